#pragma once

/// What subdomains tell one another in an iteration, and how copies come to agree.

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

/// Messages of one iteration, all ranks: between subdomains (each as if alone on its rank), and those that
/// leave a rank.
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
///   tell[e]      after the chunks of subdomain e at glued walls: its part for the root leaves; of one with
///                bodies that go through the root this is done by publish
///   publish[e]   after the border chunks of subdomain e: its interface velocities leave
///   collect      on ranks between the top and the leaves of the tree of ranks: what came from below goes up
///   root       once a rank: what goes through one rank (CCS; always walls of finite mass and bodies with
///                m_i >= 9, or 33 with subdomain colours, so that k copies cost O(k) messages). A cell that
///                follows a stress counts as two walls: its copies have 6 numbers
///   glue[e]      when its neighbours' velocities are there: copies get the mean of all (NSCDD), or add up
///                what all have gained (Schwarz); summed in order of subdomain
///
/// Alternating, subdomains have colours (partition/subdomain_colours.hpp). One whose subdomain colour is not
/// the first begins its boundary with
///
///   take[e]      copies of bodies that stand in subdomains of earlier colours, too, get the mean of the
///                latest of those
///
/// Contacts at glued walls that it has wait for nobody (distribute.cpp). In the end all copies of a body get
/// the mean of those of its last subdomain colour. Each message is sent once, as without subdomain colours: a
/// take reads those of earlier subdomain colours, glue the others.
///
/// Between subdomains of one rank the messages are memory. A body sends its velocity, 6 numbers or 3 without
/// rotation.
class Gluing {
 public:
  /// Keeps references.
  Gluing(StepState& state, const DecompositionSettings& settings, const graph::Communicator& ranks);
  ~Gluing();

  /// Collective, after the candidates were distributed: buffers and channels for these interfaces.
  void plan(bool rotation);
  /// Collective, behind plan(), when the contacts are known: the tree of ranks, and its channels. `contacts`:
  /// of this rank, and one for each of its chunks.
  void plan_tree(std::uint64_t contacts);
  const graph::Tree& tree() const { return tree_; }
  /// Collective, in every step before its sweeps: the copies of the walls.
  void begin();

  /// False when there is nothing to glue: no tasks then.
  bool needed() const { return needed_; }
  /// Subdomains here that read what e publishes; ascending, without e. They do so in
  /// their take where reads_early() is true, else in their glue.
  std::vector<SubdomainPlace> readers_here(SubdomainPlace e) const;
  bool reads_early(SubdomainPlace reader, SubdomainPlace from) const {
    return subdomain_colour(from) < subdomain_colour(reader);
  }
  int subdomain_colour(SubdomainPlace e) const;
  /// Slots of the copies that its take writes.
  std::span<const Slot> taken(SubdomainPlace e) const;
  /// The part of a subdomain for the root leaves with its tell; else with its publish.
  bool tells(SubdomainPlace e) const;
  /// This rank stands between the top and the leaves of the tree of ranks, so that collect is called.
  bool collects() const;

  enum class Mode {
    fresh,     ///< velocities were made afresh from the impulses
    iterate,   ///< after a sweep
    measured,  ///< after a sweep, with the jump measured
    local,     ///< between two exchanges: only the walls' copies of each subdomain
    sum,       ///< of sum_copies
  };
  /// A gate's thread alone, collective: each copy of a shared body gets the sum of what `field` has for all
  /// copies, in order of subdomain; likewise each copy of a wall of finite mass. Per subdomain here its
  /// bodies in order of slot, then those walls; w is summed only if plan() was told of rotation.
  void sum_copies(std::span<std::vector<Twist>> field);

  /// `single`: of the velocities that sweeps in single precision work on (StepState::single), which travel
  /// and are added up as they are.
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
  /// What each subdomain here sends, and gets from the root, as if alone on its rank; of an exchange.
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
  std::vector<Velocity> kept_;  ///< by sum_copies
};

}  // namespace talus
