#pragma once

/// Exchange between subdomains in an iteration, and gluing: how the copies of a body come to agree.

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "kernels/global/body_problem.hpp"
#include "runtime/graph/communicator.hpp"
#include "runtime/graph/tree.hpp"
#include "runtime/step/state.hpp"
#include "runtime/trace/trace.hpp"

namespace talus {

/// Messages of one iteration, over all ranks: those between subdomains, as if each were alone on its rank,
/// and those sent between ranks.
struct MessageCount {
  std::int64_t messages = 0, bytes = 0;
  std::int64_t between_ranks = 0, bytes_between_ranks = 0;
};

/// Kinetic norms at the interface: of the jumps of the copies, and of their velocities [J]; per subdomain.
struct JumpSums {
  double jump2 = 0;
  double velocity2 = 0;
};

/// Gluing of copies (Visseq et al. 2013, (12)-(15), Algorithm 1) in tasks:
///
///   tell[e]      after the chunks of subdomain e at glued walls: sends its part of the root's sums. If
///                bodies of e go through the root, publish sends this part instead
///   publish[e]   after the border chunks of subdomain e: sends its interface velocities
///   collect      on ranks with parent and children in the tree of ranks: sends up what the children sent
///   root       once a rank: sums that go through one rank (CCS; always walls of finite mass and bodies with
///                m_i >= 9, or 33 with subdomain colours, so that k copies cost O(k) messages). A cell that
///                follows a stress counts as two walls: its copies have 6 numbers
///   glue[e]      when its neighbours' velocities have arrived: copies get the mean of all (NSCDD), or add up
///                what all have gained (Schwarz); summed in order of subdomain
///
/// With alternating coupling subdomains have colours (partition/subdomain_colours.hpp). A subdomain of a
/// later colour than the first begins its boundary with
///
///   take[e]      copies of bodies that also stand in subdomains of earlier colours get the mean of the
///                copies of the latest of those colours
///
/// Its contacts at glued walls do not wait for this (distribute.cpp). At the end of an iteration all copies
/// of a body get the mean of those of its last subdomain colour. Each message is sent once, as without
/// subdomain colours: take reads those of earlier subdomain colours, glue the others.
///
/// Between subdomains of one rank messages are read from memory. The message of a body is its velocity, 6
/// numbers or 3 without rotation.
class Gluing {
 public:
  /// Keeps references.
  Gluing(StepState& state, const DecompositionSettings& settings, const graph::Communicator& ranks);
  ~Gluing();

  /// Collective, after the candidates were distributed: opens buffers and channels for these interfaces.
  void plan(bool rotation);
  /// Collective, after plan(), when the contacts are known: builds the tree of ranks and opens its channels.
  /// `contacts`: number of contacts of this rank, plus one for each of its chunks.
  void plan_tree(std::uint64_t contacts);
  const graph::Tree& tree() const { return tree_; }
  /// Collective, in every step before its sweeps: counts and lists the copies of walls and of a cell.
  void begin();

  /// False when there is nothing to glue: no tasks then.
  bool needed() const { return needed_; }
  /// Subdomains of this rank that read what e publishes; ascending, without e. They read it in their take
  /// where reads_early() is true, else in their glue.
  std::vector<SubdomainPlace> readers_here(SubdomainPlace e) const;
  bool reads_early(SubdomainPlace reader, SubdomainPlace from) const {
    return subdomain_colour(from) < subdomain_colour(reader);
  }
  int subdomain_colour(SubdomainPlace e) const;
  /// Slots of the copies that the take of e writes.
  std::span<const Slot> taken(SubdomainPlace e) const;
  /// Whether tell sends the part of a subdomain for the root; else publish does.
  bool tells(SubdomainPlace e) const;
  /// Whether this rank has parent and children in the tree of ranks, so that collect is called.
  bool collects() const;

  enum class Mode {
    fresh,     ///< velocities were made afresh from the impulses
    iterate,   ///< after a sweep
    measured,  ///< after a sweep, with the jump measured
    local,     ///< between two exchanges: glues only the copies of walls within each subdomain
    sum,       ///< used by sum_copies
  };
  /// Collective; called by one thread at a gate. Gives each copy of a shared body the sum of `field` over all
  /// its copies, in order of subdomain; likewise each copy of a wall of finite mass. `field`: per subdomain
  /// of this rank its bodies in order of slot, then those walls. w is summed only if plan() was told of
  /// rotation.
  void sum_copies(std::span<std::vector<Twist>> field);

  /// `single`: uses the velocities of sweeps in single precision (StepState::single), which travel and are
  /// added up in single precision.
  void publish(SubdomainPlace e, Mode mode, bool single = false);
  void tell(SubdomainPlace e, Mode mode);
  void collect(Mode mode);
  void root(Mode mode);
  void take(SubdomainPlace e, bool single);
  void glue(SubdomainPlace e, Mode mode, bool single = false);

  /// Brings what publish, take and glue of e read, messages of its neighbours included, into the cache of the
  /// core that calls.
  void fetch(SubdomainPlace e) const;

  const Per<SubdomainPlace, JumpSums>& jumps() const { return jumps_; }
  void forget_jumps() { jumps_.assign(jumps_.size(), {}); }
  const MessageCount& messages() const { return messages_; }
  /// Messages of one exchange: what each subdomain of this rank sends, and gets from the root, as if alone on
  /// it.
  std::vector<trace::Message> message_plan() const;
  /// Time that tasks of this rank waited for messages since begin() [s]; 0 with one rank.
  double exposed() const;

 private:
  struct Side;
  struct Subdomain;
  struct Root;
  struct RootTraffic;
  std::size_t vectors() const;
  std::int64_t copies_everywhere(std::size_t g) const;
  double* copy_of(std::size_t g, ChunkId chunk);
  void plan_sides(SubdomainPlace e);
  void plan_copies(SubdomainPlace e);
  std::span<const CopySource> copies_of(SubdomainPlace e, std::size_t s) const;
  int subdomain_colour_of(SubdomainPlace e, const CopySource& copy) const;
  int latest_colour(SubdomainPlace e, std::size_t s, int before) const;
  void count_messages();
  RootTraffic gather_traffic() const;
  std::vector<std::int64_t> items_below(const RootTraffic& traffic, int top) const;
  void plan_parts(const RootTraffic& traffic);
  void open_links(const RootTraffic& traffic);
  void find_contributions(const RootTraffic& traffic);
  template <class Which>
  void await_messages(SubdomainPlace e, const Which& which);
  template <class Which>
  void ask_for_messages(SubdomainPlace e, const Which& which);
  template <std::size_t Width, class Record>
  auto add_copies(SubdomainPlace e, std::size_t s, int before, std::span<const Record> velocity) const;
  void send_up();
  void await_children();
  void answer();
  template <class Work>
  void with_bodies(bool single, const Work& work);
  template <std::size_t Width, class Record>
  void publish_bodies(SubdomainPlace e, std::span<const Record> velocity);
  template <std::size_t Width, class Record>
  void take_bodies(SubdomainPlace e, std::span<Record> velocity);
  template <std::size_t Width, class Record>
  void glue_bodies(SubdomainPlace e, Mode mode, std::span<Record> velocity);

  StepState& state_;
  const DecompositionSettings& settings_;
  const graph::Communicator& ranks_;
  bool needed_ = false;
  std::size_t width_ = 6;            ///< numbers per body
  std::vector<std::int32_t> walls_;  ///< of finite mass
  Per<SubdomainPlace, Subdomain> subdomains_;
  graph::Tree tree_;
  std::unique_ptr<Root> root_;
  Per<SubdomainPlace, JumpSums> jumps_;
  MessageCount messages_;
  std::vector<Velocity> kept_;  ///< what sum_copies puts back into the velocities
};

}  // namespace talus
