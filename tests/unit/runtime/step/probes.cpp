/// Probes and fields of simulations whose answers are known in closed form.

#include "runtime/step/probes.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <utility>

#include "runtime/step/simulation.hpp"

namespace talus::probe_test {
namespace {

constexpr double density = 2500, h = 1e-3;

Region box(const Vec3& low, const Vec3& high) {
  Region region;
  region.low = low;
  region.high = high;
  return region;
}

Region plane(double z, double direction) {
  Region region;
  region.kind = Region::Kind::plane;
  region.point = {0, 0, z};
  region.normal = {0, 0, direction};
  return region;
}

ProbeRule probe(const std::string& name, const Region& region, std::int64_t every_steps = 1) {
  return {name, region, {}, every_steps};
}

talus::Setup free_setup(std::int64_t steps, const Vec3& gravity = Vec3::Zero()) {
  talus::Setup setup;
  Stage stage;
  stage.name = "run";
  stage.time_step = h;
  stage.gravity = gravity;
  stage.end.steps = steps;
  setup.stages.push_back(stage);
  return setup;
}

Wall side(const std::string& name, const Vec3& normal, const Vec3& point) {
  Wall wall;
  wall.name = name;
  wall.normal = normal;
  wall.point = point;
  return wall;
}

/// Calls look(simulation) behind every step.
template <class Look>
void run(const talus::Setup& setup, Bodies bodies, const Look& look, int threads = 1) {
  graph::Executor executor({.threads = threads});
  Simulation simulation(setup, std::move(bodies), executor);
  while (!simulation.finished()) {
    simulation.step();
    look(simulation);
    simulation.begin_next_stage();
  }
}

double ball(double radius) {
  return 4 * std::numbers::pi / 3 * radius * radius * radius;
}

TEST(Probes, ASphereThatFallsPassesAPlaneInTheStepThatGravitySays) {
  const double drop = 0.02, g = 9.81;
  talus::Setup setup = free_setup(100, {0, 0, -g});
  setup.probes = {probe("down", plane(-drop, -1)), probe("up", plane(-drop, 1)), probe("far", plane(-1, 1)),
                  probe("seldom", plane(-drop, -1), 50)};
  Bodies bodies;
  add_sphere(bodies, BodyId{7}, Vec3::Zero(), 0.01, density);
  const double mass = density * ball(0.01);
  // Moreau's scheme is exact in free fall.
  const auto passes = static_cast<std::int64_t>(std::ceil(std::sqrt(2 * drop / g) / h));
  run(setup, bodies, [&](const Simulation& simulation) {
    const std::int64_t step = simulation.report().step;
    const std::int64_t passed = step >= passes ? 1 : 0;
    const auto& reports = simulation.probes();
    ASSERT_EQ(reports.size(), step % 50 == 0 ? 4u : 3u);
    EXPECT_EQ(reports[0].passed_count, passed) << step;
    EXPECT_EQ(reports[1].passed_count, -passed) << step;
    EXPECT_EQ(reports[2].passed_count, 0);
    EXPECT_NEAR(reports[0].passed_mass, static_cast<double>(passed) * mass, 1e-12 * mass);
    EXPECT_NEAR(reports[0].count_rate, step == passes ? 1 / h : 0, 1e-6 / h);
    if (step == 100) {
      EXPECT_NEAR(reports[3].mass_rate, mass / 0.05, 1e-9 * mass / 0.05);
    }
  });
  ASSERT_GT(passes, 50);
}

TEST(Probes, ADiscCountsWhatPassesWithinIt) {
  talus::Setup setup = free_setup(60, {0, 0, -9.81});
  Region disc;
  disc.kind = Region::Kind::disc;
  disc.centre = {0, 0, -0.005};
  disc.axis = {0, 0, -1};
  disc.radius = 0.045;
  setup.probes = {probe("disc", disc)};
  Bodies bodies;
  for (int k = 0; k < 10; ++k) add_sphere(bodies, BodyId{k}, {0.03 * k - 0.1, 0, 0}, 0.01, density);
  run(setup, bodies, [&](const Simulation& simulation) {
    if (simulation.report().step == 60) {
      EXPECT_EQ(simulation.probes()[0].passed_count, 3);  // at -0.04, -0.01 and 0.02
    }
  });
}

/// 3 x 3 x 3 equal spheres that touch, between a floor and a lid that is pushed with a force, without
/// friction or gravity: nine columns that carry it together; which one how much, a lid that does not tilt
/// leaves open.
TEST(Probes, APressedLatticeHasTheStressOfItsLidAndItsOwnSolidFraction) {
  const double r = 0.01, d = 2 * r, force = 90;
  talus::Setup setup = free_setup(5);
  setup.walls = {side("floor", {0, 0, 1}, {0, 0, 0}), side("lid", {0, 0, -1}, {0, 0, 3 * d})};
  setup.walls[1].load.drive = WallDrive::force;
  setup.walls[1].load.force = force;
  setup.walls[1].load.mass = 1;
  setup.solver.tolerance = 1e-9;
  setup.solver.max_iterations = 20000;
  Region round;
  round.kind = Region::Kind::cylinder;
  round.start = {1.5 * d, 1.5 * d, 0.5 * d};
  round.end = {1.5 * d, 1.5 * d, 2.25 * d};
  round.radius = 0.4 * d;  // cuts the middle column
  setup.probes = {probe("all", box(Vec3::Zero(), Vec3::Constant(3 * d))),
                  probe("part", box({0, 0, 0.7 * d}, {3 * d, 3 * d, 2.2 * d})),
                  probe("middle", box(Vec3::Constant(d), Vec3::Constant(2 * d))), probe("round", round)};
  Bodies bodies;
  for (int k = 0; k < 27; ++k)
    add_sphere(bodies, BodyId{k}, d * Vec3(k % 3 + 0.5, k / 3 % 3 + 0.5, k / 9 + 0.5), r, density);
  run(setup, bodies, [&](const Simulation& simulation) {
    if (simulation.report().step < 5) return;
    ASSERT_TRUE(simulation.report().converged);
    const auto& reports = simulation.probes();
    const double stress = force / (9 * d * d), close = 1e-6 * stress;
    for (std::size_t p = 0; p < 3; ++p) {
      if (p < 2) {
        EXPECT_NEAR(reports[p].contact_stress(2, 2), stress, close) << reports[p].name;
      }
      EXPECT_NEAR(reports[p].contact_stress(0, 0), 0, close);
      EXPECT_NEAR(reports[p].contact_stress(0, 2), 0, close);
      EXPECT_EQ(reports[p].coordination, 2);  // the one above, the one below
      EXPECT_LT(reports[p].kinetic_stress.norm(), 1e-9 * stress);
    }
    // The force of the middle column, over the section of the box and over that of the cylinder.
    EXPECT_NEAR(reports[3].contact_stress(2, 2) * std::numbers::pi * 0.16, reports[2].contact_stress(2, 2),
                close);
    EXPECT_NEAR(reports[2].contact_stress(2, 2), stress, 0.1 * stress);
    EXPECT_EQ(reports[0].count, 27);
    EXPECT_EQ(reports[2].count, 1);
    EXPECT_EQ(reports[1].count, 9);  // centres at 0.5 d and 2.5 d are outside
    EXPECT_NEAR(reports[0].mass, 27 * density * ball(r), 1e-9);
    EXPECT_NEAR(reports[0].solid_fraction, std::numbers::pi / 6, 1e-6);
    EXPECT_NEAR(reports[2].solid_fraction, std::numbers::pi / 6, 1e-6);
  });
}

/// A sphere slides along +x over a floor: the floor pushes it up with m g and back with mu m g, and the
/// branch from the contact to the centre stands upright. Of force and branch the force is the first index.
TEST(Probes, ASlidingSphereHasShearStressOfTheForceAcrossItsHeightAndNoneOfItsOwnTranspose) {
  const double r = 0.01, g = 9.81, mu = 0.3;
  talus::Setup setup = free_setup(3, {0, 0, -g});
  setup.walls = {side("floor", {0, 0, 1}, {0, 0, 0})};
  setup.stages[0].laws = laws_of_one_material(mu, mu, 0);
  setup.solver.tolerance = 1e-12;
  setup.probes = {probe("all", box(Vec3::Constant(-1), Vec3::Constant(1)))};
  Bodies bodies;
  add_sphere(bodies, BodyId{0}, {0, 0, r}, r, density);
  bodies.velocity[0].u[0] = 5;
  run(setup, bodies, [&](const Simulation& simulation) {
    const Mat3& stress = simulation.probes()[0].contact_stress;
    const double normal = density * ball(r) * g * r / 8;  // in a box of 8 m^3
    EXPECT_NEAR(stress(2, 2), normal, 1e-6 * normal);
    EXPECT_NEAR(stress(0, 2), -mu * normal, 1e-6 * normal);
    EXPECT_NEAR(stress(2, 0), 0, 1e-6 * normal);
  });
}

TEST(Probes, ACloudInRigidRotationRestsOnTheWholeAndHasItsTemperature) {
  talus::Setup setup = free_setup(1);
  setup.probes = {probe("cloud", box(Vec3::Constant(-1), Vec3::Constant(1))),
                  probe("half", box({0, -1, -1}, {1, 1, 1}))};
  Bodies bodies;
  const double omega = 3;
  double square = 0, first = 0;
  for (int k = 0; k < 60; ++k) {  // opposite places two by two
    const Vec3 x =
        (k % 2 == 0 ? 1 : -1) * Vec3(0.4 * std::cos(k / 2) + 0.1, 0.4 * std::sin(k / 2), 0.02 * (k / 2));
    add_sphere(bodies, BodyId{k}, x, 1e-3, density);
    const Vec3 u(-omega * x[1] + 100, omega * x[0], 0);  // and all of it moves fast
    std::copy_n(u.data(), 3, bodies.velocity.back().u);
    square += omega * omega * (x[0] * x[0] + x[1] * x[1]) / 60;
    if (x[0] > 0) first += omega * x[0] / 30;
  }
  run(setup, bodies, [&](const Simulation& simulation) {
    const ProbeReport& cloud = simulation.probes()[0];
    EXPECT_EQ(cloud.count, 60);
    EXPECT_LT((cloud.velocity - Vec3(100, 0, 0)).norm(), 1e-11);
    EXPECT_NEAR(cloud.temperature, square / 3, 1e-11);
    EXPECT_NEAR(cloud.kinetic_stress.trace(), cloud.mass * square / 8, 1e-9 * cloud.mass * square);
    EXPECT_EQ(cloud.coordination, 0);
    EXPECT_GT(first, 0);
  });
}

/// Materials are told apart, and grains removed or inserted have not gone through anything.
TEST(Probes, TellMaterialsApartAndCountNoGrainThatIsTakenAway) {
  talus::Setup setup = free_setup(100, {0, 0, -9.81});
  setup.material_names = {"glass", "steel"};
  setup.probes = {probe("gate", plane(-0.01, -1)), probe("all", box(Vec3::Constant(-1), Vec3::Constant(1)))};
  RemoveRule out;
  out.name = "out";
  out.region = plane(-0.02, -1);
  out.region.kind = Region::Kind::beyond;
  setup.removes = {out};
  Bodies bodies;
  for (int k = 0; k < 5; ++k) {
    add_sphere(bodies, BodyId{k}, {0.1 * k, 0, 0}, 0.01, density);
    bodies.material.push_back(k < 2 ? Material{0} : Material{1});
  }
  run(setup, bodies, [&](const Simulation& simulation) {
    const auto& reports = simulation.probes();
    if (simulation.report().step == 1) {
      EXPECT_EQ(reports[1].materials[0].count, 2);
      EXPECT_EQ(reports[1].materials[1].count, 3);
      EXPECT_NEAR(reports[1].materials[1].mass, 3 * density * ball(0.01), 1e-12);
    }
    if (simulation.report().step < 100) return;
    EXPECT_EQ(reports[0].materials[0].passed_count, 2);
    EXPECT_EQ(reports[0].materials[1].passed_count, 3);
    EXPECT_EQ(reports[1].count, 0);
  });
}

TEST(Probes, ReportByTimeWhereTheyAreAskedTo) {
  talus::Setup setup = free_setup(25);
  setup.probes = {{"timed", plane(0, 1), 0.01, {}}};
  Bodies bodies;
  add_sphere(bodies, BodyId{0}, Vec3::Zero(), 0.01, density);
  std::vector<std::int64_t> steps;
  run(setup, bodies, [&](const Simulation& simulation) {
    if (!simulation.probes().empty()) steps.push_back(simulation.report().step);
  });
  EXPECT_EQ(steps, (std::vector<std::int64_t>{10, 20}));
}

/// Grains of a gas that bounces in a box: the field of a grid about it holds their mass and momentum, and no
/// bit of it depends on threads.
TEST(Fields, OfASimulationHoldItsMassAndMomentum) {
  talus::Setup setup = free_setup(20);
  setup.walls = {side("floor", {0, 0, 1}, {0, 0, -0.1})};
  setup.stages[0].gravity = {0, 0, -9.81};
  setup.fields = {{"gas", Vec3::Constant(-0.3), Vec3::Constant(0.3), {20, 24, 15}, 0.05}};
  Bodies bodies;
  Vec3 momentum = Vec3::Zero();
  double mass = 0;
  for (int k = 0; k < 40; ++k) {
    add_sphere(bodies, BodyId{k}, 0.02 * Vec3(k % 5, k / 5 % 4, k / 20), 0.01, density + 10 * k);
    bodies.velocity.back().u[0] = 0.1 * std::sin(k);
  }
  std::vector<double> numbers;
  for (const int threads : {1, 2})
    run(
        setup, bodies,
        [&](const Simulation& simulation) {
          if (simulation.report().step < 20) return;
          const Frame frame = simulation.frame(false);
          ASSERT_EQ(frame.grids.size(), 1u);
          const FieldGrid& field = frame.grids[0];
          if (threads == 2) {
            EXPECT_EQ(field.sums.numbers, numbers);
            return;
          }
          numbers = field.sums.numbers;
          const Bodies& now = simulation.state().bodies;
          for (std::size_t s = 0; s < now.size(); ++s) {
            mass += now.mass(s);
            momentum += now.mass(s) * Vec3(now.velocity[s].u);
          }
          double held = 0;
          Vec3 carried = Vec3::Zero();
          for (std::size_t c = 0; c < field.grid.size(); ++c) {
            const CellFields cell = fields_of(field.sums, c);
            held += cell.density * field.grid.cell_volume();
            carried += cell.density * cell.velocity * field.grid.cell_volume();
          }
          EXPECT_NEAR(held, mass, 1e-12 * mass);
          EXPECT_LT((carried - momentum).norm(), 1e-12 * mass);
        },
        threads);
}

}  // namespace
}  // namespace talus::probe_test
