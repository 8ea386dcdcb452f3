#include "runtime/trace/machine.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "runtime/trace/layout.hpp"
#include "runtime/trace/timeline.hpp"

namespace talus::trace {
namespace {

[[noreturn]] void refuse(const std::string& what) {
  throw std::invalid_argument("the machine of a replay: " + what);
}

void demand_positive(double value, const char* name) {
  if (!(value > 0) || !std::isfinite(value))
    refuse(fmt::format("{} must be above 0 and finite, got {}", name, value));
}

void demand_not_negative(double value, const char* name) {
  if (!(value >= 0) || !std::isfinite(value))
    refuse(fmt::format("{} must be finite and not negative, got {}", name, value));
}

/// Median time from the start of a message to its arrival, of those that somebody was waiting for: only then
/// is the arrival seen at once. 0 without any. [ns]
double median_delay(const Trace& trace) {
  std::vector<double> delays;
  for (const auto& [wait, send] : sends_of(trace))
    if (send->end() >= static_cast<double>(wait->begin))
      delays.push_back(std::max(0.0, wait->end() - send->end()));
  if (delays.empty()) return 0;
  const auto middle = delays.begin() + static_cast<std::ptrdiff_t>(delays.size() / 2);
  std::nth_element(delays.begin(), middle, delays.end());
  return *middle;
}

/// Cyclic where all plans say so and block would not; the program knows no other.
RankMap recorded_map(const Trace& trace) {
  const std::vector<std::uint32_t> groups = groups_of(trace);
  Machine machine;
  machine.ranks = trace.ranks;
  machine.map = RankMap::cyclic;
  const std::vector<std::uint64_t> alike(groups.size(), 1);
  const std::vector<std::uint32_t> cyclic = map_groups(alike, machine);
  machine.map = RankMap::block;
  if (map_groups(alike, machine) == cyclic) return RankMap::block;
  for (const Plan& plan : trace.plans)
    for (const std::uint32_t group : plan.group) {
      const auto at = std::lower_bound(groups.begin(), groups.end(), group);
      if (group != root_group &&
          cyclic[static_cast<std::size_t>(at - groups.begin())] != static_cast<std::uint32_t>(plan.rank))
        return RankMap::block;
    }
  return RankMap::cyclic;
}

constexpr std::string_view map_names[] = {"block", "cyclic", "weight"};
constexpr std::string_view schedule_names[] = {"fixed", "list"};

}  // namespace

RankMap rank_map_named(std::string_view name) {
  const auto found = std::ranges::find(map_names, name);
  if (found == std::end(map_names))
    throw std::invalid_argument(fmt::format("there is no map '{}': block, cyclic or weight", name));
  return static_cast<RankMap>(found - std::begin(map_names));
}

Schedule schedule_named(std::string_view name) {
  const auto found = std::ranges::find(schedule_names, name);
  if (found == std::end(schedule_names))
    throw std::invalid_argument(fmt::format("there is no schedule '{}': fixed or list", name));
  return static_cast<Schedule>(found - std::begin(schedule_names));
}

std::string name_of(RankMap map) {
  return std::string(map_names[static_cast<std::size_t>(map)]);
}

std::string name_of(Schedule schedule) {
  return std::string(schedule_names[static_cast<std::size_t>(schedule)]);
}

void validate(const Machine& machine, const Trace& trace) {
  const auto groups = static_cast<int>(groups_of(trace).size());
  if (machine.ranks < 1 || machine.threads < 1 || machine.ranks_per_node < 1)
    refuse(fmt::format("{} ranks with {} threads, {} ranks on a node", machine.ranks, machine.threads,
                       machine.ranks_per_node));
  if (machine.ranks > std::max(1, groups))
    refuse(
        fmt::format("{} ranks for {} subdomains: each rank needs one. Record a run with more of them "
                    "(decomposition.subdomains)",
                    machine.ranks, groups));
  demand_not_negative(machine.latency, "latency");
  demand_positive(machine.bandwidth, "bandwidth");
  demand_not_negative(machine.overhead, "overhead");
  demand_not_negative(machine.node_latency, "node latency");
  demand_positive(machine.node_bandwidth, "node bandwidth");
  demand_not_negative(machine.line, "line");
  demand_not_negative(machine.noise, "noise");
  demand_not_negative(machine.quantile, "quantile");
  if (machine.quantile > 1) refuse(fmt::format("quantile must not be above 1, got {}", machine.quantile));
  demand_positive(machine.speed, "speed");
  for (const auto& [kind, speed] : machine.speed_of) {
    demand_positive(speed, ("speed of " + kind).c_str());
    if (std::none_of(trace.kinds.begin(), trace.kinds.end(),
                     [&kind = kind](const KindInfo& info) { return info.name == kind; }))
      refuse(fmt::format("speed of '{}': no task is called that (talus trace show lists them)", kind));
  }
  demand_positive(machine.contacts, "contacts scale");
}

Machine recorded_machine(const Trace& trace) {
  if (trace.machine) return *trace.machine;
  Machine machine;
  machine.ranks = trace.ranks;
  machine.threads = trace.threads;
  // Processes of one machine, which most recordings of several ranks are; of many, the median is theirs as
  // well.
  machine.ranks_per_node = trace.ranks;
  if (const double delay = median_delay(trace); delay > 0) machine.node_latency = 1e-9 * delay;
  machine.map = recorded_map(trace);
  return machine;
}

}  // namespace talus::trace
