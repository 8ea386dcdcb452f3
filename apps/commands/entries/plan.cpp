#include "apps/commands/commands.hpp"

#include "apps/commands/plan.hpp"
#include "apps/shared/options.hpp"
#include "runtime/graph/mpi_communicator.hpp"

namespace talus {

namespace {

void add_options(CLI::App& app, PlanOptions& options) {
  app.add_option("scene", options.scene, "scene file")->type_name("FILE")->required();
  add_threads(app, options.threads);
  app.add_flag("--measure", options.measure, "measure what each omission saves, on the scene's sample");
  add_overrides(app, options.overrides);
}

int run(PlanOptions& options, CommandLine line) {
  // What messages cost is measured with MPI.
  const graph::MpiSession session(&line.argc, &line.argv, options.measure);
  const auto ranks = options.measure ? graph::plain_mpi(session) : graph::make_communicator(session);
  return plan_command(options, *ranks);
}

}  // namespace

Command plan_entry() {
  return command<PlanOptions>("plan", "say what a scene needs and what is left out", add_options, run);
}

}  // namespace talus
