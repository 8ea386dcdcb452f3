#pragma once

/// A cell that changes: its edges are the columns of a matrix h with dh/dt = L h, L the velocity gradient.
/// The stage prescribes its components, or the stress that they follow (docs/theory.md, "Periodic cells").

#include <vector>

#include "kernels/bodies/motion.hpp"
#include "kernels/detection/domain.hpp"

namespace talus {

/// The edges of a cell as columns [m]; 0 along axes of walls. And back: edges and what follows from them.
Mat3 edges_of(const Domain& domain);
Mat3 matrix_of(const EdgeRates& rates);
void set_edges(Domain& domain, const Mat3& edges);

/// How the flow of a cell is driven in a step.
struct CellDrive {
  Mat3 gradient = Mat3::Zero();  ///< L where it is prescribed [1/s]: upper triangular, 0 beside axes of walls
  Mat3 follows = Mat3::Zero();   ///< 1 for components that follow a stress
  Mat3 gain = Mat3::Zero();      ///< what the stress gives those in the step's impulse time [1/s]
};

/// What a cell does in a step.
struct CellFlow {
  Mat3 edges_end = Mat3::Zero();   ///< at the end of the step [m]
  EdgeRates rates_end;             ///< then [m/s]
  Mat3 before = Mat3::Zero();      ///< G with which it began, of the edges in the middle of the step [1/s]
  AffineGain gain;                 ///< of the free velocities, from V- to those that are solved for
  Mat3 edges_then = Mat3::Zero();  ///< at the last broad phase [m]
};

/// The symmetric part of a matrix less a third of its trace.
Mat3 deviator(const Mat3& m);
/// Rate of shear of a flow of gradient G, root of 2 dev D : dev D of its symmetric part [1/s]: of a simple
/// shear its rate.
double shear_rate(const Mat3& gradient);

/// Brings the domain to the middle of the step, and finds how it ends if contacts give it nothing: by the
/// trapezoidal rule, as bodies move. `reflection` E of the step.
void begin_flow(const CellDrive& drive, double time_step, double reflection, Domain& domain, CellFlow& flow);

/// G of the velocities with which a step begins, dh/dt = G h of the edges h in its middle [1/s].
Mat3 gradient_before(const Domain& domain, double time_step);

/// The contacts have given G so much more [1/s], before what E adds: `flow` ends so.
void speed_up(const Mat3& gained, double time_step, double reflection, const Domain& domain, CellFlow& flow);

/// The domain of the end of the step.
void end_flow(const CellFlow& flow, Domain& domain);

/// Where an edge leans over by more than half of another, the same images are those of one that leans less:
/// takes that one.
void upright(Domain& domain, CellFlow& flow);

/// Wraps a body in mid-step: its image goes on with the velocity of an image.
void wrap_body(const Domain& domain, Vec3& x, Velocity& velocity);

/// Which motion counts against the margin of a body: that against the homogeneous one of the cell.
class FlowMargins {
 public:
  FlowMargins(const Domain& domain, const CellFlow& flow);
  /// Speed against the cell's flow, and what two bodies gain against one another by it over `reach` [m/s].
  double speed(const Vec3& x, const Velocity& velocity, double reach) const;
  /// How far x has moved from where the flow has carried x_then since the last broad phase, and how much the
  /// strain since has changed a distance of `reach` [m].
  double moved(const Vec3& x, const Vec3& x_then, double reach) const;

 private:
  Vec3 low_;
  Mat3 gradient_, deformation_;
  double gradient_norm_, strain_norm_;
};

}  // namespace talus
