#include "runtime/step/cell_flow.hpp"

#include <Eigen/LU>
#include <cmath>

#include "kernels/bodies/cell_velocity.hpp"

namespace talus {

namespace {

/// Columns along axes of walls are unit vectors, so that the matrix has an inverse: nothing moves along them.
Mat3 invertible(Mat3 edges) {
  for (const Eigen::Index axis : {0, 1, 2})
    if (edges(axis, axis) == 0) edges(axis, axis) = 1;
  return edges;
}

EdgeRates rates_of(const Mat3& m) {
  const auto [xx, yy, zz, xy, xz, yz] = components_of(m);
  return {xx, yy, zz, xy, xz, yz};
}

}  // namespace

Mat3 edges_of(const Domain& domain) {
  const PeriodicSpace& c = domain.cell;
  return matrix_of({c.xx, c.yy, c.zz, c.xy, c.xz, c.yz});
}

Mat3 matrix_of(const EdgeRates& r) {
  return gradient_of({r.xx, r.yy, r.zz, r.xy, r.xz, r.yz}, 1);
}

Mat3 deviator(const Mat3& m) {
  const Mat3 even = 0.5 * (m + m.transpose());
  return even - even.trace() / 3 * Mat3::Identity();
}

double shear_rate(const Mat3& gradient) {
  return std::sqrt(2.0) * deviator(gradient).norm();
}

void set_edges(Domain& domain, const Mat3& h) {
  const auto inverse = [](double edge) { return edge > 0 ? 1 / edge : 0; };
  domain.cell = {h(0, 0), h(1, 1),          h(2, 2),          h(0, 1),         h(0, 2),
                 h(1, 2), inverse(h(0, 0)), inverse(h(1, 1)), inverse(h(2, 2))};
}

namespace {

Mat3 edges_in_middle(const Domain& domain, double time_step) {
  return edges_of(domain) + 0.5 * time_step * matrix_of(domain.rates);
}

}  // namespace

Mat3 gradient_before(const Domain& domain, double time_step) {
  return matrix_of(domain.rates) * invertible(edges_in_middle(domain, time_step)).inverse();
}

void begin_flow(const CellDrive& drive, double time_step, double reflection, Domain& domain, CellFlow& flow) {
  const Mat3 rates = matrix_of(domain.rates), middle = edges_in_middle(domain, time_step);
  const Mat3 &gradient = drive.gradient, to_end = (Mat3::Identity() - 0.5 * time_step * gradient).inverse();
  flow.before = gradient_before(domain, time_step);
  flow.edges_end = to_end * middle;
  Mat3 rates_end = gradient * flow.edges_end;
  if (!drive.follows.isZero(0)) {
    const Mat3 prescribed = gradient * to_end;
    const auto follow = drive.follows.array();
    const Mat3 end = (follow > 0).select(flow.before + (1 + reflection) * drive.gain, prescribed);
    rates_end = end * middle;
    flow.edges_end = middle + 0.5 * time_step * rates_end;
  }
  const Mat3 change = (rates_end - rates) / (1 + reflection);
  flow.rates_end = rates_of(rates_end);
  flow.gain = {change * invertible(middle).inverse(), domain.low};
  domain.drift_rates = rates_of(rates + change);
  set_edges(domain, middle);
}

void speed_up(const Mat3& gained, double time_step, double reflection, const Domain& domain, CellFlow& flow) {
  const Mat3 middle = edges_of(domain);
  flow.gain.gradient += gained;
  const Mat3 rates_end = (flow.before + (1 + reflection) * flow.gain.gradient) * middle;
  flow.rates_end = rates_of(rates_end);
  flow.edges_end = middle + 0.5 * time_step * rates_end;
}

void end_flow(const CellFlow& flow, Domain& domain) {
  set_edges(domain, flow.edges_end);
  domain.rates = flow.rates_end;
}

void upright(Domain& domain, CellFlow& flow) {
  // By how many edges another one leans: column `of` loses so many of column `by`.
  const auto take = [&](Eigen::Index of, Eigen::Index by) {
    const Mat3 edges = edges_of(domain);
    const double turns = edges(by, by) > 0 ? nearest_integer(edges(by, of) / edges(by, by)) : 0;
    if (turns == 0) return;
    const auto taken = [&](Mat3 m) {
      m.col(of) -= turns * m.col(by);
      return m;
    };
    set_edges(domain, taken(edges));
    flow.edges_end = taken(flow.edges_end);
    for (EdgeRates* rates : {&domain.rates, &domain.drift_rates, &flow.rates_end})
      *rates = rates_of(taken(matrix_of(*rates)));
  };
  take(2, 1);
  take(2, 0);
  take(1, 0);
}

void wrap_body(const Domain& domain, Vec3& x, Velocity& velocity) {
  const Vec3 beyond = domain.edges_beyond(x);
  if (beyond == Vec3::Zero()) return;
  x = domain.wrap(x);
  Eigen::Map<Vec3>(velocity.u) -= Domain::times(domain.rates, beyond);
}

FlowMargins::FlowMargins(const Domain& domain, const CellFlow& flow) : low_(domain.low) {
  const Mat3 now = invertible(edges_of(domain));
  gradient_ = matrix_of(domain.rates) * now.inverse();
  deformation_ = now * invertible(flow.edges_then).inverse();
  gradient_norm_ = gradient_.norm();
  strain_norm_ = (deformation_ - Mat3::Identity()).norm();
}

double FlowMargins::speed(const Vec3& x, const Velocity& velocity, double reach) const {
  return (Eigen::Map<const Vec3>(velocity.u) - gradient_ * (x - low_)).norm() + gradient_norm_ * reach;
}

double FlowMargins::moved(const Vec3& x, const Vec3& x_then, double reach) const {
  return (x - low_ - deformation_ * (x_then - low_)).norm() + strain_norm_ * reach;
}

}  // namespace talus
