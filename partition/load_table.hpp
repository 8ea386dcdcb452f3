#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "partition/interface.hpp"
#include "partition/reduction.hpp"

namespace talus {

/// One quantity over the subdomains: a row of the paper's Table 4.
struct Spread {
  std::int64_t min = 0;
  std::int64_t max = 0;
  double mean = 0;
  double variation = 0;  ///< (max - min) / mean; 0 when the mean is
};

/// Characteristic values per subdomain, and their spread (Table 4).
struct LoadTable {
  std::vector<std::int64_t> bodies;           ///< N_E^S: grains that stand in E, copies included
  std::vector<std::int64_t> contacts;         ///< N_E^C
  std::vector<std::int64_t> neighbours;       ///< N_E^Isd: subdomains that share a grain with E
  std::vector<std::int64_t> wall_neighbours;  ///< subdomains that share a grain or a wall with E
  std::vector<std::int64_t> shared_bodies;    ///< grains of E with m > 1
  std::vector<std::int64_t> corner_bodies;    ///< N_E^{m>2}: grains of E with m > 2
};

Spread spread_of(std::span<const std::int64_t> values);

/// `interfaces` and `contacts` (each contact's subdomain) of this rank; a contact is on one rank only.
/// `walls`: complete on each rank for the walls that touch its subdomains. The table is the same on all
/// ranks.
LoadTable measure_load(std::int32_t subdomains, std::span<const SubdomainInterface> interfaces,
                       const BodySubdomains& grains, const BodySubdomains& walls,
                       std::span<const SubdomainId> contacts, const Reduction& reduction = {});

/// Tables side by side, one column block (min, max, variation) per partitioner, as text.
std::string load_text(std::span<const std::string_view> names, std::span<const LoadTable> tables);

}  // namespace talus
