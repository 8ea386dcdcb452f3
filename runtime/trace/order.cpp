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
    auto walked() const { return std::tuple(epoch, colour, node); }
  };
  std::map<std::uint32_t, std::vector<Begun>> steps;
  for (int thread = 0; thread < trace.threads; ++thread) {
    const Lane& lane = trace.lane(rank, thread);
    std::uint32_t step = 0;
    const Plan* plan = nullptr;
    std::optional<Begun> last;
    for (const Record& record : lane.records) {
      const Kind kind = record.kind();
      if (record.epoch < 0 || kind == kind_check || kind == kind_send || kind == kind_receive ||
          kind == kind_collective)
        continue;
      if (!plan || record.step() != step) {
        step = record.step();
        plan = plan_of(trace, rank, step);
        last.reset();
      }
      if (!plan || record.node >= plan->size())
        throw TraceError(fmt::format("step {} has a node {} that its plan does not know", step, record.node));
      const Begun begun{record.begin, record.epoch, plan->colour[record.node], record.node};
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
    std::vector<Turn>& turns = turns_[step];
    for (const Begun& b : begun) turns.push_back({b.epoch, b.node});
  }
}

bool Order::begin_step(std::uint32_t step) {
  const auto found = turns_.find(step);
  if (found == turns_.end()) return false;
  current_ = &found->second;
  turn_.store(0, std::memory_order_relaxed);
  return true;
}

void Order::check(const Plan& plan, std::uint32_t step) const {
  const Plan* recorded = nullptr;
  for (const Plan& candidate : plans_)
    if (candidate.step <= step) recorded = &candidate;
  if (!recorded || !turns_.count(step)) return;
  if (plan.colour != recorded->colour || plan.owner != recorded->owner ||
      plan.neighbour != recorded->neighbour)
    throw TraceError(
        fmt::format("step {} has another loop than the recorded one: the scene, the subdomains or the number "
                    "of threads differ",
                    step));
}

}  // namespace talus::trace
