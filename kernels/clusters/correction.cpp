#include "kernels/clusters/correction.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "kernels/bodies/larger.hpp"
#include "kernels/clusters/firm_contacts.hpp"
#include "kernels/clusters/rolling_contacts.hpp"
#include "kernels/global/natural_map.hpp"
#include "kernels/global/stiffness.hpp"

namespace talus {

namespace {

enum class ContactState : char { open, sliding, sticking };

/// The contacts: where they stand, what they ask for and what they get.
struct ActiveSet {
  std::vector<ContactState> state;
  std::vector<Vec3> velocity;   ///< v + offset before the correction [m/s]
  std::vector<Vec3> direction;  ///< of the impulse of those that slide, unit, on the edge of the cone
  std::vector<double> shift;    ///< mu |v_t| of the last velocities [m/s]
  std::vector<Vec3> change;     ///< of r: known, and the multiplier [N s]
  std::vector<double> wrong;    ///< what the natural map found wrong last [N s]
  std::vector<Vec3> carried;    ///< what it would have carried [N s]
  RollingSet rolling;

  /// Known part of the change of r: all of it where open, across the direction where sliding.
  Vec3 known(const BodyProblem& problem, std::size_t k) const {
    const Vec3& r = problem.impulse[k];
    if (state[k] == ContactState::open) return -r;
    if (state[k] == ContactState::sticking) return Vec3::Zero();
    return direction[k].dot(r) * direction[k] - r;
  }
  /// The change of the relative velocity that is asked for: of those that slide along their direction.
  Vec3 wish(const BodyProblem& problem, std::size_t k) const {
    if (state[k] == ContactState::sticking) return -velocity[k];
    const Vec3 shifted = velocity[k] + shift[k] * problem.contacts[k].normal;
    return -direction[k].dot(shifted) * direction[k];
  }
};

ActiveSet empty_set(const BodyProblem& problem) {
  const std::size_t n = problem.contacts.size();
  const std::vector<Twist> V = velocities_of(problem, problem.impulse);
  const std::vector<Vec3> none(n, Vec3(Vec3::Zero()));
  const std::vector<double> nothing(n, 0.0);
  ActiveSet set{
      std::vector(n, ContactState::open), none, none, nothing, none, nothing, none, RollingSet(problem, V)};
  for (std::size_t k = 0; k < n; ++k) {
    const ContactEquation& c = problem.contacts[k];
    set.velocity[k] = constrained_velocity(c, V);
  }
  return set;
}

/// States as the natural map sees them behind the motion and the change of impulses so far. Returns what
/// contacts do wrong until then, sum |r - P_Kmu(r - (v + mu |v_t| n)/W_nn)| and of moments likewise [N s].
double see_states(const BodyProblem& problem, double firmness, std::span<const Twist> motion,
                  ActiveSet& set) {
  double wrong = 0;
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
    const ContactEquation& c = problem.contacts[k];
    const Vec3 r = problem.impulse[k] + set.change[k];
    const Vec3 v = set.velocity[k] + constrained(c, relative_velocity(c, motion));
    const auto [m, shift, aim, carried] = natural_map_of(problem, c, r, v);
    set.shift[k] = shift;
    set.carried[k] = carried;
    set.wrong[k] = (r - carried).norm();
    wrong += set.wrong[k];
    if (carried == Vec3::Zero()) {
      set.state[k] = ContactState::open;
    } else if (c.mu > 0 && carried == aim) {
      set.state[k] = ContactState::sticking;
    } else {
      set.state[k] = ContactState::sliding;
      set.direction[k] = carried.normalized();
    }
  }
  return wrong + set.rolling.see(firmness, motion, set.carried);
}

/// The part of a problem whose contacts are not open, for the linear system. `origin`: their places in all.
struct ActiveProblem {
  BodyProblem problem;
  std::vector<std::size_t> origin;
  std::vector<MomentSpring> moments;
  std::vector<Levers> levers;  ///< of frictional contacts that slide: they push along the edge of their cones
};

ActiveProblem active_part(const BodyProblem& all, const ActiveSet& set, double firmness) {
  ActiveProblem active;
  BodyProblem& problem = active.problem;
  problem.bodies = all.bodies;
  problem.grains = all.grains;
  active.levers.reserve(all.contacts.size());
  for (std::size_t k = 0; k < all.contacts.size(); ++k) {
    if (set.state[k] == ContactState::open) continue;
    set.rolling.add_springs(k, active.origin.size(), firmness, active.moments);
    active.origin.push_back(k);
    problem.contacts.push_back(all.contacts[k]);
    problem.impulse.push_back(Vec3::Zero());
    ContactEquation& c = problem.contacts.back();
    if (set.state[k] == ContactState::sticking || c.mu == 0) continue;
    if (c.levers == nullptr) {
      const Mat3 N = cross_matrix(c.normal);
      active.levers.push_back({N, -N});
      c.levers = &active.levers.back();
    }
    c.normal = set.direction[k];
    c.mu = 0;
  }
  return active;
}

/// Whether contacts stand where they stood `then`. Those that only rounding has moved go back there.
bool stand(const BodyProblem& problem, const std::vector<ContactState>& then, double rounding,
           ActiveSet& set) {
  const double least = rounding * largest_impulse(problem, set.change);
  bool same = true;
  for (std::size_t k = 0; k < then.size(); ++k) {
    if (set.state[k] == then[k]) continue;
    if (set.wrong[k] > least)
      same = false;
    else
      set.state[k] = then[k];
  }
  return same;
}

/// What the updates of the multipliers in a round have left.
struct Updates {
  double missed = 0;   ///< wishes of contacts that the motion does not grant [N s]
  double left = 0;     ///< what rounding may leave of the linear system [N s]
  double moved = 0;    ///< momentum by which the last one has changed the motion [N s]
  double to_come = 0;  ///< and what further ones would add, by the ratio of the last two [N s]
  double pushed = 0;   ///< part of the largest impulse by which the last one has changed an impulse, at most
};

/// Where geometry amplifies, wishes that are missed by next to nothing may hide much of the motion; and where
/// light bodies pass the force on between heavy ones, much of the forces behind next to no momentum.
bool converged(const BodyProblem& problem, const Updates& updates, double goal,
               const CorrectionThresholds& thresholds) {
  const double most = larger(goal, updates.left);
  return updates.moved <= most &&
         (has_friction(problem) ? updates.to_come <= most : updates.pushed <= thresholds.same_forces);
}

/// One round: the linear system of the present states, solved by augmented Lagrangians.
class Round {
 public:
  Round(const BodyProblem& all, ActiveSet& set, double enough, const CorrectionThresholds& thresholds)
      : all_(all),
        set_(set),
        enough_(enough),
        thresholds_(thresholds),
        active_(active_part(all, set, thresholds.firmness)),
        firm_(active_.problem, thresholds.firmness, active_.moments) {}

  /// The motion; the multipliers go to the set's `change`.
  std::vector<Twist> solve(Updates& updates) {
    std::vector<Twist> motion(all_.bodies.size());
    double before = std::numeric_limits<double>::infinity();
    for (int update = 0; update < thresholds_.most_updates; ++update) {
      FirmContacts::Solution solution = firm_.solve(force());
      updates.left = momentum_of(all_, solution.last);
      const bool granted = take_multipliers(solution.motion, updates);
      const double moved = momentum_of(all_, added(solution.motion, -1, motion));
      // The first update says nothing of how fast they decay.
      const bool alone = update == 0 && moved > updates.left;
      updates.to_come =
          alone ? std::numeric_limits<double>::infinity() : rest_of(before, moved, updates.left);
      updates.moved = moved;
      before = moved;
      motion = std::move(solution.motion);
      if (granted &&
          converged(all_, updates, goal_of(momentum_of(all_, motion), enough_, thresholds_), thresholds_) &&
          !leap(updates))
        break;
    }
    return motion;
  }

 private:
  /// Without friction, where updates change next to nothing: looks at three more of them. In a direction that
  /// W hardly resists all those to come may be most of the forces; they follow one another by one ratio, and
  /// the multipliers go on by all of them at once. False, and nothing is done, where they do not: along
  /// redundant contacts, which W does not resist at all, rounding changes multipliers, by no ratio.
  bool leap(Updates& updates) {
    if (has_friction(all_) || has_rolling(all_) ||
        updates.pushed <= thresholds_.rounding * thresholds_.firmness)
      return false;
    const std::vector<Vec3> kept = set_.change;
    Updates next;
    std::array<double, 3> pushed{};  // [N s]
    std::vector<Vec3> last;
    for (double& push : pushed) {
      last = set_.change;
      take_multipliers(firm_.solve(force()).motion, next);
      for (std::size_t k = 0; k < last.size(); ++k) push = larger(push, (set_.change[k] - last[k]).norm());
    }
    const auto times_of = [&](std::size_t k) { return rest_of(pushed[k - 1], pushed[k], 0) / pushed[k]; };
    const double times = times_of(2);
    const bool creeps = times > 1 && times * thresholds_.same_forces * thresholds_.same_ratio < 1 &&
                        std::abs(times - times_of(1)) <= thresholds_.same_ratio * times;
    if (!creeps) {
      set_.change = kept;
      return false;
    }
    for (const std::size_t k : active_.origin) set_.change[k] += times * (set_.change[k] - last[k]);
    updates.pushed = times * next.pushed;
    return true;
  }

  /// k + H (rho w + s), the forces of contacts that carry and of those whose change is known.
  std::vector<Twist> force() const {
    std::vector<Twist> force(all_.bodies.size());
    for (std::size_t k = 0; k < all_.contacts.size(); ++k)
      if (const Vec3 known = set_.known(all_, k); known != Vec3::Zero())
        add_force(all_.contacts[k], known, force);
    for (std::size_t a = 0; a < active_.origin.size(); ++a) {
      const ContactEquation& c = active_.problem.contacts[a];
      add_force(c, multiplier(a) + firm_.rho(a) * constrained(c, set_.wish(all_, active_.origin[a])), force);
    }
    set_.rolling.add_force(thresholds_.firmness, force);
    return force;
  }
  Vec3 multiplier(std::size_t a) const {
    return constrained(active_.problem.contacts[a], set_.change[active_.origin[a]]);
  }

  /// s += rho (w - H^T d). True when the wishes are granted but for what is small.
  bool take_multipliers(const std::vector<Twist>& motion, Updates& updates) {
    const std::vector<Vec3> before = set_.change;
    for (std::size_t k = 0; k < all_.contacts.size(); ++k)
      if (set_.state[k] == ContactState::open) set_.change[k] = -all_.impulse[k];
    updates.missed = set_.rolling.take_multipliers(thresholds_.firmness, motion);
    for (std::size_t a = 0; a < active_.origin.size(); ++a) {
      const std::size_t k = active_.origin[a];
      const ContactEquation& c = active_.problem.contacts[a];
      const Vec3 rest = constrained(c, set_.wish(all_, k)) - constrained(c, relative_velocity(c, motion));
      set_.change[k] = multiplier(a) + firm_.rho(a) * rest + set_.known(all_, k);
      updates.missed += effective_mass(active_.problem, c) * rest.norm();
    }
    updates.pushed = pushed_by(all_, before, set_.change);
    return updates.missed <= goal_of(momentum_of(all_, motion), enough_, thresholds_);
  }

  const BodyProblem& all_;
  ActiveSet& set_;
  double enough_;
  const CorrectionThresholds& thresholds_;
  ActiveProblem active_;
  FirmContacts firm_;
};

/// Sum of |r| over the contacts with these changes [N s].
double carried_by(const BodyProblem& problem, std::span<const Vec3> change) {
  double sum = 0;
  for (std::size_t k = 0; k < change.size(); ++k) sum += (problem.impulse[k] + change[k]).norm();
  return sum;
}

/// Of impulses that are an answer themselves, but for so much.
RoundsCorrection unchanged(const BodyProblem& problem, double at_first) {
  Correction none;
  none.impulse.assign(problem.contacts.size(), Vec3::Zero());
  none.motion.resize(problem.bodies.size());
  none.open = at_first;
  none.settled = none.knows_moments = true;
  return {std::move(none), at_first};
}

}  // namespace

bool has_friction(const BodyProblem& problem) {
  return std::any_of(problem.contacts.begin(), problem.contacts.end(),
                     [](const ContactEquation& c) { return c.mu > 0; });
}

double mass_of(const BodyProblem& problem) {
  double all = 0;
  for (const BodyUnknown& body : problem.bodies) all += body.mass;
  return all;
}

double mass_ratio(const BodyProblem& problem) {
  double least = std::numeric_limits<double>::infinity();
  for (const ContactEquation& c : problem.contacts) least = std::min(least, effective_mass(problem, c));
  return mass_of(problem) / least;
}

double largest_impulse(const BodyProblem& problem, std::span<const Vec3> change) {
  double largest = 0;
  for (std::size_t k = 0; k < change.size(); ++k)
    largest = larger(largest, (problem.impulse[k] + change[k]).norm());
  return largest;
}

double beyond_rounding(const BodyProblem& problem, const Correction& step, double enough,
                       const CorrectionThresholds& thresholds) {
  const double wrong = step.open + step.left, apart = mass_ratio(problem);
  if (wrong * apart <= thresholds.certain * enough) return wrong * apart;
  const double carried = carried_by(problem, step.impulse);
  return wrong <= thresholds.rounding * carried ? std::sqrt(apart * wrong * carried)
                                                : std::numeric_limits<double>::infinity();
}

double pushed_by(const BodyProblem& problem, std::span<const Vec3> before, std::span<const Vec3> now) {
  double most = 0;
  for (std::size_t k = 0; k < now.size(); ++k) most = larger(most, (now[k] - before[k]).norm());
  return most > 0 ? most / largest_impulse(problem, now) : 0;
}

double goal_of(double found, double enough, const CorrectionThresholds& thresholds) {
  return thresholds.tolerance * std::max(thresholds.sharpness * found, enough);
}

double rest_of(double before, double now, double rounding) {
  if (now <= rounding) return now;
  return now < before ? now * now / (before - now) : std::numeric_limits<double>::infinity();
}

RoundsCorrection correction_of(const BodyProblem& problem, double enough,
                               const CorrectionThresholds& thresholds) {
  const bool friction = has_friction(problem);
  std::vector<Twist> motion(problem.bodies.size());
  ActiveSet set = empty_set(problem);
  const double wrong = see_states(problem, thresholds.firmness, motion, set);
  const double apart = mass_ratio(problem);
  const bool rolling = has_rolling(problem);
  if (wrong * apart <= thresholds.certain * enough) return unchanged(problem, wrong * apart);
  if (const double error = thresholds.of_single_contact * wrong; problem.contacts.size() == 1 && !rolling &&
                                                                 problem.contacts.front().levers == nullptr &&
                                                                 apart < 2 && error <= enough)
    return unchanged(problem, error);
  // Rounds that do not settle may carry the motion off: the best one counts.
  RoundsCorrection rounds = unchanged(problem, std::numeric_limits<double>::infinity());
  rounds.best.settled = false;
  double least = std::numeric_limits<double>::infinity();
  const int most = rolling    ? thresholds.most_rolling_rounds
                   : friction ? thresholds.most_sliding_rounds
                              : thresholds.most_rounds;
  double moved = std::numeric_limits<double>::infinity();
  for (int k = 1, since = 0; k <= most && since < thresholds.patience; ++k, ++since) {
    Updates updates;
    const std::vector<Twist> before =
        std::exchange(motion, Round(problem, set, enough, thresholds).solve(updates));
    Correction now{.motion = motion,
                   .impulse = set.change,
                   .moment = set.rolling.change(),
                   .knows_moments = true,
                   .found = momentum_of(problem, motion),
                   .missed = updates.missed,
                   .left = larger(updates.left, updates.moved)};
    const std::vector<ContactState> then = set.state;
    const RollingSet rolled = set.rolling;
    now.open = see_states(problem, thresholds.firmness, motion, set);
    const double before_last = std::exchange(moved, momentum_of(problem, added(motion, -1, before)));
    // Of further rounds: the direction of sliding may lag by the same small part in each.
    const double to_come = rest_of(before_last, moved, updates.left);
    rounds.to_come = std::min(to_come, thresholds.creeping * moved);
    if (k == 1) rounds.at_first = larger(wrong, now.found + now.missed + updates.left);
    const bool stays = friction ? set.state == then && set.rolling.same_as(rolled)
                                : stand(problem, then, thresholds.rounding, set);
    if (k == 1 && apart <= thresholds.most_apart && rounds.at_first <= thresholds.exact * enough && stays)
      return unchanged(problem, rounds.at_first);
    const double goal = goal_of(now.found, enough, thresholds);
    // What the law finds wrong with a light body may be what heavy ones press by, as many times as much.
    const double law = now.open * std::max(1.0, thresholds.tolerance * apart);
    now.settled = law <= goal && updates.left <= enough && converged(problem, updates, goal, thresholds) &&
                  (friction ? k > 1 && larger(moved, to_come) <= goal : stays);
    if (now.settled || now.error() < least) {
      least = now.error();
      rounds.best = std::move(now);
      since = -1;
    }
    if (rounds.best.settled) break;
  }
  return rounds;
}

}  // namespace talus
