#pragma once

/// The registry of output sinks. One more is one source file beside the others, its declaration here and its
/// line in sinks.cpp; the scene's key, the reference and what --force may remove come from there.

#include <set>
#include <string>
#include <string_view>

#include "io/output/output_sink.hpp"
#include "kernels/registry.hpp"

namespace talus::io {

extern const SinkKind table_sink;
extern const SinkKind frame_sink;
extern const SinkKind run_json_sink;
extern const SinkKind field_sink;
extern const SinkKind picture_sink;
extern const SinkKind xyz_sink;
extern const SinkKind probe_sink;
extern const SinkKind grid_sink;

/// By name: no code asks for one of them.
using SinkRegistry = Registry<std::string_view, const SinkKind*>;
const SinkRegistry& sink_registry();

/// Names of the sinks that scenes switch off (SinkUse::by_default).
std::set<std::string> default_sinks();

/// True for the names, relative to the directory of a run, that Talus itself writes (docs/formats.md): those
/// of sinks, and scene.resolved.toml, trace.h5, run.log, status.json, checkpoints and dumps.
bool is_output_name(const std::string& name);

}  // namespace talus::io
