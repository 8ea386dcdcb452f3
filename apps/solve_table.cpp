#include "apps/solve_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <vector>

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

/// A file name may hold anything.
std::string quoted(const std::string& text) {
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + '"';
}

}  // namespace

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
  std::string text =
      "problem,contacts,method,error,scaled_error,iterations,factorisations,seconds,converged\n";
  for (const SolveRow& row : rows)
    fmt::format_to(std::back_inserter(text), "{},{},{},{},{},{},{},{},{}\n", quoted(row.problem),
                   row.contacts, row.method, row.error, row.scaled_error, row.iterations, row.factorisations,
                   row.seconds, row.converged ? 1 : 0);
  return text;
}

std::string performance_profile(std::span<const SolveRow> rows) {
  const auto methods = methods_of(rows);
  const auto best = best_times(rows);
  std::string text = "factor";
  for (const std::string& method : methods) text += ',' + method;
  text += '\n';
  constexpr int per_decade = 20;
  for (int k = 0; k <= 3 * per_decade; ++k) {
    const double factor = std::pow(10.0, static_cast<double>(k) / per_decade);
    fmt::format_to(std::back_inserter(text), "{:.6g}", factor);
    for (const std::string& method : methods) {
      const auto within = std::count_if(rows.begin(), rows.end(), [&](const SolveRow& row) {
        return row.method == method && row.converged && row.seconds <= factor * best.at(row.problem);
      });
      fmt::format_to(std::back_inserter(text), ",{:.6g}",
                     static_cast<double>(within) / static_cast<double>(best.size()));
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
