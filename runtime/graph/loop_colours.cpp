#include <algorithm>
#include <array>

#include "runtime/graph/loop_plan.hpp"

namespace talus::graph {

namespace {

/// Phases of an epoch, in their order. The phase of groups of colour t is first_colour + t.
enum Phase : std::uint32_t {
  telling,
  inside_of_later,
  first_colour,
  early_glue = 1000,
  inside_of_first,
  last_glue
};

/// Parts of a group, in their order within a phase.
enum Part : std::uint32_t { early, tell, inner, take, border, publish, inner_behind };

/// Sort key of a node: phase, group, part, colour within the part. Nodes run in ascending order of it.
using Position = std::array<std::uint32_t, 4>;

std::vector<Position> sorted(std::vector<Position> positions) {
  std::sort(positions.begin(), positions.end());
  positions.erase(std::unique(positions.begin(), positions.end()), positions.end());
  return positions;
}

std::uint32_t rank_in(const std::vector<Position>& order, const Position& position) {
  return static_cast<std::uint32_t>(std::lower_bound(order.begin(), order.end(), position) - order.begin());
}

/// Lets groups run side by side: removes the group from the keys, and counts the colours of each part of each
/// group from 0 without gaps.
void go_abreast(std::vector<Position>& positions) {
  const std::vector<Position> order = sorted(positions);
  for (Position& position : positions)
    position = {position[0], 0, position[2],
                rank_in(order, position) - rank_in(order, {position[0], position[1], position[2], 0})};
}

/// Sort keys of the nodes of a rank.
class Positions {
 public:
  Positions(const LoopSpec& spec, bool alone) : spec_(spec), alone_(alone) {
    const bool later = std::ranges::any_of(spec.groups, [](const LoopGroup& g) { return g.colour > 0; });
    // The inside of a group directly follows its border, while the group is in the cache. The exception is a
    // rank that only has groups of the first colour: other ranks wait for all its publishes.
    const bool whole = spec.overlap && spec.threads == 1 && (alone || later || !spec.in_colours);
    behind_ = whole ? first_colour : inside_of_first;
  }

  Position of(std::uint32_t group, Part part, std::uint32_t colour) const {
    return {phase_of(colour_of(group), part), group, part, colour};
  }
  Position of(const LoopWork& work) const { return of(work.group, part_of(work), work.colour); }

 private:
  std::uint32_t colour_of(std::uint32_t group) const {
    return static_cast<std::uint32_t>(spec_.groups[group].colour);
  }
  Part part_of(const LoopWork& work) const {
    if (work.side == LoopWork::inside) return colour_of(work.group) == 0 ? inner_behind : inner;
    return work.side == LoopWork::early ? early : border;
  }
  std::uint32_t phase_of(std::uint32_t colour, Part part) const {
    if (part == inner_behind) return behind_;
    if (part <= tell && !alone_) return telling;
    return colour > 0 && part <= inner && !spec_.overlap ? inside_of_later : first_colour + colour;
  }

  const LoopSpec& spec_;
  bool alone_;
  Phase behind_;
};

}  // namespace

LoopColours loop_colours(const LoopSpec& spec, const Tree& tree) {
  const Positions positions(spec, tree.order.size() == 1);
  const auto groups = static_cast<std::uint32_t>(spec.groups.size());
  std::vector<Position> own;
  for (const LoopWork& work : spec.work) own.push_back(positions.of(work));
  // A group without a take or a tell reuses the colour of its publish for it.
  for (std::uint32_t e = 0; e < groups; ++e) own.push_back(positions.of(e, publish, 0));
  for (std::uint32_t e = 0; e < groups; ++e)
    own.push_back(positions.of(e, spec.groups[e].colour > 0 ? take : publish, 0));
  for (std::uint32_t e = 0; e < groups; ++e)
    own.push_back(positions.of(e, spec.groups[e].tells ? tell : publish, 0));
  if (spec.threads > 1) go_abreast(own);
  own.push_back({spec.overlap ? last_glue : early_glue, 0, 0, 0});
  const std::vector<Position> order = sorted(own);
  std::vector<std::uint32_t> colours;
  for (const Position& position : own) colours.push_back(2 * rank_in(order, position));
  const auto publish_at = colours.begin() + static_cast<std::ptrdiff_t>(spec.work.size()),
             take_at = publish_at + groups, tell_at = take_at + groups, end = tell_at + groups;
  LoopColours result{{colours.begin(), publish_at},
                     {publish_at, take_at},
                     {take_at, tell_at},
                     {tell_at, end},
                     colours.back(),
                     {}};
  const std::uint32_t last_tell = groups > 0 ? std::ranges::max(result.tell) : 0;
  result.tree = tree_colours(tree, spec.rank, last_tell, result.glue);
  for (std::uint32_t e = 0; e < groups; ++e) {
    if (spec.groups[e].colour > 0) result.tree.up = std::min(result.tree.up, result.take[e] - 1);
    if (spec.in_colours) result.tree.down = std::max(result.tree.down, result.publish[e] + 1);
  }
  return result;
}

}  // namespace talus::graph
