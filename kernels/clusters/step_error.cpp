#include "kernels/clusters/step_error.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "kernels/bodies/index.hpp"
#include "kernels/clusters/answered_groups.hpp"
#include "kernels/clusters/cluster_problem.hpp"
#include "kernels/clusters/group_measures.hpp"
#include "kernels/clusters/rolling_contacts.hpp"
#include "kernels/global/stiffness.hpp"

namespace talus {

namespace {

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
    Measures all = total(rows);
    all[MeasureColumn::drive] = 0;  // elsewhere counts what contacts do, not how fast walls are
    exchanged_ = {all[MeasureColumn::energy], all[MeasureColumn::grains]};
    const Everywhere everywhere{scale_of(all, thresholds_), all[MeasureColumn::mass]};
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
    const auto wrong = [&](const AnsweredGroup& own) {
      return !(larger(velocity_error(own), contact_error(own)) <= enough);
    };
    error.mends =
        largest([&](const AnsweredGroup& own) { return wrong(own) && own.answer.helps ? 1.0 : 0.0; }) > 0;
    error.worst = static_cast<AnswerState>(largest(
        [&](const AnsweredGroup& own) { return wrong(own) ? static_cast<double>(own.answer.state) : 0.0; }));
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
    if (!own.answer.solved()) return larger(thresholds_.unknown, own.scale > 0 ? momentum / own.scale : 0);
    if (momentum <= 0) return 0;
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
