#include "io/output/sinks.hpp"

#include <algorithm>

#include "io/files/output_directory.hpp"

namespace talus::io {
namespace {

/// In the order in which they are driven.
constexpr SinkRegistry::Item sinks[] = {
    named("tables",
          "steps.csv, walls.csv, bodies.csv, inserted.csv, removed.csv, triaxial.csv, cell.csv and "
          "error_history.csv",
          &table_sink),
    named("probes", "probes.csv: what the probes of a scene report", &probe_sink),
    named("run", "run.json: where the numbers come from, and what came of the run", &run_json_sink),
    named("frames", "results.h5: the state at every output time, in full precision", &frame_sink),
    named("grids", "fields/field_NAME_*.vti: coarse-grained fields of every frame", &grid_sink),
    named("fields", "write frames as .vtp files for ParaView", &field_sink),
    named("pictures", "draw curves, the force network, velocities and materials", &picture_sink),
    named("xyz", "write the grains of frames as frames.xyz, for OVITO, VMD and ASE", &xyz_sink),
};

}  // namespace

const SinkRegistry& sink_registry() {
  static constexpr SinkRegistry registry("output sink", sinks);
  return registry;
}

std::set<std::string> default_sinks() {
  std::set<std::string> names;
  for (const auto& sink : sink_registry())
    if (sink.make->use == SinkUse::by_default) names.emplace(sink.name);
  return names;
}

bool is_output_name(const std::string& name) {
  return name == "scene.resolved.toml" || name == "trace.h5" || name == "run.log" || name == "status.json" ||
         name == "report.html" || name == "grains.lammpstrj" || name == "grains.vtkhdf" ||
         is_numbered_name(name, "checkpoint_", ".h5") || is_numbered_name(name, "archive_", ".h5") ||
         is_numbered_name(name, "trace_rank_", ".h5") || is_numbered_name(name, "fclib_", ".hdf5") ||
         std::ranges::any_of(sink_registry(), [&](const auto& sink) { return sink.make->writes(name); });
}

}  // namespace talus::io
