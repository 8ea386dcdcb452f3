#include "kernels/global/step_error.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "kernels/bodies/index.hpp"
#include "kernels/bodies/larger.hpp"
#include "kernels/global/balance.hpp"
#include "kernels/global/stiffness.hpp"
#include "kernels/law/friction_cone.hpp"

namespace talus {

namespace {

/// By Cauchy and Schwarz: the most momentum in so much energy.
double most_momentum(double mass, double energy) {
  return std::sqrt(mass * energy);
}

/// What a cluster, or all of them, is measured by.
enum Measure { mass, incoming, gained, pressed, sums, drive = sums, fastest, largest, measures };

using Measures = std::array<double, measures>;

void add_measure(Measures& to, std::size_t k, double value) {
  to[k] = k < sums ? to[k] + value : larger(to[k], value);
}

/// Per cluster; `own`: of each part, all its clusters together.
ClusterRows measures_of(const BodyParts& parts, const Clusters& clusters, const PartField& V,
                        std::vector<Measures>& own) {
  own.assign(parts.size(), {});
  return rows_of_clusters(parts, clusters, sums, measures - sums, [&](std::size_t p, ClusterRows& to) {
    const BodyProblem& problem = parts[p];
    for (std::size_t b = 0; b < problem.bodies.size(); ++b) {
      const std::int32_t cluster = clusters.of_body[p][b];
      if (cluster < 0 || !problem.counted(b)) continue;
      const BodyUnknown& body = problem.bodies[b];
      const std::span<double> row = to.of(p, cluster);
      row[mass] += body.mass;
      row[incoming] += kinetic2(body, body.free.u, body.free.w);
      row[gained] +=
          body.mass * (V[p][b].u - body.free.u).norm() + body.spin_mass * (V[p][b].w - body.free.w).norm();
    }
    for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
      const ContactEquation& c = problem.contacts[k];
      const Vec3& r = problem.impulse[k];
      const std::span<double> row = to.of(p, clusters.of_contact(p, c));
      row[fastest] = larger(row[fastest], c.offset.norm());
      row[largest] = larger(row[largest], r.norm());
      if (c.wall >= 0) row[pressed] += std::abs(c.normal.dot(r));
      if (r != Vec3::Zero()) row[drive] = larger(row[drive], c.drive);
    }
    for (std::int32_t c = 0; c < clusters.count[p]; ++c)
      for (std::size_t k = 0; k < measures; ++k) add_measure(own[p], k, to.of(p, c)[k]);
  });
}

/// The momentum that errors are compared with [N s]: see step_error.hpp.
double scale_of(std::span<const double> row, const StepErrorThresholds& thresholds) {
  // Contacts change no more than what comes in and what drives, gaps and restitution ask for.
  const double sound = most_momentum(row[mass], row[incoming]) + row[mass] * row[fastest];
  return std::max({std::min(row[gained], sound),
                   row[drive] > 0 ? row[mass] * row[drive] : thresholds.interest * row[pressed],
                   thresholds.rounding * most_momentum(row[mass], row[incoming])});
}

/// Of all parts together, from what each has.
Measures total_measures(const BodyParts& parts, std::span<const Measures> own) {
  const std::vector<double> rows = parts.rows(measures, [&](std::size_t p, std::span<double> row) {
    std::copy(own[p].begin(), own[p].end(), row.begin());
  });
  Measures all{};
  for (std::size_t k = 0; k < rows.size(); ++k) add_measure(all, k % measures, rows[k]);
  return all;
}

/// The change of r that the Newton step makes when it is put on the cones.
PartImpulses admissible_change(const BodyParts& parts, const Correction& correction) {
  PartImpulses change = correction.impulse;
  parts.each([&](std::size_t p) {
    for (std::size_t k = 0; k < change[p].size(); ++k) {
      const ContactEquation& c = parts[p].contacts[k];
      const Vec3& r = parts[p].impulse[k];
      change[p][k] = project_on_cone(r + change[p][k], c.normal, c.mu) - r;
    }
  });
  return change;
}

/// Impulses of walls and their changes, over the largest impulse of a wall: the largest.
double wall_error(const BodyParts& parts, const PartImpulses& change) {
  const std::vector<double> counts = parts.rows(1, [&](std::size_t p, std::span<double> row) {
    for (const ContactEquation& c : parts[p].contacts) row[0] = std::max(row[0], c.wall + 1.0);
  });
  const auto walls = static_cast<std::size_t>(*std::max_element(counts.begin(), counts.end()));
  if (walls == 0) return 0;
  const std::vector<double> total = parts.total(6 * walls, [&](std::size_t p, std::span<double> row) {
    for (std::size_t k = 0; k < parts[p].contacts.size(); ++k) {
      const std::int32_t wall = parts[p].contacts[k].wall;
      if (wall < 0) continue;
      Eigen::Map<Vec3>(&row[6 * at(wall)]) += parts[p].impulse[k] + change[p][k];
      Eigen::Map<Vec3>(&row[6 * at(wall) + 3]) += change[p][k];
    }
  });
  double scale = 0, error = 0;
  for (std::size_t w = 0; w < walls; ++w) {
    scale = larger(scale, Eigen::Map<const Vec3>(&total[6 * w]).norm());
    error = larger(error, Eigen::Map<const Vec3>(&total[6 * w + 3]).norm());
  }
  return scale > 0 ? error / scale : 0;
}

/// The largest change of a contact's impulse, over the largest impulse of its cluster, or `interest` times
/// that of all, or of what the cluster's bodies exchange.
double contact_error(const BodyParts& parts, const Clusters& clusters, const PartImpulses& changes,
                     const std::vector<std::vector<double>>& scales, double interest) {
  enum { impulse, change, width };
  const ClusterRows rows = rows_of_clusters(parts, clusters, 0, width, [&](std::size_t p, ClusterRows& to) {
    for (std::size_t k = 0; k < parts[p].contacts.size(); ++k) {
      const std::span<double> row = to.of(p, clusters.of_contact(p, parts[p].contacts[k]));
      const Vec3& by = changes[p][k];
      row[impulse] = larger(row[impulse], (parts[p].impulse[k] + by).norm());
      row[change] = larger(row[change], by.norm());
    }
  });
  const double most = largest_of_clusters(
      parts, clusters, [&](std::size_t p, std::int32_t c) { return rows.of(p, c)[impulse]; });
  return largest_of_clusters(parts, clusters, [&](std::size_t p, std::int32_t c) {
    const std::span<const double> row = rows.of(p, c);
    return row[change] > 0
               ? row[change] / std::max({row[impulse], interest * most, interest * scales[p][at(c)]})
               : 0;
  });
}

bool has_friction(const BodyParts& parts) {
  return parts.total(1, [&](std::size_t p, std::span<double> row) {
    for (const ContactEquation& c : parts[p].contacts) row[0] += c.mu > 0 ? 1 : 0;
  })[0] > 0;
}

}  // namespace

StepError step_error(std::span<const BodyProblem> problems, const PartLink& link, const ErrorGoal& goal,
                     const StepErrorThresholds& thresholds) {
  const BodyParts parts(problems, link);
  std::vector<ContactGraph> graphs;
  for (const BodyProblem& problem : problems) graphs.push_back(graph_of(problem));
  const Clusters clusters = clusters_of(graphs, link);
  const PartField V = velocities_of(parts, impulses_of(parts));
  std::vector<Measures> own;
  const ClusterRows rows = measures_of(parts, clusters, V, own);
  const Measures all = total_measures(parts, own);
  const double everywhere = scale_of(all, thresholds);
  std::vector<std::vector<double>> scales(parts.size()), goals(parts.size());
  parts.each([&](std::size_t p) {
    for (std::int32_t c = 0; c < clusters.count[p]; ++c) {
      const std::span<const double> row = rows.of(p, c);
      const double share = all[mass] > 0 ? row[mass] / all[mass] : 0;
      // What rounding makes must pass whatever is asked.
      const double still =
          row[mass] * goal.still / std::max(goal.enough, std::numeric_limits<double>::epsilon());
      scales[p].push_back(
          std::max({scale_of(row, thresholds), thresholds.interest * everywhere * share, still}));
      goals[p].push_back(goal.enough * scales[p].back());
    }
  });
  StepError error;
  error.correction = correction_of(problems, link, goals, clusters, thresholds.correction);
  error.velocity = largest_of_clusters(parts, clusters, [&](std::size_t p, std::int32_t c) {
    const double momentum = error.correction.error(p, c);
    if (momentum == 0) return 0.0;
    // Where nothing moves overlaps may still ask for it.
    return scales[p][at(c)] > 0 ? momentum / scales[p][at(c)] : std::numeric_limits<double>::infinity();
  });
  const PartImpulses change = admissible_change(parts, error.correction);
  error.wall = wall_error(parts, change);
  error.contact = contact_error(parts, clusters, change, scales, thresholds.interest);
  if (!error.correction.settled && !(error.relative() <= thresholds.nonsense) && has_friction(parts)) {
    std::vector<BodyProblem> used(problems.begin(), problems.end());
    const double one_solve = velocity_error(used, link, goal.enough).relative;
    for (double* found : {&error.velocity, &error.wall, &error.contact}) *found = std::min(*found, one_solve);
  }
  return error;
}

StepError step_error(const BodyProblem& problem, const ErrorGoal& goal,
                     const StepErrorThresholds& thresholds) {
  const PartLink alone;
  return step_error({&problem, 1}, alone, goal, thresholds);
}

}  // namespace talus
