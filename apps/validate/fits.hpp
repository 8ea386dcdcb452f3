#pragma once

/// Least squares, as far as cases need them.

#include <cmath>
#include <functional>
#include <limits>
#include <span>

namespace talus::literature {

/// y = start + slope g(x), with the sum of the squares that it misses y by.
struct Line {
  double start = 0, slope = 0, residual = std::numeric_limits<double>::infinity();
};
inline Line fit_line(
    std::span<const double> x, std::span<const double> y,
    const std::function<double(double)>& g = [](double at) { return at; }) {
  const auto n = static_cast<double>(x.size());
  double sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (std::size_t k = 0; k < x.size(); ++k) {
    const double u = g(x[k]);
    sx += u, sy += y[k], sxx += u * u, sxy += u * y[k];
  }
  Line line;
  line.slope = (n * sxy - sx * sy) / (n * sxx - sx * sx);
  line.start = (sy - line.slope * sx) / n;
  line.residual = 0;
  for (std::size_t k = 0; k < x.size(); ++k)
    line.residual += std::pow(line.start + line.slope * g(x[k]) - y[k], 2);
  return line;
}

/// Standard error of the start of that line, from those of y, independent of one another.
inline double error_of_start(
    std::span<const double> x, std::span<const double> errors,
    const std::function<double(double)>& g = [](double at) { return at; }) {
  const auto n = static_cast<double>(x.size());
  double sx = 0, sxx = 0, squares = 0;
  for (const double at : x) sx += g(at), sxx += g(at) * g(at);
  for (std::size_t k = 0; k < x.size(); ++k)
    squares += std::pow((sxx - g(x[k]) * sx) / (n * sxx - sx * sx) * errors[k], 2);
  return std::sqrt(squares);
}

/// The best line over a parameter of g, g(x, parameter), tried from `low` on in steps by a factor to `high`.
struct CurveFit {
  Line line;
  double parameter = 0;
};
inline CurveFit fit_curve(std::span<const double> x, std::span<const double> y, double low, double high,
                          const std::function<double(double, double)>& g) {
  constexpr double factor = 1.01;
  CurveFit best;
  for (double parameter = low; parameter <= high; parameter *= factor) {
    const Line line = fit_line(x, y, [&](double at) { return g(at, parameter); });
    if (line.residual < best.line.residual) best = {line, parameter};
  }
  return best;
}

}  // namespace talus::literature
