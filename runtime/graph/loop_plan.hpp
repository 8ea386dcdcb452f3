#pragma once

/// The nodes of one rank's loop: which there are, what each does and for whom, when, on which thread, and
/// which conflict. Whoever runs, records, plays or checks the loop asks here.
///
/// Work comes in groups. Those of different groups share no data but by exchange: in each epoch a group
/// publishes what others read, and takes in what others have published. Example, two groups on a rank of one
/// thread, the second of the second group colour, and its place in the tree of ranks is a leaf:
///
///   node     0 1 2    3 4 5    6         7         8      9       10      11
///   does     work     work     publish   publish   root   glue    glue    take
///   group    0 0 0    1 1 1    0         1         -      0       1       1

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "runtime/graph/epoch_graph.hpp"
#include "runtime/graph/tree.hpp"

namespace talus::graph {

/// What a node does in an epoch.
enum class LoopRole : std::uint8_t {
  work,     ///< on the data of its group
  publish,  ///< what other groups read of a group leaves
  collect,  ///< of a rank between the top and the leaves of the tree of ranks: what came from below goes up
  root,     ///< of a rank: what goes through one rank, and comes back from it
  glue,     ///< of a group: takes what others published that no take has taken
  take,     ///< of a group of a later colour: takes what groups of earlier colours published
  tell,     ///< of a group: its part for the root leaves; where there is none, its publish does that
};

/// A node of work, by what decides when and where it runs.
struct LoopWork {
  enum Side {
    early,   ///< before tell
    border,  ///< of a group of the first colour: others read what it writes
    inside,  ///< nobody of another group reads what it writes
    late,    ///< the border of a group of a later colour
  } side;
  std::uint32_t group;       ///< index into LoopSpec::groups
  std::uint32_t colour;      ///< counts within its side of its group, whatever it begins with
  std::uint32_t weight = 0;  ///< expected work
  std::uint32_t place = 0;   ///< order within its group in which neighbours are near
};

struct LoopGroup {
  char colour = 0;        ///< groups of one colour exchange nothing with one another within an epoch
  bool exchanges = true;  ///< it has publish and glue
  bool tells = false;     ///< it has a tell
  std::vector<std::uint32_t> readers;  ///< groups of this rank that read what it publishes
};

/// What the loop of a rank is planned from.
struct LoopSpec {
  std::vector<LoopGroup> groups;
  std::vector<LoopWork> work;
  /// Conflicts within the work, as in Conflicts: work + 1 offsets. May be empty if only colours are wanted.
  std::vector<std::uint32_t> offset, neighbour;
  bool in_colours = false;                   ///< some group of any rank has a later colour than the first
  bool overlap = true;                       ///< messages travel while insides are worked on
  bool collects = false;                     ///< the rank hands on what others tell the root
  bool only_first_thread_exchanges = false;  ///< others must not send or receive
  int threads = 1, rank = 0;
};

/// Colours of the nodes: even ones, without gaps; odd ones are left to what the tree of ranks does: between
/// the last tell and glue (tree.hpp), but what goes up before the first take, and what goes down behind every
/// publish, where there are group colours.
struct LoopColours {
  std::vector<std::uint32_t> work;     ///< as it was given
  std::vector<std::uint32_t> publish;  ///< per group, behind its border
  std::vector<std::uint32_t> take;     ///< per group, before its border; means nothing in the first colour
  std::vector<std::uint32_t> tell;     ///< per group: when it tells the root
  std::uint32_t glue = 0;              ///< behind everything, or before all insides without overlap
  TreeColours tree;                    ///< of what the rank does for the tree of ranks
};

/// Of each group early work, tell, the border, publish, the inside; glue. A rank of one thread does all this
/// but the gluing for one group after another, so that it stays with one while that is in the cache. Threads
/// go through all of them colour by colour: two may have parts of one group, and the one that comes to it
/// late would keep the other waiting. As groups share no data, the order among them changes no bit.
///
/// Where there are other ranks, what is early of all and tell come first. Where groups have colours, those of
/// the first come next, then those of each later colour with the inside, take, the late border and publish:
/// each hides the messages of the others. Threads, and a rank that has groups of the first colour only, leave
/// their inside to the end. A rank alone has nothing to hide, and stays with each group.
///
/// Nobody waits for ever: a tell waits for no message, what goes up the tree of ranks for tells, a take of
/// colour t for publishes of colours before t, and all these stand before what waits for more: up before
/// take, take of colour t before that of t + 1, and down, which above may stand behind takes, behind every
/// publish. A publish where nothing has colours waits for nobody, nor down but for ups.
LoopColours loop_colours(const LoopSpec& spec, const Tree& tree);

/// A loop as it is run. Nodes are numbered: the work as it was given, publish of every group, collect, the
/// root, glue of every group, take of those of later colours, tell of those that have one. n nodes.
struct LoopPlan {
  static constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();
  struct Node {
    LoopRole role = LoopRole::work;
    std::uint32_t group = none;  ///< index into LoopSpec::groups; none of collect and root
  };
  std::vector<Node> nodes;
  std::vector<std::uint32_t> colour;             ///< n
  std::vector<std::uint32_t> owner;              ///< n: thread
  std::vector<std::uint32_t> offset, neighbour;  ///< n + 1; conflicting nodes, symmetric

  Conflicts conflicts() const { return {colour, offset, neighbour}; }
};

/// Cost: the work sorted once, and every conflict.
LoopPlan plan_loop(const LoopSpec& spec, const Tree& tree);

}  // namespace talus::graph
