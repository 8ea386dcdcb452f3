/// How the error falls with the time step, and what units do not change.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "tests/validation/experiment.hpp"

namespace talus::validation::closed_form_order_test {
namespace {

/// Mean order over the halvings of a list of errors.
double mean_order(const std::vector<double>& errors) {
  return std::log2(errors.front() / errors.back()) / static_cast<double>(errors.size() - 1);
}

void record(const char* what, const std::vector<double>& errors) {
  for (std::size_t k = 0; k < errors.size(); ++k)
    ::testing::Test::RecordProperty(std::string(what) + std::to_string(k), fmt::format("{:.3e}", errors[k]));
}

/// A grain slides or rolls down a boulder so heavy that it does not recoil, from rest at an angle of 0.2 from
/// the top. Largest relative error of its speed against its loss of height: sliding 1/2 v^2, rolling 7/10
/// v^2.
double boulder_error(double h, double mu) {
  const double boulder = 1.0, grain = 0.2, start = 0.2, arm = boulder + grain;
  Scene scene(h);
  scene.slope(0);
  scene.friction(mu);
  scene.sphere({0, 0, boulder}, boulder, 1e12);
  scene.sphere({arm * std::sin(start), 0, boulder + arm * std::cos(start)}, grain, 1.0);
  Experiment run(std::move(scene));
  double worst = 0;
  while (run.time() < 0.8 - 1e-9) {
    run.step();
    const double fall = std::cos(start) - (run.x(1)[2] - run.x(0)[2]) / arm;
    const double inertia = mu > 0 ? 7.0 / 5 : 1.0;
    const double speed = std::sqrt(std::max(0.0, 2 * g_earth * arm * fall / inertia));
    if (run.time() > 0.1) worst = std::max(worst, std::abs(run.u(1).norm() - speed) / speed);
  }
  return worst;
}

TEST(Order, GrainOnABoulderIsAtLeastOfFirstOrder) {
  for (double mu : {0.0, 5.0}) {
    std::vector<double> errors;
    for (double h : {4e-3, 2e-3, 1e-3, 5e-4}) errors.push_back(boulder_error(h, mu));
    record(mu > 0 ? "rolling_" : "sliding_", errors);
    for (std::size_t k = 1; k < errors.size(); ++k)
      EXPECT_GE(errors[k - 1] / errors[k], 1.8) << "mu = " << mu;
    EXPECT_GE(mean_order(errors), 0.9) << "mu = " << mu;
    EXPECT_LE(errors.back(), 1e-2);
  }
}

/// A grain slides around in a tube, without weight or friction: relative loss of its speed in 0.5 s.
double loss_in_tube(double h, double rate) {
  const double tube = 0.1, grain = 0.01, path = tube - grain;
  Scene scene(h);
  scene.surface("cylinder", {{"start", {0, -1, 0}}, {"end", {0, 1, 0}}, {"radius", {tube}}, {"inside", {1}}});
  scene.sphere({0, 0, -path}, grain, 1, {rate * path, 0, 0});
  Experiment run(std::move(scene));
  while (run.time() < 0.5 - 1e-9) run.step();
  return 1 - run.u().norm() / (rate * path);
}

TEST(Order, AlongAHollowCurveIsOneAndActsAsFriction) {
  for (const double rate : {5.0, 10.0})
    for (const double h : {2e-4, 1e-4, 5e-5})
      EXPECT_NEAR(loss_in_tube(h, rate), 0.5 * rate * rate * h * 0.5, 0.02 * 0.25 * rate * rate * h) << h;
}

/// Errors for four time steps. An event is met within a step, at a place in it that is as good as random: so
/// the error is averaged over 64 starts.
template <class Error>
std::vector<double> averaged(Error error) {
  std::vector<double> errors;
  for (double h : {4e-3, 2e-3, 1e-3, 5e-4}) {
    double sum = 0;
    for (int start = 0; start < 64; ++start) sum += error(h, start);
    errors.push_back(sum / 64);
  }
  return errors;
}

TEST(Order, OfAnImpactsTimeIsOne) {
  const auto errors = averaged([](double h, int start) {
    const double height = 0.3 + 0.0031 * start, e = 0.7, lands = std::sqrt(2 * height / g_earth);
    Scene scene(h);
    scene.slope(0);
    scene.stage().laws.set_all(&PairLaw::restitution, e);
    scene.sphere({0, 0, 0.1 + height}, 0.1, 1.0);
    Experiment run(std::move(scene));
    const double until = lands * 1.4;
    while (run.time() < until - 0.5 * h) run.step();
    const double flown = run.time() - lands, v = e * g_earth * lands;
    return std::abs(run.x()[2] - 0.1 - (v * flown - 0.5 * g_earth * flown * flown));
  });
  record("impact_", errors);
  EXPECT_GE(mean_order(errors), 0.9);
}

TEST(Order, OfTheTurnFromSlidingToRollingIsOneOrBetter) {
  const auto errors = averaged([](double h, int start) {
    const double v_0 = 1.5 + 0.013 * start, mu = 0.25, rolls = 2 * v_0 / (7 * mu * g_earth);
    Scene scene(h);
    scene.slope(0);
    scene.friction(mu);
    scene.sphere({0, 0, 0.1}, 0.1, 1.0, {v_0, 0, 0});
    Experiment run(std::move(scene));
    while (run.time() < 1 - 0.5 * h) run.step();
    const double path =
        v_0 * rolls - 0.5 * mu * g_earth * rolls * rolls + 5.0 / 7 * v_0 * (run.time() - rolls);
    return std::abs(run.x()[0] - path);
  });
  record("turn_", errors);
  EXPECT_GE(mean_order(errors), 0.9);
}

/// Grains that fall on one another into a corner, with friction and restitution, in units of `length` m,
/// `mass` kg and `time` s.
Scene corner(double length, double mass, double time, double restitution) {
  Scene scene(1e-3 * time);
  const double acceleration = length / (time * time);
  scene.wall("floor", Vec3::Zero(), Vec3::UnitZ());
  scene.wall("left", Vec3(-0.3, 0, 0) * length, Vec3::UnitX());
  scene.wall("right", Vec3(0.3, 0, 0) * length, -Vec3::UnitX());
  Wall& lid = scene.wall("lid", Vec3(0, 0, 1.0) * length, -Vec3::UnitZ());
  lid.load = {.drive = WallDrive::force, .force = 3 * mass * acceleration, .mass = 2 * mass};
  scene.stage().gravity = Vec3(0.5, 0.1, -9.81) * acceleration;
  scene.stage().laws.set_all(&PairLaw::restitution, restitution);
  scene.friction(0.3);
  for (int k = 0; k < 12; ++k) {
    const Vec3 centre(-0.2 + 0.19 * (k % 3), 0.02 * (k % 2), 0.11 + 0.19 * (k / 3));
    scene.sphere(centre * length, 0.09 * length, (1 + 0.1 * k) * mass, Vec3(0.3, 0, -1) * length / time);
  }
  return scene;
}

TEST(Units, PowersOfTwoChangeNoBit) {
  // Every operation of the step is homogeneous, and powers of two do not round: one absolute constant of
  // length, mass or time anywhere, and this fails.
  Experiment one(corner(1, 1, 1, 0.4));
  one.steps(400);
  struct Units {
    double length, mass, time;
  };
  for (const Units& unit :
       {Units{0x1p-20, 1, 1}, Units{0x1p20, 1, 1}, Units{1, 0x1p-20, 1}, Units{1, 0x1p20, 1},
        Units{1, 1, 0x1p-20}, Units{1, 1, 0x1p20}, Units{0x1p-20, 0x1p-40, 0x1p-10}}) {
    Experiment other(corner(unit.length, unit.mass, unit.time, 0.4));
    other.steps(400);
    for (int id = 0; id < 12; ++id) {
      EXPECT_EQ(other.x(id) / unit.length, one.x(id)) << id;
      EXPECT_EQ(other.u(id) * (unit.time / unit.length), one.u(id)) << id;
      EXPECT_EQ(other.w(id) * (unit.time / unit.length), one.w(id)) << id;
    }
    EXPECT_EQ(other.simulation().report().iterations, one.simulation().report().iterations);
    EXPECT_EQ(other.simulation().report().error_rms, one.simulation().report().error_rms);
  }
}

TEST(Units, AMillionOrAMillionthGivesTheSameAnswer) {
  // Inelastic: with restitution the law jumps at gap 0, where one rounding decides about a step.
  Experiment one(corner(1, 1, 1, 0));
  one.steps(150);
  for (double length : {1e-6, 1.0, 1e6})
    for (double mass : {1e-6, 1e6})
      for (double time : {1e-6, 1e6}) {
        Experiment other(corner(length, mass, time, 0));
        other.steps(150);
        for (int id = 0; id < 12; ++id)
          EXPECT_LE((other.x(id) / length - one.x(id)).norm(), 1e-9) << length << ' ' << mass << ' ' << time;
      }
}

}  // namespace
}  // namespace talus::validation::closed_form_order_test
