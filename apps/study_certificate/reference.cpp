#include "apps/study_certificate/reference.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace talus::audit {

namespace {

std::size_t root_of(std::vector<std::size_t>& parent, std::size_t k) {
  while (parent[k] != k) k = parent[k] = parent[parent[k]];
  return k;
}

/// A cluster as a problem of its own: its grains, all walls, its contacts.
struct Part {
  StepProblem problem;
  std::vector<Vec3> run;              ///< impulses of its contacts
  std::vector<std::size_t> contacts;  ///< their places in the whole
};

void add_grain(const StepProblem& whole, std::size_t k, StepProblem& part) {
  part.mass.push_back(whole.mass[k]);
  part.spin_mobility.push_back(whole.spin_mobility[k]);
  part.free.u.push_back(whole.free.u[k]);
  part.free.w.push_back(whole.free.w[k]);
}

std::vector<Part> split(const StepProblem& whole, std::span<const Vec3> run) {
  std::size_t count = 0;
  const std::vector<std::size_t> cluster = clusters_of(whole, count);
  std::vector<Part> parts(count);
  const std::size_t none = whole.mass.size();
  std::vector<std::size_t> place(whole.mass.size(), none);  // of a grain in its cluster
  for (Part& part : parts) {
    part.problem.time_step = whole.time_step;
    part.problem.gravity = whole.gravity;
    part.problem.rounding_speed = whole.rounding_speed;
    part.problem.free.walls = whole.free.walls;
    part.problem.wall_normal = whole.wall_normal;
    part.problem.wall_inv_mass = whole.wall_inv_mass;
    part.problem.wall_load = whole.wall_load;
    part.problem.cell = whole.cell;
  }
  for (std::size_t c = 0; c < whole.contacts.size(); ++c) {
    Part& part = parts[cluster[c]];
    const auto place_of = [&](std::size_t grain) {
      if (place[grain] == none) {
        place[grain] = part.problem.mass.size();
        add_grain(whole, grain, part.problem);
      }
      return place[grain];
    };
    StepContact contact = whole.contacts[c];
    contact.first = place_of(contact.first);
    if (!contact.at_wall()) contact.second = static_cast<std::ptrdiff_t>(place_of(contact.other()));
    part.problem.contacts.push_back(contact);
    part.run.push_back(run[c]);
    part.contacts.push_back(c);
  }
  return parts;
}

}  // namespace

std::vector<std::size_t> joined_bodies(const StepProblem& problem,
                                       const std::function<bool(std::size_t)>& joins) {
  const std::size_t grains = problem.mass.size(), cell = grains + problem.wall_normal.size();
  std::vector<std::size_t> parent(cell + 1), set;
  std::iota(parent.begin(), parent.end(), std::size_t{0});
  for (std::size_t c = 0; c < problem.contacts.size(); ++c) {
    const StepContact& contact = problem.contacts[c];
    if (!joins(c) || (contact.at_wall() && problem.wall_inv_mass[contact.wall()] == 0)) continue;
    const std::size_t other = contact.at_wall() ? grains + contact.wall() : contact.other();
    parent[root_of(parent, other)] = root_of(parent, contact.first);
    if (problem.cell.follows() && !contact.at_wall()) parent[root_of(parent, cell)] = root_of(parent, other);
  }
  for (std::size_t b = 0; b <= cell; ++b) set.push_back(root_of(parent, b));
  return set;
}

std::vector<std::size_t> clusters_of(const StepProblem& problem, std::size_t& count) {
  const std::vector<std::size_t> set = joined_bodies(problem, [](std::size_t) { return true; });
  std::vector<std::size_t> number(set.size(), set.size()), cluster;
  count = 0;
  for (const StepContact& contact : problem.contacts) {
    std::size_t& own = number[set[contact.first]];
    if (own == set.size()) own = count++;
    cluster.push_back(own);
  }
  return cluster;
}

Reference solve_reference(const StepProblem& problem, std::span<const Vec3> run,
                          const ReferenceLimits& limits) {
  Reference whole;
  whole.found = Found::answer;
  whole.r.assign(run.size(), Vec3::Zero());
  whole.exact = whole.r;
  double error2 = 0, exchanged2 = 0;
  for (const Part& part : split(problem, run)) {
    const Reference own = part.problem.smooth() ? solve_smooth(part.problem, part.run, limits)
                                                : solve_frictional(part.problem, part.run, limits);
    for (std::size_t c = 0; c < part.contacts.size(); ++c) {
      whole.r[part.contacts[c]] = own.r[c];
      whole.exact[part.contacts[c]] = own.exact[c];
    }
    whole.residual = std::max(whole.residual, own.residual);
    error2 += own.error * own.error;
    exchanged2 += own.exchanged * own.exchanged;
    if (own.found > whole.found) whole.found = own.found, whole.why = own.why;
  }
  double motion2 = 0;
  for (std::size_t k = 0; k < problem.mass.size(); ++k)
    motion2 += problem.mass[k] * problem.free.u[k].squaredNorm();
  exchanged2 = std::max(exchanged2, limits.motion * limits.motion * motion2);
  whole.error = std::sqrt(error2);
  whole.exchanged = std::sqrt(exchanged2);
  whole.motion = motion_under(problem, whole.exact);
  return whole;
}

}  // namespace talus::audit
