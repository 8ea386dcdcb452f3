#pragma once

#include <optional>

#include "runtime/step/frame.hpp"
#include "runtime/step/step_report.hpp"

namespace talus {

/// Sum of m v (x) v over the grains, v against the flow of the cell, of gradient G [1/s], and against the
/// mean of all [J]: a sample that moves as a whole, or falls, presses nothing. The same bits on any ranks.
/// Collective.
Mat3 kinetic_moment(const StepState& state, const Mat3& gradient, const graph::Communicator& ranks);

/// q/p of a stress, or of anything in proportion to it: q = root of 3/2 s : s, s its deviator. 0 where q is
/// 0.
double stress_ratio(const Mat3& stress);

/// Time in which the mean stress p [Pa] brings a grain on by its diameter: d root of density over p [s]. 0
/// unless p > 0.
double inertial_time(const SampleSize& size, double p);

/// The row of cell.csv of the last step; none without a periodic cell, or where nothing bounds it along an
/// axis. Collective; the same bits on any ranks.
std::optional<CellReport> cell_report(const StepOutcome& outcome, const StepReport& report,
                                      const graph::Communicator& ranks);

}  // namespace talus
