/// Flow against its rate, distribution of forces, and what the tolerance changes.

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "apps/validate/fits.hpp"
#include "apps/validate/steady.hpp"

namespace talus::literature {

CaseResult rheology_case(const Effort& effort) {
  CaseResult result;
  const std::vector<double> rates = effort.brief
                                        ? std::vector<double>{0.03, 0.3}
                                        : std::vector<double>{1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.3};
  const std::string jop = "Jop, Forterre & Pouliquen, Nature 441 (2006) 727: glass beads";
  std::vector<double> I, mu, errors, phi;
  for (const double rate : rates) {
    const Steady steady =
        flow({effort.brief ? 250 : 500, 0.4, 0.4, rate, rate < 2e-3 ? 0.6 : 1.5}, effort, result);
    I.push_back(rate);
    mu.push_back(steady.ratio.value);
    errors.push_back(steady.ratio.error);
    phi.push_back(steady.solid_fraction.value);
    result.measures.push_back(
        {fmt::format("tau/p at I = {:g}", rate), steady.ratio.value, steady.ratio.error});
    result.measures.push_back({fmt::format("solid fraction at I = {:g}", rate), steady.solid_fraction.value,
                               steady.solid_fraction.error});
  }
  result.measures.push_back({"tau/p at the fastest less that at the slowest", mu.back() - mu.front(), 0, 0.05,
                             0.5, "it grows: " + jop});
  result.measures.push_back({"solid fraction likewise", phi.back() - phi.front(), 0, -0.2, -0.01,
                             "it falls: GDR MiDi, Eur. Phys. J. E 14 (2004) 341"});
  if (effort.brief) return result;
  const auto part = [](double at, double I_0) { return 1 / (1 + I_0 / at); };
  const CurveFit fit = fit_curve(I, mu, 0.02, 3, part);
  const double mu_s = fit.line.start, mu_2 = fit.line.start + fit.line.slope;
  const double error = error_of_start(I, errors, [&](double at) { return part(at, fit.parameter); });
  result.measures.push_back({"mu_s of the fit", mu_s, error, 0.30, 0.42, jop + " have 0.383"});
  result.measures.push_back({"mu_2 of the fit", mu_2});
  result.measures.push_back({"I_0 of the fit", fit.parameter});
  io::Chart chart = chart_of("rheology", "Shear ratio against the inertial number", "I", "tau/p");
  chart.log_y = false;
  io::ChartSeries found{"Talus, friction 0.4", {}}, line{"fit", {}}, published{"Jop et al. 2006", {}};
  found.marks = true;
  line.hue = 1;
  published.hue = 2;
  published.dash = 1;
  for (std::size_t k = 0; k < I.size(); ++k) found.points.push_back({I[k], mu[k]});
  for (double x = rates.front(); x < 0.35; x *= 1.1) {
    line.points.push_back({x, mu_s + (mu_2 - mu_s) * part(x, fit.parameter)});
    published.points.push_back({x, 0.383 + 0.26 / (1 + 0.279 / x)});
  }
  chart.series = {found, line, published};
  result.charts = {chart};
  return result;
}

CaseResult forces_case(const Effort& effort) {
  CaseResult result;
  std::vector<double> forces;  // over the mean of their sample
  const auto look = [&](const CellRun& run) {
    double sum = 0;
    std::vector<double> own;
    for (std::size_t k = 0; k < run.last.contact_force.size(); ++k) {
      own.push_back(run.last.contact_force[k].dot(run.last.contact_normal[k]));
      sum += own.back();
    }
    for (const double f : own) forces.push_back(f / (sum / static_cast<double>(own.size())));
  };
  const Steady steady =
      flow({effort.brief ? 250 : 1000, 0.3, 0.3, effort.brief ? 0.02 : slow, effort.brief ? 0.4 : 1.0},
           effort, result, look);
  // To first order, for axial compression: in plane shear the products of the anisotropies count.
  result.measures.push_back({"0.4 (a_c + a_n + 1.5 a_t) over q/p",
                             steady.forces.value / steady.q_over_p.value,
                             steady.forces.error / steady.q_over_p.value});
  const double part = effort.brief ? 0.1 : 0.05;
  result.measures.push_back({"the same with products of anisotropies",
                             steady.products.value / steady.q_over_p.value,
                             steady.products.error / steady.q_over_p.value, 1 - part, 1 + part,
                             "stress-force-fabric relation (Rothenburg & Bathurst 1989; docs/theory.md)"});
  // Beyond the mean the logarithm of the density falls by beta for each mean force: the mean excess over a
  // bound is 1/beta of an exponential tail, wherever the bound.
  const auto excess = [&](double bound) {
    double sum = 0, count = 0;
    for (const double f : forces)
      if (f > bound) sum += f - bound, count += 1;
    return count > 0 ? sum / count : std::nan("");
  };
  result.measures.push_back({"decay of the tail of P(f), beyond the mean force", 1 / excess(1), 0, 0.9, 1.9,
                             "Radjai et al., Phys. Rev. Lett. 77 (1996) 274: 1.4"});
  result.measures.push_back({"the same beyond twice the mean, over it", excess(1) / excess(2), 0,
                             effort.brief ? 0.6 : 0.75, effort.brief ? 1.7 : 1.35, "exponential: 1"});
  double weak = 0;
  for (const double f : forces) weak += f < 1 ? 1 : 0;
  result.measures.push_back({"share of forces below the mean", weak / static_cast<double>(forces.size()), 0,
                             0.55, 0.7, "Radjai et al. 1996: some 0.6"});
  if (effort.brief) return result;
  io::Chart chart = chart_of("forces", "Distribution of normal forces", "force over its mean", "density");
  chart.log_x = false;
  io::ChartSeries series{"Talus, friction 0.3", {}};
  constexpr double width = 0.2;
  std::map<int, double> bins;
  for (const double f : forces) bins[static_cast<int>(f / width)] += 1;
  for (const auto& [bin, count] : bins)
    series.points.push_back({(bin + 0.5) * width, count / width / static_cast<double>(forces.size())});
  chart.series.push_back(std::move(series));
  result.charts.push_back(std::move(chart));
  return result;
}

CaseResult tolerance_case(const Effort& effort) {
  CaseResult result;
  double finest = 0;
  for (const double tolerance : {1e-4, 1e-3, 1e-2}) {
    if (effort.brief && tolerance < 1e-3) continue;
    Effort own = effort;
    own.tolerance = tolerance;
    const Steady steady =
        flow({effort.brief ? 200 : 500, 0.3, 0.3, effort.brief ? 0.03 : slow, effort.brief ? 0.4 : 1.0}, own,
             result);
    if (finest == 0) finest = steady.ratio.value;
    result.measures.push_back({fmt::format("tau/p at tolerance {:g}, over that at the finest", tolerance),
                               steady.ratio.value / finest, steady.ratio.error / finest, 0.9, 1.1,
                               "the curve must not depend on the tolerance"});
  }
  return result;
}

}  // namespace talus::literature
