/// Steps of dumbbells and balls against a solver that shares nothing with that of Talus but the time scheme:
/// it knows what a dumbbell is made of, sets up the dense problem with tensors of inertia and arms of its
/// own, and solves it for all contacts at once. Without friction the velocities are unique.

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "tests/validation/clump_scenes.hpp"

namespace talus::validation::clump_reference_test {
namespace {

using Quaternion = Eigen::Quaterniond;

struct Rigid {
  bool dumbbell = false;
  double m = 0;
  Vec3 x, u, spin;  ///< centre, velocity, angular momentum about it
  Quaternion q;

  Mat3 inertia() const {
    if (!dumbbell) return 0.4 * m * 0.15 * 0.15 * Mat3::Identity();
    const Vec3 e = q.toRotationMatrix().col(0);  // the axis of the smallest moment
    return across * Mat3::Identity() + (along - across) * e * e.transpose();
  }
  Vec3 omega() const { return inertia().ldlt().solve(spin); }
  void turn(double time) {
    const auto by = [](const Vec3& angle) {
      return Quaternion(Eigen::AngleAxisd(angle.norm(), angle.normalized()));
    };
    Rigid amid = *this;
    amid.q = by(0.5 * time * omega()) * q;
    q = (by(time * amid.omega()) * q).normalized();
  }
  std::vector<Ball> balls() const {
    if (!dumbbell) return {{x, 0.15}};
    const Vec3 e = 0.5 * length * q.toRotationMatrix().col(0);
    return {{x - e, r}, {x + e, r}};
  }
};

std::vector<Rigid> bodies_of(const Experiment& run) {
  std::vector<Rigid> all;
  const Bodies& bodies = run.simulation().state().bodies;
  for (std::int64_t id = 0; id < run.simulation().bodies(); ++id) {
    const std::size_t s = run.slot(id);
    const auto& q = bodies.orientation[s];
    const bool dumbbell = bodies.shape[s] != 0;
    all.push_back({dumbbell, dumbbell ? mass : 3, run.x(id), run.u(id), spin_of(run, id),
                   Quaternion(q[0], q[1], q[2], q[3])});
  }
  return all;
}

/// One step between the walls of a box; what may touch is a matter of `alert` and of speeds.
class Reference {
 public:
  Reference(std::vector<Rigid> bodies, const Vec3& gravity, double edge, double alert)
      : bodies_(std::move(bodies)), edge_(edge), alert_(alert) {
    for (Rigid& b : bodies_) {
      b.x += 0.5 * h * b.u;
      b.turn(0.5 * h);
      b.u += h * gravity;
    }
    find_contacts();
    solve();
  }
  const std::vector<Rigid>& bodies() const { return bodies_; }
  std::size_t contacts() const { return rows_.size(); }
  /// Largest violation of the conditions that the solution is known by [m/s].
  double violation() const { return violation_; }

 private:
  struct Row {
    std::size_t a, b;
    Vec3 n, arm_a, arm_b;
    double bias;
    bool wall;
  };
  double speed(const Row& row) const {
    const auto part = [&](const Rigid& body, const Vec3& arm) {
      return row.n.dot(body.u + body.omega().cross(arm));
    };
    return part(bodies_[row.a], row.arm_a) - (row.wall ? 0 : part(bodies_[row.b], row.arm_b));
  }
  /// Of balls that turn about one another on their way, and do not touch on it, the gap that leads along d to
  /// where they are nearest.
  static double passing_gap(const Vec3& d, const Vec3& way, double gap) {
    const double far = d.norm(), along = d.dot(way) / far;
    if (gap <= 0 || gap + along >= 0 || d.cross(way).norm() <= 1e-3 * far * far) return gap;
    const double nearest = (d - std::clamp(d.dot(way) / way.squaredNorm(), -1.0, 0.0) * way).norm();
    return nearest > far - gap ? nearest - (far - gap) - along : gap;
  }
  void add(Row row, double gap) {
    if (gap >= alert_ && gap >= -h * speed(row)) return;
    row.bias = std::max(gap, 0.0) / h;
    rows_.push_back(row);
  }
  void find_contacts() {
    for (std::size_t i = 0; i < bodies_.size(); ++i)
      for (const Ball& one : bodies_[i].balls()) {
        for (int axis = 0; axis < 3; ++axis)
          for (const double side : {1.0, -1.0}) {
            const Vec3 n = side * Vec3::Unit(axis);
            const double gap = (side > 0 ? one.centre[axis] : edge_ - one.centre[axis]) - one.radius;
            add({i, i, n, one.centre - one.radius * n - bodies_[i].x, {}, 0, true}, gap);
          }
        for (std::size_t j = i + 1; j < bodies_.size(); ++j)
          for (const Ball& other : bodies_[j].balls()) {
            const Vec3 d = one.centre - other.centre, n = d.normalized();
            const double gap = d.norm() - one.radius - other.radius;
            const Vec3 point = 0.5 * (one.centre - one.radius * n + other.centre + other.radius * n);
            const auto way_of = [](const Rigid& body, const Vec3& centre) {
              return Vec3(h * (body.u + body.omega().cross(centre - body.x)));
            };
            const Vec3 way = way_of(bodies_[i], one.centre) - way_of(bodies_[j], other.centre);
            add({i, j, n, point - bodies_[i].x, point - bodies_[j].x, 0, false}, passing_gap(d, way, gap));
          }
      }
  }
  /// By active sets (Lawson and Hanson 1974) on the dense dual problem: r >= 0, W r + q >= 0, one of them 0.
  void solve() {
    const auto n = static_cast<Eigen::Index>(rows_.size()),
               dofs = static_cast<Eigen::Index>(6 * bodies_.size());
    Eigen::MatrixXd G = Eigen::MatrixXd::Zero(n, dofs), inverse = Eigen::MatrixXd::Zero(dofs, dofs);
    Eigen::VectorXd q(n);
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
      const auto at = static_cast<Eigen::Index>(6 * b);
      inverse.block<3, 3>(at, at) = Mat3::Identity() / bodies_[b].m;
      inverse.block<3, 3>(at + 3, at + 3) = bodies_[b].inertia().inverse();
    }
    for (Eigen::Index k = 0; k < n; ++k) {
      const Row& row = rows_[static_cast<std::size_t>(k)];
      const auto put = [&](std::size_t body, const Vec3& arm, double sign) {
        const auto at = static_cast<Eigen::Index>(6 * body);
        G.block<1, 3>(k, at) += sign * row.n.transpose();
        G.block<1, 3>(k, at + 3) += sign * arm.cross(row.n).transpose();
      };
      put(row.a, row.arm_a, 1);
      if (!row.wall) put(row.b, row.arm_b, -1);
      q[k] = speed(row) + row.bias;
    }
    const Eigen::MatrixXd W = G * inverse * G.transpose();
    Eigen::VectorXd r = Eigen::VectorXd::Zero(n);
    std::vector<Eigen::Index> active;
    for (int round = 0; round < 1000; ++round) {
      Eigen::VectorXd v = W * r + q;
      Eigen::Index worst = -1;
      for (Eigen::Index k = 0; k < n; ++k)
        if (v[k] < -1e-12 && std::ranges::find(active, k) == active.end() && (worst < 0 || v[k] < v[worst]))
          worst = k;
      if (worst < 0) break;
      active.push_back(worst);
      drop_negative(W, q, active, r);
    }
    const Eigen::VectorXd v = W * r + q;
    for (Eigen::Index k = 0; k < n; ++k)
      violation_ = std::max({violation_, -v[k], -r[k], r[k] > 0 ? std::abs(v[k]) : 0});
    const Eigen::VectorXd P = G.transpose() * r;
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
      const auto at = static_cast<Eigen::Index>(6 * b);
      bodies_[b].u += P.segment<3>(at) / bodies_[b].m;
      bodies_[b].spin += P.segment<3>(at + 3);
    }
  }
  static void drop_negative(const Eigen::MatrixXd& W, const Eigen::VectorXd& q,
                            std::vector<Eigen::Index>& active, Eigen::VectorXd& r) {
    while (!active.empty()) {
      const auto count = static_cast<Eigen::Index>(active.size());
      Eigen::MatrixXd A(count, count);
      Eigen::VectorXd c(count);
      for (Eigen::Index i = 0; i < count; ++i) {
        c[i] = -q[active[static_cast<std::size_t>(i)]];
        for (Eigen::Index j = 0; j < count; ++j)
          A(i, j) = W(active[static_cast<std::size_t>(i)], active[static_cast<std::size_t>(j)]);
      }
      const Eigen::VectorXd wish = A.completeOrthogonalDecomposition().solve(c);
      double step = 1;
      for (Eigen::Index i = 0; i < count; ++i) {
        const double now = r[active[static_cast<std::size_t>(i)]];
        if (wish[i] <= 0) step = std::min(step, now / (now - wish[i] + 1e-300));
      }
      for (Eigen::Index i = 0; i < count; ++i) {
        double& now = r[active[static_cast<std::size_t>(i)]];
        now += step * (wish[i] - now);
      }
      if (step == 1) return;
      std::erase_if(active, [&](Eigen::Index k) {
        if (r[k] > 1e-14) return false;
        r[k] = 0;
        return true;
      });
    }
  }

  std::vector<Rigid> bodies_;
  double edge_, alert_, violation_ = 0;
  std::vector<Row> rows_;
};

TEST(ClumpReference, GivesTheVelocitiesOfEveryStepWithoutFriction) {
  for (const int side : {2, 3}) {
    const double edge = 0.42 * side;
    ClumpScene scene = cloud(side, 0, 0);
    add_box(scene, edge);
    scene.stage().gravity = {0, 0, -g_earth};
    scene.setup.solver.tolerance = 1e-11;
    Experiment run(scene);
    std::size_t most = 0;
    for (int k = 0; k < 400; ++k) {
      const Simulation& simulation = run.simulation();
      const std::vector<Rigid> before = bodies_of(run);
      run.step();
      const Reference reference(before, simulation.stage().gravity, edge, simulation.parameters().alert);
      ASSERT_LT(reference.violation(), 1e-10) << "the reference is no solution, step " << k;
      most = std::max(most, reference.contacts());
      for (std::size_t b = 0; b < before.size(); ++b) {
        const auto id = static_cast<std::int64_t>(b);
        const Rigid& expected = reference.bodies()[b];
        ASSERT_LT((run.u(id) - expected.u).norm(), 1e-7) << "step " << k << ", body " << b;
        ASSERT_LT((spin_of(run, id) - expected.spin).norm(), 1e-7) << "step " << k << ", body " << b;
      }
    }
    EXPECT_GT(most, 8u) << "nothing touched";
  }
}

}  // namespace
}  // namespace talus::validation::clump_reference_test
