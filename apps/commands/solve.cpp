#include "apps/commands/solve.hpp"

#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <functional>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <vector>

#include "apps/shared/exit_codes.hpp"
#include "apps/shared/patience.hpp"
#include "apps/shared/print.hpp"
#include "apps/shared/solve_table.hpp"
#include "io/fclib/fclib.hpp"
#include "io/files/error.hpp"
#include "io/files/output_directory.hpp"
#include "kernels/delassus/delassus_solve.hpp"
#include "runtime/graph/clock.hpp"

namespace talus {
namespace {

using Clock = std::chrono::steady_clock;

/// Processor time of this thread [s]: what a solve costs, however busy the machine is.
double processor_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

struct Plan {
  std::vector<io::FclibFile> files;
  std::vector<DelassusMethod> methods;
  ErrorMeasure measure = ErrorMeasure::larger;
  bool table = false;  ///< several solves
};

/// Checks the options and finds the files; throws std::invalid_argument or io::FileError.
Plan plan_of(const SolveOptions& options) {
  if (!(options.tol > 0))
    throw std::invalid_argument(fmt::format("--tol is {}, it must be above 0", options.tol));
  if (!(options.max_seconds > 0))
    throw std::invalid_argument(fmt::format("--max-seconds is {}, it must be above 0", options.max_seconds));
  if (options.repeat < 1)
    throw std::invalid_argument(fmt::format("--repeat is {}, it must be at least 1", options.repeat));
  Plan plan;
  if (options.method == "all") {
    plan.methods.assign(all_delassus_methods.begin(), all_delassus_methods.end());
  } else if (const auto method = delassus_method(options.method)) {
    plan.methods = {*method};
  } else {
    std::string known;
    for (const DelassusMethod each : all_delassus_methods) known += fmt::format("{}, ", name_of(each));
    throw std::invalid_argument(
        fmt::format("--method is \"{}\", but there are {}and all", options.method, known));
  }
  if (options.measure == "siconos") {
    plan.measure = ErrorMeasure::siconos;
  } else if (options.measure == "scaled") {
    plan.measure = ErrorMeasure::scaled;
  } else if (options.measure != "larger") {
    throw std::invalid_argument(
        fmt::format("--measure is \"{}\", but there are larger, siconos and scaled", options.measure));
  }
  plan.files = io::fclib_files(options.path);
  plan.table = plan.methods.size() > 1 || std::filesystem::is_directory(options.path);
  if (!options.out.empty() && plan.table)
    throw std::invalid_argument("--out wants one problem and one method");
  std::vector<std::filesystem::path> inputs;
  for (const io::FclibFile& file : plan.files) inputs.push_back(file.path);
  io::check_output_files(inputs, {options.out, options.csv, options.profile}, options.force);
  return plan;
}

struct Solved {
  SolveRow row;
  std::vector<double> r;
  std::int64_t failed_contacts = 0;
  double approach = 0;  ///< where it is too much: of the contacts that the answer lets close fastest, over
                        ///< the largest |q|
};

/// Both errors compare with the impulses, which grow without bound where no velocity keeps all contacts open:
/// what is left of the approach then tells that there is no solution.
double approach_left(const DelassusProblem& problem, std::span<const double> r) {
  std::vector<double> u(r.size());
  relative_velocity(problem, r, u);
  double approach = 0, given = 0;
  for (std::size_t k = 0; k < problem.contacts(); ++k) {
    approach = std::max(approach, -u[3 * k]);
    given = std::max(given, problem.q[k].norm());
  }
  return given > 0 ? approach / given : 0;
}

/// An answer that leaves more than this approach, unless the tolerance is as loose, is none: a residual that
/// is compared with the impulses says little where these are large, or friction is, as then it turns any
/// approach into a part of the cone.
constexpr double most_approach = 0.1;

/// `alive` is called now and then while it solves.
Solved solve_one(const DelassusProblem& problem, const std::string& name, DelassusMethod method,
                 const Plan& plan, const SolveOptions& options, const std::function<void()>& alive) {
  Solved solved;
  DelassusReport report;
  std::vector<double> times;
  for (int k = 0; k < options.repeat; ++k) {
    solved.r.assign(3 * problem.contacts(), 0.0);
    const auto start = Clock::now();
    const DelassusGoal goal{.tolerance = options.tol, .measure = plan.measure, .stop = [&] {
                              alive();
                              return std::chrono::duration<double>(Clock::now() - start).count() >
                                     options.max_seconds;
                            }};
    const double before = processor_seconds();
    report = solve_delassus(problem, method, goal, solved.r);
    times.push_back(processor_seconds() - before);
    if (!report.converged) break;  // a missed tolerance is missed again
  }
  const auto middle = times.begin() + static_cast<std::ptrdiff_t>(times.size() / 2);
  std::nth_element(times.begin(), middle, times.end());
  solved.row = solve_row(name, problem.contacts(), method, report, *middle);
  solved.failed_contacts = report.failed_contacts;
  if (!report.converged) return solved;
  const double approach = approach_left(problem, solved.r);
  if (approach <= std::max(most_approach, 10 * options.tol)) return solved;
  solved.approach = approach;
  solved.row.converged = false;
  return solved;
}

void print_line(const SolveRow& row) {
  const nlohmann::ordered_json line = {
      {"problem", row.problem}, {"contacts", row.contacts},         {"method", row.method},
      {"error", row.error},     {"scaled_error", row.scaled_error}, {"iterations", row.iterations},
      {"seconds", row.seconds}, {"converged", row.converged}};
  // A file name need not be UTF-8; replace what is not instead of losing the answer.
  print_out("{}\n", line.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
  std::fflush(stdout);
}

/// Solves and writes; throws what the kernels throw, and io::FileError for a file that cannot be written.
int solve(const SolveOptions& options, const Plan& plan) {
  std::vector<SolveRow> rows;
  bool unreadable = false;
  Patience patience;
  for (const auto& file : plan.files) {
    io::FclibProblem problem;
    try {
      problem = io::read_fclib_problem(file.path);
    } catch (const io::FileError& error) {
      print_error("talus solve: {}\n", error.what());
      if (!plan.table) return exit_bad_input;
      unreadable = true;
      continue;
    }
    for (const DelassusMethod method : plan.methods) {
      const double began = graph::seconds_now();
      Solved solved = solve_one(problem.contact, file.name, method, plan, options, [&] {
        patience.tell([&] {
          return fmt::format("solve {} of {}: {}, {} contacts, {}, {:.0f} of {:g} s at most", rows.size() + 1,
                             plan.files.size() * plan.methods.size(), file.name, problem.contact.contacts(),
                             name_of(method), graph::seconds_now() - began, options.max_seconds);
        });
      });
      if (!plan.table) print_line(solved.row);
      if (!options.out.empty())
        io::write_fclib_solution(file.path, options.out, io::fclib_solution(problem, solved.r));
      if (solved.failed_contacts > 0)
        print_error(
            "{}: the law of {} contacts has no solution (their block of W is not positive definite)\n",
            file.path.string(), solved.failed_contacts);
      if (solved.approach > 0)
        print_error(
            "talus: warning: {}: not solved: contacts still close at {:.2g} of the largest velocity in q, "
            "though the error is within its tolerance. There is no solution, and impulses grow without "
            "bound, or friction is so large that the error says little: lower --tol\n",
            file.path.string(), solved.approach);
      rows.push_back(std::move(solved.row));
    }
  }
  if (plan.table) print_out("{}", solve_table(rows));
  std::fflush(stdout);
  if (!options.csv.empty()) io::write_whole(options.csv.string(), solve_csv(rows));
  if (!options.profile.empty()) io::write_whole(options.profile.string(), performance_profile(rows));
  if (unreadable) return exit_bad_input;
  return all_solved(rows) ? exit_done : exit_tolerance_missed;
}

}  // namespace

int solve_command(const SolveOptions& options) {
  Plan plan;
  try {
    plan = plan_of(options);
  } catch (const std::exception& error) {
    print_error("talus solve: {}\n", error.what());
    return exit_bad_input;
  }
  try {
    return solve(options, plan);
  } catch (const io::FileError& error) {
    print_error("talus solve: {}\n", error.what());
  } catch (const std::exception& error) {
    print_error("talus solve: {}: {}\n", options.path.string(), error.what());
  }
  return exit_failure;
}

}  // namespace talus
