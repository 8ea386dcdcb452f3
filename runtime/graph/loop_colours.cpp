#include "runtime/graph/loop_colours.hpp"

#include <algorithm>
#include <array>

namespace talus::graph {

namespace {

enum Part : std::uint32_t { border, publish, glue_early, inside, glue };

/// What comes first, by its numbers from the left.
using Turn = std::array<std::uint32_t, 3>;

std::vector<Turn> sorted(std::vector<Turn> turns) {
  std::sort(turns.begin(), turns.end());
  turns.erase(std::unique(turns.begin(), turns.end()), turns.end());
  return turns;
}

std::uint32_t place_in(const std::vector<Turn>& order, const Turn& turn) {
  return static_cast<std::uint32_t>(std::lower_bound(order.begin(), order.end(), turn) - order.begin());
}

/// Colours that count from 0 in each subdomain, subdomains alike.
void go_abreast(std::vector<Turn>& turns) {
  const std::vector<Turn> order = sorted(turns);
  for (Turn& turn : turns)
    turn = {turn[0], 0, place_in(order, turn) - place_in(order, {turn[0], turn[1], 0})};
}

}  // namespace

LoopColours loop_colours(std::span<const ChunkTurn> turns, std::size_t subdomains, bool overlap,
                         int threads) {
  std::vector<Turn> own;  // {part, subdomain, colour}
  for (const ChunkTurn& turn : turns)
    own.push_back({turn.inside ? inside : border, turn.subdomain, turn.colour});
  if (threads > 1) go_abreast(own);
  for (std::uint32_t e = 0; e < subdomains; ++e) own.push_back({publish, threads > 1 ? 0 : e, 0});
  const bool one_by_one = threads == 1 && overlap;
  if (one_by_one)
    for (Turn& turn : own) std::swap(turn[0], turn[1]);
  own.push_back(one_by_one ? Turn{static_cast<std::uint32_t>(subdomains), glue, 0}
                           : Turn{overlap ? glue : glue_early, 0, 0});
  const std::vector<Turn> order = sorted(own);
  std::vector<std::uint32_t> colours;
  for (const Turn& turn : own) colours.push_back(2 * place_in(order, turn));
  const auto publishes = colours.begin() + static_cast<std::ptrdiff_t>(turns.size());
  return {{colours.begin(), publishes}, {publishes, colours.end() - 1}, colours.back()};
}

}  // namespace talus::graph
