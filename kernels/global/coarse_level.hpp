#pragma once

/// The coarse level of the solver in body space: groups of bodies that move as rigid ones.

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <cstdint>
#include <span>
#include <vector>

#include "kernels/global/body_parts.hpp"

namespace talus {

/// Which body belongs to which aggregate of its part. Walls, bodies that count elsewhere, and bodies without
/// contacts belong to none (-1): a wall is a coarse unknown of its own, and a body without contacts needs
/// none.
struct Aggregates {
  std::vector<std::int32_t> of_body;
  std::int32_t count = 0;
};

/// Grows connected groups of about `target` grains over the contacts of a part, from the lowest body that has
/// none; what is left over and small joins a neighbour. `touched` per unknown: it has contacts, in any part.
/// Depends on the order of bodies and contacts alone.
Aggregates grow_aggregates(const BodyProblem& problem, std::span<const char> touched, int target);

/// A sensible `target` for so many bodies in all parts: 16 in small problems, so that a chain becomes several
/// aggregates; up to 256 in large ones, where the coarse factorisation would cost more than it saves; and
/// more beyond half a million, so that what every process holds of the coarse level stays bounded.
int aggregate_target(std::size_t bodies);

/// P^T A P and its factor, P the six rigid motions of each aggregate and the one of each wall: a correction
/// that sweeps would carry through thousands of contacts takes one coarse solve. Aggregates rotate even where
/// single bodies do not. Every process gathers and factorises all of it, some thousand numbers: about 300
/// bytes for each pair of aggregates that touch, and as much again for the factor times its fill.
class CoarseLevel {
 public:
  /// Keeps a reference to `parts`. `touched` and `rho` [kg] per part.
  CoarseLevel(const BodyParts& parts, std::span<const std::vector<char>> touched,
              std::span<const std::vector<double>> rho, int target);

  /// x += P (P^T A P)^-1 P^T f, f a part of a sum over copies; x is the same for all of them.
  void correct(const PartField& f, PartField& x) const;

  Eigen::Index size() const { return size_; }

 private:
  /// How a body moves with its aggregate.
  struct Member {
    std::int32_t group = -1;  ///< of all parts; -1: none
    std::int32_t local = -1;  ///< place of the group in the list of its part
    Vec3 arm;                 ///< from the aggregate's centre [m]
    double length = 0;        ///< [m]: rotations are counted in length x angle
  };
  struct Block;
  class BlockMap;
  using ContactMotion = Eigen::Matrix<double, 3, 6>;
  void join(std::span<const std::vector<char>> touched, int target);
  void list_groups();
  ContactMotion contact_motion(std::size_t part, const ContactEquation& c, bool is_first) const;
  std::vector<Block> blocks_of(std::size_t part, std::span<const double> rho) const;
  void factorise(std::span<const std::vector<double>> rho);
  Eigen::Index first(std::int64_t group) const {
    return static_cast<Eigen::Index>(group < aggregates_ ? 6 * group : 5 * aggregates_ + group);
  }

  const BodyParts& parts_;
  std::int64_t aggregates_ = 0, walls_ = 0;  ///< all
  Eigen::Index size_ = 0;
  std::vector<std::vector<Member>> members_;       ///< per part and unknown
  std::vector<std::vector<std::int32_t>> groups_;  ///< per part here: aggregates it knows, ascending
  std::vector<double> groups_of_all_;              ///< the same of all parts, as rows that -1 fills up
  std::size_t most_ = 0;                           ///< length of those rows
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver_;
};

}  // namespace talus
