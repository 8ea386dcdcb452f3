/// Slow flow at constant stress.

#include <fmt/format.h>
#include <algorithm>
#include <array>

#include <cmath>
#include <numbers>
#include <vector>

#include "apps/validate/fits.hpp"
#include "apps/validate/steady.hpp"

namespace talus::literature {

namespace {

double degrees(double ratio) {
  return std::atan(ratio) * 180 / std::numbers::pi;
}

}  // namespace

CaseResult frictionless_shear_case(const Effort& effort) {
  const char* const source = "Peyneau & Roux, Phys. Rev. E 78 (2008) 011307";
  CaseResult result;
  if (effort.brief) {
    const Steady steady = flow({250, 0, 0, 0.01, 0.2}, effort, result);
    result.measures = {
        {"macroscopic angle [degrees]", degrees(steady.ratio.value), degrees(steady.ratio.error), 5.76, 14,
         "larger than of slow shear, 5.76, at I = 0.01"},
        {"solid fraction", steady.solid_fraction.value, steady.solid_fraction.error, 0.61, 0.645,
         "no dilatancy: that of the packing, 0.639"}};
    return result;
  }
  // Without friction the ratio falls as a power of I: slow shear is extrapolated, with the power of the
  // source. From 2e-4 on the rates tell powers from 0.3 to 0.5 hardly apart, and each has another angle.
  constexpr double power_of_source = 0.38;
  std::vector<double> I, ratio, errors;
  Steady slowest;
  for (const double rate : {3e-2, 1e-2, 1e-3, 2e-4}) {
    slowest = flow({500, 0, 0, rate, rate < 5e-4 ? 0.3 : 0.6}, effort, result);
    I.push_back(rate);
    ratio.push_back(slowest.ratio.value);
    errors.push_back(slowest.ratio.error);
    result.measures.push_back({fmt::format("macroscopic angle at I = {:g} [degrees]", rate),
                               degrees(slowest.ratio.value), degrees(slowest.ratio.error)});
  }
  const auto slow_angle = [&](double power) {
    const auto g = [power](double at) { return std::pow(at, power); };
    return Mean{degrees(fit_line(I, ratio, g).start), degrees(error_of_start(I, errors, g))};
  };
  for (const double power : {0.3, 0.5}) {
    const Mean angle = slow_angle(power);
    result.measures.push_back(
        {fmt::format("angle of slow shear by a power of {} [degrees]", power), angle.value, angle.error});
  }
  const Mean angle = slow_angle(power_of_source);
  result.measures.push_back(
      {fmt::format("macroscopic angle of slow shear, by a power of {} [degrees]", power_of_source),
       angle.value, angle.error, 5.46, 6.06, source});
  result.measures.push_back({"solid fraction at the slowest", slowest.solid_fraction.value,
                             slowest.solid_fraction.error, 0.63, 0.645,
                             "no dilatancy: that of the packing, 0.633 of 500 grains"});
  return result;
}

CaseResult critical_state_case(const Effort& effort) {
  CaseResult result;
  const std::vector<double> frictions =
      effort.brief ? std::vector<double>{0.3} : std::vector<double>{0, 0.1, 0.2, 0.3, 0.5, 0.8};
  io::Chart ratio = chart_of("critical-ratio", "Shear ratio at the critical state", "friction", "tau/p"),
            fraction = chart_of("critical-fraction", "Solid fraction at the critical state", "friction",
                                "solid fraction");
  ratio.log_x = ratio.log_y = fraction.log_x = fraction.log_y = false;
  std::array<io::ChartSeries, 2> ratios, fractions;
  for (std::size_t k = 0; k < 2; ++k) {
    ratios[k].name = fractions[k].name = k == 0 ? "from loose" : "from dense";
    ratios[k].hue = fractions[k].hue = ratios[k].dash = fractions[k].dash = k;
  }
  for (const double mu : frictions) {
    const double strain = effort.brief ? 0.6 : 1.5, rate = effort.brief ? 0.02 : slow;
    const std::int64_t grains = effort.brief ? 250 : 500;
    const std::array<Steady, 2> ends = {flow({grains, mu, mu, rate, strain}, effort, result),
                                        flow({grains, 0, mu, rate, strain}, effort, result)};
    for (std::size_t k = 0; k < 2; ++k) {
      ratios[k].points.push_back({mu, ends[k].ratio.value});
      fractions[k].points.push_back({mu, ends[k].solid_fraction.value});
    }
    const auto both = [&](const std::string& what, Mean Steady::*of) {
      result.measures.push_back({fmt::format("{}, friction {}", what, mu),
                                 0.5 * ((ends[0].*of).value + (ends[1].*of).value),
                                 std::hypot((ends[0].*of).error, (ends[1].*of).error) / 2});
    };
    both("tau/p", &Steady::ratio);
    both("q/p", &Steady::q_over_p);
    both("solid fraction", &Steady::solid_fraction);
    both("coordination", &Steady::coordination);
    result.measures.push_back({fmt::format("tau/p from dense less that from loose, friction {}", mu),
                               ends[1].ratio.value - ends[0].ratio.value,
                               std::hypot(ends[0].ratio.error, ends[1].ratio.error),
                               effort.brief ? -0.08 : -0.03, effort.brief ? 0.08 : 0.03,
                               "one critical state (Schofield & Wroth 1968)"});
    result.measures.push_back({fmt::format("solid fraction likewise, friction {}", mu),
                               ends[1].solid_fraction.value - ends[0].solid_fraction.value,
                               std::hypot(ends[0].solid_fraction.error, ends[1].solid_fraction.error),
                               effort.brief ? -0.02 : -0.005, effort.brief ? 0.02 : 0.005, "likewise"});
  }
  for (std::size_t k = 0; k < 2; ++k) {
    ratio.series.push_back(ratios[k]);
    fraction.series.push_back(fractions[k]);
  }
  if (!effort.brief) result.charts = {ratio, fraction};
  return result;
}

CaseResult triaxial_case(const Effort& effort) {
  CaseResult result;
  const Steady steady = flow(
      {effort.brief ? 300 : 1000, 0.35, 0.35, effort.brief ? 0.01 : slow, effort.brief ? 0.3 : 0.6, true},
      effort, result);
  const double part = effort.brief ? 0.1 : 0.05;
  result.measures = {
      {"q/p at the critical state", steady.q_over_p.value, steady.q_over_p.error, effort.brief ? 0.62 : 0.68,
       effort.brief ? 0.85 : 0.76, "0.72 of apps/scenes/triaxial-16k.toml, in a box of walls"},
      {"solid fraction", steady.solid_fraction.value, steady.solid_fraction.error},
      {"coordination without rattlers", steady.coordination.value, steady.coordination.error},
      {"0.4 (a_c + a_n + 1.5 a_t) over q/p", steady.forces.value / steady.q_over_p.value,
       steady.forces.error / steady.q_over_p.value, 1 - part, 1 + part,
       "Guo & Zhao, Comput. Geotech. 47 (2013) 1"}};
  return result;
}

}  // namespace talus::literature
