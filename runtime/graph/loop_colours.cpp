#include "runtime/graph/loop_colours.hpp"

#include <algorithm>

namespace talus::graph {

namespace {

std::vector<ChunkTurn> sorted(std::vector<ChunkTurn> turns) {
  std::sort(turns.begin(), turns.end());
  turns.erase(std::unique(turns.begin(), turns.end()), turns.end());
  return turns;
}

std::size_t place_in(const std::vector<ChunkTurn>& order, const ChunkTurn& turn) {
  return static_cast<std::size_t>(std::lower_bound(order.begin(), order.end(), turn) - order.begin());
}

/// Colours that count from 0 in each subdomain, subdomains alike.
void go_abreast(std::vector<ChunkTurn>& turns) {
  const std::vector<ChunkTurn> order = sorted(turns);
  for (ChunkTurn& turn : turns) {
    const std::size_t first = place_in(order, {turn.inside, turn.subdomain, 0});
    turn = {turn.inside, 0, static_cast<std::uint32_t>(place_in(order, turn) - first)};
  }
}

}  // namespace

LoopColours loop_colours(std::span<const ChunkTurn> turns, bool overlap, int threads) {
  std::vector<ChunkTurn> own(turns.begin(), turns.end());
  if (threads > 1) go_abreast(own);
  const std::vector<ChunkTurn> order = sorted(own);
  const std::size_t border = place_in(order, {true, 0, 0});
  LoopColours colours;
  colours.publish = static_cast<std::uint32_t>(2 * border);
  colours.glue = overlap ? static_cast<std::uint32_t>(2 * order.size() + 2) : colours.publish + 2;
  const std::uint32_t shift = overlap ? 2 : 4;
  for (const ChunkTurn& turn : own)
    colours.chunk.push_back(static_cast<std::uint32_t>(2 * place_in(order, turn)) +
                            (turn.inside ? shift : 0));
  return colours;
}

}  // namespace talus::graph
