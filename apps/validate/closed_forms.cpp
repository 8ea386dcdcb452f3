/// Cases whose answers are known exactly.

#include <algorithm>
#include <array>
#include <cmath>

#include "apps/validate/cell_run.hpp"

namespace talus::literature {

namespace {

/// Touching spheres of diameter 1 on a cubic lattice, or two that do not touch.
Sample lattice_of(int n) {
  Sample sample;
  sample.density = 1;
  for (int k = 0; k < n * n * n; ++k) {
    sample.x.emplace_back(k % n + 0.5, k / n % n + 0.5, k / n / n + 0.5);
    sample.radius.push_back(0.5);
  }
  return sample;
}

Setup exact_setup(const Vec3& edges, const Stage& stage) {
  Setup setup;
  setup.domain = periodic_domain(edges);
  setup.stages = {stage};
  setup.solver.tolerance = 1e-10;
  setup.solver.balance_tolerance = 1e-8;
  setup.solver.max_iterations = 20000;
  setup.decomposition.coupling = Coupling::nscdd;
  setup.decomposition.subdomains = 1;
  return setup;
}

}  // namespace

CaseResult lattice_case(const Effort& effort) {
  const std::array<double, 3> stress = {1, 2, 0.5};
  Stage stage = press_stage(0);
  stage.end = {};
  stage.end.steps = 5;
  for (std::size_t k = 0; k < 3; ++k) stage.stress.to[k] = stress[k];
  const Setup setup = exact_setup(Vec3::Constant(6), stage);
  CaseResult result;
  double worst = 0;
  const StepCount count = run_to_end(setup, lattice_of(6), effort.threads, [&](const Simulation& simulation) {
    const CellReport cell = simulation.cell().value();
    for (std::size_t k = 0; k < 6; ++k)
      worst = std::max(worst, std::abs(cell.stress[k] - (k < 3 ? stress[k] : 0)) / stress[0]);
  });
  result.steps = count.steps;
  result.missed = count.missed;
  result.measures = {{"stress against the one asked for, worst component and step", worst, 0, 0, 1e-7,
                      "closed form: columns carry sigma d^2"}};
  return result;
}

CaseResult free_cell_case(const Effort& effort) {
  Stage stage = press_stage(0);
  stage.time_step = 1e-3;
  stage.end = {};
  stage.end.steps = 600;
  stage.stress.to = {std::nullopt, std::nullopt, 1.0, {}, {}, {}};
  const double edge = 8;
  Setup setup = exact_setup(Vec3::Constant(edge), stage);
  setup.cell_inertia = 100;
  Sample sample = lattice_of(2);
  for (Vec3& x : sample.x) x *= 4;
  const double inertia = 100 * 8 * 3.14159265358979324 / 6;
  CaseResult result;
  double z = 0, speed = 0;
  const StepCount count =
      run_to_end(setup, std::move(sample), effort.threads, [&](const Simulation& simulation) {
        z = simulation.state().domain.cell.zz;
        speed = simulation.state().domain.rates.zz;
      });
  result.steps = count.steps;
  result.missed = count.missed;
  const double exact = std::sqrt(2 * edge * edge / (3 * inertia) * (edge * edge * edge - z * z * z));
  result.measures = {{"speed of the face over sqrt(2 A sigma (z_0^3 - z^3)/(3 M d^2))", -speed / exact, 0,
                      0.999, 1.001, "closed form: h'' = -(V sigma/(M d^2)) h"}};
  return result;
}

}  // namespace talus::literature
