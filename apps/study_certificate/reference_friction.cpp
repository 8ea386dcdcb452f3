#include <Eigen/Dense>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <deque>
#include <numeric>

#include "apps/study_certificate/friction_newton.hpp"
#include "apps/study_certificate/reference.hpp"

namespace talus::audit {

namespace {

using Vector = Eigen::VectorXd;

Eigen::Map<Vec3> at(Vector& r, std::size_t c) {
  return Eigen::Map<Vec3>(r.data() + 3 * c);
}
Eigen::Map<const Vec3> at(const Vector& r, std::size_t c) {
  return Eigen::Map<const Vec3>(r.data() + 3 * c);
}

Vector joined(std::span<const Vec3> impulses) {
  Vector r(static_cast<Eigen::Index>(3 * impulses.size()));
  for (std::size_t c = 0; c < impulses.size(); ++c) at(r, c) = impulses[c];
  return r;
}

std::vector<Vec3> parted(const Vector& r) {
  std::vector<Vec3> impulses(static_cast<std::size_t>(r.size() / 3));
  for (std::size_t c = 0; c < impulses.size(); ++c) impulses[c] = at(r, c);
  return impulses;
}

/// Projected Gauss-Seidel on vectors in the frame of the scene.
class Sweeps {
 public:
  explicit Sweeps(const StepProblem& problem) : problem_(problem) {
    for (const StepContact& contact : problem.contacts) {
      if (contact.levers) {
        mobility_.push_back(by_levers(contact));
        continue;
      }
      Mobility m{1 / problem.mass[contact.first], 0};
      m.tangential = m.normal + problem.spin_mobility[contact.first];
      if (contact.at_wall()) {
        m.normal += problem.wall_inv_mass[contact.wall()];
      } else {
        m.normal += 1 / problem.mass[contact.other()];
        m.tangential += 1 / problem.mass[contact.other()] + problem.spin_mobility[contact.other()];
        const double of_cell = cell_mobility(problem.cell, contact.branch);
        m.normal += of_cell;
        m.tangential += of_cell;
      }
      mobility_.push_back(m);
    }
  }

  std::size_t contacts() const { return mobility_.size(); }

  /// Velocities afresh under r.
  void begin(const Vector& r) { motion_ = motion_under(problem_, parted(r)); }

  /// One pass, forwards or backwards. Velocities must be those under r.
  void sweep(Vector& r, bool backwards) {
    const std::size_t count = contacts();
    for (std::size_t k = 0; k < count; ++k) solve(backwards ? count - 1 - k : k, r);
  }

 private:
  struct Mobility {
    double normal, tangential;
  };

  /// Normal and tangential parts of a clump's contact depend on one another: the largest response of all
  /// stands for both, with which sweeps still converge.
  Mobility by_levers(const StepContact& contact) const {
    Mat3 W = Mat3::Zero();
    const double moves = contact.is_moment() ? 0 : 1;
    const auto add = [&](std::size_t body, const Mat3& lever) {
      W += moves * Mat3::Identity() / problem_.mass[body] +
           problem_.spin_mobility[body] * lever * lever.transpose();
    };
    add(contact.first, contact.levers->first);
    if (!contact.at_wall())
      add(contact.other(), contact.levers->second);
    else
      W += moves * problem_.wall_inv_mass[contact.wall()] * contact.normal * contact.normal.transpose();
    const double most = Eigen::SelfAdjointEigenSolver<Mat3>(W).eigenvalues()[2];
    return {most, most};
  }

  static Vec3 bounded(Vec3 tangential, double most) {
    const double size = tangential.norm();
    if (size > most) tangential *= size > 0 ? most / size : 0;
    return tangential;
  }

  /// The impulse that meets the law at contact c, everything else held.
  Vec3 answer(std::size_t c, const Vector& r, const Vec3& v) const {
    const StepContact& contact = problem_.contacts[c];
    const Vec3 &n = contact.normal, now = at(r, c);
    if (contact.is_moment())
      return bounded(now - v / mobility_[c].tangential,
                     contact.friction * std::max(0.0, at(r, c - 1).dot(n)));
    const double v_n = v.dot(n), r_n = now.dot(n);
    const double normal = std::max(0.0, r_n - (v_n + contact.bias) / mobility_[c].normal);
    if (contact.friction == 0) return normal * n;
    return normal * n +
           bounded(now - r_n * n - (v - v_n * n) / mobility_[c].tangential, contact.friction * normal);
  }

  void solve(std::size_t c, Vector& r) {
    const StepContact& contact = problem_.contacts[c];
    const Vec3 now = at(r, c);
    const Vec3 next = answer(c, r, relative_velocity(contact, motion_));
    at(r, c) = next;
    add_impulse(problem_, contact, next - now, motion_);
  }

  const StepProblem& problem_;
  std::vector<Mobility> mobility_;
  Motion motion_;
};

/// Anderson's extrapolation of a fixed point x = g(x), by the last few differences.
class Anderson {
 public:
  /// From x and g(x): the next x.
  Vector next(const Vector& x, const Vector& g) {
    const Vector f = g - x;
    if (last_f_.size() > 0) {
      df_.push_back(f - last_f_);
      dg_.push_back(g - last_g_);
      if (df_.size() > depth) df_.pop_front(), dg_.pop_front();
    }
    last_f_ = f;
    last_g_ = g;
    if (df_.empty()) return g;
    const auto m = static_cast<Eigen::Index>(df_.size());
    Eigen::MatrixXd normal(m, m);
    Vector right(m);
    for (Eigen::Index a = 0; a < m; ++a) {
      right[a] = df_[static_cast<std::size_t>(a)].dot(f);
      for (Eigen::Index b = 0; b <= a; ++b)
        normal(a, b) = normal(b, a) = df_[static_cast<std::size_t>(a)].dot(df_[static_cast<std::size_t>(b)]);
    }
    normal.diagonal() *= 1 + 1e-12;
    const Vector weight = normal.ldlt().solve(right);
    if (!weight.allFinite()) return forget(), g;
    Vector x_next = g;
    for (Eigen::Index a = 0; a < m; ++a) x_next -= weight[a] * dg_[static_cast<std::size_t>(a)];
    return x_next;
  }

  void forget() {
    df_.clear(), dg_.clear();
    last_f_.resize(0);
  }

 private:
  static constexpr std::size_t depth = 10;
  std::deque<Vector> df_, dg_;
  Vector last_f_, last_g_;
};

/// Passes before the extrapolation begins: they find out which contacts carry.
constexpr std::int64_t plain_passes = 20;

/// Newton's method is to leave this part of the residual that is enough: it comes at no cost.
constexpr double sharpness = 1e-2;

/// Largest difference of impulses over the largest impulse.
double difference(const Vector& a, const Vector& b) {
  const double size = b.size() > 0 ? b.cwiseAbs().maxCoeff() : 0;
  return size > 0 ? (a - b).cwiseAbs().maxCoeff() / size : 0;
}

/// Sweeps with extrapolation, until one changes impulses by no more than `enough`, or `most` are done; r in
/// and out. Returns what the best of them changed.
double accelerate(Sweeps& sweeps, Vector& r, std::int64_t most, double enough) {
  Anderson anderson;
  Vector x = r;
  double least = INFINITY;
  bool lost = false;
  for (std::int64_t pass = 0; pass < most && least > enough; ++pass) {
    Vector g = x;
    sweeps.begin(x);
    sweeps.sweep(g, false);
    sweeps.sweep(g, true);
    const double change = difference(g, x);
    if (change < least) least = change, r = g;
    if (!lost && change > 10 * least) {  // the extrapolation has left its ground
      anderson.forget();
      x = r;
      lost = true;
      continue;
    }
    lost = false;
    x = pass < plain_passes ? g : anderson.next(x, g);
  }
  return least;
}

/// Forces next to the run's (ReferenceLimits::forces).
class Forces {
 public:
  /// `rounding`: what it makes of velocities that are no error, in the kinetic norm [J^1/2].
  Forces(const FrictionNewton& newton, std::span<const Vec3> run, double unit, double rounding,
         const ReferenceLimits& limits)
      : newton_(newton), run_(run), unit_(unit), rounding_(rounding), limits_(limits) {}

  /// The run's own where they are among those; else by proximal steps. A heavy body on light ones moves by
  /// what the law's residual hardly shows, and no proximal step that holds redundant contacts lets it follow:
  /// there those forces that keep the exact velocities.
  bool take(Reference& reference) const {
    if (newton_.residual(run_, unit_) <= limits_.residual && known(run_, reference, limits_.own_velocities)) {
      reference.r.assign(run_.begin(), run_.end());
      return true;
    }
    for (double enough = limits_.forces; enough >= limits_.residual; enough /= 10) {
      std::vector<Vec3> r;
      if (!newton_.go_next_to(run_, r, unit_, enough)) break;
      if (!known(r, reference, limits_.forces_velocities)) continue;
      reference.r = r;
      return true;
    }
    const FrictionNewton::Room room{limits_.forces, unit_,
                                    limits_.forces_velocities * reference.exchanged + reference.error};
    std::vector<Vec3> r;
    if (!newton_.keep_velocities(run_, reference.exact, room, r) ||
        !known(r, reference, limits_.forces_velocities))
      return false;
    reference.r = r;
    return true;
  }

 private:
  /// The exact velocities are known but for `part` of what is exchanged, what a next step of Newton's method
  /// would change, and rounding.
  bool known(std::span<const Vec3> r, const Reference& reference, double part) const {
    return newton_.apart(r, reference.exact) <= part * reference.exchanged + reference.error + rounding_;
  }

  const FrictionNewton& newton_;
  std::span<const Vec3> run_;
  double unit_, rounding_;
  const ReferenceLimits& limits_;
};

}  // namespace

Reference solve_frictional(const StepProblem& problem, std::span<const Vec3> run,
                           const ReferenceLimits& limits) {
  Reference reference;
  reference.exact.assign(run.begin(), run.end());
  reference.residual = reference.error = reference.exchanged = 1;
  Sweeps sweeps(problem);
  const FrictionNewton newton(problem, limits.speeds);
  const FrictionNewton::Goal goal{newton.unit(run), sharpness * limits.residual, limits.proximal_steps,
                                  limits.pumped};
  const std::size_t contacts = sweeps.contacts();
  const double mass = std::accumulate(problem.mass.begin(), problem.mass.end(), 0.0);
  const Forces forces(newton, run, goal.unit, excused_roundings * problem.rounding_speed * std::sqrt(mass),
                      limits);
  Vector r = joined(run);
  // Newton's method begins at the run's own impulses: where several answers stand side by side sweeps may
  // walk from one to another. It ends quickly where the right contacts slide, stick and are open; sweeps find
  // those where it falls short, each time eight times as many.
  std::int64_t left = limits.contact_solves / static_cast<std::int64_t>(2 * contacts + 1);
  for (std::int64_t passes = 0; left > 0; passes = std::max(plain_passes, 8 * passes)) {
    accelerate(sweeps, r, std::min(left, passes), limits.residual);
    left -= passes;
    std::vector<Vec3> impulses = parted(r);
    const NewtonResult result = newton.improve(impulses, goal);
    if (!(result.residual < reference.residual)) continue;
    reference.residual = result.residual;
    reference.error = result.next;
    reference.exchanged = result.exchanged;
    reference.exact = impulses;
    if (result.residual <= limits.residual) reference.found = Found::answer;
    if (reference.found == Found::answer) break;
  }
  reference.motion = motion_under(problem, reference.exact);
  reference.r = reference.exact;
  const bool nearly = reference.uncertainty() <= limits.velocities && reference.residual <= limits.nearly;
  if (reference.found == Found::answer) {
    forces.take(reference);
  } else if (const double approach = unavoidable_approach(problem, limits); approach > 0) {
    reference.found = Found::no_answer;
    reference.residual = approach;
    reference.why = "no velocities are admissible";
  } else if (nearly && forces.take(reference)) {
    reference.found = Found::answer;
  } else if (nearly) {
    reference.found = Found::velocities;
    reference.why = "redundant contacts: forces are not known";
  } else {
    reference.why = "neither sweeps nor Newton's method find the answer";
  }
  return reference;
}

}  // namespace talus::audit
