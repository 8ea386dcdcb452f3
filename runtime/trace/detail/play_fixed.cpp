/// The loop as the program runs it: every thread walks its own nodes by (colour, index), epoch after epoch,
/// waits before a node for those that conflict, and inside a node for messages
/// (runtime/graph/epoch_graph.hpp).

#include <algorithm>
#include <limits>
#include <utility>

#include "runtime/trace/detail/simulation.hpp"

namespace talus::trace::detail {
namespace {

constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

class FixedLoop {
 public:
  FixedLoop(Stage& stage, const StepIndex& index, const LoopLayout& layout,
            const std::vector<SimEpoch>& epochs, const std::vector<double>& start)
      : stage_(stage),
        index_(index),
        layout_(layout),
        epochs_(epochs),
        threads_(static_cast<std::uint32_t>(stage.machine.threads)),
        rounds_(stage.machine.ranks, epochs, stage.network),
        workers_(layout.walk_begin.size() - 1),
        ranks_(start.size()),
        finished_(layout.nodes.size(), 0),
        first_waiter_(layout.nodes.size(), none),
        pending_(layout.nodes.size(), none),
        arrived_(2 * layout.nodes.size(), 0) {
    find_foreign();
    for (std::uint32_t w = 0; w < workers_.size(); ++w) {
      workers_[w].rank = w / threads_;
      workers_[w].time = start[workers_[w].rank];
      workers_[w].at = layout.walk_begin[w];
    }
  }

  std::vector<double> run() {
    for (std::uint32_t w = 0; w < workers_.size(); ++w) advance(w, workers_[w].time);
    while (!agenda_.empty()) {
      const Event event = agenda_.next();
      switch (event.what) {
        case node_ends:
          node_ended(event.a, event.time);
          break;
        case message_leaves:
          message_left(event.a, event.b, event.time);
          break;
        case message_comes:
          message_came(message(event.a), event.b, event.time);
          break;
        case gate_reached:
          decide(event.a, event.time);
          break;
        case gate_opens:
          open_gate(event.a, event.time);
          break;
      }
    }
    std::vector<double> end;
    for (const Rank& rank : ranks_) {
      if (!rank.left) throw TraceError("the loop of a step stands still in replay: its plan has no order");
      end.push_back(rank.time);
    }
    return end;
  }

 private:
  enum : std::uint32_t { node_ends, message_leaves, message_comes, gate_reached, gate_opens };

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
    std::uint32_t at_gate = 0;  ///< threads
    std::uint32_t told = 0;     ///< in this exchange
    double time = 0;
    double ready = 0;  ///< decided, but for the sums of others
    bool left = false;
  };

  /// Only what other threads of the rank own must be looked at; a walk knows its own nodes done.
  void find_foreign() {
    foreign_begin_.push_back(0);
    watched_.resize(layout_.nodes.size(), 0);
    for (std::uint32_t n = 0; n < layout_.nodes.size(); ++n) {
      for (std::uint32_t other : layout_.neighbours(n)) {
        if (layout_.nodes[other].worker == layout_.nodes[n].worker) continue;
        foreign_.push_back({other, layout_.nodes[other].colour > layout_.nodes[n].colour ? 0U : 1U});
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

  std::size_t inbox(std::uint32_t node, std::size_t epoch) const {
    return 2 * node + epochs_[epoch].exchanges_before % 2;
  }

  /// Goes on until something must be waited for, or something happens that others see.
  void advance(std::uint32_t w, double now) {
    Worker& me = workers_[w];
    me.time = std::max(me.time, now);
    for (;;) {
      if (me.at == layout_.walk_begin[w + 1]) {
        if (epochs_[me.epoch].gate) {
          Rank& rank = ranks_[me.rank];
          rank.time = std::max(rank.time, me.time);
          if (++rank.at_gate == threads_) agenda_.add(rank.time, gate_reached, me.rank);
          return;
        }
        ++me.epoch;
        me.at = layout_.walk_begin[w];
        continue;
      }
      const std::uint32_t node = layout_.walk[me.at];
      if (const std::uint32_t before = unmet(node, me.epoch); before != none) {
        me.next_waiter = first_waiter_[before];
        first_waiter_[before] = w;
        return;
      }
      me.taken = me.waited_to = me.time;
      if (epochs_[me.epoch].exchange) {
        const std::uint32_t came = arrived_[inbox(node, me.epoch)];
        me.taken += came * stage_.network.overhead();
        if (came < layout_.incoming[node]) {
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
    const SimEpoch& epoch = epochs_[me.epoch];
    const NodeWork recorded = work_of(stage_, index_, layout_.nodes[node], node, epoch, me.epoch);
    ExchangeWork exchange;
    if (epoch.exchange) {
      exchange = exchange_work(stage_, layout_, node);
      arrived_[inbox(node, me.epoch)] = 0;
    }
    const double waited = std::max(0.0, me.taken - me.time - exchange.takes),
                 worked = me.taken + recorded.work + exchange.shares, end = worked + exchange.sends;
    if (recorded.recorded) {
      const auto number = static_cast<std::int32_t>(me.epoch);
      stage_.log.task(w, me.time, end, waited, node - layout_.rank_begin[me.rank], number, recorded.kind);
      if (waited > 0)
        stage_.log.span(w, me.waited_to - waited, me.waited_to, me.last_name, number, kind_receive);
    }
    me.time = end + (recorded.recorded ? stage_.dispatch : 0);
    const bool sends =
        epoch.exchange && (layout_.send_begin[node + 1] > layout_.send_begin[node] ||
                           (layout_.nodes[node].tells && layout_.to_centre[me.rank].bytes > 0));
    for (std::uint32_t k = layout_.send_begin[node]; epoch.exchange && k < layout_.send_begin[node + 1]; ++k)
      agenda_.add(worked + (k - layout_.send_begin[node] + 1) * stage_.network.overhead(), message_leaves, k,
                  me.epoch);
    if (watched_[node] || sends) {
      agenda_.add(end, node_ends, w);
      return false;
    }
    ++finished_[node];
    ++me.at;
    return true;
  }

  void node_ended(std::uint32_t w, double now) {
    Worker& me = workers_[w];
    const std::uint32_t node = layout_.walk[me.at];
    if (epochs_[me.epoch].exchange) send_up(node, me.rank, me.epoch, now);
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

  /// The last of a leaf of the tree that tells sends for all.
  void send_up(std::uint32_t node, std::uint32_t rank, std::uint32_t epoch, double now) {
    if (!layout_.nodes[node].tells || ++ranks_[rank].told < layout_.tellers[rank]) return;
    ranks_[rank].told = 0;
    if (layout_.to_centre[rank].bytes > 0)
      message_left(static_cast<std::uint32_t>(layout_.sends.size() + rank), epoch, now);
  }

  void message_left(std::uint32_t number, std::uint32_t epoch, double now) {
    const SimMessage& left = message(number);
    const SimNode& from = layout_.nodes[left.from];
    agenda_.add(stage_.network.arrival(from.rank, layout_.nodes[left.to].rank, left.bytes, now),
                message_comes, number, epoch);
    stage_.log.span(from.worker, now, now, left.name, static_cast<std::int32_t>(epoch), kind_send);
  }

  /// Those of `sends`, then those to the centre.
  const SimMessage& message(std::size_t number) const {
    return number < layout_.sends.size() ? layout_.sends[number]
                                         : layout_.to_centre[number - layout_.sends.size()];
  }

  void message_came(const SimMessage& came_now, std::uint32_t epoch, double now) {
    const std::uint32_t node = came_now.to;
    const std::uint32_t came = ++arrived_[inbox(node, epoch)];
    const std::uint32_t w = pending_[node];
    if (w == none || workers_[w].epoch != epoch) return;
    Worker& me = workers_[w];
    if (now > me.taken) {
      me.taken = me.waited_to = now;
      me.last_name = came_now.name;
    }
    me.taken += stage_.network.overhead();
    if (came < layout_.incoming[node]) return;
    pending_[node] = none;
    if (start(w, node)) advance(w, now);
  }

  void decide(std::uint32_t r, double now) {
    Rank& rank = ranks_[r];
    const std::uint32_t e = workers_[r * threads_].epoch;
    const SimEpoch& epoch = epochs_[e];
    rank.ready = now + check_work(stage_, index_, epoch) + epoch.own[r];
    rank.time = now;
    if (epoch.posts) {
      rounds_.post(epoch.posts_before, rank.ready);
      rank.ready += stage_.network.overhead();
    }
    const double behind = epoch.meetings + epoch.whole;
    if (!epoch.reads)
      agenda_.add(rank.ready + behind, gate_opens, r);
    else if (rounds_.read(epoch.reads_before, rank.ready))
      for (std::uint32_t other = 0; other < ranks_.size(); ++other)
        agenda_.add(std::max(ranks_[other].ready, rounds_.known(epoch.reads_before)) + behind, gate_opens,
                    other);
  }

  void open_gate(std::uint32_t r, double now) {
    Rank& rank = ranks_[r];
    const std::uint32_t first = r * threads_, e = workers_[first].epoch;
    log_check(stage_, first, static_cast<std::int32_t>(e), epochs_[e], epochs_[e].own[r], rank.time,
              rank.ready, now);
    rank.at_gate = 0;
    rank.time = now;
    if (e + 1 == epochs_.size()) {
      rank.left = true;
      return;
    }
    for (std::uint32_t w = first; w < first + threads_; ++w) {
      ++workers_[w].epoch;
      workers_[w].at = layout_.walk_begin[w];
    }
    for (std::uint32_t w = first; w < first + threads_; ++w) advance(w, now);
  }

  struct Foreign {
    std::uint32_t node;
    std::uint32_t more;  ///< 1: must have ended this epoch, 0: the one before
  };

  Stage& stage_;
  const StepIndex& index_;
  const LoopLayout& layout_;
  const std::vector<SimEpoch>& epochs_;
  const std::uint32_t threads_;
  Rounds rounds_;
  Agenda agenda_;
  std::vector<Worker> workers_;
  std::vector<Rank> ranks_;
  std::vector<std::uint32_t> finished_;      ///< per node: epochs
  std::vector<std::uint32_t> first_waiter_;  ///< per node: a list of workers
  std::vector<std::uint32_t> pending_;       ///< per node: the worker that waits inside for messages
  /// Two per node: a neighbour is one exchange ahead at most, since it needs this node's answer.
  std::vector<std::uint32_t> arrived_;
  std::vector<std::uint32_t> foreign_begin_;
  std::vector<Foreign> foreign_;
  std::vector<char> watched_;
};

}  // namespace

std::vector<double> play_fixed(Stage& stage, const StepIndex& index, const LoopLayout& layout,
                               const std::vector<SimEpoch>& epochs, const std::vector<double>& start) {
  return FixedLoop(stage, index, layout, epochs, start).run();
}

}  // namespace talus::trace::detail
