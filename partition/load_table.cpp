#include "partition/load_table.hpp"

#include <algorithm>
#include <array>
#include <iomanip>
#include <set>
#include <sstream>

namespace talus {

namespace {

struct Row {
  std::string_view label;
  std::vector<std::int64_t> LoadTable::*values;
};
constexpr std::array<Row, 6> rows{{{"bodies", &LoadTable::bodies},
                                   {"contacts", &LoadTable::contacts},
                                   {"neighbours", &LoadTable::neighbours},
                                   {"neighbours, walls too", &LoadTable::wall_neighbours},
                                   {"interface bodies", &LoadTable::shared_bodies},
                                   {"corner bodies", &LoadTable::corner_bodies}}};

}  // namespace

Spread spread_of(std::span<const std::int64_t> values) {
  Spread spread;
  if (values.empty()) return spread;
  spread.min = *std::min_element(values.begin(), values.end());
  spread.max = *std::max_element(values.begin(), values.end());
  std::int64_t sum = 0;
  for (std::int64_t value : values) sum += value;
  spread.mean = static_cast<double>(sum) / static_cast<double>(values.size());
  if (sum > 0) spread.variation = static_cast<double>(spread.max - spread.min) / spread.mean;
  return spread;
}

LoadTable measure_load(std::int32_t subdomains, std::span<const SubdomainInterface> interfaces,
                       const BodySubdomains& grains, const BodySubdomains& walls,
                       std::span<const SubdomainId> contacts, const Reduction& reduction) {
  LoadTable table;
  for (const Row& row : rows) (table.*row.values).assign(static_cast<std::size_t>(subdomains), 0);
  for (const SubdomainId subdomain : contacts) ++table.contacts[subdomain.at()];
  for (const SubdomainInterface& interface : interfaces) {
    const std::size_t e = interface.subdomain.at();
    // Neighbours are counted from the incidences, not from the exchange lists, which leave out the subdomains
    // of a hub.
    std::set<SubdomainId> others;
    for (std::int32_t k : interface.shared) {
      const auto in = grains.of(static_cast<std::size_t>(interface.bodies[static_cast<std::size_t>(k)]));
      others.insert(in.begin(), in.end());
    }
    others.erase(interface.subdomain);
    table.neighbours[e] = static_cast<std::int64_t>(others.size());
    for (std::size_t wall = 0; wall < walls.bodies(); ++wall) {
      const auto in = walls.of(wall);
      if (std::binary_search(in.begin(), in.end(), interface.subdomain)) others.insert(in.begin(), in.end());
    }
    others.erase(interface.subdomain);
    table.wall_neighbours[e] = static_cast<std::int64_t>(others.size());
    table.bodies[e] = static_cast<std::int64_t>(interface.bodies.size());
    table.shared_bodies[e] = static_cast<std::int64_t>(interface.shared.size());
    table.corner_bodies[e] = std::count_if(interface.multiplicity.begin(), interface.multiplicity.end(),
                                           [](std::int32_t m) { return m > 2; });
  }
  for (const Row& row : rows) reduction.sum(table.*row.values);
  return table;
}

std::string load_text(std::span<const std::string_view> names, std::span<const LoadTable> tables) {
  constexpr int label = 22, column = 8, percent = 7;
  std::ostringstream text;
  text << std::setw(label) << std::left << "per subdomain" << std::right;
  for (std::string_view name : names) text << " |" << std::setw(2 * column + percent + 2) << name;
  text << '\n' << std::string(label, ' ');
  for (std::size_t k = 0; k < tables.size(); ++k)
    text << " |" << std::setw(column) << "min" << std::setw(column) << "max" << std::setw(percent + 2)
         << "var. %";
  text << '\n' << std::fixed << std::setprecision(1);
  for (const Row& row : rows) {
    text << std::setw(label) << std::left << row.label << std::right;
    for (const LoadTable& table : tables) {
      const Spread spread = spread_of(table.*row.values);
      text << " |" << std::setw(column) << spread.min << std::setw(column) << spread.max
           << std::setw(percent + 2) << 100 * spread.variation;
    }
    text << '\n';
  }
  return text.str();
}

}  // namespace talus
