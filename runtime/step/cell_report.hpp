#pragma once

#include <optional>

#include "runtime/step/frame.hpp"
#include "runtime/step/step_report.hpp"

namespace talus {

/// The row of cell.csv of the last step; none without a periodic cell, or where nothing bounds it along an
/// axis. Collective; the same bits on any ranks.
std::optional<CellReport> cell_report(const StepOutcome& outcome, const StepReport& report,
                                      const graph::Communicator& ranks);

}  // namespace talus
