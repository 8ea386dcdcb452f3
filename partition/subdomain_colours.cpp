#include "partition/subdomain_colours.hpp"

#include <algorithm>
#include <numeric>
#include <queue>
#include <stdexcept>
#include <utility>

namespace talus {

namespace {

/// Ties by subdomain, as offsets and lists.
struct Ties {
  std::vector<std::size_t> begin;
  std::vector<Tie> tie;

  Ties(std::size_t subdomains, std::span<const Tie> ties) : begin(subdomains + 1, 0), tie(ties.size()) {
    const auto known = [&](SubdomainId e) { return !e.none() && e.at() < subdomains; };
    for (const Tie& one : ties) {
      if (!known(one.subdomain) || !known(one.other))
        throw std::out_of_range("a tie of a subdomain that there is not");
      ++begin[one.subdomain.at() + 1];
    }
    std::partial_sum(begin.begin(), begin.end(), begin.begin());
    std::vector<std::size_t> next(begin.begin(), begin.end() - 1);
    for (const Tie& one : ties) tie[next[one.subdomain.at()]++] = one;
  }
  std::size_t subdomains() const { return begin.size() - 1; }
  std::span<const Tie> of(SubdomainId e) const {
    return std::span(tie).subspan(begin[e.at()], begin[e.at() + 1] - begin[e.at()]);
  }
};

constexpr char none = -1;

/// Grains that subdomain e shares with those of each subdomain colour.
std::vector<std::int64_t> shared_with(const Ties& ties, const Per<SubdomainId, char>& subdomain_colour,
                                      SubdomainId e, int subdomain_colours) {
  std::vector<std::int64_t> shared(static_cast<std::size_t>(subdomain_colours), 0);
  for (const Tie& tie : ties.of(e))
    if (const char other = subdomain_colour[tie.other]; other != none)
      shared[static_cast<std::size_t>(other)] += tie.grains;
  return shared;
}

char least(const std::vector<std::int64_t>& shared) {
  return static_cast<char>(std::ranges::min_element(shared) - shared.begin());
}

Per<SubdomainId, char> grow(const Ties& ties, int subdomain_colours) {
  Per<SubdomainId, char> subdomain_colour(ties.subdomains(), none);
  // The subdomain most strongly tied to coloured ones comes next; of equals the first. Entries whose strength
  // has changed since are skipped.
  Per<SubdomainId, std::int64_t> strength(subdomain_colour.size(), 0);
  std::priority_queue<std::pair<std::int64_t, std::int64_t>> next;
  for (const SubdomainId e : strength.indices()) next.emplace(0, -e.value());
  while (!next.empty()) {
    const auto [strong, minus] = next.top();
    next.pop();
    const SubdomainId e(-minus);
    if (subdomain_colour[e] != none || strong != strength[e]) continue;
    subdomain_colour[e] = least(shared_with(ties, subdomain_colour, e, subdomain_colours));
    for (const Tie& tie : ties.of(e)) {
      const SubdomainId other = tie.other;
      if (subdomain_colour[other] != none) continue;
      strength[other] += tie.grains;
      next.emplace(strength[other], -other.value());
    }
  }
  return subdomain_colour;
}

/// Each move reduces the grains shared within a colour, so the moves end.
void improve(const Ties& ties, int subdomain_colours, Per<SubdomainId, char>& subdomain_colour) {
  for (bool moved = true; moved;) {
    moved = false;
    for (const SubdomainId e : subdomain_colour.indices()) {
      const std::vector<std::int64_t> shared = shared_with(ties, subdomain_colour, e, subdomain_colours);
      const char best = least(shared);
      if (shared[static_cast<std::size_t>(best)] == shared[static_cast<std::size_t>(subdomain_colour[e])])
        continue;
      subdomain_colour[e] = best;
      moved = true;
    }
  }
}

}  // namespace

Per<SubdomainId, char> choose_subdomain_colours(std::int32_t subdomains, std::span<const Tie> list) {
  constexpr int most = 4;
  const Ties ties(static_cast<std::size_t>(subdomains), list);
  for (int subdomain_colours = 2;; ++subdomain_colours) {
    Per<SubdomainId, char> subdomain_colour = grow(ties, subdomain_colours);
    improve(ties, subdomain_colours, subdomain_colour);
    std::int64_t all = 0, within = 0;
    for (const Tie& tie : list) {
      all += tie.grains;
      if (subdomain_colour[tie.subdomain] == subdomain_colour[tie.other]) within += tie.grains;
    }
    if (4 * within <= all || subdomain_colours == most) return subdomain_colour;
  }
}

}  // namespace talus
