#include "runtime/trace/analysis.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <iterator>
#include <map>

namespace talus::trace {
namespace {

std::size_t at(Kind kind) {
  return static_cast<std::size_t>(kind);
}

/// Per rank: work and waiting for messages of its threads, summed. [ns]
struct RankTime {
  double work = 0, exposed = 0;
};

void add_lane(const Timeline& timeline, std::size_t number, RankTime& rank, Summary& sum) {
  const Trace& trace = timeline.trace();
  const Track& track = trace.tracks[number];
  const std::vector<float>& self = timeline.self()[number];
  const Record* around = nullptr;  // the task that a wait is in
  for (std::size_t i = 0; i < track.records.size(); ++i) {
    const Record& record = track.records[i];
    const KindInfo& info = trace.info(record.kind());
    const double own = static_cast<double>(self[i]);
    if (record.kind() == kind_send) ++sum.messages;
    KindSummary& kind = sum.kinds[at(record.kind())];
    ++kind.count;
    kind.self += own;
    kind.longest = std::max(kind.longest, static_cast<double>(record.duration));
    const auto whole = static_cast<std::uint64_t>(record.duration);
    ++kind.histogram[std::min<std::size_t>(31, static_cast<std::size_t>(std::bit_width(whole)))];
    Phase phase = info.phase;
    if (info.blocked) {
      rank.exposed += own;
      if (record.epoch < 0 && around && around->end() >= record.end())
        phase = trace.info(around->kind()).phase;
    } else if (record.kind() != kind_team) {
      rank.work += own;
      if (!around || around->end() <= static_cast<double>(record.begin)) around = &record;
    }
    sum.phase[static_cast<std::size_t>(phase)] += own;
  }
}

/// "sweep of subdomain 3", "cells"
std::string path_name(const Timeline& timeline, const StepIndex& index, Place place) {
  const Record& record = timeline.record(place);
  const Trace& trace = timeline.trace();
  const std::string& kind = trace.info(record.kind()).name;
  const auto rank = static_cast<std::size_t>(trace.tracks[place.track].rank);
  if (record.epoch < 0 || record.kind() == kind_check) return kind;
  const std::uint32_t group = index.ranks[rank].plan->group[record.node];
  return group == root_group ? kind : fmt::format("{} of subdomain {}", kind, group);
}

void add_paths(const Timeline& timeline, Summary& sum) {
  std::map<std::string, PathShare> shares;
  const auto add = [&](const std::string& what, double time) {
    if (time <= 0) return;
    PathShare& share = shares[what];
    share.what = what;
    share.time += time;
    ++share.count;
    sum.path_time += time;
  };
  for (std::uint32_t step : timeline.steps()) {
    const StepIndex index = timeline.index(step);
    const PathHop* behind = nullptr;
    const std::vector<PathHop> path = critical_path(timeline, index);
    for (const PathHop& hop : path) {
      if (behind) {
        const bool other = timeline.trace().tracks[hop.place.track].rank !=
                           timeline.trace().tracks[behind->place.track].rank;
        add(other ? "messages under way" : "between tasks", behind->from - hop.until);
      }
      add(path_name(timeline, index, hop.place), hop.until - hop.from);
      behind = &hop;
    }
  }
  for (auto& [what, share] : shares) sum.path.push_back(std::move(share));
  std::sort(sum.path.begin(), sum.path.end(),
            [](const PathShare& a, const PathShare& b) { return a.time > b.time; });
}

Efficiencies efficiencies(const std::vector<RankTime>& ranks, int threads, double makespan) {
  Efficiencies out;
  double mean = 0;
  const RankTime* most = &ranks.front();
  for (const RankTime& rank : ranks) {
    mean += rank.work / static_cast<double>(ranks.size());
    if (rank.work > most->work) most = &rank;
  }
  if (most->work <= 0 || makespan <= 0) return out;
  const double useful = most->work / threads, waited = most->exposed / threads;
  out.load_balance = mean / most->work;
  out.communication = 1 - waited / makespan;
  out.threads = useful / (makespan - waited);
  out.parallel = mean / threads / makespan;
  return out;
}

std::string time_of(double ns) {
  return ns >= 1e9   ? fmt::format("{:.3f} s", 1e-9 * ns)
         : ns >= 1e6 ? fmt::format("{:.3f} ms", 1e-6 * ns)
                     : fmt::format("{:.2f} us", 1e-3 * ns);
}

/// A bar of a histogram: height in eighths.
std::string bars(const std::array<std::uint32_t, 32>& histogram, std::size_t first, std::size_t last) {
  static constexpr const char* heights[] = {" ", "▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"};
  const std::uint32_t most = *std::max_element(histogram.begin(), histogram.end());
  std::string text;
  for (std::size_t b = first; b <= last; ++b) {
    const double part = most > 0 ? static_cast<double>(histogram[b]) / most : 0;
    text += heights[histogram[b] == 0
                        ? 0
                        : std::max<std::size_t>(1, static_cast<std::size_t>(std::lround(8 * part)))];
  }
  return text;
}

}  // namespace

Summary analyse(const Timeline& timeline) {
  const Trace& trace = timeline.trace();
  Summary sum;
  sum.predicted = trace.predicted;
  sum.ranks = trace.ranks;
  sum.threads = trace.threads;
  sum.steps = timeline.steps().size();
  sum.records = trace.record_count();
  sum.kinds.resize(trace.kinds.size());
  for (const KindInfo& info : trace.kinds) sum.names.push_back(info.name);
  double begin = INFINITY, end = -INFINITY;
  std::vector<RankTime> ranks(static_cast<std::size_t>(trace.ranks));
  for (std::size_t k = 0; k < trace.tracks.size(); ++k) {
    add_lane(timeline, k, ranks[static_cast<std::size_t>(trace.tracks[k].rank)], sum);
    for (const Record& record : trace.tracks[k].records) {
      begin = std::min(begin, static_cast<double>(record.begin));
      end = std::max(end, record.end());
    }
  }
  sum.makespan = end > begin ? end - begin : 0;
  double most = 0;
  for (const RankTime& rank : ranks) {
    sum.work += rank.work;
    sum.exposed += rank.exposed;
    most = std::max(most, rank.work);
  }
  sum.idle = sum.makespan * static_cast<double>(trace.tracks.size()) - sum.work - sum.exposed;
  sum.imbalance = sum.work > 0 ? most * trace.ranks / sum.work - 1 : 0;
  sum.efficiency = efficiencies(ranks, trace.threads, sum.makespan);
  add_paths(timeline, sum);
  return sum;
}

Summary analyse(const Trace& trace) {
  return analyse(Timeline(trace));
}

std::string describe(const Summary& sum) {
  std::string text;
  const auto line = [&]<class... T>(fmt::format_string<T...> format, T&&... values) {
    fmt::format_to(std::back_inserter(text), format, std::forward<T>(values)...);
    text += '\n';
  };
  const double all = sum.makespan * sum.ranks * sum.threads;
  const auto percent = [](double part, double whole) { return whole > 0 ? 100 * part / whole : 0; };
  line("{}: {} ranks x {} threads, {} steps, {} records, {} messages between ranks, makespan {}",
       sum.predicted ? "predicted" : "recorded", sum.ranks, sum.threads, sum.steps, sum.records, sum.messages,
       time_of(sum.makespan));
  text += "\nshare of all threads' time\n";
  double named = 0;
  for (std::size_t p = 0; p < phase_count; ++p) {
    line("  {:<26}{:6.1f} %", name_of(static_cast<Phase>(p)), percent(sum.phase[p], all));
    named += sum.phase[p];
  }
  line("  {:<26}{:6.1f} %", "idle, outside of loops", percent(std::max(0.0, all - named), all));
  line("\n  {:<26}{:6.1f} %   (in messages and collective calls)", "exposed messages",
       percent(sum.exposed, all));
  line("  {:<26}{:6.1f} %   (most work of a rank over the mean)", "load imbalance", 100 * sum.imbalance);
  const Efficiencies& e = sum.efficiency;
  line("\nparallel efficiency {:.3f} = load balance {:.3f} x communication {:.3f} x threads {:.3f}",
       e.parallel, e.load_balance, e.communication, e.threads);
  line("\ncritical path, {}", time_of(sum.path_time));
  constexpr std::size_t most_lines = 12;
  for (std::size_t k = 0; k < std::min(most_lines, sum.path.size()); ++k)
    line("  {:<34}{:6.1f} %  {:>12}  {:>9} times", sum.path[k].what, percent(sum.path[k].time, sum.path_time),
         time_of(sum.path[k].time), sum.path[k].count);
  if (sum.path.size() > most_lines) {
    double rest = 0;
    for (std::size_t k = most_lines; k < sum.path.size(); ++k) rest += sum.path[k].time;
    line("  {:<34}{:6.1f} %", fmt::format("{} others", sum.path.size() - most_lines),
         percent(rest, sum.path_time));
  }
  text += "\ntask lengths: bars from 64 ns to 1 s, a power of 2 each\n";
  line("  {:<12}{:>10}{:>12}{:>12}{:>12}  {}", "kind", "count", "work", "mean", "longest", "lengths");
  for (std::size_t k = 0; k < sum.kinds.size(); ++k) {
    const KindSummary& kind = sum.kinds[k];
    if (kind.count == 0) continue;
    line("  {:<12}{:>10}{:>12}{:>12}{:>12}  {}", sum.names[k], kind.count, time_of(kind.self),
         time_of(kind.self / static_cast<double>(kind.count)), time_of(kind.longest),
         bars(kind.histogram, 6, 30));
  }
  return text;
}

}  // namespace talus::trace
