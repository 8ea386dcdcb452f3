#include "runtime/trace/network.hpp"

#include <algorithm>
#include <bit>

namespace talus::trace {

Network::Network(const Machine& machine)
    : ranks_per_node_(static_cast<std::uint32_t>(machine.ranks_per_node)),
      latency_(1e9 * machine.latency),
      per_byte_(1e9 / machine.bandwidth),
      node_latency_(1e9 * machine.node_latency),
      node_per_byte_(1e9 / machine.node_bandwidth),
      overhead_(1e9 * machine.overhead),
      unbounded_(machine.unbounded) {
  const auto ranks = static_cast<unsigned>(machine.ranks);
  const unsigned inside = std::min(ranks, ranks_per_node_), nodes = (ranks + inside - 1) / inside;
  const auto levels = [](unsigned count) { return static_cast<double>(std::bit_width(count - 1)); };
  collective_ = levels(nodes) * (latency_ + 2 * overhead_) + levels(inside) * (node_latency_ + 2 * overhead_);
  collective_byte_ = levels(nodes) * inside * per_byte_ + levels(inside) * node_per_byte_;
  // To the next rank, which is mostly on the same node.
  first_ = ranks == 1 ? 0 : (inside > 1 ? node_latency_ : latency_) + 2 * overhead_;
  out_free_.assign(nodes, 0);
  in_free_.assign(nodes, 0);
}

double Network::arrival(std::uint32_t from_rank, std::uint32_t to_rank, std::uint32_t bytes, double now) {
  const std::size_t from = node_of(from_rank), to = node_of(to_rank);
  if (from == to) return now + node_latency_ + node_per_byte_ * bytes;
  const double length = per_byte_ * bytes;
  if (unbounded_) return now + latency_ + length;
  const double leaves = std::max(now, out_free_[from]);
  out_free_[from] = leaves + length;
  const double comes = std::max(leaves + latency_, in_free_[to]);
  in_free_[to] = comes + length;
  return comes + length;
}

}  // namespace talus::trace
