#include "runtime/step/overlap.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <mutex>

#include "runtime/graph/pretend_ranks.hpp"
#include "runtime/step/simulation.hpp"
#include "tests/unit/dense_sample.hpp"

namespace talus::overlap_test {
namespace {

constexpr double radius = 0.01, density = 2600, h = 1e-3;

talus::Setup without_walls(std::int64_t steps, double restitution) {
  talus::Setup setup;
  Stage& stage = setup.stages.emplace_back();
  stage.name = "all";
  stage.time_step = h;
  stage.laws = laws_of_one_material(0, 0, restitution);
  stage.end.steps = steps;
  return setup;
}

talus::Setup above_floor(std::int64_t steps, double restitution) {
  talus::Setup setup = without_walls(steps, restitution);
  Wall& floor = setup.walls.emplace_back();
  floor.name = "floor";
  floor.normal = Vec3::UnitZ();
  return setup;
}

void add_ball(Bodies& bodies, const Vec3& x, const Vec3& u) {
  add_sphere(bodies, BodyId{static_cast<std::int64_t>(bodies.size()) + 7}, x, radius, density);
  for (int axis = 0; axis < 3; ++axis) bodies.velocity.back().u[axis] = u[axis];
}

std::vector<StepReport> reports_of(const talus::Setup& setup, Bodies bodies) {
  graph::Executor executor({});
  Simulation simulation(setup, std::move(bodies), executor);
  std::vector<StepReport> reports;
  for (; !simulation.finished(); simulation.begin_next_stage()) reports.push_back(simulation.step());
  return reports;
}

// A ball that touches the floor at 2.2 m/s as the run begins is in by 0.11 radii in the middle of the first
// step, where its impact is found: the position is wrong though velocity and force are exact. Steps miss
// until it is out again, and name ball and wall.
TEST(Overlap, OfAStepThatIsTooLongIsMissedAndNamed) {
  Bodies bodies;
  add_ball(bodies, Vec3(0, 0, radius), Vec3(0, 0, -2.2));
  const std::vector<StepReport> reports = reports_of(above_floor(12, 0.1), bodies);
  double height = radius - h / 2 * 2.2 + h / 2 * 0.22;
  for (std::size_t k = 0; k < reports.size(); ++k, height += h * 0.22) {
    const double overlap = std::max(0.0, 1 - height / radius);
    SCOPED_TRACE(k);
    EXPECT_NEAR(reports[k].overlap, overlap, 1e-12);
    EXPECT_LE(reports[k].error_rms, 1e-12);
    EXPECT_EQ(reports[k].converged, overlap <= 0.05);
    ASSERT_EQ(reports[k].overlapping.has_value(), overlap > 0.05);
    if (overlap > 0.05) {
      EXPECT_EQ(*reports[k].overlapping, (BodyPair{7, -1}));
    }
  }
  EXPECT_TRUE(reports.back().converged);
}

// Two balls that would meet within a step rebound in it, wherever they are: no step is too long for that.
TEST(Overlap, IsNoneWhereTwoMeet) {
  for (const double e : {0.0, 0.1, 0.5, 1.0})
    for (const double x : {2.21, 2.25, 2.3, 2.4}) {
      Bodies bodies;
      add_ball(bodies, Vec3(0, 0, 0), Vec3(1, 0, 0));
      add_ball(bodies, Vec3(x * radius, 0, 0), Vec3(-1, 0.2, 0));
      for (const StepReport& report : reports_of(without_walls(4, e), bodies)) {
        EXPECT_LE(report.penetration_max, 1e-3) << "beside one another they move by (0.2 h/R)^2/4";
        EXPECT_TRUE(report.converged);
      }
    }
}

TEST(Overlap, HasATolerance) {
  Bodies bodies;
  add_ball(bodies, Vec3(0, 0, radius), Vec3(0, 0, -2.2));
  talus::Setup setup = above_floor(4, 0.1);
  setup.solver.overlap_tolerance = 0.2;
  for (const StepReport& report : reports_of(setup, bodies)) {
    EXPECT_TRUE(report.converged);
    EXPECT_FALSE(report.overlapping);
  }
}

// Spheres that begin 20 % inside one another and stay there, and one that flies in a clear step beside them.
TEST(Overlap, ThatASampleBeginsWithIsNoFaultOfItsSteps) {
  Bodies bodies;
  add_ball(bodies, Vec3(0, 0, 0), Vec3::Zero());
  add_ball(bodies, Vec3(1.8 * radius, 0, 0), Vec3::Zero());
  add_ball(bodies, Vec3(0, 1, 0), Vec3(1, 0, 0));
  for (const StepReport& report : reports_of(without_walls(5, 0), bodies)) {
    EXPECT_TRUE(report.converged);
    EXPECT_LT(std::abs(report.overlap), 1e-12);
    EXPECT_NEAR(report.penetration_max, 0.2, 1e-12);
  }
}

// The first positions are meant, not those in the middle of the first step: what begins touching and is in by
// 0.1 radii there was not given.
TEST(Overlap, IsGivenAsTheRunBegins) {
  Bodies bodies;
  add_ball(bodies, Vec3(0, 0, radius), Vec3(0, 0, -2));
  const std::vector<StepReport> reports = reports_of(above_floor(1, 0), bodies);
  EXPECT_NEAR(reports[0].overlap, 0.1, 1e-12);
  EXPECT_FALSE(reports[0].converged);
}

// A ball that was given 0.2 radii leaves the floor, and is struck down again by a heavy one, faster than the
// floor was looked for: what it is then in by it has not been given, neither in the step that strikes it nor
// in those behind, for which the floor is a contact.
TEST(Overlap, ThatHasOpenedIsNotGivenAgain) {
  Bodies bodies;
  add_ball(bodies, Vec3(0, 0, 0.8 * radius), Vec3(0, 0, 2));
  add_sphere(bodies, BodyId{1}, Vec3(0, 0, 5.9 * radius), 3 * radius, density);
  bodies.velocity.back().u[2] = -4;
  const std::vector<StepReport> reports = reports_of(above_floor(6, 0.1), bodies);
  EXPECT_TRUE(reports[0].converged);
  EXPECT_EQ(reports[1].penetration_max, 0) << "the floor is no contact yet";
  for (std::size_t k = 1; k < reports.size(); ++k) {
    EXPECT_GT(reports[k].overlap, 0.1) << k;
    EXPECT_FALSE(reports[k].converged) << k;
    if (k > 1) {
      EXPECT_EQ(reports[k].overlap, reports[k].penetration_max) << k;
    }
  }
}

// A ball that was given half a radius is in the floor by 0.1 when a step begins, and above it in its middle:
// the floor is no contact. A heavy ball strikes it down, and it ends the step in by 0.124: nothing of that
// was given.
TEST(Overlap, ThatOpensWithinAStepIsNotGivenInIt) {
  Bodies bodies;
  add_ball(bodies, Vec3(0, 0, 0.5 * radius), Vec3(0, 0, 4));
  add_sphere(bodies, BodyId{1}, Vec3(0, 0, 5.65 * radius), 3 * radius, density);
  bodies.velocity.back().u[2] = -4;
  talus::Setup setup = above_floor(2, 0.1);
  setup.detection.alert = 1e-3 * radius;
  const std::vector<StepReport> reports = reports_of(setup, bodies);
  EXPECT_TRUE(reports[0].converged);
  const double speed = 8.8 * 27 / 28 - 4;  // downwards, of the ball
  EXPECT_NEAR(reports[1].overlap, 1 - (1.1 - speed * h / 2 / radius), 1e-9);
  EXPECT_FALSE(reports[1].converged);
}

// Given overlaps and the deepest pair are the same however the sample is cut and whoever has its parts.
TEST(Overlap, IsTheSameOnAnyRanks) {
  talus::Setup setup = test::pressed_setup(test::box_of_walls(-1, 7), 0.3, 4, 1e6, 200);
  setup.solver.max_iterations = 40;
  setup.solver.overlap_tolerance = 1e-4;
  setup.decomposition.subdomains = 6;
  const Bodies bodies = test::jittered_lattice(7, 4, 2);
  const auto run = [&](const graph::Communicator& ranks) {
    graph::Executor executor({.threads = 1});
    Simulation simulation(setup, ranks.rank() == 0 ? bodies : Bodies{}, executor, ranks);
    std::vector<StepReport> reports;
    for (; !simulation.finished(); simulation.begin_next_stage()) reports.push_back(simulation.step());
    EXPECT_GT(simulation.state().given_overlaps->size(), 100U);
    return reports;
  };
  std::vector<StepReport> alone;
  graph::on_pretend_ranks(1, [&](const graph::Communicator& ranks) { alone = run(ranks); });
  std::mutex comparing;
  graph::on_pretend_ranks(3, [&](const graph::Communicator& ranks) {
    const std::vector<StepReport> reports = run(ranks);
    const std::lock_guard lock(comparing);
    for (std::size_t k = 0; k < alone.size(); ++k) {
      EXPECT_EQ(reports[k].overlap, alone[k].overlap);
      EXPECT_EQ(reports[k].overlapping, alone[k].overlapping);
      EXPECT_TRUE(alone[k].overlapping);
    }
  });
}

}  // namespace
}  // namespace talus::overlap_test
