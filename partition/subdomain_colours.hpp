#pragma once

/// Colours of subdomains for alternating coupling (Coupling::alternating): subdomains that share grains act
/// one colour after the other.

#include <cstdint>
#include <span>
#include <vector>

#include "partition/subdomain.hpp"

namespace talus {

/// Two subdomains, and how many grains they share. Each pair in both directions.
struct Tie {
  SubdomainId subdomain;
  SubdomainId other;
  std::int32_t grains;
};

/// The colour of each subdomain, 0 to 3. A heuristic makes the shared grains between subdomains of one colour
/// few: it grows the colouring from subdomain 0 along the strongest ties, then recolours single subdomains as
/// long as that helps. It takes the smallest number of colours that leaves at most a quarter of the shared
/// grains between subdomains of one colour: two for boxes, which come out like a chessboard, three for
/// subdomains cut by METIS. The result depends on the ties alone, not on their order. Throws
/// std::out_of_range when a tie names no subdomain.
Per<SubdomainId, char> choose_subdomain_colours(std::int32_t subdomains, std::span<const Tie> ties);

}  // namespace talus
