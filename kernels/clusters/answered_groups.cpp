#include "kernels/clusters/answered_groups.hpp"

#include <algorithm>
#include <limits>
#include <span>
#include <utility>

#include "kernels/bodies/index.hpp"
#include "kernels/bodies/larger.hpp"
#include "kernels/clusters/group_measures.hpp"
#include "kernels/clusters/motion_norms.hpp"

namespace talus {

namespace {

bool some(const Vec3& r) {
  return r != Vec3::Zero();
}

/// Something presses in it, now or by its answer.
bool presses(const AnsweredGroup& own) {
  return std::ranges::any_of(own.group.problem.impulse, some) || std::ranges::any_of(own.answer.found, some);
}

/// Joins groups until none closes on another.
class Groups {
 public:
  Groups(const BodyProblem& cluster, const Everywhere& everywhere, const ErrorGoal& goal,
         const StepErrorThresholds& thresholds)
      : cluster_(cluster),
        everywhere_(everywhere),
        goal_(goal),
        thresholds_(thresholds),
        enough_(std::max(goal.enough, std::numeric_limits<double>::epsilon())),
        joins_(carrying(cluster)),
        least_(cluster.bodies.size(), std::numeric_limits<double>::infinity()) {}

  std::vector<AnsweredGroup> answered() {
    answer_all();
    for (int round = 1; join_closing(); ++round) {
      if (round == thresholds_.most_rounds)
        join_by_whole();
      else if (round == 2 * thresholds_.most_rounds)
        std::ranges::fill(joins_, char{1});
      answer_all();
    }
    std::vector<AnsweredGroup> parts;
    for (AnsweredGroup& own : groups_) add_parts(std::move(own), parts);
    for (AnsweredGroup& own : parts) feel_rounding(own);
    return parts;
  }

 private:
  /// Sets what the errors of a group are compared with. What rounding makes must pass whatever is asked.
  void measure(AnsweredGroup& own) const {
    const BodyProblem& problem = own.group.problem;
    Measures row = measures_of(problem, goal_.faces);
    const double share = everywhere_.mass > 0 ? row[MeasureColumn::mass] / everywhere_.mass : 0;
    own.floor = thresholds_.elsewhere * everywhere_.scale * share;
    own.scale = std::max(scale_of(row, thresholds_), own.floor);
    row[MeasureColumn::drive] = 0;  // how fast walls or a flow are says nothing of forces
    own.exchanged = std::min(own.scale, std::max(scale_of(row, thresholds_), own.floor));
    own.noise = thresholds_.rounding * most_momentum(row[MeasureColumn::mass], row[MeasureColumn::incoming]);
    const double still = thresholds_.still * row[MeasureColumn::mass] * goal_.still / enough_;
    own.lopsided = still > thresholds_.slight * own.scale && lopsided(problem, thresholds_.lopsided);
    if (!own.lopsided) {
      own.scale = std::max(own.scale, still);
      own.exchanged = std::max(own.exchanged, still);
      own.noise = std::max(own.noise, still);
    }
    own.at_wall = std::max(own.noise, still);
  }

  /// What rounding makes of a lopsided group takes answers of their own, so at the end.
  void feel_rounding(AnsweredGroup& own) const {
    if (!own.lopsided || own.answer.error == 0) return;
    own.felt = felt_rounding(own.group.problem, {enough_ * own.scale, enough_, goal_.sweeps, goal_.still},
                             thresholds_.cluster);
    own.at_wall = std::max(own.noise, std::min(own.at_wall, own.felt.all_momentum() / enough_));
  }

  /// `relative`: error that need not be told apart.
  void answer(double relative, AnsweredGroup& own) const {
    own.answer = solve_cluster(own.group.problem, {relative * own.scale, relative, goal_.sweeps, goal_.still},
                               thresholds_.cluster);
  }

  /// Answers of the groups that `joins_` makes; those that are as before keep theirs. One that others were
  /// joined to is answered as exactly as the least of them has ever asked, if it can be: what it does in all
  /// says nothing of those that do not push one another in the end.
  void answer_all() {
    std::vector<AnsweredGroup> before = std::exchange(groups_, {});
    auto old = before.begin();
    for (LoadedGroup& group : loaded_groups(cluster_, joins_)) {
      // Both are in order of their lowest bodies, and groups only grow.
      while (old != before.end() && old->group.bodies.front() < group.bodies.front()) ++old;
      if (old != before.end() && old->group.bodies.front() == group.bodies.front() &&
          old->group.bodies.size() == group.bodies.size()) {
        groups_.push_back(std::move(*old++));
        continue;
      }
      AnsweredGroup& own = groups_.emplace_back(AnsweredGroup{.group = std::move(group), .answer = {}});
      measure(own);
      double part = own.scale > 0 ? own.exchanged / own.scale : 1;
      for (const std::size_t b : own.group.bodies) part = std::min(part, least_[b] / own.scale);
      answer(part * goal_.enough, own);
      if (!own.answer.solved() && part < 1) answer(goal_.enough, own);
      if (!presses(own)) continue;
      for (const std::size_t b : own.group.bodies)
        if (own.scale > 0) least_[b] = std::min(least_[b], own.scale);
    }
  }

  /// Joins those between which a contact closes under their answers: true where there are any.
  bool join_closing() {
    if (groups_.size() == 1) return false;
    std::vector<Twist> V(cluster_.bodies.size());
    std::vector<std::size_t> of_body(cluster_.bodies.size());
    for (std::size_t g = 0; g < groups_.size(); ++g) {
      const BodyProblem& problem = groups_[g].group.problem;
      const std::vector<Twist> own = added(velocities_of(problem, problem.impulse),
                                           groups_[g].answer.solved() ? 1 : 0, groups_[g].answer.motion);
      for (std::size_t b = 0; b < own.size(); ++b) {
        V[groups_[g].group.bodies[b]] = own[b];
        of_body[groups_[g].group.bodies[b]] = g;
      }
    }
    bool any = false;
    for (std::size_t k = 0; k < cluster_.contacts.size(); ++k) {
      const ContactEquation& c = cluster_.contacts[k];
      if (joins_[k] != 0 || c.second < 0 || of_body[at(c.first)] == of_body[at(c.second)]) continue;
      const double scale =
          std::min(groups_[of_body[at(c.first)]].scale, groups_[of_body[at(c.second)]].scale);
      const double lighter = std::min(cluster_.bodies[at(c.first)].mass, cluster_.bodies[at(c.second)].mass);
      if (closing(cluster_, c, V) <=
          std::max(thresholds_.closing * goal_.enough * scale, thresholds_.still * goal_.still * lighter))
        continue;
      joins_[k] = 1;
      any = true;
    }
    return any;
  }

  /// Joins what an answer of the whole cluster has carry, known as exactly as the group asks that exchanges
  /// least: where forces have yet to reach much of a cluster, that would take a round for each contact.
  void join_by_whole() {
    AnsweredGroup whole{.group = {cluster_, {}, {}}, .answer = {}};
    measure(whole);
    double least = whole.scale;
    for (const AnsweredGroup& own : groups_)
      if (own.scale > 0 && !own.group.contacts.empty()) least = std::min(least, own.scale);
    answer(whole.scale > 0 ? goal_.enough * least / whole.scale : goal_.enough, whole);
    for (std::size_t k = 0; k < joins_.size(); ++k)
      if (some(cluster_.impulse[k] + whole.answer.found[k])) joins_[k] = 1;
  }

  /// A group without the contacts that carry nothing, neither now nor in its answer: each part has its own of
  /// that, and is measured by what it exchanges. What is not known of the answer may be in any of them.
  void add_parts(AnsweredGroup whole, std::vector<AnsweredGroup>& parts) const {
    const BodyProblem& problem = whole.group.problem;
    const ClusterAnswer& answer = whole.answer;
    std::vector<char> joins = carrying(problem);
    for (std::size_t k = 0; k < joins.size(); ++k)
      if (some(answer.impulse[k]) || some(answer.found[k]) ||
          (!answer.moment.empty() && some(answer.moment[k])))
        joins[k] = 1;
    std::vector<LoadedGroup> groups = loaded_groups(problem, joins);
    if (groups.size() == 1 || !answer.solved()) return parts.push_back(std::move(whole));
    const double unknown = larger(0.0, answer.error - momentum_of(problem, answer.motion));
    for (LoadedGroup& group : groups) {
      AnsweredGroup part{.group = std::move(group), .answer = {}};
      measure(part);
      part.answer.state = AnswerState::found;
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
      const double moved = momentum_of(part.group.problem, part.answer.motion);
      part.answer.error = presses(part) ? moved + unknown : moved;
      parts.push_back(std::move(part));
    }
  }

  const BodyProblem& cluster_;
  const Everywhere& everywhere_;
  const ErrorGoal& goal_;
  const StepErrorThresholds& thresholds_;
  double enough_;              ///< ErrorGoal::enough, or rounding if that is more
  std::vector<char> joins_;    ///< per contact of the cluster
  std::vector<double> least_;  ///< per body of it: the least scale of the groups that it was in [N s]
  std::vector<AnsweredGroup> groups_;
};

}  // namespace

std::vector<AnsweredGroup> answered_groups(const BodyProblem& cluster, const Everywhere& everywhere,
                                           const ErrorGoal& goal, const StepErrorThresholds& thresholds) {
  return Groups(cluster, everywhere, goal, thresholds).answered();
}

}  // namespace talus
