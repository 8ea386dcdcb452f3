#include "runtime/trace/order.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <tuple>

namespace talus::trace {

Order::Order(const Trace& trace, int rank) : ranks_(trace.ranks), threads_(trace.threads) {
  for (const Plan& plan : trace.plans)
    if (plan.rank == rank) plans_.push_back(plan);
  struct Begun {
    std::int64_t begin;
    std::int32_t epoch;
    std::uint32_t colour, node;
    int thread;
    auto walked() const { return std::tuple(epoch, colour, node); }
  };
  std::map<std::uint32_t, std::vector<Begun>> steps;
  for (int thread = 0; thread < trace.threads; ++thread) {
    const Track& track = trace.track(rank, thread);
    std::uint32_t step = 0;
    const Plan* plan = nullptr;
    std::optional<Begun> last;
    for (const Record& record : track.records) {
      if (record.kind() == kind_check) steps_[record.step()].gates.insert(record.epoch);
      if (record.epoch < 0 || record.kind() == kind_check || is_communication(record.kind())) continue;
      if (!plan || record.step() != step) {
        step = record.step();
        plan = plan_of(trace, rank, step);
        last.reset();
      }
      if (!plan || record.node >= plan->size())
        throw TraceError(fmt::format("step {} has a node {} that its plan does not know", step, record.node));
      const Begun begun{record.begin, record.epoch, plan->colour[record.node], record.node, thread};
      if (plan->owner[record.node] != static_cast<std::uint32_t>(thread) ||
          (last && last->walked() >= begun.walked()))
        throw TraceError(
            fmt::format("in step {}, thread {} does not walk its nodes in the order of their colours: no "
                        "run of talus can follow it",
                        step, thread));
      steps[step].push_back(begun);
      last = begun;
    }
  }
  for (auto& [step, begun] : steps) {
    // Of two that began at once the one that the other may have waited for comes first.
    std::sort(begun.begin(), begun.end(), [](const Begun& a, const Begun& b) {
      return a.begin != b.begin ? a.begin < b.begin : a.walked() < b.walked();
    });
    Step& of = steps_[step];
    of.threads.resize(static_cast<std::size_t>(threads_));
    for (const Plan& plan : plans_)
      if (plan.step <= step) of.plan = &plan;
    for (std::size_t place = 0; place < begun.size(); ++place)
      of.threads[static_cast<std::size_t>(begun[place].thread)].push_back(
          {{begun[place].epoch, begun[place].node}, place});
  }
}

bool Order::begin_step(std::uint32_t step) {
  const auto found = steps_.find(step);
  if (found == steps_.end() || !found->second.plan) return false;
  number_ = step;
  current_ = &found->second;
  const Plan& recorded = *current_->plan;
  if (plan_ && (plan_->colour != recorded.colour || plan_->owner != recorded.owner ||
                plan_->neighbour != recorded.neighbour))
    throw TraceError(
        fmt::format("step {} has another loop than the recorded one: the scene, the subdomains or the number "
                    "of threads differ",
                    step));
  next_.store(0, std::memory_order_relaxed);
  return true;
}

std::optional<std::size_t> Order::place(int thread, std::size_t done, Visit visit, bool works) const {
  const std::vector<Placed>& own = current_->threads[static_cast<std::size_t>(thread)];
  const bool recorded = done < own.size() && own[done].visit == visit;
  if (recorded != works)
    throw TraceError(fmt::format(
        "in step {}, epoch {}, node {} {} and the recorded one {}: the run has other settings", number_,
        visit.epoch, visit.node, works ? "works" : "does not work", recorded ? "did" : "did not"));
  return recorded ? std::optional(own[done].place) : std::nullopt;
}

void Order::check_gate(int epoch) const {
  if (current_->gates.count(epoch) == 0)
    throw TraceError(fmt::format(
        "in step {} the run decides behind epoch {}, the recorded one did not: the run has other settings",
        number_, epoch));
}

}  // namespace talus::trace
