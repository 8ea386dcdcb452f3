/// Columns: each contact carries what stands on it, so every force is known.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "apps/study_stability/stability_scenes.hpp"

namespace talus::stability {
namespace {

/// Velocities at the end of a step of a column: those nearest to `free` in kinetic energy with v_0 + b_0 >= 0
/// and v_k - v_(k-1) + b_k >= 0. With B_k = b_0 + ... + b_k, v + B is the isotonic regression of free + B
/// above 0, which pooling adjacent violators gives exactly (Barlow et al. 1972).
std::vector<double> settled(const std::vector<double>& mass, const std::vector<double>& free,
                            const std::vector<double>& bias) {
  struct Pool {
    double mass, momentum;
    std::size_t count;
  };
  std::vector<Pool> pools;
  double shift = 0;
  for (std::size_t k = 0; k < mass.size(); ++k) {
    shift += bias[k];
    pools.push_back({mass[k], mass[k] * (free[k] + shift), 1});
    while (pools.size() > 1) {
      const Pool last = pools.back();
      Pool& under = pools[pools.size() - 2];
      if (under.momentum * last.mass <= last.momentum * under.mass) break;
      under = {under.mass + last.mass, under.momentum + last.momentum, under.count + last.count};
      pools.pop_back();
    }
  }
  std::vector<double> velocity;
  shift = 0;
  for (const Pool& pool : pools)
    for (std::size_t k = 0; k < pool.count; ++k) {
      shift += bias[velocity.size()];
      velocity.push_back(std::max(0.0, pool.momentum / pool.mass) - shift);
    }
  return velocity;
}

/// Columns side by side, grains counted upwards from one to the next: the contact below a grain gives what
/// it and all above it gain. Largest error over the largest force or weight of a column.
Truth stacked_forces(std::vector<std::vector<double>> columns) {
  return {[columns = std::move(columns)](const StepView& step) -> std::optional<double> {
    const double h = step.time_step();
    std::vector<double> carried(step.before.x.size(), 0.0);
    for (std::size_t k = 0; k < step.after.contact_force.size(); ++k) {
      const auto [first, second] = step.after.contact_bodies[k];
      const std::int64_t upper = std::max(first, second);
      carried[static_cast<std::size_t>(upper)] += std::abs(step.after.contact_force[k][2]);
    }
    const auto middle = [&](std::size_t k) { return step.before.x[k][2] + h / 2 * step.before.u[k][2]; };
    double error = 0, scale = 0;
    std::size_t bottom = 0;
    for (const std::vector<double>& mass : columns) {
      const std::size_t n = mass.size();
      std::vector<double> free(n), bias(n);
      for (std::size_t k = 0; k < n; ++k) {
        const std::size_t id = bottom + k;
        free[k] = step.before.u[id][2] + h * step.gravity()[2];
        const double under = k == 0 ? 0 : middle(id - 1) + step.before.radius[id - 1];
        bias[k] = std::max(0.0, middle(id) - step.before.radius[id] - under) / h;
      }
      const std::vector<double> velocity = settled(mass, free, bias);
      double exact = 0, weight = 0;
      for (std::size_t k = n; k-- > 0;) {
        exact += mass[k] * (velocity[k] - free[k]) / h;
        weight -= mass[k] * step.gravity()[2];
        error = std::max(error, std::abs(carried[bottom + k] - exact));
        scale = std::max({scale, exact, weight});
      }
      bottom += n;
    }
    return error / scale;
  }};
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
  made.truth = stacked_forces({std::move(mass)});
  return made;
}

std::vector<Grain> even(int count) {
  return std::vector<Grain>(static_cast<std::size_t>(count), Grain{radius, sphere_mass(radius)});
}

/// A grain comes down at 0.5 m/s beside a column that stands, and lands within the step.
Problem column_and_landing_grain(int count) {
  Problem made = column(even(count), 0.35);
  const double mass = sphere_mass(radius);
  add_grain(made, {20 * radius, 0, radius + 4.5e-4}, radius, mass).u[2] = -0.5;
  made.truth = stacked_forces({std::vector<double>(static_cast<std::size_t>(count), mass), {mass}});
  made.steps = 1;
  return made;
}

/// A column among grains that each lie on the floor by themselves: what is wrong in it is little of all.
Problem column_among(int count, int singles) {
  Problem made = column(even(count), 0);
  const double mass = sphere_mass(radius);
  std::vector<std::vector<double>> columns{std::vector<double>(static_cast<std::size_t>(count), mass)};
  for (int k = 1; k <= singles; ++k) {
    add_grain(made, {3 * radius * k, 0, radius}, radius, mass);
    columns.push_back({mass});
  }
  made.truth = stacked_forces(std::move(columns));
  return made;
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
  using enum Verdict;
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
  table.push_back({"column-100-among-2000", "a smooth column among 2000 single grains: each contact",
                   [] { return column_among(100, 2000); }});
  table.push_back({"column-60-landing", "a grain lands beside a column of 60: all forces",
                   [] { return column_and_landing_grain(60); }});
  for (double ratio : {1e2, 1e4, 1e6, 1e8})
    table.push_back({fmt::format("mass-ratio-top-{:.0e}", ratio),
                     "a grain so many times as heavy on top of nine",
                     [ratio] { return column(heavy_at(true, ratio), 0.35); },
                     ratio > 1e6   ? Verdicts{right, certified, honest}
                     : ratio > 1e4 ? Verdicts{right, certified}
                                   : Verdicts{right}});
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
