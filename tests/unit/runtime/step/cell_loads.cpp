/// What stages aim at in a cell that follows a stress, how they end, and what the directions of forces say.

#include "runtime/step/cell_loads.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "runtime/graph/one_rank.hpp"
#include "runtime/step/dealing.hpp"
#include "runtime/step/force_fabric.hpp"
#include "runtime/step/simulation.hpp"

namespace talus::cell_loads_test {
namespace {

talus::Setup of_stages(std::vector<StressLoad> loads) {
  talus::Setup setup;
  for (const StressLoad& load : loads) setup.stages.emplace_back().stress = load;
  return setup;
}

TEST(StressAimedAt, ComesEvenlyFromWhatTheStageBeforeAimedAt) {
  StressLoad first, second;
  first.to = {100, 200, {}, {}, {}, {}};
  second.to = {400, {}, 50, {}, {}, {}};
  second.ramp_time = 2;
  const talus::Setup setup = of_stages({first, second});
  const std::vector<double> begins{0, 5};
  const auto at = [&](std::size_t stage, double time) {
    return stress_aimed_at(setup, {stage, time, begins});
  };
  EXPECT_EQ(at(0, 0), (CellVelocity{100, 200, 0, 0, 0, 0})) << "at once";
  EXPECT_EQ(at(1, 0)[0], 100);
  EXPECT_EQ(at(1, 0.5)[0], 175);
  EXPECT_EQ(at(1, 2)[0], 400);
  EXPECT_EQ(at(1, 9)[0], 400);
  EXPECT_EQ(at(1, 9)[1], 0) << "it follows its rate now";
  EXPECT_EQ(at(1, 1)[2], 25) << "from 0, as the stage before prescribed the flow";
}

// A stage may end by what the grains do, long before its ramp is through.
TEST(StressAimedAt, ComesFromWhereTheStageBeforeWasWhenItEnded) {
  StressLoad first, second, third;
  first.to = {100, 100, {}, {}, {}, {}};
  first.amplitude[1] = 10;
  first.period = 4;
  second.to = {1100, {}, {}, {}, {}, {}};
  third.to = {100, 0, {}, {}, {}, {}};
  first.ramp_time = second.ramp_time = third.ramp_time = 10;
  talus::Setup setup = of_stages({first, second, third});
  setup.stress_at_start = {50, 0, 0, 0, 0, 0};
  const std::vector<double> begins{0, 1, 3};  // s
  const auto at = [&](std::size_t stage, double time) {
    return stress_aimed_at(setup, {stage, time, begins});
  };
  EXPECT_DOUBLE_EQ(at(0, 0)[0], 50) << "from the stress of the sample";
  EXPECT_DOUBLE_EQ(at(0, 1)[0], 55);
  EXPECT_DOUBLE_EQ(at(0, 1)[1], 10 + 10) << "a quarter of its period";
  EXPECT_DOUBLE_EQ(at(1, 0)[0], 55);
  EXPECT_DOUBLE_EQ(at(1, 2)[0], 55 + 209);
  EXPECT_DOUBLE_EQ(at(2, 0)[0], 264);
  EXPECT_DOUBLE_EQ(at(2, 5)[0], 182) << "half way from there";
  EXPECT_DOUBLE_EQ(at(2, 10)[0], 100);
}

TEST(StressAimedAt, SwingsAsASineOfTheTimeOfTheStage) {
  StressLoad load;
  load.to[4] = 10;
  load.amplitude[4] = 4;
  load.period = 0.5;
  const talus::Setup setup = of_stages({load});
  EXPECT_DOUBLE_EQ(stress_aimed_at(setup, {0, 0.125})[4], 14);
  EXPECT_NEAR(stress_aimed_at(setup, {0, 0.25})[4], 10, 1e-14);
  EXPECT_DOUBLE_EQ(stress_aimed_at(setup, {0, 0.375})[4], 6);
}

/// Two grains far apart in a cell that is sheared at the rate g: g t of shear in the time t.
TEST(StageOfShear, EndsByItsPathAlsoWhereItWasStopped) {
  const double h = 1e-3, rate = 2;
  talus::Setup setup;
  setup.domain = periodic_domain(Vec3::Constant(1));
  Stage& stage = setup.stages.emplace_back();
  stage.name = "shear";
  stage.time_step = h;
  stage.shear_rates = {0, rate, 0};
  stage.end.shear_strain = 0.0999;
  setup.decomposition.subdomains = 1;
  Sample sample;
  sample.density = 1000;
  sample.x = {{0.2, 0.2, 0.2}, {0.7, 0.7, 0.7}};
  sample.radius = {0.01, 0.01};
  graph::Executor executor({.threads = 1});
  const graph::Communicator& alone = graph::one_rank();
  Simulation whole(setup, deal_out(std::move(sample), setup.decomposition, alone), executor, alone);
  std::optional<SavedState> middle;
  int steps = 0;
  for (; !whole.finished(); whole.begin_next_stage()) {
    whole.step();
    if (++steps == 20) middle = whole.save();
  }
  EXPECT_EQ(steps, 50);
  Simulation rest(setup, *middle, executor);
  for (; !rest.finished(); rest.begin_next_stage()) {
    rest.step();
    ++steps;
  }
  EXPECT_EQ(steps, 50 + 30);
}

/// Contacts in all directions of a lattice of angles, each with the weight of its solid angle as its number
/// would have: forces are made of known anisotropies and found again.
TEST(ForceFabric, FindsTheAnisotropiesThatForcesWereMadeOf) {
  Mat3 of_normals, of_tangents;
  of_normals << 0.3, 0.1, 0, 0.1, -0.1, 0.05, 0, 0.05, -0.2;
  of_tangents << -0.1, 0, 0.08, 0, 0.2, 0.02, 0.08, 0.02, -0.1;
  StepState state;
  Contacts& c = state.contacts;
  // The points of a spiral (Saff & Kuijlaars 1997) are even over the sphere.
  constexpr int count = 20000;
  for (int k = 0; k < count; ++k) {
    const double z = 1 - (2 * k + 1.0) / count, turn = k * std::numbers::pi * (3 - std::sqrt(5.0)),
                 flat = std::sqrt(1 - z * z);
    const Vec3 n(flat * std::cos(turn), flat * std::sin(turn), z);
    const Vec3 r = (1 + n.dot(of_normals * n)) * n + of_tangents * n - n.dot(of_tangents * n) * n;
    c.nx.push_back(n[0]), c.ny.push_back(n[1]), c.nz.push_back(n[2]);
    c.rx.push_back(r[0]), c.ry.push_back(r[1]), c.rz.push_back(r[2]);
  }
  state.chunks.begin = {0, count};
  state.chunks.wall = {-1};
  state.chunks.subdomain = {0};
  state.chunks.colour = {0};
  c.count = {count};
  state.decomposition = make_decomposition({.subdomains = 1}, graph::one_rank());
  const ForceFabric found = force_fabric(state, graph::one_rank());
  EXPECT_EQ(found.contacts, count);
  EXPECT_LT((found.fabric - Mat3::Identity() / 3).norm(), 1e-4);
  EXPECT_LT(found.of_contacts.norm(), 1e-3);
  EXPECT_LT((found.of_normal_forces - of_normals).norm(), 2e-3) << found.of_normal_forces;
  EXPECT_LT((found.of_tangential_forces - of_tangents).norm(), 2e-3) << found.of_tangential_forces;
}

/// The stress of contacts with such densities and forces, added up over all directions.
TEST(ForceFabric, MakesTheStressRatioWithTheProductsOfItsAnisotropies) {
  ForceFabric of;
  of.of_contacts << 0.5, 0.2, 0.1, 0.2, -0.4, 0.05, 0.1, 0.05, -0.1;
  of.of_normal_forces << 0.6, -0.1, 0.3, -0.1, -0.2, 0.15, 0.3, 0.15, -0.4;
  of.of_tangential_forces << 0.1, 0.05, 0.2, 0.05, 0.1, 0, 0.2, 0, -0.2;
  Mat3 stress = Mat3::Zero();
  constexpr int count = 40000;
  for (int k = 0; k < count; ++k) {
    const double z = 1 - (2 * k + 1.0) / count, turn = k * std::numbers::pi * (3 - std::sqrt(5.0)),
                 flat = std::sqrt(1 - z * z);
    const Vec3 n(flat * std::cos(turn), flat * std::sin(turn), z);
    const auto along = [&](const Mat3& m) { return n.dot(m * n); };
    const Vec3 force = (1 + along(of.of_normal_forces)) * n + of.of_tangential_forces * n -
                       along(of.of_tangential_forces) * n;
    stress += (1 + along(of.of_contacts)) * force * n.transpose();
  }
  const Mat3 even = 0.5 * (stress + stress.transpose()), s = even - even.trace() / 3 * Mat3::Identity();
  const double ratio = std::sqrt(1.5) * s.norm() / (even.trace() / 3);
  EXPECT_NEAR(stress_ratio_of(of, s), ratio, 1e-4);
  const double first = 0.4 * (along_stress(of.of_contacts, s) + along_stress(of.of_normal_forces, s) +
                              1.5 * along_stress(of.of_tangential_forces, s));
  EXPECT_GT(std::abs(first - ratio), 0.02) << "products count";
}

TEST(ForceFabric, HasTheSignOfItsStress) {
  const Mat3 deviator = Eigen::Vector3d(0.1, 0.1, -0.2).asDiagonal();
  EXPECT_NEAR(along_stress(deviator, deviator), std::sqrt(1.5) * deviator.norm(), 1e-15);
  EXPECT_NEAR(along_stress(-deviator, deviator), -std::sqrt(1.5) * deviator.norm(), 1e-15);
  EXPECT_EQ(along_stress(deviator, Mat3::Zero()), 0);
}

}  // namespace
}  // namespace talus::cell_loads_test
