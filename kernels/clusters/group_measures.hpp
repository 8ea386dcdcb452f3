#pragma once

/// What the errors of a cluster, or of bodies that push one another, are compared with.

#include <array>
#include <cmath>

#include "kernels/clusters/step_error.hpp"

namespace talus {

/// By Cauchy and Schwarz: the most momentum [N s] in so much energy [J].
inline double most_momentum(double mass, double energy) {
  return std::sqrt(mass * energy);
}

/// What a cluster, or all of them, is measured by.
enum Measure {
  mass,
  incoming,
  gained,
  pressed,
  grains,
  energy,
  pulls,
  sums,
  drive = sums,
  fastest,
  largest,
  measures
};

using Measures = std::array<double, measures>;
constexpr RowColumns columns_of_measures{.sums = sums, .largest = measures - sums};

/// The parts of a contact's impulse that the faces across x, y and z of a cell feel: b over the edges, b from
/// one body to the other; of blocks whose flow is given, as between the spheres that hold them.
Vec3 face_shares(const BodyProblem& problem, const ContactEquation& c, const Vec3& faces);

/// Of all bodies and contacts of a problem. `faces`: ErrorGoal::faces.
Measures measures_of(const BodyProblem& problem, const Vec3& faces);

/// The momentum that errors are compared with [N s]: see step_error.hpp.
double scale_of(const Measures& row, const StepErrorThresholds& thresholds);

}  // namespace talus
