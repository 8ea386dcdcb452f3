/// The loop as the program runs it: every thread walks its own nodes by (colour, index), epoch after epoch,
/// waits before a node for those that conflict, and inside a node for messages
/// (runtime/graph/epoch_graph.hpp).

#include <algorithm>
#include <limits>
#include <utility>

#include "runtime/trace/detail/loop_events.hpp"

namespace talus::trace::detail {
namespace {

constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

class FixedLoop {
 public:
  FixedLoop(const LoopRun& run, const std::vector<double>& start)
      : run_(run),
        threads_(static_cast<std::uint32_t>(run.stage.machine.threads)),
        events_(run),
        workers_(run.layout.walk_begin.size() - 1),
        ranks_(start.size()),
        finished_(run.layout.nodes.size(), 0),
        first_waiter_(run.layout.nodes.size(), none),
        pending_(run.layout.nodes.size(), none) {
    find_foreign();
    for (std::uint32_t w = 0; w < workers_.size(); ++w) {
      workers_[w].rank = w / threads_;
      workers_[w].time = start[workers_[w].rank];
      workers_[w].at = run.layout.walk_begin[w];
    }
  }

  std::vector<double> run() {
    for (std::uint32_t w = 0; w < workers_.size(); ++w) advance(w, workers_[w].time);
    return events_.run(*this);
  }

  void node_ended(std::uint32_t node, std::uint32_t w, double now) {
    Worker& me = workers_[w];
    if (run_.epochs[me.epoch].exchange) events_.send_up(node, w, me.epoch, now);
    ++finished_[node];
    ++me.at;
    std::uint32_t waiter = std::exchange(first_waiter_[node], none);
    while (waiter != none) {
      const std::uint32_t next = workers_[waiter].next_waiter;
      advance(waiter, now);
      waiter = next;
    }
    advance(w, now);
  }

  void thread_freed(std::uint32_t, double) {}  // a thread goes on by itself

  void message_came(const SimMessage& came, std::uint32_t epoch, double now) {
    const std::uint32_t node = came.to, w = pending_[node];
    if (w == none || workers_[w].epoch != epoch) return;
    Worker& me = workers_[w];
    if (now > me.taken) {
      me.taken = me.waited_to = now;
      me.last_name = came.name;
    }
    me.taken += run_.stage.network.overhead();
    if (!events_.all_arrived(node, epoch)) return;
    pending_[node] = none;
    if (start(w, node)) advance(w, now);
  }

  void goes_on(std::uint32_t r, double now) {
    const std::uint32_t first = r * threads_;
    ranks_[r] = {0, now};
    for (std::uint32_t w = first; w < first + threads_; ++w) {
      ++workers_[w].epoch;
      workers_[w].at = run_.layout.walk_begin[w];
    }
    for (std::uint32_t w = first; w < first + threads_; ++w) advance(w, now);
  }

 private:
  struct Worker {
    std::uint32_t rank = 0;
    std::uint32_t at = 0;  ///< place in the walk
    std::uint32_t epoch = 0;
    std::uint32_t next_waiter = none;
    double time = 0;
    double taken = 0;             ///< when it has taken the messages that have come
    double waited_to = 0;         ///< end of its last wait for one,
    std::uint32_t last_name = 0;  ///< and which that was
  };
  struct Rank {
    std::uint32_t at_gate = 0;  ///< threads,
    double time = 0;            ///< and when the last came there
  };

  /// Only what other threads of the rank own must be looked at; a walk knows its own nodes done.
  void find_foreign() {
    foreign_begin_.push_back(0);
    watched_.resize(run_.layout.nodes.size(), 0);
    for (std::uint32_t n = 0; n < run_.layout.nodes.size(); ++n) {
      for (std::uint32_t other : run_.layout.neighbours(n)) {
        if (run_.layout.nodes[other].worker == run_.layout.nodes[n].worker) continue;
        foreign_.push_back({other, run_.layout.nodes[other].colour > run_.layout.nodes[n].colour ? 0U : 1U});
        watched_[other] = 1;
      }
      foreign_begin_.push_back(static_cast<std::uint32_t>(foreign_.size()));
    }
  }

  std::uint32_t unmet(std::uint32_t node, std::uint32_t epoch) const {
    for (std::uint32_t k = foreign_begin_[node]; k < foreign_begin_[node + 1]; ++k)
      if (finished_[foreign_[k].node] < epoch + foreign_[k].more) return foreign_[k].node;
    return none;
  }

  /// Goes on until something must be waited for, or something happens that others see.
  void advance(std::uint32_t w, double now) {
    Worker& me = workers_[w];
    me.time = std::max(me.time, now);
    for (;;) {
      if (me.at == run_.layout.walk_begin[w + 1]) {
        if (run_.epochs[me.epoch].gate) {
          Rank& rank = ranks_[me.rank];
          rank.time = std::max(rank.time, me.time);
          if (++rank.at_gate == threads_) events_.reach_gate(me.rank, me.epoch, rank.time);
          return;
        }
        ++me.epoch;
        me.at = run_.layout.walk_begin[w];
        continue;
      }
      const std::uint32_t node = run_.layout.walk[me.at];
      if (const std::uint32_t before = unmet(node, me.epoch); before != none) {
        me.next_waiter = first_waiter_[before];
        first_waiter_[before] = w;
        return;
      }
      me.taken = me.waited_to = me.time;
      if (run_.epochs[me.epoch].exchange) {
        me.taken += events_.arrived(node, me.epoch) * run_.stage.network.overhead();
        if (!events_.all_arrived(node, me.epoch)) {
          pending_[node] = w;
          return;
        }
      }
      if (!start(w, node)) return;
    }
  }

  /// The node has taken all it needs. True when nobody has to see its end.
  bool start(std::uint32_t w, std::uint32_t node) {
    Worker& me = workers_[w];
    const StartedNode started = events_.start_node(node, me.epoch);
    // Not by rounding alone.
    const double waited =
        me.waited_to > me.time ? std::max(0.0, me.taken - me.time - started.exchange.takes) : 0;
    const double end = events_.work(started, w, me.taken);
    events_.log(started, w, {me.time, end, waited}, {me.last_name, me.waited_to});
    me.time = end + (started.recorded.recorded ? run_.stage.dispatch : 0);
    if (watched_[node] || (run_.epochs[me.epoch].exchange && events_.sends(node))) {
      events_.end_node(node, w, end);
      return false;
    }
    ++finished_[node];
    ++me.at;
    return true;
  }

  struct Foreign {
    std::uint32_t node;
    std::uint32_t more;  ///< 1: must have ended this epoch, 0: the one before
  };

  const LoopRun run_;
  const std::uint32_t threads_;
  LoopEvents events_;
  std::vector<Worker> workers_;
  std::vector<Rank> ranks_;
  std::vector<std::uint32_t> finished_;      ///< per node: epochs
  std::vector<std::uint32_t> first_waiter_;  ///< per node: a list of workers
  std::vector<std::uint32_t> pending_;       ///< per node: the worker that waits inside for messages
  std::vector<std::uint32_t> foreign_begin_;
  std::vector<Foreign> foreign_;
  std::vector<char> watched_;
};

}  // namespace

std::vector<double> play_fixed(const LoopRun& run, const std::vector<double>& start) {
  return FixedLoop(run, start).run();
}

}  // namespace talus::trace::detail
