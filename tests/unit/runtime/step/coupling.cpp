/// Every coupling, exchange, partitioner and number of subdomains: the physics of the sample that was not
/// cut, and as many messages as the formulas say.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <map>
#include <set>
#include <string>

#include "runtime/step/simulation.hpp"
#include "tests/unit/dense_sample.hpp"

namespace talus {
namespace {

constexpr std::array all_couplings{Coupling::nscdd, Coupling::alternating, Coupling::schwarz};
constexpr std::array exchanges{ExchangeScheme::dcs, ExchangeScheme::ccs};
constexpr std::array partitioners{PartitionKind::boxes, PartitionKind::fitted, PartitionKind::rcb,
                                  PartitionKind::metis};

std::string label(const DecompositionSettings& settings) {
  return std::string(couplings().of(settings.coupling).name) +
         (settings.exchange == ExchangeScheme::dcs ? " dcs " : " ccs ") +
         std::string(name_of(settings.partitioner)) + " " + std::to_string(settings.subdomains);
}

/// Grains that touch and overlap and move at random, between three fixed walls and three that press.
talus::Setup pressed_lattice(int edge, double friction, std::int64_t steps) {
  talus::Setup setup = test::pressed_setup(test::box_of_walls(-0.5, edge - 0.5), friction, steps, 1e4, 1e4);
  setup.detection.alert = 0.02;
  return setup;
}

/// What does not depend on how the impulses are spread over redundant contacts.
struct Aggregates {
  double kinetic = 0;          ///< [J]
  double normal_impulse = 0;   ///< sum of r_n [N s]
  double moment = 0;           ///< trace of sum r (x) l: 3 p V h [N s m]
  std::vector<double> forces;  ///< of the walls [N]
  double contacts_per_grain = 0;
  bool converged = true;
};

Aggregates aggregates_after(const talus::Setup& setup, const Bodies& bodies) {
  graph::Executor executor({.threads = 1});
  Simulation simulation(setup, bodies, executor);
  Aggregates result;
  while (!simulation.finished()) {
    const StepReport& report = simulation.step();
    result.converged = result.converged && report.converged;
    result.kinetic = report.kinetic_translation + report.kinetic_rotation;
    result.contacts_per_grain = 2 * static_cast<double>(report.contacts) / static_cast<double>(bodies.size());
    result.normal_impulse = simulation.sums().contacts.normal_impulse;
    result.moment = simulation.sums().contacts.moment.trace();
    simulation.begin_next_stage();
  }
  for (const WallReport& wall : simulation.walls()) {
    result.forces.push_back(wall.force.norm());
  }
  return result;
}

void expect_same(const Aggregates& cut, const Aggregates& whole, double tolerance, const std::string& label) {
  EXPECT_TRUE(cut.converged) << label;
  EXPECT_NEAR(cut.kinetic, whole.kinetic, 1e-2 * tolerance * whole.kinetic) << label;
  EXPECT_NEAR(cut.normal_impulse, whole.normal_impulse, tolerance * whole.normal_impulse) << label;
  EXPECT_NEAR(cut.moment, whole.moment, tolerance * whole.moment) << label;
  EXPECT_EQ(cut.contacts_per_grain, whole.contacts_per_grain) << label;
  ASSERT_EQ(cut.forces.size(), whole.forces.size()) << label;
  for (std::size_t w = 0; w < whole.forces.size(); ++w)
    EXPECT_NEAR(cut.forces[w], whole.forces[w], tolerance * whole.forces[w]) << label << ", wall " << w;
}

class EveryCoupling : public testing::TestWithParam<int> {};

TEST_P(EveryCoupling, GivesTheAggregatesOfTheSequentialSolver) {
  // Little or no friction: energy and forces on the walls are unique, so that they agree as far as the
  // tolerance lets them; by how much depends on the compiler (1.01e-5 with clang, less than 1e-5 with g++).
  for (const double friction : {0.0, 0.05}) {
    talus::Setup setup = pressed_lattice(6, friction, 2);
    setup.solver.method = SolverMethod::nlgs;
    setup.solver.tolerance = 1e-9;
    setup.solver.max_iterations = 100000;
    const Bodies bodies = test::jittered_lattice(6, 3);
    const Aggregates whole = aggregates_after(setup, bodies);
    ASSERT_TRUE(whole.converged);
    EXPECT_GT(whole.contacts_per_grain, 5);
    setup.decomposition.subdomains = GetParam();
    for (const Coupling coupling : all_couplings)
      for (const ExchangeScheme exchange : exchanges)
        for (const PartitionKind partitioner : partitioners) {
          setup.decomposition.coupling = coupling;
          setup.decomposition.exchange = exchange;
          setup.decomposition.partitioner = partitioner;
          expect_same(aggregates_after(setup, bodies), whole, 2e-5,
                      label(setup.decomposition) + " mu " + std::to_string(friction));
        }
  }
}

INSTANTIATE_TEST_SUITE_P(OfSubdomains, EveryCoupling, testing::Values(2, 4, 8, 12, 16, 96),
                         [](const auto& n) { return std::to_string(n.param); });

TEST(Coupling, TakesHardlyMoreSweepsThanOneSubdomainWhereSubdomainsAlternate) {
  // 27 subdomains of some 50 grains: most contacts are at a border.
  talus::Setup setup = pressed_lattice(11, 0.3, 1);
  for (auto& [wall, load] : setup.stages[0].loads) load.mass = 1e7;
  setup.solver.tolerance = 1e-4;
  setup.solver.balance_tolerance = 1e9;
  // Sweeps of one sample scatter by a factor of two, whatever the subdomains: the mean of several tells.
  constexpr int samples = 9;
  const auto log_sweeps = [&](Coupling coupling, PartitionKind partitioner, int subdomains) {
    setup.decomposition.coupling = coupling;
    setup.decomposition.partitioner = partitioner;
    setup.decomposition.subdomains = subdomains;
    double sum = 0;
    for (int sample = 0; sample < samples; ++sample) {
      graph::Executor executor({.threads = 1});
      Simulation simulation(setup, test::jittered_lattice(11, 3 + static_cast<unsigned>(sample), 0),
                            executor);
      const StepReport& report = simulation.step();
      EXPECT_TRUE(report.converged);
      sum += std::log(report.iterations);
    }
    return sum / samples;
  };
  const double whole = log_sweeps(Coupling::nscdd, PartitionKind::boxes, 1);
  double more = 0;
  for (const PartitionKind partitioner : partitioners) {
    const double together = log_sweeps(Coupling::nscdd, partitioner, 27),
                 alternating = log_sweeps(Coupling::alternating, partitioner, 27);
    EXPECT_LT(alternating, together) << name_of(partitioner);
    more += (alternating - whole) / partitioners.size();
  }
  EXPECT_LE(std::exp(more), 1.2);
}

TEST(Coupling, SubdomainsSweepGluedWallsFirstAndWaitForNobodyThere) {
  for (const Coupling coupling : {Coupling::alternating, Coupling::nscdd}) {
    talus::Setup setup = pressed_lattice(6, 0.3, 1);
    setup.decomposition.coupling = coupling;
    setup.decomposition.partitioner = PartitionKind::boxes;
    setup.decomposition.subdomains = 8;
    graph::Executor executor({.threads = 1});
    Simulation simulation(setup, test::jittered_lattice(6, 3), executor);
    simulation.step();
    const StepState& state = simulation.state();
    const Chunks& chunks = state.chunks;
    std::array<int, 4> of_side{};
    std::int32_t last_of_walls = -1, first_of_others = chunks.colours;
    for (std::size_t c = 0; c < chunks.size(); ++c) {
      ++of_side[static_cast<std::size_t>(chunks.side[c])];
      const bool glued =
          chunks.wall[c] >= 0 && state.walls[static_cast<std::size_t>(chunks.wall[c])].inv_mass() > 0;
      EXPECT_EQ(chunks.side[c] == ChunkSide::wall, glued);
      if (!glued) {
        first_of_others = std::min(first_of_others, chunks.colour[c]);
        continue;
      }
      last_of_walls = std::max(last_of_walls, chunks.colour[c]);
      for (auto k = chunks.body_begin[c]; k < chunks.body_begin[c + 1] && !state.decomposition.taken.empty();
           ++k)
        EXPECT_EQ(
            state.decomposition.taken[static_cast<std::size_t>(chunks.bodies[static_cast<std::size_t>(k)])],
            0);
    }
    EXPECT_LT(last_of_walls, first_of_others);
    EXPECT_GT(of_side[static_cast<std::size_t>(ChunkSide::wall)], 8);
    EXPECT_GT(of_side[static_cast<std::size_t>(ChunkSide::border)], 0);
    EXPECT_EQ(of_side[static_cast<std::size_t>(ChunkSide::late)] > 0, coupling == Coupling::alternating);
  }
}

/// From the incidences of bodies alone: who shares one with whom, and how often a body is told.
struct Formula {
  std::int64_t messages = 0, bytes = 0;
};

Formula formula(const StepState& state, std::size_t numbers, std::int64_t glued_walls,
                std::size_t hubs_from) {
  const Decomposition& all = state.decomposition;
  std::map<BodyId, std::vector<std::size_t>> incidences;
  for (std::size_t e = 0; e + 1 < all.slot_begin.size(); ++e)
    for (std::size_t s = all.slot_begin[e]; s < all.slot_begin[e + 1]; ++s)
      incidences[state.bodies.id[s]].push_back(e);
  std::set<std::pair<std::size_t, std::size_t>> pairs;
  std::set<std::size_t> to_the_root;
  std::int64_t told = 0, gathered = 0;  // bodies, over all messages between two subdomains; to the root
  for (const auto& [id, in] : incidences) {
    const std::size_t m = in.size();
    if (m < 2) continue;
    if (m >= hubs_from) {
      gathered += static_cast<std::int64_t>(m);
      to_the_root.insert(in.begin(), in.end());
      continue;
    }
    told += static_cast<std::int64_t>(m * (m - 1));
    for (std::size_t a : in)
      for (std::size_t b : in)
        if (a != b) pairs.emplace(a, b);
  }
  const auto subdomains = static_cast<std::int64_t>(all.slot_begin.size() - 1);
  const auto body = static_cast<std::int64_t>(8 * numbers);
  Formula sent;
  sent.messages = static_cast<std::int64_t>(pairs.size()) +
                  2 * (glued_walls > 0 ? subdomains : static_cast<std::int64_t>(to_the_root.size()));
  sent.bytes = body * told + 2 * (body * gathered + 3 * 8 * glued_walls * subdomains);
  return sent;
}

TEST(Coupling, SendsWhatTheClosedFormulasSay) {
  const Bodies bodies = test::jittered_lattice(6, 5);
  for (const double friction : {0.0, 0.2})
    for (const bool pressed : {true, false})
      for (const int subdomains : {2, 8, 27, 96})
        for (const Coupling coupling : all_couplings)
          for (const ExchangeScheme exchange : exchanges) {
            talus::Setup setup = pressed_lattice(6, friction, 1);
            if (!pressed) setup.stages[0].loads.clear();
            setup.solver.max_iterations = 1;
            setup.decomposition.subdomains = subdomains;
            setup.decomposition.coupling = coupling;
            setup.decomposition.exchange = exchange;
            setup.decomposition.partitioner = PartitionKind::rcb;
            graph::Executor executor({.threads = 1});
            Simulation simulation(setup, bodies, executor);
            simulation.step();
            const Formula expected = formula(simulation.state(), friction > 0 ? 6 : 3, pressed ? 3 : 0,
                                             exchange == ExchangeScheme::ccs     ? 2
                                             : coupling == Coupling::alternating ? 33
                                                                                 : 9);
            const std::string what = label(setup.decomposition) + (pressed ? " pressed" : "");
            EXPECT_EQ(simulation.messages().messages, expected.messages) << what;
            EXPECT_EQ(simulation.messages().bytes, expected.bytes) << what;
            EXPECT_GT(expected.bytes, 0) << what;
          }
}

TEST(Coupling, BeginsWithTheMotionThatTheSampleHas) {
  // Grains in flight, no contact: the first step, in which they are dealt out, moves them like any other.
  talus::Setup setup;
  Stage stage;
  stage.name = "fly";
  stage.time_step = 1e-3;
  stage.end.steps = 2;
  setup.stages = {stage};
  setup.decomposition.subdomains = 5;
  Bodies bodies;
  for (int k = 0; k < 20; ++k) {
    add_sphere(bodies, BodyId{k}, Vec3(k, 0.1 * k, 0), 0.1, 1000);
    bodies.velocity.back().u[1] = 0.5 * k;
  }
  graph::Executor executor({.threads = 1});
  Simulation simulation(setup, bodies, executor);
  simulation.step();
  const Frame first = simulation.frame();
  for (std::size_t k = 0; k < 20; ++k)
    EXPECT_NEAR(first.x[k][1], 0.1005 * static_cast<double>(k), 1e-14) << k;
}

TEST(Coupling, KeepsTheMomentumOfTwoSpheresThatMeetAtABorder) {
  // One on each side of the cut and a third that leans on the second, so that the second stands in both.
  for (const Coupling coupling : all_couplings)
    for (const ExchangeScheme exchange : exchanges)
      for (const bool damping : {true, false}) {
        talus::Setup setup;
        Stage stage;
        stage.name = "meet";
        stage.time_step = 1e-3;
        stage.laws = laws_of_one_material(0.3, 0, 0.5);
        stage.end.steps = 6;
        setup.stages = {stage};
        setup.solver.max_iterations = 3;
        setup.decomposition = {.coupling = coupling,
                               .exchange = exchange,
                               .partitioner = PartitionKind::boxes,
                               .subdomains = 2,
                               .boxes = {2, 1, 1},
                               .damping = damping};
        Bodies bodies;
        const double density[3] = {1000, 7000, 300};
        for (int k = 0; k < 3; ++k)
          add_sphere(bodies, BodyId{k}, Vec3(0.0201 * k, 5e-3 * (k == 1), 0), 0.01, density[k]);
        bodies.velocity[0].u[0] = 1.5;
        bodies.velocity[2].u[0] = -2;
        bodies.velocity[2].u[1] = 0.4;
        Vec3 before = Vec3::Zero(), after = Vec3::Zero();
        double size = 0;
        for (std::size_t k = 0; k < 3; ++k) {
          const Vec3 momentum = bodies.mass(k) * Eigen::Map<const Vec3>(bodies.velocity[k].u);
          before += momentum;
          size += momentum.norm();
        }
        graph::Executor executor({.threads = 1});
        Simulation simulation(setup, bodies, executor);
        bool astride = false;
        while (!simulation.finished()) {
          simulation.step();
          for (std::uint16_t m : simulation.state().decomposition.multiplicity) astride = astride || m > 1;
          simulation.begin_next_stage();
        }
        const Frame frame = simulation.frame();
        for (std::size_t k = 0; k < 3; ++k) after += bodies.mass(k) * frame.u[k];
        EXPECT_TRUE(astride);
        EXPECT_LT((after - before).norm(), 1e-14 * size) << label(setup.decomposition) << damping;
        EXPECT_GT(std::abs(frame.u[1][0]), 0.01) << "they are to meet";
      }
}

// What undoes overlaps, and what carries velocities on with restitution, is glued: no copy goes its own way.
TEST(Coupling, KeepsTheCopiesOfABodyInOnePlace) {
  for (const Coupling coupling : {Coupling::nscdd, Coupling::alternating})
    for (const ExchangeScheme exchange : exchanges) {
      talus::Setup setup = pressed_lattice(6, 0.3, 5);
      setup.stages[0].laws.set_all(&PairLaw::restitution, 0.4);
      setup.solver.overlap_correction = 0.3;
      setup.decomposition.coupling = coupling;
      setup.decomposition.exchange = exchange;
      setup.decomposition.subdomains = 12;
      graph::Executor executor({.threads = 1});
      Simulation simulation(setup, test::jittered_lattice(6, 3), executor);
      for (int k = 0; k < 5; ++k) simulation.step();
      const Bodies& bodies = simulation.state().bodies;
      std::map<BodyId, std::size_t> first;
      std::size_t copies = 0;
      for (std::size_t s = 0; s < bodies.size(); ++s) {
        const auto [at, fresh] = first.emplace(bodies.id[s], s);
        if (fresh) continue;
        ++copies;
        EXPECT_EQ(bodies.x[s], bodies.x[at->second]) << label(setup.decomposition);
        for (int c = 0; c < 3; ++c) {
          EXPECT_EQ(bodies.velocity[s].u[c], bodies.velocity[at->second].u[c]) << label(setup.decomposition);
          EXPECT_EQ(bodies.velocity[s].w[c], bodies.velocity[at->second].w[c]) << label(setup.decomposition);
        }
      }
      EXPECT_GT(copies, 50u);
    }
}

TEST(Coupling, HoldsGrainsThatTouchNothingButWalls) {
  // No two grains meet: every subdomain has contacts with the floor and the lid only, and a weight on them.
  talus::Setup setup;
  const std::vector<Wall> box = test::box_of_walls(0, 0.02);
  setup.walls = {box[4], box[5]};
  Stage stage;
  stage.name = "press";
  stage.time_step = 1e-3;
  stage.laws = laws_of_one_material(0, 0, 0);
  stage.end.steps = 5;
  WallLoad load;
  load.drive = WallDrive::force;
  load.force = 50;
  load.mass = 1;
  stage.loads = {{"z+", load}};
  setup.stages = {stage};
  setup.solver.tolerance = 1e-10;
  setup.solver.balance_tolerance = 1e-8;
  Bodies bodies;
  for (int k = 0; k < 25; ++k)
    add_sphere(bodies, BodyId{k}, Vec3(0.1 * (k % 5), 0.1 * (k / 5), 0.01), 0.01, 2600);
  for (const Coupling coupling : all_couplings)
    for (const ExchangeScheme exchange : exchanges)
      for (const int subdomains : {1, 7, 40}) {
        setup.decomposition.subdomains = subdomains;
        setup.decomposition.coupling = coupling;
        setup.decomposition.exchange = exchange;
        const Aggregates pressed = aggregates_after(setup, bodies);
        EXPECT_TRUE(pressed.converged) << label(setup.decomposition);
        EXPECT_NEAR(pressed.forces[0], 50, 1e-5) << label(setup.decomposition);
        EXPECT_NEAR(pressed.forces[1], 50, 1e-5) << label(setup.decomposition);
      }
}

}  // namespace
}  // namespace talus
