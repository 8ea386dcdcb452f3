#include "runtime/graph/epoch_graph.hpp"

#include <algorithm>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>

#include "runtime/graph/detail/splitmix.hpp"

namespace talus::graph {
namespace {

std::span<const std::uint32_t> neighbours(const Conflicts& conflicts, std::uint32_t node) {
  return conflicts.neighbour.subspan(conflicts.offset[node],
                                     conflicts.offset[node + 1] - conflicts.offset[node]);
}

[[noreturn]] void refuse(const std::string& reason) {
  throw std::invalid_argument("epoch graph: " + reason);
}

std::string pair(std::uint32_t node, std::uint32_t other) {
  return "nodes " + std::to_string(node) + " and " + std::to_string(other);
}

void check_shape(const Conflicts& conflicts, std::span<const std::uint32_t> owner, int threads) {
  const std::size_t n = conflicts.colour.size();
  if (threads < 1) refuse("needs at least 1 thread, not " + std::to_string(threads));
  if (n >= std::numeric_limits<std::int32_t>::max())
    refuse(std::to_string(n) + " nodes are more than 31 bits can number");
  if (conflicts.offset.size() != n + 1)
    refuse(std::to_string(conflicts.offset.size()) + " offsets for " + std::to_string(n) +
           " nodes, n + 1 are needed");
  if (conflicts.offset.front() != 0 || conflicts.offset.back() != conflicts.neighbour.size() ||
      !std::is_sorted(conflicts.offset.begin(), conflicts.offset.end()))
    refuse("offsets do not rise from 0 to the number of neighbours, " +
           std::to_string(conflicts.neighbour.size()));
  if (owner.size() != n && !(threads == 1 && owner.empty()))
    refuse(std::to_string(owner.size()) + " owners for " + std::to_string(n) + " nodes");
  for (std::size_t node = 0; node < owner.size(); ++node)
    if (owner[node] >= static_cast<std::uint32_t>(threads))
      refuse("node " + std::to_string(node) + " is owned by thread " + std::to_string(owner[node]) + " of " +
             std::to_string(threads));
}

/// Refuses a conflict that only one of its two nodes lists. Such a conflict would let two threads write the
/// same data at once, but so rarely that tests could miss it: every build checks. The check sums a hash of
/// each pair, negative in one direction, so that a symmetric list gives 0; that costs far less than to search
/// for each partner. Pairs are searched only when the sum is not 0.
void check_conflicts(const Conflicts& conflicts) {
  const auto n = static_cast<std::uint32_t>(conflicts.colour.size());
  std::uint64_t sum = 0;
  for (std::uint32_t node = 0; node < n; ++node) {
    for (const std::uint32_t other : neighbours(conflicts, node)) {
      if (other >= n)
        refuse("node " + std::to_string(node) + " conflicts with node " + std::to_string(other) + " of " +
               std::to_string(n));
      if (conflicts.colour[other] == conflicts.colour[node])
        refuse(pair(node, other) + " conflict and have the same colour " +
               std::to_string(conflicts.colour[node]));
      const std::uint64_t key =
          detail::scatter((std::uint64_t{std::min(node, other)} << 32 | std::max(node, other)) + 1);
      sum += node < other ? key : ~key + 1;
    }
  }
  if (sum == 0) return;
  for (std::uint32_t node = 0; node < n; ++node)
    for (const std::uint32_t other : neighbours(conflicts, node))
      if (const auto back = neighbours(conflicts, other);
          std::find(back.begin(), back.end(), node) == back.end())
        refuse(pair(node, other) + " conflict, but only the first knows of it");
  // Here a node lists some conflict twice, which does no harm.
}

}  // namespace

void assign_owners(std::span<const std::uint32_t> weight, int threads, std::span<std::uint32_t> owner) {
  if (threads < 1)
    throw std::invalid_argument("assign_owners: needs at least 1 thread, not " + std::to_string(threads));
  if (owner.size() != weight.size())
    throw std::invalid_argument("assign_owners: room for " + std::to_string(owner.size()) + " owners, but " +
                                std::to_string(weight.size()) + " weights");
  const auto parts = static_cast<std::uint64_t>(threads);
  const std::uint64_t sum = std::accumulate(weight.begin(), weight.end(), std::uint64_t{0});
  const bool equal = sum == 0;
  const std::uint64_t total = equal ? weight.size() : sum;
  std::uint64_t before = 0;
  for (std::size_t i = 0; i < weight.size(); ++i) {
    const std::uint64_t own = equal ? 1 : weight[i];
    // Middle of the node over the total; only a node of weight 0 at the very end can reach `parts`.
    owner[i] = static_cast<std::uint32_t>(std::min(parts - 1, (2 * before + own) * parts / (2 * total)));
    before += own;
  }
}

void assign_owners(std::span<const std::uint32_t> weight, std::span<const std::uint32_t> group, int threads,
                   std::span<std::uint32_t> owner) {
  if (group.size() != weight.size())
    throw std::invalid_argument("assign_owners: " + std::to_string(group.size()) + " groups for " +
                                std::to_string(weight.size()) + " weights");
  std::vector<std::uint32_t> of_group;
  for (std::size_t i = 0; i < weight.size(); ++i) {
    if (i == 0 || group[i] != group[i - 1]) of_group.push_back(0);
    of_group.back() += weight[i];
  }
  std::vector<std::uint32_t> owner_of_group(of_group.size());
  assign_owners(of_group, threads, owner_of_group);
  std::vector<std::uint64_t> load(static_cast<std::size_t>(threads), 0);
  for (std::size_t g = 0; g < of_group.size(); ++g) load[owner_of_group[g]] += of_group[g];
  const std::uint64_t total = std::accumulate(load.begin(), load.end(), std::uint64_t{0});
  if (10 * *std::max_element(load.begin(), load.end()) * load.size() > 11 * total)
    return assign_owners(weight, threads, owner);
  for (std::size_t i = 0, g = 0; i < weight.size(); ++i) {
    if (i > 0 && group[i] != group[i - 1]) ++g;
    owner[i] = owner_of_group[g];
  }
}

void EpochGraph::build(const Conflicts& conflicts, std::span<const std::uint32_t> owner, int threads) {
  clear();
  check_shape(conflicts, owner, threads);
  check_conflicts(conflicts);
  threads_ = threads;
  sort_walks(conflicts, owner);
  if (threads > 1) find_waits(conflicts, owner);
}

void EpochGraph::clear() noexcept {
  threads_ = 1;
  order_.clear();
  first_step_.clear();
  steps_.clear();
  waits_.clear();
  first_wait_.clear();
  counters_.clear();
  reset();
}

void EpochGraph::reset() noexcept {
  for (Counter& counter : counters_) {
    counter.finished.store(0, std::memory_order_relaxed);
    counter.past_epochs = 0;
    counter.walking = false;
  }
  decision_.value.store(0, std::memory_order_relaxed);
}

std::span<const std::uint32_t> EpochGraph::walk(int thread) const noexcept {
  if (order_.empty()) return {};
  const auto t = static_cast<std::size_t>(thread);
  return std::span(order_).subspan(first_step_[t], first_step_[t + 1] - first_step_[t]);
}

std::int64_t EpochGraph::stride(int thread) const noexcept {
  return std::max<std::int64_t>(1, static_cast<std::int64_t>(walk(thread).size()));
}

std::size_t EpochGraph::memory_used() const noexcept {
  return order_.size() * sizeof(std::uint32_t) + first_step_.size() * sizeof(std::uint32_t) +
         steps_.size() * sizeof(Step) + waits_.size() * sizeof(Wait) +
         first_wait_.size() * sizeof(std::uint32_t) + counters_.size() * sizeof(Counter);
}

void EpochGraph::sort_walks(const Conflicts& conflicts, std::span<const std::uint32_t> owner) {
  const auto owned_by = [&](std::uint32_t node) { return owner.empty() ? 0 : owner[node]; };
  order_.resize(conflicts.colour.size());
  std::iota(order_.begin(), order_.end(), 0U);
  std::sort(order_.begin(), order_.end(), [&](std::uint32_t a, std::uint32_t b) {
    if (owned_by(a) != owned_by(b)) return owned_by(a) < owned_by(b);
    if (conflicts.colour[a] != conflicts.colour[b]) return conflicts.colour[a] < conflicts.colour[b];
    return a < b;
  });
  first_step_.assign(static_cast<std::size_t>(threads_) + 1, 0);
  for (std::uint32_t node = 0; node < order_.size(); ++node) ++first_step_[owned_by(node) + 1];
  std::partial_sum(first_step_.begin(), first_step_.end(), first_step_.begin());
}

void EpochGraph::find_waits(const Conflicts& conflicts, std::span<const std::uint32_t> owner) {
  constexpr std::int32_t nothing = std::numeric_limits<std::int32_t>::min();
  const auto teams = static_cast<std::size_t>(threads_);
  counters_ = std::vector<Counter>(teams);
  steps_.resize(order_.size());
  std::vector<std::int32_t> place(order_.size());
  for (std::size_t t = 0; t < teams; ++t)
    for (std::uint32_t i = first_step_[t]; i < first_step_[t + 1]; ++i) {
      steps_[i] = {order_[i], 0, 0};
      place[order_[i]] = static_cast<std::int32_t>(i - first_step_[t]);
    }

  /// What `node` needs of the walk that `other` is in: the end of `other`, in this epoch or in the one
  /// before.
  const auto place_needed = [&](std::uint32_t node, std::uint32_t other) {
    const bool same_epoch = conflicts.colour[other] < conflicts.colour[node];
    return place[other] + 1 -
           (same_epoch ? 0 : static_cast<std::int32_t>(stride(static_cast<int>(owner[other]))));
  };
  std::vector<std::int32_t> known(teams);   // per other thread: what the walk has already waited for
  std::vector<std::int32_t> needed(teams);  // the same, for one step
  std::vector<std::uint32_t> asked;         // threads of which that step needs anything
  for (std::uint32_t t = 0; t < teams; ++t) {
    first_wait_.push_back(static_cast<std::uint32_t>(waits_.size()));
    // Waits of the previous epoch still hold, with places one stride lower. In epoch 0 such a place lies
    // before the beginning, hence is reached.
    std::fill(known.begin(), known.end(), nothing);
    const std::span<Step> walk_steps =
        std::span(steps_).subspan(first_step_[t], first_step_[t + 1] - first_step_[t]);
    for (const Step& step : walk_steps)
      for (const std::uint32_t other : neighbours(conflicts, step.node))
        if (owner[other] != t)
          known[owner[other]] = std::max(known[owner[other]], place_needed(step.node, other));
    for (std::uint32_t u = 0; u < teams; ++u)
      if (known[u] != nothing) known[u] -= static_cast<std::int32_t>(stride(static_cast<int>(u)));

    std::fill(needed.begin(), needed.end(), nothing);
    for (Step& step : walk_steps) {
      asked.clear();
      for (const std::uint32_t other : neighbours(conflicts, step.node)) {
        const std::uint32_t u = owner[other];
        if (u == t) continue;
        if (needed[u] == nothing) asked.push_back(u);
        needed[u] = std::max(needed[u], place_needed(step.node, other));
      }
      for (const std::uint32_t u : asked) {
        if (needed[u] > known[u]) {
          known[u] = needed[u];
          waits_.push_back({u, needed[u]});
          ++step.waits;
          const std::int32_t last =
              needed[u] - 1 + (needed[u] > 0 ? 0 : static_cast<std::int32_t>(stride(static_cast<int>(u))));
          steps_[first_step_[u] + static_cast<std::uint32_t>(last)].published = 1;
        }
        needed[u] = nothing;
      }
    }
  }
}

}  // namespace talus::graph
