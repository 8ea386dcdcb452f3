/// Overlaps that a step undoes behind its velocities.

#include "runtime/step/position_correction.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "kernels/shapes/clump_motion.hpp"
#include "runtime/graph/one_rank.hpp"
#include "runtime/step/simulation.hpp"
#include "tests/unit/runtime/step/loose_scenes.hpp"

namespace talus::position_correction_test {
namespace {

using namespace simulation_test;

/// A free row, and one that stands at a wall: what opens its overlaps is no motion.
TEST(PositionCorrection, PartsGrainsAndGivesThemNoVelocity) {
  for (const bool wall : {false, true})
    for (const double mu : {0.0, 0.3}) {
      talus::Setup setup;
      if (wall) setup.walls = {box(1, 1, 1).front()};
      Bodies row;
      for (int k = 0; k < 10; ++k)
        add_sphere(row, BodyId{k}, radius * Vec3(0.99 * (2 * k + 1), 0, 0), radius, density);
      setup.stages = {stage("release", 20)};
      setup.stages[0].laws.set_all(&PairLaw::friction, mu);
      setup.solver.overlap_correction = 0.5;
      graph::Executor executor({.threads = 1});
      Simulation simulation(setup, row, executor);
      for (int k = 0; k < 20; ++k) {
        const StepReport& report = simulation.step();
        EXPECT_TRUE(report.converged);
        EXPECT_EQ(report.kinetic_translation + report.kinetic_rotation, 0);
        for (const double r : simulation.state().candidates.impulse.values()) EXPECT_EQ(r, 0);
      }
      const double at_first = 0.02;  // of a radius
      EXPECT_LT(simulation.report().penetration_max, 0.02 * at_first) << "wall " << wall << ", mu " << mu;
    }
}

/// A ball flies into another, or into a wall, as a run begins: in mid-step, when they are found, they are in
/// one another by 0.4 radii. With e = 1 they are apart again at the end of the step, and there is nothing to
/// undo; with e = 1/2 they are in by 0.15 radii, of which two balls take half each.
TEST(PositionCorrection, LeavesAloneWhatTheStepOpens) {
  for (const bool wall : {false, true})
    for (const double e : {0.5, 1.0}) {
      std::vector<Vec3> ends;
      for (const double part : {0.0, 1.0}) {
        talus::Setup setup;
        if (wall) setup.walls = {box(1, 1, 1).front()};
        Bodies balls;
        add_sphere(balls, BodyId{0}, Vec3(1.1 * radius, 0, 0), radius, density);
        balls.velocity[0].u[0] = -10;
        if (!wall) add_sphere(balls, BodyId{1}, Vec3(-radius, 0, 0), radius, density);
        setup.stages = {stage("hit", 2)};
        setup.stages[0].laws.set_all(&PairLaw::restitution, e);
        setup.solver.overlap_correction = part;
        graph::Executor executor({.threads = 1});
        Simulation simulation(setup, balls, executor);
        for (int k = 0; k < 2; ++k) simulation.step();
        ends.push_back(simulation.state().bodies.x[0]);
      }
      const double undone = e == 1 ? 0 : wall ? 0.15 : 0.075;
      EXPECT_NEAR((ends[1] - ends[0]).norm(), undone * radius, 1e-6 * radius)
          << "wall " << wall << ", e " << e;
    }
}

/// A dumbbell falls on a floor with one ball and turns out of it again within the step.
TEST(PositionCorrection, LeavesAloneWhatATurnOpens) {
  const std::array balls{Ball{{-1, 0, 0}, 1}, Ball{{1, 0, 0}, 1}};
  const PlacedClump placed = make_clump(balls);
  std::vector<Vec3> ends;
  for (const double part : {0.0, 1.0}) {
    talus::Setup setup;
    setup.walls = {box(1, 1, 1)[4]};
    setup.clumps = {placed.clump};
    Bodies body;
    const double tilt = 0.9, r = radius / 2;
    add_clump(body, setup.clumps, 1, BodyId{0},
              {.centre = Vec3(0, 0, r * (1 + std::sin(tilt)) + 2e-4),
               .orientation = {std::cos(tilt / 2), 0, std::sin(tilt / 2), 0},
               .radius = radius,
               .density = density,
               .u = Vec3(0, 0, -4),
               .omega = Vec3::Zero()});
    setup.stages = {stage("hit", 1)};
    setup.stages[0].laws.set_all(&PairLaw::restitution, 1);
    setup.detection.alert = 1e-6;
    setup.solver.overlap_correction = part;
    graph::Executor executor({.threads = 1});
    Simulation simulation(setup, body, executor);
    EXPECT_EQ(simulation.step().overlap, 0) << part;
    EXPECT_GT(simulation.report().contacts, 0);
    ends.push_back(simulation.state().bodies.x[0]);
  }
  EXPECT_LT((ends[1] - ends[0]).norm(), 1e-9 * radius);
}

/// A grain leaves the row that it overlaps. Its overlap has pushed the whole row a little, step by step; the
/// row would go on by these pushes for many steps, as ten sweeps hardly take them away.
TEST(PositionCorrection, StopsPushingARowWhenAnOverlapHasOpenedByItself) {
  constexpr int count = 30;
  constexpr double deep = 0.01 * radius, part = 0.01;
  talus::Setup setup;
  setup.stages = {stage("leave", 20)};
  setup.solver.overlap_correction = part;
  Bodies row;
  add_sphere(row, BodyId{0}, Vec3(-deep, 0, 0), radius, density);
  for (int k = 1; k < count; ++k) add_sphere(row, BodyId{k}, Vec3(-2 * radius * k, 0, 0), radius, density);
  row.velocity[0].u[0] = deep / (9.5 * setup.stages[0].time_step);
  graph::Executor executor({.threads = 1});
  Simulation simulation(setup, row, executor);
  std::vector<double> moved;  // by each step, of what has moved farthest but the one that leaves
  for (int step = 1; step <= 14; ++step) {
    const Frame before = simulation.frame(false), after = (simulation.step(), simulation.frame(false));
    moved.push_back(0);
    for (std::size_t k = 1; k < before.x.size(); ++k)
      moved.back() = std::max(moved.back(), (after.x[k] - before.x[k]).norm());
  }
  EXPECT_GT(moved[0], 0.1 * part * deep);
  for (std::size_t step = 10; step < moved.size(); ++step)
    EXPECT_LT(moved[step], 0.04 * moved[0]) << "step " << step + 1;
}

}  // namespace
}  // namespace talus::position_correction_test
