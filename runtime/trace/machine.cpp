#include <fmt/format.h>

#include <cmath>
#include <stdexcept>
#include <string>

#include "runtime/trace/replay.hpp"

namespace talus::trace {
namespace {

[[noreturn]] void refuse(const std::string& what) {
  throw std::invalid_argument("the machine of a replay: " + what);
}

void demand_positive(double value, const char* name) {
  if (!(value > 0) || !std::isfinite(value)) refuse(fmt::format("{} must be above 0, got {}", name, value));
}

void demand_not_negative(double value, const char* name) {
  if (!(value >= 0) || !std::isfinite(value))
    refuse(fmt::format("{} must not be negative, got {}", name, value));
}

}  // namespace

RankMap rank_map_named(std::string_view name) {
  if (name == "block") return RankMap::block;
  if (name == "cyclic") return RankMap::cyclic;
  if (name == "weight") return RankMap::weight;
  throw std::invalid_argument(fmt::format("there is no map '{}': block, cyclic or weight", name));
}

Schedule schedule_named(std::string_view name) {
  if (name == "fixed") return Schedule::fixed;
  if (name == "list") return Schedule::list;
  throw std::invalid_argument(fmt::format("there is no schedule '{}': fixed or list", name));
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
  demand_positive(machine.speed, "speed");
  demand_positive(machine.contacts, "contacts scale");
}

Machine recorded_machine(const Trace& trace) {
  Machine machine;
  machine.ranks = trace.ranks;
  machine.threads = trace.threads;
  // As processes on one machine, which most recordings of several ranks are.
  machine.ranks_per_node = trace.ranks;
  return machine;
}

}  // namespace talus::trace
