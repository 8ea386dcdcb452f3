#include "apps/study_certificate/true_errors.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

#include "kernels/bodies/larger.hpp"

namespace talus::audit {

namespace {

/// What else errors are compared with at least, as parts of other quantities of the step, and what is no
/// error: these the judge grants of its own.
struct Floors {
  double motion = 1e-9;    ///< of the momentum of all: less is rounding
  double exchange = 1e-2;  ///< of the momentum exchanged: least wall impulse
  double contact = 1e-3;   ///< likewise: least contact impulse
  double load = 1e-2;      ///< of a cluster's weight in a step: least momentum it exchanges
  double cluster = 1e-9;   ///< of a cluster's own momentum, likewise: grains that graze one another
  double row = 10;         ///< grains of a cluster beyond which their speeds add up to more
};
constexpr Floors floors;
constexpr ErrorUnits units;

/// The speed that a wall or a flow lends a contact [m/s].
double drive_at(const StepProblem& problem, const StepContact& contact) {
  if (problem.cell.repeats) return problem.drive_speed;
  if (!contact.at_wall()) return 0;
  const double of_wall =
      problem.wall_inv_mass[contact.wall()] > 0 ? 0 : problem.free.walls[contact.wall()].norm();
  return std::max(of_wall, contact.drift.norm());
}

/// On walls; with `pressed` what the law speaks of, r + pull n.
std::vector<Vec3> wall_impulses(const StepProblem& problem, std::span<const Vec3> r, bool pressed) {
  std::vector<Vec3> sum(problem.wall_normal.size(), Vec3::Zero());
  for (std::size_t c = 0; c < r.size(); ++c)
    if (const StepContact& contact = problem.contacts[c]; contact.at_wall() && !contact.is_moment())
      sum[contact.wall()] += r[c] - (pressed ? 0 : contact.pull) * contact.normal;
  return sum;
}

/// On the faces of the cell, a column for each axis that repeats.
Mat3 face_impulses(const StepProblem& problem, std::span<const Vec3> r) {
  Mat3 sum = Mat3::Zero();
  if (!problem.cell.repeats) return sum;
  for (std::size_t c = 0; c < r.size(); ++c)
    if (const StepContact& contact = problem.contacts[c]; !contact.at_wall())
      sum += (r[c] - contact.pull * contact.normal) * contact.branch.transpose();
  for (const Eigen::Index axis : {0, 1, 2})
    if (!problem.cell.repeats_along[static_cast<std::size_t>(axis)]) sum.col(axis).setZero();
  return sum;
}

double mass_of_cell(const StepProblem& problem) {
  return problem.cell.follows() ? 1 / problem.cell.mobility.maxCoeff() : 0;
}

/// Momentum that is wrong, and exchanged, by grain, then by wall, then of the cell.
struct Momenta {
  std::vector<double> wrong, exchanged;
  double all_wrong() const { return std::accumulate(wrong.begin(), wrong.end(), 0.0); }
  double all_exchanged() const { return std::accumulate(exchanged.begin(), exchanged.end(), 0.0); }
};

/// What is left of an error beyond what rounding of positions makes of it, so many times over: of a mass, but
/// no more than `felt` [N s].
double beyond_rounding(const StepProblem& problem, double mass, double error, double times,
                       double felt = INFINITY) {
  return std::max(0.0, error - times * std::min(felt, mass * problem.rounding_speed));
}

/// Of which the part that is claimed is what rounding is excused for [m/s].
double least_known_speed(const StepProblem& problem, const StepEnd& end) {
  return excused_roundings * problem.rounding_speed / end.claimed;
}

/// Per grain: how many speeds that rounding makes its own may be off by. A row adds up those of its grains,
/// of either sign, and so do grains that one wall or cell ties together.
std::vector<double> roundings(const StepProblem& problem) {
  std::size_t count = 0;
  const std::vector<std::size_t> cluster = clusters_of(problem, count);
  std::vector<std::size_t> of_grain(problem.mass.size(), count);
  for (std::size_t c = 0; c < cluster.size(); ++c) {
    of_grain[problem.contacts[c].first] = cluster[c];
    if (!problem.contacts[c].at_wall()) of_grain[problem.contacts[c].other()] = cluster[c];
  }
  std::vector<double> grains(count + 1, 0.0), times;
  for (const std::size_t k : of_grain) ++grains[k];
  grains[count] = 0;  // those that touch nothing
  for (const std::size_t k : of_grain)
    times.push_back(excused_roundings * std::max(1.0, std::sqrt(grains[k] / floors.row)));
  return times;
}

Momenta momenta(const StepProblem& problem, const Reference& reference, const StepEnd& end) {
  Momenta found;
  // What pulls as hard as it presses exchanges nothing.
  const Motion &exact = reference.motion, &free = problem.unpulled;
  const std::vector<double> times = roundings(problem);
  for (std::size_t k = 0; k < problem.mass.size(); ++k) {
    found.wrong.push_back(beyond_rounding(problem, problem.mass[k],
                                          problem.mass[k] * (end.after.u[k] - exact.u[k]).norm(), times[k]));
    found.exchanged.push_back(problem.mass[k] * (exact.u[k] - free.u[k]).norm());
  }
  for (std::size_t w = 0; w < problem.wall_normal.size(); ++w) {
    const bool moves = problem.wall_inv_mass[w] > 0;
    const double mass = moves ? 1 / problem.wall_inv_mass[w] : 0;
    const double found_speed = end.after.walls[w].velocity,
                 right_speed = problem.wall_normal[w].dot(exact.walls[w]);
    found.wrong.push_back(moves ? mass * std::abs(found_speed - right_speed) : 0);
    found.exchanged.push_back(mass * (exact.walls[w] - free.walls[w]).norm());
  }
  found.wrong.push_back(mass_of_cell(problem) * (end.cell - exact.cell).norm());
  found.exchanged.push_back(mass_of_cell(problem) * (exact.cell - free.cell).norm());
  return found;
}

/// Per contact: mass of the grains of its cluster.
std::vector<double> cluster_masses(const StepProblem& problem) {
  std::size_t count = 0;
  const std::vector<std::size_t> cluster = clusters_of(problem, count);
  std::vector<double> mass(count, 0.0), of_contact;
  std::vector<char> seen(problem.mass.size(), 0);
  const auto add = [&](std::size_t c, std::size_t grain) {
    if (!std::exchange(seen[grain], 1)) mass[cluster[c]] += problem.mass[grain];
  };
  for (std::size_t c = 0; c < cluster.size(); ++c) {
    add(c, problem.contacts[c].first);
    if (!problem.contacts[c].at_wall()) add(c, problem.contacts[c].other());
  }
  for (const std::size_t k : cluster) of_contact.push_back(mass[k]);
  return of_contact;
}

/// Of the bodies that push one another, in the exact answer or as the run says, where the momentum error is
/// largest against what they exchange. Contacts that carry nothing would hide a column beside what is fast.
double worst_cluster(const StepProblem& problem, const Momenta& momentum, const Reference& reference,
                     const StepEnd& end) {
  const std::vector<Vec3>& exact = reference.r;
  const std::vector<std::size_t> set = joined_bodies(problem, [&](std::size_t c) {
    return exact[c] != Vec3::Zero() || reference.exact[c] != Vec3::Zero() || end.r[c] != Vec3::Zero();
  });
  struct Sums {
    double wrong = 0, exchanged = 0, mass = 0, momentum = 0, wall_impulse = 0, drive = 0, held = 0;
  };
  std::vector<Sums> sums(set.size());
  std::vector<char> seen(momentum.wrong.size(), 0);
  const std::size_t grains = problem.mass.size();
  for (std::size_t c = 0; c < exact.size(); ++c) {
    const StepContact& contact = problem.contacts[c];
    if (!contact.at_wall() && set[contact.first] != set[contact.other()]) continue;
    Sums& own = sums[set[contact.first]];
    own.held += contact.pull;
    const auto add = [&](std::size_t body) {
      if (seen[body]) return;
      seen[body] = 1;
      own.wrong += momentum.wrong[body];
      own.exchanged += momentum.exchanged[body];
      if (body >= grains) return;
      own.mass += problem.mass[body];
      own.momentum += problem.mass[body] * problem.unpulled.u[body].norm();
    };
    add(contact.first);
    if (!contact.at_wall())
      add(contact.other());
    else if (problem.wall_inv_mass[contact.wall()] > 0 && set[grains + contact.wall()] == set[contact.first])
      add(grains + contact.wall());
    if (problem.cell.follows() && !contact.at_wall()) add(momentum.wrong.size() - 1);
    if (contact.at_wall() && !contact.is_moment())
      own.wall_impulse = std::max(own.wall_impulse, (exact[c] - contact.pull * contact.normal).norm());
    if (!contact.is_moment() && (exact[c] != Vec3::Zero() || end.r[c] != Vec3::Zero()))
      own.drive = std::max(own.drive, drive_at(problem, contact));
  }
  double worst = 0;
  const double weight = problem.time_step * problem.gravity.norm();
  const double elsewhere = units.elsewhere * momentum.all_exchanged() /
                           std::accumulate(problem.mass.begin(), problem.mass.end(), 1e-300);
  for (const Sums& own : sums) {
    const double unit =
        std::max({own.exchanged, units.walls * own.wall_impulse, own.mass * own.drive,
                  floors.load * own.mass * weight, floors.cluster * own.momentum, own.mass * elsewhere,
                  own.mass * least_known_speed(problem, end), units.held * own.held, 1e-300});
    worst = std::max(worst, own.wrong / unit);
  }
  return worst;
}

}  // namespace

FeltRounding felt_rounding(const StepProblem& problem, const Reference& reference, double claimed,
                           const ReferenceLimits& limits) {
  FeltRounding felt;
  double most = 0, lightest = INFINITY, heaviest = 0, all = 0;
  const auto weigh = [&](double mass) {
    lightest = std::min(lightest, mass);
    heaviest = std::max(heaviest, mass);
    all += mass;
  };
  for (const double mass : problem.mass) weigh(mass);
  for (const double inverse : problem.wall_inv_mass)
    if (inverse > 0) weigh(1 / inverse);
  for (const Vec3& r : reference.r) most = std::max(most, r.norm());
  const bool matters = excused_roundings * all * problem.rounding_speed > claimed * most;
  if (heaviest <= units.lopsided * lightest || !matters) return felt;
  const std::vector<Vec3> walls = wall_impulses(problem, reference.exact, false);
  std::vector<double> at_contact(reference.exact.size(), 0.0), at_wall(walls.size(), 0.0);
  // All gaps wider, all narrower, and by turns, by as many roundings as impulses are excused for: a contact
  // that they close may carry nothing yet with one of them.
  constexpr std::array<std::array<double, 2>, 4> signs{{{1, 1}, {-1, -1}, {1, -1}, {-1, 1}}};
  bool any = false;
  for (const auto& sign : signs) {
    StepProblem other = problem;
    for (std::size_t c = 0; c < other.contacts.size(); ++c)
      other.contacts[c].bias += sign[c % 2] * excused_roundings * problem.rounding_speed;
    const Reference changed = solve_reference(other, reference.exact, limits);
    if (changed.found != Found::answer) continue;
    any = true;
    for (std::size_t c = 0; c < at_contact.size(); ++c)
      at_contact[c] = std::max(at_contact[c], (changed.r[c] - reference.exact[c]).norm() / excused_roundings);
    const std::vector<Vec3> pressed = wall_impulses(other, changed.r, false);
    for (std::size_t w = 0; w < walls.size(); ++w)
      at_wall[w] = std::max(at_wall[w], (pressed[w] - walls[w]).norm() / excused_roundings);
  }
  if (!any) return felt;
  // Of light grains all counts, as where there are no others: a row passes on what it makes of each.
  double light = 0;
  for (const double mass : problem.mass) light += heaviest > units.lopsided * mass ? mass : 0;
  for (double& one : at_contact) one += light * problem.rounding_speed;
  for (double& one : at_wall) one += light * problem.rounding_speed;
  return {at_contact, at_wall};
}

TrueErrors true_errors(const StepProblem& problem, const Reference& reference, const StepEnd& end,
                       const FeltRounding& felt_at) {
  TrueErrors errors;
  const double h = problem.time_step;
  const std::vector<Vec3> walls = wall_impulses(problem, reference.r, false),
                          pressed = wall_impulses(problem, reference.r, true);
  double wall_unit = 0, wall_wrong = 0, felt = 0;
  // A wall, and a contact in a row, are passed on what rounding makes of the velocities of all grains beyond.
  const std::vector<double> together = cluster_masses(problem);
  std::vector<double> resting(walls.size(), 0.0);
  for (std::size_t c = 0; c < problem.contacts.size(); ++c)
    if (const StepContact& contact = problem.contacts[c]; contact.at_wall())
      resting[contact.wall()] = std::max(resting[contact.wall()], together[c]);
  for (std::size_t w = 0; w < walls.size(); ++w) {
    wall_unit = std::max({wall_unit, pressed[w].norm(), h * std::abs(problem.wall_load[w])});
    felt = std::max({felt, walls[w].norm(), h * std::abs(problem.wall_load[w])});
    const double error = (walls[w] - h * end.after.walls[w].force).norm();
    wall_wrong = std::max(wall_wrong,
                          beyond_rounding(problem, resting[w], error, excused_roundings, felt_at.of_wall(w)));
  }
  const Mat3 faces = face_impulses(problem, reference.r), wrong = faces - face_impulses(problem, end.r);
  const double load = h * problem.cell.load.cwiseAbs().maxCoeff();
  wall_unit = std::max({wall_unit, faces.colwise().norm().maxCoeff(), load});
  felt = std::max({felt, faces.colwise().norm().maxCoeff(), load});
  wall_wrong = std::max(wall_wrong, wrong.colwise().norm().maxCoeff());
  const Momenta momentum = momenta(problem, reference, end);
  double mass = 0, speed = 0, held = 0, contact_unit = 0, contact_wrong = 0;
  for (std::size_t k = 0; k < problem.mass.size(); ++k) {
    mass += problem.mass[k];
    speed = std::max(speed, problem.unpulled.u[k].norm());
  }
  for (const StepContact& contact : problem.contacts) held += contact.pull;
  const double exchange = std::max({momentum.all_exchanged(), units.walls * felt, mass * problem.drive_speed,
                                    floors.motion * mass * speed, mass * least_known_speed(problem, end),
                                    units.held * held, 1e-300});
  for (std::size_t c = 0; c < problem.contacts.size(); ++c) {
    if (problem.contacts[c].is_moment()) continue;
    contact_unit = std::max(contact_unit, reference.r[c].norm());
    const double error = (reference.r[c] - end.r[c]).norm();
    contact_wrong = std::max(contact_wrong, beyond_rounding(problem, together[c], error, excused_roundings,
                                                            felt_at.of_contact(c)));
  }
  errors.velocity = momentum.all_wrong() / exchange;
  errors.wall_force = wall_wrong / std::max(wall_unit, floors.exchange * exchange);
  errors.contact_force = contact_wrong / std::max(contact_unit, floors.contact * exchange);
  errors.cluster = worst_cluster(problem, momentum, reference, end);
  return errors;
}

namespace {

/// Angular momentum of a clump at the end of the step [kg m^2/s]: what contacts left of it in the middle.
Vec3 turn_after(const StepProblem& problem, const Frame& after, std::size_t k) {
  return momentum_of(problem.clumps[k].gyration, problem.mass[k], {after.orientation[k], after.omega[k]});
}

}  // namespace

std::vector<Vec3> spins_at_end(const StepProblem& problem, const Frame& after) {
  std::vector<Vec3> w;
  if (after.omega.empty()) return w;
  const double E = problem.reflection;
  for (std::size_t k = 0; k < problem.mass.size(); ++k) {
    Vec3 end = after.radius[k] * after.omega[k];
    if (!problem.clumps.empty()) {
      const TurnedClump& clump = problem.clumps[k];
      end = clump.lengths * clump.inertia.inverse() * turn_after(problem, after, k);
    }
    w.push_back((end + E * problem.free.w[k]) / (1 + E));
  }
  return w;
}

double disagreement(const StepProblem& problem, const StepEnd& end) {
  const Motion motion = motion_under(problem, end.r);
  double impulse = 1e-300, most = 0;
  for (const Vec3& r : end.r) impulse = std::max(impulse, r.norm());
  for (std::size_t k = 0; k < problem.mass.size(); ++k) {
    const double m = problem.mass[k], ends = end.speeds.empty() ? 0 : end.speeds[k],
                 own = m * (end.after.u[k].norm() + problem.free.u[k].norm() + ends);
    most = larger(most, m * (motion.u[k] - end.after.u[k]).norm() / std::max(impulse, own));
    if (end.w.empty() || problem.spin_mobility[k] == 0) continue;
    const double J = 1 / problem.spin_mobility[k],
                 turning = own + J * (end.w[k].norm() + problem.free.w[k].norm());
    most = larger(most, J * (motion.w[k] - end.w[k]).norm() / std::max(impulse, turning));
  }
  // The cell gains of every contact, and prescribed components nothing.
  double all = 1e-300;
  for (std::size_t c = 0; c < end.r.size(); ++c) all += end.r[c].norm() * problem.contacts[c].branch.norm();
  all = std::max(all, problem.time_step * problem.cell.load.norm());
  const double flow = problem.cell.length * (problem.cell.before.norm() + problem.cell.gain.norm());
  double mass = mass_of_cell(problem);
  if (mass == 0) mass = std::accumulate(problem.mass.begin(), problem.mass.end(), 0.0);
  most = larger(most, mass * (motion.cell - end.cell).norm() / std::max(all, mass * flow));
  return most;
}

double energy_gain(const StepProblem& problem, const Frame& before, const Frame& after) {
  for (std::size_t w = 0; w < problem.wall_normal.size(); ++w)
    if (problem.wall_inv_mass[w] > 0) return 0;
  if (problem.drive_speed > 0 || problem.walls_move || problem.cell.repeats) return 0;
  if (std::ranges::any_of(problem.contacts, [](const StepContact& one) { return one.pull > 0; })) return 0;
  double gained = 0, free = 0, fall = 0, mass = 0, wall_impulse = 0;
  const double h = problem.time_step * (1 + problem.reflection);
  for (const WallReport& wall : after.walls) wall_impulse = std::max(wall_impulse, h * wall.force.norm());
  const auto turning = [&](const Frame& frame, std::size_t k) {
    if (frame.omega.empty()) return 0.0;
    if (problem.clumps.empty())
      return 0.2 * problem.mass[k] * (frame.radius[k] * frame.omega[k]).squaredNorm();
    // In the axes of the middle of the step: between contacts the energy is right to second order only.
    const TurnedClump& clump = problem.clumps[k];
    return clump.energy(&frame == &before ? clump.momentum : turn_after(problem, after, k));
  };
  for (std::size_t k = 0; k < problem.mass.size(); ++k) {
    const double m = problem.mass[k];
    // Not from positions: those that `overlap_correction` shifts do not fall or rise by their motion.
    const Vec3 moved = h / 2 * (before.u[k] + after.u[k]);
    gained += 0.5 * m * (after.u[k].squaredNorm() - before.u[k].squaredNorm()) -
              m * problem.gravity.dot(moved) + turning(after, k) - turning(before, k);
    free += 0.5 * m * problem.free.u[k].squaredNorm() + turning(before, k);
    fall += m * (h * problem.gravity).squaredNorm() / 8;
    mass += m;
  }
  free += std::pow(units.walls * wall_impulse, 2) / (2 * mass);
  return free > 0 ? std::max(0.0, gained - fall) / free : 0;
}

}  // namespace talus::audit
