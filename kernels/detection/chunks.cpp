#include "kernels/detection/chunks.hpp"

#include <algorithm>
#include <array>
#include <numeric>
#include <stdexcept>
#include <string>

#include "kernels/bodies/index.hpp"
#include "kernels/detection/wall_pairs.hpp"
#include "kernels/law/pair_table.hpp"

namespace talus {

namespace {

void place_boundaries(std::span<const CandidateGroup> groups, Chunks& chunks) {
  for (const CandidateGroup& group : groups) {
    // Pieces of equal length: a short last piece would be a poor task.
    const std::int32_t pieces = (group.end - group.begin + group.target - 1) / group.target;
    for (std::int32_t k = 0; k < pieces; ++k) {
      const auto part = static_cast<std::int64_t>(group.end - group.begin) * k / pieces;
      chunks.begin.push_back(group.begin + static_cast<std::int32_t>(part));
      chunks.wall.push_back(group.wall);
      chunks.subdomain.push_back(group.subdomain);
      chunks.side.push_back(group.side);
      chunks.kind.push_back(group.wall < 0 ? ChunkKind::spheres : ChunkKind::spheres_wall);
      chunks.law.push_back(static_cast<std::int32_t>(
          PairTable::number(material_of_grains, group.wall < 0 ? material_of_grains : material_of_walls)));
    }
  }
  chunks.begin.push_back(groups.empty() ? 0 : groups.back().end);
}

void list_bodies(const Candidates& candidates, std::size_t bodies, Chunks& chunks) {
  const std::size_t grains = candidates.grain_pairs.size();
  std::vector<std::int32_t> seen_in(bodies, -1);
  std::vector<std::uint16_t> place(bodies);
  chunks.local.resize(2 * candidates.size());
  chunks.body_begin.push_back(0);
  for (std::size_t c = 0; c < chunks.wall.size(); ++c) {
    const auto first_of_chunk = chunks.bodies.size();
    const auto local = [&](Slot slot) {
      const auto s = static_cast<std::size_t>(slot);
      if (seen_in[s] != static_cast<std::int32_t>(c)) {
        seen_in[s] = static_cast<std::int32_t>(c);
        place[s] = static_cast<std::uint16_t>(chunks.bodies.size() - first_of_chunk);
        chunks.bodies.push_back(slot);
      }
      return place[s];
    };
    for (std::size_t k = at(chunks.begin[c]); k < at(chunks.begin[c + 1]); ++k) {
      if (k < grains) {
        chunks.local[2 * k] = local(candidates.grain_pairs[k].first);
        chunks.local[2 * k + 1] = local(candidates.grain_pairs[k].second);
      } else {
        chunks.local[2 * k] = local(candidates.wall_pairs[k - grains].body);
      }
    }
    chunks.body_begin.push_back(static_cast<std::int32_t>(chunks.bodies.size()));
  }
}

/// Puts candidates of grains with many candidates first: at the end they would need groups of their own.
/// Sorts by counting, so that equals keep their order. At walls the order is that of the candidates.
void order_candidates(const Candidates& candidates, Chunks& chunks) {
  constexpr std::size_t ranks = 64;
  chunks.order.resize(candidates.grain_pairs.size());
  std::vector<std::uint16_t> degree;
  for (std::size_t c = 0; c < chunks.wall.size() && chunks.wall[c] < 0; ++c) {
    const std::size_t begin = at(chunks.begin[c]), end = at(chunks.begin[c + 1]);
    degree.assign(at(chunks.body_begin[c + 1] - chunks.body_begin[c]), 0);
    for (std::size_t k = 2 * begin; k < 2 * end; ++k) ++degree[chunks.local[k]];
    std::array<std::size_t, ranks + 1> next{};
    const auto rank = [&](std::size_t k) {
      const std::size_t both =
          std::size_t{degree[chunks.local[2 * k]]} + std::size_t{degree[chunks.local[2 * k + 1]]};
      return ranks - 1 - std::min(ranks - 1, both);
    };
    for (std::size_t k = begin; k < end; ++k) ++next[rank(k) + 1];
    std::partial_sum(next.begin(), next.end(), next.begin());
    for (std::size_t k = begin; k < end; ++k)
      chunks.order[begin + next[rank(k)]++] = static_cast<std::uint16_t>(k - begin);
  }
}

/// Body -> chunks, as offsets and lists.
struct Incidence {
  std::vector<std::int32_t> begin;
  std::vector<std::uint32_t> chunk;
};

Incidence chunks_of_bodies(const Chunks& chunks, std::size_t bodies) {
  Incidence incidence;
  incidence.begin.assign(bodies + 1, 0);
  for (Slot s : chunks.bodies) ++incidence.begin[at(s) + 1];
  std::partial_sum(incidence.begin.begin(), incidence.begin.end(), incidence.begin.begin());
  incidence.chunk.resize(chunks.bodies.size());
  std::vector<std::int32_t> next(incidence.begin.begin(), incidence.begin.end() - 1);
  for (std::size_t c = 0; c < chunks.wall.size(); ++c)
    for (auto k = chunks.body_begin[c]; k < chunks.body_begin[c + 1]; ++k)
      incidence.chunk[at(next[at(chunks.bodies[at(k)])]++)] = static_cast<std::uint32_t>(c);
  return incidence;
}

void find_conflicts(const Incidence& incidence, Chunks& chunks) {
  const std::size_t count = chunks.wall.size();
  std::vector<std::uint32_t> met(count, ~0u);
  chunks.conflict_begin.push_back(0);
  for (std::size_t c = 0; c < count; ++c) {
    const auto from = chunks.conflicts.size();
    met[c] = static_cast<std::uint32_t>(c);
    for (auto k = chunks.body_begin[c]; k < chunks.body_begin[c + 1]; ++k) {
      const auto s = at(chunks.bodies[at(k)]);
      for (auto m = incidence.begin[s]; m < incidence.begin[s + 1]; ++m) {
        const std::uint32_t other = incidence.chunk[at(m)];
        if (met[other] == c) continue;
        met[other] = static_cast<std::uint32_t>(c);
        chunks.conflicts.push_back(other);
      }
    }
    std::sort(chunks.conflicts.begin() + static_cast<std::ptrdiff_t>(from), chunks.conflicts.end());
    chunks.conflict_begin.push_back(static_cast<std::int32_t>(chunks.conflicts.size()));
  }
}

/// Colours chunks greedily, those of each side above those of the sides before.
void colour_chunks(Chunks& chunks) {
  const std::size_t count = chunks.wall.size();
  chunks.colour.assign(count, -1);
  std::vector<std::uint32_t> taken_by(count + 1, ~0u);  // colour -> last chunk that found it taken
  using enum ChunkSide;
  for (const ChunkSide side : {wall, border, inside, late}) {
    const std::int32_t lowest = chunks.colours;
    for (std::size_t c = 0; c < count; ++c) {
      if (chunks.side[c] != side) continue;
      for (auto k = chunks.conflict_begin[c]; k < chunks.conflict_begin[c + 1]; ++k) {
        const std::int32_t colour = chunks.colour[chunks.conflicts[at(k)]];
        if (colour >= 0) taken_by[at(colour)] = static_cast<std::uint32_t>(c);
      }
      std::int32_t colour = lowest;
      while (taken_by[at(colour)] == c) ++colour;
      chunks.colour[c] = colour;
      chunks.colours = std::max(chunks.colours, colour + 1);
    }
  }
}

void assign_resets(const Incidence& incidence, std::size_t bodies, std::span<const char> taken,
                   Chunks& chunks) {
  const std::size_t count = chunks.wall.size();
  std::vector<std::int32_t> owner(bodies, -1);
  chunks.owned_begin.assign(count + 1, 0);
  for (std::size_t s = 0; s < bodies; ++s) {
    if (!taken.empty() && taken[s] != 0) continue;
    for (auto m = incidence.begin[s]; m < incidence.begin[s + 1]; ++m) {
      const auto c = static_cast<std::int32_t>(incidence.chunk[at(m)]);
      if (owner[s] < 0 || chunks.colour[at(c)] < chunks.colour[at(owner[s])]) owner[s] = c;
    }
    if (owner[s] < 0)
      chunks.untouched.push_back(static_cast<Slot>(s));
    else
      ++chunks.owned_begin[at(owner[s]) + 1];
  }
  std::partial_sum(chunks.owned_begin.begin(), chunks.owned_begin.end(), chunks.owned_begin.begin());
  chunks.owned.resize(at(chunks.owned_begin.back()));
  std::vector<std::int32_t> next(chunks.owned_begin.begin(), chunks.owned_begin.end() - 1);
  for (std::size_t s = 0; s < bodies; ++s)
    if (owner[s] >= 0) chunks.owned[at(next[at(owner[s])]++)] = static_cast<Slot>(s);
}

/// Walks two sorted lists together and calls same(k_old, k_fresh) where they meet.
template <class Pair, class Less, class Same>
void merge_walk(const std::vector<Pair>& old, const std::vector<Pair>& fresh, Less less, Same same) {
  for (std::size_t a = 0, b = 0; a < old.size() && b < fresh.size();) {
    if (less(old[a], fresh[b]))
      ++a;
    else if (less(fresh[b], old[a]))
      ++b;
    else
      same(a++, b++);
  }
}

/// Wall pairs by (wall, body, feature), whatever the layers they stand in, with their places.
struct PlacedPair {
  WallPair pair;
  std::size_t place;
};
std::vector<PlacedPair> without_layers(std::span<const WallPair> pairs) {
  std::vector<PlacedPair> placed;
  for (std::size_t k = 0; k < pairs.size(); ++k) placed.push_back({pairs[k], k});
  const auto less = [](const PlacedPair& a, const PlacedPair& b) { return before(a.pair, b.pair); };
  if (!std::ranges::is_sorted(placed, less)) std::ranges::sort(placed, less);
  return placed;
}

bool before(const GrainPair& a, const GrainPair& b) {
  return a.first != b.first ? a.first < b.first : a.second < b.second;
}

/// A pair of bodies, and two of their balls that may touch.
struct BallPair {
  GrainPair pair;
  std::uint16_t balls;
};
bool before(const BallPair& a, const BallPair& b) {
  return a.pair == b.pair ? a.balls < b.balls : before(a.pair, b.pair);
}
std::vector<BallPair> with_balls(const Candidates& candidates) {
  std::vector<BallPair> pairs;
  for (std::size_t k = 0; k < candidates.grain_pairs.size(); ++k)
    pairs.push_back(
        {candidates.grain_pairs[k], candidates.balls.empty() ? std::uint16_t{0} : candidates.balls[k]});
  return pairs;
}

}  // namespace

std::vector<CandidateGroup> groups_of_one_subdomain(const Candidates& candidates, std::span<const char> glued,
                                                    int target) {
  const auto grains = static_cast<std::int32_t>(candidates.grain_pairs.size());
  const auto all = static_cast<std::int32_t>(candidates.size());
  std::vector<CandidateGroup> groups;
  if (grains > 0) groups.push_back({0, grains, -1, 0, ChunkSide::inside, target});
  for (std::int32_t from = grains; from < all;) {
    const std::int32_t wall = candidates.wall_pairs[at(from - grains)].wall;
    std::int32_t to = from;
    while (to < all && candidates.wall_pairs[at(to - grains)].wall == wall &&
           (to == from || !begins_layer(candidates.wall_pairs, at(to - grains))))
      ++to;
    const bool at_glued = !glued.empty() && glued[at(wall)] != 0;
    groups.push_back({from, to, wall, 0, at_glued ? ChunkSide::wall : ChunkSide::inside, target});
    from = to;
  }
  return groups;
}

Chunks cut_chunks(const Candidates& candidates, std::span<const CandidateGroup> groups, std::size_t bodies,
                  std::span<const char> taken) {
  if (bodies > most_bodies_of_a_process)
    throw std::runtime_error(std::to_string(bodies) + " bodies in one process, of at most " +
                             std::to_string(most_bodies_of_a_process) + "; use more ranks");
  Chunks chunks;
  place_boundaries(groups, chunks);
  list_bodies(candidates, bodies, chunks);
  order_candidates(candidates, chunks);
  const Incidence incidence = chunks_of_bodies(chunks, bodies);
  find_conflicts(incidence, chunks);
  colour_chunks(chunks);
  assign_resets(incidence, bodies, taken, chunks);
  return chunks;
}

Chunks cut_chunks(const Candidates& candidates, std::size_t bodies, int target) {
  return cut_chunks(candidates, groups_of_one_subdomain(candidates, {}, target), bodies);
}

void match_impulses(const Candidates& old, Candidates& fresh) {
  fresh.impulse.assign_zeros(fresh.size());
  if (old.impulse.kind() != fresh.impulse.kind()) return;
  const auto carry = [&](std::size_t from, std::size_t to) { fresh.impulse.set(to, old.impulse.row(from)); };
  const auto less = [](const auto& a, const auto& b) { return before(a, b); };
  if (fresh.balls.empty() && old.balls.empty())
    merge_walk(old.grain_pairs, fresh.grain_pairs, less, carry);
  else
    merge_walk(with_balls(old), with_balls(fresh), less, carry);
  const std::vector<PlacedPair> from = without_layers(old.wall_pairs), to = without_layers(fresh.wall_pairs);
  merge_walk(
      from, to, [](const auto& a, const auto& b) { return before(a.pair, b.pair); },
      [&](std::size_t a, std::size_t b) {
        carry(old.grain_pairs.size() + from[a].place, fresh.grain_pairs.size() + to[b].place);
      });
}

void renumber(Candidates& candidates, std::span<const Slot> place) {
  const std::size_t grains = candidates.grain_pairs.size();
  for (std::size_t k = 0; k < grains; ++k) {
    GrainPair& pair = candidates.grain_pairs[k];
    pair = {place[at(pair.first)], place[at(pair.second)]};
    if (pair.first < pair.second) continue;
    std::swap(pair.first, pair.second);
    if (!candidates.balls.empty())
      candidates.balls[k] =
          static_cast<std::uint16_t>(candidates.balls[k] % 256 * 256 + candidates.balls[k] / 256);
    candidates.impulse.swap_bodies(k);
  }
  for (WallPair& pair : candidates.wall_pairs) pair.body = place[at(pair.body)];

  std::vector<std::size_t> order(candidates.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto split = order.begin() + static_cast<std::ptrdiff_t>(grains);
  // Sorts by counting the first body: few pairs share it, so that the runs left to sort are short.
  std::vector<std::size_t> begin(place.size() + 2, 0);
  for (const GrainPair& pair : candidates.grain_pairs) ++begin[at(pair.first) + 2];
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  for (std::size_t k = 0; k < grains; ++k) order[begin[at(candidates.grain_pairs[k].first) + 1]++] = k;
  for (std::size_t body = 0; body < place.size(); ++body)
    std::sort(order.begin() + static_cast<std::ptrdiff_t>(begin[body]),
              order.begin() + static_cast<std::ptrdiff_t>(begin[body + 1]),
              [&](std::size_t a, std::size_t b) {
                const Slot one = candidates.grain_pairs[a].second, other = candidates.grain_pairs[b].second;
                if (candidates.balls.empty() || one != other) return one < other;
                return candidates.balls[a] < candidates.balls[b];
              });
  std::ranges::transform(layered_order(candidates.wall_pairs), split,
                         [grains](std::size_t k) { return grains + k; });
  Candidates sorted;
  sorted.impulse = KeptImpulses(candidates.impulse.kind());
  sorted.grain_pairs.reserve(grains);
  sorted.wall_pairs.reserve(candidates.wall_pairs.size());
  sorted.impulse.reserve(candidates.impulse.size());
  for (std::size_t k : order) {
    if (k < grains) {
      sorted.grain_pairs.push_back(candidates.grain_pairs[k]);
      if (!candidates.balls.empty()) sorted.balls.push_back(candidates.balls[k]);
    } else
      sorted.wall_pairs.push_back(candidates.wall_pairs[k - grains]);
    sorted.impulse.push_back(candidates.impulse.row(k));
  }
  candidates = std::move(sorted);
}

std::size_t memory_used(const Candidates& candidates) {
  return candidates.grain_pairs.capacity() * sizeof(GrainPair) + candidates.balls.capacity() * 2 +
         candidates.wall_pairs.capacity() * sizeof(WallPair) + candidates.impulse.bytes();
}

std::size_t memory_used(const Chunks& chunks) {
  return (chunks.begin.capacity() + chunks.wall.capacity() + chunks.subdomain.capacity() +
          chunks.law.capacity() + chunks.colour.capacity() + chunks.body_begin.capacity() +
          chunks.bodies.capacity() + chunks.owned_begin.capacity() + chunks.owned.capacity() +
          chunks.untouched.capacity() + chunks.conflict_begin.capacity() + chunks.conflicts.capacity()) *
             4 +
         (chunks.local.capacity() + chunks.order.capacity()) * 2 + chunks.side.capacity() +
         chunks.kind.capacity();
}

}  // namespace talus
