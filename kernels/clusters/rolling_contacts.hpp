#pragma once

/// Moments of rolling resistance (kernels/law/rolling_law.hpp) in the problem of a cluster: what they do to
/// its bodies, and where they stand in a round of Newton's method (correction.hpp).

#include <array>
#include <span>
#include <vector>

#include "kernels/global/body_problem.hpp"
#include "kernels/law/rolling_law.hpp"

namespace talus {

/// Contact k resists rolling, and one of its bodies can turn.
bool rolls(const BodyProblem& problem, std::size_t k);

/// Relative angular velocity of the first body of contact k in its tangent plane [rad/s], the wall's own spin
/// left out.
Vec3 rolling_rate(const BodyProblem& problem, std::size_t k, std::span<const Twist> V);

/// The same with it: that of its material.
Vec3 rolling_rate_at(const BodyProblem& problem, std::size_t k, std::span<const Twist> V);

/// Contact k under an impulse, where it rolls so fast.
Rolling rolling_at(const BodyProblem& problem, std::size_t k, const Vec3& rate, const Vec3& impulse);

/// How far a moment of contact k is from its law, over the smaller radius [N s].
double wrong_moment(const BodyProblem& problem, std::size_t k, const Vec3& m, const Rolling& contact);

/// Any contact does.
bool has_rolling(const BodyProblem& problem);

/// What a moment m [N m s] of contact k does to its first and to its second body [N s].
std::array<Twist, 2> push_of_moment(const BodyProblem& problem, std::size_t k, const Vec3& m);

/// F += what a moment m [N m s] of contact k does to its bodies [N s].
void add_moment(const BodyProblem& problem, std::size_t k, const Vec3& m, std::span<Twist> F);

/// 1/I_1 + 1/I_2 of contact k [1/(kg m^2)].
double rolling_mobility(const BodyProblem& problem, std::size_t k);

/// The smaller radius [m]: over it a moment is an impulse.
double rolling_lever(const BodyProblem& problem, std::size_t k);

/// Sum over the contacts of |m - P(m - rate/(1/I_1 + 1/I_2))|^2 (1/I_1 + 1/I_2) [J]: how far moments are from
/// their law under these impulses and velocities.
double rolling_residual2(const BodyProblem& problem, std::span<const Vec3> impulse, std::span<const Twist> V);

/// V_free without what cohesion and moments give, per unknown [m/s].
std::vector<Twist> free_of_attraction(const BodyProblem& problem);

/// A spring that resists turning at a contact, along an axis, of any length.
struct MomentSpring {
  std::size_t contact = 0;
  Vec3 axis = Vec3::Zero();
  double stiffness = 0;  ///< moment per angular velocity [kg m^2], > 0
};

/// The problem with other moments: V_free of its bodies holds what these do, as it does of those before.
BodyProblem with_moments(const BodyProblem& problem, std::span<const Vec3> change);

/// The change of the moment of contact k that ends within the bound which an impulse gives it.
Vec3 admissible_change(const BodyProblem& problem, std::size_t k, const Vec3& impulse, const Vec3& change);

/// Where the moments of a cluster stand in a round, and what they change by. Contacts of which none rolls
/// have none of it.
class RollingSet {
 public:
  RollingSet(const BodyProblem& problem, std::span<const Twist> V);

  /// States behind the motion so far, where the law would have contacts carry such impulses: none, at its
  /// bound, held. Returns what moments do wrong until then, as impulses at the smaller radius [N s].
  double see(double firmness, std::span<const Twist> motion, std::span<const Vec3> carried);
  bool same_as(const RollingSet& other) const { return state_ == other.state_; }

  /// Springs of the moment of contact k, `number` among those of another problem: of one that is held
  /// `firmness` over its mobility, in all of the tangent plane; of one at its bound across its direction, by
  /// which that turns with the rate.
  void add_springs(std::size_t k, std::size_t number, double firmness, std::vector<MomentSpring>& to) const;
  /// F += the changes at no motion, and rho w + s of those that are held, rho being `firmness` over the
  /// mobility [N s].
  void add_force(double firmness, std::span<Twist> F) const;
  /// s += rho (w - G^T motion) of those that are held, and what the motion turns others by. Returns what of
  /// the wishes is missed [N s].
  double take_multipliers(double firmness, std::span<const Twist> motion);

  const std::vector<Vec3>& change() const { return change_; }  ///< of m [N m s], per contact, or empty

 private:
  enum class State : char { none, bound, held };
  bool held(std::size_t k) const { return state_[k] == State::held; }

  const BodyProblem* problem_;
  std::vector<State> state_;
  std::vector<Vec3> rate_;    ///< before the correction, that of the wall taken off [rad/s]
  std::vector<Vec3> known_;   ///< change of those that are not held, at no motion [N m s]
  std::vector<Vec3> across_;  ///< of those at their bounds: spring across their direction, (kg m^2)^(1/2)
  std::vector<Vec3> change_;  ///< known, and the multiplier [N m s]
};

}  // namespace talus
