#include "apps/study_scaling/study_scaling.hpp"

#include <fmt/format.h>

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <optional>
#include <stdexcept>

#include "apps/shared/child_process.hpp"
#include "apps/shared/exit_codes.hpp"
#include "apps/shared/options.hpp"
#include "apps/shared/print.hpp"
#include "apps/shared/say.hpp"
#include "apps/study_scaling/scaling_plan.hpp"
#include "apps/study_scaling/scaling_report.hpp"
#include "apps/study_scaling/scaling_runs.hpp"
#include "apps/study_scaling/scaling_scenes.hpp"
#include "apps/study_scaling/scaling_study.hpp"
#include "io/files/output_directory.hpp"
#include "io/scene/scene_change.hpp"

namespace talus {

namespace {

namespace fs = std::filesystem;

/// Traces, and the scenes that those of weak scaling are of.
bool is_name_but_recorded(const std::string& name) {
  return is_study_scaling_name(name) && !name.starts_with("traces/") && !name.starts_with("weak-");
}

std::string text_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// True when the folder holds this sample.
bool holds(const fs::path& directory, const ScalingSample& sample, const std::string& stem) {
  const io::ScratchFolder draft(directory / "run");
  write_scaling_sample(sample, draft.path(), stem);
  return std::ranges::all_of(std::array{".toml", ".csv"}, [&](const char* ending) {
    return text_of(directory / (stem + ending)) == text_of(draft.path() / (stem + ending));
  });
}

/// Writes the scene of strong scaling. Traces that are there must be of the same; throws
/// std::invalid_argument.
void write_strong(const ScalingSample& sample, const fs::path& directory, bool reuse, const auto& prepare) {
  if (reuse && fs::exists(directory / "strong.toml") && !holds(directory, sample, "strong"))
    throw std::invalid_argument(
        fmt::format("--reuse: the traces in {} are of another scene or sample; --force replaces them",
                    directory.string()));
  prepare();
  write_scaling_sample(sample, directory, "strong");
}

/// The scene with the overrides of a variant. Throws io::SceneError.
io::Scene scene_of(const StudyScalingOptions& options, const std::string& variant) {
  std::vector<std::string> overrides = options.overrides;
  for (const std::string& word : split_words(variant)) overrides.push_back(word);
  return io::load_scene(options.scene, overrides);
}

/// Rows of steps that missed their tolerance where the scene, with the overrides of the variant, does not
/// allow it.
std::size_t rows_over_tolerance(const std::map<std::string, bool>& allow_unconverged,
                                const std::vector<ScalingRow>& rows) {
  const auto over = [&](const ScalingRow& row) {
    return row.missed > 0 && !allow_unconverged.at(row.variant);
  };
  return static_cast<std::size_t>(std::ranges::count_if(rows, over));
}

/// Open MPI's mpirun refuses root unless told so; a container has no other user. What the user says stays.
void let_root_run_ranks() {
  if (::geteuid() != 0) return;
  ::setenv("OMPI_ALLOW_RUN_AS_ROOT", "1", 0);
  ::setenv("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1", 0);
}

/// A study whose options, scene and sample have been checked, and whose directory is prepared.
struct PreparedStudy {
  ScalingPlan plan;
  ScalingSample sample;
  std::map<std::string, bool> allow_unconverged;  ///< by variant
  std::vector<RecordedTrace> recordings;          ///< of an earlier study
  std::string directory;                          ///< absolute
  std::string no_weak;                            ///< why the sample cannot grow; "" when it can
  std::optional<io::DirectoryLock> lock;
};

/// Throws std::invalid_argument where the scene surely ends before step `last`.
void demand_steps(const io::Scene& scene, std::int64_t last) {
  std::int64_t most = 0;
  for (const Stage& stage : scene.setup.stages) {
    if (!stage.end.steps) return;
    most += *stage.end.steps;
  }
  if (most < last)
    throw std::invalid_argument(
        fmt::format("the scene ends after {} steps: ask for earlier ones than {} with --steps", most, last));
}

/// The part of the scene's sample that weak scaling on n cores has.
double weak_part(const std::vector<int>& all, int n) {
  return static_cast<double>(n) / all.back();
}

/// Throws std::invalid_argument where the smallest sample cannot be made.
void demand_weak_sample(const StudyScalingOptions& options, const std::vector<int>& all) {
  try {
    scaled_sample(options.scene, options.overrides, options.stage, weak_part(all, all.front()));
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(
        fmt::format("the sample of weak scaling for {} of {} cores cannot be made: {}; ask for others with "
                    "--weak, or for none with --no-weak",
                    all.front(), all.back(), error.what()));
  }
}

/// Fills in `study`, which begins empty. Throws std::exception for whatever is wrong with the options and
/// their files.
void prepare(const StudyScalingOptions& options, PreparedStudy& study) {
  study.plan = plan_of(options);
  const io::Scene scene = scene_of(options, "");
  study.allow_unconverged[""] = scene.setup.allow_unconverged;
  for (const std::string& variant : study.plan.variants)  // a mistake is heard of now
    study.allow_unconverged[variant] = scene_of(options, variant).setup.allow_unconverged;
  study.no_weak = options.from.empty() ? why_not_weak(scene) : "it begins from results";
  if (!options.weak.empty() && !study.no_weak.empty())
    throw std::invalid_argument(fmt::format("--weak: the sample cannot grow, since {}", study.no_weak));
  study.sample = scaling_sample(options.scene, options.overrides, options.from, options.stage);
  const ScalingSample& sample = study.sample;
  if (sample.grains.size() == 0)
    throw std::invalid_argument(
        "no grain is there at the beginning, all are inserted: begin from a frame of a run with --from");
  if (const auto most = static_cast<std::size_t>(study.plan.strong.back()); most > sample.grains.size())
    throw std::invalid_argument(fmt::format(
        "{} subdomains for {} grains: take fewer with --subdomains, and on machines of more cores "
        "--cores 1",
        most, sample.grains.size()));
  demand_steps(sample.scene, study.plan.last);
  if (study.no_weak.empty() && !study.plan.weak.empty()) demand_weak_sample(options, study.plan.weak);
  const std::string directory = options.out.empty() ? "out/scaling-" + sample.scene.name : options.out;
  if (options.reuse) study.recordings = read_recordings(fs::path(directory) / "traces" / "times.csv");
  std::vector<fs::path> inputs = io::files_read(scene);
  inputs.emplace_back(options.scene);
  write_strong(sample, directory, options.reuse, [&] {
    study.lock.emplace(
        io::prepare_output_directory(directory, options.force || options.reuse,
                                     options.reuse ? is_name_but_recorded : is_study_scaling_name, inputs));
  });
  study.directory = fs::absolute(directory).lexically_normal().string();
}

/// What is worth a look before the first run: the sample, and whether it is that of the scene.
void say_subject(const StudyScalingOptions& options, const PreparedStudy& study) {
  const ScalingSample& sample = study.sample;
  say(fmt::format("{}: {} grains, steps {} to {}", sample.scene.name, sample.grains.size(), study.plan.first,
                  study.plan.last));
  if (options.from.empty()) return;
  say(fmt::format("grains and walls are those of {}; radii {}", options.from, range_of_radii(sample.grains)));
  if (const std::string other = other_sample(sample.scene, sample.grains); !other.empty())
    say(fmt::format("warning: {} holds {}: is it the results of this scene?", options.from, other));
}

/// Weak scaling: a sample of its own for every number of cores.
void run_weak(const StudyScalingOptions& options, const PreparedStudy& prepared, ScalingStudy& study) {
  const std::vector<int>& all = prepared.plan.weak;
  for (const int n : all) {
    const ScalingSample sample =
        scaled_sample(options.scene, options.overrides, options.stage, weak_part(all, n));
    const std::string stem = fmt::format("weak-{}", n);
    if (!holds(prepared.directory, sample, stem)) study.forget(stem);
    write_scaling_sample(sample, prepared.directory, stem);
    study.weak({ScalingKind::weak, prepared.directory + "/" + stem + ".toml", "", sample.grains.size()}, n);
  }
}

int run_study(const StudyScalingOptions& options) {
  PreparedStudy prepared;
  try {
    prepare(options, prepared);
  } catch (const std::exception& error) {
    print_error("talus: error: {}\n", error.what());
    return exit_bad_input;
  }
  const ScalingPlan& plan = prepared.plan;
  const std::string& directory = prepared.directory;
  ScalingReport report;
  report.name = prepared.sample.scene.name;
  report.description = prepared.sample.scene.description;
  report.plan = plan;
  let_root_run_ranks();
  ScalingStudy study(options, plan, directory, std::move(prepared.recordings),
                     [&](const std::vector<ScalingRow>& rows) {
                       report.rows = rows;
                       write_scaling_report(directory, report);
                     });
  const ScalingSubject subject{ScalingKind::strong, directory + "/strong.toml", "",
                               prepared.sample.grains.size()};
  say_subject(options, prepared);
  report.commands = scaling_commands(study.launcher(), plan.strong, plan.repeat);
  write_scaling_report(directory, report);  // what a cluster needs is there at once
  print_out("{}", report.commands.lines);
  print_out("\n{}", report.commands.slurm);
  prepared.sample = {};
  study.strong(subject);
  if (prepared.no_weak.empty())
    run_weak(options, prepared, study);
  else if (!options.no_weak)
    say(fmt::format("no weak scaling: the sample cannot grow, since {}", prepared.no_weak));
  for (const std::string& doubt : doubts_about(study.rows())) say("warning: " + doubt);
  say(fmt::format("tables, pictures, traces and report.html in {}", directory));
  const std::size_t over = rows_over_tolerance(prepared.allow_unconverged, study.rows());
  if (over == 0) return exit_done;
  say(
      fmt::format("{} of {} rows are of runs that missed the tolerance in some of the steps {} to {} (column "
                  "missed); with --set allow_unconverged=true that is no error",
                  over, study.rows().size(), plan.first, plan.last));
  return exit_tolerance_missed;
}

}  // namespace

void add_study_scaling_options(CLI::App& app, StudyScalingOptions& options) {
  app.add_option("scene", options.scene, "scene file")->type_name("FILE")->required();
  app.add_option("--out", options.out, "directory of the study [out/scaling-NAME]")->type_name("DIR");
  app.add_flag("--force", options.force, "replace an earlier study in the directory");
  app.add_flag("--reuse", options.reuse,
               "the same, but play the traces again that it has recorded of the same scene and steps; real "
               "runs are made anew (--repeat 0: none)");
  app.add_option("--steps", options.steps, "steps that count, first and last")
      ->type_name("FIRST:LAST")
      ->capture_default_str();
  app.add_option("--from", options.from, "results.h5 whose last frame is the sample [as the scene says]")
      ->type_name("FILE");
  app.add_option("--stage", options.stage, "stage to begin with [the first]")->type_name("NAME");
  const auto numbers = [&](const char* name, std::vector<int>& values, const char* text) {
    app.add_option(name, values, text)
        ->type_name("N,..")
        ->delimiter(',')
        ->check(CLI::Range(1, most_subdomains));
  };
  numbers("--subdomains", options.subdomains, "numbers of subdomains, one a core [1,2,4,8,16]");
  numbers("--weak", options.weak,
          "the same with as many grains a core; the most have the scene's sample [as --subdomains]");
  app.add_flag("--no-weak", options.no_weak, "no weak scaling");
  numbers("--hybrid", options.hybrid, "numbers of cores to divide into ranks and threads [the most]");
  app.add_option("--variant", options.variants,
                 "predict with these overrides too, several between spaces; may be repeated")
      ->type_name("\"a.b=c ...\"")
      ->allow_extra_args(false);
  app.add_option("--network", options.networks, "of predictions: today, 2012 or node [today]")
      ->type_name("NAME,..")
      ->delimiter(',');
  app.add_option("--latency", options.latency, "of a message between nodes [s]: makes a network `given`")
      ->check(not_negative());
  app.add_option("--bandwidth", options.bandwidth, "of a node's link, each way [B/s], likewise")
      ->check(above_zero());
  app.add_option("--overhead", options.overhead, "of a core per message sent or taken [s], likewise")
      ->check(not_negative());
  app.add_option("--ranks-per-node", options.ranks_per_node, "likewise")->check(above_zero());
  app.add_option("--repeat", options.repeat, "real runs of each machine; 0: only predict")
      ->type_name("N")
      ->capture_default_str()
      ->check(not_negative());
  app.add_option("--record", options.record, "traces of each number of subdomains")
      ->type_name("N")
      ->capture_default_str()
      ->check(above_zero());
  app.add_flag("--own-caches", options.own_caches,
               "record subdomains as on cores of their own, each of whose caches holds no other");
  app.add_flag("--typical", options.typical,
               "tasks that took over three times their median take the median: for noisy recordings");
  app.add_option(
         "--quantile", options.quantile,
         "tasks take this quantile of their times in the step: for recordings on a busy machine [off]")
      ->type_name("Q")
      ->check(CLI::Range(0.0, 1.0));
  app.add_option("--cores", options.cores, "cores for real runs [all]")->type_name("N")->check(above_zero());
  app.add_option("--mpirun", options.mpirun, "words before -n RANKS [mpirun --bind-to core ...]")
      ->type_name("TEXT");
  app.add_option("--smpi", options.smpi, "talus of preset smpi: predict by running it on simulated ranks too")
      ->type_name("PROGRAM");
  app.add_option("--smpirun", options.smpirun, "SimGrid's launcher")
      ->type_name("PROGRAM")
      ->capture_default_str();
  app.add_option("--beside", options.beside, "other speedups for the pictures: name,cores,speedup")
      ->type_name("CSV");
  add_overrides(app, options.overrides);
}

int study_scaling_command(const StudyScalingOptions& options) {
  try {
    return run_study(options);
  } catch (const std::exception& error) {
    print_error("talus: error: {}\n", error.what());
    return exit_failure;
  }
}

}  // namespace talus
