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
    const auto known = [&](std::int32_t e) { return e >= 0 && static_cast<std::size_t>(e) < subdomains; };
    for (const Tie& one : ties) {
      if (!known(one.subdomain) || !known(one.other))
        throw std::out_of_range("a tie of a subdomain that there is not");
      ++begin[static_cast<std::size_t>(one.subdomain) + 1];
    }
    std::partial_sum(begin.begin(), begin.end(), begin.begin());
    std::vector<std::size_t> next(begin.begin(), begin.end() - 1);
    for (const Tie& one : ties) tie[next[static_cast<std::size_t>(one.subdomain)]++] = one;
  }
  std::size_t subdomains() const { return begin.size() - 1; }
  std::span<const Tie> of(std::size_t e) const {
    return std::span(tie).subspan(begin[e], begin[e + 1] - begin[e]);
  }
};

constexpr char none = -1;

/// Grains that subdomain e shares with those of each subdomain colour.
std::vector<std::int64_t> shared_with(const Ties& ties, const std::vector<char>& subdomain_colour,
                                      std::size_t e, int subdomain_colours) {
  std::vector<std::int64_t> shared(static_cast<std::size_t>(subdomain_colours), 0);
  for (const Tie& tie : ties.of(e))
    if (const char other = subdomain_colour[static_cast<std::size_t>(tie.other)]; other != none)
      shared[static_cast<std::size_t>(other)] += tie.grains;
  return shared;
}

char least(const std::vector<std::int64_t>& shared) {
  return static_cast<char>(std::ranges::min_element(shared) - shared.begin());
}

std::vector<char> grow(const Ties& ties, int subdomain_colours) {
  std::vector<char> subdomain_colour(ties.subdomains(), none);
  // The subdomain most strongly tied to coloured ones comes next; of equals the first. Entries whose strength
  // has changed since are skipped.
  std::vector<std::int64_t> strength(subdomain_colour.size(), 0);
  std::priority_queue<std::pair<std::int64_t, std::int64_t>> next;
  for (std::size_t e = 0; e < subdomain_colour.size(); ++e) next.emplace(0, -static_cast<std::int64_t>(e));
  while (!next.empty()) {
    const auto [strong, minus] = next.top();
    next.pop();
    const auto e = static_cast<std::size_t>(-minus);
    if (subdomain_colour[e] != none || strong != strength[e]) continue;
    subdomain_colour[e] = least(shared_with(ties, subdomain_colour, e, subdomain_colours));
    for (const Tie& tie : ties.of(e)) {
      const auto other = static_cast<std::size_t>(tie.other);
      if (subdomain_colour[other] != none) continue;
      strength[other] += tie.grains;
      next.emplace(strength[other], -static_cast<std::int64_t>(other));
    }
  }
  return subdomain_colour;
}

/// Each move reduces the grains shared within a colour, so the moves end.
void improve(const Ties& ties, int subdomain_colours, std::vector<char>& subdomain_colour) {
  for (bool moved = true; moved;) {
    moved = false;
    for (std::size_t e = 0; e < subdomain_colour.size(); ++e) {
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

std::vector<char> choose_subdomain_colours(std::int32_t subdomains, std::span<const Tie> list) {
  constexpr int most = 4;
  const Ties ties(static_cast<std::size_t>(subdomains), list);
  for (int subdomain_colours = 2;; ++subdomain_colours) {
    std::vector<char> subdomain_colour = grow(ties, subdomain_colours);
    improve(ties, subdomain_colours, subdomain_colour);
    std::int64_t all = 0, within = 0;
    for (const Tie& tie : list) {
      all += tie.grains;
      if (subdomain_colour[static_cast<std::size_t>(tie.subdomain)] ==
          subdomain_colour[static_cast<std::size_t>(tie.other)])
        within += tie.grains;
    }
    if (4 * within <= all || subdomain_colours == most) return subdomain_colour;
  }
}

}  // namespace talus
