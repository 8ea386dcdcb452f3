#include "apps/study_profile.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <set>
#include <stdexcept>

#include "apps/study_variants.hpp"
#include "io/error.hpp"
#include "io/fclib.hpp"
#include "kernels/delassus_solve.hpp"

namespace talus {

namespace {

namespace fs = std::filesystem;

std::vector<DelassusMethod> methods_named(std::span<const std::string> names) {
  std::vector<DelassusMethod> chosen;
  for (const std::string& name : names) {
    const auto method = delassus_method(name);
    if (!method)
      throw std::invalid_argument(fmt::format("method '{}' is not known for FCLIB problems; there are {}",
                                              name, fmt::join(profile_methods(), ", ")));
    chosen.push_back(*method);
  }
  return chosen;
}

ProfileRow solve_once(const DelassusProblem& problem, DelassusMethod method, double tolerance,
                      double max_seconds) {
  using Clock = std::chrono::steady_clock;
  const auto start = Clock::now();
  const auto elapsed = [&] { return std::chrono::duration<double>(Clock::now() - start).count(); };
  std::vector<double> r(3 * problem.contacts(), 0.0);
  const DelassusGoal goal{.tolerance = tolerance, .stop = [&] { return elapsed() > max_seconds; }};
  const DelassusReport report = solve_delassus(problem, method, goal, r);
  ProfileRow row;
  row.seconds = elapsed();
  row.contacts = static_cast<std::int64_t>(problem.contacts());
  row.iterations = report.iterations;
  row.error = report.error.siconos;
  row.scaled_error = report.error.scaled;
  row.solved = report.converged;
  return row;
}

}  // namespace

std::vector<std::string> profile_methods() {
  std::vector<std::string> names;
  for (const DelassusMethod method : all_delassus_methods) names.emplace_back(name_of(method));
  return names;
}

void check_profile(const fs::path& folder, std::span<const std::string> methods) {
  methods_named(methods);
  io::fclib_files(folder);
}

std::vector<ProfileRow> study_profile(const fs::path& folder, std::span<const std::string> methods,
                                      std::span<const double> tolerances, double max_seconds,
                                      const std::function<void(const std::string&)>& say) {
  const std::vector<DelassusMethod> chosen = methods_named(methods);
  const std::vector<io::FclibFile> files = io::fclib_files(folder);
  std::vector<ProfileRow> rows;
  for (std::size_t k = 0; k < files.size(); ++k) {
    DelassusProblem problem;
    try {
      problem = io::read_fclib(files[k].path);
    } catch (const io::FileError& error) {
      say(error.what());
      continue;
    }
    for (const DelassusMethod method : chosen)
      for (const double tolerance : tolerances) {
        ProfileRow row = solve_once(problem, method, tolerance, max_seconds);
        std::vector<double> seconds{row.seconds};
        while (row.seconds < cheap_solve && seconds.size() < 3)
          seconds.push_back(solve_once(problem, method, tolerance, max_seconds).seconds);
        row.seconds = median(seconds);
        row.problem = files[k].name;
        row.method = name_of(method);
        row.tolerance = tolerance;
        say(fmt::format("{}/{} {}: {}, tolerance {:.1e}: {} in {:.3g} s, error {:.1e}", k + 1, files.size(),
                        row.problem, row.method, tolerance, row.solved ? "solved" : "NOT solved", row.seconds,
                        row.error));
        rows.push_back(std::move(row));
      }
  }
  if (rows.empty()) throw io::FileError(folder.string(), "holds no problem that can be read");
  return rows;
}

std::vector<std::array<double, 2>> performance_profile(std::span<const ProfileRow> rows,
                                                       const std::string& method, double tolerance) {
  std::map<std::string, double> fastest;
  std::set<std::string> problems;
  for (const ProfileRow& row : rows) {
    problems.insert(row.problem);
    if (row.tolerance != tolerance || !row.solved) continue;
    const auto [best, is_new] = fastest.emplace(row.problem, row.seconds);
    if (!is_new) best->second = std::min(best->second, row.seconds);
  }
  std::vector<double> ratios;
  for (const ProfileRow& row : rows)
    if (row.method == method && row.tolerance == tolerance && row.solved)
      ratios.push_back(row.seconds / fastest.at(row.problem));
  std::ranges::sort(ratios);
  std::vector<std::array<double, 2>> points;
  for (std::size_t k = 0; k < ratios.size(); ++k) {
    const double part = static_cast<double>(k + 1) / static_cast<double>(problems.size());
    if (!points.empty() && points.back()[0] == ratios[k])
      points.back()[1] = part;
    else
      points.push_back({ratios[k], part});
  }
  return points;
}

}  // namespace talus
