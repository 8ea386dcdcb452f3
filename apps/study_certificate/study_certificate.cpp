#include "apps/study_certificate/study_certificate.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <iterator>
#include <limits>
#include <map>
#include <optional>
#include <stdexcept>

#include "apps/shared/exit_codes.hpp"
#include "apps/shared/options.hpp"
#include "apps/shared/placed_sample.hpp"
#include "apps/shared/print.hpp"
#include "apps/shared/say.hpp"
#include "apps/shared/signals.hpp"
#include "apps/study_certificate/calibration.hpp"
#include "apps/study_certificate/certificate_report.hpp"
#include "apps/study_certificate/scene_maker.hpp"
#include "apps/study_certificate/step_problem.hpp"
#include "io/files/output_directory.hpp"
#include "io/scene/scene_change.hpp"

namespace talus {

namespace {

namespace fs = std::filesystem;
using namespace audit;
using Clock = std::chrono::steady_clock;

/// Grains of larger scenes outgrow the audit's direct solves, as matrices of all their contacts.
constexpr int most_size = 16;

/// A study on its way: what has been audited, and the line that says so.
class Progress {
 public:
  explicit Progress(std::size_t scenes) : scenes_(scenes) {}

  std::vector<StepOfScene> steps;
  std::vector<std::string> gave_up;  ///< runs that an error ended behind steps that do not hold
  std::vector<std::string> ended;    ///< that one ended behind certified steps, or none

  /// Audits one scene and takes its steps.
  void audit(const io::Scene& scene, const std::string& family, const Sample& grains, const AuditPlan& plan) {
    io::Scene placed = scene;
    Bodies bodies;
    AuditedRun run;
    try {
      io::place_walls(placed, grains);
      append(grains, bodies);
      run = audit_run(placed, bodies, plan, [&](const AuditedStep&) {
        say_where(scene.name);
        return stop_signal() == 0;
      });
    } catch (const std::exception& error) {
      run.ended = error.what();
    }
    if (!run.ended.empty()) (run.gave_up() ? gave_up : ended).push_back(scene.name + ": " + run.ended);
    const double tolerance = placed.setup.solver.tolerance;
    for (AuditedStep& step : run.steps) steps.push_back({scene.name, family, tolerance, std::move(step)});
    if (stop_signal() == 0) ++done_;
  }

  std::size_t done() const { return done_; }  ///< scenes

  double seconds() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }

 private:
  static constexpr double every = 10;  ///< [s] between two lines

  /// At once behind the first step, so that whoever waits knows that the study is under way.
  void say_where(const std::string& scene) {
    if (said_ && seconds() < *said_ + every) return;
    said_ = seconds();
    say(fmt::format("{} of {} scenes, {} steps, {:.0f} s; at {}", done_, scenes_, steps.size(), *said_,
                    scene));
  }

  std::size_t scenes_, done_ = 0;
  Clock::time_point start_ = Clock::now();
  std::optional<double> said_;  ///< [s] of the last line
};

/// Largest bounded error over the claim of a certified and judged step; nothing is worse than a disputed one.
double worst_ratio(const AuditedStep& step) {
  double worst = 0;
  if (step.certified && step.judged == Judged::other_problem) return std::numeric_limits<double>::infinity();
  if (!step.certified || step.judged != Judged::yes) return worst;
  for (const Measure& measure : measures())
    if (measure.bounded) worst = std::max(worst, step.errors.*measure.error / step.claimed);
  return worst;
}

std::vector<std::string> families_of(const StudyCertificateOptions& options) {
  std::vector<std::string> names = options.families;
  if (names.empty())
    for (const SceneFamily& family : scene_families()) names.emplace_back(family.name);
  return names;
}

/// Audits made scenes; keeps the worst of each tolerance.
void audit_made(const StudyCertificateOptions& options, const fs::path& directory, Progress& progress) {
  const std::vector<std::string> families = families_of(options);
  for (const double tolerance : options.tolerances.empty() ? std::vector<double>{1e-3} : options.tolerances) {
    MakerSettings settings;
    settings.steps = options.steps > 0 ? options.steps : 20;
    settings.tolerance = tolerance;
    settings.size = options.size;
    settings.subdomains = std::max(1, options.subdomains);
    if (!options.coupling.empty()) settings.coupling = couplings().named(options.coupling).kind;
    std::multimap<double, MadeScene, std::greater<>> worst;
    for (int k = 0; k < options.scenes && stop_signal() == 0; ++k) {
      const std::string& family = families[static_cast<std::size_t>(k) % families.size()];
      MadeScene made = make_scene(family, options.seed + static_cast<std::uint64_t>(k), settings);
      made.scene.name = fmt::format("{}-{:.0e}", made.name(), tolerance);
      made.scene.samples.front().file = made.scene.name + ".csv";
      const std::size_t first = progress.steps.size();
      progress.audit(made.scene, family, made.grains, {settings.steps, {}});
      double ratio = 0;
      for (std::size_t s = first; s < progress.steps.size(); ++s)
        ratio = std::max(ratio, worst_ratio(progress.steps[s].step));
      if (ratio > 0) worst.emplace(ratio, std::move(made));
      if (worst.size() > static_cast<std::size_t>(options.keep)) worst.erase(std::prev(worst.end()));
    }
    for (const auto& [ratio, made] : worst) keep_scene(made, directory);
  }
}

std::vector<fs::path> scene_files(const fs::path& from) {
  if (!fs::is_directory(from)) return {from};
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(from))
    if (entry.path().extension() == ".toml") files.push_back(entry.path());
  std::ranges::sort(files);
  if (files.empty()) throw std::invalid_argument(from.string() + " holds no scene file (.toml)");
  return files;
}

std::vector<io::Scene> given_scenes(const StudyCertificateOptions& options) {
  std::vector<std::string> overrides;
  if (options.subdomains > 0)
    overrides.push_back(fmt::format("decomposition.subdomains={}", options.subdomains));
  if (!options.coupling.empty()) overrides.push_back("decomposition.coupling=" + options.coupling);
  std::vector<io::Scene> scenes;
  for (const fs::path& file : scene_files(options.scenes_from)) {
    if (options.tolerances.empty()) scenes.push_back(io::load_scene(file.string(), overrides));
    for (const double tolerance : options.tolerances) {
      std::vector<std::string> all = overrides;
      all.push_back(fmt::format("solver.tolerance={}", tolerance));
      all.push_back(fmt::format("solver.balance_tolerance={}", tolerance));
      scenes.push_back(io::load_scene(file.string(), all));
    }
    try {
      demand_audited(scenes.back().setup);
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument(fmt::format("{}: {}", file.string(), error.what()));
    }
  }
  return scenes;
}

void audit_given(const StudyCertificateOptions& options, const std::vector<io::Scene>& scenes,
                 Progress& progress) {
  const AuditPlan plan{options.steps > 0 ? options.steps : std::numeric_limits<std::int64_t>::max(), {}};
  for (const io::Scene& scene : scenes) {
    if (stop_signal() != 0) return;
    io::Scene placed = scene;
    Sample grains;
    try {
      grains = place_sample(placed).sample;
    } catch (const std::exception&) {
      if (stop_signal() != 0) return;  // which cuts a deposition short
      throw;
    }
    progress.audit(placed, scene.name, grains, plan);
  }
}

std::string summary_of(const Progress& progress, std::size_t scenes) {
  return fmt::format("{} scenes, {} steps in {:.0f} s, {} of them in the runs.", scenes,
                     progress.steps.size(), progress.seconds(), [&] {
                       double run = 0;
                       for (const StepOfScene& one : progress.steps) run += one.step.run_seconds;
                       return fmt::format("{:.0f}", run);
                     }());
}

int conclude(const Progress& progress, std::size_t scenes, const std::string& directory, bool by_family) {
  const std::vector<CalibrationRow> rows = calibrate(progress.steps);
  const std::string summary = summary_of(progress, stop_signal() == 0 ? scenes : progress.done());
  print_out("{}\n{}\n", calibration_table(rows, by_family), summary);
  write_certificate_report(directory, progress.steps, rows, summary);
  say(fmt::format("calibration.csv, steps.csv, pictures and report.html in {}", directory));
  const std::vector<std::string> broken = broken_bounds(rows, {});
  for (const std::string& sentence : broken) print_error("talus: error: {}\n", sentence);
  for (const std::string& sentence : progress.gave_up) say(fmt::format("gave up: {}", sentence));
  for (const std::string& sentence : progress.ended) print_error("talus: error: {}\n", sentence);
  if (!broken.empty() || !progress.ended.empty()) return exit_failure;
  if (stop_signal() == 0) return exit_done;
  say(fmt::format("stopped: {} after {} of {} scenes", signal_name(stop_signal()), progress.done(), scenes));
  return exit_stopped;
}

}  // namespace

void add_study_certificate_options(CLI::App& app, StudyCertificateOptions& options) {
  app.add_option("--scenes", options.scenes, "made scenes, for each tolerance")
      ->type_name("N")
      ->capture_default_str()
      ->check(above_zero());
  app.add_option("--steps", options.steps, "steps of a scene [20; of a file all]")
      ->type_name("K")
      ->check(above_zero());
  app.add_option("--seed", options.seed, "seed of the first scene; the next one has the next seed")
      ->type_name("S")
      ->capture_default_str()
      ->check(not_negative());
  app.add_option("--size", options.size, "grains of a made scene, over the usual number (up to some 150)")
      ->type_name("F")
      ->capture_default_str()
      ->check(CLI::Range(1, most_size));
  std::vector<std::string> names;
  for (const SceneFamily& family : scene_families()) names.emplace_back(family.name);
  app.add_option("--families", options.families,
                 fmt::format("families of scenes, of {} [all]", fmt::join(names, ", ")))
      ->type_name("A,B")
      ->delimiter(',')
      ->check(CLI::IsMember(names).description(""));
  app.add_option("--tolerances", options.tolerances,
                 "solver.tolerance and solver.balance_tolerance alike [0.001; of a file its own]")
      ->type_name("T,..")
      ->delimiter(',')
      ->check(above_zero());
  app.add_option("--subdomains", options.subdomains, "of every scene [1; of a file its own]")
      ->type_name("N")
      ->check(CLI::Range(1, most_subdomains));
  app.add_option("--coupling", options.coupling, "decomposition.coupling of every scene")
      ->type_name(fmt::format("{}", fmt::join(couplings().names(), "|")))
      ->check(CLI::IsMember(couplings().names()).description(""));
  app.add_option("--scenes-from", options.scenes_from,
                 "a scene file, or a folder of them, instead of made ones")
      ->type_name("PATH")
      ->check(CLI::ExistingPath)
      ->excludes("--scenes", "--seed", "--size", "--families");
  app.add_option("--keep", options.keep, "worst scenes that are kept as files, for each tolerance")
      ->type_name("N")
      ->capture_default_str()
      ->check(not_negative());
  app.add_option("--out", options.out, "directory of the study [out/study-certificate]")->type_name("DIR");
  app.add_flag("--force", options.force, "replace an earlier study in the directory");
}

int study_certificate_command(const StudyCertificateOptions& options) {
  const std::string directory = options.out.empty() ? "out/study-certificate" : options.out;
  std::optional<io::DirectoryLock> lock;
  std::vector<io::Scene> given;
  catch_signals();
  try {
    if (!options.scenes_from.empty()) given = given_scenes(options);
    std::vector<fs::path> inputs;
    for (const io::Scene& scene : given) {
      inputs.emplace_back(scene.source_file);
      std::ranges::move(io::files_read(scene), std::back_inserter(inputs));
    }
    lock.emplace(io::prepare_output_directory(directory, options.force, is_certificate_name, inputs));
  } catch (const std::exception& error) {
    print_error("talus: error: {}\n", error.what());
    return exit_bad_input;
  }
  try {
    const bool files = !options.scenes_from.empty();
    const std::size_t scenes = files ? given.size()
                                     : static_cast<std::size_t>(options.scenes) *
                                           std::max<std::size_t>(1, options.tolerances.size());
    Progress progress(scenes);
    if (files)
      audit_given(options, given, progress);
    else
      audit_made(options, directory, progress);
    return conclude(progress, scenes, directory, files);
  } catch (const std::exception& error) {
    print_error("talus: error: {}\n", error.what());
    return exit_failure;
  }
}

}  // namespace talus
