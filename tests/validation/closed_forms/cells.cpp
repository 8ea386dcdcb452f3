/// Periodic cells: contacts across a face, and the stress of lattices.

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <array>
#include <cmath>
#include <vector>

#include "runtime/step/runaway.hpp"
#include "tests/validation/experiment.hpp"

namespace talus::validation::closed_form_cells_test {
namespace {

constexpr double h = 1e-3, radius = 0.05, mass = 0.8;

TEST(CollisionAcrossAFace, IsThatOfTheSameGrainsWithoutAFace) {
  // Grain 1 flies out of the cell, and into grain 0 on the other side; without the cell it stands one edge
  // further back.
  const double edge = 1;
  const Vec3 u(2, 0.3, -0.2);
  const auto made = [&](bool periodic) {
    Scene scene(h);
    scene.friction(0.3);
    scene.stage().laws.set_all(&PairLaw::restitution, 0.5);
    if (periodic) scene.setup.domain = periodic_domain(Vec3::Constant(edge));
    scene.sphere({0.08, 0.5, 0.5}, radius, mass);
    scene.sphere({0.8 - (periodic ? 0 : edge), 0.49, 0.52}, radius, 2 * mass, u);
    return Experiment(std::move(scene));
  };
  Experiment periodic = made(true), open = made(false);
  for (int k = 0; k < 400; ++k) {
    periodic.step();
    open.step();
    for (const int id : {0, 1}) {
      ASSERT_LT((periodic.u(id) - open.u(id)).norm(), 1e-11) << "step " << k;
      ASSERT_LT((periodic.w(id) - open.w(id)).norm(), 1e-11) << "step " << k;
      const Vec3 way = periodic.x(id) - open.x(id);
      ASSERT_LT((way - edge * (way / edge).array().round().matrix()).norm(), 1e-11) << "step " << k;
    }
  }
  EXPECT_GT((open.u(1) - u).norm(), 0.1) << "they met";
}

/// Three grains in a row along x, and one in the hollow between the last and the image of the first.
TEST(GrainInAHollowAcrossAFace, IsHeldByBothGrainsAndPressesTheRow) {
  const double opening = 0.4 * radius, edge = 6 * radius + opening;
  Scene scene(h);
  scene.stage().gravity = {0, 0, -g_earth};
  scene.setup.domain = periodic_domain({edge, 0, 0});
  scene.wall("floor", Vec3::Zero(), Vec3::UnitZ());
  scene.wall("back", Vec3::Zero(), Vec3::UnitY());
  scene.wall("front", {0, 2 * radius, 0}, -Vec3::UnitY());
  for (const double x : {1.0, 3.0, 5.0})
    scene.sphere({x * radius + opening / 2, radius, radius}, radius, mass);
  const double half = radius + opening / 2, height = std::sqrt(4 * radius * radius - half * half);
  scene.sphere({0, radius, radius + height}, radius, mass);
  Experiment run(std::move(scene));
  for (int k = 0; k < 50; ++k) ASSERT_TRUE(run.step().converged) << "step " << k;
  const double weight = mass * g_earth, push = weight * radius / height;
  EXPECT_NEAR(run.wall_force(0)[2], 4 * weight, 1e-7 * weight);
  const Frame frame = run.simulation().frame();
  int held = 0, pressed = 0;
  for (std::size_t k = 0; k < frame.contact_force.size(); ++k) {
    const auto [first, second] = frame.contact_bodies[k];
    if (second < 0) continue;
    if (first == 3 || second == 3) {
      ++held;
      EXPECT_NEAR(frame.contact_force[k].norm(), push, 1e-6 * weight);
    } else {
      ++pressed;
      EXPECT_NEAR(frame.contact_force[k].norm(), push * half / (2 * radius), 1e-6 * weight);
    }
  }
  EXPECT_EQ(held, 2);
  EXPECT_EQ(pressed, 2);
}

/// A cubic lattice between two plates, periodic along x and y: columns of touching grains.
TEST(CubicLatticeBetweenPlates, HasTheStressOfThePlatesExactly) {
  const double pressure = 1e3;
  const int n = 4;
  Scene scene(h);
  const double side = n * 2.2 * radius;
  scene.setup.domain = periodic_domain({side, side, 0});
  scene.wall("z-", Vec3::Zero(), Vec3::UnitZ());
  Wall& lid = scene.wall("z+", {0, 0, n * 2 * radius}, -Vec3::UnitZ());
  lid.load.drive = WallDrive::pressure;
  lid.load.pressure = pressure;
  lid.load.mass = 1;
  for (int k = 0; k < n * n * n; ++k)
    scene.sphere({2.2 * radius * (k % n), 2.2 * radius * (k / n % n), radius * (2 * (k / n / n) + 1)}, radius,
                 mass);
  Experiment run(std::move(scene));
  for (int k = 0; k < 5; ++k) ASSERT_TRUE(run.step().converged) << "step " << k;
  EXPECT_NEAR(run.wall_force(0)[2], pressure * side * side, 1e-8 * pressure * side * side);
  const auto triaxial = run.simulation().triaxial();
  ASSERT_TRUE(triaxial);
  EXPECT_NEAR(triaxial->stress[2], pressure, 1e-8 * pressure);
  EXPECT_NEAR(triaxial->stress[0], 0, 1e-8 * pressure);
  EXPECT_NEAR(triaxial->solid_fraction, pi / 6 / (1.1 * 1.1), 1e-9);
  const auto cell = run.simulation().cell();
  ASSERT_TRUE(cell);
  EXPECT_NEAR(cell->stress[2], pressure, 1e-8 * pressure);
  EXPECT_NEAR(cell->p, pressure / 3, 1e-8 * pressure);
  EXPECT_NEAR(cell->q, pressure, 1e-8 * pressure);
  EXPECT_EQ(cell->edges, (std::array<double, 6>{side, side, 0, 0, 0, 0}));
}

/// Grains that fly without touching: what they carry through a face, as an ideal gas, beyond what both do
/// together.
TEST(GasInAFlowingCell, HasTheKineticStressOfItsVelocitiesAgainstTheFlow) {
  const double rate = 3;
  Scene scene(h);
  scene.setup.domain = periodic_domain({1, 2, 1});
  scene.stage().shear_rates = {0, rate, 0};
  scene.sphere({0.2, 0.2, 0.2}, radius, mass, {1, 0, 0.5});
  scene.sphere({0.7, 1.2, 0.6}, radius, 2 * mass, {0, -2, 0});
  Experiment run(std::move(scene));
  for (int k = 0; k < 3; ++k) ASSERT_TRUE(run.step().converged);
  // Against the flow v_x falls by rate x the way along z; the flow began half a step late.
  const double way = 0.5 * 3 * h, drifted = 1 - rate * (way - 0.5 * 0.5 * h);
  const auto cell = run.simulation().cell();
  ASSERT_TRUE(cell);
  // Of two bodies: the reduced mass, and the velocity of one against the other.
  const double reduced = 2.0 / 3 * mass, volume = 2;
  EXPECT_NEAR(cell->kinetic_stress[0], reduced * drifted * drifted / volume, 1e-9);
  EXPECT_NEAR(cell->kinetic_stress[1], reduced * 4 / volume, 1e-9);
  EXPECT_NEAR(cell->kinetic_stress[2], reduced * 0.25 / volume, 1e-9);
  EXPECT_NEAR(cell->kinetic_stress[4], reduced * drifted * 0.5 / volume, 1e-9);
  EXPECT_EQ(cell->p, 0);
}

/// In free flight nothing happens at a face.
TEST(GrainThatFallsThroughTheCell, PassesItsFacesAsIfThereWereNone) {
  Scene scene(h);
  scene.stage().gravity = {0.5, 0, -g_earth};
  scene.setup.domain = periodic_domain(Vec3::Constant(0.5));
  scene.sphere({0.25, 0.25, 0.25}, radius, mass, {1, 2, 3});
  Experiment run(std::move(scene));
  run.steps(1000);
  const Vec3 g(0.5, 0, -g_earth), u = Vec3(1, 2, 3) + g;
  EXPECT_LT((run.u() - u).norm(), 1e-11);
  const Vec3 way = Vec3(1, 2, 3) + 0.5 * g, x = Vec3::Constant(0.25) + way;
  const Vec3 off = run.x() - x;
  EXPECT_LT((off - 0.5 * (off / 0.5).array().round().matrix()).norm(), 1e-10);
  const Vec3 written = run.simulation().frame().x.front();
  EXPECT_GE(written.minCoeff(), 0) << "frames have the image in the cell";
  EXPECT_LE(written.maxCoeff(), 0.5);
}

/// Grains that touch nothing go with the cell: their places in it, in edges, stay.
TEST(FreeGrains, FollowTheHomogeneousFlowOfTheCell) {
  Scene scene(h);
  const Vec3 low(-0.2, 0.1, 3), lengths(1, 1.2, 0.9);
  scene.setup.domain = periodic_domain(lengths, low);
  scene.stage().strain_rates = {-0.4, 0.3, 0.1};
  scene.stage().shear_rates = {0.2, 1.7, -0.6};
  const std::vector<Vec3> places = {{0.1, 0.1, 0.1}, {0.5, 0.5, 0.5}, {0.9, 0.3, 0.85}, {0.2, 0.8, 0.6}};
  for (const Vec3& place : places) scene.sphere(low + lengths.cwiseProduct(place), radius / 5, mass);
  Experiment run(std::move(scene));
  for (int k = 0; k < 700; ++k) ASSERT_TRUE(run.step().converged) << "step " << k;
  const Domain& domain = run.simulation().state().domain;
  const Mat3 edges = edges_of(domain), rates = matrix_of(domain.rates);
  EXPECT_LE(std::abs(domain.cell.xz), 0.7 * domain.cell.xx) << "it was set upright again";
  EXPECT_NEAR(domain.cell.xx, std::exp(-0.4 * 0.7), 1e-3) << "from rest to the flow in half a step";
  for (std::size_t k = 0; k < places.size(); ++k) {
    const auto id = static_cast<std::int64_t>(k);
    const Vec3 place = edges.inverse() * (run.x(id) - low), off = place - places[k];
    // Leaning edges that were exchanged move whole edges along x and y.
    EXPECT_NEAR(off[2], std::round(off[2]), 1e-11);
    EXPECT_LT((run.u(id) - rates * place).norm(), 1e-11);
  }
  EXPECT_NEAR((rates * edges.inverse() - run.simulation().parameters().velocity_gradient).norm(), 0, 1e-12);
}

/// A cell that is squeezed until a grain would meet two images of another.
TEST(CellThatIsSqueezedTooFar, EndsTheRunBeforeAGrainMeetsTwoImagesOfAnother) {
  Scene scene(h);
  scene.setup.domain = periodic_domain({1, 1, 0.5});
  scene.stage().strain_rates = {0, 0, -1};
  scene.sphere({0.2, 0.2, 0.1}, radius, mass);
  scene.sphere({0.7, 0.7, 0.1}, radius, mass);
  Experiment run(std::move(scene));
  try {
    run.steps(1500);
    FAIL() << "it went on to an edge of " << run.simulation().state().domain.cell.zz << " m";
  } catch (const RunawayError& error) {
    EXPECT_NE(std::string(error.what()).find("two images of another"), std::string::npos) << error.what();
  }
  EXPECT_GT(run.simulation().state().domain.cell.zz, 2 * 2 * radius);
}

/// Two grains that are pulled apart across a face, and pushed together, feel what they would feel inside.
TEST(PairInAShearedCell, FeelsTheSameForceAcrossAFaceAsInside) {
  const auto made = [&](double z) {
    Scene scene(h);
    scene.friction(0.3);
    scene.setup.domain = periodic_domain(Vec3::Constant(1));
    scene.stage().shear_rates = {0, 2, 0};
    scene.stage().strain_rates = {0, 0, -0.5};
    scene.sphere({0.5, 0.5, z}, radius, mass);
    scene.sphere({0.5 + 0.8 * radius, 0.5, z - 1.84 * radius}, radius, 3 * mass);
    return Experiment(std::move(scene));
  };
  Experiment inside = made(0.5), across = made(0.04);
  double most = 0;
  for (int k = 0; k < 120; ++k) {
    inside.step();
    across.step();
    const Frame a = inside.simulation().frame(), b = across.simulation().frame();
    ASSERT_EQ(a.contact_force.size(), b.contact_force.size()) << "step " << k;
    const auto on_first = [](const Frame& frame) -> Vec3 {
      if (frame.contact_force.empty()) return Vec3::Zero();
      return frame.contact_bodies[0][0] == 0 ? frame.contact_force[0] : Vec3(-frame.contact_force[0]);
    };
    EXPECT_LT((on_first(a) - on_first(b)).norm(), 1e-8 * (1 + on_first(a).norm())) << "step " << k;
    most = std::max(most, on_first(a).norm());
    EXPECT_LT((inside.w(0) - across.w(0)).norm(), 1e-11);
  }
  EXPECT_GT(most, 0.1) << "they touch";
}

}  // namespace
}  // namespace talus::validation::closed_form_cells_test
