#include "runtime/trace/order.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <optional>
#include <utility>
#include <vector>

#include "runtime/graph/executor.hpp"
#include "runtime/graph/task_error.hpp"
#include "tests/unit/runtime/trace/small_trace.hpp"

namespace talus::trace {
namespace {

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
    trace.tracks = {{0, 0, {}}, {0, 1, {}}};
    for (int epoch = 0; epoch < 2; ++epoch) {
      for (std::uint32_t n = 0; n < 8; ++n)
        trace.tracks[n / 4].records.push_back(
            {20 * epoch + static_cast<int>(2 * (n % 4) + n / 4), 1, n, epoch, pack(1, test::sweep)});
      if (epoch == 1 || two_gates)
        trace.tracks[0].records.push_back({20 * epoch + 10, 1, 0, epoch, pack(1, kind_check)});
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
  std::erase_if(idle.tracks[1].records, [](const Record& record) { return record.node == 5; });
  expect_failure(idle, 1, -1);  // a node that did nothing does something
}

TEST_F(Orders, OfFreeThreadsAreRefused) {
  Trace free = test::one_loop({0, 1}, {}, {1, 1});
  std::swap(free.tracks[0].records[1].begin, free.tracks[0].records[2].begin);
  sort_tracks(free);
  EXPECT_THROW(Order(free, 0), TraceError);
}

}  // namespace
}  // namespace talus::trace
