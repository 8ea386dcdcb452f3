/// Subdomains on one rank: the same numbers with any threads, the same physics as without them, and the cases
/// in which a cut goes through little or nothing.

#include "runtime/step/decomposition.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

#include "tests/unit/runtime/step/cut_boxes.hpp"

namespace talus::decomposition_test {
namespace {

TEST(ChunkTarget, IsSmallInSmallSamplesAndGrowsInLargeSubdomains) {
  EXPECT_EQ(chunk_target(0, 0), 64);
  EXPECT_EQ(chunk_target(9600, 9600), 300);
  EXPECT_EQ(chunk_target(16384, 200), 512);
  EXPECT_EQ(chunk_target(461699, 461699), 512);
  EXPECT_EQ(chunk_target(10000000, 461700), 513);
  EXPECT_EQ(chunk_target(10000000, 10000000), longest_chunk);
}

TEST(Decomposition, HasTheSameBitsWithAnyNumberOfThreads) {
  for (const Variant& variant : variants) {
    talus::Setup setup = pressed_box(0.3, 12);
    choose(setup, variant, 5);
    setup.solver.max_iterations = 40;
    const Outcome one = run(setup, lattice(6, 1));
    for (int threads : {2, 3})
      EXPECT_EQ(run(setup, lattice(6, 1), {.threads = threads}).digest, one.digest)
          << variant.name << ", " << threads;
    EXPECT_EQ(run(setup, lattice(6, 1), {.threads = 2, .delay_seed = 7}).digest, one.digest) << variant.name;
  }
}

TEST(Decomposition, HasTheSameBitsWithInnerChunksBehindTheExchange) {
  for (const Variant& variant : {variants[0], variants[3]}) {
    talus::Setup setup = pressed_box(0.3, 8);
    choose(setup, variant, 4);
    const Outcome overlapped = run(setup, lattice(6, 9), {.threads = 2});
    setup.decomposition.overlap = false;
    EXPECT_EQ(run(setup, lattice(6, 9), {.threads = 2}).digest, overlapped.digest) << variant.name;
  }
}

TEST(Decomposition, GivesTheForcesOfTheSequentialSolver) {
  // Frictionless and pressed from three sides: the forces on the walls and the energy are unique.
  talus::Setup setup = pressed_box(0, 12);  // in later steps rounding decides whether two grains meet
  setup.solver.tolerance = 1e-6;
  setup.solver.balance_tolerance = 1e-5;
  setup.solver.max_iterations = 200000;
  setup.solver.overlap_tolerance = 1;  // loose grains are thrown together in few steps
  const Outcome whole = run(setup, lattice(6, 2));
  ASSERT_EQ(whole.unconverged, 0);
  for (const Variant& variant : variants)
    for (int subdomains : {2, 12}) {
      choose(setup, variant, subdomains);
      const Outcome cut = run(setup, lattice(6, 2));
      const std::string label = std::string(variant.name) + ", " + std::to_string(subdomains);
      EXPECT_EQ(cut.unconverged, 0) << label;
      EXPECT_NEAR(cut.last.kinetic_translation, whole.last.kinetic_translation,
                  1e-3 * whole.last.kinetic_translation)
          << label;
      for (std::size_t w = 0; w < whole.walls.size(); ++w)
        EXPECT_NEAR(cut.walls[w].position, whole.walls[w].position, 1e-6)
            << label << ", wall " << whole.walls[w].name;
      EXPECT_GT(cut.last.contacts, 300) << label;
      EXPECT_NEAR(cut.coordination, whole.coordination, 0.05) << label;
    }
}

TEST(Decomposition, ExchangesInEverySweepWhereSubdomainsAlternate) {
  talus::Setup setup = pressed_box(0.3, 2);
  choose(setup, variants[3], 4);
  setup.decomposition.sweeps_per_exchange = 2;
  EXPECT_THROW(validate(setup), std::invalid_argument);
}

/// Four spheres in a row that run into one another, in eight steps. Cut in two the middle ones stand in both.
struct ARow {
  talus::Setup setup;
  Bodies bodies;

  explicit ARow(double restitution) {
    Stage stage;
    stage.name = "collide";
    stage.time_step = 1e-3;
    stage.laws = laws_of_one_material(0.4, 0, restitution);
    stage.end.steps = 8;
    setup.stages = {stage};
    for (int k = 0; k < 4; ++k) {
      add_sphere(bodies, BodyId{k}, Vec3(0.0199 * k, 1e-3 * k, 0), 0.01, 1000.0 * (k + 1));
      bodies.velocity.back().u[0] = 2 - k;
      bodies.velocity.back().u[1] = 0.3 * k;
    }
  }
};

TEST(Decomposition, ConservesMomentumAcrossABorder) {
  for (const Variant& variant : variants)
    for (bool damping : {true, false}) {
      auto [setup, bodies] = ARow(0);
      setup.solver.max_iterations = 7;  // a solution that is not finished conserves it too
      choose(setup, variant, 2);
      setup.decomposition.damping = damping;
      Vec3 before = Vec3::Zero(), after = Vec3::Zero();
      for (std::size_t k = 0; k < 4; ++k)
        before += bodies.mass(k) * Eigen::Map<const Vec3>(bodies.velocity[k].u);
      graph::Executor executor({.threads = 1});
      Simulation simulation(setup, bodies, executor);
      while (!simulation.finished()) {
        simulation.step();
        simulation.begin_next_stage();
      }
      const Frame frame = simulation.frame();
      ASSERT_EQ(frame.id.size(), 4u);
      for (std::size_t k = 0; k < 4; ++k) after += bodies.mass(k) * frame.u[k];
      EXPECT_LT((after - before).norm(), 1e-14 * before.norm())
          << variant.name << (damping ? "" : ", undamped");
      EXPECT_GT(std::abs(frame.u[0][0] - 2), 0.1) << "they are to collide";
    }
}

TEST(Decomposition, LeavesNoForceBetweenGrainsThatHaveParted) {
  const auto contacts_that_carry = [](const Variant* variant) {
    auto [setup, bodies] = ARow(0.5);
    setup.solver.direct_bodies = 0;  // answers of small clusters end at 0
    if (variant != nullptr) choose(setup, *variant, 2);
    graph::Executor executor({.threads = 1});
    Simulation simulation(setup, bodies, executor);
    std::vector<std::int64_t> active;
    while (!simulation.finished()) {
      active.push_back(simulation.step().active);
      simulation.begin_next_stage();
    }
    return active;
  };
  const std::vector<std::int64_t> whole = contacts_that_carry(nullptr);
  ASSERT_GT(whole.front(), 0);
  ASSERT_EQ(whole.back(), 0) << "they are to part";
  for (const Variant& variant : variants) EXPECT_EQ(contacts_that_carry(&variant), whole) << variant.name;
}

// A pressed block drifts with its walls through the cuts, which stay where they are: the contact problem is
// that of the block at rest, and impulses that travelled with their contacts all but solve it before the
// first sweep.
TEST(Decomposition, LetsBodiesMigrateAndKeepsTheirContactsMemory) {
  struct Late {
    std::int64_t migrants = 0;
    double staying = 0,
           migrating = 0;  ///< largest error before a first sweep, of steps without migrants and with
  };
  const auto run_late = [](double drift, bool warm_start) {
    talus::Setup setup = pressed_box(0.3, 250);
    setup.stages[0].laws.between(material_of_grains, material_of_walls).friction =
        0;  // the pushed ones do not come along
    choose(setup, variants[0], 8);
    setup.decomposition.repartition_every = 1000000;
    setup.decomposition.max_imbalance = 100;
    setup.solver.warm_start = warm_start;
    for (Wall& wall : setup.walls) {
      wall.velocity[0] += drift;
      if (wall.load.pushed()) continue;
      wall.load.drive = WallDrive::velocity;
      wall.load.velocity[0] += drift;
    }
    Bodies bodies = lattice(6, 3);
    for (Velocity& v : bodies.velocity) v.u[0] += drift;
    graph::Executor executor({.threads = 1});
    Simulation simulation(setup, std::move(bodies), executor);
    Late late;
    while (!simulation.finished()) {
      const StepReport& report = simulation.step();
      if (report.step > 100) {  // pressed together by now
        late.migrants += report.migrants;
        double& worst = report.migrants > 0 ? late.migrating : late.staying;
        worst = std::max(worst, simulation.error_history().front().error_rms);
      }
      simulation.begin_next_stage();
    }
    return late;
  };
  const Late moved = run_late(0.3, true);
  EXPECT_GT(moved.migrants, 30);
  EXPECT_LT(moved.migrating, 2 * moved.staying);
  EXPECT_LT(moved.migrating, 0.03);
  EXPECT_GT(run_late(0, false).staying, 0.9) << "memory is to matter";
}

TEST(Decomposition, NamesTheDivergenceOfUndampedSchwarz) {
  talus::Setup setup = pressed_box(0.3, 20);
  choose(setup, variants[6], 27);
  setup.decomposition.damping = false;
  setup.solver.tolerance = 1e-6;
  try {
    run(setup, lattice(6, 4));
    FAIL() << "27 subdomains of 8 grains each, and undamped Schwarz converged";
  } catch (const RunawayError& error) {
    EXPECT_NE(std::string(error.what()).find("damping"), std::string::npos) << error.what();
  }
}

TEST(Decomposition, SendsWhatTheFormulaSays) {
  // Grains on a line cut in four: three borders, each with two shared bodies when contacts lie on both sides.
  talus::Setup setup;
  Stage stage;
  stage.name = "rest";
  stage.time_step = 1e-3;
  stage.laws = laws_of_one_material(0.3, 0, 0);
  stage.end.steps = 1;
  setup.stages = {stage};
  setup.decomposition.subdomains = 4;
  setup.decomposition.partitioner = PartitionKind::boxes;
  setup.decomposition.boxes = {4, 1, 1};
  Bodies bodies;
  for (int k = 0; k < 17; ++k) add_sphere(bodies, BodyId{k}, Vec3(0.02 * k, 0, 0), 0.01, 2600);
  graph::Executor executor({.threads = 1});
  {
    Simulation simulation(setup, bodies, executor);
    simulation.step();
    EXPECT_EQ(simulation.messages().messages, 6) << "one each way over three borders";
    EXPECT_EQ(simulation.messages().bytes, 6 * 6 * 8) << "the one grain astride, 6 numbers";
    EXPECT_EQ(simulation.messages().between_ranks, 0);
  }
  setup.decomposition.exchange = ExchangeScheme::ccs;
  Simulation simulation(setup, bodies, executor);
  simulation.step();
  EXPECT_EQ(simulation.messages().messages, 8) << "to the root and back, per subdomain";
  EXPECT_EQ(simulation.messages().bytes, 2 * 6 * 6 * 8) << "the same velocities, each once up and once down";
}

TEST(Decomposition, AWallOfKSubdomainsCostsKMessagesNotKSquared) {
  std::int64_t last = 0;
  for (int edge : {2, 4}) {
    talus::Setup setup = pressed_box(0, 1);
    setup.decomposition.subdomains = edge * edge;
    setup.decomposition.partitioner = PartitionKind::boxes;
    setup.decomposition.boxes = {edge, edge, 1};
    setup.decomposition.exchange = ExchangeScheme::ccs;
    graph::Executor executor({.threads = 1});
    Simulation simulation(setup, lattice(6, 5), executor);
    simulation.step();
    EXPECT_EQ(simulation.messages().messages, 2 * edge * edge);
    EXPECT_GT(simulation.messages().messages, last);
    last = simulation.messages().messages;
  }
}

TEST(Decomposition, BearsSubdomainsWithLittleOrNothingInThem) {
  const auto rest = [](int subdomains, PartitionKind kind) {
    talus::Setup setup;
    setup.walls = {test::box_of_walls(0, 1)[4]};
    Stage stage;
    stage.name = "fall";
    stage.time_step = 1e-3;
    stage.gravity = Vec3(0, 0, -9.81);
    stage.laws = laws_of_one_material(0.3, 0.3, 0);
    stage.end.steps = 60;
    setup.stages = {stage};
    setup.decomposition.subdomains = subdomains;
    setup.decomposition.partitioner = kind;
    return setup;
  };
  for (PartitionKind kind :
       {PartitionKind::boxes, PartitionKind::fitted, PartitionKind::rcb, PartitionKind::metis}) {
    Bodies one;
    add_sphere(one, BodyId{7}, Vec3(0, 0, 0.0101), 0.01, 2600);
    const Outcome alone = run(rest(9, kind), one);
    EXPECT_EQ(alone.unconverged, 0) << name_of(kind);
    EXPECT_LT(alone.last.kinetic_translation, 1e-12) << name_of(kind);

    Bodies corner = lattice(3, 6);  // all in one corner, with a boulder larger than any subdomain on top
    add_sphere(corner, BodyId{100}, Vec3(0.03, 0.03, 0.4), 0.3, 2600);
    add_sphere(corner, BodyId{101}, Vec3(5, 5, 0.01), 0.01, 2600);
    const Outcome piled = run(rest(40, kind), corner);
    EXPECT_EQ(piled.unconverged, 0) << name_of(kind);
    EXPECT_EQ(run(rest(40, kind), corner, {.threads = 3}).digest, piled.digest) << name_of(kind);
  }
}

TEST(Decomposition, CarriesOrientationsAndStagesAlong) {
  talus::Setup setup = pressed_box(0, 10);
  Stage shear = setup.stages[0];
  shear.name = "shear";
  shear.laws = laws_of_one_material(0.4, 0.2, 0);
  shear.time_step = 5e-4;
  setup.stages.push_back(shear);
  setup.orientation = true;
  choose(setup, variants[0], 7);
  graph::Executor executor({.threads = 1});
  Simulation simulation(setup, lattice(6, 8), executor);
  while (!simulation.finished()) {
    simulation.step();
    simulation.begin_next_stage();
  }
  const Frame frame = simulation.frame();
  ASSERT_EQ(frame.orientation.size(), 216u);
  ASSERT_EQ(frame.id.size(), 216u);
  int turned = 0;
  for (std::size_t k = 0; k < 216; ++k) {
    EXPECT_EQ(frame.id[k], static_cast<std::int64_t>(k));
    turned += frame.orientation[k][0] < 1;
  }
  EXPECT_GT(turned, 100);
}

}  // namespace
}  // namespace talus::decomposition_test
