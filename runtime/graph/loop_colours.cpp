#include "runtime/graph/loop_colours.hpp"

#include <algorithm>
#include <array>

namespace talus::graph {

namespace {

/// What a rank goes through one after the other. Turn t > 0 is phase first_turn + t.
enum Phase : std::uint32_t { telling, inside_of_later, first_turn, early_glue = 1000, inside_of_first, glue };

/// Of a subdomain, within a phase.
enum Part : std::uint32_t { early, tell, inner, take, border, publish, inner_behind };

/// What comes first, by its numbers from the left: phase, subdomain, part, colour.
using Turn = std::array<std::uint32_t, 4>;

std::vector<Turn> sorted(std::vector<Turn> turns) {
  std::sort(turns.begin(), turns.end());
  turns.erase(std::unique(turns.begin(), turns.end()), turns.end());
  return turns;
}

std::uint32_t place_in(const std::vector<Turn>& order, const Turn& turn) {
  return static_cast<std::uint32_t>(std::lower_bound(order.begin(), order.end(), turn) - order.begin());
}

/// Colours that count from 0 in each part of a subdomain, subdomains alike.
void go_abreast(std::vector<Turn>& turns) {
  const std::vector<Turn> order = sorted(turns);
  for (Turn& turn : turns)
    turn = {turn[0], 0, turn[2], place_in(order, turn) - place_in(order, {turn[0], turn[1], turn[2], 0})};
}

}  // namespace

LoopColours loop_colours(std::span<const ChunkTurn> turns, std::span<const char> turn_of,
                         std::span<const char> tells, bool in_turns, bool overlap, int threads, int rank,
                         const Tree& tree) {
  const auto subdomains = static_cast<std::uint32_t>(turn_of.size());
  // One after another as a whole, but where others wait for all publishes of a rank that has nothing else to
  // do in between.
  const bool alone = tree.order.size() == 1,
             later = std::ranges::any_of(turn_of, [](char turn) { return turn > 0; });
  const Phase behind =
      overlap && threads == 1 && (alone || later || !in_turns) ? first_turn : inside_of_first;
  std::vector<Turn> own;
  const auto phase_of = [&](std::uint32_t turn, Part part) -> std::uint32_t {
    if (part == inner_behind) return behind;
    if (part <= tell && !alone) return telling;
    return turn > 0 && part <= inner && !overlap ? inside_of_later : first_turn + turn;
  };
  const auto add = [&](std::uint32_t e, Part part, std::uint32_t colour) {
    own.push_back({phase_of(static_cast<std::uint32_t>(turn_of[e]), part), e, part, colour});
  };
  for (const ChunkTurn& chunk : turns) {
    add(chunk.subdomain,
        chunk.side == ChunkTurn::inside  ? (turn_of[chunk.subdomain] == 0 ? inner_behind : inner)
        : chunk.side == ChunkTurn::early ? early
                                         : border,
        chunk.colour);
  }
  // What is not there begins nothing more.
  for (std::uint32_t e = 0; e < subdomains; ++e) add(e, publish, 0);
  for (std::uint32_t e = 0; e < subdomains; ++e) add(e, turn_of[e] > 0 ? take : publish, 0);
  for (std::uint32_t e = 0; e < subdomains; ++e) add(e, tells[e] != 0 ? tell : publish, 0);
  if (threads > 1) go_abreast(own);
  own.push_back({overlap ? glue : early_glue, 0, 0, 0});
  const std::vector<Turn> order = sorted(own);
  std::vector<std::uint32_t> colours;
  for (const Turn& turn : own) colours.push_back(2 * place_in(order, turn));
  const auto publish_at = colours.begin() + static_cast<std::ptrdiff_t>(turns.size()),
             take_at = publish_at + subdomains, tell_at = take_at + subdomains, end = tell_at + subdomains;
  LoopColours result{{colours.begin(), publish_at},
                     {publish_at, take_at},
                     {take_at, tell_at},
                     {tell_at, end},
                     colours.back(),
                     {}};
  const std::uint32_t last_tell = subdomains > 0 ? std::ranges::max(result.tell) : 0;
  result.tree = tree_colours(tree, rank, last_tell, result.glue);
  for (std::uint32_t e = 0; e < subdomains; ++e) {
    if (turn_of[e] > 0) result.tree.up = std::min(result.tree.up, result.take[e] - 1);
    if (in_turns) result.tree.down = std::max(result.tree.down, result.publish[e] + 1);
  }
  return result;
}

}  // namespace talus::graph
