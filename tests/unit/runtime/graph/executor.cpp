#include "runtime/graph/executor.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <mutex>
#include <random>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace talus::graph::executor_test {
namespace {

constexpr int thread_counts[] = {1, 2, 3, 4, 8};
constexpr std::uint64_t delay_seeds[] = {0, 1, 2, 3};

/// A program of tasks and teams over a few numbers. No update commutes with another one of the same number.
class RandomProgram {
 public:
  RandomProgram(std::uint32_t seed, std::size_t tasks) {
    std::mt19937 random(seed);
    for (std::size_t i = 0; i < tasks; ++i) {
      Step step;
      for (auto k = random() % 4; k-- > 0;) step.reads.push_back(random() % numbers);
      for (auto k = random() % 3; k-- > 0;) step.writes.push_back(random() % numbers);
      step.team = random() % 5 == 0;
      steps_.push_back(step);
    }
  }

  std::vector<std::uint64_t> run(Executor& executor) const {
    std::vector<std::uint64_t> value(numbers, 1);
    Graph graph;
    const Handles data = graph.data("number", numbers);
    for (std::size_t i = 0; i < steps_.size(); ++i) {
      std::vector<Access> accesses;
      for (const std::size_t r : steps_[i].reads)
        accesses.push_back(read(data[static_cast<std::uint32_t>(r)]));
      for (const std::size_t w : steps_[i].writes)
        accesses.push_back(write(data[static_cast<std::uint32_t>(w)]));
      if (steps_[i].team)
        graph.team("team", accesses, [this, i, &value](Worker& me) {
          // Each number has one thread that writes it, and all of them read only what the team does not
          // write.
          for (std::size_t w = 0; w < steps_[i].writes.size(); ++w)
            if (w % static_cast<std::size_t>(me.threads()) == static_cast<std::size_t>(me.thread()))
              write_one(i, w, value);
        });
      else
        graph.task("task", accesses, [this, i, &value] {
          for (std::size_t w = 0; w < steps_[i].writes.size(); ++w) write_one(i, w, value);
        });
    }
    executor.run(graph);
    return value;
  }

  /// The definition: one step after the other, no graph at all.
  std::vector<std::uint64_t> run_in_order() const {
    std::vector<std::uint64_t> value(numbers, 1);
    for (std::size_t i = 0; i < steps_.size(); ++i)
      for (std::size_t w = 0; w < steps_[i].writes.size(); ++w) write_one(i, w, value);
    return value;
  }

 private:
  static constexpr std::uint32_t numbers = 7;
  struct Step {
    std::vector<std::size_t> reads, writes;
    bool team = false;
  };

  void write_one(std::size_t step, std::size_t w, std::vector<std::uint64_t>& value) const {
    const Step& s = steps_[step];
    const std::size_t target = s.writes[w];
    for (std::size_t before = 0; before < w; ++before)
      if (s.writes[before] == target) return;
    std::uint64_t sum = step;
    for (const std::size_t r : s.reads)
      if (std::find(s.writes.begin(), s.writes.end(), r) == s.writes.end()) sum += value[r];
    value[target] = (value[target] ^ sum) * 6364136223846793005ULL + 1442695040888963407ULL;
  }

  std::vector<Step> steps_;
};

TEST(Executor, GivesTheBitsOfTheProgramInOrderForAnyThreadsAndAnyDelays) {
  for (std::uint32_t seed = 1; seed <= 8; ++seed) {
    const RandomProgram program(seed, 60);
    const auto expected = program.run_in_order();
    for (const int threads : thread_counts)
      for (const std::uint64_t delay_seed : delay_seeds) {
        Executor executor({.threads = threads, .delay_seed = delay_seed});
        EXPECT_EQ(program.run(executor), expected)
            << threads << " threads, delays " << delay_seed << ", program " << seed;
        EXPECT_EQ(program.run(executor), expected) << "again";
      }
  }
}

TEST(Executor, GoesOnBehindAnEmptyGraph) {
  for (const int threads : thread_counts) {
    Executor executor({.threads = threads});
    executor.run(Graph());
    int tasks = 0;
    Graph graph;
    graph.task("task", {}, [&] { ++tasks; });
    executor.run(graph);
    EXPECT_EQ(tasks, 1);
  }
}

TEST(Executor, RunsEveryTaskOnceAndEveryTeamOncePerThread) {
  for (const int threads : thread_counts) {
    Graph graph;
    std::atomic<int> tasks = 0, teams = 0;
    std::vector<std::atomic<int>> entered(static_cast<std::size_t>(threads));
    for (int i = 0; i < 20; ++i) {
      graph.task("task", {}, [&] { ++tasks; });
      graph.team("team", {}, [&](Worker& me) {
        EXPECT_EQ(me.threads(), threads);
        ++entered[static_cast<std::size_t>(me.thread())];
        ++teams;
      });
    }
    Executor({.threads = threads}).run(graph);
    EXPECT_EQ(tasks, 20);
    EXPECT_EQ(teams, 20 * threads);
    for (const auto& count : entered) EXPECT_EQ(count, 20);
  }
}

TEST(Executor, PutsAllThreadsIntoATeamAtTheSameTime) {
  for (const int threads : thread_counts) {
    Graph graph;
    std::atomic<int> inside = 0;
    for (int i = 0; i < 10; ++i) {
      graph.task("beside", {}, [] {});
      graph.team("meet", {}, [&, i](Worker& me) {
        const int all = (i + 1) * me.threads();
        ++inside;
        EXPECT_TRUE(me.wait([&] { return inside >= all; }));
      });
    }
    Executor({.threads = threads, .delay_seed = 4}).run(graph);
    EXPECT_EQ(inside, 10 * threads);
  }
}

TEST(Executor, AFailureNamesItsTaskAndBeginsNoOther) {
  for (const int threads : thread_counts) {
    Graph graph;
    const Handle a = graph.data("a");
    bool later = false;
    graph.task("detect", {write(a)}, [] { throw std::invalid_argument("grain 7 has no radius"); });
    graph.task("sweep", {write(a)}, [&] { later = true; });
    Executor executor({.threads = threads});
    try {
      executor.run(graph);
      FAIL() << "the failure was lost";
    } catch (const TaskError& error) {
      EXPECT_EQ(error.task(), "detect");
      EXPECT_STREQ(error.what(), "task 'detect': grain 7 has no radius");
      EXPECT_THROW(std::rethrow_if_nested(error), std::invalid_argument);
    }
    EXPECT_FALSE(later);
    Graph next;
    next.task("later", {}, [&] { later = true; });
    executor.run(next);
    EXPECT_TRUE(later) << "the executor is of use after a failure";
  }
}

TEST(Executor, AFailureReleasesATeamThatWaitsForTheFailedThread) {
  for (const int threads : {2, 3, 8}) {
    Graph graph;
    graph.team("wait", {}, [](Worker& me) {
      if (me.thread() == me.threads() - 1) throw std::runtime_error("gone");
      EXPECT_FALSE(me.wait([] { return false; }));
    });
    Executor executor({.threads = threads, .delay_seed = 9});
    EXPECT_THROW(executor.run(graph), TaskError);
  }
}

TEST(Executor, AFailureBesideATeamReleasesTheTeam) {
  for (const int threads : {2, 3, 8}) {
    Graph graph;
    std::atomic<bool> waiting = false;
    graph.task("fail", {}, [&] {
      while (!waiting) std::this_thread::yield();
      throw std::runtime_error("gone");
    });
    graph.team("wait", {}, [&](Worker& me) {
      waiting = true;
      EXPECT_FALSE(me.wait([] { return false; }));
    });
    Executor executor({.threads = threads, .delay_seed = 9});
    try {
      executor.run(graph);
      FAIL() << "the failure was lost";
    } catch (const TaskError& error) {
      EXPECT_EQ(error.task(), "fail");
    }
  }
}

TEST(Executor, WhatIsNoStandardExceptionIsReportedToo) {
  Graph graph;
  graph.task("odd", {}, [] { throw 7; });
  for (const int threads : {1, 2}) {
    Executor executor({.threads = threads});
    EXPECT_THROW(executor.run(graph), TaskError);
  }
}

TEST(Executor, RefusesToBeRunByItsOwnTasks) {
  for (const int threads : {1, 2}) {
    Executor executor({.threads = threads});
    const Graph inner;
    Graph graph;
    graph.task("recursion", {}, [&] { executor.run(inner); });
    EXPECT_THROW(executor.run(graph), TaskError);
  }
}

TEST(Executor, RefusesAnImpossibleNumberOfThreads) {
  EXPECT_THROW(Executor({.threads = 0}), std::invalid_argument);
  EXPECT_THROW(Executor({.threads = 1, .background_capacity = 0}), std::invalid_argument);
}

TEST(Executor, SaysSoWhenOpenMPGrantsFewerThreads) {
  Graph graph;
  graph.team("team", {}, [](Worker&) {});
  std::string message;
#pragma omp parallel num_threads(2)
  {
#pragma omp single
    try {
      Executor({.threads = 2}).run(graph);  // nested parallelism is off unless asked for
    } catch (const std::runtime_error& error) {
      message = error.what();
    }
  }
  EXPECT_EQ(
      message,
      "OpenMP granted 1 of 2 threads: raise OMP_THREAD_LIMIT, unset OMP_DYNAMIC, or ask for fewer threads");
}

/// A door that one side opens and the other waits at.
class Door {
 public:
  void open() {
    const std::lock_guard lock(mutex_);
    open_ = true;
    changed_.notify_all();
  }
  void wait() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return open_; });
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool open_ = false;
};

TEST(Background, RunsInOrderBesideTheGraph) {
  for (const int threads : thread_counts) {
    Executor executor({.threads = threads});
    Door computed;
    std::vector<int> order;
    executor.submit_background("first", [&] {
      computed.wait();  // ends only if the graph below runs meanwhile
      order.push_back(1);
    });
    executor.submit_background("second", [&] { order.push_back(2); });
    Graph graph;
    graph.task("compute", {}, [&] { computed.open(); });
    executor.run(graph);
    executor.drain();
    EXPECT_EQ(order, (std::vector<int>{1, 2}));
  }
}

TEST(Background, NeverHasMoreOutstandingThanItsCapacity) {
  Executor executor({.background_capacity = 2});
  std::atomic<int> ended = 0;
  for (int i = 1; i <= 500; ++i) {
    executor.submit_background("write", [&] { ++ended; });
    EXPECT_LE(i - ended, 2);
  }
  executor.drain();
  EXPECT_EQ(ended, 500);
}

TEST(Background, HoldsTheSubmitterBackWhenFull) {
  Executor executor({.background_capacity = 1});
  Door door;
  std::atomic<bool> accepted = false;
  executor.submit_background("slow", [&] {
    door.wait();
    EXPECT_FALSE(accepted) << "a second task was accepted while the first was outstanding";
  });
  std::thread submitter([&] {
    executor.submit_background("next", [] {});
    accepted = true;
  });
  door.open();
  submitter.join();
  executor.drain();
  EXPECT_TRUE(accepted);
}

TEST(Background, AFailureSurfacesOnceWithItsNameAndDropsWhatWasBehind) {
  Executor executor({.background_capacity = 3});
  Door queued;
  bool behind = false;
  executor.submit_background("results.h5", [&] {
    queued.wait();
    throw std::runtime_error("disk full");
  });
  executor.submit_background("behind", [&] { behind = true; });
  queued.open();
  try {
    executor.drain();
    FAIL() << "the failure was lost";
  } catch (const TaskError& error) {
    EXPECT_STREQ(error.what(), "task 'results.h5': disk full");
  }
  EXPECT_FALSE(behind);
  executor.drain();
  bool again = false;
  executor.submit_background("again", [&] { again = true; });
  executor.drain();
  EXPECT_TRUE(again);
}

TEST(Background, AFailureSurfacesAtTheNextSubmission) {
  Executor executor({.background_capacity = 1});
  executor.submit_background("fails", [] { throw std::runtime_error("disk full"); });
  bool ran = false;
  EXPECT_THROW(executor.submit_background("next", [&] { ran = true; }), TaskError)
      << "capacity 1: it waits for the first to end";
  executor.drain();
  EXPECT_FALSE(ran);
}

TEST(Background, EndsItsTasksBeforeTheExecutorGoes) {
  int done = 0;
  {
    Executor executor({.background_capacity = 10});
    for (int i = 0; i < 5; ++i) executor.submit_background("write", [&] { ++done; });
    executor.submit_background("fails", [] { throw std::runtime_error("nobody asks"); });
  }
  EXPECT_EQ(done, 5);
  Executor unused({});
  unused.drain();
}

}  // namespace
}  // namespace talus::graph::executor_test
