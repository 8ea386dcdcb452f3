#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "runtime/trace/replay.hpp"
#include "runtime/trace/timeline.hpp"

namespace talus::trace {

/// When messages arrive. A message leaves through the link of its node when those before it have left, is
/// under way for the latency, and then takes the link of the receiving node, in order of arrival: alone on
/// the network it needs latency + bytes/bandwidth. Links are not shared inside a node, nor on an unbounded
/// machine: with another order on a shared link a run could end sooner, and the bound must hold for every
/// order.
class Network {
 public:
  explicit Network(const Machine& machine);
  /// `now` must not decrease from call to call. [ns]
  double arrival(std::uint32_t from_rank, std::uint32_t to_rank, std::uint32_t bytes, double now);
  /// Time of a gather on all ranks, from the arrival of the last rank: log2(ranks) messages, one behind the
  /// other (Communicator::start_gather). [ns]
  double collective() const { return collective_; }
  /// Time of collective calls, one behind the other. Each message of a call holds all that it adds up, and
  /// the ranks of a node share its link. [ns]
  double time_of(const Calls& calls) const {
    return calls.count * collective_ + calls.bytes * collective_byte_;
  }
  /// The part of collective() that follows once all ranks wait: the first message of each rank has left
  /// before (Communicator::start_gather).
  double collective_rest() const { return collective_ - first_; }
  /// Between ranks that are farthest from each other.
  double latency() const { return out_free_.size() > 1 ? latency_ : node_latency_; }
  /// Of a thread, per message. [ns]
  double overhead() const { return overhead_; }

 private:
  std::size_t node_of(std::uint32_t rank) const { return rank / ranks_per_node_; }
  std::uint32_t ranks_per_node_;
  double latency_, per_byte_, node_latency_, node_per_byte_, overhead_, collective_, collective_byte_, first_;
  bool unbounded_;
  std::vector<double> out_free_, in_free_;  ///< per node: when its link is free again
};

}  // namespace talus::trace
