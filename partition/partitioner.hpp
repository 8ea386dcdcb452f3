#pragma once

/// Cuts space into subdomains. Candidates are dealt by the midpoints of the centres of their bodies (Visseq,
/// Alart and Dureisseix 2013, section 3.1): a subdomain is a region, and holds the candidates whose point is
/// in it. What a partitioner returns is a description of the regions, small enough for every rank to keep, so
/// that a candidate found anywhere gets the same subdomain everywhere. See docs/decisions/0005-partition.md.

#include <array>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "kernels/bodies/types.hpp"
#include "kernels/detection/broad_phase.hpp"
#include "kernels/detection/chunks.hpp"
#include "kernels/detection/domain.hpp"
#include "kernels/registry.hpp"
#include "partition/frame.hpp"
#include "partition/reduction.hpp"
#include "partition/subdomain.hpp"

namespace talus {

/// A way of cutting space, known by its name in the registry (partition/partitioners.hpp). The constants are
/// those that code asks for.
class PartitionKind : public NamedKind<PartitionKind> {
 public:
  using NamedKind::NamedKind;
  static const PartitionKind automatic;  ///< "auto"
  static const PartitionKind boxes, fitted, rcb, metis;
};
inline constexpr PartitionKind PartitionKind::automatic("auto");
inline constexpr PartitionKind PartitionKind::boxes("boxes");
inline constexpr PartitionKind PartitionKind::fitted("fitted");
inline constexpr PartitionKind PartitionKind::rcb("rcb");
inline constexpr PartitionKind PartitionKind::metis("metis");

/// Whether the partitioner cuts a grid of boxes, whose numbers per axis may be given.
bool cuts_boxes(PartitionKind kind);

/// The name in the registry; `partition_kind` throws std::invalid_argument naming those there are.
std::string_view name_of(PartitionKind kind);
PartitionKind partition_kind(std::string_view name);

/// The points of this rank; all ranks together hold every candidate exactly once.
struct PartitionPoints {
  std::vector<Vec3> x;     ///< midpoint of the centres; at a wall, the grain's centre [m]
  std::vector<Vec3> half;  ///< from the midpoint to one of the centres [m]; 0 at a wall. May be empty
                           ///< where the partitioner does not read it (Partitioner::reads_halves)
  std::vector<std::int32_t> weight;  ///< >= 0; empty: all 1. All ranks together: below 2^31
};

/// Points of candidates in their order: grain pairs, then wall pairs. `x` are the centres [m]; unit weights.
PartitionPoints candidate_points(std::span<const Vec3> x, std::span<const GrainPair> grain_pairs,
                                 std::span<const WallPair> wall_pairs, const Domain& domain = {});

/// Binary tree of cuts, root first. A cut compares keys: the integer coordinate along `axis`, then those of
/// the two axes that follow cyclically, so that even points of one plane of a lattice can be divided.
struct CutTree {
  struct Cut {
    std::int32_t axis;
    std::uint64_t key;   ///< points with a smaller key go `below`, all others `above`
    std::int32_t below;  ///< index of a cut, or -1 - subdomain
    std::int32_t above;
  };
  std::vector<Cut> cuts;  ///< subdomains - 1 of them
};

/// A grid of equal cells over the frame, each with its subdomain.
struct CellTable {
  std::array<std::int32_t, 3> cells{};  ///< per axis
  std::vector<std::int32_t> subdomain;  ///< number per cell, x fastest

  std::size_t cell_of(const std::array<std::uint32_t, 3>& q) const {
    std::array<std::size_t, 3> c;
    for (std::size_t k = 0; k < 3; ++k)
      c[k] = static_cast<std::size_t>(std::uint64_t{q[k]} * static_cast<std::uint64_t>(cells[k]) >>
                                      IntegerFrame::bits);
    return c[0] + static_cast<std::size_t>(cells[0]) * (c[1] + static_cast<std::size_t>(cells[1]) * c[2]);
  }
};

/// The regions. A value: copy it, store it in a checkpoint, compare it.
struct Partition {
  std::int32_t subdomains = 1;
  PartitionKind kind = PartitionKind::boxes;  ///< never `automatic`
  IntegerFrame frame;
  CutTree tree;     ///< of partitioners that cut along planes
  CellTable table;  ///< of partitioners that deal out cells; else empty

  bool by_table() const { return !table.subdomain.empty(); }
  /// Subdomain 0 .. subdomains - 1 of a finite point [m], inside or outside the box of the sample.
  SubdomainId subdomain_of(const Vec3& point) const;
};

struct PartitionOptions {
  PartitionKind kind = PartitionKind::automatic;
  std::int32_t subdomains = 1;
  /// Boxes per axis for `boxes` and `fitted`; their product is `subdomains`. Zeros: of all factorisations,
  /// the one with the least area of cuts in the box of the sample.
  std::array<std::int32_t, 3> boxes{};
  double auto_imbalance = 0.02;  ///< imbalance (heaviest box over the mean, less 1) up to which boxes stay
  /// The partition in force, or nullptr. `rcb` then keeps its axes while the spreads allow it, and `metis`
  /// gives a new region the number of the old one it overlaps most, so that fewer bodies migrate.
  const Partition* previous = nullptr;
  Domain domain = {};  ///< that the points stand in: `metis` ties regions across the faces of a periodic cell
};

/// Collective over the ranks of `reduction`. The result is the same for any order of the points and any way
/// of dealing them to ranks. No rank sees the points of another: ranks add up histograms or cells. Subdomains
/// may come out empty: with fewer points than subdomains they must. Cost for P points and N subdomains on a
/// rank: boxes P; rcb, fitted about 4 P log2 N and as many histograms of 512 N integers; metis P and one sum
/// over 14 x cells (below 2^18), then METIS on the cells. Throws std::invalid_argument if subdomains < 1, the
/// boxes' product is not `subdomains`, a weight is negative, their sum reaches 2^31, or a point is not
/// finite.
Partition make_partition(const PartitionPoints& points, const PartitionOptions& options,
                         const Reduction& reduction = {});

/// Subdomain of every point, in order.
std::vector<SubdomainId> subdomains_of(const Partition& partition, std::span<const Vec3> points);

/// Weight per subdomain over all ranks. The heaviest over the mean decides when to partition anew.
std::vector<std::int64_t> weight_per_subdomain(const Partition& partition, const PartitionPoints& points,
                                               const Reduction& reduction = {});
/// Largest entry over the mean entry, less 1; 0 when all are 0.
double imbalance(std::span<const std::int64_t> weights);

/// n_x x n_y x n_z = n with the least area of inner planes in a box of these lengths [m]; of equal ones the
/// first in lexicographic order.
std::array<std::int32_t, 3> box_factors(std::int32_t n, const Vec3& lengths);

std::size_t memory_used(const Partition& partition);

}  // namespace talus
