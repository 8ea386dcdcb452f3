#include "runtime/trace/detail/loop_events.hpp"

#include <algorithm>

namespace talus::trace::detail {

LoopEvents::LoopEvents(const LoopRun& run)
    : run_(run),
      ranks_(static_cast<std::size_t>(run.stage.machine.ranks)),
      rounds_(run.epochs.size()),
      worker_(run.layout.nodes.size(), 0),
      arrived_(2 * run.layout.nodes.size(), 0) {}

StartedNode LoopEvents::start_node(std::uint32_t node, std::uint32_t e) {
  StartedNode started{
      node, e, work_of(run_.stage, run_.index, run_.layout.nodes[node], node, run_.epochs[e], e), {}};
  if (run_.epochs[e].exchange) {
    started.exchange = exchange_work(run_.stage, run_.layout, node);
    arrived_[inbox(node, e)] = 0;
  }
  return started;
}

double LoopEvents::work(const StartedNode& started, std::uint32_t worker, double taken) {
  const double worked = taken + started.recorded.work + started.exchange.shares;
  if (run_.epochs[started.epoch].exchange) send(started.node, worker, started.epoch, worked);
  return worked + started.exchange.sends;
}

void LoopEvents::log(const StartedNode& started, std::uint32_t worker, const Log::TaskTime& time,
                     const LastMessage& last) {
  if (!started.recorded.recorded) return;
  const auto epoch = static_cast<std::int32_t>(started.epoch);
  const std::uint32_t first = run_.layout.rank_begin[run_.layout.nodes[started.node].rank];
  run_.stage.log.task(worker, time, {started.node - first, epoch, started.recorded.kind});
  if (time.waited > 0)
    run_.stage.log.span(worker, last.at - time.waited, last.at, {last.name, epoch, kind_receive});
}

void LoopEvents::send(std::uint32_t node, std::uint32_t worker, std::uint32_t epoch, double worked) {
  worker_[node] = worker;
  const std::uint32_t first = run_.layout.send_begin[node];
  for (std::uint32_t k = first; k < run_.layout.send_begin[node + 1]; ++k)
    agenda_.add(worked + (k - first + 1) * run_.stage.network.overhead(), message_leaves, k, epoch);
}

void LoopEvents::send_up(std::uint32_t node, std::uint32_t worker, std::uint32_t epoch, double now) {
  const std::uint32_t rank = run_.layout.nodes[node].rank;
  if (!run_.layout.nodes[node].tells || ++ranks_[rank].told < run_.layout.tellers[rank]) return;
  ranks_[rank].told = 0;
  if (run_.layout.to_root[rank].bytes > 0)
    message_left(static_cast<std::uint32_t>(run_.layout.sends.size() + rank), worker, epoch, now);
}

void LoopEvents::message_left(std::uint32_t number, std::uint32_t worker, std::uint32_t epoch, double now) {
  const SimMessage& left = message(number);
  agenda_.add(run_.stage.network.arrival(run_.layout.nodes[left.from].rank, run_.layout.nodes[left.to].rank,
                                         left.bytes, now),
              message_comes, number, epoch);
  run_.stage.log.span(worker, now, now, {left.name, static_cast<std::int32_t>(epoch), kind_send});
}

void LoopEvents::decide(std::uint32_t r, std::uint32_t e, double now) {
  Rank& rank = ranks_[r];
  const SimEpoch& epoch = run_.epochs[e];
  rank.began = now;
  rank.decided = now + check_work(run_.stage, run_.index, epoch) + epoch.own[r];
  if (epoch.posts) {
    double& known = rounds_[epoch.round].known;
    known = std::max(known, rank.decided + run_.stage.network.collective());
    rank.decided += run_.stage.network.overhead();
  }
  const double behind = epoch.meetings + epoch.whole;
  if (epoch.awaits.empty()) {
    agenda_.add(rank.decided + behind, gate_opens, r, e);
    return;
  }
  // The sums of one round after those of the other, each from when all wait for it.
  double known = rank.decided;
  for (const std::size_t round : epoch.awaits)
    known = rounds_[round].known =
        std::max(rounds_[round].known, known + run_.stage.network.collective_rest());
  if (++rounds_[epoch.awaits.back()].waiting < static_cast<int>(ranks_.size())) return;
  for (std::uint32_t other = 0; other < ranks_.size(); ++other)
    agenda_.add(std::max(ranks_[other].decided, known) + behind, gate_opens, other, e);
}

bool LoopEvents::open_gate(std::uint32_t r, std::uint32_t e, double now) {
  Rank& rank = ranks_[r];
  log_check(run_.stage, run_.stage.log.worker(r, 0), static_cast<std::int32_t>(e), run_.epochs[e],
            {run_.epochs[e].own[r], rank.began, rank.decided, now});
  if (e + 1 < run_.epochs.size()) return true;
  rank.left = now;
  return false;
}

std::vector<double> LoopEvents::ends() const {
  std::vector<double> end;
  for (const Rank& rank : ranks_) {
    if (rank.left < 0) throw TraceError("the loop of a step stands still in replay: its plan has no order");
    end.push_back(rank.left);
  }
  return end;
}

}  // namespace talus::trace::detail
