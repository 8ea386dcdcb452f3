#pragma once

/// Plan of the loop of one rank: its nodes, what each does and for which group of work, its colour and
/// thread, and which nodes conflict. The code that runs, records, replays or checks the loop reads this plan.
///
/// Work comes in groups (subdomains). Groups share data only by exchange: in each epoch a group publishes
/// what other groups read, and takes in what they have published. Example: a rank of one thread with two
/// groups, the second of which has the second group colour; the rank is a leaf of the tree of ranks
/// (tree.hpp).
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
  work,     ///< works on the data of its group
  publish,  ///< sends what other groups read of its group
  collect,  ///< on a rank with parent and children in the tree of ranks: sends up what the children sent
  root,     ///< on every rank: the top rank's answer, which the top computes and others receive, goes down
  glue,     ///< of a group: takes in what others published, except what its take has taken in
  take,     ///< of a group of a later colour: takes in what groups of earlier colours published
  tell,     ///< of a group: sends its part of the top rank's sums; in a group without tell, publish does that
};

/// A node of work, with what decides when and where it runs.
struct LoopWork {
  enum Side {
    early,   ///< runs before tell
    border,  ///< in a group of the first colour: other groups read what it writes
    inside,  ///< no other group reads what it writes
    late,    ///< in a group of a later colour: other groups read what it writes
  } side;
  std::uint32_t group;       ///< index into LoopSpec::groups
  std::uint32_t colour;      ///< within its side of its group; need not begin at 0
  std::uint32_t weight = 0;  ///< expected work
  std::uint32_t place = 0;   ///< its place within its group, in an order in which neighbours are near
};

struct LoopGroup {
  char colour = 0;        ///< group colour: in an epoch, take waits for groups of earlier colours only
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
  bool in_colours = false;                   ///< some group, on any rank, has a later colour than the first
  bool overlap = true;                       ///< inside work runs while messages travel
  bool collects = false;                     ///< this rank has the node collect
  bool only_first_thread_exchanges = false;  ///< other threads must not send or receive
  int threads = 1, rank = 0;
};

/// Colours of the nodes. Nodes of groups have even colours, without gaps; collect and root, the nodes of the
/// tree of ranks, have odd ones between the last tell and glue (tree.hpp). With group colours, collect also
/// comes before every take and root after every publish.
struct LoopColours {
  std::vector<std::uint32_t> work;     ///< in the order of LoopSpec::work
  std::vector<std::uint32_t> publish;  ///< per group, after its border work
  std::vector<std::uint32_t> take;     ///< per group, before its late work; unused in the first colour
  std::vector<std::uint32_t> tell;     ///< per group; without a tell, the colour of its publish
  std::uint32_t glue = 0;              ///< last; without overlap, before the inside work of the first colour
  TreeColours tree;                    ///< of collect and root
};

/// Order of the nodes of a rank alone: for each group early work, tell, border work, publish and inside work;
/// then glue. One thread does all this but the gluing for one group after another, so that it stays with a
/// group while its data are in the cache. Several threads go through all groups side by side, colour by
/// colour: two threads may have parts of one group, and if one came to it late, the other would wait. As
/// groups share no data, the order among them changes no bit.
///
/// With several ranks, the early work and the tells of all groups come first. With group colours, the groups
/// of the first colour come next, then for each later colour the inside work, take, late work and publish of
/// its groups: the work of one colour hides the messages of another. Inside work of the first colour goes to
/// the end of the epoch if the rank has several threads, or if it has groups of the first colour only.
///
/// No deadlock: a tell waits for no message, collect waits for tells, a take of colour t waits for publishes
/// of colours before t, and root waits for the roots of ranks above, which may come after takes. On each
/// rank, what waits for more comes later: collect before the takes, the takes in order of their colours, root
/// after every publish. Without group colours a publish waits for no message, and root only for what
/// collects and tells have sent.
LoopColours loop_colours(const LoopSpec& spec, const Tree& tree);

/// The planned loop. Its n nodes are numbered: the work as it was given, publish of every group, collect, the
/// root, glue of every group, take of groups of later colours, tell of those that have one.
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

/// Cost: one sort of the work, and one pass over all conflicts.
LoopPlan plan_loop(const LoopSpec& spec, const Tree& tree);

}  // namespace talus::graph
