#pragma once

/// Scenes of dumbbells, and what is conserved in them.

#include <Eigen/Geometry>
#include <random>

#include "kernels/shapes/clump_motion.hpp"
#include "tests/validation/experiment.hpp"

namespace talus::validation {

inline constexpr double h = 1e-3;

/// Of a dumbbell: two balls of 0.1 m, touching, of 1 kg each, along x.
inline constexpr double r = 0.1, ball_mass = 1, length = 0.2, mass = 2;
inline constexpr double along = 2 * 0.4 * ball_mass * r * r,
                        across = along + 2 * ball_mass * 0.25 * length * length;

inline double density() {
  return ball_mass / (4.0 / 3.0 * pi * r * r * r);
}

/// A scene of dumbbells, balls and boxes.
struct ClumpScene : Scene {
  std::array<double, 4> axes{1, 0, 0, 0};
  double radius = 0;

  explicit ClumpScene(double time_step = h) : Scene(time_step) {
    const Ball balls[] = {{{-0.5 * length, 0, 0}, r}, {{0.5 * length, 0, 0}, r}};
    const PlacedClump placed = make_clump(balls);
    axes = placed.orientation;
    radius = placed.radius;
    setup.clumps.push_back(placed.clump);
  }
  /// Turned by `turn` from its place along x.
  void dumbbell(const Vec3& centre, const Eigen::Quaterniond& turn = Eigen::Quaterniond::Identity(),
                const Vec3& u = Vec3::Zero(), const Vec3& omega = Vec3::Zero()) {
    const Eigen::Quaterniond q = turn * Eigen::Quaterniond(axes[0], axes[1], axes[2], axes[3]);
    add_clump(bodies, setup.clumps, 1, BodyId{static_cast<std::int64_t>(bodies.size())},
              {centre, {q.w(), q.x(), q.y(), q.z()}, radius, density(), u, omega});
  }
};

inline Eigen::Quaterniond about(const Vec3& axis, double angle) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle, axis));
}

inline Vec3 omega_of(const Experiment& run, std::int64_t id) {
  const StepState& state = run.simulation().state();
  const std::size_t s = run.slot(id);
  return turning_of(clumps_of(state), s, state.bodies.radius[s]) *
         Eigen::Map<const Vec3>(state.bodies.velocity[s].w);
}

/// From mass, shape and orientation alone.
inline Vec3 spin_of(const Experiment& run, std::int64_t id) {
  const StepState& state = run.simulation().state();
  const std::size_t s = run.slot(id);
  const Bodies& bodies = state.bodies;
  const double R = bodies.radius[s];
  const std::array<double, 4>& q = bodies.orientation[s];
  const Mat3 Q = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix();
  const Vec3 inertia = bodies.shape[s] == 0 ? Vec3(Vec3::Constant(0.4))
                                            : state.clumps[bodies.shape[s] - std::size_t{1}].inertia;
  return bodies.mass(s) * R * R * (Q * inertia.asDiagonal() * Q.transpose() * omega_of(run, id));
}

inline Vec3 angular_momentum(const Experiment& run) {
  Vec3 sum = Vec3::Zero();
  for (std::int64_t id = 0; id < run.simulation().bodies(); ++id)
    sum += run.simulation().state().bodies.mass(run.slot(id)) * run.x(id).cross(run.u(id)) + spin_of(run, id);
  return sum;
}

inline Vec3 momentum(const Experiment& run) {
  Vec3 sum = Vec3::Zero();
  for (std::int64_t id = 0; id < run.simulation().bodies(); ++id)
    sum += run.simulation().state().bodies.mass(run.slot(id)) * run.u(id);
  return sum;
}

inline void add_box(Scene& scene, double edge) {
  for (int axis = 0; axis < 3; ++axis) {
    const Vec3 n = Vec3::Unit(axis);
    scene.wall("low" + std::to_string(axis), Vec3::Zero(), n);
    scene.wall("high" + std::to_string(axis), edge * n, -n);
  }
}

/// `side`^3 dumbbells, every other one a ball instead, turned and thrown at random.
inline ClumpScene cloud(int side, double e, double mu, double spacing = 0.42) {
  ClumpScene scene;
  scene.stage().laws.set_all(&PairLaw::restitution, e);
  scene.friction(mu);
  scene.setup.solver.tolerance = 1e-9;
  scene.setup.solver.balance_tolerance = 1e-2;
  std::mt19937_64 random(11);
  const auto any = [&] { return 2 * static_cast<double>(random() >> 11) * 0x1p-53 - 1; };
  for (int k = 0; k < side * side * side; ++k) {
    const Vec3 centre = spacing * (Vec3(k % side, k / side % side, k / side / side) + Vec3::Constant(0.5));
    const Eigen::Quaterniond q = Eigen::Quaterniond(any(), any(), any(), any()).normalized();
    const Vec3 u = Vec3(any(), any(), any()) - (centre - Vec3::Constant(0.5 * spacing * side)),
               omega(5 * any(), 5 * any(), 5 * any());
    if (k % 2 == 0)
      scene.dumbbell(centre, q, u, omega);
    else
      scene.sphere(centre, 0.15, 3, u);
  }
  return scene;
}

}  // namespace talus::validation
