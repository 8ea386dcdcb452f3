#include "apps/study_scaling/scaling_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace talus {

const char* name_of(ScalingSource source) {
  return source == ScalingSource::run ? "run" : source == ScalingSource::replay ? "replay" : "smpi";
}

const char* name_of(ScalingKind kind) {
  return kind == ScalingKind::strong ? "strong" : kind == ScalingKind::weak ? "weak" : "hybrid";
}

namespace {

const ScalingRow* reference_of(const ScalingRow& row, const std::vector<ScalingRow>& rows) {
  const ScalingKind kind = row.kind == ScalingKind::hybrid ? ScalingKind::strong : row.kind;
  const ScalingRow* plain = nullptr;
  for (const ScalingRow& other : rows) {
    if (other.kind != kind || other.source != row.source || other.network != row.network ||
        other.cores() != 1 || other.subdomains != 1)
      continue;
    if (other.variant == row.variant) return &other;
    if (other.variant.empty()) plain = &other;
  }
  return plain;
}

}  // namespace

void relate(std::vector<ScalingRow>& rows) {
  for (ScalingRow& row : rows) {
    const ScalingRow* one = reference_of(row, rows);
    if (!one) continue;
    const double grains = static_cast<double>(row.grains) / static_cast<double>(one->grains);
    row.speedup = one->seconds * grains / row.seconds;
    row.efficiency = row.speedup / row.cores();
    // Steps without a loop need no iteration anywhere.
    row.of_iterations = row.iterations > 0 ? one->iterations / row.iterations : 1;
    row.of_sweeps = row.efficiency / row.of_iterations;
    row.work = row.of_sweeps / (row.balance * row.communication * row.within);
  }
}

std::vector<std::string> doubts_about(const std::vector<ScalingRow>& rows,
                                      const DoubtThresholds& thresholds) {
  std::vector<std::string> doubts;
  const ScalingRow* best = nullptr;
  for (const ScalingRow& row : rows)
    if (row.efficiency > (best ? best->efficiency : thresholds.efficiency)) best = &row;
  if (best)
    doubts.push_back(
        fmt::format("efficiency {:.2g} of {} scaling on {} cores is more than cores have: the time on one "
                    "was disturbed, or "
                    "parts of the sample do other work than all of it (clusters of up to 200 bodies are "
                    "solved directly); "
                    "--record 3 --typical, or more grains",
                    best->efficiency, name_of(best->kind), best->cores()));
  for (const ScalingRow& row : rows) {
    if (row.kind != ScalingKind::strong || !row.predicted() || row.cores() != 1 || row.subdomains != 1)
      continue;
    const auto measured = std::ranges::find_if(rows, [&](const ScalingRow& other) {
      return !other.predicted() && other.kind == row.kind && other.variant == row.variant &&
             other.cores() == 1 && other.subdomains == 1;
    });
    if (measured == rows.end()) continue;
    const double ratio = row.seconds / measured->seconds;
    if (ratio <= thresholds.one_core && ratio >= 1 / thresholds.one_core) continue;
    doubts.push_back(
        fmt::format("a step on one core is predicted to take {:.3g} s and takes {:.3g} s: the recording was "
                    "disturbed, and "
                    "what follows from it is as wrong; --record 3 --typical on a quiet machine",
                    row.seconds, measured->seconds));
    break;
  }
  return doubts;
}

std::string bound_of(const ScalingRow& row) {
  struct Factor {
    double value;
    const char* name;
  };
  const Factor factors[] = {{row.of_iterations, "more iterations"},
                            {row.work, "more work a sweep"},
                            {row.balance, "load imbalance"},
                            {row.communication, "exposed messages"},
                            {row.within, "waiting within ranks"},
                            {std::isfinite(row.work) ? ScalingRow::nan : row.of_sweeps, "longer iterations"}};
  const Factor* worst = nullptr;
  for (const Factor& factor : factors)
    if (std::isfinite(factor.value) && (!worst || factor.value < worst->value)) worst = &factor;
  if (!worst) return "";
  return worst->value > 0.995 ? "nothing" : fmt::format("{} ({:.2f})", worst->name, worst->value);
}

}  // namespace talus
