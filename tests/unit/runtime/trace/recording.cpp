#include "runtime/trace/recorder.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <vector>

#include "runtime/graph/executor.hpp"
#include "runtime/graph/task_error.hpp"
#include "runtime/trace/traced.hpp"
#include "tests/unit/runtime/trace/small_trace.hpp"

namespace talus::trace {
namespace {

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
  for (std::uint32_t i = 0; i < 100; ++i) recorder.track(0).add(i, i + 1, i, 2, test::sweep);
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

}  // namespace
}  // namespace talus::trace
