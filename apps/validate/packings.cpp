/// Isotropic packings of spheres, pressed together from random places.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "apps/validate/cell_run.hpp"
#include "apps/validate/fits.hpp"

namespace talus::literature {

namespace {

constexpr const char* agnolin_roux = "Agnolin & Roux, Phys. Rev. E 76 (2007) 061302";

struct Packings {
  Mean solid_fraction, coordination;
};

/// When a packing counts as being at rest.
struct Rest {
  double tolerance;    ///< of its steps, at most
  double equilibrium;  ///< StageEnd::equilibrium
  double most;         ///< inertial times, if it has not come to rest before
};
/// With looser steps a packing creeps on, grows denser by overlaps, and closes contacts that need not carry.
constexpr Rest with_friction{1e-4, 3e-4, 300};
/// Without friction as many contacts carry as hold the grains: at 1e-4 overlaps add up to one in a hundred.
constexpr Rest without_friction{1e-5, 1e-4, 900};

Packings pack(std::int64_t grains, double friction, const Effort& effort, CaseResult& result,
              const std::vector<double>& radii = {0.5}) {
  std::vector<double> solid_fraction, coordination;
  const Rest& rest = friction > 0 ? with_friction : without_friction;
  Effort own = effort;
  own.tolerance = std::min(effort.tolerance, rest.tolerance);
  for (int seed = 1; seed <= effort.seeds; ++seed) {
    const CellRun run = run_cell({static_cast<std::int64_t>(effort.size * static_cast<double>(grains)),
                                  static_cast<std::uint64_t>(seed),
                                  {press_stage(friction, rest.equilibrium, rest.most)},
                                  own,
                                  1,
                                  radii});
    result.steps += run.steps;
    result.missed += run.missed;
    solid_fraction.push_back(last_of(run, "press").solid_fraction);
    coordination.push_back(last_of(run, "press").coordination);
  }
  return {mean_of(solid_fraction), mean_of(coordination)};
}

io::Chart size_chart(const std::vector<double>& x, const std::vector<double>& y, double published) {
  io::Chart chart{.name = "packing",
                  .title = "Solid fraction without friction",
                  .subtitle = "means over seeds, against the size of the sample",
                  .x_label = "N^(-1/3)",
                  .y_label = "solid fraction",
                  .series = {}};
  chart.log_x = chart.log_y = false;
  io::ChartSeries series{"Talus", {}};
  series.marks = true;
  for (std::size_t k = 0; k < x.size(); ++k) series.points.push_back({x[k], y[k]});
  chart.series.push_back(std::move(series));
  chart.levels.push_back({published, "Agnolin & Roux 2007"});
  return chart;
}

}  // namespace

CaseResult frictionless_packing_case(const Effort& effort) {
  CaseResult result;
  if (effort.brief) {
    const Packings small = pack(250, 0, effort, result);
    // Packings of 250 grains scatter by a hundredth, and are looser than large ones.
    result.measures = {{"solid fraction, 250 grains", small.solid_fraction.value, small.solid_fraction.error,
                        0.61, 0.65, agnolin_roux},
                       {"coordination without rattlers", small.coordination.value, small.coordination.error,
                        5.6, 6.2, agnolin_roux}};
    return result;
  }
  std::vector<double> x, y, errors;
  Packings largest;
  for (const std::int64_t grains : {500, 1000, 2000}) {
    largest = pack(grains, 0, effort, result);
    x.push_back(1 / std::cbrt(effort.size * static_cast<double>(grains)));
    y.push_back(largest.solid_fraction.value);
    errors.push_back(largest.solid_fraction.error);
    result.measures.push_back({fmt::format("solid fraction, {} grains", grains), largest.solid_fraction.value,
                               largest.solid_fraction.error});
  }
  result.measures.push_back({"solid fraction, extrapolated in N^(-1/3)", fit_line(x, y).start,
                             error_of_start(x, errors), 0.637, 0.641, agnolin_roux});
  result.measures.push_back({"coordination without rattlers", largest.coordination.value,
                             largest.coordination.error, 5.97, 6.03, agnolin_roux});
  result.charts.push_back(size_chart(x, y, 0.639));
  return result;
}

CaseResult packing_of_two_sizes_case(const Effort& effort) {
  CaseResult result;
  const std::int64_t grains = effort.brief ? 125 : 1000;
  const Packings equal = pack(grains, 0, effort, result);
  const Packings mixed = pack(grains, 0, effort, result, {0.5, 0.7});
  // By 0.0658 times the deviation of the sizes over their mean, which is 1/6; their skewness is 0.
  constexpr const char* desmond_weeks = "Desmond & Weeks, Phys. Rev. E 90 (2014) 022204";
  const double more = 0.0658 / 6, part = 0.003;
  Measure beyond{"beyond that of equal ones", mixed.solid_fraction.value - equal.solid_fraction.value,
                 std::hypot(mixed.solid_fraction.error, equal.solid_fraction.error)};
  // So few grains scatter by more than sizes change.
  if (!effort.brief) beyond.low = more - part, beyond.high = more + part, beyond.source = desmond_weeks;
  result.measures = {{"solid fraction", mixed.solid_fraction.value, mixed.solid_fraction.error},
                     beyond,
                     {"coordination without rattlers", mixed.coordination.value, mixed.coordination.error,
                      effort.brief ? 5.6 : 5.97, effort.brief ? 6.2 : 6.03, "as many contacts as freedoms"}};
  return result;
}

CaseResult frictional_packing_case(const Effort& effort) {
  CaseResult result;
  const Packings packing = pack(effort.brief ? 250 : 2000, 0.3, effort, result);
  const double part = effort.brief ? 0.03 : 0.02;
  result.measures = {{"solid fraction", packing.solid_fraction.value, packing.solid_fraction.error,
                      (1 - part) * 0.593, (1 + part) * 0.593, agnolin_roux},
                     {"coordination without rattlers", packing.coordination.value, packing.coordination.error,
                      (1 - part) * 4.5, (1 + part) * 4.5, agnolin_roux}};
  // A small sample has a coarse coordination number.
  if (effort.brief) result.measures[1].low = 4.2, result.measures[1].high = 5.0;
  return result;
}

}  // namespace talus::literature
