#pragma once

#include <string>
#include <vector>

#include "apps/commands/run_messages.hpp"

namespace talus {

/// What the steps of a run give cause to doubt or to change, a sentence or more each, with a remedy: grains
/// that passed through one another, overlaps, steps without an answer or a solution, grains that found no
/// room. The same on any ranks and threads. Said at the end, written to run.json, and shown in report.html.
std::vector<std::string> run_findings(const Simulation& simulation, const Tally& tally);

}  // namespace talus
