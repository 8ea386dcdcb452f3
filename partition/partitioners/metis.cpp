/// k-way partition of a graph of cells by METIS. A new region gets the number of the old one that it overlaps
/// most, so that fewer bodies migrate.

#include "partition/detail/cell_graph.hpp"
#include "partition/partitioners.hpp"

namespace talus {
namespace {

void cut_metis(const Cutting& cutting, Partition& partition) {
  const std::int32_t n = partition.subdomains;
  const auto graph =
      detail::build_cell_graph(cutting.points, partition.frame, detail::cells_per_subdomain * n,
                               cutting.reduction, cutting.options.domain);
  partition.table = detail::cut_cell_graph(graph, n, cutting.reduction);
  if (cutting.previous != nullptr)
    detail::keep_numbers(partition.table, *cutting.previous, cutting.points, partition.frame, n,
                         cutting.reduction);
}

}  // namespace

const Partitioner metis_partitioner{cut_metis, false, true};

}  // namespace talus
