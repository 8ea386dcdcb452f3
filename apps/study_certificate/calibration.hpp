#pragma once

/// Many audited steps in a few numbers: how true errors lie against what was claimed.

#include <array>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "apps/study_certificate/audited_run.hpp"

namespace talus::audit {

/// A step and the scene that it is of.
struct StepOfScene {
  std::string scene, family;
  double tolerance = 0;  ///< asked of the scene
  AuditedStep step;
};

/// What is compared with the claim of a step.
struct Measure {
  std::string_view name, meaning;
  double TrueErrors::*error;
  bool bounded;    ///< the bounds hold for it
  bool of_forces;  ///< known only where forces are
};
std::span<const Measure> measures();

/// Quantiles of ratios: the median, 95 %, 99.9 %, and the worst. The q-quantile of n ratios is the one that
/// at least q n of them do not exceed; of none all are 0.
struct Quantiles {
  double median = 0, most = 0, nearly_all = 0, worst = 0;
};
Quantiles quantiles_of(std::vector<double> ratios);

/// One row of the table: steps of a tolerance and a family ("all": of every one), and one measure.
struct CalibrationRow {
  double tolerance = 0;
  std::string family;
  std::string_view measure;
  bool bounded = false;
  std::int64_t steps = 0, certified = 0, judged = 0;
  std::int64_t missed = 0;       ///< steps that have an answer and were not certified, overlaps aside
  std::int64_t overlapping = 0;  ///< steps beyond the tolerance on overlaps: none of them is certified
  std::int64_t unjudged = 0;     ///< certified steps without a reference
  std::int64_t unsolvable = 0;   ///< steps that have no answer
  /// Certified steps whose contacts or velocities are not those of the scene, or in which grains approach by
  /// more than is claimed whatever their velocities.
  std::int64_t disputed = 0;
  Quantiles claimed, asked;  ///< true error over claimed error, over tolerance asked for
  std::string worst;         ///< scene and step where the first is largest

  double missed_share() const;  ///< of the steps that have an answer
};

/// A row per tolerance (descending) and measure of all families, then of each family.
std::vector<CalibrationRow> calibrate(std::span<const StepOfScene> steps);

/// What a calibration has to keep.
struct CalibrationBounds {
  double nearly_all = 2;  ///< 99.9 % of the certified steps: true over claimed error
  double worst = 5;       ///< every one
  double asked = 10;      ///< every one: true error over the tolerance asked for
  double missed = 0.03;   ///< share of steps that are not certified
  double unjudged = 0.1;  ///< share of certified steps without a reference: beyond it nothing is shown
  double disputed = 0;    ///< share of certified steps that are of another problem than the scene's
};

/// A sentence for every bound that rows of "all" families break; empty when all hold.
std::vector<std::string> broken_bounds(std::span<const CalibrationRow> rows, const CalibrationBounds& bounds);

}  // namespace talus::audit
