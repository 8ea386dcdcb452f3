#pragma once

/// What gluing.cpp exchanges and gluing_plan.cpp lays out.

#include <atomic>
#include <cstddef>
#include <memory>
#include <vector>

#include "runtime/step/gluing.hpp"

namespace talus {

/// A message from and to another rank; buffers have one room more than payload, for the time stamp of a
/// delay.
struct Gluing::Link {
  std::vector<double> out, in;
  std::unique_ptr<graph::Communicator::Channel> sender, receiver;
  std::uint32_t out_name = 0, in_name = 0;  ///< of the messages, in a trace
};

/// Towards one neighbour.
struct Gluing::Side {
  std::vector<std::size_t> slots;  ///< of the bodies in the message, in its order
  Link link;                       ///< `in` and the channels: of neighbours on other ranks only
  const double* source = nullptr;  ///< the neighbour's message to this subdomain
  std::int32_t local = -1;         ///< the neighbour's place here, -1 on another rank
};

struct Gluing::Subdomain {
  std::vector<Side> sides;
  std::vector<std::size_t> shared;  ///< slots
  std::vector<const double*>
      sources;               ///< per copy of `interface.copies`: where it is read; null: the own one
  std::vector<double> base;  ///< Schwarz: velocities after the last gluing, per shared body
  std::vector<std::vector<std::int32_t>> wall_copies;  ///< per glued wall: chunks here that hold a copy
  std::vector<double> partial;                         ///< to the centre: 3 per wall, then width per hub
  std::vector<std::size_t> hub_item;                   ///< per hub: its place in the centre's results
  double waited = 0;
};

/// The one rank through which some velocities go is rank 0.
struct Gluing::Centre {
  struct Contribution {
    const double* partial = nullptr;
    std::vector<std::size_t> item;  ///< per hub of the subdomain
  };
  std::vector<Contribution> contributions;  ///< rank 0: of every subdomain, in order
  std::vector<double> sums;  ///< 3 per wall, then width per item: all on rank 0, else those asked for
  std::vector<std::unique_ptr<Link>> links;             ///< rank 0: per other rank
  std::vector<std::vector<std::size_t>> items_of_rank;  ///< rank 0: per other rank
  std::atomic<std::size_t> published{0};                ///< other ranks: subdomains whose part is ready
  std::unique_ptr<Link> to_centre;                      ///< other ranks
  double waited = 0;
};

}  // namespace talus
