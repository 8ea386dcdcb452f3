#include "runtime/step/present_problem.hpp"

#include <algorithm>
#include <limits>

namespace talus {

void PresentProblem::plan(const graph::Communicator& ranks) {
  struct Row {
    double least, most, candidates;
  };
  Row own{std::numeric_limits<double>::infinity(), 0, static_cast<double>(state_.candidates.size())};
  for (const Velocity& v : state_.bodies.velocity) {
    own.least = std::min(own.least, v.inv_mass);
    own.most = std::max(own.most, v.inv_mass);
  }
  Row all{own.least, own.most, 0};
  for (const Row& row : ranks.gather_records(std::span<const Row>(&own, 1))) {
    all.least = std::min(all.least, row.least);
    all.most = std::max(all.most, row.most);
    all.candidates += row.candidates;
  }
  stiffness_.renew(all.most / all.least);
  candidates_ = all.candidates;
  largest_inv_mass_ = all.most;
}

double PresentProblem::plain_sweeps_needed() {
  const std::int64_t contacts = certificate_.result().contacts;
  StiffnessMemory::Problem problem{contacts, {}};
  for (std::size_t w = 0; w < state_.walls.size(); ++w)
    problem.carrying.push_back(certificate_.wall_impulses()[w] != Vec3::Zero() ? state_.walls[w].inv_mass()
                                                                               : -1);
  return stiffness_.sweeps_needed(problem, certificate_.stiff_for(contacts),
                                  [&] { return admm_.sweeps_needed(); });
}

}  // namespace talus
