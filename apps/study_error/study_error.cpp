#include "apps/study_error/study_error.hpp"

#include <fmt/format.h>
#include <omp.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <optional>
#include <set>
#include <stdexcept>

#include "apps/shared/exit_codes.hpp"
#include "apps/shared/options.hpp"
#include "apps/shared/print.hpp"
#include "apps/shared/report_page.hpp"
#include "apps/shared/say.hpp"
#include "apps/study_error/study_problem.hpp"
#include "apps/study_error/study_profile.hpp"
#include "apps/study_error/study_report.hpp"
#include "apps/study_error/study_runs.hpp"
#include "apps/study_error/study_variants.hpp"
#include "io/fclib/fclib.hpp"
#include "io/files/output_directory.hpp"
#include "io/scene/scene_change.hpp"
#include "runtime/step/methods/method.hpp"

namespace talus {

namespace {

namespace fs = std::filesystem;

template <class T>
std::vector<T> without_repeats(const std::vector<T>& values) {
  std::vector<T> kept;
  for (const T& value : values)
    if (std::ranges::find(kept, value) == kept.end()) kept.push_back(value);
  return kept;
}

std::vector<double> descending(const std::vector<double>& given, std::vector<double> otherwise) {
  std::vector<double> values = given.empty() ? std::move(otherwise) : without_repeats(given);
  std::ranges::sort(values, std::greater<>());
  return values;
}

template <class T>
std::vector<T> or_else(const std::vector<T>& given, std::vector<T> otherwise) {
  return given.empty() ? otherwise : without_repeats(given);
}

/// Of a whole run that neither the command nor the scene bounds by a number of steps.
constexpr std::int64_t default_steps = 20;

StudyPlan plan_of(const StudyErrorOptions& options, std::uint64_t scene_seed) {
  StudyPlan plan;
  plan.tolerances = descending(options.tolerances, {1e-2, 1e-3, 1e-4});
  plan.time_steps = descending(options.time_steps, {1});
  plan.at_step = options.at_step;
  plan.steps = options.steps.value_or(default_steps);
  plan.max_sweeps = options.max_sweeps;
  plan.max_seconds = options.max_seconds;
  const std::vector<std::string> methods = or_else(options.methods, talus::methods().names());
  for (const std::string& method : methods) talus::methods().named(method);  // refuses unknown names
  for (const std::uint64_t seed : or_else(options.seeds, {scene_seed}))
    for (const std::string& method : methods)
      for (const int subdomains : or_else(options.subdomains, {1}))
        for (const int threads : or_else(options.threads, {omp_get_num_procs()}))
          plan.variants.push_back({method, subdomains, threads, seed});
  return plan;
}

/// What a run of the scene would find out late; `steps`: those asked for. Throws std::invalid_argument.
void check_lengths(const io::Scene& scene, const StudyPlan& plan, const std::string& only,
                   std::optional<std::int64_t> steps) {
  const double last = most_steps(scene.setup.stages);
  if (only != "run" && static_cast<double>(plan.at_step) >= last)
    throw std::invalid_argument(
        fmt::format("--at-step {}: {} ends after step {}, so there is no step to solve behind it; choose a "
                    "smaller one",
                    plan.at_step, scene.source_file, last));
  if (only == "step") return;
  if (steps && static_cast<double>(*steps) > length_in_first_steps(scene.setup.stages))
    throw std::invalid_argument(fmt::format(
        "--steps {}: {} is over after {:g} time steps of its first stage; choose no more, or --set an end of "
        "its stages",
        *steps, scene.source_file, length_in_first_steps(scene.setup.stages)));
  for (const double time_step : plan.time_steps)
    if (const std::string why = why_no_step(scene, plan, time_step); !why.empty())
      throw std::invalid_argument(why);
}

int study_scene(const StudyErrorOptions& options) {
  StudyPlan plan;
  std::vector<StudySample> samples;
  std::string directory = options.out;
  std::optional<io::DirectoryLock> lock;
  try {
    const io::Scene scene = io::load_scene(options.subject, options.overrides);
    plan = plan_of(options, scene.setup.seed);
    check_lengths(scene, plan, options.only, options.steps);
    for (const StudyVariant& variant : plan.variants)
      if (samples.empty() || samples.back().scene.setup.seed != variant.seed)
        samples.push_back(study_sample(options.subject, options.overrides, variant.seed));
    if (directory.empty()) directory = "out/error-" + scene.name;
    lock.emplace(
        io::prepare_output_directory(directory, options.force, is_study_error_name, io::files_read(scene)));
  } catch (const std::exception& error) {
    print_error("talus: error: {}\n", error.what());
    return exit_bad_input;
  }
  const io::Scene& scene = samples.front().scene;
  const std::string title = fmt::format("{}: error against run time", scene.name);
  const std::string introduction = (scene.description.empty() ? "" : scene.description + ". ") +
                                   "Measured with " + where_and_when() +
                                   " Times are medians of three where a solve takes less than " +
                                   fmt::format("{:g} s. The tables are beside this page.", cheap_solve);
  say(fmt::format("{}: {} grains, {} ways to solve", scene.name, samples.front().bodies.size(),
                  plan.variants.size()));
  ProblemStudy problem;
  RunStudy runs;
  const auto keep = [&] {  // a study that is stopped leaves what it has
    ReportPage report;
    report.title = title;
    report.introduction = introduction;
    if (!problem.references.empty()) report_problem(problem, plan, report);
    if (!runs.references.empty()) report_runs(runs, plan, report);
    write_report(directory, report);
  };
  if (options.only != "run")
    for (const StudySample& sample : samples) study_problem(sample, plan, say, keep, problem);
  if (options.only != "step")
    for (const StudySample& sample : samples) study_runs(sample, plan, say, keep, runs);
  keep();
  say(fmt::format("tables, pictures and report.html in {}", directory));
  const bool no_step = options.only != "run" && problem.truth.empty();
  if (no_step || (options.only != "step" && runs.rows.empty())) {
    print_error("talus: error: {} of {} could not be solved in any of these ways\n",
                no_step ? "the step" : "whole runs", scene.name);
    return exit_failure;
  }
  const bool sound =
      std::ranges::all_of(problem.references, &ProblemReference::converged) &&
      std::ranges::all_of(runs.references, [](const RunReference& r) { return r.missed == 0; });
  return sound ? exit_done : exit_tolerance_missed;
}

int study_folder(const StudyErrorOptions& options) {
  const fs::path folder = options.subject;
  std::string directory = options.out;
  std::optional<io::DirectoryLock> lock;
  std::vector<std::string> methods = or_else(options.methods, profile_methods());
  try {
    const std::string name = fs::absolute(folder / "x").lexically_normal().parent_path().filename().string();
    if (directory.empty()) directory = "out/error-" + name;
    check_profile(folder, methods);
    lock.emplace(io::prepare_output_directory(directory, options.force, is_study_error_name, {}));
  } catch (const std::exception& error) {
    print_error("talus: error: {}\n", error.what());
    return exit_bad_input;
  }
  const std::string introduction =
      "Measured with " + where_and_when() +
      fmt::format(
          " A solve may take {:g} s; times are medians of three where it takes less than "
          "{:g} s. The tables are beside this page.",
          options.max_seconds, cheap_solve);
  std::vector<ProfileRow> rows;
  const auto keep = [&] {
    ReportPage report;
    report.title = "FCLIB problems: who solves how many, and how fast";
    report.introduction = introduction;
    report_profile(rows, report);
    write_report(directory, report);
  };
  study_profile(folder, {methods, descending(options.tolerances, {1e-4, 1e-8}), options.max_seconds}, say,
                keep, rows);
  say(fmt::format("tables, picture and report.html in {}", directory));
  std::set<std::string> solved, problems, names;
  for (const auto& [tolerance, solve] : rows) {
    names.insert(solve.problem);
    problems.insert(fmt::format("{} {}", solve.problem, tolerance));
    if (solve.converged) solved.insert(fmt::format("{} {}", solve.problem, tolerance));
  }
  if (names.size() < io::fclib_files(folder).size()) return exit_bad_input;  // some could not be read
  return solved == problems ? exit_done : exit_tolerance_missed;
}

/// Refuses options that were given and would do nothing. Throws CLI::ValidationError.
void refuse_idle_options(const CLI::App& app, const StudyErrorOptions& options) {
  const auto refuse = [&](const std::string& of_what, std::initializer_list<const char*> names) {
    for (const char* name : names)
      if (app.count(name) > 0) throw CLI::ValidationError(name, "has no meaning for " + of_what);
  };
  if (fs::is_directory(options.subject))
    refuse("a folder of FCLIB files", {"--set", "--subdomains", "--threads", "--seeds", "--only", "--steps",
                                       "--time-steps", "--at-step", "--max-sweeps"});
  if (options.only == "run") refuse("--only run", {"--at-step", "--max-sweeps", "--max-seconds"});
  if (options.only == "step") refuse("--only step", {"--steps", "--time-steps"});
}

}  // namespace

void add_study_error_options(CLI::App& app, StudyErrorOptions& options) {
  app.add_option("subject", options.subject, "scene file, or folder of FCLIB files")
      ->type_name("PATH")
      ->required();
  app.add_option("--out", options.out, "directory of the study [out/error-NAME]")->type_name("DIR");
  app.add_flag("--force", options.force, "replace an earlier study in the directory");
  app.add_option("--methods", options.methods, "names of solver.method [all]")
      ->type_name("A,B")
      ->delimiter(',');
  app.add_option("--tolerances", options.tolerances,
                 "on the residual [0.01,0.001,0.0001; of FCLIB files 1e-4,1e-8]")
      ->type_name("T,..")
      ->delimiter(',')
      ->check(above_zero());
  app.add_option("--time-steps", options.time_steps, "whole runs: multiples of the scene's time steps [1]")
      ->type_name("F,..")
      ->delimiter(',')
      ->check(above_zero());
  app.add_option("--subdomains", options.subdomains, "numbers of subdomains [1]")
      ->type_name("N,..")
      ->delimiter(',')
      ->check(CLI::Range(1, most_subdomains));
  app.add_option("--threads", options.threads, "numbers of threads [one per core]")
      ->type_name("N,..")
      ->delimiter(',')
      ->check(thread_count());
  app.add_option("--seeds", options.seeds, "seeds of the sample [the scene's]")
      ->type_name("S,..")
      ->delimiter(',')
      ->check(not_negative());
  app.add_option("--only", options.only, "step: no whole runs; run: no single step")
      ->type_name("step|run")
      ->check(CLI::IsMember({"step", "run"}).description(""));
  app.add_option("--at-step", options.at_step, "steps before the one that is solved in every way")
      ->type_name("N")
      ->capture_default_str()
      ->check(not_negative());
  app.add_option("--steps", options.steps, "length of a whole run, in time steps of the first stage [20]")
      ->type_name("N")
      ->check(above_zero());
  app.add_option("--max-sweeps", options.max_sweeps, "of a solve of the one step")
      ->type_name("N")
      ->capture_default_str()
      ->check(above_zero());
  app.add_option("--max-seconds", options.max_seconds, "of a solve of the one step, or of an FCLIB problem")
      ->type_name("S")
      ->capture_default_str()
      ->check(above_zero());
  add_overrides(app, options.overrides);
  app.callback([&app, &options] { refuse_idle_options(app, options); });
}

int study_error_command(const StudyErrorOptions& options) {
  try {
    return fs::is_directory(options.subject) ? study_folder(options) : study_scene(options);
  } catch (const std::exception& error) {
    print_error("talus: error: {}\n", error.what());
    return exit_failure;
  }
}

}  // namespace talus
