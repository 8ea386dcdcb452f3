#pragma once

/// The plan of a loop whose nodes conflict: which thread runs which node, and what a thread must see of
/// another before it may go on.
///
/// Nodes have colours; no two conflicting nodes share one. In epoch e a node may start when its conflicting
/// nodes of lower colour have finished epoch e and those of higher colour have finished epoch e - 1. So any
/// two conflicting nodes alternate in an order that the colours fix: the result is that of the loop "for each
/// epoch, for each node by (colour, index)", bit for bit, for any number of threads and any timing, provided
/// that nodes which share what they write conflict.
///
/// Each thread walks its own nodes by (colour, index), epoch after epoch, and publishes how far it has come
/// in one counter. Since the walk is fixed, "node c of thread u has finished epoch e" means "u's counter is
/// at least e * stride(u) + place of c + 1", and a thread needs at most one such number per other thread
/// before a node: the largest. Numbers that an earlier node of the walk has already asked for are dropped,
/// and a thread publishes only where another one waits. With two threads that own halves of a grid a few
/// percent of the nodes wait or publish:
///
///     thread 0:  a b c |publish 3| d e ... |wait for u1 >= 4| k ...
///     thread 1:  p q |wait for u0 >= 3| r s |publish 4| ...
///
/// per epoch, and no barrier between epochs.
///
/// No deadlock: of all unfinished (epoch, colour, index), the smallest has nothing unfinished to wait for.

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/graph/worker.hpp"

namespace talus::graph {

/// Which nodes conflict: n colours, n + 1 offsets, neighbours of node c in neighbour[offset[c] .. offset[c +
/// 1]). Symmetric, in any order. Views: valid during the call they are given to.
struct Conflicts {
  std::span<const std::uint32_t> colour;
  std::span<const std::uint32_t> offset;
  std::span<const std::uint32_t> neighbour;
};

/// Owners of contiguous ranges of nearly equal weight, for nodes in an order in which neighbours are near
/// (Morton order, say). weight and owner: n each; owner is non-decreasing, < threads. The middle of a node's
/// range of weight decides its owner, in integers: the result is deterministic, and no range exceeds the mean
/// by more than the heaviest node. If all weights are 0, all count as 1. threads >= 1; the sum of weights
/// times 2 * threads must fit 64 bits.
void assign_owners(std::span<const std::uint32_t> weight, int threads, std::span<std::uint32_t> owner);

/// The same for nodes in groups (subdomains). group: n numbers, equal ones side by side. Whole groups go to
/// one thread, unless that leaves some thread more than a tenth above the mean; then groups do not count.
void assign_owners(std::span<const std::uint32_t> weight, std::span<const std::uint32_t> group, int threads,
                   std::span<std::uint32_t> owner);

class EpochGraph;
template <class Program>
bool run_epochs(EpochGraph& graph, Worker& me, Program& program);  // epoch_loop.hpp

class EpochGraph {
 public:
  EpochGraph() = default;
  EpochGraph(const EpochGraph&) = delete;
  EpochGraph& operator=(const EpochGraph&) = delete;

  /// Plans the loop; replaces an earlier plan and reuses its memory. owner: n values < threads; may be empty
  /// with one thread. With one thread only the order of nodes is stored: no dependencies, no counters. Cost:
  /// a few ns per conflict. Throws std::invalid_argument when sizes do not match, an index is out of range, a
  /// node conflicts with itself or with one of its colour, or only one of two nodes lists their conflict; the
  /// graph is empty then.
  void build(const Conflicts& conflicts, std::span<const std::uint32_t> owner, int threads);

  /// Makes the graph usable again after a run that failed; called by one thread. A loop that decide() ended
  /// does not need it.
  void reset() noexcept;

  int threads() const noexcept { return threads_; }
  std::size_t size() const noexcept { return order_.size(); }
  /// Nodes of `thread` in the order of its walk.
  std::span<const std::uint32_t> walk(int thread) const noexcept;
  /// Waits per epoch, over all threads; 0 with one thread.
  std::size_t wait_count() const noexcept { return waits_.size(); }
  /// Bytes held for this plan.
  std::size_t memory_used() const noexcept;

 private:
  template <class Program>
  friend bool run_epochs(EpochGraph& graph, Worker& me, Program& program);
  friend class EpochPeers;

  /// Before its node, the walk needs counter of `thread` >= epoch * stride(thread) + place.
  struct Wait {
    std::uint32_t thread;
    std::int32_t place;  ///< <= 0: in the epoch before
  };
  /// One node of a walk.
  struct Step {
    std::uint32_t node;
    std::uint32_t waits : 31;     ///< how many entries of waits_, following those of the step before
    std::uint32_t published : 1;  ///< some thread waits for the end of this step
  };
  /// What one thread writes while it walks. It has cache lines of its own, so that its writes cost another
  /// thread nothing unless that thread waits for them.
  struct alignas(cache_line) Counter {
    /// Steps finished since build: epochs * stride + place. Written by the owner of the walk with release
    /// after the nodes up to there have written their data; read with acquire by threads that wait. Without
    /// the pair a neighbour could use data of the previous epoch, or overwrite data that is still being read.
    std::atomic<std::int64_t> finished{0};
    /// Used by the owner only: epochs of the loops that have ended, and whether it is inside one.
    std::int64_t past_epochs = 0;
    bool walking = false;
  };

  /// Steps per epoch in the counter of a thread; 1 for a thread without nodes, so that its epochs can be told
  /// apart, too.
  std::int64_t stride(int thread) const noexcept;
  void clear() noexcept;
  void sort_walks(const Conflicts& conflicts, std::span<const std::uint32_t> owner);
  void find_waits(const Conflicts& conflicts, std::span<const std::uint32_t> owner);

  int threads_ = 1;
  std::vector<std::uint32_t> order_;       ///< nodes, walk after walk
  std::vector<std::uint32_t> first_step_;  ///< threads + 1 offsets into order_ and steps_
  // Several threads only:
  std::vector<Step> steps_;
  std::vector<Wait> waits_;                ///< of all walks, in the order of the steps
  std::vector<std::uint32_t> first_wait_;  ///< per thread, into waits_
  std::vector<Counter> counters_;          ///< per thread
  /// 2 * (epochs since build that the last decision ended) + (1 if it ended the loop). Written by thread 0
  /// with release after decide(), read with acquire by all others, so that they see what was decided before
  /// they go on.
  struct alignas(cache_line) Decision {
    std::atomic<std::int64_t> value{0};
  } decision_;
};

}  // namespace talus::graph
