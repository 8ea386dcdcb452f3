/// A run that goes on from a checkpoint in memory, on other ranks and threads, ends in the bits of the run
/// that was never stopped.

#include "runtime/step/checkpoint.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <mutex>
#include <optional>
#include <random>
#include <set>
#include <string>

#include "runtime/graph/pretend_ranks.hpp"
#include "runtime/step/simulation.hpp"
#include "tests/unit/dense_sample.hpp"

namespace talus::checkpoint_test {
namespace {

/// A checkpoint with the parts of all ranks.
struct Whole {
  CheckpointHead head;
  std::map<std::int32_t, CheckpointPart> parts;
};

struct Outcome {
  Whole whole;
  std::uint64_t digest = 0;
  std::vector<double> reports;  ///< error and kinetic energy of each step
};

/// Runs `steps` steps, or to the end, from a checkpoint or from the beginning, with edge^3 grains on
/// pretended ranks.
Outcome run(const talus::Setup& setup, int ranks, int threads, std::optional<int> steps,
            const Whole* from = nullptr, int edge = 6) {
  Outcome outcome;
  std::mutex adding;
  graph::on_pretend_ranks(ranks, [&](const graph::Communicator& world) {
    graph::Executor executor({.threads = threads});
    std::optional<Simulation> simulation;
    if (from != nullptr) {
      Checkpoint own{from->head, {}, {}};
      const Decomposition all =
          make_decomposition(with_subdomains(setup.decomposition, from->head.subdomains), world);
      for (const SubdomainId e : all.here) {
        own.here.push_back(e.value());
        own.parts.push_back(from->parts.at(e.value()));
      }
      simulation.emplace(setup, own, executor, world);
    } else {
      simulation.emplace(setup, world.rank() == 0 ? test::jittered_lattice(edge, 4, 0.1) : Bodies{}, executor,
                         world);
    }
    std::vector<double> reports;
    for (int k = 0; !simulation->finished() && (!steps || k < *steps); ++k) {
      const StepReport& report = simulation->step();
      reports.push_back(report.error_rms);
      reports.push_back(report.kinetic_translation);
      simulation->begin_next_stage();
    }
    const std::uint64_t digest = simulation->digest();
    const Checkpoint saved = simulation->checkpoint();
    const std::lock_guard lock(adding);
    for (std::size_t e = 0; e < saved.here.size(); ++e) outcome.whole.parts[saved.here[e]] = saved.parts[e];
    if (world.rank() != 0) return;
    outcome.whole.head = saved.head;
    outcome.digest = digest;
    outcome.reports = reports;
  });
  return outcome;
}

/// Pressed without friction, then sheared with it, between walls of finite mass.
talus::Setup pressed(int subdomains) {
  talus::Setup setup = test::pressed_setup(test::box_of_walls(-1, 6), 0, 6, 1e4, 200);
  Stage shear = setup.stages.front();
  shear.name = "shear";
  shear.laws = laws_of_one_material(0.4, 0.3, 0);
  shear.gravity = Vec3(0, 0, -9.81);
  shear.end.steps = 8;
  setup.stages.push_back(shear);
  setup.decomposition.subdomains = subdomains;
  setup.decomposition.repartition_every = 3;
  setup.solver.max_iterations = 60;
  return setup;
}

std::map<std::string, talus::Setup> setups() {
  std::map<std::string, talus::Setup> all{{"one subdomain", pressed(1)}, {"alternating", pressed(6)}};
  talus::Setup next = pressed(6);
  next.decomposition.coupling = Coupling::nscdd;
  next.decomposition.partitioner = PartitionKind::metis;
  next.decomposition.mapping = SubdomainMapping::cyclic;
  all["nscdd, METIS"] = next;
  next = pressed(5);
  next.decomposition.coupling = Coupling::schwarz;
  next.decomposition.exchange = ExchangeScheme::ccs;
  next.decomposition.partitioner = PartitionKind::rcb;
  all["schwarz"] = next;
  next = pressed(4);
  next.solver.overlap_correction = 0.3;
  all["overlap correction"] = next;
  next = pressed(3);
  for (Stage& stage : next.stages) stage.laws = laws_of_one_material(0.3, 0.3, 0.5);
  next.solver.method = SolverMethod::admm;
  all["restitution, ADMM"] = next;
  next = pressed(3);
  for (Stage& stage : next.stages) {
    stage.chooses_time_step = true;
    stage.time_step = 0;
    stage.time_step_max = 2e-3;
    stage.gravity = Vec3(0, 0, -9.81);
  }
  next.orientation = true;
  all["chosen time steps"] = next;
  return all;
}

TEST(Checkpoints, AreGoneOnFromToTheBitsOfTheUninterruptedRun) {
  std::mt19937 random(7);
  const auto any = [&](int low, int high) { return std::uniform_int_distribution<int>(low, high)(random); };
  for (const auto& [name, setup] : setups()) {
    const Outcome straight = run(setup, 1, 1, std::nullopt);
    // Ranks poll as threads do: several of both starve one another here (tests/mpi has them).
    const auto threads_for = [&](int ranks) { return ranks > 1 ? 1 : any(1, 2); };
    const int most = std::min(3, std::max(1, setup.decomposition.subdomains));
    for (int trial = 0; trial < 2; ++trial) {
      int ranks = any(1, most);
      Outcome part = run(setup, ranks, threads_for(ranks), any(1, 9));
      std::vector<double> reports = part.reports;
      for (int resumed = any(0, 2); resumed >= 0; --resumed) {
        const Whole from = part.whole;
        ranks = any(1, most);
        part = run(setup, ranks, threads_for(ranks), resumed > 0 ? std::optional(1) : std::nullopt, &from);
        reports.insert(reports.end(), part.reports.begin(), part.reports.end());
      }
      EXPECT_EQ(part.digest, straight.digest) << name << ", trial " << trial;
      EXPECT_EQ(reports, straight.reports) << name << ", trial " << trial;
    }
  }
}

TEST(Checkpoints, ChangeNothingOfTheRunTheyAreTakenFrom) {
  const talus::Setup setup = pressed(4);
  graph::Executor executor({.threads = 1});
  std::uint64_t digest[2];
  for (const int with : {0, 1}) {
    Simulation simulation(setup, test::jittered_lattice(6, 4, 0.1), executor);
    for (; !simulation.finished(); simulation.begin_next_stage()) {
      simulation.step();
      if (with == 1) simulation.checkpoint();
    }
    digest[with] = simulation.digest();
  }
  EXPECT_EQ(digest[0], digest[1]);
}

/// Wrong, and not so wrong that it shows at once.
template <class Row>
void spoil(bool wanted, std::vector<Row>& column) {
  if (!wanted || column.size() < 2) return;
  if constexpr (std::is_floating_point_v<Row>)
    for (Row& value : column) value *= Row(0.5);
  else
    std::swap(column.front(), column.back());
}
// A column that could be left out, or be wrong, without anybody's notice would not be worth its bytes.
TEST(Checkpoints, KnowWhatAVelocityCheckHasFound) {
  talus::Setup setup = test::pressed_setup(test::box_of_walls(-0.5, 8.5), 0, 20, 1e4, 1e4);
  setup.detection.alert = 0.02;
  setup.decomposition.subdomains = 3;
  const auto numbers = [](const Whole& whole) {
    std::vector<double> all;
    VelocityErrorMemory::each_number(whole.head.velocity_errors, [&](const char*, const auto& number) {
      all.push_back(static_cast<double>(number));
    });
    return all;
  };
  const Outcome half = run(setup, 1, 1, 10, nullptr, 9), whole = run(setup, 1, 1, {}, nullptr, 9);
  ASSERT_GT(numbers(half.whole).back(), 0) << "velocities were checked, and sweeps counted since";
  const Outcome resumed = run(setup, 2, 1, {}, &half.whole);
  EXPECT_EQ(numbers(resumed.whole), numbers(whole.whole));
  EXPECT_EQ(resumed.digest, whole.digest);
}

// A stage ends when equilibrium has held for so many times that a grain needs to fall by its diameter under
// the load, which a resumed run knows only when it has made a step.
TEST(Checkpoints, KnowForHowLongEquilibriumHasToHold) {
  talus::Setup in_cell;
  in_cell.domain = periodic_domain({6.3, 6.3, 6.3}, Vec3::Constant(-0.6));
  in_cell.decomposition.coupling = Coupling::nscdd;
  in_cell.solver.max_iterations = 20;
  Stage press;
  press.name = "press";
  press.time_step = 0.01;
  press.laws = laws_of_one_material(0.3, 0.3, 0);
  press.stress.to = {1e3, 1e3, 1e3, {}, {}, {}};
  in_cell.stages = {press};
  talus::Setup in_box = pressed(2);
  in_box.stages.pop_back();
  in_box.stages[0].end.steps.reset();
  for (talus::Setup* setup : {&in_cell, &in_box}) {
    StageEnd& end = setup->stages[0].end;
    end.equilibrium = 1e9;
    // A grain falls in about 2 s in the cell, and in 0.6 s in the box.
    end.equilibrium_hold = 8.5 * setup->stages[0].time_step / (setup == &in_cell ? 2 : 0.6);
    const Outcome straight = run(*setup, 1, 1, std::nullopt);
    const auto steps = static_cast<int>(straight.reports.size() / 2);
    ASSERT_GT(steps, 3);
    ASSERT_LT(steps, 30);
    for (int stop = 1; stop < steps; ++stop) {
      const Outcome stopped = run(*setup, 1, 1, stop), resumed = run(*setup, 1, 1, {}, &stopped.whole);
      EXPECT_EQ(stopped.reports.size() + resumed.reports.size(), straight.reports.size()) << stop;
      EXPECT_EQ(resumed.digest, straight.digest) << stop;
    }
  }
}

TEST(Checkpoints, ColumnsMatterToTheDigest) {
  talus::Setup setup = pressed(4);
  setup.solver.overlap_correction = 0.3;
  const Outcome straight = run(setup, 1, 1, std::nullopt);
  std::set<std::string> matter;
  for (const int steps : {7, 8, 9, 10, 11}) {
    const Outcome stopped = run(setup, 1, 1, steps);
    for (const std::string wrong :
         {"x", "radius", "velocity", "whole", "impulses", "pushes", "order", "reach_then"}) {
      Whole from = stopped.whole;
      for (auto& [subdomain, part] : from.parts)
        each_column(part, [&](const char* name, auto& column) { spoil(name == wrong, column); });
      std::uint64_t digest = 0;
      try {
        digest = run(setup, 1, 1, std::nullopt, &from).digest;
      } catch (const std::exception&) {
      }
      if (digest != straight.digest) matter.insert(wrong);
    }
  }
  EXPECT_EQ(matter.size(), 8U) << ::testing::PrintToString(matter);
}

TEST(Checkpoints, AreRefusedWhereRanksAreMoreThanSubdomains) {
  const talus::Setup setup = pressed(2);
  const Outcome stopped = run(setup, 1, 1, 3);
  EXPECT_THROW(run(setup, 3, 1, 1, &stopped.whole), std::invalid_argument);
}

TEST(Checkpoints, TakeOtherLoadsAndEnds) {
  talus::Setup setup = pressed(2);
  const Outcome stopped = run(setup, 1, 1, 8);
  setup.stages[1].end.steps = 4;
  for (auto& [name, load] : setup.stages[0].loads)
    if (name == "z+") load = {.drive = WallDrive::velocity, .velocity = {0, 0, 0.1}};
  const Outcome gone_on = run(setup, 2, 1, std::nullopt, &stopped.whole);
  EXPECT_EQ(gone_on.reports.size(), 2U * 2U) << "two steps of the second stage were done";
  EXPECT_EQ(run(setup, 1, 2, std::nullopt, &stopped.whole).digest, gone_on.digest);
}

}  // namespace
}  // namespace talus::checkpoint_test
