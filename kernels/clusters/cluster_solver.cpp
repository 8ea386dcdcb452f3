#include "kernels/clusters/cluster_solver.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "kernels/bodies/larger.hpp"
#include "kernels/clusters/contact_matrix.hpp"
#include "kernels/clusters/rolling_contacts.hpp"
#include "kernels/delassus/delassus_auto.hpp"
#include "kernels/delassus/delassus_sweeps.hpp"
#include "kernels/global/natural_map.hpp"
#include "kernels/law/friction_cone.hpp"

namespace talus {

namespace {

bool finite(const BodyProblem& problem) {
  double sum = 0;
  for (const BodyUnknown& body : problem.bodies)
    sum += body.free.u.sum() + body.free.w.sum() + body.mass + body.spin_mass;
  for (std::size_t k = 0; k < problem.contacts.size(); ++k)
    sum += problem.contacts[k].offset.sum() + problem.contacts[k].normal.sum() + problem.impulse[k].sum();
  return std::isfinite(sum);
}

/// How far impulses are from the law.
struct LawDefect {
  double residual2 = 0;  ///< sum of |r - P_Kmu(r - (v + mu |v_t| n)/W_nn)|^2 W_nn over the contacts, and of
                         ///< their moments likewise (rolling_residual2) [J]
  double energy = 0;     ///< dual objective 1/2 |V(r)|_M^2 + r.offset, which the answer makes least without
                         ///< friction [J]
  double worst = 0;      ///< largest |r - P(...)| W_nn^(1/2), or that of all moments [J^(1/2)]
  double largest = 0;    ///< |r| W_nn^(1/2), the largest [J^(1/2)]
};
LawDefect law_defect(const BodyProblem& problem, const std::vector<Vec3>& impulse) {
  const std::vector<Twist> V = velocities_of(problem, impulse);
  LawDefect defect;
  for (std::size_t b = 0; b < V.size(); ++b)
    defect.energy += 0.5 * kinetic2(problem.bodies[b], V[b].u, V[b].w);
  for (std::size_t k = 0; k < impulse.size(); ++k) {
    const ContactEquation& c = problem.contacts[k];
    const Vec3 v = constrained_velocity(c, V);
    const NaturalMap map = natural_map_of(problem, c, impulse[k], v);
    const double wrong2 = (impulse[k] - map.carried).squaredNorm() / map.m;
    defect.residual2 += wrong2;
    defect.worst = larger(defect.worst, std::sqrt(wrong2));
    defect.largest = larger(defect.largest, impulse[k].norm() / std::sqrt(map.m));
    defect.energy += c.offset.dot(impulse[k]);
  }
  const double rolling2 = rolling_residual2(problem, impulse, V);
  defect.residual2 += rolling2;
  defect.worst = larger(defect.worst, std::sqrt(rolling2));
  return defect;
}

/// What the contacts do to the bodies, with cohesion and moments: V(r) - V_free [m/s].
std::vector<Twist> exchanged(const BodyProblem& problem) {
  return added(velocities_of(problem, problem.impulse), -1, free_of_attraction(problem));
}

bool meets_law(const LawDefect& defect, const ClusterGoal& goal, const ClusterThresholds& thresholds) {
  return defect.worst <= thresholds.same_law * goal.relative * defect.largest;
}

/// Redundant contacts share forces by gaps that differ by no more than rounding, and by less than what the
/// step before was certified to: an answer that shares them otherwise is none that is better. So impulses
/// stay that meet the law themselves and give the velocities of the answer (ClusterThresholds::same_law),
/// also by the scale of what contacts do, beside which walls may press much harder.
bool as_good(const BodyProblem& problem, const ClusterAnswer& answer, const LawDefect& defect,
             const ClusterGoal& goal, const ClusterThresholds& thresholds) {
  if (!answer.solved() || !meets_law(defect, goal, thresholds)) return false;
  const std::vector<Twist> done = exchanged(problem);
  const double apart = std::min(goal.enough, goal.relative * momentum_of(problem, done));
  const double norm =
      goal.relative * std::max(kinetic_norm(problem, done), thresholds.pressed * defect.largest);
  return answer.error <= thresholds.same_velocities * apart &&
         (has_friction(problem) || kinetic_norm(problem, answer.motion) <= thresholds.same_velocities * norm);
}

/// Puts the changed impulses on the cones, and asks whether they are nearer to the law: by the residual, or
/// without friction by the dual objective, which falls also where rounds have not settled.
void admit(const BodyProblem& problem, const ClusterGoal& goal, const ClusterThresholds& thresholds,
           ClusterAnswer& answer) {
  const LawDefect then = law_defect(problem, problem.impulse);
  if (as_good(problem, answer, then, goal, thresholds)) {
    answer.impulse.assign(problem.contacts.size(), Vec3::Zero());
    answer.found = answer.impulse;
    answer.moment = {};
    return;
  }
  std::vector<Vec3> changed(problem.impulse);
  for (std::size_t k = 0; k < changed.size(); ++k) {
    const ContactEquation& c = problem.contacts[k];
    changed[k] = project_on_cone(changed[k] + answer.impulse[k], c.normal, c.mu);
    answer.impulse[k] = changed[k] - problem.impulse[k];
    if (answer.solved()) answer.found[k] = answer.impulse[k];
  }
  for (std::size_t k = 0; k < answer.moment.size(); ++k)
    answer.moment[k] = admissible_change(problem, k, changed[k], answer.moment[k]);
  const LawDefect now = answer.moment.empty() ? law_defect(problem, changed)
                                              : law_defect(with_moments(problem, answer.moment), changed);
  // Comparisons are false for NaN.
  answer.helps = now.residual2 < then.residual2 || (!has_friction(problem) && now.energy < then.energy);
}

/// What a correction of `now` means for the impulses of `from`, which has the same contacts. Changes of
/// rounds that have not settled are not taken: all that they have found counts as uncertain.
ClusterAnswer answer_of(const BodyProblem& from, const BodyProblem& now, const Correction& correction) {
  ClusterAnswer answer;
  answer.state = correction.settled ? AnswerState::found : AnswerState::missing;
  answer.knows_moments = correction.knows_moments;
  if (answer.solved()) answer.moment = correction.moment;
  const std::vector<Twist> then = velocities_of(from, from.impulse), since = velocities_of(now, now.impulse);
  for (std::size_t k = 0; k < from.contacts.size(); ++k) {
    const Vec3 change = now.impulse[k] - from.impulse[k];
    answer.found.push_back(change + correction.impulse[k]);
    answer.impulse.push_back(answer.solved() ? answer.found.back() : change);
  }
  for (std::size_t b = 0; b < then.size(); ++b) {
    Twist motion{since[b].u - then[b].u, since[b].w - then[b].w};
    if (answer.solved()) {
      motion.u += correction.motion[b].u;
      motion.w += correction.motion[b].w;
    }
    answer.motion.push_back(motion);
  }
  answer.error =
      momentum_of(from, answer.motion) + (answer.solved() ? correction.uncertain() : correction.error());
  return answer;
}

/// By the solvers that keep W, for so much work (DelassusGoal::most_work), and rounds from where they get.
/// `answer`: so far, in; the best, out.
void solve_by_matrix(const BodyProblem& problem, double enough, double work,
                     const ClusterThresholds& thresholds, ClusterAnswer& answer) {
  ContactMatrix matrix = matrix_of(problem);
  for (const ClusterThresholds::Handover& handover : thresholds.handovers) {
    if (work <= 0) break;
    const DelassusGoal goal{.tolerance = handover.residual,
                            .measure = ErrorMeasure::scaled,
                            .max_iterations = handover.most_iterations,
                            .most_work = work};
    const bool last = &handover == &thresholds.handovers.back();
    const DelassusReport report = solve_auto(matrix.problem, goal, {}, matrix.r);
    work -= report.work;
    if (report.iterations == 0 && !last) continue;
    BodyProblem now = problem;
    now.impulse = matrix.impulses();
    ClusterAnswer other = answer_of(problem, now, correction_of(now, enough, thresholds.correction).best);
    // Of answers that are none the nearest says most.
    if (other.solved() || other.error < answer.error) answer = std::move(other);
    if (answer.solved()) break;
  }
}

/// Without friction, of impulses that meet the law: whether they give the velocities of the answer, which
/// take less to be known than forces that bodies share by gaps of next to nothing. `answer`: that they do.
bool velocities_suffice(const BodyProblem& problem, ClusterGoal goal, const ClusterThresholds& thresholds,
                        double work, ClusterAnswer& answer) {
  const LawDefect defect = law_defect(problem, problem.impulse);
  if (!meets_law(defect, goal, thresholds)) return false;
  goal.forces = false;
  ClusterAnswer other =
      answer_of(problem, problem,
                proximal_correction(problem, goal, thresholds.correction, thresholds.proximal, work).best);
  if (!as_good(problem, other, defect, goal, thresholds)) return false;
  answer = std::move(other);
  return true;
}

/// Rounds may not settle, as contacts close on bodies and part by the last bit of their velocities.
bool lost_in_rounding(const BodyProblem& problem, const RoundsCorrection& rounds, const ClusterGoal& goal,
                      const ClusterThresholds& thresholds) {
  double wrong = larger(rounds.at_first, rounds.best.error());
  for (const Vec3& change : rounds.best.impulse) wrong = larger(wrong, change.norm());
  return wrong <= thresholds.rounding * mass_of(problem) * goal.still &&
         mass_ratio(problem) <= thresholds.rounding_apart;
}

/// What follows where rounds have not settled. `answer`: theirs, in; the best, out.
void search(const BodyProblem& problem, const ClusterGoal& goal, const ClusterThresholds& thresholds,
            ClusterAnswer& answer) {
  const double budget = (thresholds.least_budget + thresholds.budget_per_sweep * goal.sweeps) *
                        sweep_cost(blocks_of(problem), problem.contacts.size());
  bool stuck = true;
  const auto take = [&](const StepsCorrection& steps) {
    stuck = stuck && steps.stuck;
    ClusterAnswer other = answer_of(problem, problem, steps.best);
    if (other.solved() || other.error < answer.error) answer = std::move(other);
  };
  double left = thresholds.admissible_share * budget;
  if (!problem.has_cell() && none_admissible(problem, goal.enough, thresholds.admissible, left)) {
    answer.state = AnswerState::jammed;
    return;
  }
  if (has_friction(problem)) {
    left += thresholds.coulomb_share * budget;
    take(coulomb_correction(problem, goal, thresholds.correction, thresholds.coulomb, left));
  } else if (velocities_suffice(problem, goal, thresholds, thresholds.coulomb_share * budget, answer)) {
    return;
  }
  left += thresholds.proximal_share * budget;
  if (!answer.solved())
    take(proximal_correction(problem, goal, thresholds.correction, thresholds.proximal, left));
  left += (1 - thresholds.admissible_share - thresholds.coulomb_share - thresholds.proximal_share) * budget;
  // A cell that follows a stress couples all contacts: the matrix would be full. And where steps of all
  // kinds press contacts against one another without end, these solvers would, too.
  if (!answer.solved() && !problem.has_cell() && !stuck)
    solve_by_matrix(problem, goal.enough, left, thresholds, answer);
  if (answer.solved() || problem.has_cell() || !has_friction(problem)) return;
  left = thresholds.admissible_share * budget;
  if (friction_may_lock(problem, goal.enough, thresholds.admissible, left))
    answer.state = AnswerState::locked;
}

/// Where an answer takes moments as given: what the rounds, which do not, would change in velocities or in an
/// impulse counts if it is more.
void take_worse(const RoundsCorrection& rounds, const std::vector<Vec3>& found, ClusterAnswer& answer) {
  answer.error = larger(answer.error, rounds.best.error() + rounds.to_come);
  for (std::size_t k = 0; k < found.size(); ++k)
    if (!(found[k].norm() <= answer.found[k].norm())) answer.found[k] = found[k];
}

}  // namespace

ClusterAnswer solve_cluster(const BodyProblem& problem, const ClusterGoal& goal,
                            const ClusterThresholds& thresholds) {
  ClusterAnswer answer;
  if (!finite(problem)) {
    answer.impulse.assign(problem.contacts.size(), Vec3::Zero());
    answer.found = answer.impulse;
    answer.motion.resize(problem.bodies.size());
    answer.error = std::numeric_limits<double>::quiet_NaN();
    return answer;
  }
  const RoundsCorrection rounds = correction_of(problem, goal.enough, thresholds.correction);
  answer = answer_of(problem, problem, rounds.best);
  const std::vector<Vec3> found = answer.found;
  if (lost_in_rounding(problem, rounds, goal, thresholds)) answer.state = AnswerState::found;
  if (!answer.solved()) search(problem, goal, thresholds, answer);
  const bool estimate = has_rolling(problem) && !(answer.solved() && answer.knows_moments);
  admit(problem, goal, thresholds, answer);
  if (estimate) take_worse(rounds, found, answer);
  return answer;
}

}  // namespace talus
