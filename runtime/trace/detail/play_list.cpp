/// The loop with free threads: a node is ready when what conflicts with it has ended and its messages are in,
/// and any thread of the rank takes it. With a thread for every node the time is that of the longest chain.

#include <algorithm>
#include <limits>
#include <queue>
#include <tuple>

#include "runtime/trace/detail/loop_events.hpp"

namespace talus::trace::detail {
namespace {

class ListLoop {
 public:
  ListLoop(const LoopRun& run, const std::vector<double>& start)
      : run_(run),
        threads_(static_cast<std::uint32_t>(run.stage.machine.threads)),
        events_(run),
        ranks_(start.size()),
        missing_(run.layout.nodes.size(), 0),
        epoch_(run.layout.nodes.size(), 0),
        ready_(run.layout.nodes.size(), never) {
    for (std::uint32_t r = 0; r < ranks_.size(); ++r) {
      for (std::uint32_t t = threads_; t-- > 0;)
        ranks_[r].idle.push_back({run.stage.log.worker(r, t), start[r]});
      ranks_[r].allowed = last_before_gate(0);
    }
    for (std::uint32_t n = 0; n < run.layout.nodes.size(); ++n)
      for (std::uint32_t other : run.layout.neighbours(n))
        if (run.layout.nodes[other].colour < run.layout.nodes[n].colour) ++missing_[n];
  }

  std::vector<double> run(const std::vector<double>& start) {
    for (std::uint32_t r = 0; r < ranks_.size(); ++r) begin_epochs(r, start[r]);
    return events_.run(*this);
  }

  void node_ended(std::uint32_t n, std::uint32_t worker, double now) {
    const SimNode& node = run_.layout.nodes[n];
    Rank& rank = ranks_[node.rank];
    const std::uint32_t e = epoch_[n];
    if (run_.epochs[e].exchange) events_.send_up(n, worker, e, now);
    // From now on everything that conflicts must end once more before this node runs again.
    ++epoch_[n];
    missing_[n] = static_cast<std::uint32_t>(run_.layout.neighbours(n).size());
    if (missing_[n] == 0 && epoch_[n] < run_.epochs.size()) offer(n, now);
    for (std::uint32_t other : run_.layout.neighbours(n))
      if (--missing_[other] == 0 && epoch_[other] < run_.epochs.size()) offer(other, now);
    const std::size_t nodes = run_.layout.rank_begin[node.rank + 1] - run_.layout.rank_begin[node.rank];
    if (e == rank.allowed && ++rank.ended == nodes) events_.reach_gate(node.rank, e, now);
    dispatch(node.rank, now);
  }

  void thread_freed(std::uint32_t worker, double now) {
    const std::uint32_t r = worker / threads_;
    ranks_[r].idle.push_back({worker, now});
    dispatch(r, now);
  }

  void message_came(const SimMessage& came, std::uint32_t, double now) {
    last_name_ = came.name;
    offer(came.to, now);
    dispatch(run_.layout.nodes[came.to].rank, now);
  }

  void goes_on(std::uint32_t r, double now) {
    ranks_[r].ended = 0;
    ranks_[r].allowed = last_before_gate(ranks_[r].allowed + 1);
    begin_epochs(r, now);
  }

 private:
  using Ready = std::tuple<std::uint32_t, std::uint32_t, std::uint32_t>;  ///< epoch, colour, node
  static constexpr double never = std::numeric_limits<double>::infinity();

  struct Idle {
    std::uint32_t worker;
    double since;
  };
  struct Rank {
    std::priority_queue<Ready, std::vector<Ready>, std::greater<>> ready;
    std::vector<Idle> idle;
    std::uint32_t allowed = 0;  ///< last epoch that may be worked on
    std::size_t ended = 0;      ///< nodes that have ended that epoch
  };

  std::uint32_t last_before_gate(std::uint32_t epoch) const {
    while (!run_.epochs[epoch].gate) ++epoch;
    return epoch;
  }
  /// From when the rank may work on the epochs up to the next gate.
  void begin_epochs(std::uint32_t r, double now) {
    if (run_.layout.rank_begin[r] == run_.layout.rank_begin[r + 1]) {
      events_.reach_gate(r, ranks_[r].allowed, now);  // nothing to do until the next gate
      return;
    }
    for (std::uint32_t n = run_.layout.rank_begin[r]; n < run_.layout.rank_begin[r + 1]; ++n) offer(n, now);
    dispatch(r, now);
  }

  /// Puts the node among the ready ones if it is.
  void offer(std::uint32_t n, double now) {
    Rank& rank = ranks_[run_.layout.nodes[n].rank];
    const std::uint32_t e = epoch_[n];
    if (missing_[n] > 0 || e > rank.allowed) return;
    ready_[n] = std::min(ready_[n], now);
    if (run_.epochs[e].exchange && !events_.all_arrived(n, e)) return;
    rank.ready.push({e, run_.layout.nodes[n].colour, n});
    ++missing_[n];  // taken: what comes later must not offer it again
  }

  void dispatch(std::uint32_t r, double now) {
    Rank& rank = ranks_[r];
    const bool unbounded = run_.stage.machine.unbounded;
    while (!rank.ready.empty() && (unbounded || !rank.idle.empty())) {
      const std::uint32_t n = std::get<2>(rank.ready.top());
      rank.ready.pop();
      Idle thread{run_.stage.log.worker(r, 0), now};
      if (!unbounded) {
        thread = rank.idle.back();
        rank.idle.pop_back();
      }
      start(n, thread, now);
    }
  }

  void start(std::uint32_t n, const Idle& thread, double now) {
    const std::uint32_t e = epoch_[n];
    const StartedNode started = events_.start_node(n, e);
    double takes = started.exchange.takes;
    // A thread that has nothing else to do takes each message as it comes; the last one is left.
    if (run_.stage.machine.unbounded) takes = std::min(takes, run_.stage.network.overhead());
    const double end = events_.work(started, thread.worker, now + takes);
    // A thread without work lacked the node's last message only.
    const double waited = now - std::max(thread.since, ready_[n]);
    events_.log(started, thread.worker, {now - waited, end, waited}, {last_name_, now});
    ready_[n] = never;
    events_.end_node(n, thread.worker, end);
    if (!run_.stage.machine.unbounded)
      events_.free_thread(thread.worker, end + (started.recorded.recorded ? run_.stage.dispatch : 0));
  }

  const LoopRun run_;
  const std::uint32_t threads_;
  LoopEvents events_;
  std::vector<Rank> ranks_;
  /// Per node: conflicting nodes that must end before it begins: those of lower colour in its epoch, the
  /// others in the one before.
  std::vector<std::uint32_t> missing_;
  std::vector<std::uint32_t> epoch_;  ///< per node: the next
  std::vector<double> ready_;         ///< per node: when it was, but for messages
  std::uint32_t last_name_ = 0;       ///< of the last message that came
};

}  // namespace

std::vector<double> play_list(const LoopRun& run, const std::vector<double>& start) {
  return ListLoop(run, start).run(start);
}

}  // namespace talus::trace::detail
