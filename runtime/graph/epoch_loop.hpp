#pragma once

/// Runs the loop that an EpochGraph plans. A program gives the work:
///
///     struct Sweep {
///       // One node; runs beside nodes that it does not conflict with.
///       void node(std::uint32_t chunk, int epoch);
///       // Does anybody decide after this epoch?
///       // Whether decide() is called after this epoch.
///       // Called when all nodes have finished the epoch and nothing else runs; false ends the loop.
///       bool decide(int epoch);
///     };
///     graph.build(conflicts, owner, executor.threads());
///     step.team("iterate", accesses, [&](Worker& me) { run_epochs(graph, me, sweep); });
///
/// A program may also have `void assist()`: threads that wait for a decision call it again and again, so that
/// decide() can share out work (crew.hpp); and `void about_to_wait()`, called before nodes that may have to
/// wait for other threads.
///
/// Epochs count from 0 in every call. The loop ends only in decide(), so some gate must be true sooner or
/// later. gate(epoch) is asked by every thread at the beginning of its epoch and must be the same on all: it
/// may depend on the epoch and on what decide() wrote. Between gates there is no barrier: threads are in
/// different epochs, as far apart as conflicts allow.

#include <concepts>
#include <cstdint>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "runtime/graph/epoch_graph.hpp"

namespace talus::graph {

template <class Program>
concept EpochProgram = requires(Program& program, std::uint32_t node, int epoch) {
  program.node(node, epoch);
  { program.gate(epoch) } -> std::convertible_to<bool>;
  { program.decide(epoch) } -> std::convertible_to<bool>;
};

/// The loop on one thread: the plain loop over epochs and nodes. The graph was built for one thread.
template <class Program>
void run_epochs(EpochGraph& graph, Program& program) {
  static_assert(EpochProgram<Program>);
  if (graph.threads() != 1)
    throw std::invalid_argument("an epoch loop planned for " + std::to_string(graph.threads()) +
                                " threads is run by one");
  const std::span<const std::uint32_t> nodes = graph.walk(0);
  for (int epoch = 0;; ++epoch) {
    const bool gated = program.gate(epoch);
    for (const std::uint32_t node : nodes) program.node(node, epoch);
    if (gated && !program.decide(epoch)) return;
  }
}

/// What one thread of the team knows of the others while it walks.
class EpochPeers {
 public:
  EpochPeers(EpochGraph& graph, Worker& me) : graph_(graph), me_(me) {
    for (int thread = 0; thread < graph.threads(); ++thread)
      peers_.push_back(
          {&graph.counters_[static_cast<std::size_t>(thread)].finished, graph.stride(thread), 0});
  }

  /// Steps per epoch of a thread.
  std::int64_t stride(std::size_t thread) const { return peers_[thread].stride; }

  /// Waits until `thread` has finished `place` steps of epoch `now`, counted since the graph was built. False
  /// if the run was stopped first.
  bool wait_for(std::size_t thread, std::int64_t now, std::int64_t place) {
    Peer& peer = peers_[thread];
    const std::int64_t needed = now * peer.stride + place;
    return peer.seen >= needed || me_.wait([&] {
      peer.seen = peer.finished->load(std::memory_order_acquire);
      return peer.seen >= needed;
    });
  }

  /// The result of program.decide(epoch) after epoch `now`, which this thread has finished. Thread 0 calls it
  /// when all threads have finished the epoch; the others read the result. None if the run was stopped first.
  template <class Program>
  std::optional<bool> decide(Program& program, int epoch, std::int64_t now) {
    std::atomic<std::int64_t>& decision = graph_.decision_.value;
    if (me_.thread() == 0) {
      for (std::size_t thread = 0; thread < peers_.size(); ++thread)
        if (!wait_for(thread, now + 1, 0)) return std::nullopt;
      me_.delay();
      const bool goes_on = program.decide(epoch);
      decision.store(2 * (now + 1) + (goes_on ? 0 : 1), std::memory_order_release);
      return goes_on;
    }
    std::int64_t decided = 0;
    const bool told = me_.wait([&] {
      if constexpr (requires { program.assist(); }) program.assist();
      return (decided = decision.load(std::memory_order_acquire)) >= 2 * (now + 1);
    });
    if (!told) return std::nullopt;
    return decided % 2 == 0;  // of this very epoch: thread 0 cannot pass the next gate without this thread
  }

 private:
  struct Peer {
    const std::atomic<std::int64_t>* finished;
    std::int64_t stride;
    std::int64_t seen;  ///< last value read; avoids reading a cache line that its owner keeps writing
  };
  EpochGraph& graph_;
  Worker& me_;
  std::vector<Peer> peers_;
};

/// One thread's part of the loop; to be called by all threads of the team, with the same graph and program.
/// True when decide() ended the loop, false when the thread left because a task of the run has failed
/// elsewhere. What the program throws passes through; whoever catches it raises the stop flag of the workers
/// (Executor does), and every other thread leaves. decide() is always called by thread 0. Cost beside the
/// work (bench_task_cost, Zen 4): 0.6 ns per node on one thread; 3-5 ns of both threads' time on two. A wait
/// for a cache line that the other core has just written takes 50-100 ns, but few nodes wait. Throws
/// std::invalid_argument when the team is not the one the graph was built for, std::logic_error when an
/// earlier run failed and reset() was not called.
template <class Program>
bool run_epochs(EpochGraph& graph, Worker& me, Program& program) {
  static_assert(EpochProgram<Program>);
  if (me.threads() != graph.threads())
    throw std::invalid_argument("an epoch loop planned for " + std::to_string(graph.threads()) +
                                " threads is run by " + std::to_string(me.threads()));
  if (graph.threads() == 1) {
    run_epochs(graph, program);
    return true;
  }

  EpochPeers peers(graph, me);
  const auto self = static_cast<std::size_t>(me.thread());
  EpochGraph::Counter& mine = graph.counters_[self];
  if (mine.walking)
    throw std::logic_error("an epoch graph whose last run failed is run again without EpochGraph::reset");
  mine.walking = true;
  const std::int64_t stride = peers.stride(self);
  const auto steps =
      std::span(graph.steps_)
          .subspan(graph.first_step_[self], graph.first_step_[self + 1] - graph.first_step_[self]);
  const EpochGraph::Wait* const first_wait = graph.waits_.data() + graph.first_wait_[self];

  for (int epoch = 0;; ++epoch) {
    if (me.stopped()) return false;
    // Asked before the epoch ends: once it has, thread 0 may be inside decide() and change the answer.
    const bool gated = program.gate(epoch);
    const std::int64_t now = mine.past_epochs + epoch;
    std::int64_t finished = now * stride;
    const EpochGraph::Wait* wait = first_wait;
    for (const EpochGraph::Step& step : steps) {
      if constexpr (requires { program.about_to_wait(); })
        if (step.waits > 0) program.about_to_wait();
      for (const EpochGraph::Wait* const end = wait + step.waits; wait != end; ++wait)
        if (!peers.wait_for(wait->thread, now, wait->place)) return false;
      me.delay();
      program.node(step.node, epoch);
      ++finished;
      if (step.published) mine.finished.store(finished, std::memory_order_release);
    }
    if (!gated) continue;

    mine.finished.store((now + 1) * stride, std::memory_order_release);
    const std::optional<bool> goes_on = peers.decide(program, epoch, now);
    if (!goes_on) return false;
    if (!*goes_on) {
      mine.past_epochs = now + 1;
      mine.walking = false;
      return true;
    }
  }
}

}  // namespace talus::graph
