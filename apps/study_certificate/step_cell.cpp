#include "apps/study_certificate/step_cell.hpp"

#include <Eigen/LU>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "apps/study_certificate/step_problem.hpp"

namespace talus::audit {

namespace {

constexpr std::array<std::array<Eigen::Index, 2>, 6> places_of_components = {
    {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}}};

CellVector upper_components(const Mat3& m) {
  CellVector v;
  for (std::size_t k = 0; k < 6; ++k)
    v[static_cast<Eigen::Index>(k)] = m(places_of_components[k][0], places_of_components[k][1]);
  return v;
}

Mat3 upper_matrix(const CellVector& v) {
  Mat3 m = Mat3::Zero();
  for (std::size_t k = 0; k < 6; ++k)
    m(places_of_components[k][0], places_of_components[k][1]) = v[static_cast<Eigen::Index>(k)];
  return m;
}

Mat3 edges_in(const Domain& domain) {
  const PeriodicSpace& c = domain.cell;
  Mat3 h;
  h << c.xx, c.xy, c.xz, 0, c.yy, c.yz, 0, 0, c.zz;
  return h;
}

Mat3 rates_in(const Domain& domain) {
  const EdgeRates& r = domain.rates;
  Mat3 rates;
  rates << r.xx, r.xy, r.xz, 0, r.yy, r.yz, 0, 0, r.zz;
  return rates;
}

/// With unit vectors along the axes of walls, so that there is an inverse: nothing moves along them.
Mat3 with_walled_axes(Mat3 edges) {
  for (const Eigen::Index axis : {0, 1, 2})
    if (edges(axis, axis) == 0) edges(axis, axis) = 1;
  return edges;
}

/// The stress that component k aims at, `time` [s] after the beginning of a stage [Pa]; 0 where the stage
/// prescribes the flow.
double aimed_at(const StepInput& input, std::size_t stage, double time, std::size_t k) {
  const StressLoad& load = input.setup.stages[stage].stress;
  if (!load.to[k]) return 0;
  double aim = *load.to[k];
  if (time < load.ramp_time) {
    const double from = stage > 0 ? aimed_at(input, stage - 1, input.stage_times[stage - 1], k)
                                  : input.setup.stress_at_start[k];
    aim = from + (aim - from) * time / load.ramp_time;
  }
  if (load.period > 0) aim += load.amplitude[k] * std::sin(2 * std::numbers::pi * time / load.period);
  return aim;
}

/// Of the cell as the step begins; along axes of walls the distance between the planes at their ends [m^3].
double volume_of(const StepInput& input) {
  const Mat3 edges = edges_in(input.before.domain);
  double volume = 1;
  for (const Eigen::Index axis : {0, 1, 2}) {
    double low = -INFINITY, high = INFINITY;
    for (const Wall& wall : input.walls) {
      if (wall.normal[axis] > 1 - 1e-12) low = std::max(low, wall.point[axis]);
      if (wall.normal[axis] < -1 + 1e-12) high = std::min(high, wall.point[axis]);
    }
    volume *= edges(axis, axis) > 0 ? edges(axis, axis) : std::max(0.0, high - low);
  }
  return volume;
}

/// Sum of m c (x) c, c the velocities against the flow with which the step begins and against their mean [J].
Mat3 motion_of_grains(const StepInput& input, std::span<const double> masses) {
  const Frame& before = input.before;
  const Mat3 flow = rates_in(before.domain) * with_walled_axes(edges_in(before.domain)).inverse();
  std::vector<Vec3> against;
  Vec3 momentum = Vec3::Zero();
  double mass = 0;
  for (std::size_t k = 0; k < masses.size(); ++k) {
    against.push_back(before.u[k] - flow * (before.x[k] - before.domain.low));
    momentum += masses[k] * against.back();
    mass += masses[k];
  }
  Mat3 sum = Mat3::Zero();
  for (std::size_t k = 0; k < masses.size(); ++k) {
    const Vec3 c = against[k] - momentum / mass;
    sum += masses[k] * c * c.transpose();
  }
  return sum;
}

/// Mass, length and load of a cell that follows a stress; returns what it gains of the loads [1/s].
Mat3 load_cell(const StepInput& input, std::span<const double> masses, double acts, StepCell& cell) {
  double mass = 0, diameter = 0;
  for (std::size_t k = 0; k < masses.size(); ++k) {
    mass += masses[k];
    diameter += 2 * input.before.radius[k];
  }
  cell.length = diameter / static_cast<double>(std::max<std::size_t>(1, masses.size()));
  mass *= input.setup.cell_inertia;
  const CellVector motion = upper_components(motion_of_grains(input, masses));
  const double volume = volume_of(input);
  CellVector gained = CellVector::Zero();
  for (std::size_t k = 0; k < 6; ++k) {
    if (!input.stage.stress.to[k]) continue;
    const auto row = static_cast<Eigen::Index>(k);
    const double aim = aimed_at(input, input.stage_index, input.time + 0.5 * input.stage.time_step, k);
    cell.mobility[row] = 1 / mass;
    cell.load[row] = volume * aim / cell.length;
    gained[row] = acts * (motion[row] - volume * aim) / (mass * cell.length * cell.length);
  }
  return upper_matrix(gained);
}

}  // namespace

Vec3 StepCell::edges_between(const Vec3& apart) const {
  Vec3 rest = apart, k = Vec3::Zero();
  if (!repeats) return k;
  for (const Eigen::Index axis : {2, 1, 0}) {
    if (!repeats_along[static_cast<std::size_t>(axis)]) continue;
    k[axis] = std::nearbyint(rest[axis] / edges(axis, axis));
    rest -= k[axis] * edges.col(axis);
  }
  return k;
}

StepCell cell_of_step(const StepInput& input, std::span<const double> masses, double reflection) {
  StepCell cell;
  const Domain& domain = input.before.domain;
  cell.repeats = domain.repeats;
  if (!cell.repeats) return cell;
  const Stage& stage = input.stage;
  const double h = stage.time_step;
  cell.low = domain.low;
  cell.rates = rates_in(domain);
  const Mat3 now = edges_in(domain);
  for (const Eigen::Index axis : {0, 1, 2})
    cell.repeats_along[static_cast<std::size_t>(axis)] = now(axis, axis) > 0;
  cell.edges = with_walled_axes(now + 0.5 * h * cell.rates);
  cell.before = cell.rates * cell.edges.inverse();
  const Mat3 gained = load_cell(input, masses, h / (1 + reflection), cell);
  if (!domain.flows) return cell;
  Mat3 driven = stage.strain_rates.asDiagonal();
  driven(0, 1) = stage.shear_rates[0];
  driven(0, 2) = stage.shear_rates[1];
  driven(1, 2) = stage.shear_rates[2];
  cell.drive = cell.length * driven.cwiseAbs().maxCoeff();
  // dh/dt = L h at the end of the step, of edges that move as bodies do, in terms of those in its middle.
  const Mat3 end = driven * (Mat3::Identity() - 0.5 * h * driven).inverse();
  const Mat3 change = (end - cell.before) / (1 + reflection);
  for (std::size_t k = 0; k < 6; ++k) {
    const auto [a, b] = places_of_components[k];
    cell.gain(a, b) = stage.stress.to[k] ? gained(a, b) : change(a, b);
  }
  return cell;
}

Vec3 stretched(const CellVector& U, const Vec3& b) {
  return upper_matrix(U) * b;
}

CellVector push_on_cell(const Vec3& r, const Vec3& b) {
  return upper_components(r * b.transpose());
}

double cell_mobility(const StepCell& cell, const Vec3& b) {
  // What r gives along a depends on r_a alone.
  return (upper_matrix(cell.mobility) * b.cwiseAbs2()).maxCoeff();
}

CellEnd end_in_cell(const StepCell& cell, double time_step, double reflection, const Frame& before,
                    const Frame& after) {
  CellEnd end;
  const double h = time_step, E = reflection;
  // An edge that leaned over may have been replaced: the run's edges may span the same images otherwise.
  const Mat3 rates = rates_in(after.domain);
  const Mat3 middle = with_walled_axes(edges_in(after.domain) - 0.5 * h * rates);
  const Mat3 flow = (rates * middle.inverse() - cell.before) / (1 + E) - cell.gain;
  end.gained = cell.length * upper_components(flow);
  for (std::size_t k = 0; k < after.x.size(); ++k) {
    const Vec3 place = before.x[k] + 0.5 * h * before.u[k];
    const Vec3 edges = (middle.inverse() * (place + 0.5 * h * after.u[k] - after.x[k])).array().round();
    const Vec3 u = after.u[k] + rates * edges;
    end.u.push_back((u + E * before.u[k]) / (1 + E) - flow * (place - cell.low));
  }
  return end;
}

}  // namespace talus::audit
