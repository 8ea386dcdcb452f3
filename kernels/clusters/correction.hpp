#pragma once

/// How far the impulses of a cluster are from those that solve it: rounds of an active-set Newton method over
/// all its bodies, by linear solves that see through chains where sweeps do not
/// (docs/decisions/0024-certificate.md).

#include <span>
#include <vector>

#include "kernels/bodies/larger.hpp"
#include "kernels/clusters/motion_norms.hpp"
#include "kernels/global/body_problem.hpp"

namespace talus {

/// Every number that a correction depends on. Ratios have no unit.
struct CorrectionThresholds {
  /// rho W_nn in the linear systems, >> 1.
  double firmness = 1e9;
  /// Updates of the multipliers in a round, at most, >= 1.
  int most_updates = 8;
  /// What may be left: this part of what need not be known more exactly, or of this part of what was found,
  /// both in (0, 1). Small, as redundant contacts whose gaps hardly differ share forces by what little is
  /// left, and with friction rounds may come nearer by a few per cent each.
  double tolerance = 1e-3, sharpness = 1e-4;
  /// Impulses that leave less than this part of what need not be known, in (0, 1], are exact: what
  /// multipliers still say of them is rounding, firmness times as large.
  double exact = 1e-6;
  /// Without friction impulses are known where the last update of the multipliers has changed none by more
  /// than this part of the largest, in (0, 1), unless the ratios of three more, alike to the part
  /// `same_ratio` in (0, 1), tell of a creep (by up to 1/(`same_forces` `same_ratio`) updates like these);
  /// and where a proximal step of this firmness would change none by more.
  double same_forces = 1e-4, same_ratio = 1e-2;
  /// And where no contact has changed its state for more than this part of the largest impulse, in (0, 1): so
  /// much rounding makes. With friction steps end where the law finds no more wrong than that part of all
  /// impulses.
  double rounding = 1e-15;
  /// Not where all bodies of the cluster together are so many effective masses of a contact, >> 1: heavier
  /// ones go on where the firm contacts of a round give way, and contacts feel next to nothing of it.
  double most_apart = 1e7;
  /// Where the law is met to this part of it, in (0, 1), over that ratio of masses, no geometry can hide an
  /// error: no round is made.
  double certain = 1e-9;
  /// A single contact hides none: its error is at most so many times what the law finds wrong, >= 1. (The
  /// eigenvalues of its W, of spheres and walls, are 1/W_nn and 3.5 times as much.)
  double of_single_contact = 4;
  /// Rounds, at most, >= 1: before each further one contacts open, close, stick or slide.
  int most_rounds = 12;
  /// With friction, likewise: of 759 answers that they found for grains in heaps and in a drum 721 had come
  /// within four; 1792 more they did not find.
  int most_sliding_rounds = 4;
  /// Where contacts resist rolling, likewise: moments at their bounds follow the normal impulses a part in
  /// each. Of 103,000 clusters of a heap 92,800 had come within six, 400 more within twelve.
  int most_rolling_rounds = 6;
  /// Rounds that creep, as those of friction may without end, are taken to go on so many times, >> 1.
  double creeping = 1e3;
  /// Rounds that have not made the error smaller, after which no more follow, >= 1.
  int patience = 3;
};

/// What is asked of the answer of a cluster.
struct ClusterGoal {
  double enough = 0;    ///< momentum that need not be told apart [N s]
  double relative = 0;  ///< the same over the cluster's scale
  int sweeps = 0;       ///< that the step has had: what an answer may cost grows with them
  /// [m/s]: slower normal velocities may be rounding of positions, and say nothing of forces.
  double still = 0;
  /// Without friction: impulses are to be known as well as velocities. Else those of an answer may not be
  /// taken, though it is settled.
  bool forces = true;
};

/// What would set all contacts right, and how well that is known. Momenta are sum m |u| + (I/R^2) |w|.
struct Correction {
  std::vector<Twist> motion;   ///< per unknown: change of V [m/s]
  std::vector<Vec3> impulse;   ///< per contact: change of r [N s]
  std::vector<Vec3> moment;    ///< likewise of the moments of those that resist rolling [N m s]; empty where
                               ///< none does, or nothing changes
  bool knows_moments = false;  ///< these are unknowns, too; else they are taken as given
  double found = 0;            ///< momentum of the motion [N s]
  double missed = 0;           ///< what the motion lacks, as far as that is known [N s]
  double open = 0;             ///< what the natural map still finds wrong with motion and impulses [N s]
  double left = 0;       ///< what the linear systems, or rounding, leave of the balance of momentum [N s]
  bool settled = false;  ///< it is an answer: going on would change next to nothing

  /// All of it [N s].
  double error() const { return found + uncertain(); }
  /// What is not known of it [N s].
  double uncertain() const { return missed + open + left; }
};

/// What rounds of Newton's method have found. `missed` are wishes of contacts that the motion does not grant.
struct RoundsCorrection {
  Correction best;
  double at_first = 0;  ///< what the law and the first round find wrong with the impulses [N s]
  double to_come = 0;   ///< what further rounds would add to the last, by the ratio of the last two, or so
                        ///< many like it (CorrectionThresholds::creeping) [N s]
};

/// The Newton step from the impulses of `problem`. `enough`: momentum [N s] below which an error need not be
/// known.
///
/// Each contact is put where the natural map sees it: open, sliding along a given direction, or sticking.
/// With the wishes w = y - v of those that carry (y = 0 where b = 0; without friction along the normal only)
///
///   min 1/2 |d|_M^2 - k.d,   H^T d = w,   change of r = multipliers,   k: what is known, such as -r of those
///                                                                       that open
///
/// is solved by augmented Lagrangians: (M + H rho H^T) d = k + H (rho w + s), s += rho (w - H^T d). Contacts
/// whose impulse would pull then open, and open ones that d closes join, and it is solved again. When no
/// contact changes any more, and without friction, V + d is the exact solution of the step, since it and r +
/// change satisfy all its conditions. A contact that would change by next to nothing is given another round:
/// in a lattice whose contacts lean by 10^-3 a closing speed of 10^-9 m/s decides who carries. With friction
/// the direction of sliding is that of the last velocities: there two rounds have to agree in any case; where
/// contacts carry more than they must, as in a jammed wedge, they may never do. Moments of contacts that
/// resist rolling are held, below their bounds, or put on those that the last normal impulses give.
RoundsCorrection correction_of(const BodyProblem& problem, double enough,
                               const CorrectionThresholds& thresholds = {});

/// Some contact has it.
bool has_friction(const BodyProblem& problem);

/// Mass of all bodies together [kg]; and over the least effective mass of a contact.
double mass_of(const BodyProblem& problem);
double mass_ratio(const BodyProblem& problem);

/// The largest impulse of the problem with these changes [N s].
double largest_impulse(const BodyProblem& problem, std::span<const Vec3> change);

/// What may still be wrong with the momentum behind a step, whose impulses meet the law to rounding or as
/// CorrectionThresholds::certain says [N s]; infinite where they do not. Further steps would press rounding,
/// firmness times as large, into redundant contacts. Where a residual e of the law is rounding of impulses r,
/// its motion has an energy of e r over the least effective mass at most, as the law is monotone but for
/// friction: momenta up to (M/m e r)^1/2.
double beyond_rounding(const BodyProblem& problem, const Correction& step, double enough,
                       const CorrectionThresholds& thresholds);

/// By which the changes of impulses differ from those `before`, over the largest impulse, at most.
double pushed_by(const BodyProblem& problem, std::span<const Vec3> before, std::span<const Vec3> now);

/// What may be left of a correction that has found so much momentum [N s].
double goal_of(double found, double enough, const CorrectionThresholds& thresholds);

/// What is still to come of steps, rounds or updates that have changed the motion by `before` and by `now` at
/// last: a geometric series. What is within `rounding` tells nothing of its ratio [all N s].
double rest_of(double before, double now, double rounding);

}  // namespace talus
