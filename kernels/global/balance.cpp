#include "kernels/global/balance.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <vector>

#include "kernels/bodies/larger.hpp"
#include "kernels/global/body_solver.hpp"
#include "kernels/global/momentum_scale.hpp"
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
  // Per group:
  std::vector<double> drive;    ///< fastest drive among those that carry [m/s]
  std::vector<double> fastest;  ///< drive, gap to close or rebound [m/s]
  std::vector<double> pressed;  ///< sum of the impulses at walls [N s]
};

/// Of one part.
struct PartGroups {
  std::size_t number;
  const BodyGroups& groups;
  std::size_t group(const ContactEquation& c) const { return group(static_cast<std::size_t>(c.first)); }
  std::size_t group(std::size_t body) const { return static_cast<std::size_t>(groups.of(number, body)); }
  bool counts(std::size_t body) const { return groups.of(number, body) >= 0; }
};

/// Finds the wishes of `problem`, which keeps only the contacts that carry.
Wishes wishes_of(BodyProblem& problem, const PartGroups& part, std::span<const Twist> V,
                 const BalanceThresholds& thresholds) {
  Wishes wishes;
  for (std::vector<double>* of : {&wishes.drive, &wishes.fastest, &wishes.pressed})
    of->assign(part.groups.size(), 0.0);
  std::size_t kept = 0;
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
    ContactEquation c = problem.contacts[k];
    const std::size_t g = part.group(c);
    const Vec3 r = problem.impulse[k], v = constrained_velocity(c, V);
    if (c.second < 0 || problem.bodies[static_cast<std::size_t>(c.second)].kind == BodyKind::wall)
      wishes.pressed[g] += std::abs(c.normal.dot(r));
    if (c.cell >= 0)  // what its faces carry, as walls would
      wishes.pressed[g] += c.branch.norm() / problem.bodies[static_cast<std::size_t>(c.cell)].radius *
                           std::abs(c.normal.dot(r));
    wishes.fastest[g] = std::max(wishes.fastest[g], c.offset.norm());
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
    wishes.drive[g] = std::max(wishes.drive[g], c.drive);
    wishes.change.push_back(constrained(c, change));
    problem.contacts[kept] = c;
    problem.impulse[kept++] = r;
  }
  problem.contacts.resize(kept);
  problem.impulse.resize(kept);
  return wishes;
}

/// Open contacts that `motion` closes and more join those that carry; they ask only to be closed. Adds to
/// `pushed2`, per group, sum m v_n^2 of what it pushed them in [J].
void close_open(BodyProblem& problem, const PartGroups& part, std::span<const Twist> motion, Wishes& wishes,
                std::span<double> pushed2) {
  std::size_t kept = 0;
  for (std::size_t k = 0; k < wishes.open.size(); ++k) {
    const ContactEquation c = wishes.open[k];
    const double left = wishes.gap[k] + c.normal.dot(relative_velocity(c, motion));
    if (left < 0) {
      pushed2[part.group(c)] += effective_mass(problem, c) * left * left;
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
}

/// Sum m |u| + (I/R^2) |w| of the motion [N s], per group.
std::vector<double> momentum(const BodyParts& parts, const BodyGroups& groups, const PartField& motion) {
  return parts.total(groups.size(), [&](std::size_t p, std::span<double> row) {
    const PartGroups part{p, groups};
    for (std::size_t b = 0; b < motion[p].size(); ++b) {
      if (!parts[p].counted(b) || !part.counts(b)) continue;
      const BodyUnknown& body = parts[p].bodies[b];
      row[part.group(b)] += body.mass * motion[p][b].u.norm() + body.spin_mass * motion[p][b].w.norm();
    }
  });
}

/// The same of the difference of two motions.
std::vector<double> distance(const BodyParts& parts, const BodyGroups& groups, const PartField& motion,
                             const PartField& from) {
  PartField difference = motion;
  parts.each([&](std::size_t p) {
    for (std::size_t b = 0; b < motion[p].size(); ++b) {
      difference[p][b].u -= from[p][b].u;
      difference[p][b].w -= from[p][b].w;
    }
  });
  return momentum(parts, groups, difference);
}

/// How well a motion fits, per group: |d|_M^2 + sum rho |H^T d - change|^2, which is to be small [J]; and the
/// wishes that it misses, sum |H^T d - change|/W_nn [N s].
struct Fit {
  double cost, missed;
};
std::vector<Fit> fit_of(const BodyParts& parts, const BodyGroups& groups, const PartField& motion,
                        std::span<const Wishes> wishes, std::span<const double> kappa) {
  const std::vector<double> sums = parts.total(2 * groups.size(), [&](std::size_t p, std::span<double> row) {
    const PartGroups part{p, groups};
    for (std::size_t b = 0; b < motion[p].size(); ++b)
      if (parts[p].counted(b) && part.counts(b))
        row[2 * part.group(b)] += kinetic2(parts[p].bodies[b], motion[p][b].u, motion[p][b].w);
    for (std::size_t k = 0; k < wishes[p].change.size(); ++k) {
      const ContactEquation& c = parts[p].contacts[k];
      const Vec3 missed = constrained(c, relative_velocity(c, motion[p])) - wishes[p].change[k];
      const std::size_t g = part.group(c);
      row[2 * g] += kappa[g] * effective_mass(parts[p], c) * missed.squaredNorm();
      row[2 * g + 1] += effective_mass(parts[p], c) * missed.norm();
    }
  });
  std::vector<Fit> fits;
  for (std::size_t k = 0; k < sums.size(); k += 2) fits.push_back({sums[k], sums[k + 1]});
  return fits;
}

/// Groups that `stop` fits better than `motion` take it.
void begin_with_better(const BodyParts& parts, const BodyGroups& groups, std::span<const Wishes> wishes,
                       std::span<const double> kappa, const PartField& stop, PartField& motion) {
  const std::vector<Fit> stopped = fit_of(parts, groups, stop, wishes, kappa),
                         moving = fit_of(parts, groups, motion, wishes, kappa);
  parts.each([&](std::size_t p) {
    const PartGroups part{p, groups};
    for (std::size_t b = 0; b < motion[p].size(); ++b)
      if (part.counts(b) && stopped[part.group(b)].cost < moving[part.group(b)].cost)
        motion[p][b] = stop[p][b];
  });
}

/// What the error of the velocities of a group is compared with.
struct Scale {
  double contacts = 0;  ///< number, of all parts
  double mass = 0;      ///< of its bodies [kg]
  double momentum = 0;  ///< [kg m/s]; 0 where nothing moves
};

std::vector<Scale> scales_of(const BodyParts& parts, const BodyGroups& groups,
                             const std::vector<Wishes>& wishes, const PartField& V,
                             const BalanceThresholds& thresholds) {
  enum : std::size_t { contacts, mass, pressed, incoming, drive, fastest, width };
  constexpr RowColumns columns{.sums = drive, .largest = width - drive};
  const auto fill = [&](std::size_t p, std::span<double> row) {
    const PartGroups part{p, groups};
    for (std::size_t k = 0; k < wishes[p].change.size(); ++k)
      row[width * part.group(parts[p].contacts[k]) + contacts] += 1;
    for (std::size_t b = 0; b < parts[p].bodies.size(); ++b) {
      if (!parts[p].counted(b) || !part.counts(b)) continue;
      const BodyUnknown& body = parts[p].bodies[b];
      row[width * part.group(b) + mass] += body.mass;
      row[width * part.group(b) + incoming] += kinetic2(body, body.free.u, body.free.w);
    }
    for (std::size_t g = 0; g < groups.size(); ++g) {
      row[width * g + pressed] = wishes[p].pressed[g];
      row[width * g + drive] = wishes[p].drive[g];
      row[width * g + fastest] = wishes[p].fastest[g];
    }
  };
  const std::vector<double> all = parts.reduced(columns, groups.size(), fill);
  PartField free = parts.field();
  parts.each([&](std::size_t p) {
    for (std::size_t b = 0; b < free[p].size(); ++b) free[p][b] = parts[p].bodies[b].free;
  });
  const std::vector<double> exchanged = distance(parts, groups, V, free);
  std::vector<Scale> scales;
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const double* of = all.data() + width * g;
    const MomentumSums sums{.mass = of[mass],
                            .incoming = of[incoming],
                            .exchanged = exchanged[g],
                            .fastest = of[fastest],
                            .drive = of[drive],
                            .at_rest = thresholds.interest * of[pressed]};
    scales.push_back({of[contacts], of[mass], momentum_scale(sums, thresholds.rounding)});
  }
  return scales;
}

/// The bodies of all parts and the contacts of a group, or of it and those behind it.
std::vector<ContactGraph> graphs_of(const BodyParts& parts, const BodyGroups& groups, std::int32_t group,
                                    bool and_behind) {
  std::vector<ContactGraph> graphs;
  for (std::size_t p = 0; p < parts.size(); ++p) {
    ContactGraph& graph = graphs.emplace_back(graph_of(parts[p]));
    std::erase_if(graph.pairs, [&](const std::array<std::int32_t, 2>& pair) {
      const std::int32_t own = groups.of(p, static_cast<std::size_t>(pair[0]));
      return and_behind ? own < group : own != group;
    });
  }
  return graphs;
}

/// estimate_stiffness of each group: a heavy one beside it must not make a tall one soft. Behind the first
/// few, `most_groups`, the others have one together.
std::vector<double> stiffness_of(const BodyParts& parts, const BodyGroups& groups, std::int32_t most_groups) {
  if (groups.count == 1) return {estimate_stiffness(parts)};
  std::vector<double> each;
  for (std::int32_t g = 0; g < std::min(groups.count, most_groups); ++g)
    each.push_back(estimate_stiffness(graphs_of(parts, groups, g, false), parts.link()));
  if (groups.count > most_groups)
    each.resize(groups.size(), estimate_stiffness(graphs_of(parts, groups, most_groups, true), parts.link()));
  return each;
}

/// The linear solve of velocity_error, round after round.
class VelocitySolve {
 public:
  VelocitySolve(std::span<BodyProblem> problems, const PartLink& link, double enough,
                const BodyGroups& groups, const BalanceThresholds& thresholds)
      : problems_(problems),
        parts_(problems, link),
        enough_(enough),
        groups_(groups),
        thresholds_(thresholds),
        kappa_(stiffness_of(parts_, groups, thresholds.most_groups)),
        V_(velocities_of(parts_)),
        wishes_(parts_.size()),
        left_(groups.size(), 0.0),
        found_(groups.size(), 0.0) {
    for (double& kappa : kappa_) kappa *= thresholds_.firmness;
    parts_.each([&](std::size_t p) {
      wishes_[p] = wishes_of(problems_[p], {p, groups_}, V_[p], thresholds_);
    });
    scales_ = scales_of(parts_, groups_, wishes_, V_, thresholds_);
  }

  VelocityError error() {
    if (std::ranges::all_of(scales_, [](const Scale& scale) { return scale.contacts == 0; })) return {};
    VelocityError error;
    if (std::ranges::any_of(scales_, [](const Scale& scale) { return scale.momentum == 0; })) {
      // Nothing moves there: overlaps may still ask for it.
      const std::vector<Fit> still = fit_of(parts_, groups_, parts_.field(), wishes_, kappa_);
      for (std::size_t g = 0; g < scales_.size(); ++g)
        if (scales_[g].momentum == 0 && still[g].missed > 0)
          error.relative = std::numeric_limits<double>::infinity();
      const auto moves = [](const Scale& scale) { return scale.momentum != 0; };
      if (error.relative > 0 || std::ranges::none_of(scales_, moves)) return error;
    }
    // Two motions to start from: none; and the one that stops everything, the answer of a sample at rest.
    PartField motion = parts_.field(), stop = V_;
    parts_.each([&](std::size_t p) {
      for (Twist& v : stop[p]) v = {-v.u, -v.w};
    });
    std::vector<Fit> fits;
    for (int round = 0; round < thresholds_.most_rounds; ++round) {
      const PartField began = motion;
      begin_with_better(parts_, groups_, wishes_, kappa_, stop, motion);
      error.linear_iterations += solve(motion);
      fits = fit_of(parts_, groups_, motion, wishes_, kappa_);
      const std::vector<double> pushed2 =
          parts_.total(groups_.size(), [&](std::size_t p, std::span<double> row) {
            close_open(problems_[p], {p, groups_}, motion[p], wishes_[p], row);
          });
      const auto pushed = [&](std::size_t g) {
        return most_momentum(scales_[g].mass, kappa_[g] * pushed2[g]);
      };
      if (small(pushed)) break;
      if (round == 0) continue;
      const std::vector<double> change = distance(parts_, groups_, motion, began);
      if (small([&](std::size_t g) { return change[g]; })) break;
    }
    for (std::size_t g = 0; g < scales_.size(); ++g)
      if (scales_[g].momentum != 0)
        error.relative =
            larger(error.relative, (found_[g] + fits[g].missed + left_[g]) / scales_[g].momentum);
    return error;
  }

 private:
  /// momentum_of(group) is small in each group that moves [N s].
  template <class MomentumOf>
  bool small(const MomentumOf& momentum_of) const {
    for (std::size_t g = 0; g < scales_.size(); ++g) {
      const double scale = scales_[g].momentum;
      if (scale != 0 &&
          !(momentum_of(g) <= thresholds_.linear_tolerance * std::max(found_[g], enough_ * scale)))
        return false;
    }
    return true;
  }

  /// The motion that fits best, by conjugate gradients from the one given. Returns their number.
  int solve(PartField& motion) {
    std::vector<std::vector<double>> rho(parts_.size());
    PartField force = parts_.field();
    parts_.each([&](std::size_t p) {
      for (std::size_t k = 0; k < wishes_[p].change.size(); ++k) {
        const ContactEquation& c = parts_[p].contacts[k];
        rho[p].push_back(kappa_[PartGroups{p, groups_}.group(c)] * effective_mass(parts_[p], c));
        add_force(c, rho[p][k] * wishes_[p].change[k], force[p]);
      }
    });
    parts_.link().sum_copies(force);
    parts_.each([&](std::size_t p) {
      for (std::size_t b = 0; b < force[p].size(); ++b)
        restrict_to_freedoms(parts_[p].bodies[b], force[p][b]);
    });
    BodySolver solver(parts_, rho);
    PartField then = motion;
    double energy = solver.begin(force, motion);
    const auto bound = [&](std::size_t g) {
      return thresholds_.caution * most_momentum(scales_[g].mass, energy);
    };
    const auto left = [&](std::size_t g) { return left_[g]; };
    for (std::size_t g = 0; g < left_.size(); ++g) left_[g] = bound(g);
    found_ = momentum(parts_, groups_, motion);
    // The bound counts light bodies with the mass of all. Beside a heavy body the changes over the last half
    // of the iterations and the quarter before it show better what is left.
    std::vector<double> before(groups_.size(), std::numeric_limits<double>::infinity());
    int done = 0;
    while (done < thresholds_.most_linear && !small(left)) {
      energy = solver.iterate(motion);
      ++done;
      if (!std::has_single_bit(static_cast<unsigned>(done)) && !small(bound)) continue;
      found_ = momentum(parts_, groups_, motion);
      const std::vector<double> change = distance(parts_, groups_, motion, then);
      for (std::size_t g = 0; g < left_.size(); ++g)
        left_[g] = done < thresholds_.few_linear
                       ? bound(g)
                       : std::min(bound(g), left_over(change[g], before[g], thresholds_.unsettled));
      before = change;
      then = motion;
    }
    return done;
  }

  std::span<BodyProblem> problems_;
  BodyParts parts_;
  double enough_;
  const BodyGroups& groups_;
  BalanceThresholds thresholds_;
  std::vector<double> kappa_;  ///< per group
  PartField V_;
  std::vector<Wishes> wishes_;
  std::vector<Scale> scales_;
  std::vector<double> left_, found_;  ///< per group [N s]: what the last solve has left and found
};

}  // namespace

VelocityError velocity_error(std::span<BodyProblem> problems, const PartLink& link, double enough,
                             const BodyGroups& groups, const BalanceThresholds& thresholds) {
  return VelocitySolve(problems, link, enough, groups, thresholds).error();
}

VelocityError velocity_error(BodyProblem problem, double enough, const BalanceThresholds& thresholds) {
  const PartLink alone;
  return velocity_error({&problem, 1}, alone, enough, {}, thresholds);
}

}  // namespace talus
