/// `auto` of `talus solve` against the best single method, on problems of many kinds: is it ever more than
/// twice as slow, plus a millisecond?
///
///   bench_solve_race [problems=200] [seed=1] [set=FOLDER] [tolerance=1e-4] [measure=larger] [seconds=60]
///                    [repeat=3] [only=NAME] [csv=FILE] [write=FOLDER]
///
/// set: FCLIB problems that are raced and disturbed too. Times are thread CPU seconds, the least of the
/// repeats for methods and auto alike. A single method is ended when it has taken as long as auto: what takes
/// longer cannot be the best one. write: leaves the problems as FCLIB files.

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <map>
#include <string>

#include "io/fclib/fclib.hpp"
#include "kernels/delassus/delassus_solve.hpp"
#include "tests/bench/clocks.hpp"
#include "tests/bench/contact_problems.hpp"

namespace {

using namespace talus;
using bench::cpu_now;
using bench::NamedProblem;

struct Options {
  std::map<std::string, std::string> values{
      {"problems", "200"}, {"seed", "1"},   {"set", ""},  {"tolerance", "1e-4"}, {"measure", "larger"},
      {"seconds", "60"},   {"repeat", "3"}, {"only", ""}, {"csv", ""},           {"write", ""}};
  const std::string& operator[](const char* key) const { return values.at(key); }
  double number(const char* key) const { return std::stod(values.at(key)); }
};

struct Time {
  bool solved = false;
  double seconds = 0;
  double error = 0;
  std::int64_t iterations = 0;
};

Time time_of(const DelassusProblem& problem, DelassusMethod method, DelassusGoal goal, double limit,
             int repeats) {
  Time best;
  for (int k = 0; k < repeats; ++k) {
    std::vector<double> r(3 * problem.contacts(), 0.0), u(r.size());
    const double begin = cpu_now();
    goal.stop = [&] { return cpu_now() - begin > limit; };
    const DelassusReport report = solve_delassus(problem, method, goal, r);
    const double seconds = cpu_now() - begin;
    const DelassusError error = delassus_error(problem, r, u);
    if (report.converged && !(measured(error, goal.measure) <= goal.tolerance))
      fmt::print("{} says it converged, and its error is {}\n", name_of(method),
                 measured(error, goal.measure));
    if (k == 0 || seconds < best.seconds)
      best = {report.converged, seconds, measured(error, goal.measure), report.iterations};
    if (!report.converged) break;
  }
  return best;
}

std::vector<NamedProblem> problems_of(const Options& options) {
  std::vector<NamedProblem> given;
  if (!options["set"].empty())
    for (const auto& file : io::fclib_files(options["set"]))
      given.push_back({file.name, io::read_fclib(file.path)});
  return bench::race_problems(std::move(given), static_cast<std::size_t>(options.number("problems")),
                              static_cast<std::uint64_t>(options.number("seed")));
}

/// What the table sums up.
struct Summary {
  std::size_t raced = 0, solved = 0, missed_though_solvable = 0, beyond = 0;
  double worst = 0;
  std::string worst_name;
  std::map<std::string, int> best;  ///< how often a method was the best
};

void race(const NamedProblem& named, const Options& options, Summary& summary, std::FILE* csv) {
  const std::string& measure = options["measure"];
  const DelassusGoal goal{.tolerance = options.number("tolerance"),
                          .measure = measure == "siconos"  ? ErrorMeasure::siconos
                                     : measure == "scaled" ? ErrorMeasure::scaled
                                                           : ErrorMeasure::larger};
  const int repeats = static_cast<int>(options.number("repeat"));
  const Time own =
      time_of(named.problem, DelassusMethod::automatic, goal, options.number("seconds"), repeats);
  Time best{.seconds = std::numeric_limits<double>::infinity()};
  std::string best_name = "-", all;
  for (const DelassusMethod method : all_delassus_methods) {
    if (method == DelassusMethod::automatic) continue;
    const Time time = time_of(named.problem, method, goal, own.seconds, repeats);
    all += time.solved ? fmt::format(" {}:{:.3g}ms/{}", name_of(method), 1e3 * time.seconds, time.iterations)
                       : fmt::format(" {}:-({:.0e})", name_of(method), time.error);
    if (time.solved && time.seconds < best.seconds) {
      best = time;
      best_name = name_of(method);
    }
  }
  const double ratio = best.solved ? own.seconds / (2 * best.seconds + 1e-3) : 0;
  ++summary.raced;
  summary.solved += own.solved;
  summary.missed_though_solvable += best.solved && !own.solved;
  summary.beyond += ratio > 1;
  ++summary.best[best_name];
  if (ratio > summary.worst) {
    summary.worst = ratio;
    summary.worst_name = named.name;
  }
  const char* verdict = !own.solved ? (best.solved ? "MISSED" : "unsolved") : ratio > 1 ? "SLOW" : "";
  fmt::print("{:<48} {:>5} auto {:9.3f} ms, error {:.1e}, {:>6}; best {:<13} {:9.3f} ms; {:5.2f} {}{}\n",
             named.name, named.problem.contacts(), 1e3 * own.seconds, own.error, own.iterations, best_name,
             1e3 * (best.solved ? best.seconds : 0), ratio, verdict, ratio > 1 || !own.solved ? all : "");
  std::fflush(stdout);
  if (csv)
    fmt::print(csv, "{},{},{},{},{},{},{}\n", named.name, named.problem.contacts(), own.solved, own.seconds,
               best_name, best.seconds, ratio);
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  for (int k = 1; k < argc; ++k) {
    const std::string word = argv[k];
    const std::size_t equals = word.find('=');
    const auto known = options.values.find(word.substr(0, equals));
    if (equals == std::string::npos || known == options.values.end()) {
      fmt::print(stderr,
                 "'{}' is none of problems=, seed=, set=, tolerance=, measure=, seconds=, repeat=, only=, "
                 "csv=, write=\n",
                 word);
      return 2;
    }
    known->second = word.substr(equals + 1);
  }
  const std::vector<NamedProblem> problems = problems_of(options);
  std::FILE* csv = options["csv"].empty() ? nullptr : std::fopen(options["csv"].c_str(), "w");
  if (csv) fmt::print(csv, "problem,contacts,solved,auto_seconds,best,best_seconds,ratio\n");
  Summary summary;
  for (std::size_t k = 0; k < problems.size(); ++k) {
    if (problems[k].name.find(options["only"]) == std::string::npos) continue;
    if (options["write"].empty()) {
      race(problems[k], options, summary, csv);
    } else {
      std::filesystem::create_directories(options["write"]);
      io::write_fclib(
          problems[k].problem, {}, {.title = problems[k].name, .description = "", .math_info = ""},
          std::filesystem::path(options["write"]) / fmt::format("{:04}-{}.hdf5", k, problems[k].name));
    }
  }
  if (csv) std::fclose(csv);
  fmt::print(
      "tolerance {} by {}: {} problems, auto solved {}, missed {} that a single method solved in its "
      "time; {} beyond 2 x best + 1 ms, worst {:.2f} of it ({}); best method:",
      options["tolerance"], options["measure"], summary.raced, summary.solved, summary.missed_though_solvable,
      summary.beyond, summary.worst, summary.worst_name);
  for (const auto& [name, count] : summary.best) fmt::print(" {} {}", name, count);
  fmt::print("\n");
  return 0;
}
