#pragma once

/// A step for the judge of `talus study certificate`, from grains and walls.

#include <numbers>

#include "apps/shared/sample_builder.hpp"
#include "apps/study_certificate/reference.hpp"
#include "kernels/samples/sample.hpp"

namespace talus::audit {

inline constexpr double R = 0.01, density = 2600, h = 1e-3, g = 9.81;

inline double mass_of(double radius) {
  return density * 4 / 3 * std::numbers::pi * radius * radius * radius;
}

/// Grains and walls of one step, as a frame and a setup.
struct Step {
  Frame before;
  Bodies bodies;
  Setup setup;
  Stage stage;

  Step(double gravity, double friction, double restitution = 0) {
    stage.time_step = h;
    stage.gravity = {0, 0, -gravity};
    stage.laws = laws_of_one_material(friction, friction, restitution);
  }
  void grain(const Vec3& x, double radius, const Vec3& u = Vec3::Zero()) {
    const auto id = static_cast<std::int64_t>(before.x.size());
    before.id.push_back(id);
    before.x.push_back(x);
    before.radius.push_back(radius);
    before.u.push_back(u);
    before.omega.push_back(Vec3::Zero());
    add_sphere(bodies, BodyId{id}, x, radius, density);
  }
  Wall& wall(const Vec3& point, const Vec3& normal) {
    Wall made;
    made.point = point;
    made.normal = normal.normalized();
    return setup.walls.emplace_back(made);
  }
  StepProblem problem() const {
    std::vector<double> loads;
    for (const Wall& one : setup.walls) loads.push_back(one.load.force);
    return rebuild_step({before, setup.walls, loads, stage, bodies, setup});
  }
};

/// With the exact forces in place of those next to a run's.
inline Reference solved(const StepProblem& problem) {
  const std::vector<Vec3> nothing(problem.contacts.size(), Vec3::Zero());
  Reference answer = solve_reference(problem, nothing);
  answer.r = answer.exact;
  return answer;
}

/// A pile in a corner, in motion, so that some contacts open and others close.
inline Step small_pile(double friction, std::uint64_t seed) {
  Step step(g, friction);
  Draws draws(seed, 7);
  const std::vector<double> radii(6, R);
  const std::vector<Vec3> centres = deposit(radii, 5 * R, 5 * R);
  for (const Vec3& x : centres) step.grain(x, R, Vec3(2 * g * h * draws.direction()));
  step.wall(Vec3::Zero(), Vec3::UnitX());
  step.wall(Vec3::Zero(), Vec3::UnitY());
  step.wall(Vec3::Zero(), Vec3::UnitZ());
  return step;
}

}  // namespace talus::audit
