#pragma once

/// The part of a loop's replay that is the same under every schedule: messages, decisions, and the order of
/// events.

#include <cstdint>
#include <vector>

#include "runtime/trace/detail/agenda.hpp"
#include "runtime/trace/detail/simulation.hpp"

namespace talus::trace::detail {

/// A node that has taken all it needs, and what it does in its epoch.
struct StartedNode {
  std::uint32_t node, epoch;
  NodeWork recorded;
  ExchangeWork exchange;  ///< all 0 in epochs that do not exchange
};

class LoopEvents {
 public:
  explicit LoopEvents(const LoopRun& run);

  /// Plays until no event is left and returns the times at which the ranks left the loop [ns]. The schedule's
  /// part is done by `loop`:
  ///
  ///     node_ended(node, worker, now), thread_freed(worker, now)
  ///     message_came(message, epoch, now)      // counted by now
  ///     goes_on(rank, now)                     // behind a decision, with the epoch after it
  ///
  /// Throws TraceError when a rank waits for ever.
  template <class Loop>
  std::vector<double> run(Loop& loop) {
    while (!agenda_.empty()) {
      const Event event = agenda_.next();
      switch (event.what) {
        case node_ends:
          loop.node_ended(event.a, event.b, event.time);
          break;
        case thread_is_free:
          loop.thread_freed(event.a, event.time);
          break;
        case message_leaves:
          message_left(event.a, worker_[message(event.a).from], event.b, event.time);
          break;
        case message_comes: {
          const SimMessage& came = message(event.a);
          ++arrived_[inbox(came.to, event.b)];
          loop.message_came(came, event.b, event.time);
          break;
        }
        case gate_reached:
          decide(event.a, event.b, event.time);
          break;
        case gate_opens:
          if (open_gate(event.a, event.b, event.time)) loop.goes_on(event.a, event.time);
          break;
      }
    }
    return ends();
  }

  /// The node ends then, on that worker.
  void end_node(std::uint32_t node, std::uint32_t worker, double at) {
    agenda_.add(at, node_ends, node, worker);
  }
  void free_thread(std::uint32_t worker, double at) { agenda_.add(at, thread_is_free, worker); }
  /// All threads of the rank have ended the epoch, which has a gate.
  void reach_gate(std::uint32_t rank, std::uint32_t epoch, double at) {
    agenda_.add(at, gate_reached, rank, epoch);
  }

  /// Messages that have come for a node in an epoch that exchanges, and whether these are all.
  std::uint32_t arrived(std::uint32_t node, std::uint32_t epoch) const {
    return arrived_[inbox(node, epoch)];
  }
  bool all_arrived(std::uint32_t node, std::uint32_t epoch) const {
    return arrived(node, epoch) == run_.layout.incoming[node];
  }
  /// The messages that the node waited for are its own.
  StartedNode start_node(std::uint32_t node, std::uint32_t epoch);
  /// Its work begins when it has taken its messages, at `taken`; its own then leave. Returns its end [ns].
  double work(const StartedNode& started, std::uint32_t worker, double taken);
  /// The message that came last, and when [ns].
  struct LastMessage {
    std::uint32_t name;
    double at;
  };
  /// Records the node, and its wait for the last message. Nothing where nothing was recorded.
  void log(const StartedNode& started, std::uint32_t worker, const Log::TaskTime& time,
           const LastMessage& last);
  /// True when the node sends in an epoch that exchanges.
  bool sends(std::uint32_t node) const {
    return run_.layout.send_begin[node + 1] > run_.layout.send_begin[node] ||
           (run_.layout.nodes[node].tells && run_.layout.to_root[run_.layout.nodes[node].rank].bytes > 0);
  }
  /// At the end of a node in an epoch that exchanges: the last of a leaf of the tree that tells sends for
  /// all.
  void send_up(std::uint32_t node, std::uint32_t worker, std::uint32_t epoch, double now);

 private:
  enum : std::uint32_t { node_ends, thread_is_free, message_leaves, message_comes, gate_reached, gate_opens };
  struct Rank {
    std::uint32_t told = 0;  ///< in this exchange
    double began = 0;        ///< the decision
    double decided = 0;      ///< but for the sums of others
    double left = -1;        ///< the loop
  };
  /// Sums that all ranks post and some later decision of each waits for. The first message of a posted sum
  /// travels at once; the others leave when all ranks wait for it.
  struct Round {
    int waiting = 0;
    double known = 0;
  };

  std::size_t inbox(std::uint32_t node, std::size_t epoch) const {
    return 2 * node + run_.epochs[epoch].exchanges_before % 2;
  }
  /// Those of `sends`, then those to the root.
  const SimMessage& message(std::size_t number) const {
    return number < run_.layout.sends.size() ? run_.layout.sends[number]
                                             : run_.layout.to_root[number - run_.layout.sends.size()];
  }
  /// Its messages leave one after the other, from the end of its work, `worked`.
  void send(std::uint32_t node, std::uint32_t worker, std::uint32_t epoch, double worked);
  void message_left(std::uint32_t number, std::uint32_t worker, std::uint32_t epoch, double now);
  void decide(std::uint32_t r, std::uint32_t e, double now);
  /// False when the rank leaves the loop.
  bool open_gate(std::uint32_t r, std::uint32_t e, double now);
  std::vector<double> ends() const;

  const LoopRun run_;
  Agenda agenda_;
  std::vector<Rank> ranks_;
  std::vector<Round> rounds_;
  std::vector<std::uint32_t> worker_;  ///< per node that sends: where it ran last
  /// Two per node: a neighbour is one exchange ahead at most, since it needs this node's answer.
  std::vector<std::uint32_t> arrived_;
};

}  // namespace talus::trace::detail
