#include "kernels/global/balance.hpp"

#include <array>
#include <bit>
#include <limits>
#include <vector>

#include "kernels/global/body_solver.hpp"
#include "kernels/global/natural_map.hpp"
#include "kernels/global/stiffness.hpp"

namespace talus {

namespace {

/// The changes that the carrying contacts of one part ask of the velocities, and its contacts that do not
/// carry.
struct Wishes {
  std::vector<Vec3> change;  ///< of the relative velocity, y - v [m/s], in order of contact
  std::vector<ContactEquation> open;
  std::vector<double> gap;  ///< of the open ones: v_n, >= 0 [m/s]
  double drive = 0;         ///< fastest drive among those that carry [m/s]
  double fastest = 0;       ///< drive, gap to close or rebound [m/s]
  double pressed = 0;       ///< sum of the impulses at walls [N s]
};

/// Finds the wishes of `problem`, which keeps only the contacts that carry.
Wishes wishes_of(BodyProblem& problem, std::span<const Twist> V, const BalanceThresholds& thresholds) {
  Wishes wishes;
  std::size_t kept = 0;
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
    ContactEquation c = problem.contacts[k];
    const Vec3 r = problem.impulse[k], v = constrained(c, relative_velocity(c, V) + c.offset);
    if (c.second < 0 || problem.bodies[static_cast<std::size_t>(c.second)].wall)
      wishes.pressed += std::abs(c.normal.dot(r));
    if (c.cell >= 0)  // what its faces carry, as walls would
      wishes.pressed +=
          c.reach / problem.bodies[static_cast<std::size_t>(c.cell)].radius * std::abs(c.normal.dot(r));
    wishes.fastest = std::max(wishes.fastest, c.offset.norm());
    const auto [m, shift, aim, carried] = natural_map_of(problem, c, r, v);
    const Vec3 shifted = v + shift * c.normal;
    const Vec3 y = shifted + (carried - r) / m, slip = tangential(c, y);
    Vec3 change = y - c.mu * slip.norm() * c.normal - v;
    const double most = c.mu * c.normal.dot(carried);
    if (c.mu > 0 && slip != Vec3::Zero() && tangential(c, carried).norm() > (1 - thresholds.sliding) * most)
      c.mu = 0;  // it slides: along the plane it asks for nothing
    if (carried == Vec3::Zero()) {
      c.mu = 0;
      wishes.open.push_back(c);
      wishes.gap.push_back(std::max(0.0, c.normal.dot(v)));
      continue;
    }
    wishes.drive = std::max(wishes.drive, c.drive);
    wishes.change.push_back(constrained(c, change));
    problem.contacts[kept] = c;
    problem.impulse[kept++] = r;
  }
  problem.contacts.resize(kept);
  problem.impulse.resize(kept);
  return wishes;
}

/// Open contacts that `motion` closes and more join those that carry; they ask only to be closed. Returns sum
/// m v_n^2 of what it pushed them in [J].
double close_open(BodyProblem& problem, std::span<const Twist> motion, Wishes& wishes) {
  double pushed2 = 0;
  std::size_t kept = 0;
  for (std::size_t k = 0; k < wishes.open.size(); ++k) {
    const ContactEquation c = wishes.open[k];
    const double left = wishes.gap[k] + c.normal.dot(relative_velocity(c, motion));
    if (left < 0) {
      pushed2 += effective_mass(problem, c) * left * left;
      problem.contacts.push_back(c);
      problem.impulse.push_back(Vec3::Zero());
      wishes.change.push_back(-wishes.gap[k] * c.normal);
    } else {
      wishes.open[kept] = c;
      wishes.gap[kept++] = wishes.gap[k];
    }
  }
  wishes.open.resize(kept);
  wishes.gap.resize(kept);
  return pushed2;
}

/// Sum m |u| + (I/R^2) |w| of the motion [N s].
double momentum(const BodyParts& parts, const PartField& motion) {
  return parts.total(1, [&](std::size_t p, std::span<double> row) {
    for (std::size_t b = 0; b < motion[p].size(); ++b) {
      if (!parts[p].counted(b)) continue;
      const BodyUnknown& body = parts[p].bodies[b];
      row[0] += body.mass * motion[p][b].u.norm() + body.spin_mass * motion[p][b].w.norm();
    }
  })[0];
}

/// The same of the difference of two motions.
double distance(const BodyParts& parts, const PartField& motion, const PartField& from) {
  PartField difference = motion;
  parts.each([&](std::size_t p) {
    for (std::size_t b = 0; b < motion[p].size(); ++b) {
      difference[p][b].u -= from[p][b].u;
      difference[p][b].w -= from[p][b].w;
    }
  });
  return momentum(parts, difference);
}

/// How well a motion fits: |d|_M^2 + sum rho |H^T d - change|^2, which is to be small [J]; and the wishes
/// that it misses, sum |H^T d - change|/W_nn [N s].
struct Fit {
  double cost, missed;
};
Fit fit_of(const BodyParts& parts, const PartField& motion, std::span<const Wishes> wishes, double kappa) {
  const std::vector<double> sums = parts.total(2, [&](std::size_t p, std::span<double> row) {
    for (std::size_t b = 0; b < motion[p].size(); ++b)
      if (parts[p].counted(b)) row[0] += kinetic2(parts[p].bodies[b], motion[p][b].u, motion[p][b].w);
    for (std::size_t k = 0; k < wishes[p].change.size(); ++k) {
      const ContactEquation& c = parts[p].contacts[k];
      const Vec3 missed = constrained(c, relative_velocity(c, motion[p])) - wishes[p].change[k];
      row[0] += kappa * effective_mass(parts[p], c) * missed.squaredNorm();
      row[1] += effective_mass(parts[p], c) * missed.norm();
    }
  });
  return {sums[0], sums[1]};
}

/// What the error of the velocities of all parts is compared with.
struct Scales {
  double contacts = 0;  ///< number, of all parts
  double mass = 0;      ///< of all bodies [kg]
  double momentum = 0;  ///< [kg m/s]; 0 where nothing moves

  /// The largest momentum with this energy, by Cauchy and Schwarz.
  double most(double energy) const { return std::sqrt(mass * energy); }
};

Scales scales_of(const BodyParts& parts, const std::vector<Wishes>& wishes, const PartField& V,
                 const BalanceThresholds& thresholds) {
  enum { contacts, mass, pressed, incoming, drive, fastest, width };
  const std::vector<double> rows = parts.rows(width, [&](std::size_t p, std::span<double> row) {
    row[contacts] = static_cast<double>(wishes[p].change.size());
    for (std::size_t b = 0; b < parts[p].bodies.size(); ++b) {
      if (!parts[p].counted(b)) continue;
      const BodyUnknown& body = parts[p].bodies[b];
      row[mass] += body.mass;
      row[incoming] += kinetic2(body, body.free.u, body.free.w);
    }
    row[pressed] = wishes[p].pressed;
    row[drive] = wishes[p].drive;
    row[fastest] = wishes[p].fastest;
  });
  std::array<double, width> all{};
  for (std::size_t k = 0; k < rows.size(); ++k)
    all[k % width] = k % width >= drive ? std::max(all[k % width], rows[k]) : all[k % width] + rows[k];
  Scales scales{all[contacts], all[mass]};
  PartField free = parts.field();
  parts.each([&](std::size_t p) {
    for (std::size_t b = 0; b < free[p].size(); ++b) free[p][b] = parts[p].bodies[b].free;
  });
  // Contacts change no more than the momentum that comes in and what drives, gaps and restitution ask for.
  const double sound = scales.most(all[incoming]) + all[mass] * all[fastest];
  scales.momentum = std::max({std::min(distance(parts, V, free), sound),
                              all[drive] > 0 ? all[mass] * all[drive] : thresholds.interest * all[pressed],
                              thresholds.rounding * scales.most(all[incoming])});
  return scales;
}

}  // namespace

VelocityError velocity_error(std::span<BodyProblem> problems, const PartLink& link, double enough,
                             const BalanceThresholds& thresholds) {
  const BodyParts parts(problems, link);
  const double kappa = thresholds.firmness * estimate_stiffness(parts);
  const PartField V = velocities_of(parts);
  std::vector<Wishes> wishes(parts.size());
  parts.each([&](std::size_t p) { wishes[p] = wishes_of(problems[p], V[p], thresholds); });

  const Scales scales = scales_of(parts, wishes, V, thresholds);
  if (scales.contacts == 0) return {};
  const double scale = scales.momentum;
  VelocityError error;
  if (scale == 0) {  // nothing moves: overlaps may still ask for it
    if (fit_of(parts, parts.field(), wishes, kappa).missed > 0)
      error.relative = std::numeric_limits<double>::infinity();
    return error;
  }

  // Two motions to start from: none; and the one that stops everything, the answer of a sample at rest.
  PartField motion = parts.field(), stop = V;
  parts.each([&](std::size_t p) {
    for (Twist& v : stop[p]) v = {-v.u, -v.w};
  });
  double left = 0, found = 0, missed = 0;
  const auto small = [&](double part) {
    return part <= thresholds.linear_tolerance * std::max(found, enough * scale);
  };
  for (int round = 0; round < thresholds.most_rounds; ++round) {
    std::vector<std::vector<double>> rho(parts.size());
    PartField force = parts.field();
    parts.each([&](std::size_t p) {
      for (std::size_t k = 0; k < wishes[p].change.size(); ++k) {
        const ContactEquation& c = parts[p].contacts[k];
        rho[p].push_back(kappa * effective_mass(parts[p], c));
        add_force(c, rho[p][k] * wishes[p].change[k], force[p]);
      }
    });
    link.sum_copies(force);
    parts.each([&](std::size_t p) {
      for (std::size_t b = 0; b < force[p].size(); ++b) restrict_to_freedoms(parts[p].bodies[b], force[p][b]);
    });
    const PartField began = motion;
    if (fit_of(parts, stop, wishes, kappa).cost < fit_of(parts, motion, wishes, kappa).cost) motion = stop;
    BodySolver solver(parts, rho);
    PartField then = motion;
    left = thresholds.caution * scales.most(solver.begin(force, motion));
    found = momentum(parts, motion);
    // The bound counts light bodies with the mass of all. Beside a heavy body the changes over the last half
    // of the iterations and the quarter before it show better what is left.
    double before = std::numeric_limits<double>::infinity();
    for (int k = 1; k <= thresholds.most_linear && !small(left); ++k) {
      const double bound = thresholds.caution * scales.most(solver.iterate(motion));
      ++error.linear_iterations;
      if (!std::has_single_bit(static_cast<unsigned>(k)) && !small(bound)) continue;
      found = momentum(parts, motion);
      const double change = distance(parts, motion, then);
      left = k < thresholds.few_linear ? bound
                                       : std::min(bound, left_over(change, before, thresholds.unsettled));
      before = change;
      then = motion;
    }
    missed = fit_of(parts, motion, wishes, kappa).missed;
    const double pushed2 = parts.total(1, [&](std::size_t p, std::span<double> row) {
      row[0] = close_open(problems[p], motion[p], wishes[p]);
    })[0];
    if (small(scales.most(kappa * pushed2)) || (round > 0 && small(distance(parts, motion, began)))) break;
  }
  error.relative = (found + missed + left) / scale;
  return error;
}

VelocityError velocity_error(BodyProblem problem, double enough, const BalanceThresholds& thresholds) {
  const PartLink alone;
  return velocity_error({&problem, 1}, alone, enough, thresholds);
}

}  // namespace talus
