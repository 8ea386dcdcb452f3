#include "apps/study_error/study_profile.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <chrono>
#include <stdexcept>

#include "apps/shared/median.hpp"
#include "apps/study_error/study_variants.hpp"
#include "io/fclib/fclib.hpp"
#include "io/files/error.hpp"
#include "kernels/delassus/delassus_solve.hpp"

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

SolveRow solve_once(const DelassusProblem& problem, const std::string& name, DelassusMethod method,
                    double tolerance, double max_seconds) {
  using Clock = std::chrono::steady_clock;
  const auto start = Clock::now();
  const auto elapsed = [&] { return std::chrono::duration<double>(Clock::now() - start).count(); };
  std::vector<double> r(3 * problem.contacts(), 0.0);
  const DelassusGoal goal{.tolerance = tolerance, .stop = [&] { return elapsed() > max_seconds; }};
  const DelassusReport report = solve_delassus(problem, method, goal, r);
  return solve_row(name, problem.contacts(), method, report, elapsed());
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

void study_profile(const fs::path& folder, const ProfilePlan& plan,
                   const std::function<void(const std::string&)>& say, const std::function<void()>& keep,
                   std::vector<ProfileRow>& rows) {
  const std::vector<DelassusMethod> chosen = methods_named(plan.methods);
  const std::vector<io::FclibFile> files = io::fclib_files(folder);
  for (std::size_t k = 0; k < files.size(); ++k) {
    DelassusProblem problem;
    try {
      problem = io::read_fclib(files[k].path);
    } catch (const io::FileError& error) {
      say(error.what());
      continue;
    }
    for (const DelassusMethod method : chosen)
      for (const double tolerance : plan.tolerances) {
        const auto solve = [&] {
          return solve_once(problem, files[k].name, method, tolerance, plan.max_seconds);
        };
        SolveRow row = solve();
        std::vector<double> seconds{row.seconds};
        while (row.seconds < cheap_solve && seconds.size() < 3) seconds.push_back(solve().seconds);
        row.seconds = median(seconds);
        say(fmt::format("{}/{} {}: {}, tolerance {:.1e}: {} in {:.3g} s, error {:.1e}", k + 1, files.size(),
                        row.problem, row.method, tolerance, row.converged ? "solved" : "NOT solved",
                        row.seconds, row.error));
        rows.push_back({tolerance, std::move(row)});
      }
    keep();
  }
  if (rows.empty()) throw io::FileError(folder.string(), "holds no problem that can be read");
}

}  // namespace talus
