#include "apps/shared/solve_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <vector>

#include "io/files/csv_table.hpp"

namespace talus {
namespace {

std::vector<std::string> methods_of(std::span<const SolveRow> rows) {
  std::vector<std::string> methods;
  for (const SolveRow& row : rows)
    if (std::find(methods.begin(), methods.end(), row.method) == methods.end()) methods.push_back(row.method);
  return methods;
}

/// Least time in which a problem was solved; infinite when it was not.
std::map<std::string, double> best_times(std::span<const SolveRow> rows) {
  std::map<std::string, double> best;
  for (const SolveRow& row : rows) {
    double& time = best.try_emplace(row.problem, std::numeric_limits<double>::infinity()).first->second;
    if (row.converged) time = std::min(time, row.seconds);
  }
  return best;
}

}  // namespace

SolveRow solve_row(const std::string& problem, std::size_t contacts, DelassusMethod method,
                   const DelassusReport& report, double seconds) {
  return {.problem = problem,
          .contacts = contacts,
          .method = std::string(name_of(method)),
          .error = report.error.siconos,
          .scaled_error = report.error.scaled,
          .iterations = report.iterations,
          .factorisations = report.factorisations,
          .seconds = seconds,
          .converged = report.converged};
}

std::string solve_table(std::span<const SolveRow> rows) {
  std::size_t width = 7;
  for (const SolveRow& row : rows) width = std::max(width, row.problem.size());
  std::string text = fmt::format("{:<{}}  {:>8}  {:<13}  {:>8}  {:>8}  {:>10}  {:>10}\n", "problem", width,
                                 "contacts", "method", "error", "scaled", "iterations", "seconds");
  for (const SolveRow& row : rows)
    fmt::format_to(std::back_inserter(text), "{:<{}}  {:>8}  {:<13}  {:8.1e}  {:8.1e}  {:>10}  {:10.3g}{}\n",
                   row.problem, width, row.contacts, row.method, row.error, row.scaled_error, row.iterations,
                   row.seconds, row.converged ? "" : "  missed");
  for (const std::string& method : methods_of(rows)) {
    std::size_t solved = 0, all = 0;
    double seconds = 0;
    for (const SolveRow& row : rows) {
      if (row.method != method) continue;
      ++all;
      seconds += row.seconds;
      solved += row.converged;
    }
    fmt::format_to(std::back_inserter(text), "{}: {} of {} solved, {:.3g} s\n", method, solved, all, seconds);
  }
  return text;
}

std::string solve_csv(std::span<const SolveRow> rows) {
  io::CsvTable table({"problem", "contacts", "method", "error", "scaled_error", "iterations",
                      "factorisations", "seconds", "converged"});
  for (const SolveRow& row : rows)
    table.row(row.problem, static_cast<std::int64_t>(row.contacts), row.method, row.error, row.scaled_error,
              row.iterations, row.factorisations, row.seconds, row.converged);
  return table.text();
}

std::vector<std::array<double, 2>> profile_of(std::span<const SolveRow> rows, const std::string& method) {
  const auto best = best_times(rows);
  std::vector<double> factors;
  for (const SolveRow& row : rows)
    if (row.method == method && row.converged)
      // A solve too short for the clock takes no time: it is the fastest, and nothing is a multiple of it.
      factors.push_back(row.seconds == best.at(row.problem) ? 1 : row.seconds / best.at(row.problem));
  std::sort(factors.begin(), factors.end());
  std::vector<std::array<double, 2>> points;
  for (std::size_t k = 0; k < factors.size(); ++k) {
    const double part = static_cast<double>(k + 1) / static_cast<double>(best.size());
    if (!points.empty() && points.back()[0] == factors[k])
      points.back()[1] = part;
    else
      points.push_back({factors[k], part});
  }
  return points;
}

std::string performance_profile(std::span<const SolveRow> rows) {
  std::string text = "factor";
  std::vector<std::vector<std::array<double, 2>>> profiles;
  for (const std::string& method : methods_of(rows)) {
    text += ',' + method;
    profiles.push_back(profile_of(rows, method));
  }
  text += '\n';
  constexpr int per_decade = 20;
  for (int k = 0; k <= 3 * per_decade; ++k) {
    const double factor = std::pow(10.0, static_cast<double>(k) / per_decade);
    fmt::format_to(std::back_inserter(text), "{:.6g}", factor);
    for (const auto& points : profiles) {
      double part = 0;
      for (const auto& [at, solved] : points)
        if (at <= factor) part = solved;
      fmt::format_to(std::back_inserter(text), ",{:.6g}", part);
    }
    text += '\n';
  }
  return text;
}

bool all_solved(std::span<const SolveRow> rows) {
  const auto best = best_times(rows);
  return std::all_of(best.begin(), best.end(), [](const auto& entry) { return std::isfinite(entry.second); });
}

}  // namespace talus
