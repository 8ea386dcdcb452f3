#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "kernels/delassus/delassus_solve.hpp"

namespace talus {

/// One solve of one problem.
struct SolveRow {
  std::string problem;
  std::size_t contacts = 0;
  std::string method;
  double error = 0, scaled_error = 0;
  std::int64_t iterations = 0, factorisations = 0;
  double seconds = 0;
  bool converged = false;
};

/// The row of a solve that took so many `seconds`.
SolveRow solve_row(const std::string& problem, std::size_t contacts, DelassusMethod method,
                   const DelassusReport& report, double seconds);

/// For people: aligned columns, with a line of totals per method.
std::string solve_table(std::span<const SolveRow> rows);

/// For programs: a header and a line per row.
std::string solve_csv(std::span<const SolveRow> rows);

/// Performance profile (Dolan and More 2002) of a method: points (t, part of the problems that it solved in
/// at most t times the time of the fastest), t ascending, each once. Problems that no method solved count.
std::vector<std::array<double, 2>> profile_of(std::span<const SolveRow> rows, const std::string& method);

/// The same of all methods for programs: per line a factor t from 1 to 1000 and a part for each method.
std::string performance_profile(std::span<const SolveRow> rows);

/// True when every problem was solved by some method.
bool all_solved(std::span<const SolveRow> rows);

}  // namespace talus
