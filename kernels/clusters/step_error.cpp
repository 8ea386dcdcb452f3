#include "kernels/clusters/step_error.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "kernels/bodies/index.hpp"
#include "kernels/clusters/cluster_problem.hpp"
#include "kernels/global/stiffness.hpp"

namespace talus {

namespace {

/// By Cauchy and Schwarz: the most momentum in so much energy.
double most_momentum(double mass, double energy) {
  return std::sqrt(mass * energy);
}

/// What a cluster, or all of them, is measured by.
enum Measure {
  mass,
  incoming,
  gained,
  pressed,
  grains,
  energy,
  sums,
  drive = sums,
  fastest,
  largest,
  measures
};

using Measures = std::array<double, measures>;
constexpr RowColumns columns_of_measures{.sums = sums, .largest = measures - sums};

/// The parts of a contact's impulse that the faces across x, y and z of a cell feel: b over the edges, b from
/// one body to the other; of blocks whose flow is given, as between the spheres that hold them.
Vec3 face_shares(const BodyProblem& problem, const ContactEquation& c, const Vec3& faces) {
  if (c.wall >= 0 || c.second < 0) return Vec3::Zero();
  if (c.cell >= 0) return faces.cwiseProduct(c.branch);
  const double between = problem.bodies[at(c.first)].radius + problem.bodies[at(c.second)].radius;
  return faces.cwiseProduct(between * c.normal);
}

Measures measures_of(const BodyProblem& problem, const Vec3& faces) {
  Measures row{};
  const std::vector<Twist> V = velocities_of(problem, problem.impulse);
  for (std::size_t b = 0; b < problem.bodies.size(); ++b) {
    const BodyUnknown& body = problem.bodies[b];
    row[mass] += body.mass;
    row[incoming] += kinetic2(body, body.free.u, body.free.w);
    row[gained] += body.mass * (V[b].u - body.free.u).norm() + body.spin_mass * (V[b].w - body.free.w).norm();
    if (body.wall || body.cell) continue;
    row[grains] += body.mass;
    row[energy] += 0.5 * body.mass * (V[b].u - body.free.u).squaredNorm();
  }
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
    const ContactEquation& c = problem.contacts[k];
    const Vec3& r = problem.impulse[k];
    row[fastest] = larger(row[fastest], c.offset.norm());
    row[largest] = larger(row[largest], r.norm());
    if (c.wall >= 0) row[pressed] += std::abs(c.normal.dot(r));
    row[pressed] += face_shares(problem, c, faces).norm() * std::abs(c.normal.dot(r));
    if (r != Vec3::Zero()) row[drive] = larger(row[drive], c.drive);
  }
  return row;
}

/// The momentum that errors are compared with [N s]: see step_error.hpp.
double scale_of(const Measures& row, const StepErrorThresholds& thresholds) {
  // Contacts change no more than what comes in and what drives, gaps and restitution ask for.
  const double sound = most_momentum(row[mass], row[incoming]) + row[mass] * row[fastest];
  return std::max({std::min(row[gained], sound),
                   row[drive] > 0 ? row[mass] * row[drive] : thresholds.interest * row[pressed],
                   thresholds.rounding * most_momentum(row[mass], row[incoming])});
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
    answers_.resize(clusters_.size());
    scales_.resize(clusters_.size());
    floors_.resize(clusters_.size());
    noise_.resize(clusters_.size());
  }

  void solve(const ErrorGoal& goal) {
    std::vector<Measures> rows(clusters_.size());
    each([&](std::size_t c) { rows[c] = measures_of(clusters_[c].problem, goal.faces); });
    const Measures all = total(rows);
    exchanged_ = {all[energy], all[grains]};
    const double everywhere = scale_of(all, thresholds_);
    each([&](std::size_t c) {
      const double share = all[mass] > 0 ? rows[c][mass] / all[mass] : 0;
      // What rounding makes must pass whatever is asked.
      const double still =
          rows[c][mass] * goal.still / std::max(goal.enough, std::numeric_limits<double>::epsilon());
      floors_[c] = thresholds_.elsewhere * everywhere * share;
      scales_[c] = std::max({scale_of(rows[c], thresholds_), floors_[c], still});
      noise_[c] = std::max(thresholds_.rounding * most_momentum(rows[c][mass], rows[c][incoming]), still);
      answers_[c] = solve_cluster(clusters_[c].problem,
                                  {goal.enough * scales_[c], goal.enough, goal.sweeps, goal.still},
                                  thresholds_.cluster);
    });
  }

  StepError error(const ErrorGoal& goal) const {
    const double enough = goal.enough;
    StepError error;
    error.velocity = largest([&](std::size_t c) { return velocity_error(c); });
    error.wall = wall_error(goal);
    const auto contact = [&](std::size_t c) { return contact_error(c); };
    error.contact = largest(contact);
    const auto any = [&](bool ClusterAnswer::*which, bool value) {
      return largest([&](std::size_t c) {
               const bool wrong = !(larger(velocity_error(c), contact(c)) <= enough);
               return wrong && answers_[c].*which == value ? 1.0 : 0.0;
             }) > 0;
    };
    error.mends = any(&ClusterAnswer::helps, true);
    error.solved = !any(&ClusterAnswer::solved, false);
    error.jammed = any(&ClusterAnswer::jammed, true);
    error.change = changes();
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
  double largest(const std::function<double(std::size_t)>& value) const {
    const std::vector<double> rows = parts_.rows(1, [&](std::size_t p, std::span<double> row) {
      for (const std::size_t c : own_[p]) row[0] = larger(row[0], value(c));
    });
    double most = 0;
    for (const double row : rows) most = larger(most, row);
    return most;
  }

  double velocity_error(std::size_t c) const {
    const double momentum = answers_[c].error;
    if (!answers_[c].solved) return larger(thresholds_.unknown, scales_[c] > 0 ? momentum / scales_[c] : 0);
    if (momentum == 0) return 0;
    // Where nothing moves overlaps may still ask for it.
    return scales_[c] > 0 ? momentum / scales_[c] : std::numeric_limits<double>::infinity();
  }
  double largest_impulse(std::size_t c) const {
    return talus::largest_impulse(clusters_[c].problem, answers_[c].found);
  }
  /// The largest change of a contact's impulse, over the largest impulse of its cluster, or what is done
  /// elsewhere, or what rounding leaves. How fast walls or a flow are says nothing of forces.
  double contact_error(std::size_t c) const {
    double change = 0;
    for (const Vec3& by : answers_[c].found) change = larger(change, by.norm());
    if (change == 0) return 0;
    return change / std::max({largest_impulse(c), floors_[c], noise_[c]});
  }
  /// Changes of the impulses of walls, and of the faces of a cell, over the largest of them, at least
  /// ErrorGoal::walls: the largest.
  double wall_error(const ErrorGoal& goal) const {
    const double walls = largest([&](std::size_t c) {
      double count = 0;
      for (const ContactEquation& k : clusters_[c].problem.contacts) count = std::max(count, k.wall + 1.0);
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
      for (const std::size_t c : own_[p])
        for (std::size_t k = 0; k < answers_[c].found.size(); ++k) {
          const BodyProblem& problem = clusters_[c].problem;
          const ContactEquation& contact = problem.contacts[k];
          const Vec3 &impulse = problem.impulse[k], &change = answers_[c].found[k];
          if (contact.wall >= 0) add(at(contact.wall), impulse, change);
          const Vec3 share = face_shares(problem, contact, goal.faces);
          for (std::size_t face = first_face; face < n; ++face) {
            const double part = share[static_cast<Eigen::Index>(face - first_face)];
            add(face, part * impulse, part * change);
          }
        }
    });
    double scale = goal.walls, error = 0;
    for (std::size_t w = 0; w < n; ++w) {
      scale = larger(scale, Eigen::Map<const Vec3>(&sum[6 * w]).norm());
      error = larger(error, Eigen::Map<const Vec3>(&sum[6 * w + 3]).norm());
    }
    return scale > 0 ? error / scale : 0;
  }
  PartImpulses changes() const {
    PartImpulses change(parts_.size());
    for (std::size_t p = 0; p < parts_.size(); ++p)
      change[p].assign(parts_[p].contacts.size(), Vec3(Vec3::Zero()));
    for (std::size_t c = 0; c < clusters_.size(); ++c)
      for (std::size_t k = 0; k < clusters_[c].contacts.size() && answers_[c].helps; ++k) {
        const ClusterProblem::Place& place = clusters_[c].contacts[k];
        if (const std::size_t p = part_of(place.subdomain); p < parts_.size())
          change[p][at(place.number)] = answers_[c].impulse[k];
      }
    return change;
  }

  const BodyParts& parts_;
  std::vector<ClusterProblem> clusters_;
  const StepErrorThresholds& thresholds_;
  std::vector<std::vector<std::size_t>> own_;  ///< per part: clusters that it answers for
  std::vector<ClusterAnswer> answers_;
  std::vector<double> scales_;  ///< [N s]
  std::vector<double> floors_;  ///< what is done elsewhere makes of them [N s]
  std::vector<double> noise_;   ///< what rounding leaves of momenta [N s]
  Exchanged exchanged_;         ///< by all of them
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
