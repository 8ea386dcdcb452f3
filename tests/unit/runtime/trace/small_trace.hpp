#pragma once

/// A trace made by hand: small enough to foretell its replay on paper.

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "runtime/trace/trace.hpp"

namespace talus::trace::test {

inline constexpr Kind task{6}, sweep{7}, publish{8}, root{9}, glue{10};

inline std::vector<KindInfo> kinds() {
  std::vector<KindInfo> all = runtime_kinds();
  all.push_back({"task", Phase::update, false, true});
  all.push_back({"sweep", Phase::sweeps, false, false});
  all.push_back({"publish", Phase::exchange, false, false});
  all.push_back({"root", Phase::exchange, false, false});
  all.push_back({"glue", Phase::sweeps, false, false});
  return all;
}

/// A loop in the making. Nodes conflict as join() says; owner 0.
class PlanBuilder {
 public:
  std::uint32_t add(Role role, std::uint32_t group, std::uint32_t colour, std::uint32_t weight = 1) {
    plan_.role.push_back(static_cast<std::uint8_t>(role));
    plan_.group.push_back(group);
    plan_.colour.push_back(colour);
    plan_.weight.push_back(role == Role::compute ? weight : 0);
    plan_.place.push_back(role == Role::compute ? static_cast<std::uint32_t>(plan_.place.size()) : 0);
    plan_.owner.push_back(0);
    adjacent_.emplace_back();
    return static_cast<std::uint32_t>(adjacent_.size() - 1);
  }
  void join(std::uint32_t a, std::uint32_t b) {
    adjacent_[a].push_back(b);
    adjacent_[b].push_back(a);
  }
  Plan plan(std::int32_t rank, std::vector<Message> messages = {}) {
    Plan out = plan_;
    out.rank = rank;
    out.step = 1;
    out.messages = std::move(messages);
    out.offset.push_back(0);
    for (const auto& list : adjacent_) {
      out.neighbour.insert(out.neighbour.end(), list.begin(), list.end());
      out.offset.push_back(static_cast<std::uint32_t>(out.neighbour.size()));
    }
    return out;
  }

 private:
  Plan plan_;
  std::vector<std::vector<std::uint32_t>> adjacent_;
};

/// The tasks of a step: one before the loop, the loop, one behind it.
inline std::vector<Task> three_tasks() {
  return {
      {"before", task, -1, false, {}}, {"loop", kind_team, -1, true, {0}}, {"behind", task, -1, false, {1}}};
}

/// One step on one thread: tasks of 0 ns around a loop, every node once an epoch in the order of their
/// colours, with these durations, and a decision of 0 ns at the end.
inline Track run_once(const Plan& plan, const std::vector<float>& duration, const std::vector<Kind>& kind,
                      int epochs) {
  Track track{plan.rank, 0, {}};
  std::int64_t now = 0;
  const auto add = [&](float length, std::uint32_t node, std::int32_t epoch, Kind of) {
    track.records.push_back({now, length, node, epoch, pack(1, of)});
    now += static_cast<std::int64_t>(length);
  };
  std::vector<std::uint32_t> order;
  for (std::uint32_t n = 0; n < plan.size(); ++n) order.push_back(n);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return plan.colour[a] < plan.colour[b]; });
  add(0, 0, -1, task);
  for (int epoch = 0; epoch < epochs; ++epoch)
    for (std::uint32_t n : order) add(duration[n], n, epoch, kind[n]);
  add(0, 0, epochs - 1, kind_check);
  add(0, 2, -1, task);
  return track;
}

/// Subdomains that all share copies: in each epoch a sweep of 100 ns, publish of 10 ns, an inner sweep of 50
/// ns, glue of 20 ns, on one rank or one on each; two epochs, messages of 1000 bytes. With a wall that all of
/// them touch, 100 bytes each go to the root and back besides.
inline Trace all_neighbours(int subdomains, int ranks, bool wall = false) {
  Trace trace;
  trace.ranks = ranks;
  trace.kinds = kinds();
  for (int rank = 0; rank < ranks; ++rank) {
    PlanBuilder builder;
    std::vector<float> duration;
    std::vector<Kind> kind;
    std::vector<Message> messages;
    std::vector<std::uint32_t> publishes, glues;
    const auto add = [&](Role role, std::uint32_t group, std::uint32_t colour, float length, Kind of) {
      duration.push_back(length);
      kind.push_back(of);
      return builder.add(role, group, colour);
    };
    const int first = ranks == 1 ? 0 : rank, end = ranks == 1 ? subdomains : rank + 1;
    std::vector<std::uint32_t> outer;
    for (int e = first; e < end; ++e) {
      outer.push_back(add(Role::compute, static_cast<std::uint32_t>(e), 0, 100, sweep));
      builder.join(outer.back(), add(Role::compute, static_cast<std::uint32_t>(e), 4, 50, sweep));
    }
    for (int e = first; e < end; ++e)
      publishes.push_back(add(Role::publish, static_cast<std::uint32_t>(e), 2, 10, publish));
    const std::uint32_t hub = add(Role::root, root_group, 7, 0, root);
    for (int e = first; e < end; ++e) {
      glues.push_back(add(Role::glue, static_cast<std::uint32_t>(e), 8, 20, glue));
      for (int other = 0; other < subdomains; ++other)
        if (other != e)
          messages.push_back({static_cast<std::uint16_t>(e), static_cast<std::uint16_t>(other), 1000});
      if (!wall) continue;
      messages.push_back({static_cast<std::uint16_t>(e), root_group, 100});
      messages.push_back({root_group, static_cast<std::uint16_t>(e), 100});
    }
    for (std::size_t k = 0; k < publishes.size(); ++k) {
      builder.join(publishes[k], outer[k]);
      builder.join(glues[k], outer[k]);
      builder.join(publishes[k], hub);
      builder.join(glues[k], hub);
      for (std::uint32_t reader : glues) builder.join(publishes[k], reader);
    }
    trace.plans.push_back(builder.plan(rank, messages));
    trace.tasks.push_back(three_tasks());
    trace.tracks.push_back(run_once(trace.plans.back(), duration, kind, 2));
  }
  return trace;
}

inline Trace two_subdomains(int ranks) {
  return all_neighbours(2, ranks);
}

/// One subdomain without gluing: `colour` and conflicts as given, one epoch.
inline Trace one_loop(const std::vector<std::uint32_t>& colour,
                      const std::vector<std::pair<std::uint32_t, std::uint32_t>>& conflicts,
                      const std::vector<float>& duration, int epochs = 1) {
  PlanBuilder builder;
  for (std::uint32_t c : colour) builder.add(Role::compute, 0, c);
  for (const auto& [a, b] : conflicts) builder.join(a, b);
  Trace trace;
  trace.kinds = kinds();
  trace.plans.push_back(builder.plan(0));
  trace.tasks.push_back(three_tasks());
  trace.tracks.push_back(
      run_once(trace.plans.back(), duration, std::vector<Kind>(colour.size(), sweep), epochs));
  return trace;
}

}  // namespace talus::trace::test
