/// Columns: each contact carries what stands on it, so every force is known.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "apps/stability_scenes.hpp"

namespace talus::stability {
namespace {

/// Grain 0 stands on the floor, grain k on grain k - 1, and all come to rest in one step: the contact below
/// grain k gives what stops all from k upwards. Largest error over the largest force.
Truth stacked_forces(std::vector<double> mass) {
  return [mass = std::move(mass)](const StepView& step) -> std::optional<double> {
    const std::size_t n = mass.size();
    std::vector<double> carried(n, 0.0);
    for (std::size_t k = 0; k < step.after.contact_force.size(); ++k) {
      const auto [first, second] = step.after.contact_bodies[k];
      const std::int64_t upper = std::max(first, second);
      carried[static_cast<std::size_t>(upper)] += std::abs(step.after.contact_force[k][2]);
    }
    double exact = 0, error = 0;
    for (std::size_t k = n; k-- > 0;) {
      exact += mass[k] * (-step.gravity()[2] - step.before.u[k][2] / step.time_step());
      error = std::max(error, std::abs(carried[k] - exact));
    }
    return error / exact;
  };
}

struct Grain {
  double radius_, mass;
};

Problem column(const std::vector<Grain>& grains, double mu, double time_step = natural_dt) {
  Problem made = problem(time_step, {0, 0, -earth}, mu);
  add_wall(made, "floor", Vec3::Zero(), Vec3::UnitZ());
  double height = 0;
  std::vector<double> mass;
  for (const Grain& grain : grains) {
    add_grain(made, {0, 0, height + grain.radius_}, grain.radius_, grain.mass);
    height += 2 * grain.radius_;
    mass.push_back(grain.mass);
  }
  made.truth = stacked_forces(std::move(mass));
  made.truth_from_any_state = true;
  return made;
}

std::vector<Grain> even(int count) {
  return std::vector<Grain>(static_cast<std::size_t>(count), Grain{radius, sphere_mass(radius)});
}

/// Ten grains, the uppermost or all but it `ratio` times as heavy.
std::vector<Grain> heavy_at(bool top, double ratio) {
  std::vector<Grain> grains = even(10);
  for (std::size_t k = 0; k < grains.size(); ++k)
    if ((k == 9) == top) grains[k].mass *= ratio;
  return grains;
}

}  // namespace

void add_columns(std::vector<Scene>& table) {
  for (int count : {10, 100, 300, 1000})
    table.push_back(
        {fmt::format("column-{}", count),
         fmt::format("{} grains on one another, cold start: each contact carries what stands on it", count),
         [count] { return column(even(count), 0.35); }});
  table.push_back(
      {"column-100-frictionless", "the same without friction", [] { return column(even(100), 0); }});
  table.push_back({"column-100-subdomains-8", "a column cut into 8 subdomains", [] {
                     Problem made = column(even(100), 0.35);
                     made.setup.decomposition.subdomains = 8;
                     return made;
                   }});
  for (double ratio : {1e2, 1e4, 1e6, 1e8})
    table.push_back({fmt::format("mass-ratio-top-{:.0e}", ratio),
                     "a grain so many times as heavy on top of nine",
                     [ratio] { return column(heavy_at(true, ratio), 0.35); }});
  for (double ratio : {1e4, 1e8})
    table.push_back({fmt::format("mass-ratio-bottom-{:.0e}", ratio), "nine heavy grains under a light one",
                     [ratio] { return column(heavy_at(false, ratio), 0.35); }});
  table.push_back({"mass-ratio-sandwich-1e6", "ten grains, every other one 10^6 times as heavy", [] {
                     std::vector<Grain> grains = even(10);
                     for (std::size_t k = 1; k < 10; k += 2) grains[k].mass *= 1e6;
                     return column(grains, 0.35);
                   }});
  for (double ratio : {10.0, 100.0})
    table.push_back({fmt::format("radius-ratio-column-{}", ratio),
                     "large and small grains of one density in turns, a large one on top", [ratio] {
                       std::vector<Grain> grains;
                       for (int k = 0; k < 10; ++k) {
                         const double r = k % 2 == 0 ? radius : ratio * radius;
                         grains.push_back({r, sphere_mass(r)});
                       }
                       return column(grains, 0.35);
                     }});
  for (double mu : {0.1, 1.0, 10.0})
    table.push_back({fmt::format("friction-column-{}", mu), "a column of 30 with that coefficient",
                     [mu] { return column(even(30), mu); }});
  for (double factor : {1e-2, 1e-1, 1e1, 1e2})
    table.push_back({fmt::format("time-step-column-{:.0e}", factor),
                     "a column of 30 at so many times the natural step",
                     [factor] { return column(even(30), 0.35, factor * natural_dt); }});
}

}  // namespace talus::stability
