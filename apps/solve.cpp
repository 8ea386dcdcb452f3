#include "apps/solve.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <vector>

#include "io/error.hpp"
#include "io/fclib.hpp"
#include "kernels/delassus.hpp"

namespace talus {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// The command without its error handling; throws what the kernels and io throw.
int solve(const SolveOptions& options) {
  if (!(options.tol > 0))
    throw std::invalid_argument(fmt::format("--tol is {}, it must be above 0", options.tol));
  if (!(options.max_seconds > 0))
    throw std::invalid_argument(fmt::format("--max-seconds is {}, it must be above 0", options.max_seconds));
  const DelassusProblem problem = io::read_fclib(options.path);
  if (!options.out.empty()) io::check_fclib_output(options.path, options.out);

  std::vector<double> r(3 * problem.contacts(), 0.0), u(r.size());
  const auto start = Clock::now();
  const NlgsReport report = solve_nlgs(
      problem, {.tolerance = options.tol, .stop = [&] { return seconds_since(start) > options.max_seconds; }},
      r);
  const double seconds = seconds_since(start);

  const nlohmann::ordered_json line = {{"problem", options.path.stem().string()},
                                       {"contacts", problem.contacts()},
                                       {"method", "nlgs"},
                                       {"error", report.error.siconos},
                                       {"scaled_error", report.error.scaled},
                                       {"iterations", report.iterations},
                                       {"seconds", seconds},
                                       {"converged", report.converged}};
  // A file name need not be UTF-8; replace what is not instead of losing the answer.
  fmt::print("{}\n", line.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
  std::fflush(stdout);
  if (!options.out.empty()) {
    relative_velocity(problem, r, u);
    io::write_fclib_solution(options.path, options.out, r, u);
  }
  if (report.failed_contacts > 0)
    fmt::print(stderr,
               "{}: the law of {} contacts has no solution (their block of W is not positive definite)\n",
               options.path.string(), report.failed_contacts);
  return report.converged ? 0 : 3;
}

}  // namespace

int solve_command(const SolveOptions& options) {
  try {
    return solve(options);
  } catch (const io::FileError& error) {
    fmt::print(stderr, "talus solve: {}\n", error.what());
    return 2;
  } catch (const std::invalid_argument& error) {
    fmt::print(stderr, "talus solve: {}\n", error.what());
    return 2;
  } catch (const std::exception& error) {
    fmt::print(stderr, "talus solve: {}: {}\n", options.path.string(), error.what());
    return 1;
  }
}

}  // namespace talus
