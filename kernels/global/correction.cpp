#include "kernels/global/correction.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "kernels/bodies/index.hpp"
#include "kernels/global/balance.hpp"
#include "kernels/global/body_solver.hpp"
#include "kernels/global/stiffness.hpp"
#include "kernels/law/friction_cone.hpp"

namespace talus {

namespace {

enum class ContactState : char { open, sliding, sticking };

/// The contacts of one part: where they stand, what they ask for and what they get.
struct ActiveSet {
  std::vector<ContactState> state;
  std::vector<Vec3> velocity;   ///< v + offset before the correction [m/s]
  std::vector<Vec3> direction;  ///< of the impulse of those that slide, unit, on the edge of the cone
  std::vector<double> shift;    ///< mu |v_t| of the last velocities [m/s]
  std::vector<Vec3> change;     ///< of r: known, and the multiplier [N s]

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

ActiveSet empty_set(const BodyProblem& problem, std::span<const Twist> V) {
  const std::size_t n = problem.contacts.size();
  ActiveSet set{std::vector(n, ContactState::open), std::vector<Vec3>(n), std::vector(n, Vec3(Vec3::Zero())),
                std::vector<double>(n, 0.0), std::vector(n, Vec3(Vec3::Zero()))};
  for (std::size_t k = 0; k < n; ++k) {
    const ContactEquation& c = problem.contacts[k];
    set.velocity[k] = constrained(c, relative_velocity(c, V) + c.offset);
  }
  return set;
}

/// States as the natural map sees them behind the motion and the change of impulses so far. What contacts do
/// wrong until then, |r - P_Kmu(r - (v + mu |v_t| n)/W_nn)|, is added to wrong(k) [N s].
void see_states(const BodyProblem& problem, std::span<const Twist> motion, ActiveSet& set,
                const std::function<double&(std::size_t)>& wrong) {
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
    const ContactEquation& c = problem.contacts[k];
    const Vec3 r = problem.impulse[k] + set.change[k];
    const Vec3 v = set.velocity[k] + constrained(c, relative_velocity(c, motion));
    const double m = effective_mass(problem, c);
    set.shift[k] = c.mu * tangential(c, v).norm();
    const Vec3 aim = r - m * (v + set.shift[k] * c.normal);
    const Vec3 carried = project_on_cone(aim, c.normal, c.mu);
    wrong(k) += (r - carried).norm();
    if (carried == Vec3::Zero()) {
      set.state[k] = ContactState::open;
    } else if (c.mu > 0 && carried == aim) {
      set.state[k] = ContactState::sticking;
    } else {
      set.state[k] = ContactState::sliding;
      set.direction[k] = carried.normalized();
    }
  }
}

/// The part of a problem whose contacts are not open, for the linear system. `origin`: their places in all.
struct ActiveProblem {
  BodyProblem problem;
  std::vector<std::size_t> origin;
  std::vector<Levers> levers;  ///< of frictional contacts that slide: they push along the edge of their cones
};

ActiveProblem active_part(const BodyProblem& all, const ActiveSet& set) {
  ActiveProblem active;
  BodyProblem& problem = active.problem;
  problem.bodies = all.bodies;
  problem.grains = all.grains;
  problem.subdomain = all.subdomain;
  problem.counts = all.counts;
  problem.shared = all.shared;
  active.levers.reserve(all.contacts.size());
  for (std::size_t k = 0; k < all.contacts.size(); ++k) {
    if (set.state[k] == ContactState::open) continue;
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

/// One round: the linear system of the present states, solved by augmented Lagrangians.
class Round {
 public:
  Round(const BodyParts& all, const PartLink& link, std::vector<ActiveSet>& sets, const Clusters& clusters,
        const CorrectionThresholds& thresholds)
      : all_(all), link_(link), sets_(sets), clusters_(clusters), thresholds_(thresholds) {
    active_.resize(all.size());
    all.each([&](std::size_t p) { active_[p] = active_part(all[p], sets[p]); });
    for (ActiveProblem& part : active_) problems_.push_back(std::move(part.problem));
    rho_.resize(all.size());
    const double kappa = thresholds.firmness;
    all.each([&](std::size_t p) {
      for (const ContactEquation& c : problems_[p].contacts)
        rho_[p].push_back(kappa * effective_mass(problems_[p], c));
    });
  }

  /// Improves `motion`; the multipliers go to the sets' `change`. Adds to `errors` what is missed and left.
  int solve(const std::vector<std::vector<double>>& enough, PartField& motion, Correction& result) {
    const BodyParts parts(problems_, link_);
    BodySolver solver(parts, rho_, 1);
    int iterations = 0;
    for (int update = 0; update < thresholds_.most_updates; ++update) {
      const PartField force = force_of(parts);
      iterations += gradients(parts, solver, force, enough, motion, result);
      const bool granted = take_multipliers(parts, motion, enough, result);
      if (granted) break;
    }
    return iterations;
  }

 private:
  /// k + H (rho w + s), the forces of contacts that carry and of those whose change is known.
  PartField force_of(const BodyParts& parts) const {
    PartField force = parts.field();
    parts.each([&](std::size_t p) {
      const ActiveSet& set = sets_[p];
      for (std::size_t k = 0; k < all_[p].contacts.size(); ++k)
        if (const Vec3 known = set.known(all_[p], k); known != Vec3::Zero())
          add_force(all_[p].contacts[k], known, force[p]);
      for (std::size_t a = 0; a < active_[p].origin.size(); ++a) {
        const std::size_t k = active_[p].origin[a];
        const ContactEquation& c = problems_[p].contacts[a];
        add_force(c, multiplier(p, a) + rho_[p][a] * constrained(c, set.wish(all_[p], k)), force[p]);
      }
    });
    link_.sum_copies(force);
    parts.each([&](std::size_t p) {
      for (std::size_t b = 0; b < force[p].size(); ++b) restrict_to_freedoms(parts[p].bodies[b], force[p][b]);
    });
    return force;
  }
  Vec3 multiplier(std::size_t p, std::size_t a) const {
    return constrained(problems_[p].contacts[a], sets_[p].change[active_[p].origin[a]]);
  }

  /// Until what they leave of every cluster is small beside what they have found of it.
  int gradients(const BodyParts& parts, BodySolver& solver, const PartField& force,
                const std::vector<std::vector<double>>& enough, PartField& motion, Correction& result) {
    solver.begin(force, motion);
    PartField then = motion;
    std::vector<std::vector<double>> before(parts.size());
    for (std::size_t p = 0; p < parts.size(); ++p)
      before[p].assign(at(clusters_.count[p]), std::numeric_limits<double>::infinity());
    // One at least: multipliers are rho times what the wishes have not got, and rho is large.
    int k = 0;
    for (;;) {
      const bool looks = std::has_single_bit(static_cast<unsigned>(k)) || k >= thresholds_.most_linear;
      if (looks && small(parts, solver, enough, motion, then, before, k, result)) break;
      if (k >= thresholds_.most_linear) break;
      ++k;
      if (!(solver.iterate(motion) > 0)) {
        small(parts, solver, enough, motion, then, before, k, result);
        break;
      }
    }
    return k;
  }

  bool small(const BodyParts& parts, const BodySolver& solver, const std::vector<std::vector<double>>& enough,
             const PartField& motion, PartField& then, std::vector<std::vector<double>>& before, int k,
             Correction& result) {
    enum { found, change, mass, energy, width };
    const ClusterRows rows =
        rows_of_clusters(parts, clusters_, width, 0, [&](std::size_t p, ClusterRows& to) {
          for (std::size_t b = 0; b < motion[p].size(); ++b) {
            const std::int32_t cluster = clusters_.of_body[p][b];
            if (cluster < 0 || !parts[p].counted(b)) continue;
            const BodyUnknown& body = parts[p].bodies[b];
            const std::span<double> row = to.of(p, cluster);
            const Twist &now = motion[p][b], &old = then[p][b];
            row[found] += body.mass * now.u.norm() + body.spin_mass * now.w.norm();
            row[change] += body.mass * (now.u - old.u).norm() + body.spin_mass * (now.w - old.w).norm();
            row[mass] += body.mass;
            row[energy] += dot(solver.residual()[p][b], solver.preconditioned()[p][b]);
          }
        });
    const double worst = largest_of_clusters(parts, clusters_, [&](std::size_t p, std::int32_t c) {
      const std::span<const double> row = rows.of(p, c);
      const double bound = thresholds_.caution * std::sqrt(row[mass] * std::max(0.0, row[energy]));
      double left = bound;
      if (k >= thresholds_.few_linear)
        left = std::min(bound, left_over(row[change], before[p][at(c)], thresholds_.unsettled));
      if (k > 0) before[p][at(c)] = row[change];
      result.errors.of(p, c)[Correction::left] = left;
      const double goal = thresholds_.tolerance * std::max(row[found], enough[p][at(c)]);
      return left > goal ? left / std::max(goal, std::numeric_limits<double>::min()) : 0;
    });
    then = motion;
    return worst == 0;
  }

  /// s += rho (w - H^T d). True when the wishes are granted but for what is small.
  bool take_multipliers(const BodyParts& parts, const PartField& motion,
                        const std::vector<std::vector<double>>& enough, Correction& result) {
    enum { missed, found, width };
    const ClusterRows rows =
        rows_of_clusters(parts, clusters_, width, 0, [&](std::size_t p, ClusterRows& to) {
          for (std::size_t k = 0; k < all_[p].contacts.size(); ++k)
            if (sets_[p].state[k] == ContactState::open) sets_[p].change[k] = -all_[p].impulse[k];
          for (std::size_t a = 0; a < active_[p].origin.size(); ++a) {
            const std::size_t k = active_[p].origin[a];
            const ContactEquation& c = problems_[p].contacts[a];
            const Vec3 wish = constrained(c, sets_[p].wish(all_[p], k));
            const Vec3 rest = wish - constrained(c, relative_velocity(c, motion[p]));
            sets_[p].change[k] = multiplier(p, a) + rho_[p][a] * rest + sets_[p].known(all_[p], k);
            to.of(p, clusters_.of_contact(p, c))[missed] += effective_mass(problems_[p], c) * rest.norm();
          }
          for (std::size_t b = 0; b < motion[p].size(); ++b)
            if (const std::int32_t cluster = clusters_.of_body[p][b]; cluster >= 0 && parts[p].counted(b))
              to.of(p, cluster)[found] += parts[p].bodies[b].mass * motion[p][b].u.norm();
        });
    const double worst = largest_of_clusters(parts, clusters_, [&](std::size_t p, std::int32_t c) {
      const std::span<const double> row = rows.of(p, c);
      result.errors.of(p, c)[Correction::missed] = row[missed];
      const double goal = thresholds_.tolerance * std::max(row[found], enough[p][at(c)]);
      return row[missed] > goal ? 1 : 0;
    });
    return worst == 0;
  }

  const BodyParts& all_;
  const PartLink& link_;
  std::vector<ActiveSet>& sets_;
  const Clusters& clusters_;
  const CorrectionThresholds& thresholds_;
  std::vector<ActiveProblem> active_;
  std::vector<BodyProblem> problems_;
  std::vector<std::vector<double>> rho_;
};

}  // namespace

ClusterRows momentum_of_clusters(const BodyParts& parts, const Clusters& clusters, const PartField& motion) {
  return rows_of_clusters(parts, clusters, 1, 0, [&](std::size_t p, ClusterRows& to) {
    for (std::size_t b = 0; b < motion[p].size(); ++b) {
      const std::int32_t cluster = clusters.of_body[p][b];
      if (cluster < 0 || !parts[p].counted(b)) continue;
      const BodyUnknown& body = parts[p].bodies[b];
      to.of(p, cluster)[0] += body.mass * motion[p][b].u.norm() + body.spin_mass * motion[p][b].w.norm();
    }
  });
}

Correction correction_of(std::span<const BodyProblem> problems, const PartLink& link,
                         const std::vector<std::vector<double>>& enough, const Clusters& clusters,
                         const CorrectionThresholds& thresholds) {
  const BodyParts parts(problems, link);
  Correction result;
  result.clusters = clusters;
  result.velocity = velocities_of(parts, impulses_of(parts));
  result.motion = parts.field();
  const auto no_errors = [&] {
    return rows_of_clusters(parts, clusters, Correction::width, 0, [](std::size_t, ClusterRows&) {});
  };
  result.errors = no_errors();
  std::vector<ActiveSet> sets(parts.size());
  parts.each([&](std::size_t p) {
    sets[p] = empty_set(parts[p], result.velocity[p]);
    double unused = 0;
    see_states(parts[p], result.motion[p], sets[p], [&](std::size_t) -> double& { return unused; });
  });

  const auto worst_error = [&] {
    return largest_of_clusters(parts, clusters, [&](std::size_t p, std::int32_t c) {
      return result.error(p, c) / std::max(enough[p][at(c)], std::numeric_limits<double>::min());
    });
  };
  // Rounds that do not settle may carry the motion off: the best one counts.
  Correction best;
  double least = std::numeric_limits<double>::infinity();
  int since = 0;
  while (result.rounds < thresholds.most_rounds && since < thresholds.patience) {
    ++result.rounds;
    result.errors = no_errors();
    result.linear_iterations +=
        Round(parts, link, sets, clusters, thresholds).solve(enough, result.motion, result);
    result.impulse.clear();
    for (const ActiveSet& set : sets) result.impulse.push_back(set.change);
    const ClusterRows found = momentum_of_clusters(parts, clusters, result.motion);
    const ClusterRows wrong = rows_of_clusters(parts, clusters, 1, 0, [&](std::size_t p, ClusterRows& to) {
      see_states(parts[p], result.motion[p], sets[p], [&](std::size_t k) -> double& {
        return to.of(p, clusters.of_contact(p, parts[p].contacts[k]))[0];
      });
    });
    const double unsettled = largest_of_clusters(parts, clusters, [&](std::size_t p, std::int32_t c) {
      const std::span<double> row = result.errors.of(p, c);
      row[Correction::found] = found.of(p, c)[0];
      row[Correction::open] = wrong.of(p, c)[0];
      return row[Correction::open] > thresholds.tolerance * std::max(row[Correction::found], enough[p][at(c)])
                 ? 1
                 : 0;
    });
    result.settled = unsettled == 0;
    const double error = worst_error();
    ++since;
    if (error < least || result.settled) {
      least = error;
      best = result;
      since = 0;
    }
    if (result.settled) break;
  }
  best.rounds = result.rounds;
  best.linear_iterations = result.linear_iterations;
  return best;
}

}  // namespace talus
