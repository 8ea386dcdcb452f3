#include "kernels/global/admm.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "kernels/bodies/index.hpp"
#include "kernels/global/body_solver.hpp"
#include "kernels/law/friction_cone.hpp"

namespace talus {

namespace {

/// State of the iteration in one part: an entry per contact.
struct PartState {
  std::span<const double> rho;
  std::vector<Vec3> y;        ///< aim of the contact velocity, with its shift
  std::vector<double> shift;  ///< mu |y_t|
  double gap2 = 0, weight = 0;

  explicit PartState(std::span<const double> weights)
      : rho(weights), y(weights.size()), shift(weights.size()) {}

  /// The first aims, from impulses and velocities.
  void begin(const BodyProblem& problem, std::span<const Twist> V, std::span<Vec3> r) {
    for (std::size_t k = 0; k < y.size(); ++k) {
      const ContactEquation& c = problem.contacts[k];
      r[k] = project_on_cone(r[k], c.normal, c.mu);
      const Vec3 v = constrained_velocity(c, V);
      shift[k] = c.mu * tangential(c, v).norm();
      y[k] = v + shift[k] * c.normal + project_on_cone(-v, c.normal, c.mu);
    }
  }

  /// H (r + rho (y - c)): what the contacts here add to the right-hand side.
  void add_aims(const BodyProblem& problem, std::span<const Vec3> r, std::span<Twist> force) const {
    std::fill(force.begin(), force.end(), Twist{});
    for (std::size_t k = 0; k < y.size(); ++k) {
      const ContactEquation& c = problem.contacts[k];
      add_force(c, constrained(c, r[k] + rho[k] * (y[k] - shift[k] * c.normal - c.offset)), force);
    }
  }

  /// New impulses and aims from the velocities.
  void update(const BodyProblem& problem, std::span<const Twist> V, double relaxation, double kappa,
              std::span<Vec3> r) {
    gap2 = weight = 0;
    for (std::size_t k = 0; k < y.size(); ++k) {
      const ContactEquation& c = problem.contacts[k];
      const Vec3 v = constrained_velocity(c, V) + shift[k] * c.normal;
      const Vec3 x = relaxation * v + (1 - relaxation) * y[k];
      const Vec3 r_new = project_on_cone(r[k] - rho[k] * x, c.normal, c.mu);
      y[k] = x + (r_new - r[k]) / rho[k];
      r[k] = r_new;
      const double m = rho[k] / kappa;
      gap2 += m * (v - y[k]).squaredNorm();
      weight += m;
      const double next_shift = c.mu * tangential(c, y[k]).norm();
      y[k] += (next_shift - shift[k]) * c.normal;
      shift[k] = next_shift;
    }
  }
};

/// Velocities of the iterate V against those that its impulses give.
void measure(const BodyParts& parts, const PartField& V, const PartImpulses& r,
             std::span<const PartState> states, std::span<const std::vector<std::int32_t>> heavy,
             BodyAdmmResult& result) {
  const PartField made = velocities_of(parts, r);
  enum : std::size_t {
    gained2,
    defect2,
    speed2,
    count,
    gap2,
    weight,
    scale,
    sample,
    heavies = sample + 3,
    worst
  };
  constexpr RowColumns columns{.sums = worst, .largest = 1};
  const std::vector<double> all = parts.reduced(columns, 1, [&](std::size_t p, std::span<double> row) {
    const BodyProblem& problem = parts[p];
    for (std::size_t b = 0; b < problem.bodies.size(); ++b) {
      if (!problem.counted(b)) continue;
      const BodyUnknown& body = problem.bodies[b];
      const Vec3 defect = made[p][b].u - V[p][b].u, gained = made[p][b].u - body.free.u;
      row[gained2] += kinetic2(body, gained, made[p][b].w - body.free.w);
      row[defect2] += kinetic2(body, defect, made[p][b].w - V[p][b].w);
      row[speed2] += gained.squaredNorm();
      row[count] += 1;
      row[scale] += body.mass * gained.norm();
      for (std::size_t k = 0; k < 3; ++k) row[sample + k] += body.mass * defect[static_cast<Eigen::Index>(k)];
    }
    row[gap2] = states[p].gap2;
    row[weight] = states[p].weight;
    row[heavies] = static_cast<double>(heavy[p].size());
    for (std::int32_t b : heavy[p]) {
      const double own = (made[p][at(b)].u - problem.bodies[at(b)].free.u).norm();
      if (own > 0) row[worst] = std::max(row[worst], (made[p][at(b)].u - V[p][at(b)].u).norm() / own);
    }
  });
  // Sums over all bodies: a NaN, of any of them, stays NaN, and must not pass for solved.
  result.momentum_defect = all[gained2] != 0 ? std::sqrt(all[defect2] / all[gained2]) : 0;
  // Each body counts alike: the heaviest would hide the rest.
  const double speed = std::sqrt(all[speed2] / all[count]);
  result.contact_defect = speed > 0 ? std::sqrt(all[gap2] / all[weight]) / speed : 0;
  result.balance_defect = all[worst];
  if (all[heavies] == 0 && all[scale] > 0)
    result.balance_defect = Vec3(all[sample], all[sample + 1], all[sample + 2]).norm() / all[scale];
}

/// Whether all weights are finite, and leave room in doubles for sums and products with them. Collective.
bool weights_are_sound(const BodyParts& parts, std::span<const std::vector<double>> rho) {
  constexpr double least = 1e-250, most = 1e250;
  return parts.total(1, [&](std::size_t p, std::span<double> row) {
    row[0] = static_cast<double>(
        std::ranges::count_if(rho[p], [](double weight) { return !(weight >= least && weight <= most); }));
  })[0] == 0;
}

bool any_contact(const BodyParts& parts) {
  return parts.total(1, [&](std::size_t p, std::span<double> row) {
    row[0] = static_cast<double>(parts[p].contacts.size());
  })[0] > 0;
}

}  // namespace

BodyAdmmResult solve_admm(std::span<BodyProblem> problems, const PartLink& link,
                          const BodyAdmmSettings& settings) {
  const BodyParts parts(problems, link);
  BodyAdmmResult result;
  if (!any_contact(parts)) {
    result.converged = true;
    return result;
  }
  const double kappa = estimate_stiffness(parts);
  if (!(kappa > 0 && std::isfinite(kappa))) return result;  // masses beyond what doubles hold
  std::vector<std::vector<double>> rho(parts.size());
  for (std::size_t p = 0; p < parts.size(); ++p)
    for (const ContactEquation& c : parts[p].contacts) rho[p].push_back(kappa * effective_mass(parts[p], c));
  if (!weights_are_sound(parts, rho)) return result;
  std::vector<PartState> states(rho.begin(), rho.end());
  BodySolver linear(parts, rho);

  PartImpulses r = impulses_of(parts);
  PartField V = velocities_of(parts, r), force = parts.field();
  const std::vector<std::vector<std::int32_t>> heavy = heavy_unknowns(parts);
  const bool has_heavy = parts.total(1, [&](std::size_t p, std::span<double> row) {
    row[0] = static_cast<double>(heavy[p].size());
  })[0] > 0;
  std::array<double, 8> worst;
  worst.fill(std::numeric_limits<double>::infinity());
  parts.each([&](std::size_t p) { states[p].begin(parts[p], V[p], r[p]); });
  for (result.iterations = 0; result.iterations < settings.max_iterations;) {
    parts.each([&](std::size_t p) { states[p].add_aims(parts[p], r[p], force[p]); });
    link.sum_copies(force);
    parts.each([&](std::size_t p) {
      for (std::size_t b = 0; b < force[p].size(); ++b) {
        const BodyUnknown& body = parts[p].bodies[b];
        restrict_to_freedoms(body, force[p][b]);
        force[p][b].u += body.mass * body.free.u;
        force[p][b].w += body.spin_mass * body.free.w;
      }
    });
    result.linear_iterations += linear.solve(force, V, settings.linear_tolerance, settings.max_linear);
    ++result.iterations;
    parts.each([&](std::size_t p) { states[p].update(parts[p], V[p], settings.relaxation, kappa, r[p]); });
    measure(parts, V, r, states, heavy, result);
    worst[static_cast<std::size_t>(result.iterations) % worst.size()] = result.balance_defect;
    result.balance_defect = *std::max_element(worst.begin(), worst.end());
    const bool balanced = has_heavy && result.balance_defect <= settings.balance_tolerance &&
                          !std::isnan(result.momentum_defect);
    if (balanced ||
        (result.momentum_defect <= settings.tolerance && result.contact_defect <= settings.tolerance)) {
      result.converged = true;
      break;
    }
  }
  for (std::size_t p = 0; p < parts.size(); ++p) problems[p].impulse = std::move(r[p]);
  result.stiffness = kappa;
  return result;
}

BodyAdmmResult solve_admm(BodyProblem& problem, const BodyAdmmSettings& settings) {
  const PartLink alone;
  return solve_admm({&problem, 1}, alone, settings);
}

}  // namespace talus
