#include "kernels/clusters/step_error.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "kernels/bodies/index.hpp"
#include "kernels/clusters/cluster_problem.hpp"
#include "kernels/clusters/felt_rounding.hpp"
#include "kernels/clusters/group_measures.hpp"
#include "kernels/clusters/loaded_groups.hpp"
#include "kernels/clusters/motion_norms.hpp"
#include "kernels/clusters/rolling_contacts.hpp"
#include "kernels/global/stiffness.hpp"

namespace talus {

namespace {

/// A group of bodies that push one another, and its answer.
struct AnsweredGroup {
  LoadedGroup group;
  ClusterAnswer answer;
  double scale = 0;        ///< what its errors are compared with [N s]
  double floor = 0;        ///< what is done elsewhere makes of that [N s]
  double noise = 0;        ///< what rounding leaves of its momentum [N s]
  double at_wall = 0;      ///< likewise of a wall's impulse
  FeltRounding felt = {};  ///< of its bodies and contacts, if heavy ones are not to hide light ones

  bool same_as(const LoadedGroup& other) const {
    return group.bodies.front() == other.bodies.front() && group.bodies.size() == other.bodies.size();
  }
};

/// What the contacts of all clusters do: a floor for each.
struct Everywhere {
  double scale = 0;  ///< [N s]
  double mass = 0;   ///< [kg]
};

/// Sets what the errors of a group are compared with. What rounding makes must pass whatever is asked.
void measure_group(const Everywhere& everywhere, const ErrorGoal& goal, const StepErrorThresholds& thresholds,
                   AnsweredGroup& own) {
  const BodyProblem& problem = own.group.problem;
  const Measures row = measures_of(problem, goal.faces);
  const double share = everywhere.mass > 0 ? row[mass] / everywhere.mass : 0;
  const double enough = std::max(goal.enough, std::numeric_limits<double>::epsilon());
  own.floor = thresholds.elsewhere * everywhere.scale * share;
  own.scale = std::max(scale_of(row, thresholds), own.floor);
  own.noise = thresholds.rounding * most_momentum(row[mass], row[incoming]);
  double still = thresholds.still * row[mass] * goal.still / enough;
  if (still > thresholds.interest * own.scale && lopsided(problem, thresholds.lopsided)) {
    own.felt =
        felt_rounding(problem, {enough * own.scale, enough, goal.sweeps, goal.still}, thresholds.cluster);
    still = std::min(still, own.felt.all_momentum() / enough);
  } else {
    own.scale = std::max(own.scale, still);
    own.noise = std::max(own.noise, still);
  }
  own.at_wall = std::max(own.noise, still);
}

/// `relative`: error that need not be told apart.
void answer_group(double relative, const ErrorGoal& goal, const StepErrorThresholds& thresholds,
                  AnsweredGroup& own) {
  own.answer = solve_cluster(own.group.problem, {relative * own.scale, relative, goal.sweeps, goal.still},
                             thresholds.cluster);
}

/// Per body of a cluster: the least scale of the groups that exchange something and that it was in [N s].
std::vector<double> least_scales(std::size_t bodies, const std::vector<AnsweredGroup>& groups) {
  std::vector<double> least(bodies, std::numeric_limits<double>::infinity());
  for (const AnsweredGroup& own : groups)
    for (const std::size_t b : own.group.bodies)
      if (own.scale > 0 && !own.group.contacts.empty()) least[b] = own.scale;
  return least;
}

/// The groups of a cluster that `joins` makes; those that are as before keep their answers. One that others
/// were joined to is answered as exactly as the least of them asks, if it can be: what it does in all says
/// nothing of those that do not push one another in the end.
std::vector<AnsweredGroup> answered(const BodyProblem& cluster, std::span<const char> joins,
                                    std::vector<AnsweredGroup> before, const Everywhere& everywhere,
                                    const ErrorGoal& goal, const StepErrorThresholds& thresholds) {
  std::vector<AnsweredGroup> groups;
  const std::vector<double> least = least_scales(cluster.bodies.size(), before);
  auto old = before.begin();
  for (LoadedGroup& group : loaded_groups(cluster, joins)) {
    // Both are in order of their lowest bodies, and groups only grow.
    while (old != before.end() && old->group.bodies.front() < group.bodies.front()) ++old;
    if (old != before.end() && old->same_as(group)) {
      groups.push_back(std::move(*old++));
    } else {
      AnsweredGroup& own = groups.emplace_back(AnsweredGroup{.group = std::move(group), .answer = {}});
      measure_group(everywhere, goal, thresholds, own);
      double part = 1;
      for (const std::size_t b : own.group.bodies) part = std::min(part, least[b] / own.scale);
      answer_group(part * goal.enough, goal, thresholds, own);
      if (!own.answer.solved && part < 1) answer_group(goal.enough, goal, thresholds, own);
    }
  }
  return groups;
}

/// Joins those between which a contact closes under their answers: true where there are any.
bool join_closing(const BodyProblem& cluster, const std::vector<AnsweredGroup>& groups, const ErrorGoal& goal,
                  const StepErrorThresholds& thresholds, std::vector<char>& joins) {
  if (groups.size() == 1) return false;
  std::vector<Twist> V(cluster.bodies.size());
  std::vector<std::size_t> of_body(cluster.bodies.size());
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const BodyProblem& problem = groups[g].group.problem;
    const std::vector<Twist> own = added(velocities_of(problem, problem.impulse),
                                         groups[g].answer.solved ? 1 : 0, groups[g].answer.motion);
    for (std::size_t b = 0; b < own.size(); ++b) {
      V[groups[g].group.bodies[b]] = own[b];
      of_body[groups[g].group.bodies[b]] = g;
    }
  }
  bool any = false;
  for (std::size_t k = 0; k < cluster.contacts.size(); ++k) {
    const ContactEquation& c = cluster.contacts[k];
    if (joins[k] != 0 || c.second < 0 || of_body[at(c.first)] == of_body[at(c.second)]) continue;
    const double scale = std::min(groups[of_body[at(c.first)]].scale, groups[of_body[at(c.second)]].scale);
    const double lighter = std::min(cluster.bodies[at(c.first)].mass, cluster.bodies[at(c.second)].mass);
    if (closing(cluster, c, V) <=
        std::max(thresholds.closing * goal.enough * scale, thresholds.still * goal.still * lighter))
      continue;
    joins[k] = 1;
    any = true;
  }
  return any;
}

/// Joins what an answer of the whole cluster has carry, known as exactly as the group asks that exchanges
/// least: where forces have yet to reach much of a cluster, that would take a round for each contact.
void join_by_whole(const BodyProblem& cluster, const std::vector<AnsweredGroup>& groups,
                   const Everywhere& everywhere, const ErrorGoal& goal, const StepErrorThresholds& thresholds,
                   std::vector<char>& joins) {
  AnsweredGroup whole{.group = {cluster, {}, {}}, .answer = {}};
  measure_group(everywhere, goal, thresholds, whole);
  double least = whole.scale;
  for (const AnsweredGroup& own : groups)
    if (own.scale > 0 && !own.group.contacts.empty()) least = std::min(least, own.scale);
  answer_group(whole.scale > 0 ? goal.enough * least / whole.scale : goal.enough, goal, thresholds, whole);
  for (std::size_t k = 0; k < joins.size(); ++k)
    if (cluster.impulse[k] + whole.answer.found[k] != Vec3::Zero()) joins[k] = 1;
}

/// A group without the contacts that carry nothing, neither now nor in its answer: each part has its own of
/// that, and is measured by what it exchanges. Of what is not known of the answer each part has a share by
/// its scale.
void add_parts(AnsweredGroup whole, const Everywhere& everywhere, const ErrorGoal& goal,
               const StepErrorThresholds& thresholds, std::vector<AnsweredGroup>& parts) {
  const BodyProblem& problem = whole.group.problem;
  const ClusterAnswer& answer = whole.answer;
  std::vector<char> joins = carrying(problem);
  for (std::size_t k = 0; k < joins.size(); ++k)
    if (answer.impulse[k] != Vec3::Zero() || answer.found[k] != Vec3::Zero()) joins[k] = 1;
  std::vector<LoadedGroup> groups = loaded_groups(problem, joins);
  if (groups.size() == 1 || !answer.solved) return parts.push_back(std::move(whole));
  const double unknown = std::max(0.0, answer.error - momentum_of(problem, answer.motion));
  for (LoadedGroup& group : groups) {
    AnsweredGroup part{.group = std::move(group), .answer = {}};
    measure_group(everywhere, goal, thresholds, part);
    part.answer.solved = true;
    part.answer.helps = answer.helps;
    for (std::size_t& b : part.group.bodies) {
      part.answer.motion.push_back(answer.motion[b]);
      b = whole.group.bodies[b];
    }
    for (std::size_t& k : part.group.contacts) {
      part.answer.impulse.push_back(answer.impulse[k]);
      part.answer.found.push_back(answer.found[k]);
      if (!answer.moment.empty()) part.answer.moment.push_back(answer.moment[k]);
      k = whole.group.contacts[k];
    }
    const double share = whole.scale > 0 ? std::min(1.0, part.scale / whole.scale) : 1;
    part.answer.error = momentum_of(part.group.problem, part.answer.motion) + share * unknown;
    parts.push_back(std::move(part));
  }
}

/// The answers to a cluster's groups, such that no contact between two closes by more than may be.
std::vector<AnsweredGroup> answered_groups(const BodyProblem& cluster, const Everywhere& everywhere,
                                           const ErrorGoal& goal, const StepErrorThresholds& thresholds) {
  std::vector<char> joins = carrying(cluster);
  std::vector<AnsweredGroup> groups = answered(cluster, joins, {}, everywhere, goal, thresholds);
  for (int round = 1; join_closing(cluster, groups, goal, thresholds, joins); ++round) {
    if (round == thresholds.most_rounds)
      join_by_whole(cluster, groups, everywhere, goal, thresholds, joins);
    else if (round == 2 * thresholds.most_rounds)
      std::ranges::fill(joins, char{1});
    groups = answered(cluster, joins, std::move(groups), everywhere, goal, thresholds);
  }
  std::vector<AnsweredGroup> parts;
  for (AnsweredGroup& own : groups) add_parts(std::move(own), everywhere, goal, thresholds, parts);
  return parts;
}

/// Where the answers of clusters come together: those that several processes hold count in one of them.
class Answers {
 public:
  Answers(const BodyParts& parts, std::vector<ClusterProblem> clusters, const StepErrorThresholds& thresholds)
      : parts_(parts), clusters_(std::move(clusters)), thresholds_(thresholds), own_(parts.size()) {
    for (std::size_t c = 0; c < clusters_.size(); ++c) {
      const std::size_t part = part_of(clusters_[c].subdomain());
      if (part < parts.size()) own_[part].push_back(c);
    }
    groups_.resize(clusters_.size());
  }

  void solve(const ErrorGoal& goal) {
    std::vector<Measures> rows(clusters_.size());
    each([&](std::size_t c) { rows[c] = measures_of(clusters_[c].problem, goal.faces); });
    const Measures all = total(rows);
    exchanged_ = {all[energy], all[grains]};
    const Everywhere everywhere{scale_of(all, thresholds_), all[mass]};
    each([&](std::size_t c) {
      groups_[c] = answered_groups(clusters_[c].problem, everywhere, goal, thresholds_);
    });
  }

  StepError error(const ErrorGoal& goal) const {
    const double enough = goal.enough;
    StepError error;
    error.velocity = largest([&](const AnsweredGroup& own) { return velocity_error(own); });
    error.wall = wall_error(goal);
    error.contact = largest(contact_error);
    const auto any = [&](bool ClusterAnswer::*which, bool value) {
      return largest([&](const AnsweredGroup& own) {
               const bool wrong = !(larger(velocity_error(own), contact_error(own)) <= enough);
               return wrong && own.answer.*which == value ? 1.0 : 0.0;
             }) > 0;
    };
    error.mends = any(&ClusterAnswer::helps, true);
    error.solved = !any(&ClusterAnswer::solved, false);
    error.jammed = any(&ClusterAnswer::jammed, true);
    error.change = changes(&ClusterAnswer::impulse);
    error.moments = changes(&ClusterAnswer::moment);
    error.exchanged = exchanged_;
    return error;
  }

 private:
  std::size_t part_of(std::int32_t subdomain) const {
    std::size_t p = 0;
    while (p < parts_.size() && parts_[p].subdomain != subdomain) ++p;
    return p;
  }
  void each(const std::function<void(std::size_t)>& work) const {
    parts_.link().each(clusters_.size(), work);
  }
  Measures total(const std::vector<Measures>& rows) const {
    const std::vector<double> all =
        parts_.reduced(columns_of_measures, 1, [&](std::size_t p, std::span<double> row) {
          for (const std::size_t c : own_[p]) columns_of_measures.add(rows[c], row);
        });
    Measures sum{};
    std::ranges::copy(all, sum.begin());
    return sum;
  }
  double largest(const std::function<double(const AnsweredGroup&)>& value) const {
    const std::vector<double> rows = parts_.rows(1, [&](std::size_t p, std::span<double> row) {
      for (const std::size_t c : own_[p])
        for (const AnsweredGroup& own : groups_[c]) row[0] = larger(row[0], value(own));
    });
    double most = 0;
    for (const double row : rows) most = larger(most, row);
    return most;
  }

  double velocity_error(const AnsweredGroup& own) const {
    const double momentum = own.answer.error - own.felt.part_of_motion(own.group.problem, own.answer.motion);
    if (!own.answer.solved) return larger(thresholds_.unknown, own.scale > 0 ? momentum / own.scale : 0);
    if (momentum == 0) return 0;
    // Where nothing moves overlaps may still ask for it.
    return own.scale > 0 ? momentum / own.scale : std::numeric_limits<double>::infinity();
  }
  /// The largest change of a contact's impulse, over the largest impulse of its group, or what is done
  /// elsewhere, or what rounding leaves. How fast walls or a flow are says nothing of forces.
  static double contact_error(const AnsweredGroup& own) {
    double change = 0;
    for (std::size_t k = 0; k < own.answer.found.size(); ++k)
      change = larger(change, own.felt.beyond(k, own.answer.found[k].norm()));
    if (change == 0) return 0;
    return change / std::max({largest_impulse(own.group.problem, own.answer.found), own.floor, own.noise});
  }
  /// What is done elsewhere, or rounding, makes of the momentum of a group that changes a wall's impulse: the
  /// largest [N s].
  double least_at_walls() const {
    return largest([](const AnsweredGroup& own) {
      for (std::size_t k = 0; k < own.answer.found.size(); ++k)
        if (own.group.problem.contacts[k].wall >= 0 && own.answer.found[k] != Vec3::Zero())
          return std::max(own.floor, own.at_wall);
      return 0.0;
    });
  }
  /// Changes of the impulses of walls, and of the faces of a cell, over the largest of them, at least
  /// ErrorGoal::walls: the largest.
  double wall_error(const ErrorGoal& goal) const {
    const double walls = largest([](const AnsweredGroup& own) {
      double count = 0;
      for (const ContactEquation& k : own.group.problem.contacts) count = std::max(count, k.wall + 1.0);
      return count;
    });
    const auto first_face = static_cast<std::size_t>(walls);
    const std::size_t n = first_face + (goal.faces.isZero(0) ? 0 : 3);
    if (n == 0) return 0;
    const std::vector<double> sum = parts_.total(6 * n, [&](std::size_t p, std::span<double> row) {
      const auto add = [&](std::size_t wall, const Vec3& impulse, const Vec3& change) {
        Eigen::Map<Vec3>(&row[6 * wall]) += impulse + change;
        Eigen::Map<Vec3>(&row[6 * wall + 3]) += change;
      };
      const auto add_group = [&](const AnsweredGroup& own) {
        const BodyProblem& problem = own.group.problem;
        for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
          const ContactEquation& contact = problem.contacts[k];
          const Vec3 &impulse = problem.impulse[k], &change = own.answer.found[k];
          if (contact.wall >= 0) add(at(contact.wall), impulse, change);
          const Vec3 share = face_shares(problem, contact, goal.faces);
          for (std::size_t face = first_face; face < n; ++face) {
            const double part = share[static_cast<Eigen::Index>(face - first_face)];
            add(face, part * impulse, part * change);
          }
        }
      };
      for (const std::size_t c : own_[p]) std::ranges::for_each(groups_[c], add_group);
    });
    double scale = larger(goal.walls, least_at_walls()), error = 0;
    for (std::size_t w = 0; w < n; ++w) {
      scale = larger(scale, Eigen::Map<const Vec3>(&sum[6 * w]).norm());
      error = larger(error, Eigen::Map<const Vec3>(&sum[6 * w + 3]).norm());
    }
    return scale > 0 ? error / scale : 0;
  }
  /// Of impulses or moments, of groups that it helps, per part and contact.
  PartImpulses changes(std::vector<Vec3> ClusterAnswer::*which) const {
    PartImpulses change(parts_.size());
    for (std::size_t p = 0; p < parts_.size(); ++p)
      change[p].assign(parts_[p].contacts.size(), Vec3(Vec3::Zero()));
    for (std::size_t c = 0; c < clusters_.size(); ++c)
      for (const AnsweredGroup& own : groups_[c])
        for (std::size_t k = 0; k < (own.answer.*which).size() && own.answer.helps; ++k) {
          const ClusterProblem::Place& place = clusters_[c].contacts[own.group.contacts[k]];
          if (const std::size_t p = part_of(place.subdomain); p < parts_.size())
            change[p][at(place.number)] = (own.answer.*which)[k];
        }
    return change;
  }

  const BodyParts& parts_;
  std::vector<ClusterProblem> clusters_;
  const StepErrorThresholds& thresholds_;
  std::vector<std::vector<std::size_t>> own_;       ///< per part: clusters that it answers for
  std::vector<std::vector<AnsweredGroup>> groups_;  ///< per cluster
  Exchanged exchanged_;                             ///< by all of them
};

}  // namespace

StepError step_error(std::span<const BodyProblem> problems, const PartLink& link, const ErrorGoal& goal,
                     const StepErrorThresholds& thresholds) {
  const BodyParts parts(problems, link);
  std::vector<ContactGraph> graphs;
  for (const BodyProblem& problem : problems) graphs.push_back(graph_of(problem));
  Answers answers(parts, cluster_problems(parts, clusters_of(graphs, link)), thresholds);
  answers.solve(goal);
  return answers.error(goal);
}

StepError step_error(const BodyProblem& problem, const ErrorGoal& goal,
                     const StepErrorThresholds& thresholds) {
  const PartLink alone;
  return step_error({&problem, 1}, alone, goal, thresholds);
}

}  // namespace talus
