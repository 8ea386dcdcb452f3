#include "runtime/step/simulation.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <iterator>
#include <set>
#include <span>
#include <utility>

#include "runtime/graph/one_rank.hpp"
#include "runtime/step/task_kinds.hpp"
#include "tests/unit/runtime/step/loose_scenes.hpp"

namespace talus::simulation_test {
namespace {

// Inside a TEST, Setup is a private name of GoogleTest: there it is spelled talus::Setup.

/// 576 grains between three fixed and three pressed walls: squeezed without friction, held with it, then
/// sheared by the top wall; few iterations, so that the bits also are those of an unfinished solution.
Setup press_and_shear() {
  talus::Setup setup;
  setup.walls = box(8 * 2.1 * radius, 8 * 2.1 * radius, 9 * 2.1 * radius);
  Stage squeeze = stage("squeeze", 25), hold = stage("hold", 10), shear = stage("shear", 10);
  for (const char* name : {"x+", "y+", "z+"}) squeeze.loads.push_back({name, pressed(2e4)});
  hold.laws = laws_of_one_material(0.35, 0.2, 0);
  hold.gravity = Vec3(0, 0, -9.81);
  shear.laws = laws_of_one_material(0.35, 0, 0);
  WallLoad down;
  down.drive = WallDrive::velocity;
  down.velocity = Vec3(0, 0, -0.3);
  shear.loads.push_back({"z+", down});
  setup.stages = {squeeze, hold, shear};
  setup.solver.max_iterations = 60;
  return setup;
}

/// What a run leaves, to the bit.
struct Outcome {
  std::uint64_t state = 0;                 ///< of the last step
  std::vector<std::uint64_t> certificate;  ///< error, wall force and iterations of every step
  int broad_phases = 0;
  int repairs = 0;  ///< chunks whose contacts changed in part
  std::int64_t contacts = 0;
  bool operator==(const Outcome&) const = default;
};

/// Chunks in which some contacts came or went, and all others but as many stand where they did.
int repairs(const StepState& state, const Contacts& before) {
  int count = 0;
  for (std::size_t c = 0; c < state.chunks.size(); ++c) {
    const auto contacts = [&](const Contacts& of) {
      return std::span(of.candidate)
          .subspan(static_cast<std::size_t>(state.chunks.begin[c]), static_cast<std::size_t>(of.count[c]));
    };
    const std::span was = contacts(before), is = contacts(state.contacts);
    const std::set<std::int32_t> had(was.begin(), was.end()), has(is.begin(), is.end());
    std::vector<std::int32_t> changed;
    std::ranges::set_symmetric_difference(had, has, std::back_inserter(changed));
    std::size_t moved = 0;
    for (std::size_t k = 0; k < std::min(was.size(), is.size()); ++k) moved += was[k] != is[k];
    count += state.chunks.wall[c] < 0 && !changed.empty() && moved <= changed.size();
  }
  return count;
}

Outcome run(const Setup& setup, Bodies bodies, graph::ExecutorOptions options) {
  graph::Executor executor(options);
  Simulation simulation(setup, std::move(bodies), executor);
  Outcome outcome;
  while (!simulation.finished()) {
    const Contacts before = simulation.state().contacts;
    const StepReport& report = simulation.step();
    if (!simulation.sums().broad_phase) outcome.repairs += repairs(simulation.state(), before);
    for (double value : {report.error_rms, report.error_max, report.balance, report.kinetic_translation,
                         report.kinetic_rotation, report.penetration_mean, report.penetration_max,
                         static_cast<double>(report.iterations), static_cast<double>(report.active)})
      outcome.certificate.push_back(std::bit_cast<std::uint64_t>(value));
    for (const WallReport& wall : simulation.walls())
      for (double value : {wall.position, wall.velocity, wall.force[0], wall.force[1], wall.force[2]})
        outcome.certificate.push_back(std::bit_cast<std::uint64_t>(value));
    if (const auto triaxial = simulation.triaxial())
      for (double stress : triaxial->stress)
        outcome.certificate.push_back(std::bit_cast<std::uint64_t>(stress));
    outcome.broad_phases += simulation.sums().broad_phase;
    outcome.contacts = report.contacts;
    simulation.begin_next_stage();
  }
  outcome.state = digest(simulation.state().bodies);
  return outcome;
}

TEST(Simulation, HasTheSameBitsWithAnyNumberOfThreads) {
  const talus::Setup setup = press_and_shear();
  const Outcome one = run(setup, loose_sample(8, 8, 9, 1), {.threads = 1});
  EXPECT_GT(one.broad_phases, 4) << "candidates are to change within the run";
  EXPECT_GT(one.contacts, 800) << "the sample is to be dense in the end";
  EXPECT_GT(one.repairs, 20) << "groups are to be repaired within the run";
  for (int threads : {2, 3, 4, 8})
    EXPECT_TRUE(run(setup, loose_sample(8, 8, 9, 1), {.threads = threads}) == one) << threads << " threads";
}

TEST(Simulation, HasTheSameBitsWhenTasksAreDelayedAtRandom) {
  talus::Setup setup = press_and_shear();
  setup.solver.max_iterations = 12;
  setup.stages[0].end.steps = 16;
  setup.stages[1].end.steps = 4;
  setup.stages[2].end.steps = 4;
  const Outcome one = run(setup, loose_sample(8, 8, 9, 2), {.threads = 1});
  for (std::uint64_t seed : {1, 2, 3})
    EXPECT_TRUE(run(setup, loose_sample(8, 8, 9, 2),
                    {.threads = 2 + static_cast<int>(seed % 2), .delay_seed = seed}) == one)
        << "seed " << seed;
}

TEST(Simulation, HasTheSameBitsWhereMemoryIsGivenBackBetweenSteps) {
  talus::Setup setup = press_and_shear();
  setup.solver.max_iterations = 12;
  setup.solver.overlap_correction = 0.1;
  for (Stage& stage : setup.stages) stage.end.steps = 4;
  const auto digest_of = [&](bool releases) {
    graph::Executor executor({.threads = 1});
    Simulation simulation(setup, loose_sample(8, 8, 9, 4), executor);
    while (!simulation.finished()) {
      simulation.step();
      if (releases) simulation.release_room();
      EXPECT_EQ(simulation.frame().id.size(), 576u);
      simulation.begin_next_stage();
      if (releases) simulation.release_room();
    }
    return simulation.digest();
  };
  EXPECT_EQ(digest_of(true), digest_of(false));
}

TEST(Simulation, DoesNotDependOnTheOrderInWhichBodiesAreGiven) {
  const talus::Setup setup = press_and_shear();
  Bodies shuffled = loose_sample(8, 8, 9, 3);
  std::vector<Slot> order(shuffled.size());
  for (std::size_t k = 0; k < order.size(); ++k) order[k] = static_cast<Slot>(order.size() - 1 - k);
  reorder(shuffled, order);
  EXPECT_EQ(run(setup, shuffled, {}).state, run(setup, loose_sample(8, 8, 9, 3), {}).state);
}

TEST(Simulation, OfNoBodiesRunsItsSteps) {
  graph::Executor executor({.threads = 2});
  talus::Setup setup = falling(3);
  setup.walls = box(1, 1, 1);
  Simulation simulation(setup, Bodies{}, executor);
  while (!simulation.finished()) {
    EXPECT_TRUE(simulation.step().converged);
    simulation.begin_next_stage();
  }
  EXPECT_EQ(simulation.report().step, 3);
  EXPECT_EQ(simulation.report().contacts, 0);
}

// theta = 1/2 integrates constant acceleration exactly.
TEST(Simulation, OfOneFreeBodyIsTheParabola) {
  graph::Executor executor({});
  Bodies bodies;
  add_sphere(bodies, BodyId{4}, Vec3(0, 0, 5), radius, density);
  bodies.velocity[0].u[0] = 2;
  Simulation simulation(falling(100), bodies, executor);
  while (!simulation.finished()) {
    simulation.step();
    simulation.begin_next_stage();
  }
  EXPECT_NEAR(simulation.state().bodies.x[0][0], 0.2, 1e-13);
  EXPECT_NEAR(simulation.state().bodies.x[0][2], 5 - 0.5 * 10 * 0.01, 1e-13);
}

/// How often 30 x 30 columns of three grains, side by side, which glide over their floor and so get new
/// candidates, are asked how stiff their problem is. One grain at the top is `heavy` times as heavy as the
/// others.
std::pair<int, int> looks_and_renewals(double heavy) {
  constexpr int edge = 30, height = 3, steps = 60;
  int looks = 0, renewals = 0;
  trace::Recorder recorder({.sink = [&](trace::Block&& block) {
    for (const trace::Record& record : block.records) looks += record.kind() == kind_of(TaskKind::whole);
  }});
  graph::Executor executor({.trace = &recorder});
  const graph::OneRank ranks;
  ranks.record_to(&recorder);
  Bodies bodies;
  for (int k = 0; k < height * edge * edge; ++k) {
    const int column = k / height, level = k % height;
    add_sphere(bodies, BodyId{k}, radius * Vec3(2 * (column % edge), 2 * (column / edge), 1 + 2 * level),
               radius, k == height - 1 ? heavy * density : density);
    bodies.velocity.back().u[0] = 1;
  }
  talus::Setup setup = falling(steps);
  setup.solver.warm_start = false;  // or one sweep would do
  setup.walls = {test::box_of_walls(0, 0)[4]};
  Simulation simulation(setup, bodies, executor, ranks);
  for (; !simulation.finished(); simulation.begin_next_stage()) {
    simulation.step();
    renewals += simulation.sums().broad_phase;
    EXPECT_NEAR(static_cast<double>(simulation.report().contacts),
                height * (edge * edge + 2 * edge * (edge - 1)), 10);
  }
  recorder.finish();
  return {looks - steps, renewals};  // clusters are found in every step
}

TEST(Simulation, AsksAgainHowStiffItIsOnlyWhereNewNeighboursCouldMatter) {
  const auto [looks, renewals] = looks_and_renewals(1);
  EXPECT_GE(renewals, 20);
  EXPECT_GE(looks, 1);
  EXPECT_LE(looks, 1 + renewals / 10);
  const auto [heavy_looks, heavy_renewals] = looks_and_renewals(400);
  EXPECT_GE(heavy_looks, heavy_renewals);
  EXPECT_LE(heavy_looks, heavy_renewals + 1) << "velocities were in doubt once";
}

TEST(Simulation, OfAPerfectlyElasticBallKeepsItsEnergy) {
  graph::Executor executor({});
  talus::Setup setup = falling(20000);
  setup.walls.resize(1);
  setup.walls[0].name = "floor";
  setup.stages[0].laws.set_all(&PairLaw::restitution, 1);
  Bodies bodies;
  add_sphere(bodies, BodyId{0}, Vec3(0, 0, 1 + radius), radius, density);
  const double mass = bodies.mass(0);
  Simulation simulation(setup, bodies, executor);
  int bounces = 0;
  while (!simulation.finished()) {
    bounces += simulation.step().active > 0;
    simulation.begin_next_stage();
    const Bodies& now = simulation.state().bodies;
    const double energy = kinetic_energy(now.velocity).translation + mass * 10 * (now.x[0][2] - radius);
    ASSERT_NEAR(energy, mass * 10, 1e-9 * mass * 10) << "step " << simulation.report().step;
  }
  EXPECT_GT(bounces, 15);
}

// ---- certificate

TEST(Certificate, MarksAStepThatMissesItsTolerance) {
  // One sweep of `auto` is enough: a direct solve puts right so few grains before the step is given up.
  for (const auto& [method, iterations] :
       {std::pair{SolverMethod::nlgs, 1}, {SolverMethod::automatic, 1}, {SolverMethod::automatic, 5000}}) {
    graph::Executor executor({});
    talus::Setup setup = press_and_shear();
    setup.stages.resize(1);
    setup.stages[0].end.steps = 30;
    setup.solver.method = method;
    setup.solver.max_iterations = iterations;
    setup.solver.overlap_tolerance = 100;  // walls run into loose grains, and far into some
    Simulation simulation(setup, loose_sample(4, 4, 4, 1), executor);
    while (!simulation.finished()) {
      simulation.step();
      simulation.begin_next_stage();
    }
    const StepReport& report = simulation.report();
    ASSERT_GT(report.active, 50);
    EXPECT_EQ(report.converged, method == SolverMethod::automatic);
    EXPECT_LE(report.iterations, iterations);
    EXPECT_EQ(report.error_rms <= setup.solver.tolerance && report.balance <= setup.solver.balance_tolerance,
              report.converged);
  }
}

// B, struck by A at the end of a step, jumps into C, or far beyond it, before C is its contact or candidate.
TEST(Certificate, MarksAStepInWhichAGrainThatWasStruckPassesAnother) {
  struct Case {
    double a, speed, c;
  };
  for (const auto& [a, speed, c] : {Case{-3.9, 4, 2.2}, {-5.9, 8, 3.0}}) {
    graph::Executor executor({});
    talus::Setup setup = falling(4);
    setup.stages[0].gravity = Vec3::Zero();
    setup.stages[0].time_step = 1;
    setup.stages[0].laws.set_all(&PairLaw::restitution, 1);
    setup.solver.overlap_tolerance = 100;  // the step that strikes B ends with it in C, or beyond
    Bodies bodies;
    for (const double x : {a, 0.0, c})
      add_sphere(bodies, BodyId{static_cast<int>(bodies.size())}, Vec3(x, 0, 0), 1, 1);
    bodies.velocity[0].u[0] = speed;
    Simulation simulation(setup, bodies, executor);
    EXPECT_TRUE(simulation.step().converged);
    EXPECT_FALSE(simulation.step().converged) << "C at " << c;
  }
}

// 1.5 mm above the grain, 5 mm further down at the end of the step if there were none.
TEST(Simulation, ALidThatItsLoadBringsWithinAStepIsAContact) {
  graph::Executor executor({});
  talus::Setup setup = falling(2);
  setup.walls = box(1, 1, 0.0215);
  WallLoad load;
  load.drive = WallDrive::force;
  load.force = 5;
  load.mass = 1e-3;
  setup.stages[0].loads = {{"z+", load}};
  setup.stages[0].gravity = Vec3::Zero();
  setup.stages[0].time_step = 1e-3;
  Bodies bodies;
  add_sphere(bodies, BodyId{0}, Vec3(0.5, 0.5, radius), radius, density);
  Simulation simulation(setup, bodies, executor);
  simulation.step();
  simulation.step();
  EXPECT_LT(simulation.report().penetration_max, 1e-3);
  EXPECT_NEAR(simulation.walls()[5].position, -2 * radius, 1e-3 * radius);
}

TEST(Certificate, OfAStepWithoutContactsIsConverged) {
  graph::Executor executor({});
  Simulation simulation(falling(1), loose_sample(3, 3, 3, 1), executor);
  EXPECT_TRUE(simulation.step().converged);
  EXPECT_EQ(simulation.report().active, 0);
}

TEST(Simulation, WithoutFrictionHasNoTangentialArrays) {
  for (double mu : {0.0, 0.3}) {
    graph::Executor executor({});
    talus::Setup setup = falling(2);
    setup.walls = box(0.09, 0.09, 0.09);
    setup.stages[0].laws.between(material_of_grains, material_of_grains).friction = mu;
    Simulation simulation(setup, loose_sample(4, 4, 4, 1), executor);
    simulation.step();
    const StepState& state = simulation.state();
    EXPECT_EQ(state.contacts.rx.empty(), mu == 0);
    EXPECT_EQ(state.contacts.ry.empty(), mu == 0);
    EXPECT_EQ(state.contacts.rz.empty(), mu == 0);
    EXPECT_EQ(state.contacts.rn.empty(), mu > 0);
    EXPECT_EQ(state.free.w.empty(), mu == 0);
    EXPECT_EQ(state.candidates.impulse.kind(), mu > 0 ? ImpulseKind::force : ImpulseKind::normal);
    EXPECT_TRUE(state.bodies.orientation.empty());
  }
}

/// Speeds that differ by their last bit cannot be made equal: no impulse is small enough.
TEST(Simulation, RoundingIsNoErrorOfASolver) {
  talus::Setup setup;
  setup.stages = {stage("fly", 1)};
  Bodies pair;
  for (int k = 0; k < 2; ++k) add_sphere(pair, BodyId{k}, radius * Vec3(2 * k, 0, 0), radius, density);
  pair.velocity[0].u[0] = 1e-5;
  pair.velocity[1].u[0] = std::nextafter(1e-5, 0);
  graph::Executor executor({.threads = 1});
  Simulation simulation(setup, pair, executor);
  const StepReport& report = simulation.step();
  EXPECT_GT(report.contacts, 0);
  EXPECT_TRUE(report.converged) << report.error_rms << " after " << report.iterations;
}

}  // namespace
}  // namespace talus::simulation_test
