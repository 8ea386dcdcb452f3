#pragma once

/// Recorded subdomains on the ranks and threads of another machine.

#include <cstdint>
#include <vector>

#include "runtime/graph/tree.hpp"
#include "runtime/trace/replay.hpp"

namespace talus::trace {

/// A node of a loop on the machine, and the node of the trace that it stands for.
struct SimNode {
  std::int32_t source_rank = -1;  ///< -1: nothing was recorded
  std::uint32_t source_node = 0;
  Role role = Role::compute;
  std::uint32_t group = 0;
  std::uint32_t rank = 0;
  std::uint32_t worker = 0;  ///< rank x threads + thread
  std::uint32_t colour = 0;
  bool tells = false;       ///< the part of its group for the root leaves with it
  bool waits_only = false;  ///< takes messages, and does none of the recorded work
};

/// A message of each exchange, from the node `from` to the glue, take or root `to`.
struct SimMessage {
  std::uint32_t from = 0, to = 0;
  std::uint32_t bytes = 0;
  std::uint32_t name = 0;
};

/// The loop of one plan on all ranks. n nodes, rank by rank.
struct LoopLayout {
  std::vector<SimNode> nodes;
  graph::Tree tree;                              ///< of the ranks
  std::vector<std::uint32_t> rank_begin;         ///< ranks + 1
  std::vector<std::uint32_t> offset, neighbour;  ///< n + 1; conflicting nodes, of the same rank
  std::vector<std::uint32_t> walk_begin, walk;   ///< per worker: its nodes by (colour, index)
  std::vector<std::uint32_t> send_begin;         ///< n + 1, into sends
  std::vector<SimMessage> sends;                 ///< of publishes and centres
  std::vector<SimMessage> to_root;               ///< per rank: sent by the last of a leaf that tells
  std::vector<std::uint32_t> tellers;            ///< per rank: nodes that tell
  std::vector<std::uint32_t> handed;    ///< n: bytes that a node newly shares with other threads of its rank
  std::vector<std::uint32_t> incoming;  ///< n: messages that a node takes per exchange
  std::vector<Plan> plans;              ///< per rank, as the program would have made them

  std::span<const std::uint32_t> neighbours(std::uint32_t node) const {
    return std::span(neighbour).subspan(offset[node], offset[node + 1] - offset[node]);
  }
};

/// Rank of each entry of groups_of(trace). Weights: of the groups, for RankMap::weight.
std::vector<std::uint32_t> map_groups(const std::vector<std::uint64_t>& weight, const Machine& machine);

/// `plans`: of every recorded rank, none null. `rank_of`: of every group in `groups`.
LoopLayout lay_out(const std::vector<const Plan*>& plans, const std::vector<std::uint32_t>& groups,
                   const std::vector<std::uint32_t>& rank_of, const Machine& machine);

/// A task of every step on the machine.
struct SimTask {
  Task task;
  struct Source {
    std::int32_t rank;
    std::uint32_t task;
  };
  std::vector<Source> sources;  ///< one for a subdomain's task, all recorded ranks for the rank's
};

/// Tasks of each rank, in their order of submission.
std::vector<std::vector<SimTask>> lay_out_tasks(const Trace& trace, const std::vector<std::uint32_t>& groups,
                                                const std::vector<std::uint32_t>& rank_of, int ranks);

}  // namespace talus::trace
