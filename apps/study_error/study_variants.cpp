#include "apps/study_error/study_variants.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "apps/shared/placed_sample.hpp"

namespace talus {

StudySample study_sample(const std::string& path, const std::vector<std::string>& overrides,
                         std::uint64_t seed) {
  std::vector<std::string> all = overrides;
  all.push_back(fmt::format("seed={}", seed));
  StudySample sample{io::load_scene(path, all), {}};
  append(place_sample(sample.scene).sample, sample.bodies);
  return sample;
}

SolverSettings at_tolerance(SolverSettings solver, double tolerance) {
  solver.balance_tolerance *= std::min(1.0, tolerance / solver.tolerance);
  solver.tolerance = tolerance;
  return solver;
}

double most_steps(std::span<const Stage> stages) {
  double sum = 0;
  for (const Stage& stage : stages) {
    double steps = std::numeric_limits<double>::infinity();
    if (stage.end.steps) steps = static_cast<double>(*stage.end.steps);
    if (stage.end.time) steps = std::min(steps, steps_in(*stage.end.time, stage.time_step));
    sum += steps;
  }
  return sum;
}

double length_in_first_steps(std::span<const Stage> stages) {
  double sum = 0;
  for (const Stage& stage : stages) sum += most_steps({&stage, 1}) * stage.time_step;
  return std::round(sum / stages.front().time_step);
}

std::string label_of(const StudyVariant& variant, std::span<const StudyVariant> all) {
  std::string label = variant.method;
  const auto add = [&](const char* what, auto member) {
    const auto own = variant.*member;
    if (std::ranges::all_of(all, [&](const StudyVariant& other) { return other.*member == own; })) return;
    label += what == std::string_view("seed") ? fmt::format(", seed {}", own)
                                              : fmt::format(", {} {}{}", own, what, own == 1 ? "" : "s");
  };
  add("subdomain", &StudyVariant::subdomains);
  add("thread", &StudyVariant::threads);
  add("seed", &StudyVariant::seed);
  return label;
}

}  // namespace talus
