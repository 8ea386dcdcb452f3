#include "runtime/graph/loop_colours.hpp"

#include <algorithm>
#include <array>

namespace talus::graph {

namespace {

/// What a rank goes through one after the other. Turn t > 0 is phase first_colour + t.
enum Phase : std::uint32_t {
  telling,
  inside_of_later,
  first_colour,
  early_glue = 1000,
  inside_of_first,
  glue
};

/// Of a subdomain, within a phase.
enum Part : std::uint32_t { early, tell, inner, take, border, publish, inner_behind };

/// What comes first, by its numbers from the left: phase, subdomain, part, colour.
using Position = std::array<std::uint32_t, 4>;

std::vector<Position> sorted(std::vector<Position> subdomain_colours) {
  std::sort(subdomain_colours.begin(), subdomain_colours.end());
  subdomain_colours.erase(std::unique(subdomain_colours.begin(), subdomain_colours.end()),
                          subdomain_colours.end());
  return subdomain_colours;
}

std::uint32_t place_in(const std::vector<Position>& order, const Position& subdomain_colour) {
  return static_cast<std::uint32_t>(std::lower_bound(order.begin(), order.end(), subdomain_colour) -
                                    order.begin());
}

/// Colours that count from 0 in each part of a subdomain, subdomains alike.
void go_abreast(std::vector<Position>& subdomain_colours) {
  const std::vector<Position> order = sorted(subdomain_colours);
  for (Position& subdomain_colour : subdomain_colours)
    subdomain_colour = {
        subdomain_colour[0], 0, subdomain_colour[2],
        place_in(order, subdomain_colour) -
            place_in(order, {subdomain_colour[0], subdomain_colour[1], subdomain_colour[2], 0})};
}

}  // namespace

LoopColours loop_colours(std::span<const ChunkOrder> subdomain_colours,
                         std::span<const char> subdomain_colour_of, std::span<const char> tells,
                         bool in_colours, bool overlap, int threads, int rank, const Tree& tree) {
  const auto subdomains = static_cast<std::uint32_t>(subdomain_colour_of.size());
  // One after another as a whole, but where others wait for all publishes of a rank that has nothing else to
  // do in between.
  const bool alone = tree.order.size() == 1,
             later = std::ranges::any_of(subdomain_colour_of,
                                         [](char subdomain_colour) { return subdomain_colour > 0; });
  const Phase behind =
      overlap && threads == 1 && (alone || later || !in_colours) ? first_colour : inside_of_first;
  std::vector<Position> own;
  const auto phase_of = [&](std::uint32_t subdomain_colour, Part part) -> std::uint32_t {
    if (part == inner_behind) return behind;
    if (part <= tell && !alone) return telling;
    return subdomain_colour > 0 && part <= inner && !overlap ? inside_of_later
                                                             : first_colour + subdomain_colour;
  };
  const auto add = [&](std::uint32_t e, Part part, std::uint32_t colour) {
    own.push_back({phase_of(static_cast<std::uint32_t>(subdomain_colour_of[e]), part), e, part, colour});
  };
  for (const ChunkOrder& chunk : subdomain_colours) {
    add(chunk.subdomain,
        chunk.side == ChunkOrder::inside  ? (subdomain_colour_of[chunk.subdomain] == 0 ? inner_behind : inner)
        : chunk.side == ChunkOrder::early ? early
                                          : border,
        chunk.colour);
  }
  // Subdomains without such a node reuse the colour of `publish`.
  for (std::uint32_t e = 0; e < subdomains; ++e) add(e, publish, 0);
  for (std::uint32_t e = 0; e < subdomains; ++e) add(e, subdomain_colour_of[e] > 0 ? take : publish, 0);
  for (std::uint32_t e = 0; e < subdomains; ++e) add(e, tells[e] != 0 ? tell : publish, 0);
  if (threads > 1) go_abreast(own);
  own.push_back({overlap ? glue : early_glue, 0, 0, 0});
  const std::vector<Position> order = sorted(own);
  std::vector<std::uint32_t> colours;
  for (const Position& subdomain_colour : own) colours.push_back(2 * place_in(order, subdomain_colour));
  const auto publish_at = colours.begin() + static_cast<std::ptrdiff_t>(subdomain_colours.size()),
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
    if (subdomain_colour_of[e] > 0) result.tree.up = std::min(result.tree.up, result.take[e] - 1);
    if (in_colours) result.tree.down = std::max(result.tree.down, result.publish[e] + 1);
  }
  return result;
}

}  // namespace talus::graph
