#pragma once

/// The periodic cell of a step, made anew from the state before it and the formulas of docs/theory.md,
/// "Periodic cells" and "Cells under stress". Where components of its flow follow a stress it is one more
/// body of the contact problem. Nothing here comes from what moves the run's cell
/// (runtime/step/cell_flow.hpp).

#include <array>
#include <span>
#include <vector>

#include "runtime/step/frame.hpp"
#include "runtime/step/setup.hpp"

namespace talus::audit {

struct StepInput;

/// Components xx, yy, zz, xy, xz, yz of an upper triangular matrix. Of a flow in m/s: d times its gradient.
using CellVector = Eigen::Matrix<double, 6, 1>;

/// The cell in the middle of the step; columns of matrices belong to its edges, unit vectors and 0 along axes
/// of walls.
struct StepCell {
  bool repeats = false;                 ///< there is a cell
  std::array<bool, 3> repeats_along{};  ///< x, y, z
  Vec3 low = Vec3::Zero();              ///< [m] its corner, which does not move
  Mat3 edges = Mat3::Identity();        ///< [m]
  Mat3 rates = Mat3::Zero();            ///< of the edges before the step [m/s]
  Mat3 before = Mat3::Zero();           ///< G- [1/s]: rates = G- edges
  Mat3 gain = Mat3::Zero();             ///< what G gains without contacts in the velocities solved for [1/s]
  double drive = 0;                     ///< d times the flow that is prescribed, its largest component [m/s]
  double length = 1;                    ///< d [m], mean diameter
  CellVector mobility = CellVector::Zero();  ///< 1/M [1/kg]; 0 of components without a stress
  CellVector load = CellVector::Zero();      ///< V sigma/d [N]; 0 likewise

  bool follows() const { return !mobility.isZero(0); }  ///< some component follows a stress
  /// How many edges the image of a point that is nearest to another one stands away from it, of their
  /// difference `apart` [m] in the middle of the step.
  Vec3 edges_between(const Vec3& apart) const;
};

/// `masses` of the grains in the order of the frame [kg]; `reflection` E of Moreau's law.
StepCell cell_of_step(const StepInput& input, std::span<const double> masses, double reflection);

/// Velocity that U gives to a contact whose branch over d is `b`, U b [m/s]: of U = d G upper triangular.
Vec3 stretched(const CellVector& U, const Vec3& b);

/// Momentum that an impulse gives to the cell, components of r (x) b: the transpose of `stretched` [N s].
CellVector push_on_cell(const Vec3& r, const Vec3& b);

/// The largest that the cell adds to the inverse mass of a contact along any direction [1/kg].
double cell_mobility(const StepCell& cell, const Vec3& b);

/// The end of a step as the run tells it, in the terms of the problem: velocities `u` of the images that the
/// problem has, without what the contacts have given the cell, and that apart as U. Of mean velocities where
/// E > 0.
struct CellEnd {
  std::vector<Vec3> u;                     ///< [m/s]
  CellVector gained = CellVector::Zero();  ///< U [m/s]
};
CellEnd end_in_cell(const StepCell& cell, double time_step, double reflection, const Frame& before,
                    const Frame& after);

}  // namespace talus::audit
