#pragma once

/// What the errors of a cluster, or of bodies that push one another, are compared with.

#include <array>

#include "kernels/clusters/step_error_goal.hpp"
#include "kernels/global/momentum_scale.hpp"

namespace talus {

/// What a cluster, or all of them, is measured by.
struct MeasureColumn {
  enum : std::size_t {
    mass,      ///< [kg]
    incoming,  ///< twice the kinetic energy without contacts [J]
    gained,    ///< momentum that the contacts give [N s]
    pressed,   ///< impulses at walls and faces [N s]
    grains,    ///< mass of those that are grains [kg]
    energy,    ///< kinetic, of what grains gain [J]
    pulls,     ///< impulses that cohesion bears [N s]
    sums,
    drive = sums,  ///< fastest that a wall or flow drives a contact that carries [m/s]
    fastest,       ///< largest velocity that a gap or restitution asks for [m/s]
    largest,       ///< largest impulse of a contact [N s]
    width
  };
};

using Measures = std::array<double, MeasureColumn::width>;
constexpr RowColumns columns_of_measures{.sums = MeasureColumn::sums,
                                         .largest = MeasureColumn::width - MeasureColumn::sums};

/// The parts of a contact's impulse that the faces across x, y and z of a cell feel: b over the edges, b from
/// one body to the other; of blocks whose flow is given, as between the spheres that hold them.
Vec3 face_shares(const BodyProblem& problem, const ContactEquation& c, const Vec3& faces);

/// Of all bodies and contacts of a problem. `faces`: ErrorGoal::faces.
Measures measures_of(const BodyProblem& problem, const Vec3& faces);

/// The momentum that errors are compared with [N s]: see step_error.hpp.
double scale_of(const Measures& row, const StepErrorThresholds& thresholds);

}  // namespace talus
