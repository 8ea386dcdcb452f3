#include "partition/detail/bisection.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "kernels/bodies/index.hpp"

namespace talus::detail {

namespace {

/// A median is found by radix selection. A round settles a few of the 63 bits of a key: one histogram per
/// open node and one sum over the ranks, all histograms together of at most 512 numbers or 8 per node. A
/// round with a short sum takes the latency of an all-reduction, so few nodes settle 9 bits at a time. With
/// many nodes such histograms would make the sum long: where 32 ranks share a link, it would take twenty
/// times the latency.
constexpr int key_bits = 3 * IntegerFrame::bits;
constexpr int most_bits = 9, least_bits = 3;
int bits_of_a_round(std::size_t histograms) {
  return std::max(least_bits, most_bits - static_cast<int>(std::bit_width(histograms - 1)));
}

/// Moments are taken of the upper 16 bits of a coordinate: with weights below 2^31 in all, sums of squares
/// stay below 2^63.
constexpr int moment_shift = IntegerFrame::bits - 16;

/// A set of points still to be divided; it becomes one cut of the tree.
struct Node {
  std::int32_t first;                 ///< subdomain
  std::int32_t parts;                 ///< subdomains first .. first + parts - 1; > 1
  std::array<std::int32_t, 3> boxes;  ///< what is left to cut per axis; unused by recursive bisection
  std::int32_t cut;                   ///< its place in the tree
  std::int32_t axis = 0;
  std::int32_t parts_below = 0;

  // Selection of the key; the weight below `prefix` is known, the median is among the keys that begin with
  // it.
  bool open = true;
  std::uint64_t prefix = 0;
  std::int64_t below = 0;
  std::int64_t total = 0;
};

/// One level of the tree at a time, all nodes of a level together, so that ranks meet a number of times that
/// grows with the depth and not with the number of subdomains.
class Bisection {
 public:
  Bisection(const WeightedPoints& points, const Reduction& reduction)
      : points_(points), reduction_(reduction), node_(points.q.size(), 0) {}

  /// `split(node, k)` sets axis and parts_below of level node k.
  template <class Split>
  CutTree run(const Node& root, Split&& split) {
    if (root.parts > 1) {
      level_.assign(1, root);
      tree_.cuts.push_back({});
    }
    while (!level_.empty()) {
      split(level_);
      select_keys();
      descend();
    }
    return std::move(tree_);
  }

  /// Per node of the level: sum of weights, then of weight x coordinate and weight x coordinate^2 per axis.
  std::vector<std::int64_t> moments(const std::vector<Node>& level) const {
    std::vector<std::int64_t> sums(7 * level.size(), 0);
    for (std::size_t k = 0; k < points_.q.size(); ++k) {
      if (node_[k] < 0) continue;
      std::int64_t* sum = &sums[7 * at(node_[k])];
      const std::int64_t weight = points_.weight_of(k);
      sum[0] += weight;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::int64_t q = points_.q[k][axis] >> moment_shift;
        sum[1 + axis] += weight * q;
        sum[4 + axis] += weight * q * q;
      }
    }
    reduction_.sum(sums);
    return sums;
  }

  const CutTree& tree() const { return tree_; }

 private:
  void select_keys() {
    std::vector<std::size_t> among;  // points that the median of their node may still be next to
    for (std::size_t k = 0; k < node_.size(); ++k)
      if (node_[k] >= 0) among.push_back(k);
    for (int shift = key_bits; shift > 0;) {
      std::vector<std::size_t> histogram;  // of each level node; of one that is closed nobody's
      std::size_t histograms = 0;
      for (const Node& node : level_) histogram.push_back(node.open ? histograms++ : histograms);
      if (histograms == 0) return;
      const int bits = std::min(shift, bits_of_a_round(histograms));
      const std::size_t bins = std::size_t{1} << bits;
      shift -= bits;
      std::vector<std::int64_t> counts(bins * histograms, 0);
      for (const std::size_t k : among) {
        const std::size_t node = at(node_[k]);
        const std::uint64_t leading = cut_key(points_.q[k], level_[node].axis) >> shift;
        counts[bins * histogram[node] + (leading & (bins - 1))] += points_.weight_of(k);
      }
      reduction_.sum(counts);
      for (std::size_t k = 0; k < level_.size(); ++k)
        if (level_[k].open) narrow(level_[k], std::span(counts).subspan(bins * histogram[k], bins), shift);
      std::erase_if(among, [&](std::size_t k) {
        const Node& node = level_[at(node_[k])];
        return !node.open || cut_key(points_.q[k], node.axis) >> shift != node.prefix;
      });
    }
  }

  /// Narrows the selection to the bin in which the wanted share of the weight is passed. Closes the node, its
  /// key then in `prefix`, when a border of the bin is near enough.
  void narrow(Node& node, std::span<const std::int64_t> counts, int shift) {
    const auto bits = std::countr_zero(counts.size());
    if (shift + bits == key_bits)
      for (std::int64_t count : counts) node.total += count;
    // Shares are compared as below x parts against total x parts_below: integers, no rounding; weights stay
    // below 2^31 and so do parts.
    const std::int64_t wanted = node.total * node.parts_below;
    std::size_t bin = 0;
    while (bin + 1 < counts.size() && (node.below + counts[bin]) * node.parts <= wanted)
      node.below += counts[bin++];
    node.prefix = node.prefix << bits | bin;
    const std::int64_t short_of = wanted - node.below * node.parts;
    const std::int64_t too_many = (node.below + counts[bin]) * node.parts - wanted;
    // A cut may miss the wanted weight by half of the heaviest point; shift 0 means that one key is left.
    if (2 * std::min(short_of, too_many) > points_.heaviest * node.parts && shift > 0) return;
    node.open = false;
    node.prefix += too_many < short_of ? 1 : 0;
    node.prefix <<= shift;
  }

  /// Writes the cuts, moves the points to the nodes of the next level, or to leaves.
  void descend() {
    std::vector<Node> next;
    std::vector<std::array<std::int32_t, 2>> child(level_.size());  // node of the next level, or -1
    for (std::size_t k = 0; k < level_.size(); ++k) {
      const Node& node = level_[k];
      CutTree::Cut& cut = tree_.cuts[at(node.cut)];
      cut.axis = node.axis;
      cut.key = node.prefix;
      const std::array<std::int32_t, 2> parts{node.parts_below, node.parts - node.parts_below};
      std::array<std::int32_t, 2> to{};
      for (std::size_t side = 0; side < 2; ++side) {
        Node half{node.first + (side == 0 ? 0 : parts[0]), parts[side], node.boxes,
                  static_cast<std::int32_t>(tree_.cuts.size() + next.size())};
        const auto axis = at(node.axis);
        const std::int32_t across = node.boxes[axis];
        if (across > 1) half.boxes[axis] = side == 0 ? across / 2 : across - across / 2;
        child[k][side] = -1;
        to[side] = -1 - half.first;
        if (half.parts == 1) continue;
        child[k][side] = static_cast<std::int32_t>(next.size());
        to[side] = half.cut;
        next.push_back(half);
      }
      cut.below = to[0];
      cut.above = to[1];
    }
    tree_.cuts.resize(tree_.cuts.size() + next.size());
    for (std::size_t k = 0; k < points_.q.size(); ++k) {
      if (node_[k] < 0) continue;
      const Node& node = level_[at(node_[k])];
      node_[k] = child[at(node_[k])][cut_key(points_.q[k], node.axis) < node.prefix ? 0 : 1];
    }
    level_ = std::move(next);
  }

  const WeightedPoints& points_;
  const Reduction& reduction_;
  std::vector<std::int32_t> node_;  // per point: node of the level, -1 once in a leaf
  std::vector<Node> level_;
  CutTree tree_;
};

/// The first axis along which boxes are left to cut, and half of them.
void split_boxes(Node& node) {
  node.axis = 0;
  while (node.axis < 2 && node.boxes[at(node.axis)] == 1) ++node.axis;
  const std::int32_t across = node.boxes[at(node.axis)];
  node.parts_below = node.parts / across * (across / 2);
}

}  // namespace

std::uint64_t cut_key(const Coordinates& q, std::int32_t axis) {
  const auto k = at(axis);
  return std::uint64_t{q[k]} << 2 * IntegerFrame::bits | std::uint64_t{q[(k + 1) % 3]} << IntegerFrame::bits |
         q[(k + 2) % 3];
}

CutTree regular_boxes(const std::array<std::int32_t, 3>& boxes) {
  CutTree tree;
  struct Block {
    std::array<std::int32_t, 3> low, size;
    std::int32_t first;
  };
  std::vector<Block> blocks;  // of cut k
  const auto child = [&](const Block& block) {
    const std::int32_t parts = block.size[0] * block.size[1] * block.size[2];
    if (parts == 1) return -1 - block.first;
    blocks.push_back(block);
    return static_cast<std::int32_t>(blocks.size() - 1);
  };
  child({{0, 0, 0}, boxes, 0});
  for (std::size_t k = 0; k < blocks.size(); ++k) {
    const Block block = blocks[k];
    std::size_t axis = 0;
    while (block.size[axis] == 1) ++axis;
    Block below = block, above = block;
    below.size[axis] = block.size[axis] / 2;
    above.size[axis] = block.size[axis] - below.size[axis];
    above.low[axis] = block.low[axis] + below.size[axis];
    above.first = block.first + below.size[0] * below.size[1] * below.size[2];
    const auto plane = static_cast<std::uint64_t>(IntegerFrame::steps * above.low[axis] / boxes[axis]);
    const std::int32_t low = child(below), high = child(above);
    tree.cuts.push_back({static_cast<std::int32_t>(axis), plane << 2 * IntegerFrame::bits, low, high});
  }
  return tree;
}

CutTree fitted_boxes(const WeightedPoints& points, const std::array<std::int32_t, 3>& boxes,
                     const Reduction& reduction) {
  Bisection bisection(points, reduction);
  return bisection.run(Node{0, boxes[0] * boxes[1] * boxes[2], boxes, 0}, [](std::vector<Node>& level) {
    for (Node& node : level) split_boxes(node);
  });
}

CutTree recursive_bisection(const WeightedPoints& points, std::int32_t n, const IntegerFrame& frame,
                            const CutTree* previous, const Reduction& reduction) {
  Bisection bisection(points, reduction);
  return bisection.run(Node{0, n, {1, 1, 1}, 0}, [&](std::vector<Node>& level) {
    const std::vector<std::int64_t> sums = bisection.moments(level);
    for (std::size_t k = 0; k < level.size(); ++k) {
      const auto* sum = &sums[7 * k];
      Vec3 variance = Vec3::Zero();
      for (std::size_t axis = 0; axis < 3 && sum[0] > 0; ++axis) {
        const auto index = static_cast<Eigen::Index>(axis);
        const double weight = static_cast<double>(sum[0]);
        const double mean = static_cast<double>(sum[1 + axis]) / weight;
        const double steps = static_cast<double>(sum[4 + axis]) / weight - mean * mean;
        variance[index] = steps * frame.lengths[index] * frame.lengths[index];
      }
      Node& node = level[k];
      node.parts_below = node.parts / 2;
      node.axis = 0;  // of equal ones the first
      for (std::int32_t axis = 1; axis < 3; ++axis)
        if (variance[axis] > variance[node.axis]) node.axis = axis;
      if (previous == nullptr) continue;
      // Both trees have the same shape: it depends on n alone.
      const std::int32_t before = previous->cuts[at(node.cut)].axis;
      if (variance[before] >= 0.81 * variance[node.axis]) node.axis = before;
    }
  });
}

std::int32_t leaf_of(const CutTree& tree, const Coordinates& q) {
  if (tree.cuts.empty()) return 0;
  std::int32_t k = 0;
  while (k >= 0) {
    const CutTree::Cut& cut = tree.cuts[at(k)];
    // The two other coordinates only tell points of the very plane of the cut apart.
    const std::uint64_t along = q[at(cut.axis)], plane = cut.key >> (2 * IntegerFrame::bits);
    const bool below = along != plane ? along < plane : cut_key(q, cut.axis) < cut.key;
    k = below ? cut.below : cut.above;
  }
  return -1 - k;
}

}  // namespace talus::detail
