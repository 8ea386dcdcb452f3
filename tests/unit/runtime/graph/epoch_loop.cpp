#include "runtime/graph/epoch_loop.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "runtime/graph/executor.hpp"

namespace talus::graph {
namespace {

/// The same on every platform, unlike std::uniform_int_distribution.
std::uint32_t draw(std::mt19937& random, std::uint32_t below) {
  return static_cast<std::uint32_t>(random() % below);
}

/// A conflict graph with a proper colouring.
struct Problem {
  std::vector<std::uint32_t> colour, offset, neighbour;
  std::vector<std::uint32_t>
      pair;  ///< per entry of neighbour: number of the conflicting pair, the same on both sides
  std::size_t pairs = 0;
  Conflicts view() const { return {colour, offset, neighbour}; }
};

/// First-fit colours in the order of nodes.
Problem problem_from(const std::vector<std::vector<std::uint32_t>>& adjacent) {
  Problem p;
  p.offset.push_back(0);
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> numbers;
  for (std::uint32_t i = 0; i < adjacent.size(); ++i) {
    std::vector<bool> taken(adjacent.size() + 1, false);
    for (const std::uint32_t j : adjacent[i]) {
      if (j < i) taken[p.colour[j]] = true;
      p.neighbour.push_back(j);
      p.pair.push_back(
          numbers.try_emplace(std::minmax(i, j), static_cast<std::uint32_t>(numbers.size())).first->second);
    }
    p.offset.push_back(static_cast<std::uint32_t>(p.neighbour.size()));
    p.colour.push_back(
        static_cast<std::uint32_t>(std::find(taken.begin(), taken.end(), false) - taken.begin()));
  }
  p.pairs = numbers.size();
  return p;
}

Problem random_problem(std::size_t nodes, double density, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::vector<std::vector<std::uint32_t>> adjacent(nodes);
  for (std::uint32_t i = 0; i < nodes; ++i)
    for (std::uint32_t j = 0; j < i; ++j)
      if (draw(random, 1000) < 1000 * density) {
        adjacent[i].push_back(j);
        adjacent[j].push_back(i);
      }
  return problem_from(adjacent);
}

/// Owners without any spatial order, so that waits abound; some threads may own nothing.
std::vector<std::uint32_t> random_owners(std::size_t nodes, int threads, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::vector<std::uint32_t> owner(nodes);
  for (std::uint32_t& o : owner) o = draw(random, static_cast<std::uint32_t>(threads));
  return owner;
}

/// Each conflicting pair shares a number that both nodes read and write, each node has one of its own, and no
/// update commutes with another: every change of order, and every overlap of two conflicting nodes, shows in
/// the digest. Gates move by what was decided.
class Mixing {
 public:
  Mixing(const Problem& problem, int gates)
      : problem_(problem), own_(problem.colour.size()), shared_(problem.pairs, 7), left_(gates) {
    std::iota(own_.begin(), own_.end(), 1U);
  }

  void node(std::uint32_t node, int epoch) {
    std::uint64_t own = own_[node] * 6364136223846793005ULL + static_cast<std::uint64_t>(epoch) + decided_;
    for (std::uint32_t i = problem_.offset[node]; i < problem_.offset[node + 1]; ++i) {
      std::uint64_t& shared = shared_[problem_.pair[i]];
      shared = (shared ^ own) * 0x9e3779b97f4a7c15ULL + 1;
      own += shared >> 7;
    }
    own_[node] = own;
  }
  bool gate(int epoch) const { return epoch == gate_; }
  bool decide(int epoch) {
    for (const std::uint64_t value : own_) decided_ = decided_ * 31 + value;
    gate_ = epoch + 1 + static_cast<int>(decided_ % 4);
    return --left_ > 0;
  }
  std::uint64_t digest() const { return decided_; }

  /// The definition: a plain loop over epochs, colours and nodes.
  void run_in_order() {
    const std::uint32_t colours =
        problem_.colour.empty() ? 0 : 1 + *std::max_element(problem_.colour.begin(), problem_.colour.end());
    for (int epoch = 0;; ++epoch) {
      const bool gated = gate(epoch);
      for (std::uint32_t c = 0; c < colours; ++c)
        for (std::uint32_t i = 0; i < problem_.colour.size(); ++i)
          if (problem_.colour[i] == c) node(i, epoch);
      if (gated && !decide(epoch)) return;
    }
  }

 private:
  const Problem& problem_;
  std::vector<std::uint64_t> own_;     ///< per node
  std::vector<std::uint64_t> shared_;  ///< per pair
  std::uint64_t decided_ = 1;
  int left_;
  int gate_ = 2;
};

std::uint64_t digest_in_order(const Problem& problem, int gates) {
  Mixing mixing(problem, gates);
  mixing.run_in_order();
  return mixing.digest();
}

/// Runs `program` over `loop` as the only task of a graph.
template <class Program>
void run_as_team(Executor& executor, EpochGraph& loop, Program& program) {
  Graph graph;
  graph.team("loop", {}, [&](Worker& me) { run_epochs(loop, me, program); });
  executor.run(graph);
}

constexpr int thread_counts[] = {1, 2, 3, 4, 8};

TEST(EpochLoop, GivesTheBitsOfThePlainLoopForAnyThreadsAndAnyDelays) {
  for (std::uint32_t seed = 1; seed <= 6; ++seed) {
    const Problem problem = random_problem(20 * seed, 0.9 / seed, seed);
    const std::uint64_t expected = digest_in_order(problem, 12);
    for (const int threads : thread_counts)
      for (const std::uint64_t delay_seed : {0, 11, 12}) {
        EpochGraph loop;
        loop.build(problem.view(), random_owners(problem.colour.size(), threads, seed + 100), threads);
        Executor executor({.threads = threads, .delay_seed = delay_seed});
        Mixing mixing(problem, 12);
        run_as_team(executor, loop, mixing);
        EXPECT_EQ(mixing.digest(), expected)
            << "threads " << threads << ", delays " << delay_seed << ", problem " << seed;
      }
  }
}

TEST(EpochLoop, IsReplayedWithoutBeingRebuilt) {
  const Problem problem = random_problem(40, 0.2, 5);
  EpochGraph loop;
  loop.build(problem.view(), random_owners(40, 3, 1), 3);
  Executor executor({.threads = 3, .delay_seed = 3});
  for (int gates = 1; gates < 6; ++gates) {
    Mixing mixing(problem, gates);
    run_as_team(executor, loop, mixing);
    EXPECT_EQ(mixing.digest(), digest_in_order(problem, gates)) << "run " << gates;
  }
}

TEST(EpochLoop, RunsWithFewerNodesThanThreads) {
  for (const std::size_t nodes : {0, 1, 2, 3}) {
    const Problem problem = random_problem(nodes, 1.0, 9);
    for (const int threads : thread_counts) {
      EpochGraph loop;
      loop.build(problem.view(), random_owners(nodes, threads, 3), threads);
      Executor executor({.threads = threads, .delay_seed = 7});
      Mixing mixing(problem, 20);
      run_as_team(executor, loop, mixing);
      EXPECT_EQ(mixing.digest(), digest_in_order(problem, 20))
          << nodes << " nodes, " << threads << " threads";
    }
  }
}

TEST(EpochLoop, AsksNothingOfAnybodyOnOneThread) {
  const Problem problem = random_problem(50, 0.3, 2);
  EpochGraph loop;
  loop.build(problem.view(), {}, 1);
  EXPECT_EQ(loop.wait_count(), 0U);
  EXPECT_LE(loop.memory_used(), 50 * sizeof(std::uint32_t) + 2 * sizeof(std::uint32_t));
  Mixing mixing(problem, 5);
  run_epochs(loop, mixing);
  EXPECT_EQ(mixing.digest(), digest_in_order(problem, 5));
}

TEST(EpochLoop, AFailureReleasesAllThreadsAndNamesTheTask) {
  struct Failing {
    Mixing mixing;
    bool in_decide;
    void node(std::uint32_t node, int epoch) {
      if (!in_decide && node == 17 && epoch == 4) throw std::runtime_error("node 17 fell apart");
      mixing.node(node, epoch);
    }
    bool gate(int epoch) const { return epoch == 6; }
    bool decide(int) { throw std::runtime_error("no decision"); }
  };
  const Problem problem = random_problem(40, 0.2, 4);
  for (const int threads : thread_counts)
    for (const bool in_decide : {false, true}) {
      EpochGraph loop;
      loop.build(problem.view(), random_owners(40, threads, 8), threads);
      Executor executor({.threads = threads, .delay_seed = 5});
      Failing failing{Mixing(problem, 1), in_decide};
      try {
        run_as_team(executor, loop, failing);
        FAIL() << "the failure was lost";
      } catch (const TaskError& error) {
        EXPECT_EQ(error.task(), "loop");
        EXPECT_STREQ(error.what(),
                     in_decide ? "task 'loop': no decision" : "task 'loop': node 17 fell apart");
      }
    }
}

TEST(EpochLoop, LeftByAFailureRefusesToRunUntilReset) {
  struct Program {
    bool fails = true;
    void node(std::uint32_t node, int) const {
      if (fails && node == 1) throw std::runtime_error("once");
    }
    bool gate(int) const { return true; }
    bool decide(int epoch) const { return epoch < 3; }
  } program;
  const Problem problem = random_problem(10, 0.5, 4);
  EpochGraph loop;
  loop.build(problem.view(), random_owners(10, 2, 8), 2);
  Executor executor({.threads = 2});
  EXPECT_THROW(run_as_team(executor, loop, program), TaskError);
  program.fails = false;
  EXPECT_THROW(run_as_team(executor, loop, program), TaskError);
  loop.reset();
  EXPECT_NO_THROW(run_as_team(executor, loop, program));
}

TEST(EpochLoop, PlannedForOtherThreadsIsRefused) {
  const Problem problem = random_problem(10, 0.5, 4);
  EpochGraph loop;
  loop.build(problem.view(), random_owners(10, 2, 8), 2);
  Executor executor({.threads = 3});
  Mixing mixing(problem, 1);
  EXPECT_THROW(run_as_team(executor, loop, mixing), TaskError);
  EXPECT_THROW(run_epochs(loop, mixing), std::invalid_argument);
}

/// The message of the refusal, or "accepted".
std::string refusal(const Conflicts& conflicts, const std::vector<std::uint32_t>& owner, int threads) {
  try {
    EpochGraph().build(conflicts, owner, threads);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "accepted";
}

TEST(EpochGraph, RefusesConflictsThatContradictThemselves) {
  using Numbers = std::vector<std::uint32_t>;
  const Numbers two_colours{0, 1};
  EXPECT_EQ(refusal({two_colours, Numbers{0, 1, 2}, Numbers{1, 0}}, {0, 1}, 2), "accepted");
  EXPECT_EQ(refusal({two_colours, Numbers{0, 2, 3}, Numbers{1, 1, 0}}, {0, 1}, 2), "accepted")
      << "a repetition is no contradiction";
  EXPECT_EQ(refusal({two_colours, Numbers{0, 1, 1}, Numbers{1}}, {0, 1}, 2),
            "epoch graph: nodes 0 and 1 conflict, but only the first knows of it");
  EXPECT_EQ(refusal({Numbers{3, 3}, Numbers{0, 1, 2}, Numbers{1, 0}}, {0, 1}, 2),
            "epoch graph: nodes 0 and 1 conflict and have the same colour 3");
  EXPECT_EQ(refusal({two_colours, Numbers{0, 1, 2}, Numbers{1, 2}}, {0, 1}, 2),
            "epoch graph: node 1 conflicts with node 2 of 2");
  EXPECT_EQ(refusal({two_colours, Numbers{0, 1, 2}, Numbers{1, 0}}, {0, 2}, 2),
            "epoch graph: node 1 is owned by thread 2 of 2");
  EXPECT_NE(refusal({two_colours, Numbers{0, 1}, Numbers{1}}, {0, 1}, 2), "accepted");
  EXPECT_NE(refusal({two_colours, Numbers{0, 2, 1}, Numbers{1}}, {0, 1}, 2), "accepted");
  EXPECT_NE(refusal({two_colours, Numbers{0, 0, 0}, Numbers{}}, {0}, 2), "accepted");
  EXPECT_NE(refusal({{}, Numbers{0}, {}}, {}, 0), "accepted");
}

TEST(EpochGraph, WaitsOnlyWhereRangesMeet) {
  // A chain of 100 nodes in two colours, cut into halves: one pair of neighbours is split, so each side waits
  // for the other once.
  std::vector<std::vector<std::uint32_t>> adjacent(100);
  for (std::uint32_t i = 0; i + 1 < 100; ++i) {
    adjacent[i].push_back(i + 1);
    adjacent[i + 1].push_back(i);
  }
  const Problem problem = problem_from(adjacent);
  std::vector<std::uint32_t> owner(100);
  assign_owners(std::vector<std::uint32_t>(100, 1), 2, owner);
  EpochGraph loop;
  loop.build(problem.view(), owner, 2);
  EXPECT_EQ(loop.wait_count(), 2U);
  EXPECT_EQ(loop.walk(0).size(), 50U);
}

TEST(Owners, AreContiguousAndNearlyEqual) {
  std::mt19937 random(3);
  for (const int threads : {1, 2, 3, 7, 16}) {
    std::vector<std::uint32_t> weight(200);
    for (std::uint32_t& w : weight) w = draw(random, 500);
    std::vector<std::uint32_t> owner(weight.size());
    assign_owners(weight, threads, owner);
    EXPECT_TRUE(std::is_sorted(owner.begin(), owner.end()));
    std::vector<double> load(static_cast<std::size_t>(threads), 0);
    for (std::size_t i = 0; i < weight.size(); ++i) load.at(owner[i]) += weight[i];
    const double mean = std::accumulate(weight.begin(), weight.end(), 0.0) / threads;
    for (const double sum : load) EXPECT_NEAR(sum, mean, 500.0);
  }
}

TEST(Owners, ExistForNodesWithoutWeight) {
  std::vector<std::uint32_t> owner(4);
  assign_owners(std::vector<std::uint32_t>(4, 0), 2, owner);
  EXPECT_EQ(owner, (std::vector<std::uint32_t>{0, 0, 1, 1}));
  assign_owners(std::vector<std::uint32_t>{5, 0, 0, 0}, 2, owner);
  EXPECT_LT(owner.back(), 2U);
  assign_owners({}, 3, {});
}

TEST(Owners, KeepAGroupWithOneThreadWhereThatIsFair) {
  // Four groups of equal work on two threads: the cut falls between groups, not in the heavy node's middle.
  const std::vector<std::uint32_t> weight = {9, 1, 5, 5, 2, 8, 10}, group = {0, 0, 1, 1, 2, 2, 3};
  std::vector<std::uint32_t> owner(weight.size());
  assign_owners(weight, group, 2, owner);
  EXPECT_EQ(owner, (std::vector<std::uint32_t>{0, 0, 0, 0, 1, 1, 1}));
  // Three threads cannot have equal parts of four groups: nodes are dealt out one by one.
  std::vector<std::uint32_t> alone(weight.size());
  assign_owners(weight, 3, alone);
  assign_owners(weight, group, 3, owner);
  EXPECT_EQ(owner, alone);
  EXPECT_THROW(assign_owners(weight, std::vector<std::uint32_t>{0}, 2, owner), std::invalid_argument);
}

}  // namespace
}  // namespace talus::graph
