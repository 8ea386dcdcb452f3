#include "apps/study_certificate/calibration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>

namespace talus::audit {

namespace {

constexpr std::array all_measures = {
    Measure{"V", "velocities: momentum that is wrong over momentum exchanged", &TrueErrors::velocity, true,
            false},
    Measure{"wf", "largest error of a wall's force over the largest wall force", &TrueErrors::wall_force,
            true, true},
    Measure{"cf", "largest error of a contact's force over the largest contact force",
            &TrueErrors::contact_force, true, true},
    Measure{"cluster", "V of the bodies that push one another, where it is largest", &TrueErrors::cluster,
            true, false},
    Measure{"energy", "energy gained that nothing supplied, over the kinetic energy without contacts",
            &TrueErrors::energy, false, false}};

constexpr std::string_view all_families = "all";

CalibrationRow row_of(std::span<const StepOfScene> steps, double tolerance, std::string_view family,
                      const Measure& measure) {
  CalibrationRow row;
  row.tolerance = tolerance;
  row.family = family;
  row.measure = measure.name;
  row.bounded = measure.bounded;
  std::vector<double> claimed, asked;
  double worst = -1;
  for (const StepOfScene& one : steps) {
    if (one.tolerance != tolerance || (family != all_families && one.family != family)) continue;
    const AuditedStep& step = one.step;
    ++row.steps;
    row.unsolvable += step.judged == Judged::no_answer ? 1 : 0;
    row.overlapping += step.overlapping ? 1 : 0;
    row.missed += !step.certified && !step.overlapping && step.judged != Judged::no_answer ? 1 : 0;
    if (!step.certified) continue;
    ++row.certified;
    row.disputed += step.judged == Judged::no_answer && step.residual > step.claimed ? 1 : 0;
    row.disputed += step.judged == Judged::other_problem ? 1 : 0;
    const bool known = step.judged == Judged::yes && (step.forces_known || !measure.of_forces);
    row.unjudged += step.judged == Judged::no_reference || (step.judged == Judged::yes && !known) ? 1 : 0;
    if (!known) continue;
    ++row.judged;
    const double error = step.errors.*measure.error;
    // NaN is the worst of all.
    claimed.push_back(std::isnan(error) ? INFINITY : error / step.claimed);
    asked.push_back(std::isnan(error) ? INFINITY : error / step.asked);
    if (claimed.back() > worst) {
      worst = claimed.back();
      row.worst = fmt::format("{} step {}", one.scene, step.step);
    }
  }
  row.claimed = quantiles_of(std::move(claimed));
  row.asked = quantiles_of(std::move(asked));
  return row;
}

}  // namespace

std::span<const Measure> measures() {
  return all_measures;
}

double CalibrationRow::missed_share() const {
  return steps > 0 ? static_cast<double>(missed) / static_cast<double>(steps) : 0;
}

Quantiles quantiles_of(std::vector<double> ratios) {
  if (ratios.empty()) return {};
  std::ranges::sort(ratios);
  const auto at = [&](double q) {
    const double rank = std::ceil(q * static_cast<double>(ratios.size()) - 1e-9);
    return ratios[static_cast<std::size_t>(std::max(rank, 1.0)) - 1];
  };
  return {at(0.5), at(0.95), at(0.999), ratios.back()};
}

std::vector<CalibrationRow> calibrate(std::span<const StepOfScene> steps) {
  std::set<double, std::greater<>> tolerances;
  std::set<std::string> families;
  for (const StepOfScene& one : steps) tolerances.insert(one.tolerance), families.insert(one.family);
  std::vector<CalibrationRow> rows;
  for (const double tolerance : tolerances) {
    for (const Measure& measure : all_measures)
      rows.push_back(row_of(steps, tolerance, all_families, measure));
    for (const std::string& family : families)
      for (const Measure& measure : all_measures) {
        CalibrationRow row = row_of(steps, tolerance, family, measure);
        if (row.steps > 0) rows.push_back(std::move(row));
      }
  }
  return rows;
}

std::vector<std::string> broken_bounds(std::span<const CalibrationRow> rows,
                                       const CalibrationBounds& bounds) {
  std::vector<std::string> broken;
  std::set<double> seen;
  for (const CalibrationRow& row : rows) {
    if (row.family != all_families) continue;
    const auto check = [&](const std::string& what, double value, double most) {
      if (!(value <= most))
        broken.push_back(
            fmt::format("tolerance {:.0e}: {} is {:.3g}, beyond {:g}", row.tolerance, what, value, most));
    };
    if (seen.insert(row.tolerance).second) {
      const auto share = [&](std::int64_t count) {
        return row.certified > 0 ? static_cast<double>(count) / static_cast<double>(row.certified) : 0;
      };
      check("the share of steps that missed", row.missed_share(), bounds.missed);
      check("the share of certified steps without a reference", share(row.unjudged), bounds.unjudged);
      check("the share of certified steps of another problem", share(row.disputed), bounds.disputed);
    }
    if (!row.bounded) continue;
    check(fmt::format("the 99.9 % quantile of {} over the claim", row.measure), row.claimed.nearly_all,
          bounds.nearly_all);
    check(fmt::format("the worst {} over the claim ({})", row.measure, row.worst), row.claimed.worst,
          bounds.worst);
    check(fmt::format("the worst {} over the tolerance", row.measure), row.asked.worst, bounds.asked);
  }
  return broken;
}

}  // namespace talus::audit
