#pragma once

/// The numbers that describe how the bodies of a cluster move: 3 of a grain, 6 where it turns, 1 of a wall.

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

#include "kernels/global/body_problem.hpp"

namespace talus {

/// Freedoms of the unknowns of a problem, one after the other. The problem must outlive this.
class Freedoms {
 public:
  explicit Freedoms(const BodyProblem& problem);

  Eigen::Index size() const { return begin_.back(); }  ///< of all
  std::size_t bodies() const { return begin_.size() - 1; }
  Eigen::Index begin(std::size_t body) const { return begin_[body]; }
  Eigen::Index count(std::size_t body) const { return begin_[body + 1] - begin_[body]; }

  /// Mass of each freedom [kg].
  Eigen::VectorXd masses() const;
  Eigen::VectorXd of(std::span<const Twist> twists) const;
  std::vector<Twist> twists(const Eigen::VectorXd& x) const;

  /// What a force along `direction` at a contact does to one of its bodies: so many numbers as it has
  /// freedoms, the first of them at `begin`.
  struct Part {
    Eigen::Index begin = 0, count = 0;
    Eigen::Matrix<double, 6, 1> value = Eigen::Matrix<double, 6, 1>::Zero();
  };
  /// Of both bodies of a contact, the second empty at a driven wall.
  std::array<Part, 2> column(const ContactEquation& contact, const Vec3& direction) const;

 private:
  Part part(std::size_t body, const Twist& of) const;

  const BodyProblem& problem_;
  std::vector<Eigen::Index> begin_;  ///< per unknown, its first freedom; and the number of all
};

}  // namespace talus
