#pragma once

/// What the parts of Gluing share: links to other ranks, what a subdomain and a rank hold.

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "kernels/bodies/index.hpp"
#include "runtime/step/gluing.hpp"
#include "runtime/trace/recorder.hpp"

namespace talus::detail {

using graph::Channel;

/// Waits for a message and adds the time to `waited`.
inline void await(Channel& channel, double& waited, trace::Recorder* trace, std::uint32_t message) {
  if (channel.done()) return;
  const trace::Span span(trace, trace::kind_receive, message);
  waited += channel.wait();
}

inline void start(Channel& channel, trace::Recorder* trace, std::uint32_t message) {
  const trace::Span span(trace, trace::kind_send, message);
  channel.start();
}

/// A message from and to another rank.
struct Link {
  std::vector<double> out, in;
  std::unique_ptr<Channel> sender, receiver;
  std::uint32_t out_name = 0, in_name = 0;  ///< of the messages, in a trace
};

/// Messages hold numbers in the precision of the sweeps, which may be single; buffers have room for doubles.
inline const std::byte* bytes_of(const std::vector<double>& buffer) {
  return std::as_bytes(std::span(buffer)).data();
}
inline std::byte* bytes_of(std::vector<double>& buffer) {
  return std::as_writable_bytes(std::span(buffer)).data();
}

/// A body, and the place of its copy in a neighbour's message.
struct Pair {
  Slot slot;
  MessagePlace place;
};

/// Subdomain colours are below the first of these; the second stands for all of them.
inline constexpr int behind_all = 1000, any_colour = behind_all + 1;

inline constexpr int root_tag = graph::Communicator::first_tag;
/// The largest tag is subdomains^2 + root_tag.
inline int tag_of(SubdomainId from, SubdomainId to, std::int32_t subdomains) {
  return root_tag + 1 + from.value() * subdomains + to.value();
}

}  // namespace talus::detail

namespace talus {

/// Exchange of a subdomain with one neighbour.
struct Gluing::Side {
  std::vector<Slot> slots;  ///< of the bodies in the message, in its order
  std::vector<detail::Pair>
      pairs;  ///< bodies of which only these two copies are of the last subdomain colour
  std::vector<detail::Pair> given;  ///< bodies of which only the neighbour's copy is
  std::vector<detail::Pair>
      taken;          ///< bodies of which only the neighbour's copy is of the colour before this one's
  detail::Link link;  ///< `in` and the channels: of neighbours on other ranks only
  const std::byte* source = nullptr;  ///< the neighbour's message to this subdomain
  int subdomain_colour = 0;           ///< of the neighbour
  SubdomainPlace local;               ///< of the neighbour; none on another rank
};

struct Gluing::Subdomain {
  std::vector<Side> sides;
  std::vector<Slot> shared;  ///< slots of `interface.shared`
  std::vector<Slot> taken;   ///< slots of `shared` that take writes
  int subdomain_colour = 0;
  bool tells = false;  ///< it has a tell
  std::vector<std::int32_t>
      corners;  ///< indices into `shared`, no hubs: bodies with more copies of the last subdomain colour
  std::vector<std::int32_t> taken_corners;  ///< likewise of the subdomain colour before this one's
  std::vector<double> base;                 ///< Schwarz: velocities after the last gluing, per shared body
  std::vector<std::vector<ChunkId>> wall_copies;  ///< per glued wall: chunks here that hold a copy
  std::vector<double> partial;                    ///< to the root: 3 per wall, then width per hub
  std::vector<std::size_t> hub_item;              ///< per hub: its place in the root's results
  double waited = 0;
};

/// The one rank through which some velocities go is the top of a tree of ranks (runtime/graph/tree.hpp). A
/// message up holds the parts of a rank's own subdomains, then its children's messages: nothing is added up
/// on the way, so that the sums on the top are the same on any ranks.
struct Gluing::Root {
  struct Contribution {
    const double* partial = nullptr;
    std::vector<std::size_t> item;  ///< per hub of the subdomain
  };
  std::vector<Contribution> contributions;  ///< the top: of every subdomain, in order
  std::vector<double> sums;  ///< 3 per wall, then width per item that this rank or one below it asks for
  std::vector<std::unique_ptr<detail::Link>> links;      ///< per child
  std::vector<std::vector<std::size_t>> items_of_child;  ///< per child: what its branch asks for
  std::atomic<std::size_t> published{0};                 ///< leaves: subdomains whose part is ready
  std::unique_ptr<detail::Link> up;                      ///< to the parent; null on the top
  double waited = 0;
};

}  // namespace talus
