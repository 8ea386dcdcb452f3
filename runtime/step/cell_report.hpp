#pragma once

#include <optional>

#include "runtime/step/frame.hpp"
#include "runtime/step/step_report.hpp"

namespace talus {

/// Sum of m v (x) v over the grains, v against the flow of the cell, of gradient G [1/s], in [J]: subdomain
/// by subdomain, so that its bits are the same on any ranks. Collective.
Mat3 kinetic_moment(const StepState& state, const Mat3& gradient, const graph::Communicator& ranks);

/// The row of cell.csv of the last step; none without a periodic cell, or where nothing bounds it along an
/// axis. Collective; the same bits on any ranks.
std::optional<CellReport> cell_report(const StepOutcome& outcome, const StepReport& report,
                                      const graph::Communicator& ranks);

}  // namespace talus
