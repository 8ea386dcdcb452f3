/// Cells that follow a stress along some axes, between walls along the others: a wall stretches with the
/// cell.

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "tests/validation/experiment.hpp"

namespace talus::validation::closed_form_walled_stress_test {
namespace {

constexpr double radius = 0.05, mass = 0.8, diameter = 2 * radius;

void bound_along_z(Scene& scene, double height) {
  scene.wall("z-", Vec3::Zero(), Vec3::UnitZ());
  scene.wall("z+", height * Vec3::UnitZ(), -Vec3::UnitZ());
}

void press_lid(Scene& scene, double pressure) {
  Wall& lid = scene.setup.walls.back();
  lid.load.drive = WallDrive::pressure;
  lid.load.pressure = pressure;
  lid.load.mass = 3 * mass;
}

/// A cubic lattice between floor and lid: each axis carries what it is asked for, by walls or by the cell.
TEST(LatticeBetweenWallsInACell, CarriesTheStressOfTheCellAndThePressureOfTheLid) {
  Scene scene(1e-3);
  scene.setup.domain = periodic_domain({4 * diameter, 4 * diameter, 0});
  scene.setup.decomposition.coupling = Coupling::nscdd;
  bound_along_z(scene, 4 * diameter);
  press_lid(scene, 3e3);
  scene.friction(0.5);
  for (int k = 0; k < 64; ++k)
    scene.sphere(diameter * Vec3(k % 4 + 0.5, k / 4 % 4 + 0.5, k / 16 + 0.5), radius, mass);
  scene.stage().stress.to[0] = 1e3;
  scene.stage().stress.to[1] = 5e2;
  Experiment run(std::move(scene));
  for (int step = 0; step < 5; ++step) {
    ASSERT_TRUE(run.step().converged) << step;
    const auto cell = run.simulation().cell();
    ASSERT_TRUE(cell);
    EXPECT_NEAR(cell->stress[0], 1e3, 1e-5) << step;
    EXPECT_NEAR(cell->stress[1], 5e2, 1e-5) << step;
    EXPECT_NEAR(cell->stress[2], 3e3, 1e-5) << step;
    EXPECT_NEAR(run.wall_force(1)[2], -3e3 * 16 * diameter * diameter, 1e-5);
  }
}

struct Flow {
  bool stressed;
  Vec3 strain_rates, shear_rates;
};
class FlowsOverAFloor : public testing::TestWithParam<Flow> {};
INSTANTIATE_TEST_SUITE_P(Cells, FlowsOverAFloor,
                         testing::Values(Flow{false, {-0.5, 0.3, 0}, {0.7, 0, 0}},
                                         Flow{true, {0, 0, 0}, {0.7, 0, 0}}));

/// Grains that rest on a rough floor go with the flow, and the floor with them: it puts no force along it on
/// any of them, wherever the faces are.
TEST_P(FlowsOverAFloor, CarryGrainsAtRestWithTheFloorThatStretches) {
  const Vec3 low(0.3, -2, 0);
  Scene scene(1e-3);
  scene.setup.domain = periodic_domain({1, 1.2, 0}, low);
  scene.setup.decomposition.coupling = Coupling::nscdd;
  bound_along_z(scene, 1);
  scene.friction(0.8);
  scene.stage().gravity = {0, 0, -10};
  scene.stage().shear_rates = GetParam().shear_rates;
  scene.stage().strain_rates = GetParam().strain_rates;
  if (GetParam().stressed) scene.stage().stress.to[0] = scene.stage().stress.to[1] = 1;
  const std::vector<Vec3> places{{0.2, 0.3, radius}, {0.8, 0.9, radius}, {0.3, 0.8, radius}};
  for (const Vec3& place : places) scene.sphere(low + place, radius, mass);
  Experiment run(std::move(scene));
  for (int step = 0; step < 100; ++step) {
    ASSERT_TRUE(run.step().converged) << step;
    const Vec3 force = run.wall_force(0);
    EXPECT_NEAR(force[2], 3 * mass * 10, 1e-6) << step;
    EXPECT_LT(std::hypot(force[0], force[1]), 1e-6) << step;
  }
  const Domain& domain = run.simulation().state().domain;
  EXPECT_GT(std::abs(domain.cell.xx - 1), 1e-2) << "it has been strained";
  for (std::size_t k = 0; k < places.size(); ++k) {
    const double s_y = places[k][1] / 1.2, s_x = places[k][0];
    const Vec3 at = domain.wrap(run.x(static_cast<std::int64_t>(k))),
               expected = domain.wrap(
                   low + Vec3(domain.cell.xx * s_x + domain.cell.xy * s_y, domain.cell.yy * s_y, radius));
    EXPECT_LT((at - expected).norm(), 1e-10) << k;
  }
}

/// Two ways to one solution: sweeps over copies of the cell, and a linear system of which it is an unknown.
TEST(PackingBetweenWallsInACell, MovesAlikeBySweepsAndByADMMOnAnySubdomains) {
  const double h = 1e-3, edge = 0.34;
  struct Way {
    SolverMethod method;
    int subdomains;
  };
  std::vector<Mat3> rates;
  std::vector<std::vector<Vec3>> velocities;
  for (const Way way :
       {Way{SolverMethod::nlgs, 1}, Way{SolverMethod::admm, 1}, Way{SolverMethod::automatic, 4}}) {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> place(0, edge);
    Scene scene(h);
    scene.setup.domain = periodic_domain({edge, edge, 0});
    scene.setup.decomposition.coupling = Coupling::nscdd;
    scene.setup.decomposition.subdomains = way.subdomains;
    scene.setup.solver.method = way.method;
    scene.setup.solver.overlap_tolerance = 10;
    scene.setup.detection.alert = 0.01;
    bound_along_z(scene, edge);
    press_lid(scene, 2e3);
    scene.friction(0.4);
    scene.stage().stress.to = {2e3, 1e3, {}, 3e2, {}, {}};
    for (int k = 0; k < 30; ++k)
      scene.sphere({place(random), place(random), radius + place(random) / edge * (edge - 2 * radius)},
                   radius, mass * (1 + k % 3));
    Experiment run(std::move(scene));
    const StepReport& report = run.step();
    ASSERT_TRUE(report.converged) << report.error_rms << " " << report.balance;
    rates.push_back(matrix_of(run.simulation().state().domain.rates));
    velocities.emplace_back();
    for (int k = 0; k < 30; ++k) velocities.back().push_back(run.u(k));
  }
  EXPECT_GT(rates[0].norm(), 1e-3);
  EXPECT_EQ(rates[0](2, 2), 0);
  for (std::size_t way = 1; way < rates.size(); ++way) {
    EXPECT_LT((rates[way] - rates[0]).norm(), 1e-7 * rates[0].norm()) << way;
    for (std::size_t k = 0; k < 30; ++k) EXPECT_LT((velocities[way][k] - velocities[0][k]).norm(), 1e-7) << k;
  }
}

}  // namespace
}  // namespace talus::validation::closed_form_walled_stress_test
