#include "apps/study_scaling/study_scaling.hpp"

#include <fmt/format.h>
#include <omp.h>

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <stdexcept>

#include "apps/shared/child_process.hpp"
#include "apps/shared/exit_codes.hpp"
#include "apps/shared/options.hpp"
#include "apps/shared/trace_feed.hpp"
#include "apps/study_scaling/scaling_predict.hpp"
#include "apps/study_scaling/scaling_report.hpp"
#include "apps/study_scaling/scaling_runs.hpp"
#include "apps/study_scaling/scaling_scenes.hpp"
#include "io/files/output_directory.hpp"

namespace talus {

namespace {

namespace fs = std::filesystem;

void say(const std::string& line) {
  fmt::print(stderr, "talus: {}\n", line);
}

/// Ascending, without repeats.
std::vector<int> ascending(const std::vector<int>& given) {
  const std::set<int> sorted(given.begin(), given.end());
  return {sorted.begin(), sorted.end()};
}

/// What a study does, once its options have been understood.
struct ScalingPlan {
  std::vector<int> strong, weak, hybrid;
  std::vector<ScalingNetwork> networks;
  std::vector<std::string> variants;  ///< without the one that is as the scene says
  std::vector<OtherSpeedup> beside;
  std::int64_t first = 1, last = 1;
  int cores = 1;
  bool own_caches = false, typical = false;
  double quantile = 0;
  int repeat = 5, record = 1;
};

void refuse(const std::string& what) {
  throw std::invalid_argument(what);
}

/// Powers of two, and all of them.
std::vector<int> cores_to_measure(int cores) {
  std::vector<int> all;
  for (int count = 1; count < cores; count *= 2) all.push_back(count);
  all.push_back(cores);
  return all;
}

ScalingNetwork given_network(const StudyScalingOptions& options) {
  ScalingNetwork network = scaling_network("today");
  network.name = "given";
  network.machine.latency = options.latency.value_or(network.machine.latency);
  network.machine.bandwidth = options.bandwidth.value_or(network.machine.bandwidth);
  network.machine.overhead = options.overhead.value_or(network.machine.overhead);
  network.machine.ranks_per_node = options.ranks_per_node.value_or(network.machine.ranks_per_node);
  network.description = fmt::format("{:g} s, {:g} B/s a node of {} ranks, {:g} s a message for the core",
                                    network.machine.latency, network.machine.bandwidth,
                                    network.machine.ranks_per_node, network.machine.overhead);
  return network;
}

ScalingPlan plan_of(const StudyScalingOptions& options) {
  ScalingPlan plan;
  const auto [first, last] = parse_steps(options.steps, "--steps");
  if (last == trace::largest_step) refuse(fmt::format("--steps {}: say which is the last", options.steps));
  plan.first = first;
  plan.last = last;
  std::vector<int> strong = options.subdomains;
  if (strong.empty()) strong = {1, 2, 4, 8, 16};
  strong.push_back(1);  // what the others are held against
  plan.cores = options.cores.value_or(omp_get_num_procs());
  plan.repeat = options.repeat;
  if (plan.repeat > 0)
    for (const int cores : cores_to_measure(plan.cores)) strong.push_back(cores);
  plan.strong = ascending(strong);
  if (!options.no_weak) {
    std::vector<int> weak = options.weak.empty() ? plan.strong : options.weak;
    weak.push_back(1);
    plan.weak = ascending(weak);
  }
  plan.hybrid = options.hybrid.empty() ? std::vector<int>{plan.strong.back()} : ascending(options.hybrid);
  for (const int n : plan.hybrid)
    if (!std::ranges::binary_search(plan.strong, n))
      refuse(
          fmt::format("--hybrid {}: there will be no trace of {} subdomains; add it to --subdomains", n, n));
  for (const std::string& name : options.networks) plan.networks.push_back(scaling_network(name));
  if (options.latency || options.bandwidth || options.overhead || options.ranks_per_node)
    plan.networks.push_back(given_network(options));
  if (plan.networks.empty()) plan.networks.push_back(scaling_network("today"));
  for (const std::string& variant : options.variants) {
    if (split_words(variant).empty()) refuse("--variant names no override");
    for (const std::string& word : split_words(variant))
      if (word.starts_with("decomposition.subdomains") || word.starts_with("decomposition.boxes"))
        refuse(fmt::format("--variant {}: the study chooses the subdomains itself; see --subdomains", word));
    plan.variants.push_back(variant);
  }
  if (!options.beside.empty()) plan.beside = read_speedups(options.beside);
  plan.record = options.record;
  plan.typical = options.typical;
  plan.own_caches = options.own_caches;
  plan.quantile = options.quantile;
  const std::string mpirun = options.mpirun.empty() ? "mpirun" : split_words(options.mpirun).front();
  if (plan.repeat > 0 && plan.cores > 1 && !program_exists(mpirun))
    refuse(
        fmt::format("{} is not to be found; real runs on several ranks need it. Load MPI, name it with "
                    "--mpirun, or ask for --cores 1",
                    mpirun));
  if (!options.smpi.empty()) {
    if (!fs::is_regular_file(options.smpi))
      refuse(options.smpi + " is not there: --smpi wants the talus of preset smpi");
    if (!program_exists(options.smpirun)) refuse(options.smpirun + " is not to be found; see --smpirun");
  }
  return plan;
}

/// Open MPI's mpirun refuses root unless told so; a container has no other user. What the user says stays.
void let_root_run_ranks() {
  if (::geteuid() != 0) return;
  ::setenv("OMPI_ALLOW_RUN_AS_ROOT", "1", 0);
  ::setenv("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1", 0);
}

class Study {
 public:
  using Keep = std::function<void(const std::vector<ScalingRow>&)>;

  /// `keep` is called with all rows whenever there are new ones.
  Study(const StudyScalingOptions& options, ScalingPlan plan, fs::path directory,
        std::vector<RecordedTrace> recordings, Keep keep)
      : plan_(std::move(plan)),
        directory_(std::move(directory)),
        recordings_(std::move(recordings)),
        keep_(std::move(keep)) {
    simulated_ = {options.smpi, options.smpirun};
    launcher_.talus = own_path();
    launcher_.mpirun = split_words(options.mpirun);
    launcher_.work = directory_ / "run";
    launcher_.first = plan_.first;
    launcher_.last = plan_.last;
  }

  /// The whole study of one sample that stays as it is.
  void strong(const ScalingSubject& subject) {
    measure(subject, cores_to_measure(plan_.cores));
    std::vector<ScalingTraces> all;
    for (const int n : plan_.strong) {
      all.push_back({subject, n, {}, {}});
      for (const std::string& variant : plan_.variants) {
        // How subdomains act on one another makes no difference to one.
        if (n == 1 && of_decomposition(variant)) continue;
        all.push_back({subject, n, {}, {}});
        all.back().subject.variant = variant;
      }
    }
    record(all);
    for (const ScalingTraces& traces : all) predict_from(traces);
    if (!simulated_.talus.empty())
      for (const int n : plan_.strong)
        for (const ScalingNetwork& network : plan_.networks) simulate(subject, n, network);
  }

  /// What was recorded of this scene does not hold any more. The list says so before anything else happens: a
  /// study may be killed.
  void forget(const std::string& scene) {
    if (std::erase_if(recordings_,
                      [&](const RecordedTrace& there) { return there.file.starts_with(scene + "-"); }) > 0)
      write_recordings(directory_ / "traces" / "times.csv", recordings_);
  }

  void weak(const ScalingSubject& subject, int n) {
    if (n <= plan_.cores) measure(subject, {n});
    std::vector<ScalingTraces> traces{{subject, n, {}, {}}};
    record(traces);
    predict_from(traces.front());
  }

  const std::vector<ScalingRow>& rows() const { return rows_; }
  const ScalingLauncher& launcher() const { return launcher_; }

 private:
  static bool of_decomposition(const std::string& variant) {
    return std::ranges::all_of(split_words(variant),
                               [](const std::string& word) { return word.starts_with("decomposition."); });
  }

  /// Runs on every number of cores, a subdomain a core, divided into ranks and threads in all ways. Machines
  /// take turns, so that what disturbs one disturbs all.
  void measure(const ScalingSubject& subject, const std::vector<int>& cores) {
    if (plan_.repeat == 0) return;
    std::vector<ScalingMachine> machines;
    for (const int count : cores)
      for (const int ranks : rank_counts(count)) machines.push_back({count, ranks, count / ranks});
    std::vector<std::vector<RunTimes>> times(machines.size());
    const std::size_t before = rows_.size();
    for (int repeat = 0; repeat < plan_.repeat; ++repeat)
      for (std::size_t m = 0; m < machines.size(); ++m) {
        times[m].push_back(run_once(launcher_, subject, machines[m]));
        rows_.resize(std::max(rows_.size(), before + m + 1));
        rows_[before + m] = row_of(subject, machines[m], times[m]);
        keep();
      }
    for (std::size_t m = 0; m < machines.size(); ++m) {
      const ScalingRow& row = rows_[before + m];
      say(fmt::format("{}, {} ranks x {} threads: {:.4g} s a step ({:.4g} - {:.4g}), {:.1f} iterations",
                      name_of(row.kind), row.ranks, row.threads, row.seconds, row.fastest, row.slowest,
                      row.iterations));
    }
  }

  void keep() {
    relate(rows_);
    keep_(rows_);
  }

  void simulate(const ScalingSubject& subject, int n, const ScalingNetwork& network) {
    trace::Machine machine = network.machine;
    machine.ranks = n;
    machine.ranks_per_node = std::min(machine.ranks_per_node, n);
    ScalingRow row = row_of(subject, {n, n, 1}, {simulate_once(launcher_, simulated_, subject, machine)});
    row.source = ScalingSource::smpi;
    row.network = network.name;
    add({row});
  }

  /// One core has the whole sample in its caches, or has not.
  bool own_caches(const ScalingTraces& traces) const { return plan_.own_caches && traces.subdomains > 1; }

  /// Recordings take turns as runs do.
  void record(std::vector<ScalingTraces>& all) {
    for (int k = 1; k <= plan_.record; ++k)
      for (ScalingTraces& traces : all) {
        const ScalingSubject& subject = traces.subject;
        std::string variant;
        if (!subject.variant.empty())
          variant = fmt::format(
              "-variant{}", std::ranges::find(plan_.variants, subject.variant) - plan_.variants.begin() + 1);
        const std::string name = fmt::format("{}-{}{}{}-{}.h5", name_of(subject.kind), traces.subdomains,
                                             variant, own_caches(traces) ? "-own" : "", k);
        const fs::path file = directory_ / "traces" / name;
        traces.times.push_back(recorded(name, file, traces));
        traces.files.push_back(file);
      }
  }

  /// Of an earlier study, or recorded now.
  RunTimes recorded(const std::string& name, const fs::path& file, const ScalingTraces& traces) {
    const std::string steps = fmt::format("{}:{}", plan_.first, plan_.last);
    for (const RecordedTrace& there : recordings_) {
      if (there.file != name || !fs::exists(file)) continue;
      if (there.variant == traces.subject.variant && there.steps == steps) return there.times;
      say(fmt::format("{} was of steps {}{}: recorded anew", name, there.steps,
                      there.variant.empty() ? "" : ", " + there.variant));
    }
    const RunTimes times =
        record_once(launcher_, traces.subject, traces.subdomains, own_caches(traces), file);
    say(fmt::format("recorded {}: {:.4g} s a step, {:.1f} iterations", name, times.seconds,
                    times.iterations));
    std::erase_if(recordings_, [&](const RecordedTrace& there) { return there.file == name; });
    recordings_.push_back({name, steps, traces.subject.variant, times});
    write_recordings(directory_ / "traces" / "times.csv", recordings_);  // a killed study can be taken up
    return times;
  }

  void predict_from(const ScalingTraces& traces) {
    const int n = traces.subdomains;
    const ScalingMachine machines[] = {{n, n, 1}};
    add(predict(traces, machines, plan_.networks, plan_.typical, plan_.quantile));
    // What was measured, predicted: how far the others can be believed.
    if (n <= plan_.cores && plan_.repeat > 0 && traces.subject.variant.empty()) {
      std::vector<ScalingMachine> here;
      for (const int ranks : rank_counts(n)) here.push_back({n, ranks, n / ranks});
      const ScalingNetwork node[] = {scaling_network("node")};
      if (std::ranges::find(plan_.networks, "node", &ScalingNetwork::name) == plan_.networks.end())
        add(predict(traces, here, node, plan_.typical, plan_.quantile));
    }
    if (traces.subject.kind != ScalingKind::strong || !traces.subject.variant.empty() || n == 1 ||
        std::ranges::find(plan_.hybrid, n) == plan_.hybrid.end())
      return;
    std::vector<ScalingMachine> ways;
    for (const int ranks : rank_counts(n)) ways.push_back({n, ranks, n / ranks});
    std::vector<ScalingRow> divided = predict(traces, ways, plan_.networks, plan_.typical, plan_.quantile);
    for (ScalingRow& row : divided) row.kind = ScalingKind::hybrid;
    add(divided);
  }

  void add(const std::vector<ScalingRow>& rows) {
    for (const ScalingRow& row : rows) {
      say(fmt::format(
          "{}, {} subdomains{}, {} ranks x {} threads, network {}: predicted by {}: {:.4g} s a step, "
          "{:.1f} iterations",
          name_of(row.kind), row.subdomains, row.variant.empty() ? "" : ", " + row.variant, row.ranks,
          row.threads, row.network, name_of(row.source), row.seconds, row.iterations));
      rows_.push_back(row);
    }
    keep();
  }

  ScalingPlan plan_;
  fs::path directory_;
  ScalingLauncher launcher_;
  SimulatedLauncher simulated_;
  std::vector<RecordedTrace> recordings_;
  Keep keep_;
  std::vector<ScalingRow> rows_;
};

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
    refuse(fmt::format("--reuse: the traces in {} are of another scene or sample; --force replaces them",
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

int run_study(const StudyScalingOptions& options) {
  ScalingPlan plan;
  ScalingSample sample;
  std::map<std::string, bool> allow_unconverged;  // by variant
  std::vector<RecordedTrace> recordings;
  std::string directory = options.out, no_weak;
  std::optional<io::DirectoryLock> lock;
  try {
    plan = plan_of(options);
    const io::Scene scene = scene_of(options, "");
    allow_unconverged[""] = scene.setup.allow_unconverged;
    for (const std::string& variant : plan.variants)  // a mistake is heard of now
      allow_unconverged[variant] = scene_of(options, variant).setup.allow_unconverged;
    no_weak = options.from.empty() ? why_not_weak(scene) : "it begins from results";
    if (!options.weak.empty() && !no_weak.empty())
      refuse(fmt::format("--weak: the sample cannot grow, since {}", no_weak));
    sample = scaling_sample(options.scene, options.overrides, options.from, options.stage);
    if (const auto most = static_cast<std::size_t>(plan.strong.back()); most > sample.grains.size())
      refuse(fmt::format("{} subdomains for {} grains", most, sample.grains.size()));
    if (directory.empty()) directory = "out/scaling-" + sample.scene.name;
    if (options.reuse) recordings = read_recordings(fs::path(directory) / "traces" / "times.csv");
    write_strong(sample, directory, options.reuse, [&] {
      lock.emplace(
          io::prepare_output_directory(directory, options.force || options.reuse,
                                       options.reuse ? is_name_but_recorded : is_study_scaling_name));
    });
  } catch (const std::exception& error) {
    fmt::print(stderr, "talus: error: {}\n", error.what());
    return exit_bad_input;
  }
  directory = fs::absolute(directory).lexically_normal().string();
  ScalingReport report;
  report.name = sample.scene.name;
  report.description = sample.scene.description;
  report.networks = plan.networks;
  report.beside = plan.beside;
  report.first = plan.first;
  report.last = plan.last;
  report.record = plan.record;
  report.typical = plan.typical;
  report.quantile = plan.quantile;
  report.own_caches = plan.own_caches;
  let_root_run_ranks();
  Study study(options, plan, directory, std::move(recordings), [&](const std::vector<ScalingRow>& rows) {
    report.rows = rows;
    write_scaling_report(directory, report);
  });
  const ScalingSubject subject{ScalingKind::strong, directory + "/strong.toml", "", sample.grains.size()};
  say(fmt::format("{}: {} grains, steps {} to {}", report.name, subject.grains, plan.first, plan.last));
  if (!options.from.empty()) {
    say(fmt::format("grains and walls are those of {}; radii {}", options.from,
                    range_of_radii(sample.grains)));
    if (const std::string other = other_sample(sample.scene, sample.grains); !other.empty())
      say(fmt::format("warning: {} holds {}: is it the results of this scene?", options.from, other));
  }
  report.commands = scaling_commands(study.launcher(), plan.strong, plan.repeat);
  write_scaling_report(directory, report);  // what a cluster needs is there at once
  fmt::print("{}", report.commands.lines);
  fmt::print("\n{}", report.commands.slurm);
  sample = {};
  study.strong(subject);
  if (no_weak.empty()) {
    for (const int n : plan.weak) {
      const double part = static_cast<double>(n) / plan.weak.back();
      const ScalingSample part_sample = scaled_sample(options.scene, options.overrides, options.stage, part);
      const std::string stem = fmt::format("weak-{}", n);
      if (!holds(directory, part_sample, stem)) study.forget(stem);
      write_scaling_sample(part_sample, directory, stem);
      study.weak({ScalingKind::weak, directory + "/" + stem + ".toml", "", part_sample.grains.size()}, n);
    }
  } else if (!options.no_weak) {
    say(fmt::format("no weak scaling: the sample cannot grow, since {}", no_weak));
  }
  say(fmt::format("tables, pictures, traces and report.html in {}", directory));
  const std::size_t over = rows_over_tolerance(allow_unconverged, study.rows());
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
    fmt::print(stderr, "talus: error: {}\n", error.what());
    return exit_failure;
  }
}

}  // namespace talus
