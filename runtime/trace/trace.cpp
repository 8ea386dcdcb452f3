#include "runtime/trace/trace.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

namespace talus::trace {
namespace {

constexpr std::size_t role_count = static_cast<std::size_t>(Role::tell) + 1;
constexpr std::uint32_t most_turn = std::numeric_limits<signed char>::max();  // LoopGroup::colour is a char

[[noreturn]] void refuse_trace(const std::string& reason) {
  throw TraceError("the trace makes no sense: " + reason);
}

void check(const Plan& plan, int ranks) {
  const std::size_t n = plan.size();
  const std::string where = fmt::format("the plan of rank {} from step {}", plan.rank, plan.step);
  if (plan.rank < 0 || plan.rank >= ranks)
    refuse_trace(fmt::format("{} in a trace of {} ranks", where, ranks));
  if (plan.group.size() != n || plan.role.size() != n || plan.weight.size() != n || plan.place.size() != n ||
      plan.owner.size() != n || plan.offset.size() != n + 1)
    refuse_trace(where + ": arrays of different lengths");
  if (plan.offset.front() != 0 || plan.offset.back() != plan.neighbour.size() ||
      !std::is_sorted(plan.offset.begin(), plan.offset.end()))
    refuse_trace(where + ": offsets do not rise from 0 to the number of neighbours");
  for (std::uint32_t other : plan.neighbour)
    if (other >= n) refuse_trace(fmt::format("{}: a conflict with node {} of {}", where, other, n));
  for (std::uint8_t role : plan.role)
    if (role > static_cast<std::uint8_t>(Role::tell)) refuse_trace(fmt::format("{}: role {}", where, role));
  // What copies are glued by stands together: what there is of each role, by group.
  std::map<std::uint32_t, std::array<std::size_t, role_count>> count;
  for (std::size_t node = 0; node < n; ++node) {
    const Role role = static_cast<Role>(plan.role[node]);
    if (role == Role::compute || role == Role::root) continue;
    ++count[plan.group[node]][plan.role[node]];
    if (plan.place[node] > most_turn)
      refuse_trace(
          fmt::format("{}: subdomain {} has subdomain colour {}", where, plan.group[node], plan.place[node]));
  }
  for (const auto& [group, of] : count) {
    const auto has = [&of = of](Role role) { return of[static_cast<std::size_t>(role)]; };
    if (has(Role::publish) != 1 || has(Role::glue) != 1 || has(Role::take) > 1 || has(Role::tell) > 1)
      refuse_trace(fmt::format("{}: subdomain {} publishes {} times, glues {}, takes {}, tells {}", where,
                               group, has(Role::publish), has(Role::glue), has(Role::take), has(Role::tell)));
  }
}

void check(const std::vector<Task>& tasks, std::size_t kinds) {
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    if (static_cast<std::size_t>(tasks[i].kind) >= kinds)
      refuse_trace(fmt::format("task '{}' is of a kind that has no name", tasks[i].name));
    for (std::uint32_t before : tasks[i].predecessors)
      if (before >= i) refuse_trace(fmt::format("task '{}' comes after a later one", tasks[i].name));
  }
}

}  // namespace

Role role_of(graph::LoopRole role) {
  switch (role) {
    case graph::LoopRole::work:
      return Role::compute;
    case graph::LoopRole::publish:
      return Role::publish;
    case graph::LoopRole::collect:
    case graph::LoopRole::root:
      return Role::root;
    case graph::LoopRole::glue:
      return Role::glue;
    case graph::LoopRole::take:
      return Role::take;
    case graph::LoopRole::tell:
      break;
  }
  return Role::tell;
}

const char* name_of(Phase phase) {
  switch (phase) {
    case Phase::partitioning:
      return "partitioning";
    case Phase::detection:
      return "contact detection";
    case Phase::sweeps:
      return "inloop 1: sweeps, gluing";
    case Phase::exchange:
      return "inloop 2: exchange";
    case Phase::update:
      return "update";
    case Phase::waiting:
      return "waiting for threads";
    case Phase::outside:
      return "between steps";
  }
  return "?";
}

std::vector<KindInfo> runtime_kinds() {
  return {{"team", Phase::waiting, false, false},       {"outside", Phase::outside, false, true},
          {"collective", Phase::exchange, true, false}, {"receive", Phase::exchange, true, false},
          {"send", Phase::exchange, false, false},      {"check", Phase::exchange, false, false}};
}

std::size_t Trace::record_count() const {
  std::size_t sum = 0;
  for (const Track& track : tracks) sum += track.records.size();
  return sum;
}

void validate(const Trace& trace) {
  if (trace.ranks < 1 || trace.threads < 1)
    refuse_trace(fmt::format("{} ranks with {} threads", trace.ranks, trace.threads));
  const auto ranks = static_cast<std::size_t>(trace.ranks), threads = static_cast<std::size_t>(trace.threads);
  if (trace.tracks.size() != ranks * threads || trace.tasks.size() != ranks)
    refuse_trace(fmt::format("{} tracks and tasks of {} ranks for {} ranks with {} threads",
                             trace.tracks.size(), trace.tasks.size(), ranks, threads));
  const std::vector<KindInfo> own = runtime_kinds();
  if (trace.kinds.size() < own.size() || trace.kinds.size() > 256 ||
      !std::equal(own.begin(), own.end(), trace.kinds.begin()))
    refuse_trace("its kinds of records are not those of this version");
  for (const auto& tasks : trace.tasks) check(tasks, trace.kinds.size());
  for (const Plan& plan : trace.plans) check(plan, trace.ranks);
  // Every epoch leaves records, so a larger number is a damaged one, and nobody should make room for it.
  const auto most_epochs = static_cast<std::int64_t>(trace.record_count());
  for (std::size_t k = 0; k < trace.tracks.size(); ++k) {
    const Track& track = trace.tracks[k];
    if (track.rank != static_cast<std::int32_t>(k / threads) ||
        track.thread != static_cast<std::int32_t>(k % threads))
      refuse_trace(fmt::format("track {} is of rank {}, thread {}", k, track.rank, track.thread));
    for (const Record& record : track.records)
      if (static_cast<std::size_t>(record.kind()) >= trace.kinds.size() || record.epoch < -1 ||
          (record.kind() == kind_check && record.epoch < 0) || record.epoch >= most_epochs ||
          !std::isfinite(record.duration) || record.duration < 0)
        refuse_trace(fmt::format("a record of rank {}, thread {} in step {}: kind {}, epoch {}, duration {}",
                                 track.rank, track.thread, record.step(), static_cast<int>(record.kind()),
                                 record.epoch, record.duration));
  }
}

void sort_tracks(Trace& trace) {
  // A task is written when it ends, hence after the spans within it.
  const auto before = [](const Record& a, const Record& b) {
    return a.begin != b.begin ? a.begin < b.begin : a.duration > b.duration;
  };
  for (Track& track : trace.tracks)
    if (!std::is_sorted(track.records.begin(), track.records.end(), before))
      std::stable_sort(track.records.begin(), track.records.end(), before);
}

const Plan* plan_of(const Trace& trace, int rank, std::uint32_t step) {
  const Plan* last = nullptr;
  for (const Plan& plan : trace.plans)
    if (plan.rank == rank && plan.step <= step && (!last || plan.step >= last->step)) last = &plan;
  return last;
}

std::size_t memory_used(const Trace& trace) {
  std::size_t sum = 0;
  for (const Track& track : trace.tracks) sum += track.records.capacity() * sizeof(Record);
  for (const Plan& plan : trace.plans)
    sum += (6 * plan.size() + plan.neighbour.size()) * sizeof(std::uint32_t) + plan.role.size() +
           plan.messages.size() * sizeof(Message);
  return sum;
}

}  // namespace talus::trace
