#include "runtime/trace/trace.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "io/files/error.hpp"
#include "io/trace/trace_file.hpp"
#include "runtime/trace/analysis.hpp"
#include "tests/unit/io/results/output_helpers.hpp"
#include "tests/unit/runtime/trace/small_trace.hpp"

namespace talus::trace {
namespace {

namespace fs = std::filesystem;

class TraceFile : public testing::Test {
 protected:
  std::string complaint() const {
    try {
      io::read_trace(path_);
    } catch (const io::FileError& error) {
      return error.what();
    }
    return "";
  }
  const talus::test::ScratchDirectory folder_;
  const fs::path path_ = io::trace_file_of(folder_.path(), 0);
};

void expect_equal(const Record& a, const Record& b) {
  EXPECT_EQ(a.begin, b.begin);
  EXPECT_EQ(a.duration, b.duration);
  EXPECT_EQ(a.node, b.node);
  EXPECT_EQ(a.epoch, b.epoch);
  EXPECT_EQ(a.step_and_kind, b.step_and_kind);
}

TEST_F(TraceFile, ReadsBackWhatWasWritten) {
  Trace trace = test::two_subdomains(2);
  sort_tracks(trace);
  io::write_trace(path_, trace);
  const Trace back = io::read_trace(path_);
  EXPECT_EQ(back.ranks, trace.ranks);
  EXPECT_EQ(back.kinds, trace.kinds);
  ASSERT_EQ(back.plans.size(), trace.plans.size());
  EXPECT_EQ(back.plans[0].neighbour, trace.plans[0].neighbour);
  EXPECT_EQ(back.plans[1].messages.size(), trace.plans[1].messages.size());
  EXPECT_EQ(back.plans[1].messages[0].bytes, trace.plans[1].messages[0].bytes);
  ASSERT_EQ(back.tasks[1].size(), trace.tasks[1].size());
  EXPECT_EQ(back.tasks[1][2].predecessors, trace.tasks[1][2].predecessors);
  ASSERT_EQ(back.tracks.size(), trace.tracks.size());
  for (std::size_t k = 0; k < back.tracks.size(); ++k) {
    ASSERT_EQ(back.tracks[k].records.size(), trace.tracks[k].records.size());
    for (std::size_t i = 0; i < back.tracks[k].records.size(); ++i)
      expect_equal(back.tracks[k].records[i], trace.tracks[k].records[i]);
  }
}

TEST_F(TraceFile, TakesNoMoreThan32BytesATask) {
  Trace trace = test::two_subdomains(1);
  std::vector<Record>& records = trace.tracks[0].records;
  const Record one = records.back();
  for (int k = 0; k < 200000; ++k) {
    records.push_back(one);
    records.back().begin += k;
  }
  io::write_trace(path_, trace);
  EXPECT_LE(static_cast<double>(fs::file_size(path_)), 32.0 * static_cast<double>(trace.record_count()));
}

TEST_F(TraceFile, OffsetsOfClocksAreTakenOut) {
  const Trace trace = test::two_subdomains(2);
  io::TraceWriter writer(path_, 2, 1, false, trace.kinds);
  for (const Track& track : trace.tracks)
    writer.append(Block{track.rank, track.thread, track.records, std::nullopt});
  for (const Plan& plan : trace.plans) writer.append(Block{plan.rank, 0, {}, plan});
  for (std::int32_t rank = 0; rank < 2; ++rank)
    writer.append(rank, trace.tasks[static_cast<std::size_t>(rank)]);
  writer.append(io::RankClock{0, {}});
  // Rank 1 is 500 ns behind in the beginning, 700 ns at time 2000.
  writer.append(io::RankClock{1, {io::ClockOffset{0, 500}, io::ClockOffset{2000, 700}}});
  const Trace back = io::read_trace(path_);
  EXPECT_EQ(back.tracks[0].records[0].begin, trace.tracks[0].records[0].begin);
  const std::int64_t before = trace.tracks[1].records[0].begin;
  EXPECT_EQ(back.tracks[1].records[0].begin, before + 500 + before / 10);
}

TEST_F(TraceFile, PartsOfRanksMakeOneTrace) {
  const fs::path part = path_.string() + ".part";
  const Trace trace = test::two_subdomains(2);
  const auto write = [&](const fs::path& path, std::int32_t rank) {
    io::TraceWriter writer(path, 2, 1, false, trace.kinds);
    writer.append(Block{rank, 0, trace.track(rank, 0).records, trace.plans[static_cast<std::size_t>(rank)]});
    writer.append(rank, trace.tasks[static_cast<std::size_t>(rank)]);
    writer.append(io::RankClock{rank, {}});
    return writer;
  };
  io::TraceWriter whole = write(path_, 0);
  write(part, 1);
  whole.append_file(part);
  const Trace back = io::read_trace(path_);
  EXPECT_EQ(back.record_count(), trace.record_count());
  EXPECT_EQ(back.plans.size(), 2u);
  EXPECT_EQ(back.tasks[1].size(), trace.tasks[1].size());
  fs::remove(part);
}

TEST_F(TraceFile, SaysWhatIsNoTrace) {
  EXPECT_NE(complaint().find("no such file"), std::string::npos);
  std::ofstream(path_) << "time,task\n0,sweep\n";
  EXPECT_NE(complaint().find("is no HDF5 file"), std::string::npos) << complaint();
}

TEST_F(TraceFile, NoticesACutFile) {
  io::write_trace(path_, test::two_subdomains(1));
  fs::resize_file(path_, fs::file_size(path_) / 2);
  EXPECT_NE(complaint(), "");
}

TEST_F(TraceFile, NoticesIndicesThatPointNowhere) {
  Trace trace = test::two_subdomains(1);
  trace.plans[0].neighbour[0] = 1000;
  io::write_trace(path_, trace);
  EXPECT_NE(complaint().find("damaged"), std::string::npos) << complaint();
}

TEST_F(TraceFile, NoticesACheckOutsideOfTheLoop) {
  Trace trace = test::two_subdomains(1);
  std::ranges::find(trace.tracks[0].records, kind_check, &Record::kind)->epoch = -1;
  io::write_trace(path_, trace);
  EXPECT_NE(complaint().find("epoch -1"), std::string::npos) << complaint();
}

TEST_F(TraceFile, NoticesASubdomainThatPublishesAndDoesNotGlue) {
  Trace trace = test::two_subdomains(1);
  std::vector<std::uint8_t>& role = trace.plans[0].role;
  std::ranges::replace(role, static_cast<std::uint8_t>(Role::glue), std::uint8_t{0});
  io::write_trace(path_, trace);
  EXPECT_NE(complaint().find("glues 0"), std::string::npos) << complaint();
}

TEST_F(TraceFile, NoticesATurnThatNoSubdomainHas) {
  Trace trace = test::two_subdomains(1);
  Plan& plan = trace.plans[0];
  const auto publish = std::ranges::find(plan.role, static_cast<std::uint8_t>(Role::publish));
  plan.place[static_cast<std::size_t>(publish - plan.role.begin())] = 128;
  io::write_trace(path_, trace);
  EXPECT_NE(complaint().find("subdomain colour 128"), std::string::npos) << complaint();
}

/// Two threads; what is recorded comes in parts of steps 1, 2 and so on, as of a run that was killed.
class CutTraceFile : public TraceFile {
 protected:
  /// Steps that the track of each thread has come to.
  void write(std::uint32_t first, std::uint32_t second) const {
    const Trace trace = test::two_subdomains(1);
    io::TraceWriter writer(path_, 1, 2, false, trace.kinds);
    writer.append(Block{0, 0, {}, std::nullopt, trace.tasks[0]});
    writer.append(Block{0, 0, {}, trace.plans[0]});
    for (const auto& [thread, steps] : {std::pair(0, first), std::pair(1, second)}) {
      std::vector<Record> records;
      for (std::uint32_t step = 1; step <= steps; ++step)
        for (Record record : trace.tracks[0].records) {
          if (thread == 1) record = {record.begin, 1, 1, -1, pack(1, kind_team)};
          record.begin += 10000 * step;
          record.step_and_kind = pack(step, record.kind());
          records.push_back(record);
        }
      writer.append(Block{0, thread, records, std::nullopt});
    }
  }
};

TEST_F(CutTraceFile, OfAKilledRunHasTheStepsThatAllThreadsWereThrough) {
  write(5, 3);
  const Trace back = io::read_trace(path_);
  EXPECT_EQ(steps_of(back), (std::vector<std::uint32_t>{1, 2}));
  const Timeline timeline(back);
  EXPECT_NO_THROW(timeline.index(2));
}

// The ranks' own clocks cannot be compared any more.
TEST_F(TraceFile, OfAKilledRunOfSeveralRanksIsRefused) {
  const Trace trace = test::two_subdomains(2);
  for (const int rank : {0, 1}) {
    io::TraceWriter writer(io::trace_file_of(folder_.path(), rank), 2, 1, false, trace.kinds);
    writer.append(Block{rank, 0, {}, std::nullopt, trace.tasks[static_cast<std::size_t>(rank)]});
    writer.append(Block{rank, 0, {}, trace.plans[static_cast<std::size_t>(rank)]});
    writer.append(Block{rank, 0, trace.tracks[static_cast<std::size_t>(rank)].records, std::nullopt});
  }
  EXPECT_NE(complaint().find("was killed"), std::string::npos) << complaint();
}

TEST_F(CutTraceFile, BeforeItsFirstBlockHoldsNothing) {
  { io::TraceWriter(path_, 1, 2, false, test::two_subdomains(1).kinds); }
  EXPECT_NE(complaint().find("holds no tasks"), std::string::npos) << complaint();
}

TEST_F(CutTraceFile, SaysThatAKilledRunCameToNothing) {
  write(5, 1);
  EXPECT_NE(complaint().find("was stopped before a step"), std::string::npos) << complaint();
}

TEST_F(TraceFile, OfAPredictionKnowsItsMachine) {
  Trace trace = test::two_subdomains(2);
  trace.predicted = true;
  trace.machine = Machine{};
  trace.machine->ranks = 2;
  trace.machine->map = RankMap::cyclic;
  trace.machine->ranks_per_node = 2;
  trace.machine->node_latency = 3e-7;
  io::write_trace(path_, trace);
  const Trace back = io::read_trace(path_);
  EXPECT_EQ(back.machine, trace.machine);
  EXPECT_EQ(recorded_machine(back), *trace.machine);
}

TEST(Timelines, RefuseAStepThatWasRecordedInPart) {
  Trace trace = test::two_subdomains(1);
  std::vector<Record>& records = trace.tracks[0].records;
  records.erase(std::find_if(records.begin(), records.end(),
                             [](const Record& r) { return r.epoch == 1 && r.node == 0; }));
  const Timeline timeline(trace);
  EXPECT_THROW(timeline.index(1), TraceError);
}

/// Where all subdomains are on one rank and nothing touches, no node of the loop does anything: its check is
/// all that is recorded of it.
TEST(Timelines, AStepWhoseNodesDidNothingHasTheEpochsOfItsChecks) {
  Trace trace = test::two_subdomains(1);
  trace.plans[0] = test::PlanBuilder().plan(0);
  std::erase_if(trace.tracks[0].records,
                [](const Record& r) { return r.epoch >= 0 && r.kind() != kind_check; });
  const Timeline timeline(trace);
  const StepIndex step = timeline.index(1);
  EXPECT_EQ(step.ranks[0].epochs, 2U);
  EXPECT_TRUE(step.ranks[0].check.back().exists());
}

TEST(Timelines, TimeWithinATaskIsNotCountedTwice) {
  Trace trace = test::two_subdomains(1);
  trace.tracks[0].records = {{0, 100, 0, 0, pack(1, test::sweep)},
                             {10, 30, 0, 0, pack(1, kind_receive)},
                             {50, 20, 0, 0, pack(1, kind_receive)},
                             {100, 5, 1, 0, pack(1, test::sweep)}};
  EXPECT_EQ(self_times(trace)[0], (std::vector<float>{50, 30, 20, 5}));
}

TEST(Analysis, KnowsHowLongThreadsWereIdle) {
  Trace trace = test::two_subdomains(2);
  EXPECT_NEAR(analyse(trace).idle, 0, 1e-9);
  // Rank 0 does nothing for 70 ns between its two epochs, rank 1 nothing for as long at the end.
  for (Record& record : trace.tracks[0].records)
    if (record.begin >= 180) record.begin += 70;
  const Summary sum = analyse(trace);
  EXPECT_NEAR(sum.makespan, 2 * 180 + 70, 1e-9);
  EXPECT_NEAR(sum.idle, 2 * 70, 1e-9);
  const Efficiencies& e = sum.efficiency;
  EXPECT_NEAR(e.parallel, e.load_balance * e.communication * e.threads, 1e-12);
  EXPECT_NEAR(e.parallel, sum.work / (2 * sum.makespan), 1e-12);
}

TEST(Analysis, TheCriticalPathOfOneThreadIsAllOfIt) {
  const Trace trace = test::two_subdomains(1);
  const Summary sum = analyse(trace);
  EXPECT_NEAR(sum.path_time, sum.makespan, 1e-9 * sum.makespan);
}

}  // namespace
}  // namespace talus::trace
