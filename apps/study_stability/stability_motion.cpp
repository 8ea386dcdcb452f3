/// Few grains in motion: flight, impact, spin, rolling, overlap.

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "apps/study_stability/stability_scenes.hpp"
#include "kernels/samples/sample.hpp"

namespace talus::stability {
namespace {

/// Of a grain [m/s]: of its centre, and R omega.
struct Motion {
  Vec3 u = Vec3::Zero(), spin = Vec3::Zero();
};

Motion motion(const Frame& frame, std::size_t k) {
  return {frame.u[k], frame.omega.empty() ? Vec3(Vec3::Zero()) : Vec3(frame.radius[k] * frame.omega[k])};
}

double largest(const Motion& a) {
  return std::max(a.u.norm(), a.spin.norm());
}

Motion difference(const Motion& a, const Motion& b) {
  return {a.u - b.u, a.spin - b.spin};
}

using Exact = std::function<Motion(const StepView&, std::size_t)>;

Motion unchanged(const StepView& step, std::size_t k) {
  Motion free = motion(step.before, k);
  free.u += step.time_step() * step.gravity();
  return free;
}

/// Velocities of all grains after each step, over what contacts change of them and g h.
Truth velocities(Exact exact) {
  return {[exact = std::move(exact), ever = 0.0](const StepView& step) mutable -> std::optional<double> {
    // Where nothing acts rounding is of the fastest, before or after; and a step that takes back what the
    // last one exchanged leaves rounding of the fastest that there ever was.
    constexpr double rounding = 1e-6, last_digit = std::numeric_limits<double>::epsilon();
    double error = 0, scale = (step.time_step() * step.gravity()).norm();
    for (std::size_t k = 0; k < step.after.u.size(); ++k) {
      const Motion should = exact(step, k), is = motion(step.after, k);
      const double fastest = std::max(largest(is), largest(motion(step.before, k)));
      ever = std::max(ever, fastest);
      error = std::max(error, largest(difference(is, should)));
      scale = std::max({scale, largest(difference(should, unchanged(step, k))), rounding * fastest});
    }
    return scale > 0 ? std::max(error - last_digit * ever, 0.0) / scale : 0;
  }};
}

void push(Velocity& velocity, const Vec3& u) {
  for (int axis = 0; axis < 3; ++axis) velocity.u[axis] = u[axis];
}

Problem one_body(bool spinning) {
  Problem made = problem(natural_dt, Vec3::Zero(), spinning ? 0.35 : 0);
  Velocity& grain = add_grain(made, Vec3::Zero(), radius, sphere_mass(radius));
  push(grain, {1, 2, 3});
  if (spinning) grain.w[2] = 1e3;
  made.steps = 100;
  made.truth = velocities(unchanged);
  return made;
}

Problem nobody() {
  Problem made = problem(natural_dt, {0, 0, -earth}, 0.35);
  add_wall(made, "floor", Vec3::Zero(), Vec3::UnitZ());
  return made;
}

/// 64 touching grains at rest, nothing acts.
Problem weightless() {
  Problem made = problem(natural_dt, Vec3::Zero(), 0.35);
  for (int k = 0; k < 64; ++k)
    add_grain(made, 2 * radius * Vec3(k % 4, k / 4 % 4, k / 16), radius, sphere_mass(radius));
  made.truth = velocities(unchanged);
  return made;
}

/// In the first step the first `flying` grains stop one another in free fall, the others lie. Momentum that
/// is wrong over that which the contacts exchange.
Truth all_stop(const Problem& of, std::size_t flying) {
  const auto wrong = [bodies = of.bodies, flying](const StepView& step) -> std::optional<double> {
    if (step.after.step > 1) return std::nullopt;
    const Vec3 fall = step.time_step() * step.gravity();
    double error = 0, exchanged = 0;
    for (std::size_t k = 0; k < bodies.size(); ++k) {  // ids count from 0: the order of frames
      const Vec3 exact = k < flying ? fall : Vec3(Vec3::Zero());
      error += bodies.mass(k) * (step.after.u[k] - exact).norm();
      exchanged += bodies.mass(k) * (step.before.u[k] + fall - exact).norm();
    }
    return error / exchanged;
  };
  return {wrong, TruthFrom::any_state, "the others begin with what is left of the impact"};
}

/// The halves of rows of touching grains run into one another, in free fall; with `lying`, a metre above one
/// grain at rest on a floor, which is all that the floor's force tells of.
Problem rows_in_flight(std::size_t rows, std::size_t count, bool lying) {
  Problem made = problem(natural_dt, {0, 0, -earth}, 0);
  for (std::size_t row = 0; row < rows; ++row)
    for (std::size_t k = 0; k < count; ++k)
      push(add_grain(made, {2 * radius * static_cast<double>(k), 3 * radius * static_cast<double>(row), 1},
                     radius, sphere_mass(radius)),
           {2 * k < count ? 1.0 : -1.0, 0, 0});
  if (lying) {
    add_wall(made, "floor", Vec3::Zero(), Vec3::UnitZ());
    add_grain(made, {0, 0, radius}, radius, sphere_mass(radius));
  }
  made.steps = 1;
  made.truth = all_stop(made, rows * count);
  return made;
}

/// Two boulders run into a pebble of a millionth of their mass between them. Far away, where nobody feels
/// them, a pebble comes down on a floor, or a boulder a third heavier than these is at rest.
Problem boulders_and_pebble(bool beside_a_floor) {
  Problem made = problem(natural_dt, Vec3::Zero(), 0.35);
  const double pebble = radius / 5, boulder = 100 * pebble, apart = boulder + pebble + pebble / 100;
  push(add_grain(made, {-apart, 0, 0}, boulder, sphere_mass(boulder)), {1, 0, 0});
  add_grain(made, Vec3::Zero(), pebble, sphere_mass(pebble));
  push(add_grain(made, {apart, 0, 0}, boulder, sphere_mass(boulder)), {-1, 0, 0});
  const double far = 100 * boulder;
  if (beside_a_floor) {
    add_wall(made, "floor", {0, 0, -2 * boulder}, Vec3::UnitZ());
    push(add_grain(made, {far, 0, pebble - 2 * boulder}, pebble, sphere_mass(pebble)), {0, 0, -1e-3});
  } else {
    add_grain(made, {far, 0, 0}, 1.1 * boulder, sphere_mass(1.1 * boulder));
  }
  made.truth = all_stop(made, made.bodies.size());
  return made;
}

/// One grain on the floor z = 0, gravity turned by `slope` about y. Exact in each step: the impulse that
/// stops the slip, but at most mu times the normal one, and what it does to the spin.
Problem on_floor(double slope, double mu, const Vec3& u, const Vec3& w, int steps) {
  Problem made = problem(natural_dt, earth * Vec3(std::sin(slope), 0, -std::cos(slope)), mu);
  add_wall(made, "floor", Vec3::Zero(), Vec3::UnitZ());
  Velocity& grain = add_grain(made, {0, 0, radius}, radius, sphere_mass(radius));
  push(grain, u);
  for (int axis = 0; axis < 3; ++axis) grain.w[axis] = w[axis];
  made.steps = steps;
  made.truth = velocities([mu](const StepView& step, std::size_t k) {
    const Vec3 n = Vec3::UnitZ();
    Motion exact = unchanged(step, k);
    const double normal = std::max(0.0, -exact.u.dot(n));  // impulses over the mass
    exact.u += normal * n;
    const Vec3 slip = exact.u - exact.spin.cross(n);
    Vec3 tangent = -2.0 / 7.0 * Vec3(slip[0], slip[1], 0);
    if (tangent.norm() > mu * normal) tangent *= mu * normal / tangent.norm();
    exact.u += tangent;
    exact.spin -= 2.5 * n.cross(tangent);
    return exact;
  });
  return made;
}

/// A grain meets another of `ratio` times its mass head on. Exact in each step: what a step leaves of the
/// approach, the next one stops.
Problem impact(double ratio, double e) {
  Problem made = problem(natural_dt, Vec3::Zero(), 0.35);
  stage(made).laws.set_all(&PairLaw::restitution, e);
  const double m = sphere_mass(radius);
  push(add_grain(made, {-0.999 * radius, 0, 0}, radius, m), {1, 0, 0});
  add_grain(made, {0.999 * radius, 0, 0}, radius, ratio * m);
  made.truth = velocities([=](const StepView& step, std::size_t k) {
    Motion exact = unchanged(step, k);
    const double approach = std::max(0.0, step.before.u[0][0] - step.before.u[1][0]);
    exact.u[0] += (1 + e) * approach * (k == 0 ? -ratio : 1) / (1 + ratio);
    return exact;
  });
  return made;
}

/// A grain that crosses 20 of its radii in a step, towards a wall or another grain that comes as fast. It
/// must be stopped and not end behind: error = the way gone too far over the way of a step.
Problem bullet(bool at_wall, double distance) {
  Problem made = problem(natural_dt, Vec3::Zero(), 0);
  const double speed = 20 * radius / natural_dt;
  push(add_grain(made, {0, 0, radius + distance}, radius, sphere_mass(radius)), {0, 0, -speed});
  if (at_wall)
    add_wall(made, "wall", Vec3::Zero(), Vec3::UnitZ());
  else
    push(add_grain(made, {0, 0, -radius - distance}, radius, sphere_mass(radius)), {0, 0, speed});
  made.steps = 4;
  made.truth = {[speed](const StepView& step) -> std::optional<double> {
                  return std::max(0.0, radius - step.after.x[0][2]) / (step.time_step() * speed);
                },
                TruthFrom::certified};
  return made;
}

/// Grains at the given distance of centres, at rest: what a step undoes of the overlap is no motion.
Problem overlap(double distance, double correction) {
  Problem made = problem(natural_dt, Vec3::Zero(), 0.35);
  made.setup.solver.overlap_correction = correction;
  for (int side : {-1, 1}) add_grain(made, {0, 0, side * distance / 2}, radius, sphere_mass(radius));
  made.truth = velocities(unchanged);
  return made;
}

/// Three grains at one place on the floor, under gravity.
Problem coincident_on_floor() {
  Problem made = problem(natural_dt, {0, 0, -earth}, 0.35);
  add_wall(made, "floor", Vec3::Zero(), Vec3::UnitZ());
  for (int k = 0; k < 3; ++k) add_grain(made, {0, 0, radius}, radius, sphere_mass(radius));
  made.truth = wall_forces({{0, 0, 3 * earth * sphere_mass(radius)}});
  return made;
}

/// 200 grains in a box where 25 have room.
Problem crowd(double correction) {
  Problem made = problem(natural_dt, Vec3::Zero(), 0.35);
  made.setup.solver.overlap_correction = correction;
  // Velocities are asked for: 200 grains are pushed about in the room of 27, from one overlap into another.
  made.setup.solver.overlap_tolerance = 2;
  const double edge = 6 * radius;
  add_box(made, Vec3::Constant(edge));
  const std::vector<double> places =
      draw_radii({.kind = SizeDistribution::Kind::uniform, .min = radius, .max = edge - radius}, 600, 7);
  for (std::size_t k = 0; k < 200; ++k)
    add_grain(made, {places[3 * k], places[3 * k + 1], places[3 * k + 2]}, radius, sphere_mass(radius));
  made.steps = 10;
  made.truth = velocities(unchanged);
  return made;
}

/// Elastic grains fly about in a box: their energy stays.
Problem gas() {
  Problem made = problem(natural_dt, Vec3::Zero(), 0);
  stage(made).laws.set_all(&PairLaw::restitution, 1);
  constexpr int n = 5;
  add_box(made, Vec3::Constant(4 * radius * n));
  const std::vector<double> speeds =
      draw_radii({.kind = SizeDistribution::Kind::uniform, .min = 1, .max = 3}, 3 * n * n * n, 3);
  for (std::size_t k = 0; k < n * n * n; ++k) {
    const Vec3 cell(static_cast<double>(k % n), static_cast<double>(k / n % n),
                    static_cast<double>(k / n / n));
    push(add_grain(made, 4 * radius * (cell + Vec3::Constant(0.5)), radius, sphere_mass(radius)),
         Vec3(speeds[3 * k], speeds[3 * k + 1], speeds[3 * k + 2]) - Vec3::Constant(2));
  }
  made.steps = 300;
  made.truth = {[](const StepView& step) -> std::optional<double> {
    double before = 0, after = 0;
    for (const Vec3& u : step.before.u) before += u.squaredNorm();
    for (const Vec3& u : step.after.u) after += u.squaredNorm();
    return std::abs(after - before) / before;
  }};
  return made;
}

}  // namespace

void add_motion(std::vector<Scene>& table) {
  using enum Verdict;
  table.push_back(
      {"one-body", "a grain alone without gravity keeps its velocity", [] { return one_body(false); }});
  table.push_back({"one-body-spinning", "the same at 20,000 rad/s", [] { return one_body(true); }});
  table.push_back({"no-body", "walls only", nobody, {certified}});
  table.push_back({"no-gravity", "64 touching grains at rest stay there", weightless});
  table.push_back(
      {"rest", "one grain on the floor", [] { return on_floor(0, 0.35, Vec3::Zero(), Vec3::Zero(), 20); }});
  for (const bool lying : {false, true})
    table.push_back({lying ? "row-1000-above-a-grain" : "row-1000",
                     lying ? "the same, above a grain on a floor that feels nothing of it"
                           : "the halves of a row in free fall run into one another: all stop",
                     [lying] { return rows_in_flight(1, 1000, lying); }});
  table.push_back(
      {"rows-100x50", "a hundred such rows side by side", [] { return rows_in_flight(100, 50, false); }});
  for (const bool floor : {true, false})
    table.push_back({floor ? "boulders-pebble-floor" : "boulders-pebble-rattler",
                     floor ? "boulders run into a pebble between them, far from one that lies: all stop"
                           : "the same, far from a free boulder that is a third heavier",
                     [floor] { return boulders_and_pebble(floor); },
                     {right, certified, honest}});
  for (double spin : {1e1, 1e5})
    table.push_back({fmt::format("spin-{:.0e}", spin), "a grain set down spinning at so many rad/s", [spin] {
                       return on_floor(0, 0.35, Vec3::Zero(), Vec3(0, spin * radius, spin * radius), 50);
                     }});
  table.push_back({"skid", "a grain set down at 1 km/s slides to rolling", [] {
                     return on_floor(0, 0.35, {1e3, 0, 0}, Vec3::Zero(), 50);
                   }});
  for (double mu : {0.0, 0.1, 10.0})
    table.push_back({fmt::format("slope-friction-{}", mu), "a grain slides or rolls down a slope of 0.5 rad",
                     [mu] { return on_floor(0.5, mu, Vec3::Zero(), Vec3::Zero(), 50); }});
  for (double ratio : {1.0, 1e8})
    for (double e : {0.0, 1.0})
      table.push_back({fmt::format("impact-{:.0e}-restitution-{}", ratio, e),
                       "head-on impact on a grain of so many times the mass",
                       [=] { return impact(ratio, e); }});
  for (double distance : {2.0, 5.0, 9.0})
    for (bool wall : {true, false})
      table.push_back({fmt::format("fast-{}-{}", wall ? "wall" : "grains", distance),
                       "20 radii a step, so many radii before the impact: nothing may pass through",
                       [=] { return bullet(wall, distance * radius); },
                       {right, honest}});
  for (double correction : {0.0, 0.2})
    table.push_back({fmt::format("overlap-half-correction-{}", correction),
                     "two grains begin half inside each other: nothing may move",
                     [correction] { return overlap(radius, correction); }});
  table.push_back({"overlap-coincident", "two grains begin at one place: nothing may move",
                   [] { return overlap(0, 0); }});
  table.push_back(
      {"overlap-coincident-correction", "the same, undone by 0.2 a step", [] { return overlap(0, 0.2); }});
  table.push_back(
      {"overlap-coincident-floor", "three grains at one place on the floor: its force", coincident_on_floor});
  table.push_back(
      {"overlap-crowd", "200 grains where 25 have room: nothing may move", [] { return crowd(0); }});
  table.push_back({"overlap-crowd-correction", "the same, undone by 0.2 a step", [] { return crowd(0.2); }});
  table.push_back({"gas-elastic", "125 elastic grains in a box, 300 steps: energy of each step", gas});
}

}  // namespace talus::stability
