// The arithmetic of scaling studies.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "apps/shared/child_process.hpp"
#include "apps/study_scaling/scaling_runs.hpp"
#include "apps/study_scaling/scaling_table.hpp"
#include "io/files/error.hpp"
#include "runtime/step/decomposition.hpp"
#include "tests/unit/io/results/output_helpers.hpp"

namespace talus {
namespace {

namespace fs = std::filesystem;

ScalingRow row(ScalingKind kind, int ranks, double seconds, double iterations, std::size_t grains = 1000) {
  ScalingRow out;
  out.kind = kind;
  out.ranks = out.subdomains = ranks;
  out.seconds = seconds;
  out.iterations = iterations;
  out.grains = grains;
  return out;
}

TEST(Scaling, RecordingsReadBackWhateverTheirVariantHolds) {
  const test::ScratchDirectory scratch;
  const std::string variant = "gravity=[0,0,-1] description=\"a, b\"";
  write_recordings(scratch / "times.csv", {{"strong-1-1.h5", "1:2", variant, {0.5, 3, 7, 2}}});
  const std::vector<RecordedTrace> back = read_recordings(scratch / "times.csv");
  ASSERT_EQ(back.size(), 1U);
  EXPECT_EQ(back[0].variant, variant);
  EXPECT_EQ(back[0].times.contacts, 7);
  EXPECT_EQ(back[0].times.missed, 2);
}

TEST(Scaling, StrongEfficiencyIsIterationsTimesTimeOfAnIteration) {
  std::vector<ScalingRow> rows{row(ScalingKind::strong, 1, 8, 100), row(ScalingKind::strong, 4, 2.5, 125)};
  relate(rows);
  EXPECT_DOUBLE_EQ(rows[0].speedup, 1);
  EXPECT_DOUBLE_EQ(rows[1].speedup, 3.2);
  EXPECT_DOUBLE_EQ(rows[1].efficiency, 0.8);
  EXPECT_DOUBLE_EQ(rows[1].of_iterations, 0.8);
  EXPECT_DOUBLE_EQ(rows[1].of_sweeps, 1);
  EXPECT_EQ(bound_of(rows[1]), "more iterations (0.80)");
}

TEST(Scaling, TimesThatNoMachineHasAreDoubted) {
  std::vector<ScalingRow> rows{row(ScalingKind::strong, 1, 8, 100), row(ScalingKind::strong, 4, 2.5, 125),
                               row(ScalingKind::strong, 1, 9, 100)};
  rows[2].source = ScalingSource::replay;
  relate(rows);
  EXPECT_TRUE(doubts_about(rows).empty());
  rows[1].seconds = 1;
  rows[2].seconds = 80;
  relate(rows);
  const std::vector<std::string> doubts = doubts_about(rows);
  ASSERT_EQ(doubts.size(), 2U);
  EXPECT_EQ(doubts[0].find("efficiency 2 of strong scaling on 4 cores"), 0U) << doubts[0];
  EXPECT_EQ(doubts[1].find("a step on one core is predicted to take 80 s and takes 8 s"), 0U) << doubts[1];
}

TEST(Scaling, WeakEfficiencyComparesTimesPerGrain) {
  // Four times the grains in 2.5 instead of 2 s; a thousandth more than four times must not count as loss.
  std::vector<ScalingRow> rows{row(ScalingKind::weak, 1, 2, 100), row(ScalingKind::weak, 4, 2.5, 100, 4004)};
  relate(rows);
  EXPECT_DOUBLE_EQ(rows[1].efficiency, 2 / 2.5 * 4004 / 4000);
  EXPECT_DOUBLE_EQ(rows[1].speedup, 4 * rows[1].efficiency);
}

TEST(Scaling, FactorsOfAPredictionMultiplyToItsEfficiency) {
  std::vector<ScalingRow> rows{row(ScalingKind::strong, 1, 8, 100), row(ScalingKind::strong, 4, 2.5, 100)};
  for (ScalingRow& r : rows) r.source = ScalingSource::replay;
  rows[0].balance = rows[0].communication = rows[0].within = 1;
  rows[1].balance = 0.95;
  rows[1].communication = 0.9;
  rows[1].within = 0.98;
  relate(rows);
  EXPECT_NEAR(rows[1].work * 0.95 * 0.9 * 0.98, rows[1].efficiency, 1e-12);
  EXPECT_EQ(bound_of(rows[1]), "exposed messages (0.90)");
  EXPECT_EQ(bound_of(rows[0]), "nothing");
}

TEST(Scaling, AVariantIsHeldAgainstItsOwnOneCoreAndElseAgainstThePlainOne) {
  ScalingRow plain = row(ScalingKind::strong, 1, 8, 100), own = plain,
             changed = row(ScalingKind::strong, 2, 3, 100);
  own.seconds = 6;
  own.variant = changed.variant = "solver.method=nlgs";
  std::vector<ScalingRow> both{plain, own, changed}, without{plain, changed};
  relate(both);
  relate(without);
  EXPECT_DOUBLE_EQ(both[2].speedup, 2);
  EXPECT_DOUBLE_EQ(without[1].speedup, 8.0 / 3);
}

TEST(Scaling, PredictionsAreNeverHeldAgainstMeasurements) {
  std::vector<ScalingRow> rows{row(ScalingKind::strong, 1, 8, 100), row(ScalingKind::strong, 4, 2, 100)};
  rows[1].source = ScalingSource::replay;
  relate(rows);
  EXPECT_TRUE(std::isnan(rows[1].speedup));
  EXPECT_EQ(bound_of(rows[1]), "");
}

TEST(Scaling, BoxesStayWithTheirNumberOfSubdomainsOnly) {
  const DecompositionSettings cut{.partitioner = PartitionKind::boxes, .subdomains = 6, .boxes = {1, 2, 3}};
  EXPECT_EQ(with_subdomains(cut, 6).boxes, cut.boxes);
  const DecompositionSettings other = with_subdomains(cut, 4);
  EXPECT_EQ(other.subdomains, 4);
  EXPECT_EQ(other.boxes, DecompositionSettings().boxes);
  EXPECT_EQ(other.partitioner, PartitionKind::boxes);
}

TEST(Scaling, RanksAndThreadsShareTheCoresEvenly) {
  EXPECT_EQ(rank_counts(1), (std::vector<int>{1}));
  EXPECT_EQ(rank_counts(12), (std::vector<int>{1, 2, 3, 4, 6, 12}));
}

TEST(Scaling, ARowHasTheMissedStepsOfItsWorstRun) {
  const ScalingRow made = row_of({}, {}, {{1, 9, 4, 0}, {2, 9, 4, 3}, {3, 9, 4, 1}});
  EXPECT_EQ(made.missed, 3);
  EXPECT_DOUBLE_EQ(made.seconds, 2);
}

TEST(Scaling, TimesAreMeansOverTheStepsThatCount) {
  const test::ScratchDirectory folder;
  const auto file = folder.path() / "steps.csv";
  std::ofstream(file)
      << "step,contacts,iterations,wall_s,converged\n1,5,1000,9,0\n2,10,30,1,1\n3,20,50,2,0\n4,1";
  const RunTimes times = read_times(file, 2, 3);
  EXPECT_DOUBLE_EQ(times.seconds, 1.5);
  EXPECT_DOUBLE_EQ(times.iterations, 40);
  EXPECT_DOUBLE_EQ(times.contacts, 15);
  EXPECT_EQ(times.missed, 1);
  EXPECT_THROW(read_times(file, 2, 4), io::FileError) << "the last line was cut off";
}

TEST(ChildProcess, TellsHowItEndedAndWhatItSaid) {
  const test::ScratchDirectory folder;
  const auto log = folder.path() / "log";
  EXPECT_EQ(run_child({"sh", "-c", "echo one; echo two >&2; exit 3"}, log), 3);
  EXPECT_EQ(tail_of(log, 1), "\n  two");
  EXPECT_EQ(run_child({"sh", "-c", "kill -9 $$"}, log), 128 + 9);
  EXPECT_THROW(run_child({"no-such-program"}, log), std::runtime_error);
  EXPECT_TRUE(program_exists("sh"));
  EXPECT_FALSE(program_exists("no-such-program"));
}

// A study that is stopped must be able to clear its folder, and must leave no run behind.
TEST(ChildProcess, StopsWithThisProcess) {
  const test::ScratchDirectory folder;
  const auto log = folder.path() / "log";
  for (const std::string signal : {"TERM", "INT"}) {
    const fs::path told = folder / signal;
    const std::string child = "sleep 100 & trap 'kill $!; echo told > " + told.string() + "; exit' " +
                              signal + "; kill -" + signal + " $PPID; wait";
    EXPECT_THROW(run_child({"sh", "-c", child}, log), std::runtime_error) << signal;
    EXPECT_TRUE(fs::exists(told)) << signal << " was not passed on";
    EXPECT_EQ(run_child({"true"}, log), 0) << "the signal was of the one before";
  }
}

TEST(ChildProcess, LinesForAShellSurviveIt) {
  const test::ScratchDirectory folder;
  const auto log = folder.path() / "log";
  const std::string word = "a'b \"c\" $HOME";
  EXPECT_EQ(run_child({"sh", "-c", shell_line({"test", word, "=", word})}, log), 0);
  EXPECT_EQ(shell_line({"talus", "--set", "a.b=1e-3"}), "talus --set a.b=1e-3");
}

}  // namespace
}  // namespace talus
