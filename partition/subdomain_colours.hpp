#pragma once

/// When it is whose subdomain colour, where subdomains that share grains act one after the other
/// (Coupling::alternating).

#include <cstdint>
#include <span>
#include <vector>

namespace talus {

/// Two subdomains, and how many grains they share. Each pair in both directions.
struct Tie {
  std::int32_t subdomain;
  std::int32_t other;
  std::int32_t grains;
};

/// Turns of the subdomains, 0 to 3, such that as many ties as can easily be had, counted in grains, run
/// between subdomains of different subdomain colours: a colouring that leaves few conflicts, by growth from
/// subdomain 0 along the strongest ties and moves of single subdomains as long as one helps. No more
/// subdomain colours than leave a quarter of the ties within one: two for boxes, which come out like the
/// fields of a chessboard, three for parts of METIS. A function of the ties alone, whatever their order.
/// Throws std::out_of_range when a tie names no subdomain.
std::vector<char> choose_subdomain_colours(std::int32_t subdomains, std::span<const Tie> ties);

}  // namespace talus
