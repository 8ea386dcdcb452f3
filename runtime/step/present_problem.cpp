#include "runtime/step/present_problem.hpp"

#include <algorithm>
#include <limits>
#include <utility>

namespace talus {

void PresentProblem::plan(const graph::Communicator& ranks) {
  struct Row {
    double least, most, candidates, farthest;
  };
  Row own{std::numeric_limits<double>::infinity(), 0, static_cast<double>(state_.candidates.size()), 0};
  for (const Velocity& v : state_.bodies.velocity) {
    own.least = std::min(own.least, v.inv_mass);
    own.most = std::max(own.most, v.inv_mass);
  }
  for (const Vec3& x : state_.bodies.x) own.farthest = std::max(own.farthest, x.lpNorm<Eigen::Infinity>());
  Row all{own.least, own.most, 0, 0};
  for (const Row& row : ranks.gather_records(std::span<const Row>(&own, 1))) {
    all.least = std::min(all.least, row.least);
    all.most = std::max(all.most, row.most);
    all.candidates += row.candidates;
    all.farthest = std::max(all.farthest, row.farthest);
  }
  stiffness_.renew(all.most / all.least);
  farthest_ = all.farthest;
  candidates_ = all.candidates;
  largest_inv_mass_ = all.most;
}

void PresentProblem::find_clusters() {
  if (!std::exchange(clusters_known_, true))
    global_.find_clusters(certificate_.small_clusters(), certificate_.looks_twice());
}

double PresentProblem::plain_sweeps_needed() {
  const std::int64_t contacts = certificate_.result().contacts;
  StiffnessMemory::Problem problem{contacts, {}};
  for (std::size_t w = 0; w < state_.walls.size(); ++w)
    problem.carrying.push_back(certificate_.wall_impulses()[w] != Vec3::Zero() ? state_.walls[w].inv_mass()
                                                                               : -1);
  return stiffness_.sweeps_needed(problem, certificate_.stiff_for(contacts),
                                  [&] { return global_.sweeps_needed(stiffness_.spread()); });
}

}  // namespace talus
