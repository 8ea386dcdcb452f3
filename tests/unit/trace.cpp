#include "runtime/trace/trace.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "io/error.hpp"
#include "io/trace_export.hpp"
#include "io/trace_file.hpp"
#include "runtime/graph/executor.hpp"
#include "runtime/trace/analysis.hpp"
#include "runtime/trace/order.hpp"
#include "runtime/trace/traced.hpp"
#include "tests/unit/small_trace.hpp"

namespace talus::trace {
namespace {

namespace fs = std::filesystem;

class TraceFile : public testing::Test {
 protected:
  TraceFile() : path_(fs::temp_directory_path() / ("talus_trace_" + std::to_string(::getpid()) + ".h5")) {}
  ~TraceFile() override { fs::remove(path_); }
  std::string complaint() const {
    try {
      io::read_trace(path_);
    } catch (const io::FileError& error) {
      return error.what();
    }
    return "";
  }
  const fs::path path_;
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
  sort_lanes(trace);
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
  ASSERT_EQ(back.lanes.size(), trace.lanes.size());
  for (std::size_t k = 0; k < back.lanes.size(); ++k) {
    ASSERT_EQ(back.lanes[k].records.size(), trace.lanes[k].records.size());
    for (std::size_t i = 0; i < back.lanes[k].records.size(); ++i)
      expect_equal(back.lanes[k].records[i], trace.lanes[k].records[i]);
  }
}

TEST_F(TraceFile, TakesNoMoreThan32BytesATask) {
  Trace trace = test::two_subdomains(1);
  std::vector<Record>& records = trace.lanes[0].records;
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
  for (const Lane& lane : trace.lanes)
    writer.append(Block{lane.rank, lane.thread, lane.records, std::nullopt});
  for (const Plan& plan : trace.plans) writer.append(Block{plan.rank, 0, {}, plan});
  for (std::int32_t rank = 0; rank < 2; ++rank)
    writer.append(rank, trace.tasks[static_cast<std::size_t>(rank)]);
  // Rank 1 is 500 ns behind in the beginning, 700 ns at time 2000.
  writer.append(io::RankClock{1, {io::ClockOffset{0, 500}, io::ClockOffset{2000, 700}}});
  const Trace back = io::read_trace(path_);
  EXPECT_EQ(back.lanes[0].records[0].begin, trace.lanes[0].records[0].begin);
  const std::int64_t before = trace.lanes[1].records[0].begin;
  EXPECT_EQ(back.lanes[1].records[0].begin, before + 500 + before / 10);
}

TEST_F(TraceFile, PartsOfRanksMakeOneTrace) {
  const fs::path part = path_.string() + ".part";
  const Trace trace = test::two_subdomains(2);
  const auto write = [&](const fs::path& path, std::int32_t rank) {
    io::TraceWriter writer(path, 2, 1, false, trace.kinds);
    writer.append(Block{rank, 0, trace.lane(rank, 0).records, trace.plans[static_cast<std::size_t>(rank)]});
    writer.append(rank, trace.tasks[static_cast<std::size_t>(rank)]);
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
  EXPECT_NE(complaint().find("opening as HDF5"), std::string::npos) << complaint();
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

TEST(Timelines, RefuseAStepThatWasRecordedInPart) {
  Trace trace = test::two_subdomains(1);
  std::vector<Record>& records = trace.lanes[0].records;
  records.erase(std::find_if(records.begin(), records.end(),
                             [](const Record& r) { return r.epoch == 1 && r.node == 0; }));
  const Timeline timeline(trace);
  EXPECT_THROW(timeline.index(1), TraceError);
}

TEST(Timelines, TimeWithinATaskIsNotCountedTwice) {
  Trace trace = test::two_subdomains(1);
  trace.lanes[0].records = {{0, 100, 0, 0, pack(1, test::sweep)},
                            {10, 30, 0, 0, pack(1, kind_receive)},
                            {50, 20, 0, 0, pack(1, kind_receive)},
                            {100, 5, 1, 0, pack(1, test::sweep)}};
  EXPECT_EQ(self_times(trace)[0], (std::vector<float>{50, 30, 20, 5}));
}

TEST(Analysis, AddsUpToTheWholeOfAllThreads) {
  const Trace trace = test::two_subdomains(2);
  const Summary sum = analyse(trace);
  EXPECT_NEAR(sum.work + sum.exposed + sum.idle, sum.makespan * 2, 1e-9 * sum.makespan);
  const Efficiencies& e = sum.efficiency;
  EXPECT_NEAR(e.parallel, e.load_balance * e.communication * e.threads, 1e-12);
  EXPECT_NEAR(e.parallel, sum.work / (2 * sum.makespan), 1e-12);
}

TEST(Analysis, TheCriticalPathOfOneThreadIsAllOfIt) {
  const Trace trace = test::two_subdomains(1);
  const Summary sum = analyse(trace);
  EXPECT_NEAR(sum.path_time, sum.makespan, 1e-9 * sum.makespan);
}

TEST(Recording, LosesNothingWhenBuffersAreFull) {
  std::vector<Record> records;
  Recorder recorder({.block = 7, .sink = [&](Block&& block) {
                       records.insert(records.end(), block.records.begin(), block.records.end());
                     }});
  recorder.begin_step(3);
  for (std::uint32_t i = 0; i < 100; ++i) recorder.lane(0).add(i, i + 1, i, 2, test::sweep);
  recorder.end_step();
  recorder.finish();
  ASSERT_EQ(records.size(), 100u);
  for (std::uint32_t i = 0; i < 100; ++i) {
    EXPECT_EQ(records[i].node, i);
    EXPECT_EQ(records[i].step(), 3u);
    EXPECT_EQ(records[i].kind(), test::sweep);
  }
}

TEST(Recording, KeepsToItsStepsAndBringsThePlanAlong) {
  std::size_t records = 0, plans = 0;
  Recorder recorder({.first_step = 3, .last_step = 4, .sink = [&](Block&& block) {
                       records += block.records.size();
                       if (block.plan) {
                         ++plans;
                         EXPECT_EQ(block.plan->step, 3u);
                       }
                     }});
  for (std::uint32_t step = 1; step <= 6; ++step) {
    recorder.begin_step(step);
    if (step == 2) recorder.plan(test::two_subdomains(1).plans[0]);
    { const Span span(&recorder, kind_collective); }
    recorder.end_step();
    { const Span between(&recorder, kind_collective); }
  }
  recorder.finish();
  EXPECT_EQ(records, 2u + 2u);  // one span a step, the time between the two and what was done in it
  EXPECT_EQ(plans, 1u);
}

/// Three nodes, two epochs.
struct Program {
  int nodes = 0;
  void node(std::uint32_t, int) { ++nodes; }
  bool gate(int epoch) const { return epoch == 1; }
  bool decide(int) { return false; }
  std::optional<Kind> kind(std::uint32_t node, int) const {
    return node == 2 ? std::optional<Kind>() : std::optional<Kind>(test::sweep);
  }
};

TEST(Recording, OfALoopHasEachNodeThatDoesSomethingOnce) {
  std::vector<Record> records;
  Recorder recorder({.sink = [&](Block&& block) { records = std::move(block.records); }});
  graph::EpochGraph graph;
  const std::vector<std::uint32_t> colour{0, 1, 2}, offset{0, 0, 0, 0}, neighbour;
  graph.build({colour, offset, neighbour}, {}, 1);
  Program program;
  recorder.begin_step(1);
  {
    Traced traced(program, recorder, 0);
    graph::run_epochs(graph, traced);
  }
  recorder.finish();
  EXPECT_EQ(program.nodes, 6);
  ASSERT_EQ(records.size(), 5u);  // 2 x 2 nodes and the decision
  EXPECT_EQ(records[0].node, 0u);
  EXPECT_EQ(records[3].epoch, 1);
  EXPECT_EQ(records[4].kind(), kind_check);
}

// One look at the clock a node, but for nodes that waited: waiting is no work.
TEST(Recording, ANodeBeginsWhereTheLastOneEndedUnlessItWaited) {
  std::vector<Record> records;
  Recorder recorder({.sink = [&](Block&& block) { records = std::move(block.records); }});
  Program program;
  recorder.begin_step(1);
  Traced traced(program, recorder, 0);
  const auto let_time_pass = [&] {
    for (const std::int64_t from = recorder.now(); recorder.now() < from + 2000;) continue;
  };
  traced.gate(0);
  traced.node(0, 0);
  let_time_pass();
  traced.node(1, 0);
  let_time_pass();
  traced.about_to_wait();
  traced.node(0, 0);
  let_time_pass();
  traced.gate(1);
  traced.node(0, 1);
  recorder.finish();
  ASSERT_EQ(records.size(), 4u);
  EXPECT_EQ(static_cast<double>(records[1].begin), records[0].end());
  EXPECT_GE(static_cast<double>(records[2].begin), records[1].end() + 2000);
  EXPECT_GE(static_cast<double>(records[3].begin), records[2].end() + 2000);
}

/// Beginnings of nodes, as they come.
struct Beginnings {
  std::atomic<int> count{0};
  std::vector<int> place = std::vector<int>(8, -1);
  void node(std::uint32_t node, int) { place[node] = count.fetch_add(1); }
  bool gate(int) const { return true; }
  bool decide(int) { return false; }
  std::optional<Kind> kind(std::uint32_t, int) const { return test::sweep; }
};

TEST(Orders, AreFollowedByThreadsThatNeedNotWait) {
  // Eight nodes without conflicts on two threads, begun in turn: 0, 4, 1, 5, 2, 6, 3, 7.
  const std::vector<std::uint32_t> colour(8, 0), offset(9, 0), neighbour, owner{0, 0, 0, 0, 1, 1, 1, 1};
  Trace trace = test::one_loop(colour, {}, std::vector<float>(8, 1));
  trace.threads = 2;
  trace.plans[0].owner = owner;
  trace.lanes = {{0, 0, {}}, {0, 1, {}}};
  for (std::uint32_t n = 0; n < 8; ++n)
    trace.lanes[n / 4].records.push_back({2 * (n % 4) + n / 4, 1, n, 0, pack(1, test::sweep)});
  Order order(trace, 0);
  ASSERT_TRUE(order.begin_step(1));
  EXPECT_FALSE(Order(trace, 0).begin_step(2));
  graph::EpochGraph loop;
  loop.build({colour, offset, neighbour}, owner, 2);
  Beginnings program;
  graph::Graph graph;
  graph.team("loop", {}, [&](graph::Worker& me) {
    Ordered ordered(program, order, me);
    graph::run_epochs(loop, me, ordered);
  });
  graph::Executor executor({.threads = 2});
  executor.run(graph);
  ASSERT_EQ(program.count, 8);
  // Each takes its place right after its turn: of two neighbours in the order the later may overtake by that
  // much.
  for (std::uint32_t n = 0; n < 8; ++n)
    EXPECT_NEAR(program.place[n], static_cast<int>(2 * (n % 4) + n / 4), 1) << n;
}

TEST(Orders, OfFreeThreadsAreRefused) {
  Trace trace = test::one_loop({0, 1}, {}, {1, 1});
  std::swap(trace.lanes[0].records[1].begin, trace.lanes[0].records[2].begin);
  sort_lanes(trace);
  EXPECT_THROW(Order(trace, 0), TraceError);
}

TEST(Recording, OfAnExecutorHasItsTasks) {
  std::vector<Record> records;
  Recorder recorder({.threads = 2, .sink = [&](Block&& block) {
                       records.insert(records.end(), block.records.begin(), block.records.end());
                     }});
  recorder.declare({{"first", test::task, -1, false, {}}, {"second", test::task, -1, false, {0}}});
  graph::Executor executor({.threads = 2, .trace = &recorder});
  graph::Graph graph;
  const auto data = graph.data("data");
  graph.task("first", {graph::write(data)}, [] {});
  graph.task("second", {graph::write(data)}, [] {});
  executor.run(graph);  // outside of any step
  EXPECT_TRUE(records.empty());
  recorder.begin_step(1);
  executor.run(graph);
  recorder.finish();
  ASSERT_EQ(records.size(), 2u);
  std::sort(records.begin(), records.end(), [](const Record& a, const Record& b) { return a.node < b.node; });
  EXPECT_LE(records[0].end(), static_cast<double>(records[1].begin));
}

TEST(Export, PerfettoHasTwoEventsARecord) {
  const Trace trace = test::two_subdomains(2);
  const std::string bytes = io::to_perfetto(trace, {});
  // Walk the packets: field 1, length-delimited.
  std::size_t events = 0, at = 0;
  const auto number = [&] {
    std::uint64_t value = 0;
    for (int shift = 0;; shift += 7) {
      const auto byte = static_cast<unsigned char>(bytes.at(at++));
      value |= std::uint64_t{byte & 0x7fU} << shift;
      if ((byte & 0x80U) == 0) return value;
    }
  };
  while (at < bytes.size()) {
    ASSERT_EQ(number(), 1u << 3 | 2u);
    const std::size_t end = number() + at;
    while (at < end) {
      const std::uint64_t tag = number();
      if ((tag & 7) == 2) {
        if (tag >> 3 == 11) ++events;
        const std::size_t length = number();
        at += length;
      } else {
        ASSERT_EQ(tag & 7, 0u);
        number();
      }
    }
    ASSERT_EQ(at, end);
  }
  EXPECT_EQ(events, 2 * trace.record_count());
}

TEST(Export, PajeOpensAndClosesEachTask) {
  const Trace trace = test::two_subdomains(1);
  const std::string text = io::to_paje(trace, {});
  std::size_t opened = 0, closed = 0;
  for (std::size_t at = text.find("\n5 "); at != std::string::npos; at = text.find("\n5 ", at + 1)) ++opened;
  for (std::size_t at = text.find("\n6 "); at != std::string::npos; at = text.find("\n6 ", at + 1)) ++closed;
  EXPECT_EQ(opened, trace.record_count());
  EXPECT_EQ(closed, trace.record_count());
}

}  // namespace
}  // namespace talus::trace
