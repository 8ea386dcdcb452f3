/// Whole simulations in a periodic cell: the same forces wherever its faces lie, and the same bits on any
/// ranks and threads.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <map>
#include <mutex>

#include "runtime/graph/one_rank.hpp"
#include "runtime/graph/pretend_ranks.hpp"
#include "runtime/step/dealing.hpp"
#include "runtime/step/simulation.hpp"
#include "tests/unit/runtime/step/cut_boxes.hpp"
#include "tests/unit/runtime/step/loose_scenes.hpp"

namespace talus::periodic_cell_test {
namespace {

using simulation_test::cell_edge;
using simulation_test::density;
using simulation_test::flying;
using simulation_test::radius;
using simulation_test::stage;

constexpr double edge = cell_edge;

/// 216 grains that fly about in a cube and hit one another, with friction.
Setup colliding(std::int64_t steps) {
  talus::Setup setup;
  setup.domain = periodic_domain(Vec3::Constant(edge));
  setup.stages = {stage("fly", steps)};
  setup.stages[0].laws = laws_of_one_material(0.4, 0.4, 0);
  setup.solver.tolerance = 1e-10;
  setup.solver.max_iterations = 20000;
  setup.solver.overlap_tolerance = 1;
  setup.decomposition.subdomains = 1;
  return setup;
}

/// State of each grain at the end, by its number, and what the steps said.
struct Outcome {
  std::map<BodyId, std::pair<Vec3, Velocity>> grains;
  std::int64_t contacts = 0, migrants = 0;
  std::uint64_t digest = 0;
  bool converged = true;
  Domain domain;  ///< at the end
};
Outcome simulate(const talus::Setup& setup, Sample sample,
                 const graph::Communicator& ranks = graph::one_rank(), int threads = 1) {
  graph::Executor executor({.threads = threads});
  Simulation simulation(setup, deal_out(std::move(sample), setup.decomposition, ranks), executor, ranks);
  Outcome outcome;
  for (; !simulation.finished(); simulation.begin_next_stage()) {
    const StepReport& report = simulation.step();
    outcome.contacts += report.active;
    outcome.migrants += report.migrants;
    outcome.converged = outcome.converged && report.converged;
  }
  outcome.digest = simulation.digest();
  outcome.domain = simulation.state().domain;
  const Bodies& bodies = simulation.state().bodies;
  for (std::size_t s = 0; s < bodies.size(); ++s)
    outcome.grains.insert({bodies.id[s], {bodies.x[s], bodies.velocity[s]}});
  return outcome;
}

Vec3 momentum(const Outcome& outcome) {
  Vec3 sum = Vec3::Zero();
  for (const auto& [id, grain] : outcome.grains)
    sum += Eigen::Map<const Vec3>(grain.second.u) / grain.second.inv_mass;
  return sum;
}

TEST(PeriodicRun, ForcesDoNotDependOnWhereTheFacesLie) {
  const talus::Setup setup = colliding(60);
  const Outcome one = simulate(setup, flying());
  ASSERT_GT(one.contacts, 1000);
  EXPECT_TRUE(one.converged);
  for (const Vec3& shift : {Vec3(0.3 * edge, 0, 0), Vec3(0.7, -0.9, 0.41), Vec3(0, 0, -7 * edge)}) {
    const Outcome other = simulate(setup, flying(shift));
    double worst_place = 0, worst_speed = 0;
    for (const auto& [id, grain] : one.grains) {
      const auto& [x, velocity] = other.grains.at(id);
      worst_place = std::max(worst_place, setup.domain.separation(x - shift, grain.first).norm());
      worst_speed = std::max(
          worst_speed, (Eigen::Map<const Vec3>(velocity.u) - Eigen::Map<const Vec3>(grain.second.u)).norm());
    }
    EXPECT_LT(worst_place, 1e-6 * radius);
    EXPECT_LT(worst_speed, 1e-5 * 0.5);
  }
}

TEST(PeriodicRun, MomentumOfTheWholeIsKept) {
  const talus::Setup setup = colliding(1);
  const Vec3 before = momentum(simulate(setup, flying()));
  talus::Setup longer = colliding(60);
  const Outcome outcome = simulate(longer, flying());
  double scale = 0;
  for (const auto& [id, grain] : outcome.grains)
    scale += Eigen::Map<const Vec3>(grain.second.u).norm() / grain.second.inv_mass;
  EXPECT_LT((momentum(outcome) - before).norm(), 1e-12 * scale);
}

TEST(PeriodicRun, GrainsAreStoredInTheCellWhereverTheyFly) {
  talus::Setup setup = colliding(400);
  setup.solver.tolerance = 1e-3;
  const Outcome outcome = simulate(setup, flying());
  for (const auto& [id, grain] : outcome.grains) {
    EXPECT_GT(grain.first.minCoeff(), -radius) << "at most a skin outside";
    EXPECT_LT(grain.first.maxCoeff(), edge + radius);
  }
}

TEST(PeriodicRun, HasTheSameBitsOnAnyRanksAndThreads) {
  for (const auto& variant : decomposition_test::variants)
    for (const int subdomains : {2, 8}) {
      if (subdomains == 2 && &variant != &decomposition_test::variants[3]) continue;
      talus::Setup setup = colliding(12);
      setup.solver.max_iterations = 20;
      decomposition_test::choose(setup, variant, subdomains);
      setup.decomposition.repartition_every = 3;
      const Outcome one = simulate(setup, flying());
      EXPECT_EQ(simulate(setup, flying(), graph::one_rank(), 2).digest, one.digest) << variant.name;
      EXPECT_GT(one.migrants, 0) << variant.name;
      for (const int count : {2, 3}) {
        if (count > subdomains) continue;
        std::map<BodyId, std::pair<Vec3, Velocity>> all;
        std::mutex adding;
        graph::on_pretend_ranks(count, [&](const graph::Communicator& ranks) {
          const Outcome own = simulate(setup, ranks.rank() == 0 ? flying() : Sample{}, ranks);
          const std::lock_guard lock(adding);
          for (const auto& [id, grain] : own.grains) all.insert({id, grain});
        });
        ASSERT_EQ(all.size(), one.grains.size()) << variant.name;
        for (const auto& [id, grain] : one.grains) {
          const auto& [x, velocity] = all.at(id);
          EXPECT_EQ(x, grain.first) << variant.name << ", " << count << " ranks";
          EXPECT_TRUE(std::equal(velocity.u, velocity.u + 3, grain.second.u)) << variant.name;
        }
      }
    }
}

/// Sheared and squeezed, fast enough to lean over by more than an edge.
Setup flowing(std::int64_t steps) {
  Setup setup = colliding(steps);
  setup.stages[0].strain_rates = {-1.5, 0.5, 0};
  setup.stages[0].shear_rates = {0, 16, 3};
  return setup;
}

/// Velocities against the homogeneous flow.
std::map<BodyId, Vec3> against_flow(const Setup& setup, const Vec3& shift) {
  graph::Executor executor({.threads = 1});
  Sample sample = flying(shift);
  Simulation simulation(setup, deal_out(std::move(sample), setup.decomposition, graph::one_rank()), executor);
  for (; !simulation.finished(); simulation.begin_next_stage()) EXPECT_TRUE(simulation.step().converged);
  const Domain& domain = simulation.state().domain;
  const Mat3 gradient = matrix_of(domain.rates) * edges_of(domain).inverse();
  std::map<BodyId, Vec3> found;
  const Bodies& bodies = simulation.state().bodies;
  for (std::size_t s = 0; s < bodies.size(); ++s)
    found[bodies.id[s]] =
        Eigen::Map<const Vec3>(bodies.velocity[s].u) - gradient * (bodies.x[s] - domain.low);
  return found;
}

TEST(PeriodicRun, ForcesInAFlowDoNotDependOnWhereTheFacesLie) {
  const talus::Setup setup = flowing(60);
  const std::map<BodyId, Vec3> one = against_flow(setup, Vec3::Zero());
  double scale = 0;
  for (const auto& [id, u] : one) scale = std::max(scale, u.norm());
  ASSERT_GT(scale, 0.1);
  for (const Vec3& shift : {Vec3(0.3 * edge, 0, 0), Vec3(0, 0, 0.45 * edge), Vec3(0.1, -0.05, 0.021)}) {
    const std::map<BodyId, Vec3> other = against_flow(setup, shift);
    double worst = 0;
    for (const auto& [id, u] : one) worst = std::max(worst, (other.at(id) - u).norm());
    EXPECT_LT(worst, 1e-5 * scale) << shift.transpose();
  }
}

TEST(PeriodicRun, FlowsToTheSameBitsOnAnyRanksAndThreads) {
  for (const std::size_t which : {3U, 1U, 7U}) {
    const auto& variant = decomposition_test::variants[which];
    talus::Setup setup = flowing(90);
    setup.solver.max_iterations = 40;
    setup.solver.overlap_correction = variant.coupling == Coupling::schwarz ? 0 : 0.1;
    decomposition_test::choose(setup, variant, 8);
    const Outcome one = simulate(setup, flying());
    EXPECT_EQ(simulate(setup, flying(), graph::one_rank(), 2).digest, one.digest) << variant.name;
    std::map<BodyId, std::pair<Vec3, Velocity>> all;
    std::mutex adding;
    graph::on_pretend_ranks(3, [&](const graph::Communicator& ranks) {
      const Outcome own = simulate(setup, ranks.rank() == 0 ? flying() : Sample{}, ranks);
      const std::lock_guard lock(adding);
      for (const auto& [id, grain] : own.grains) all.insert({id, grain});
    });
    for (const auto& [id, grain] : one.grains) EXPECT_EQ(all.at(id).first, grain.first) << variant.name;
  }
}

/// Pushed together by a stress while it is sheared.
Setup pushed(std::int64_t steps) {
  Setup setup = colliding(steps);
  setup.stages[0].stress.to = {2e3, 1e3, 1e3, std::nullopt, 5e2, std::nullopt};
  setup.stages[0].shear_rates = {4, 0, 0};
  setup.decomposition.coupling = Coupling::nscdd;
  return setup;
}

TEST(PeriodicRun, ForcesUnderAStressDoNotDependOnWhereTheFacesLie) {
  talus::Setup setup = pushed(60);
  setup.solver.tolerance = 1e-12;  // collisions amplify what it leaves by 10^5
  const std::map<BodyId, Vec3> one = against_flow(setup, Vec3::Zero());
  double scale = 0;
  for (const auto& [id, u] : one) scale = std::max(scale, u.norm());
  ASSERT_GT(scale, 0.1);
  for (const Vec3& shift : {Vec3(0.3 * edge, 0, 0), Vec3(0.1, -0.05, 0.021)}) {
    const std::map<BodyId, Vec3> other = against_flow(setup, shift);
    double worst = 0;
    for (const auto& [id, u] : one) worst = std::max(worst, (other.at(id) - u).norm());
    EXPECT_LT(worst, 1e-6 * scale) << shift.transpose();
  }
}

// Nothing says where a cell stands: a sample that drifts is as far from equilibrium as one that does not.
TEST(PeriodicRun, DriftIsNoUnrest) {
  talus::Setup setup = colliding(20);
  setup.stages[0].stress.to = {1e3, 1e3, 1e3, std::nullopt, std::nullopt, std::nullopt};
  setup.decomposition.coupling = Coupling::nscdd;
  Sample drifting = flying();
  for (auto& velocity : drifting.velocity) velocity[1] += 30;
  graph::Executor executor({.threads = 1});
  Simulation one(setup, deal_out(flying(), setup.decomposition, graph::one_rank()), executor),
      other(setup, deal_out(std::move(drifting), setup.decomposition, graph::one_rank()), executor);
  for (int step = 0; step < 20; ++step) {
    const double still = one.step().equilibrium;
    ASSERT_GT(still, 0);
    EXPECT_NEAR(other.step().equilibrium, still, 1e-6 * still) << step;
  }
}

/// Grains that a stress pushes together, and grains that are squeezed, while they are sheared.
struct DenseFlow {
  const char* name;
  talus::Setup setup;
};

std::vector<DenseFlow> dense_flows() {
  talus::Setup stressed = pushed(280);      // later it is pressed to less than two diameters
  stressed.stages[0].stress.to[4].reset();  // beyond what friction bears it would speed up for ever
  stressed.stages[0].shear_rates = {0, 4, 0};
  talus::Setup strained = colliding(300);
  strained.stages[0].shear_rates = {0, 4, 0};
  const double rate = -0.1 / (150 * strained.stages[0].time_step);
  strained.stages.insert(strained.stages.begin(), strained.stages[0]);
  strained.stages[0].end.steps = 150;
  strained.stages[0].strain_rates = {rate, rate, rate};
  std::vector<DenseFlow> flows{{"stressed", stressed}, {"strained", strained}};
  for (auto& [name, setup] : flows) {
    for (Stage& stage : setup.stages) stage.laws = laws_of_one_material(0.3, 0, 0);
    setup.solver = {};
    setup.solver.overlap_tolerance = 1;
  }
  return flows;
}

/// What certified steps are off by, of the same steps solved nearly exactly.
struct Off {
  double stress = 0;    ///< relative
  double velocity = 0;  ///< mean momentum of the differences, over the rate of shear times a diameter
  double balance = 0;   ///< largest claim
  double sweeps = 0;    ///< of a step, mean
  int judged = 0;       ///< steps
};

Off off_in(const talus::Setup& setup) {
  talus::Setup exact = setup;
  exact.solver.tolerance = 1e-9;
  exact.solver.balance_tolerance = 1e-7;
  exact.solver.max_iterations = 100000;
  graph::Executor executor({.threads = 1});
  Simulation simulation(setup, deal_out(flying(), setup.decomposition, graph::one_rank()), executor);
  double mass = 0;
  for (const Velocity& v : simulation.state().bodies.velocity) mass += 1 / v.inv_mass;
  Off off;
  for (; !simulation.finished(); simulation.begin_next_stage()) {
    const bool looked_at = simulation.report().step % 20 == 19;
    const SavedState before = simulation.save();
    const StepReport& report = simulation.step();
    if (!report.converged || !looked_at || report.contacts < 300) continue;
    Simulation other(exact, before, executor);
    EXPECT_TRUE(other.step().converged);
    const StepState &found = simulation.state(), &truth = other.state();
    using Three = Eigen::Map<const Vec3>;
    const Three claimed(found.cell.impulse.data()), right(truth.cell.impulse.data());
    off.stress = std::max(off.stress, (claimed - right).norm() / right.norm());
    double error = 0;
    for (std::size_t s = 0; s < found.bodies.size(); ++s)
      error += (Three(found.bodies.velocity[s].u) - Three(truth.bodies.velocity[s].u)).norm() /
               found.bodies.velocity[s].inv_mass;
    off.velocity = std::max(off.velocity, error / (mass * 2 * radius * 4));
    off.balance = std::max(off.balance, report.balance);
    off.sweeps += report.iterations;
    ++off.judged;
  }
  off.sweeps /= std::max(off.judged, 1);
  return off;
}

/// What grains' velocities differ by is told in docs/certificate.md.
TEST(PeriodicRun, CertifiedStepsOfDenseFlowsHaveTheStressThatTheyClaim) {
  for (const auto& [name, setup] : dense_flows()) {
    const Off off = off_in(setup);
    EXPECT_GT(off.judged, 10) << name;
    EXPECT_LE(off.stress, 2 * setup.solver.balance_tolerance) << name;
    EXPECT_GT(off.balance, 1e-6) << name << ": the stress of the cell has a part in the claim";
    EXPECT_LE(off.velocity, 0.25) << name;
    RecordProperty(std::string(name) + "_stress", fmt::format("{}", off.stress));
    RecordProperty(std::string(name) + "_velocity", fmt::format("{}", off.velocity));
    RecordProperty(std::string(name) + "_sweeps", fmt::format("{}", off.sweeps));
  }
}

TEST(PeriodicRun, EverySubdomainCountFindsTheSameMotionUnderAStress) {
  const Outcome one = simulate(pushed(30), flying());
  for (const int subdomains : {2, 5, 8}) {
    talus::Setup setup = pushed(30);
    setup.decomposition.subdomains = subdomains;
    const Outcome other = simulate(setup, flying());
    EXPECT_EQ(other.contacts, one.contacts) << subdomains;
    for (const auto& [id, grain] : one.grains)
      // The cell has changed: across faces of its first edges a grain in one place would be in two.
      EXPECT_LT(one.domain.separation(other.grains.at(id).first, grain.first).norm(), 1e-5 * radius);
  }
}

TEST(PeriodicRun, EverySubdomainCountFindsTheSameMotion) {
  const Outcome one = simulate(colliding(30), flying());
  for (const int subdomains : {2, 5, 8}) {
    talus::Setup setup = colliding(30);
    setup.decomposition.subdomains = subdomains;
    const Outcome other = simulate(setup, flying());
    EXPECT_EQ(other.contacts, one.contacts) << subdomains;
    for (const auto& [id, grain] : one.grains)
      EXPECT_LT(setup.domain.separation(other.grains.at(id).first, grain.first).norm(), 1e-5 * radius);
  }
}

}  // namespace
}  // namespace talus::periodic_cell_test
