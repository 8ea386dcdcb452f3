#include "apps/commands/dump_fclib.hpp"

#include <fmt/format.h>

#include <stdexcept>
#include <utility>
#include <vector>

#include "io/fclib/fclib.hpp"
#include "io/results/version.hpp"
#include "runtime/step/cell.hpp"
#include "runtime/step/global_solver.hpp"

namespace talus {

void check_dump(const Setup& setup, int ranks) {
  for (const Stage& stage : setup.stages)
    if (stage.laws.largest(&PairLaw::rolling_resistance) > 0)
      throw std::invalid_argument(fmt::format(
          "--dump-fclib: stage '{}' has rolling resistance, and FCLIB has no moments", stage.name));
  if (any_stress(setup))
    throw std::invalid_argument(
        "--dump-fclib: the cell follows a stress, and FCLIB has no cell that all contacts push; drive it by "
        "strain_rates and shear_rates");
  if (!setup.clumps.empty())
    throw std::invalid_argument("--dump-fclib knows spheres only; set sample.shape to \"sphere\"");
  if (ranks > 1)
    throw std::invalid_argument(
        fmt::format("--dump-fclib works on one rank, this run has {}; run the step on one", ranks));
  if (setup.decomposition.subdomains > 1)
    throw std::invalid_argument(
        fmt::format("--dump-fclib works with one subdomain, this scene has {}; add --set "
                    "decomposition.subdomains=1",
                    setup.decomposition.subdomains));
}

ContactMatrix matrix_of_step(const Simulation& simulation) {
  return matrix_of(contact_problem(simulation.state(), simulation.parameters()));
}

std::function<void()> fclib_dump(const Simulation& simulation, const std::filesystem::path& directory) {
  const StepParameters& parameters = simulation.parameters();
  const StepReport& report = simulation.report();
  ContactMatrix step = matrix_of_step(simulation);
  io::FclibInfo info{
      .title =
          fmt::format("Talus {}, stage {}, step {}", io::version(), simulation.stage().name, report.step),
      .description =
          fmt::format("{} grains, {} contacts, time {:.9g} s, time step {:.9g} s; /solution is what "
                      "the step found, error {:.2e}",
                      simulation.state().bodies.size(), step.problem.contacts(), report.time,
                      parameters.time_step, report.error_rms),
      .math_info =
          parameters.reflection > 0
              ? fmt::format("u = W r + q: velocities in m/s, impulses in N s, normal first; with E = {:g} of "
                            "Moreau's restitution u is (v + E v_begin)/(1 + E) and r the impulse over 1 + E; "
                            "q has the gap and restitution terms in it",
                            parameters.reflection)
              : "u = W r + q: velocities in m/s at the end of the step, impulses in N s, normal first; q has "
                "the gap and restitution terms in it"};
  return [problem = io::FclibProblem{.contact = std::move(step.problem), .global = {}}, r = std::move(step.r),
          info = std::move(info), path = directory / fmt::format("fclib_{:06}.hdf5", report.step)] {
    io::write_fclib(problem.contact, io::fclib_solution(problem, r), info, path);
  };
}

}  // namespace talus
