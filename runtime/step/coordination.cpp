#include "runtime/step/coordination.hpp"

#include <array>
#include <span>
#include <unordered_map>
#include <vector>

namespace talus {

namespace {

using EndsOfPair = std::array<Slot, 2>;

std::size_t at(Slot slot) {
  return static_cast<std::size_t>(slot);
}

/// The active contacts of this rank, by the bodies that they hold: those of rattlers are dropped with them,
/// each contact and each body once.
class HoldingContacts {
 public:
  explicit HoldingContacts(const StepState& state)
      : rattles(state.bodies.size(), 0),
        count(state.bodies.size(), 0),
        pairs_(active_pairs(state.contacts, state.chunks)),
        dropped_(pairs_.size(), 0),
        begin_(state.bodies.size() + 1, 0) {
    each_end([&](std::size_t body, std::size_t) { ++count[body]; });
    for (std::size_t s = 0; s < count.size(); ++s)
      begin_[s + 1] = begin_[s] + static_cast<std::size_t>(count[s]);
    of_body_.resize(begin_.back());
    std::vector<std::size_t> next(begin_.begin(), begin_.end() - 1);
    each_end([&](std::size_t body, std::size_t pair) { of_body_[next[body]++] = pair; });
  }

  std::vector<char> rattles;
  std::vector<std::int32_t> count;  ///< per body: contacts on this rank with no rattler

  /// The body is a rattler. Those that lose a contact by it are added to `lost`.
  void drop(std::size_t body, std::vector<std::size_t>& lost) {
    rattles[body] = 1;
    for (const std::size_t pair :
         std::span(of_body_).subspan(begin_[body], begin_[body + 1] - begin_[body])) {
      if (dropped_[pair] != 0) continue;
      dropped_[pair] = 1;
      for (const Slot end : pairs_[pair]) {
        if (at(end) == body) continue;
        --count[at(end)];
        lost.push_back(at(end));
      }
    }
  }

 private:
  /// visit(body, pair): both bodies of a contact, or the one that touches a wall.
  template <class Visit>
  void each_end(const Visit& visit) const {
    for (std::size_t pair = 0; pair < pairs_.size(); ++pair) {
      visit(at(pairs_[pair][0]), pair);
      if (pairs_[pair][1] != pairs_[pair][0]) visit(at(pairs_[pair][1]), pair);
    }
  }

  std::vector<EndsOfPair> pairs_;
  std::vector<char> dropped_;                 ///< per pair
  std::vector<std::size_t> begin_, of_body_;  ///< pairs of each body
};

/// Adds up the counts of bodies whose contacts are spread over subdomains. Collective.
void sum_over_copies(const StepState& state, const graph::Communicator& ranks,
                     std::vector<std::int32_t>& touching) {
  const Decomposition& all = state.decomposition;
  if (!all.several()) return;
  struct Part {
    std::int64_t id, count;
  };
  std::vector<Part> parts;
  for (std::size_t s = 0; s < touching.size(); ++s)
    if (all.multiplicity[s] > 1)
      parts.push_back({static_cast<std::int64_t>(state.bodies.id[s]), touching[s]});
  parts = ranks.gather_records(std::span<const Part>(parts));
  std::unordered_map<std::int64_t, std::int32_t> whole;
  for (const Part& part : parts) whole[part.id] += static_cast<std::int32_t>(part.count);
  for (std::size_t s = 0; s < touching.size(); ++s)
    if (all.multiplicity[s] > 1) touching[s] = whole[static_cast<std::int64_t>(state.bodies.id[s])];
}

/// Drops the rattlers among bodies that stand in one subdomain only, and those that they leave behind.
void drop_own(const Decomposition& all, std::int32_t hold, std::vector<std::size_t> candidates,
              HoldingContacts& contacts) {
  while (!candidates.empty()) {
    const std::size_t body = candidates.back();
    candidates.pop_back();
    if (contacts.rattles[body] != 0 || contacts.count[body] >= hold) continue;
    if (all.several() && all.multiplicity[body] > 1) continue;
    contacts.drop(body, candidates);
  }
}

}  // namespace

double coordination(const StepState& state, const graph::Communicator& ranks, std::int32_t hold) {
  const Decomposition& all = state.decomposition;
  HoldingContacts contacts(state);
  std::vector<std::size_t> candidates(state.bodies.size());
  for (std::size_t s = 0; s < candidates.size(); ++s) candidates[s] = s;
  for (;;) {
    drop_own(all, hold, std::move(candidates), contacts);
    candidates.clear();
    std::vector<std::int32_t> touching = contacts.count;
    sum_over_copies(state, ranks, touching);
    std::int64_t sums[3] = {0, 0, 0};  // grains, their contacts, rattlers found
    for (std::size_t s = 0; s < touching.size(); ++s) {
      if (contacts.rattles[s] != 0) continue;
      if (touching[s] < hold) {
        contacts.drop(s, candidates);
        ++sums[2];
      } else if (counts(all, s)) {
        ++sums[0];
        sums[1] += touching[s];
      }
    }
    ranks.sum(sums);
    if (sums[2] == 0) return sums[0] > 0 ? static_cast<double>(sums[1]) / static_cast<double>(sums[0]) : 0;
  }
}

}  // namespace talus
