#pragma once

/// The exact answer of one small cluster, next to the impulses that it has: what its error is measured by,
/// and what mends it (docs/decisions/0024-certificate.md).

#include <array>
#include <cstdint>
#include <vector>

#include "kernels/clusters/admissible.hpp"
#include "kernels/clusters/answer_state.hpp"
#include "kernels/clusters/correction.hpp"
#include "kernels/clusters/coulomb_newton.hpp"
#include "kernels/clusters/proximal_newton.hpp"
#include "kernels/global/body_problem.hpp"

namespace talus {

/// Every number that an answer depends on. Ratios have no unit.
struct ClusterThresholds {
  CorrectionThresholds correction;
  AdmissibleThresholds admissible;
  CoulombThresholds coulomb;
  ProximalThresholds proximal;
  /// Budget of an answer that rounds do not find, in multiplications, those of sweeps over the cluster's
  /// stored matrix (sweep_cost): so many, >= 0, and so many for each sweep that the step has had, >= 0.
  /// Beyond it the cluster is left without an answer.
  double least_budget = 500, budget_per_sweep = 20;
  /// Parts of it that the question whether there is an answer (and once more, beyond the budget, where none
  /// was found, that whether friction may lock), and the steps of coulomb_newton.hpp and
  /// proximal_newton.hpp may take, together in (0, 1); each has also what those before it leave. Without
  /// friction the second is that of steps which ask for the velocities alone.
  double admissible_share = 0.05, coulomb_share = 0.5, proximal_share = 0.4;
  /// Impulses are kept as they are, however far the answer that was found is from them, where they give its
  /// velocities to this part of what need not be told apart, in (0, 1), and no contact is further from its
  /// law than by `same_law` of it, over the largest impulse, in (0, 1): they are an answer to gaps that
  /// differ by as little.
  /// Without friction velocities are compared in the kinetic norm, too, in which light bodies count beside
  /// heavy ones, with what contacts exchange there, at least `pressed`, in (0, 1), of the largest impulse.
  double same_velocities = 0.1, same_law = 1e-3, pressed = 1e-2;
  /// Where all that the law and the rounds find wrong, in momentum and in each impulse, is less than this
  /// part, in (0, 1), of what rounding of positions makes of the momentum of all bodies (ClusterGoal::still),
  /// the impulses are an answer: grains that fly along walls, and close on them or part by the last bit. Not
  /// where all bodies together are more than so many effective masses of a contact, > 1: the lightest of them
  /// may be off by as many times more.
  double rounding = 0.1, rounding_apart = 100;
  /// Scaled errors (kernels/delassus/delassus.hpp) at which the solver with the stored matrix hands over to
  /// Newton rounds again, > 0, falling; and its iterations until then, at most, >= 1.
  struct Handover {
    double residual;
    std::int64_t most_iterations;
  };
  std::array<Handover, 3> handovers{{{1e-6, 300}, {1e-8, 1000}, {1e-11, 3000}}};
};

/// What a cluster's impulses have to change by. Momenta are sum m |u| + (I/R^2) |w| [N s].
struct ClusterAnswer {
  std::vector<Vec3> impulse;  ///< per contact: change of r [N s]
  std::vector<Vec3> moment;   ///< likewise of moments [N m s]; empty where these are as they are to be
  std::vector<Twist> motion;  ///< per unknown: change of V [m/s]
  std::vector<Vec3> found;    ///< per contact: `impulse` where solved; else what the best of the rounds would
                              ///< change, an estimate of what r is off by [N s]
  double error = 0;           ///< momentum of the motion, and what is not known of it [N s]
  AnswerState state = AnswerState::missing;
  bool knows_moments = false;  ///< Correction::knows_moments
  bool helps = false;          ///< with the change they are nearer to it than before

  bool solved() const { return state == AnswerState::found; }
};

/// Rounds of Newton's method over the bodies (correction.hpp). Where these do not settle, but find no more
/// wrong than rounding of positions, the impulses stay; else, where there may be an answer (admissible.hpp),
/// proximal steps, with friction first those of coulomb_newton.hpp, then proximal_newton.hpp, which without
/// friction ask first for the velocities alone, and end where these are those of impulses that meet the law;
/// and where these do not either, with what is left of the budget the solvers that keep W
/// (kernels/delassus/delassus_auto.hpp) from the impulses that it has, and rounds again from there; not where
/// steps of all kinds were stuck (StepsCorrection::stuck). All but the rounds take moments of rolling
/// resistance as given: beside their answers what the rounds would change counts as error, if it is more, an
/// estimate. All by counted work, so the same bits come out every time. The changed impulses lie on the
/// cones. Values that are not finite come back as an error that is not.
ClusterAnswer solve_cluster(const BodyProblem& problem, const ClusterGoal& goal,
                            const ClusterThresholds& thresholds = {});

}  // namespace talus
