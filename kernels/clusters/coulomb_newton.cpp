#include "kernels/clusters/coulomb_newton.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <tuple>
#include <vector>

#include "kernels/bodies/larger.hpp"
#include "kernels/clusters/block_elimination.hpp"
#include "kernels/clusters/freedoms.hpp"
#include "kernels/global/natural_map.hpp"
#include "kernels/global/stiffness.hpp"

namespace talus {

namespace {

using Vector = Eigen::VectorXd;

/// A contact and the columns of H that belong to it: what impulses along x, y and z do to the blocks of
/// freedoms that it touches.
struct Columns {
  Freedoms::Column blocks;  ///< which ones: values are those of x
  std::array<Eigen::Matrix<double, 6, 3>, std::tuple_size_v<Freedoms::Column>> H;
};

/// Loops that pairs of bodies close which have contacts, in a cluster.
std::ptrdiff_t loops_of(const BodyProblem& problem) {
  std::vector<std::array<std::int32_t, 2>> pairs;
  for (const ContactEquation& c : problem.contacts)
    if (c.second >= 0) pairs.push_back({std::min(c.first, c.second), std::max(c.first, c.second)});
  std::sort(pairs.begin(), pairs.end());
  const auto pairs_end = std::unique(pairs.begin(), pairs.end());
  const std::size_t bodies = problem.bodies.size() - (problem.has_cell() ? 1 : 0);
  return pairs_end - pairs.begin() - static_cast<std::ptrdiff_t>(bodies) + 1;
}

/// What steps have still to change.
struct LinearRest {
  double momentum = std::numeric_limits<double>::infinity();  ///< of the motion [N s]
  double impulse = std::numeric_limits<double>::infinity();   ///< of a contact, over the largest of all
};

/// The problem of a step, around impulses t.
class CoulombStep {
 public:
  explicit CoulombStep(const BodyProblem& problem)
      : problem_(problem), freedoms_(problem), mass_(freedoms_.masses()) {
    const std::vector<Twist> V = velocities_of(problem, problem.impulse);
    for (const ContactEquation& c : problem.contacts) {
      velocity_.push_back(constrained_velocity(c, V));
      add_columns(c);
    }
  }

  Vector none() const { return Vector::Zero(freedoms_.size()); }
  std::vector<Twist> twists(const Vector& d) const { return freedoms_.twists(d); }
  /// |f| in the norm of M^-1 times the root of all masses: at least the sum of |f| over the bodies [N s].
  double size(const Vector& f) const { return std::sqrt(mass_.sum() * f.cwiseQuotient(mass_).dot(f)); }

  /// v + b n [m/s].
  Vec3 velocity(std::size_t k, const Vector& d) const {
    return velocity_[k] + constrained(problem_.contacts[k], change(k, d));
  }
  /// r(d), and where asked for P' rho.
  Vec3 impulse(std::size_t k, const Vector& d, double firmness, const std::vector<Vec3>& t,
               Mat3* slope = nullptr) const {
    const ContactEquation& c = problem_.contacts[k];
    const Mat3 along = c.normal * c.normal.transpose();
    const Mat3 rho = firmness * (normal_[k] * along + tangential_[k] * (Mat3::Identity() - along));
    const Vec3 z = t[k] - rho * velocity(k, d), side = tangential(c, z);
    const double z_n = c.normal.dot(z), most = c.mu * z_n, length = side.norm();
    if (slope != nullptr) slope->setZero();
    if (!(z_n > 0)) return Vec3::Zero();
    if (c.mu > 0 && length <= most) {
      if (slope != nullptr) *slope = rho;
      return z;
    }
    const Vec3 direction = c.mu > 0 ? Vec3(side / length) : Vec3(Vec3::Zero());
    if (slope != nullptr) {
      *slope = along + c.mu * direction * c.normal.transpose();
      if (c.mu > 0) *slope += most / length * (Mat3::Identity() - along - direction * direction.transpose());
      *slope = (*slope * rho).eval();
    }
    return z_n * c.normal + most * direction;
  }
  /// M d - H (r(d) - r) [N s].
  Vector residual(const Vector& d, double firmness, const std::vector<Vec3>& t) const {
    Vector f = mass_.cwiseProduct(d);
    for (std::size_t k = 0; k < columns_.size(); ++k)
      add_force(k, problem_.impulse[k] - impulse(k, d, firmness, t), f);
    return f;
  }
  /// Newton's step from d, where the residual is f; its work is taken off. False where there is none.
  bool way(const Vector& d, const Vector& f, double firmness, const std::vector<Vec3>& t, Vector& way,
           double& work) const {
    const std::vector<Mat3> slope = slopes(d, firmness, t);
    const BlockElimination system = eliminated(slope, work);
    way = system.solve(-f);
    way -= system.solve(f + product(slope, way));
    return way.allFinite();
  }
  /// What steps behind the one from impulses t to d change in all, if contacts stay as they are. To the
  /// motion: the R with H^T R = -(v + H^T d) at those that carry. That step has changed their impulses by
  /// what this asks for over rho, and has left a `residual`: (M + K) R = H (r(d) - t) - residual, of which K
  /// = H P' rho H^T need not have an inverse, and is made so firm that M hardly counts. To the impulses: what
  /// that firm step from there would add, r - t as often as it is firmer less P' rho H^T R; at contacts that
  /// open in this step all of t counts so, as who carries is then still being decided. Infinite where there
  /// is no solution.
  LinearRest linear_rest(const Vector& d, double firmness, double firm_enough, const std::vector<Vec3>& t,
                         double& work) const {
    const double times = firm_enough / firmness;
    std::vector<Mat3> slope = slopes(d, firmness, t);
    for (Mat3& s : slope) s *= times;
    const BlockElimination system = eliminated(slope, work);
    Vector f = -residual(d, firmness, t);
    for (std::size_t k = 0; k < columns_.size(); ++k)
      add_force(k, times * (impulse(k, d, firmness, t) - t[k]), f);
    Vector rest = system.solve(f);
    rest -= system.solve(product(slope, rest) - f);
    if (!rest.allFinite()) return {};
    double most = 0, largest = 0;
    for (std::size_t k = 0; k < columns_.size(); ++k) {
      const Vec3 r = impulse(k, d, firmness, t);
      most = larger(most, (times * (r - t[k]) - slope[k] * change(k, rest)).norm());
      largest = larger(largest, r.norm());
    }
    return {momentum_of(problem_, twists(rest)), most > 0 ? most / largest : 0};
  }

 private:
  /// And the masses that a contact feels along its normal and across it, 1/W_nn and 1/W_tt.
  void add_columns(const ContactEquation& c) {
    Columns columns;
    Mat3 W = Mat3::Zero();
    for (int axis = 0; axis < 3; ++axis) {
      const Freedoms::Column column = freedoms_.column(c, Vec3(Vec3::Unit(axis)));
      if (axis == 0) columns.blocks = column;
      for (std::size_t b = 0; b < column.size(); ++b) columns.H[b].col(axis) = column[b].value;
    }
    for (std::size_t b = 0; b < columns.H.size(); ++b)
      for (Eigen::Index k = 0; k < columns.blocks[b].count; ++k)
        W += columns.H[b].row(k).transpose() * columns.H[b].row(k) / mass_[columns.blocks[b].begin + k];
    const double W_nn = c.normal.dot(W * c.normal);
    normal_.push_back(1 / W_nn);
    tangential_.push_back(c.mu > 0 ? 2 / (W.trace() - W_nn) : 1 / W_nn);
    columns_.push_back(columns);
  }
  /// P' rho of all contacts.
  std::vector<Mat3> slopes(const Vector& d, double firmness, const std::vector<Vec3>& t) const {
    std::vector<Mat3> slope(columns_.size());
    for (std::size_t k = 0; k < columns_.size(); ++k) impulse(k, d, firmness, t, &slope[k]);
    return slope;
  }
  /// M + H S H^T, factorised.
  BlockElimination eliminated(const std::vector<Mat3>& slope, double& work) const {
    std::vector<BlockElimination::Pair> pairs;
    for (std::size_t k = 0; k < columns_.size(); ++k) {
      if (slope[k].isZero(0)) continue;
      const Freedoms::Column& blocks = columns_[k].blocks;
      Freedoms::each_two(blocks, [&](std::size_t a, std::size_t b) {
        if (a < b) pairs.push_back({blocks[a].block, blocks[b].block});
      });
    }
    BlockElimination system(freedoms_, mass_, pairs);
    for (std::size_t k = 0; k < columns_.size(); ++k)
      if (!slope[k].isZero(0)) add_blocks(k, slope[k], system);
    system.factorise();
    work -= system.work();
    return system;
  }
  /// H S H^T of a contact.
  void add_blocks(std::size_t k, const Mat3& slope, BlockElimination& system) const {
    const auto& [blocks, H] = columns_[k];
    Freedoms::each_two(blocks, [&](std::size_t a, std::size_t b) {
      system.add(blocks[a].block, blocks[b].block, H[a] * slope * H[b].transpose());
    });
  }
  /// f += H r of a contact.
  void add_force(std::size_t k, const Vec3& r, Vector& f) const {
    const auto& [blocks, H] = columns_[k];
    for (std::size_t b = 0; b < H.size(); ++b)
      f.segment(blocks[b].begin, blocks[b].count) += H[b].topRows(blocks[b].count) * r;
  }
  /// M x + sum of H S H^T x.
  Vector product(const std::vector<Mat3>& slope, const Vector& x) const {
    Vector y = mass_.cwiseProduct(x);
    for (std::size_t k = 0; k < columns_.size(); ++k) add_force(k, slope[k] * change(k, x), y);
    return y;
  }
  /// H^T d of a contact.
  Vec3 change(std::size_t k, const Vector& d) const {
    Vec3 change = Vec3::Zero();
    const auto& [blocks, H] = columns_[k];
    for (std::size_t b = 0; b < H.size(); ++b)
      change += H[b].topRows(blocks[b].count).transpose() * d.segment(blocks[b].begin, blocks[b].count);
    return change;
  }

  const BodyProblem& problem_;
  Freedoms freedoms_;
  Vector mass_;                              ///< per freedom [kg]
  std::vector<Vec3> velocity_;               ///< v + b n at the impulses of the problem [m/s]
  std::vector<double> normal_, tangential_;  ///< 1/W_nn, 1/W_tt [kg]
  std::vector<Columns> columns_;             ///< per contact
};

/// Steps of Coulomb's law (search_by_steps), whose impulses are the next t.
class CoulombSteps {
 public:
  CoulombSteps(const BodyProblem& problem, const CoulombThresholds& thresholds)
      : problem_(problem),
        thresholds_(thresholds),
        step_(problem),
        t_(problem.impulse),
        d_(step_.none()),
        loops_(loops_of(problem)) {
    for (std::size_t k = 0; k < t_.size(); ++k) open_ += (t_[k] - mapped(k, t_[k]).carried).norm();
  }

  std::vector<Twist> motion() const { return step_.twists(d_); }

  bool solve(const StepStart& start, double& work) {
    const Vector before = d_;
    began_ = t_;
    firmness_ = start.firmness;
    const double enough = thresholds_.search.inner * std::max(start.goal, open_);
    const double most = std::max(start.goal, thresholds_.loose * open_);
    Vector f = step_.residual(d_, firmness_, t_), way;
    off_ = step_.size(f);
    for (int k = 0; k < thresholds_.most_iterations && off_ > enough && work > 0; ++k)
      if (!step_.way(d_, f, firmness_, t_, way, work) || !go_along(way, f)) break;
    if (off_ <= most) return true;
    d_ = before;
    return false;
  }

  Correction take() {
    Correction now;
    for (std::size_t k = 0; k < t_.size(); ++k) {
      const Vec3 r = step_.impulse(k, d_, firmness_, t_);
      now.open += (r - mapped(k, r).carried).norm();
      now.impulse.push_back(r - problem_.impulse[k]);
      t_[k] = r;
    }
    now.left = off_;
    now.motion = motion();
    now.found = momentum_of(problem_, now.motion);
    slow_ = now.open > thresholds_.slow * open_;
    open_ = now.open;
    return now;
  }

  std::optional<double> to_come(const Correction& now, const ClusterGoal& goal, double& work) const {
    const CoulombThresholds::Known& known = thresholds_.known;
    if (loops_ <= known.loops) return {};
    const double left = known.left * goal.enough, most = known.to_come * goal.enough;
    if (now.open > left || now.left > left || known.steps * now.moved > most) return {};
    const LinearRest linear = step_.linear_rest(d_, firmness_, known.firmness, began_, work);
    const double rest = std::max(known.steps * now.moved, linear.momentum);
    const bool creeps = goal.relative <= known.fine && !(linear.impulse <= known.forces * goal.relative);
    if (creeps || !(rest <= most)) return {};
    return rest;
  }
  bool firmer(bool small) const { return slow_ || small; }

 private:
  NaturalMap mapped(std::size_t k, const Vec3& r) const {
    return natural_map_of(problem_, problem_.contacts[k], r, step_.velocity(k, d_));
  }
  /// Takes the part of an iteration that makes the residual f smaller. False where none does.
  bool go_along(const Vector& way, Vector& f) {
    Vector there;
    double part = 1, after = off_;
    for (int halving = 0; halving <= thresholds_.halvings; ++halving, part /= 2) {
      there = d_ + part * way;
      f = step_.residual(there, firmness_, t_);
      after = step_.size(f);
      if (after <= (1 - thresholds_.descent * part) * off_) break;
    }
    if (!(after < off_)) return false;
    d_ = there;
    off_ = after;
    return true;
  }

  const BodyProblem& problem_;
  const CoulombThresholds& thresholds_;
  CoulombStep step_;
  std::vector<Vec3> t_;      ///< per contact [N s]
  std::vector<Vec3> began_;  ///< likewise, of the last step
  Vector d_;                 ///< per freedom [m/s]
  double firmness_ = 0;      ///< of the last step
  double off_ = 0;           ///< what momentum is off by behind it [N s]
  double open_ = 0;          ///< what the law finds wrong there, sum of |r - P_Kmu(...)| [N s]
  std::ptrdiff_t loops_;     ///< loops_of
  bool slow_ = false;        ///< that is hardly less than before it
};

}  // namespace

Correction coulomb_correction(const BodyProblem& problem, const ClusterGoal& goal,
                              const CorrectionThresholds& thresholds, const CoulombThresholds& coulomb,
                              double& work) {
  CoulombSteps steps(problem, coulomb);
  return search_by_steps(problem, goal, thresholds, coulomb.search, steps, work);
}

}  // namespace talus
