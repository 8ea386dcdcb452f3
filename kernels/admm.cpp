#include "kernels/admm.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "kernels/body_solver.hpp"

namespace talus {

namespace {

std::size_t at(std::int32_t k) {
  return static_cast<std::size_t>(k);
}

}  // namespace

double stiffness_of(const BodyProblem& problem, std::span<const Vec3> impulse) {
  std::vector<Twist> gained = velocities_of(problem, impulse);
  for (std::size_t b = 0; b < gained.size(); ++b) {
    gained[b].u -= problem.bodies[b].free.u;
    gained[b].w -= problem.bodies[b].free.w;
  }
  const double kinetic = kinetic2(problem, gained);
  double sum = 0;
  for (std::size_t k = 0; k < impulse.size(); ++k)
    sum += impulse[k].squaredNorm() / effective_mass(problem, problem.contacts[k]);
  return kinetic > 0 ? sum / kinetic : 0;
}

double estimate_stiffness(const BodyProblem& problem) {
  // Layers: distance over contacts from the driven walls.
  const std::size_t count = problem.bodies.size();
  std::vector<std::size_t> begin(count + 1, 0);
  for (const ContactEquation& c : problem.contacts)
    if (c.second >= 0) {
      ++begin[at(c.first) + 1];
      ++begin[at(c.second) + 1];
    }
  for (std::size_t b = 0; b < count; ++b) begin[b + 1] += begin[b];
  std::vector<std::int32_t> other(begin.back());
  std::vector<std::size_t> next(begin.begin(), begin.end() - 1);
  for (const ContactEquation& c : problem.contacts)
    if (c.second >= 0) {
      other[next[at(c.first)]++] = c.second;
      other[next[at(c.second)]++] = c.first;
    }
  std::vector<std::int32_t> depth(count, -1), queue;
  const auto reach = [&](std::size_t body, std::int32_t layer) {
    if (depth[body] >= 0) return;
    depth[body] = layer;
    queue.push_back(static_cast<std::int32_t>(body));
  };
  for (const ContactEquation& c : problem.contacts)
    if (c.second < 0) reach(at(c.first), 1);
  if (queue.empty() && count > 0) {
    std::size_t heaviest = 0;
    for (std::size_t b = 1; b < count; ++b)
      if (problem.bodies[b].mass > problem.bodies[heaviest].mass) heaviest = b;
    reach(heaviest, 0);  // what the others come to rest on
  }
  for (std::size_t head = 0; head < queue.size(); ++head) {
    const std::size_t b = at(queue[head]);
    for (std::size_t e = begin[b]; e < begin[b + 1]; ++e) reach(at(other[e]), depth[b] + 1);
  }
  // Backwards, each body hands what it carries to its contacts of the layer below, in equal parts.
  std::vector<double> load(count, 0), parts(count, 0);
  double total = 0;
  for (std::size_t b = 0; b < count; ++b)
    if (depth[b] >= 1) total += load[b] = problem.bodies[b].mass;
  const auto below = [&](std::int32_t from, std::int32_t to) {
    return to < 0 ? depth[at(from)] == 1 : depth[at(to)] == depth[at(from)] - 1;
  };
  for (const ContactEquation& c : problem.contacts) {
    if (below(c.first, c.second)) ++parts[at(c.first)];
    if (c.second >= 0 && below(c.second, c.first)) ++parts[at(c.second)];
  }
  for (std::size_t k = queue.size(); k-- > 0;) {
    const std::size_t b = at(queue[k]);
    for (std::size_t e = begin[b]; e < begin[b + 1]; ++e)
      if (depth[at(other[e])] == depth[b] - 1 && depth[b] > 1) load[at(other[e])] += load[b] / parts[b];
  }
  double sum = 0;
  for (const ContactEquation& c : problem.contacts) {
    double r = 0;
    if (below(c.first, c.second)) r = load[at(c.first)] / parts[at(c.first)];
    if (c.second >= 0 && below(c.second, c.first)) r = load[at(c.second)] / parts[at(c.second)];
    sum += r * r / effective_mass(problem, c);
  }
  return total > 0 ? sum / total : 0;
}

namespace {

/// Velocities of the iterate V against those that its impulses give.
void measure(const BodyProblem& problem, std::span<const Twist> V, std::span<const Vec3> r, double gap,
             std::span<const std::int32_t> heavy, BodyAdmmResult& result) {
  std::vector<Twist> gained = velocities_of(problem, r), defect(gained.size());
  double speed2 = 0;
  for (std::size_t b = 0; b < gained.size(); ++b) {
    defect[b].u = gained[b].u - V[b].u;
    defect[b].w = gained[b].w - V[b].w;
    gained[b].u -= problem.bodies[b].free.u;
    gained[b].w -= problem.bodies[b].free.w;
    speed2 += gained[b].u.squaredNorm();
  }
  const double gained2 = kinetic2(problem, gained);
  result.momentum_defect = gained2 > 0 ? std::sqrt(kinetic2(problem, defect) / gained2) : 0;
  // Each body counts alike: the heaviest would hide the rest.
  const double speed = std::sqrt(speed2 / static_cast<double>(gained.size()));
  result.contact_defect = speed > 0 ? gap / speed : 0;
  result.balance_defect = 0;
  for (std::int32_t b : heavy) {
    const double own = gained[at(b)].u.norm();
    if (own > 0) result.balance_defect = std::max(result.balance_defect, defect[at(b)].u.norm() / own);
  }
  if (!heavy.empty()) return;
  Vec3 sample = Vec3::Zero();
  double scale = 0;
  for (std::size_t b = 0; b < gained.size(); ++b) {
    sample += problem.bodies[b].mass * defect[b].u;
    scale += problem.bodies[b].mass * gained[b].u.norm();
  }
  if (scale > 0) result.balance_defect = std::max(result.balance_defect, sample.norm() / scale);
}

}  // namespace

BodyAdmmResult solve_admm(BodyProblem& problem, const BodyAdmmSettings& settings) {
  BodyAdmmResult result;
  const std::size_t contacts = problem.contacts.size(), bodies = problem.bodies.size();
  if (contacts == 0) {
    result.converged = true;
    return result;
  }
  double kappa = settings.stiffness;
  if (kappa <= 0) kappa = estimate_stiffness(problem);
  std::vector<double> rho(contacts);
  for (std::size_t k = 0; k < contacts; ++k) rho[k] = kappa * effective_mass(problem, problem.contacts[k]);
  BodySolver linear(problem, rho,
                    settings.aggregate > 0 ? settings.aggregate : aggregate_target(problem.grains));

  std::vector<Vec3>& r = problem.impulse;
  std::vector<Vec3> y(contacts);        // aim of the contact velocity, with its shift
  std::vector<double> shift(contacts);  // mu |y_t|
  std::vector<Twist> V = velocities_of(problem, r), force(bodies);
  const std::vector<std::int32_t> heavy = heavy_unknowns(problem);
  std::array<double, 8> worst;
  worst.fill(std::numeric_limits<double>::infinity());
  const auto split = [&](std::size_t k, const Vec3& v) {
    const Vec3& n = problem.contacts[k].normal;
    return Vec3(v - n.dot(v) * n);
  };
  for (std::size_t k = 0; k < contacts; ++k) {
    const ContactEquation& c = problem.contacts[k];
    r[k] = project_on_cone(r[k], c.normal, c.mu);
    const Vec3 v = constrained(c, relative_velocity(c, V) + c.offset);
    shift[k] = c.mu * split(k, v).norm();
    y[k] = v + shift[k] * c.normal + project_on_cone(-v, c.normal, c.mu);
  }
  for (result.iterations = 0; result.iterations < settings.max_iterations;) {
    for (std::size_t b = 0; b < bodies; ++b) force[b] = Twist{};
    for (std::size_t k = 0; k < contacts; ++k) {
      const ContactEquation& c = problem.contacts[k];
      add_force(c, constrained(c, r[k] + rho[k] * (y[k] - shift[k] * c.normal - c.offset)), force);
    }
    for (std::size_t b = 0; b < bodies; ++b) {
      restrict_to_freedoms(problem.bodies[b], force[b]);
      force[b].u += problem.bodies[b].mass * problem.bodies[b].free.u;
      force[b].w += problem.bodies[b].spin_mass * problem.bodies[b].free.w;
    }
    double left = linear.begin(force, V);
    const double goal = settings.linear_tolerance * settings.linear_tolerance * left;
    for (int k = 0; k < settings.max_linear && left > goal; ++k, ++result.linear_iterations)
      left = linear.iterate(V);
    ++result.iterations;

    double gap2 = 0, weight = 0;
    for (std::size_t k = 0; k < contacts; ++k) {
      const ContactEquation& c = problem.contacts[k];
      const Vec3 v = constrained(c, relative_velocity(c, V) + c.offset) + shift[k] * c.normal;
      const Vec3 x = settings.relaxation * v + (1 - settings.relaxation) * y[k];
      const Vec3 r_new = project_on_cone(r[k] - rho[k] * x, c.normal, c.mu);
      y[k] = x + (r_new - r[k]) / rho[k];
      r[k] = r_new;
      const double m = rho[k] / kappa;
      gap2 += m * (v - y[k]).squaredNorm();
      weight += m;
      const double next_shift = c.mu * split(k, y[k]).norm();
      y[k] += (next_shift - shift[k]) * c.normal;
      shift[k] = next_shift;
    }
    measure(problem, V, r, std::sqrt(gap2 / weight), heavy, result);
    worst[static_cast<std::size_t>(result.iterations) % worst.size()] = result.balance_defect;
    result.balance_defect = *std::max_element(worst.begin(), worst.end());
    const bool balanced = !heavy.empty() && result.balance_defect <= settings.balance_tolerance;
    if (balanced ||
        (result.momentum_defect <= settings.tolerance && result.contact_defect <= settings.tolerance)) {
      result.converged = true;
      break;
    }
  }
  result.stiffness = kappa;
  return result;
}

}  // namespace talus
