#include "runtime/trace/machine.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "runtime/trace/layout.hpp"
#include "runtime/trace/timeline.hpp"

namespace talus::trace {
namespace {

[[noreturn]] void refuse(const std::string& what) {
  throw std::invalid_argument("the machine of a replay: " + what);
}

/// What times and factors of a machine may be: those of a step, of thousands of messages and tasks, are added
/// up in nanoseconds, which end after 292 years. Factors have no unit.
struct MachineLimits {
  double longest = 1e3;  ///< latencies, overhead and lines [s]
  double slowest = 1;    ///< bandwidths [byte/s]
  double factor = 1e6;   ///< speeds, contacts and noise; and 1 over it of all but noise
};
constexpr MachineLimits limits;

void demand(double value, double least, double most, const std::string& name) {
  if (!(value >= least && value <= most))
    refuse(fmt::format("{} must be {:g} to {:g}, got {}", name, least, most, value));
}

void demand_duration(double value, const char* name) {
  demand(value, 0, limits.longest, fmt::format("{} [s]", name));
}

void demand_bandwidth(double value, const char* name) {
  demand(value, limits.slowest, std::numeric_limits<double>::max(), fmt::format("{} [B/s]", name));
}

void demand_factor(double value, const std::string& name) {
  demand(value, 1 / limits.factor, limits.factor, name);
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
  for (const auto& [name, count] : {std::pair{"ranks", machine.ranks}, std::pair{"threads", machine.threads},
                                    std::pair{"ranks per node", machine.ranks_per_node}})
    if (count < 1) refuse(fmt::format("{} must be at least 1, got {}", name, count));
  if (machine.ranks > std::max(1, groups))
    refuse(
        fmt::format("{} ranks for {} subdomains: each rank needs one. Record a run with more of them "
                    "(decomposition.subdomains)",
                    machine.ranks, groups));
  demand_duration(machine.latency, "latency");
  demand_bandwidth(machine.bandwidth, "bandwidth");
  demand_duration(machine.overhead, "overhead");
  demand_duration(machine.node_latency, "node latency");
  demand_bandwidth(machine.node_bandwidth, "node bandwidth");
  demand_duration(machine.line, "line");
  demand(machine.noise, 0, limits.factor, "noise");
  demand(machine.quantile, 0, 1, "quantile");
  demand_factor(machine.speed, "speed");
  for (const auto& [kind, speed] : machine.speed_of) {
    demand_factor(speed, "speed of " + kind);
    if (std::none_of(trace.kinds.begin(), trace.kinds.end(),
                     [&kind = kind](const KindInfo& info) { return info.name == kind; }))
      refuse(fmt::format("speed of '{}': no task is called that (talus trace show lists them)", kind));
  }
  demand_factor(machine.contacts, "contacts scale");
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
