/// The loop with free threads: a node is ready when what conflicts with it has ended and its messages are in,
/// and any thread of the rank takes it. With a thread for every node the time is that of the longest chain.

#include <algorithm>
#include <tuple>

#include "runtime/trace/detail/simulation.hpp"

namespace talus::trace::detail {
namespace {

class ListLoop {
 public:
  ListLoop(Stage& stage, const StepIndex& index, const LoopLayout& layout,
           const std::vector<SimEpoch>& epochs, const std::vector<double>& start)
      : stage_(stage),
        index_(index),
        layout_(layout),
        epochs_(epochs),
        threads_(static_cast<std::uint32_t>(stage.machine.threads)),
        rounds_(stage.machine.ranks, epochs, stage.network),
        ranks_(start.size()),
        missing_(layout.nodes.size(), 0),
        epoch_(layout.nodes.size(), 0),
        arrived_(2 * layout.nodes.size(), 0) {
    for (std::size_t r = 0; r < ranks_.size(); ++r) {
      ranks_[r].time = start[r];
      for (std::uint32_t t = threads_; t-- > 0;) ranks_[r].idle.push_back(t);
      ranks_[r].allowed = last_before_gate(0);
    }
    for (std::uint32_t n = 0; n < layout.nodes.size(); ++n)
      for (std::uint32_t other : layout.neighbours(n))
        if (layout.nodes[other].colour < layout.nodes[n].colour) ++missing_[n];
  }

  std::vector<double> run() {
    for (std::uint32_t r = 0; r < ranks_.size(); ++r) agenda_.add(ranks_[r].time, gate_opens, r, 1);
    while (!agenda_.empty()) {
      const Event event = agenda_.next();
      switch (event.what) {
        case node_ends:
          node_ended(event.a, event.b, event.time);
          break;
        case message_leaves:
          message_left(event.a, event.b, event.time);
          break;
        case message_comes: {
          const SimMessage& came = message(event.a);
          ++arrived_[inbox(came.to, event.b)];
          offer(came.to);
          dispatch(layout_.nodes[came.to].rank, event.time);
          break;
        }
        case gate_reached:
          decide(event.a, event.time);
          break;
        case gate_opens:
          open_gate(event.a, event.time, event.b != 0);
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
  using Ready = std::tuple<std::uint32_t, std::uint32_t, std::uint32_t>;  ///< epoch, colour, node

  struct Rank {
    std::priority_queue<Ready, std::vector<Ready>, std::greater<>> ready;
    std::vector<std::uint32_t> idle;  ///< threads
    std::uint32_t allowed = 0;        ///< last epoch that may be worked on
    std::size_t ended = 0;            ///< nodes that have ended that epoch
    std::uint32_t told = 0;
    double time = 0, decided = 0;
    bool left = false;
  };

  std::uint32_t last_before_gate(std::uint32_t epoch) const {
    while (!epochs_[epoch].gate) ++epoch;
    return epoch;
  }
  std::size_t inbox(std::uint32_t node, std::size_t epoch) const {
    return 2 * node + epochs_[epoch].exchanges_before % 2;
  }
  const SimMessage& message(std::size_t number) const {
    return number < layout_.sends.size() ? layout_.sends[number]
                                         : layout_.to_centre[number - layout_.sends.size()];
  }

  /// Puts the node among the ready ones if it is.
  void offer(std::uint32_t n) {
    const SimNode& node = layout_.nodes[n];
    Rank& rank = ranks_[node.rank];
    if (missing_[n] > 0 || epoch_[n] > rank.allowed) return;
    if (epochs_[epoch_[n]].exchange && arrived_[inbox(n, epoch_[n])] < layout_.incoming[n]) return;
    rank.ready.push({epoch_[n], node.colour, n});
    ++missing_[n];  // taken: what comes later must not offer it again
  }

  void dispatch(std::uint32_t r, double now) {
    Rank& rank = ranks_[r];
    while (!rank.ready.empty() && (stage_.machine.unbounded || !rank.idle.empty())) {
      const std::uint32_t n = std::get<2>(rank.ready.top());
      rank.ready.pop();
      std::uint32_t thread = 0;
      if (!stage_.machine.unbounded) {
        thread = rank.idle.back();
        rank.idle.pop_back();
      }
      const SimEpoch& epoch = epochs_[epoch_[n]];
      const NodeWork recorded = work_of(stage_, index_, layout_.nodes[n], n, epoch, epoch_[n]);
      ExchangeWork exchange;
      if (epoch.exchange) {
        exchange = exchange_work(stage_, layout_, n);
        // A thread that has nothing else to do takes each message as it comes; the last one is left.
        if (stage_.machine.unbounded) exchange.takes = std::min(exchange.takes, stage_.network.overhead());
        arrived_[inbox(n, epoch_[n])] = 0;
      }
      const double worked = now + exchange.takes + recorded.work + exchange.shares,
                   end = worked + exchange.sends;
      if (epoch.exchange) {
        const std::uint32_t first = layout_.send_begin[n];
        for (std::uint32_t k = first; k < layout_.send_begin[n + 1]; ++k)
          agenda_.add(worked + (k - first + 1) * stage_.network.overhead(), message_leaves, k, epoch_[n]);
      }
      if (recorded.recorded)
        stage_.log.task(stage_.log.worker(r, thread), now, end, 0, n - layout_.rank_begin[r],
                        static_cast<std::int32_t>(epoch_[n]), recorded.kind);
      agenda_.add(end + (recorded.recorded ? stage_.dispatch : 0), node_ends, n, thread);
    }
  }

  void node_ended(std::uint32_t n, std::uint32_t thread, double now) {
    const SimNode& node = layout_.nodes[n];
    Rank& rank = ranks_[node.rank];
    const std::uint32_t e = epoch_[n];
    if (epochs_[e].exchange) send_up(n, e, now);
    if (!stage_.machine.unbounded) rank.idle.push_back(thread);
    // From now on everything that conflicts must end once more before this node runs again.
    ++epoch_[n];
    missing_[n] = static_cast<std::uint32_t>(layout_.neighbours(n).size());
    if (missing_[n] == 0 && epoch_[n] < epochs_.size()) offer(n);
    for (std::uint32_t other : layout_.neighbours(n))
      if (--missing_[other] == 0 && epoch_[other] < epochs_.size()) offer(other);
    const std::size_t nodes = layout_.rank_begin[node.rank + 1] - layout_.rank_begin[node.rank];
    if (e == rank.allowed && ++rank.ended == nodes) agenda_.add(now, gate_reached, node.rank);
    dispatch(node.rank, now);
  }

  /// The last of a leaf of the tree that tells sends for all.
  void send_up(std::uint32_t n, std::uint32_t e, double now) {
    const SimNode& node = layout_.nodes[n];
    Rank& rank = ranks_[node.rank];
    if (!node.tells || ++rank.told < layout_.tellers[node.rank]) return;
    rank.told = 0;
    if (layout_.to_centre[node.rank].bytes > 0)
      message_left(static_cast<std::uint32_t>(layout_.sends.size() + node.rank), e, now);
  }

  void message_left(std::uint32_t number, std::uint32_t e, double now) {
    const SimMessage& left = message(number);
    agenda_.add(
        stage_.network.arrival(layout_.nodes[left.from].rank, layout_.nodes[left.to].rank, left.bytes, now),
        message_comes, number, e);
  }

  void decide(std::uint32_t r, double now) {
    Rank& rank = ranks_[r];
    const SimEpoch& epoch = epochs_[rank.allowed];
    rank.time = now;
    rank.decided = now + check_work(stage_, index_, epoch) + epoch.own[r];
    if (epoch.posts) {
      rounds_.post(epoch.posts_before, rank.decided);
      rank.decided += stage_.network.overhead();
    }
    const double behind = epoch.meetings + epoch.whole;
    if (!epoch.reads)
      agenda_.add(rank.decided + behind, gate_opens, r);
    else if (rounds_.read(epoch.reads_before, rank.decided))
      for (std::uint32_t other = 0; other < ranks_.size(); ++other)
        agenda_.add(std::max(ranks_[other].decided, rounds_.known(epoch.reads_before)) + behind, gate_opens,
                    other);
  }

  void open_gate(std::uint32_t r, double now, bool first) {
    Rank& rank = ranks_[r];
    if (!first) {
      log_check(stage_, stage_.log.worker(r, 0), static_cast<std::int32_t>(rank.allowed),
                epochs_[rank.allowed], epochs_[rank.allowed].own[r], rank.time, rank.decided, now);
      rank.time = now;
      rank.ended = 0;
      if (rank.allowed + 1 == epochs_.size()) {
        rank.left = true;
        return;
      }
      rank.allowed = last_before_gate(rank.allowed + 1);
    }
    if (layout_.rank_begin[r] == layout_.rank_begin[r + 1]) {
      agenda_.add(now, gate_reached, r);  // nothing to do until the next gate
      return;
    }
    for (std::uint32_t n = layout_.rank_begin[r]; n < layout_.rank_begin[r + 1]; ++n) offer(n);
    dispatch(r, now);
  }

  Stage& stage_;
  const StepIndex& index_;
  const LoopLayout& layout_;
  const std::vector<SimEpoch>& epochs_;
  const std::uint32_t threads_;
  Rounds rounds_;
  Agenda agenda_;
  std::vector<Rank> ranks_;
  /// Per node: conflicting nodes that must end before it begins: those of lower colour in its epoch, the
  /// others in the one before.
  std::vector<std::uint32_t> missing_;
  std::vector<std::uint32_t> epoch_;    ///< per node: the next
  std::vector<std::uint32_t> arrived_;  ///< two per node, as in play_fixed.cpp
};

}  // namespace

std::vector<double> play_list(Stage& stage, const StepIndex& index, const LoopLayout& layout,
                              const std::vector<SimEpoch>& epochs, const std::vector<double>& start) {
  return ListLoop(stage, index, layout, epochs, start).run();
}

}  // namespace talus::trace::detail
