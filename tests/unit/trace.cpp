#include "runtime/trace/trace.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "io/error.hpp"
#include "io/trace_export.hpp"
#include "io/trace_file.hpp"
#include "runtime/graph/executor.hpp"
#include "runtime/graph/task_error.hpp"
#include "runtime/trace/analysis.hpp"
#include "runtime/trace/order.hpp"
#include "runtime/trace/traced.hpp"
#include "tests/unit/output_helpers.hpp"
#include "tests/unit/small_trace.hpp"

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
  writer.append(io::RankClock{0, {}});
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

TEST_F(TraceFile, NoticesACheckOutsideOfTheLoop) {
  Trace trace = test::two_subdomains(1);
  std::ranges::find(trace.lanes[0].records, kind_check, &Record::kind)->epoch = -1;
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
  EXPECT_NE(complaint().find("turn 128"), std::string::npos) << complaint();
}

/// Two threads; what is recorded comes in parts of steps 1, 2 and so on, as of a run that was killed.
class CutTraceFile : public TraceFile {
 protected:
  /// Steps that the lane of each thread has come to.
  void write(std::uint32_t first, std::uint32_t second) const {
    const Trace trace = test::two_subdomains(1);
    io::TraceWriter writer(path_, 1, 2, false, trace.kinds);
    writer.append(Block{0, 0, {}, std::nullopt, trace.tasks[0]});
    writer.append(Block{0, 0, {}, trace.plans[0]});
    for (const auto& [thread, steps] : {std::pair(0, first), std::pair(1, second)}) {
      std::vector<Record> records;
      for (std::uint32_t step = 1; step <= steps; ++step)
        for (Record record : trace.lanes[0].records) {
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
    writer.append(Block{rank, 0, trace.lanes[static_cast<std::size_t>(rank)].records, std::nullopt});
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

TEST(Analysis, KnowsHowLongThreadsWereIdle) {
  Trace trace = test::two_subdomains(2);
  EXPECT_NEAR(analyse(trace).idle, 0, 1e-9);
  // Rank 0 does nothing for 70 ns between its two epochs, rank 1 nothing for as long at the end.
  for (Record& record : trace.lanes[0].records)
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

/// Both clocks are read from the inside or from the outside, so that a pause between two readings cannot make
/// the test fail.
TEST(Recording, ItsClockKeepsTheTimeOfTheSystem) {
  const auto system = [] { return graph::Clock::now().time_since_epoch(); };
  const auto ns = [](auto d) { return std::chrono::duration<double, std::nano>(d).count(); };
  const Ticks ticks;
  const auto outer = system();
  const std::int64_t first = ticks.now();
  const auto inner = system();
  EXPECT_GE(first, 0);
  std::int64_t last = first;
  while (system() - inner < std::chrono::milliseconds(30)) {
    const std::int64_t now = ticks.now();
    ASSERT_GE(now, last);
    last = now;
  }
  const auto inner_end = system();
  const std::int64_t end = ticks.now();
  const auto outer_end = system();
  EXPECT_GE(static_cast<double>(end - first), 0.999 * ns(inner_end - inner));
  EXPECT_LE(static_cast<double>(end - first), 1.001 * ns(outer_end - outer));
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

// Spans end in destructors, which must not throw: on a disk that is full the program ends by itself, later.
TEST(Recording, AFailureIsToldAtTheEndOfTheStep) {
  int calls = 0;
  Recorder recorder({.block = 1, .sink = [&](Block&&) {
                       ++calls;
                       throw std::runtime_error("the disk is full");
                     }});
  recorder.begin_step(1);
  { const Span span(&recorder, kind_collective); }
  { const Span span(&recorder, kind_collective); }
  EXPECT_THROW(recorder.end_step(), std::runtime_error);
  EXPECT_EQ(calls, 1);
  recorder.begin_step(2);
  EXPECT_NO_THROW(recorder.end_step()) << "told once";
  EXPECT_NO_THROW(recorder.finish());
  EXPECT_EQ(calls, 1) << "a file with a hole";
}

TEST(Recording, HandsOverTheTasksBeforeAnythingElse) {
  std::vector<std::size_t> tasks;
  Recorder recorder({.first_step = 2, .sink = [&](Block&& block) { tasks.push_back(block.tasks.size()); }});
  recorder.declare(test::three_tasks());
  for (std::uint32_t step = 1; step <= 3; ++step) {
    recorder.begin_step(step);
    recorder.plan(test::two_subdomains(1).plans[0]);
    recorder.end_step();
  }
  EXPECT_EQ(tasks, (std::vector<std::size_t>{3, 0, 0, 0}));
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
  int epochs = 1, idle_node = -1;
  std::atomic<int> count{0};
  std::vector<int> place = std::vector<int>(8, -1);
  void node(std::uint32_t node, int) { place[node] = count.fetch_add(1); }
  bool gate(int) const { return true; }
  bool decide(int epoch) { return epoch + 1 < epochs; }
  std::optional<Kind> kind(std::uint32_t node, int) const {
    return static_cast<int>(node) == idle_node ? std::nullopt : std::optional(test::sweep);
  }
};

/// Eight nodes without conflicts on two threads, begun in turn: 0, 4, 1, 5, 2, 6, 3, 7. Then as many again,
/// with a decision behind each epoch, or the second only.
class Orders : public testing::Test {
 protected:
  Trace trace(bool two_gates = true) const {
    Trace trace = test::one_loop(colour_, {}, std::vector<float>(8, 1));
    trace.threads = 2;
    trace.plans[0].owner = owner_;
    trace.lanes = {{0, 0, {}}, {0, 1, {}}};
    for (int epoch = 0; epoch < 2; ++epoch) {
      for (std::uint32_t n = 0; n < 8; ++n)
        trace.lanes[n / 4].records.push_back(
            {20 * epoch + 2 * (n % 4) + n / 4, 1, n, epoch, pack(1, test::sweep)});
      if (epoch == 1 || two_gates)
        trace.lanes[0].records.push_back({20 * epoch + 10, 1, 0, epoch, pack(1, kind_check)});
    }
    return trace;
  }
  Plan plan() const { return trace().plans[0]; }
  void run(Order& order, Beginnings& program) const {
    graph::EpochGraph loop;
    loop.build({colour_, offset_, {}}, owner_, 2);
    graph::Graph graph;
    graph.team("loop", {}, [&](graph::Worker& me) {
      Ordered ordered(program, order, me);
      graph::run_epochs(loop, me, ordered);
    });
    graph::Executor executor({.threads = 2});
    executor.run(graph);
  }

  const std::vector<std::uint32_t> colour_ = std::vector<std::uint32_t>(8, 0),
                                   offset_ = std::vector<std::uint32_t>(9, 0), owner_{0, 0, 0, 0, 1, 1, 1, 1};
};

TEST_F(Orders, AreFollowedByThreadsThatNeedNotWait) {
  Order order(trace(), 0);
  order.plan(plan());
  ASSERT_TRUE(order.begin_step(1));
  EXPECT_FALSE(Order(trace(), 0).begin_step(2));
  Beginnings program;
  run(order, program);
  ASSERT_EQ(program.count, 8);
  // Each takes its place right after its turn: of two neighbours in the order the later may overtake by that
  // much.
  for (std::uint32_t n = 0; n < 8; ++n)
    EXPECT_NEAR(program.place[n], static_cast<int>(2 * (n % 4) + n / 4), 1) << n;
}

// The run may plan its loop long before the first step that was recorded.
TEST_F(Orders, OfAnotherLoopAreRefusedWhereverItWasPlanned) {
  Order order(trace(), 0);
  Plan other = plan();
  other.owner[3] = 1;
  order.plan(other);
  EXPECT_FALSE(order.begin_step(7));
  EXPECT_THROW(order.begin_step(1), TraceError);
}

// Each of these would leave threads waiting for a turn that nobody takes.
TEST_F(Orders, ThatCannotBeFollowedEndTheRun) {
  const auto expect_failure = [&](const Trace& recorded, int epochs, int idle_node) {
    Order order(recorded, 0);
    order.plan(plan());
    ASSERT_TRUE(order.begin_step(1));
    Beginnings program;
    program.epochs = epochs;
    program.idle_node = idle_node;
    EXPECT_THROW(run(order, program), graph::TaskError);
  };
  expect_failure(trace(), 1, 0);        // a node that did something does nothing
  expect_failure(trace(), 1, 7);        // the last before a decision
  expect_failure(trace(), 3, -1);       // the recorded loop had ended
  expect_failure(trace(false), 2, -1);  // it had gone on without a decision
  Trace idle = trace();
  std::erase_if(idle.lanes[1].records, [](const Record& record) { return record.node == 5; });
  expect_failure(idle, 1, -1);  // a node that did nothing does something
}

TEST_F(Orders, OfFreeThreadsAreRefused) {
  Trace free = test::one_loop({0, 1}, {}, {1, 1});
  std::swap(free.lanes[0].records[1].begin, free.lanes[0].records[2].begin);
  sort_lanes(free);
  EXPECT_THROW(Order(free, 0), TraceError);
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

TEST(Export, PajeLinksTheMessagesThatWereWaitedFor) {
  Trace trace = test::two_subdomains(2);
  const std::uint32_t there = message_name(0, 1), back = message_name(1, 0);
  trace.lanes[0].records.push_back({110, 0, there, 0, pack(1, kind_send)});
  trace.lanes[1].records.push_back({110, 0, back, 0, pack(1, kind_send)});
  trace.lanes[1].records.push_back({160, 10, there, 0, pack(1, kind_receive)});
  // Once more, as copies are added up within a check.
  trace.lanes[0].records.push_back({171, 0, there, 0, pack(1, kind_send)});
  trace.lanes[1].records.push_back({172, 5, there, 0, pack(1, kind_receive)});
  sort_lanes(trace);
  std::istringstream text(io::to_paje(trace, {}));
  std::vector<std::string> begun, ended;
  for (std::string line; std::getline(text, line);) {
    const std::string key = line.substr(line.rfind(' ') + 1);
    if (line.starts_with("7 ")) begun.push_back(key);
    if (line.starts_with("8 ")) ended.push_back(key);
  }
  EXPECT_EQ(begun.size(), 2u) << "nobody waited for the other";
  EXPECT_EQ(std::set(begun.begin(), begun.end()).size(), 2u) << "a key names one link";
  EXPECT_EQ(begun, ended);
}

}  // namespace
}  // namespace talus::trace
