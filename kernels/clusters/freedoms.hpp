#pragma once

/// The numbers that describe how the bodies of a cluster move: 3 of a grain, 6 where it turns, 1 of a wall, 6
/// of a cell that follows a stress.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kernels/global/body_problem.hpp"

namespace talus {

/// Freedoms of the unknowns of a problem, one after the other, in blocks: one of each body, and of a cell,
/// which stands last, its stretches and its shears. The problem must outlive this.
class Freedoms {
 public:
  explicit Freedoms(const BodyProblem& problem);

  Eigen::Index size() const { return begin_.back(); }  ///< of all
  std::size_t blocks() const { return begin_.size() - 1; }
  Eigen::Index begin(std::size_t block) const { return begin_[block]; }
  Eigen::Index count(std::size_t block) const { return begin_[block + 1] - begin_[block]; }

  /// Mass of each freedom [kg].
  Eigen::VectorXd masses() const;
  Eigen::VectorXd of(std::span<const Twist> twists) const;
  std::vector<Twist> twists(const Eigen::VectorXd& x) const;

  /// What a force along `direction` at a contact does to one block: so many numbers as that has freedoms, the
  /// first of them at `begin`. 0 where the body cannot follow.
  struct Part {
    std::int32_t block = -1;  ///< -1: the contact does not touch so many
    Eigen::Index begin = 0, count = 0;
    Eigen::Matrix<double, 6, 1> value = Eigen::Matrix<double, 6, 1>::Zero();
  };
  /// Of the blocks that a contact touches: its bodies, the second empty at a driven wall, and the cell.
  using Column = std::array<Part, 4>;
  Column column(const ContactEquation& contact, const Vec3& direction) const;
  /// The same of a moment along `axis` at contact `number`, over its radii.
  Column column_of_moment(std::size_t number, const Vec3& axis) const;

  /// visit(a, b) for each two places of a column that are not empty, also the same twice.
  template <class Visit>
  static void each_two(const Column& column, const Visit& visit) {
    for (std::size_t a = 0; a < column.size(); ++a)
      for (std::size_t b = 0; b < column.size(); ++b)
        if (column[a].block >= 0 && column[b].block >= 0) visit(a, b);
  }

 private:
  Part part(std::size_t body, const Twist& of) const;
  std::array<Part, 2> parts_of_cell(const Twist& of) const;

  const BodyProblem& problem_;
  std::vector<Eigen::Index> begin_;  ///< per block, its first freedom; and the number of all
};

}  // namespace talus
