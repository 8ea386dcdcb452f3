#include "runtime/trace/detail/simulation.hpp"

#include <algorithm>
#include <cmath>

#include "runtime/graph/detail/splitmix.hpp"

namespace talus::trace::detail {

void Log::span(std::uint32_t worker, double begin, double end, const What& what) {
  if (!trace_) return;
  // Ends in whole nanoseconds too: one that lay behind the next beginning would take it for a part of itself.
  const std::int64_t from = std::llround(begin);
  trace_->tracks[worker].records.push_back(
      {from, static_cast<float>(std::llround(end) - from), what.node, what.epoch, pack(step_, what.kind)});
}

void Log::calls(std::uint32_t worker, double begin, double end, double known, const Calls& calls) {
  const double at = known > end ? end : begin;
  for (int k = 0; k < calls.count; ++k)
    span(worker, at, at + (k == 0 ? known - end : 0),
         {k == 0 ? static_cast<std::uint32_t>(calls.bytes) : 0, -1, kind_collective});
}

double Stage::stretch(std::uint64_t step, std::uint64_t worker, std::uint64_t what) const {
  if (machine.noise == 0) return 1;
  const std::uint64_t name =
      graph::detail::scatter(machine.seed * 0x9e3779b97f4a7c15ULL + step * 0xd1342543de82ef95ULL +
                             worker * 0x2545f4914f6cdd1dULL + what * 0x9fb21c651e98df25ULL);
  return 1 + machine.noise * static_cast<double>(name >> 11) * 0x1p-53;
}

NodeWork work_of(const Stage& stage, const StepIndex& index, const SimNode& node, std::uint32_t number,
                 const SimEpoch& epoch, std::size_t number_of_epoch) {
  if (node.source_rank < 0) return {};
  const Place place =
      index.ranks[static_cast<std::size_t>(node.source_rank)].at(epoch.source, node.source_node);
  if (!place.exists()) return {};
  if (node.waits_only) return {0, true, stage.timeline.record(place).kind()};
  const Kind kind = stage.timeline.record(place).kind();
  double scale = stage.stretch(index.step, number, number_of_epoch) / stage.speed_of(kind);
  if (node.role == Role::compute) scale *= stage.machine.contacts;
  // These copy what the messages hold.
  if (node.role == Role::publish || node.role == Role::glue || node.role == Role::take) scale *= stage.faces;
  double work = stage.timeline.self(place);
  if (stage.machine.typical || stage.machine.quantile > 0) {
    const auto usual = static_cast<double>(
        stage.typical[static_cast<std::size_t>(node.source_rank)].at(kind)[node.source_node]);
    if (stage.machine.quantile > 0 || work > 3 * usual) work = usual;
  }
  return {work * scale, true, kind};
}

namespace {

/// The value below which `part` of the list lies; the list is not empty, and is reordered.
float quantile_of(std::vector<float>& list, double part) {
  const auto place =
      std::min(list.size() - 1, static_cast<std::size_t>(part * static_cast<double>(list.size())));
  const auto at = list.begin() + static_cast<std::ptrdiff_t>(place);
  std::nth_element(list.begin(), at, list.end());
  return *at;
}

}  // namespace

std::vector<double> speeds(const Machine& machine, const Trace& trace) {
  std::vector<double> speed;
  for (const KindInfo& info : trace.kinds) {
    const auto own = machine.speed_of.find(info.name);
    speed.push_back(own == machine.speed_of.end() ? machine.speed : own->second);
  }
  return speed;
}

std::vector<std::map<Kind, std::vector<float>>> typical_times(const Timeline& timeline,
                                                              const StepIndex& index, double quantile) {
  std::vector<std::map<Kind, std::vector<float>>> typical;
  std::map<Kind, std::vector<float>> times;
  for (const StepIndex::Rank& rank : index.ranks) {
    auto& medians = typical.emplace_back();
    for (std::size_t n = 0; n < rank.nodes; ++n) {
      for (auto& [kind, list] : times) list.clear();
      for (std::size_t e = 0; e < rank.epochs; ++e)
        if (const Place place = rank.at(e, n); place.exists())
          times[timeline.record(place).kind()].push_back(static_cast<float>(timeline.self(place)));
      for (auto& [kind, list] : times) {
        if (list.empty()) continue;
        auto& of_kind = medians[kind];
        of_kind.resize(rank.nodes, 0);
        of_kind[n] = quantile_of(list, quantile);
      }
    }
  }
  return typical;
}

std::vector<std::map<Kind, float>> typical_tasks(const Timeline& timeline, const StepIndex& index,
                                                 double quantile) {
  std::vector<std::map<Kind, float>> typical;
  for (std::size_t r = 0; r < index.ranks.size(); ++r) {
    const std::vector<Task>& tasks = timeline.trace().tasks[r];
    std::map<Kind, std::vector<float>> times;
    for (std::size_t i = 0; i < tasks.size(); ++i)
      if (tasks[i].group >= 0)
        times[tasks[i].kind].push_back(static_cast<float>(timeline.self(index.ranks[r].task[i]) +
                                                          timeline.self(index.ranks[r].part[i])));
    auto& medians = typical.emplace_back();
    for (auto& [kind, list] : times) medians[kind] = quantile_of(list, quantile);
  }
  return typical;
}

ExchangeWork exchange_work(const Stage& stage, const LoopLayout& layout, std::uint32_t node) {
  const SimNode& of = layout.nodes[node];
  double sent = layout.send_begin[node + 1] - layout.send_begin[node];
  if (of.tells && layout.to_root[of.rank].bytes > 0) sent += 1.0 / layout.tellers[of.rank];
  const double overhead = stage.network.overhead();
  return {layout.incoming[node] * overhead, 0.5e9 * stage.machine.line / 64 * layout.handed[node],
          sent * overhead};
}

namespace {

/// `work`, or what the machine takes instead of a noisy recording, of all like it in the step: there are few.
double usual(const Stage& stage, double work, std::span<const std::vector<Place>* const> alike) {
  if (!stage.machine.typical && stage.machine.quantile == 0) return work;
  std::vector<float> all;
  for (const std::vector<Place>* places : alike)
    for (const Place place : *places)
      if (place.exists()) all.push_back(static_cast<float>(stage.timeline.self(place)));
  if (all.empty()) return work;
  if (stage.machine.quantile > 0) return static_cast<double>(quantile_of(all, stage.machine.quantile));
  return std::min(work, 3 * static_cast<double>(quantile_of(all, 0.5)));
}

}  // namespace

double check_work(const Stage& stage, const StepIndex& index, const SimEpoch& epoch) {
  double work = 0;
  std::vector<const std::vector<Place>*> checks;
  for (const StepIndex::Rank& rank : index.ranks) {
    work = std::max(work, stage.timeline.self(rank.check[epoch.source]));
    checks.push_back(&rank.check);
  }
  return usual(stage, work, checks) / stage.speed_of(kind_check);
}

double alone_work(const Stage& stage, const StepIndex& index, std::size_t source, std::size_t e) {
  const std::vector<Place>& alone = index.ranks[source].alone;
  const std::vector<Place>* const alike[] = {&alone};
  return usual(stage, stage.timeline.self(alone[e]), alike) /
         stage.speed_of(stage.timeline.record(alone[e]).kind());
}

void log_check(Stage& stage, std::uint32_t worker, std::int32_t number, const SimEpoch& epoch,
               const CheckTime& time) {
  const auto& [own, begin, decided, end] = time;
  const double waited = end - decided - epoch.whole, from = end - epoch.whole;
  stage.log.task(worker, {begin, end, waited}, {epoch.settles ? check_settles : 0, number, kind_check});
  if (own > 0) stage.log.span(worker, begin, begin + own, {0, -1, epoch.own_kind});
  // One wait, and what else is read takes no time; where nobody waited it stands where it is within.
  const std::size_t calls = std::max({epoch.calls, epoch.awaits.size(), std::size_t{waited > 0}});
  const double at = waited > 0 ? decided : begin;
  for (std::size_t call = 0; call < calls; ++call)
    stage.log.span(worker, at, waited > 0 && call == 0 ? from : at, {0, number, kind_collective});
  for (const SimEpoch::Span& span : epoch.spans)
    stage.log.span(worker, from + span.begin, from + span.end, {span.meetings, -1, span.kind});
}

}  // namespace talus::trace::detail
