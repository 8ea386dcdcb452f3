#include "apps/study_scaling/scaling_study.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "apps/shared/child_process.hpp"
#include "apps/shared/say.hpp"
#include "apps/study_scaling/scaling_table.hpp"

namespace talus {

namespace {

namespace fs = std::filesystem;

bool of_decomposition(const std::string& variant) {
  return std::ranges::all_of(split_words(variant),
                             [](const std::string& word) { return word.starts_with("decomposition."); });
}

}  // namespace

ScalingStudy::ScalingStudy(const StudyScalingOptions& options, ScalingPlan plan, fs::path directory,
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

void ScalingStudy::strong(const ScalingSubject& subject) {
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

void ScalingStudy::forget(const std::string& scene) {
  if (std::erase_if(recordings_,
                    [&](const RecordedTrace& there) { return there.file.starts_with(scene + "-"); }) > 0)
    write_recordings(directory_ / "traces" / "times.csv", recordings_);
}

void ScalingStudy::weak(const ScalingSubject& subject, int n) {
  if (n <= plan_.cores) measure(subject, {n});
  std::vector<ScalingTraces> traces{{subject, n, {}, {}}};
  record(traces);
  predict_from(traces.front());
}

void ScalingStudy::measure(const ScalingSubject& subject, const std::vector<int>& cores) {
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

void ScalingStudy::keep() {
  relate(rows_);
  keep_(rows_);
}

void ScalingStudy::simulate(const ScalingSubject& subject, int n, const ScalingNetwork& network) {
  trace::Machine machine = network.machine;
  machine.ranks = n;
  machine.ranks_per_node = std::min(machine.ranks_per_node, n);
  ScalingRow row = row_of(subject, {n, n, 1}, {simulate_once(launcher_, simulated_, subject, machine)});
  row.source = ScalingSource::smpi;
  row.network = network.name;
  add({row});
}

void ScalingStudy::record(std::vector<ScalingTraces>& all) {
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

RunTimes ScalingStudy::recorded(const std::string& name, const fs::path& file, const ScalingTraces& traces) {
  const std::string steps = fmt::format("{}:{}", plan_.first, plan_.last);
  for (const RecordedTrace& there : recordings_) {
    if (there.file != name || !fs::exists(file)) continue;
    if (there.variant == traces.subject.variant && there.steps == steps) return there.times;
    say(fmt::format("{} was of steps {}{}: recorded anew", name, there.steps,
                    there.variant.empty() ? "" : ", " + there.variant));
  }
  const RunTimes times = record_once(launcher_, traces.subject, traces.subdomains, own_caches(traces), file);
  say(fmt::format("recorded {}: {:.4g} s a step, {:.1f} iterations", name, times.seconds, times.iterations));
  std::erase_if(recordings_, [&](const RecordedTrace& there) { return there.file == name; });
  recordings_.push_back({name, steps, traces.subject.variant, times});
  write_recordings(directory_ / "traces" / "times.csv", recordings_);  // a killed study can be taken up
  return times;
}

void ScalingStudy::predict_from(const ScalingTraces& traces) {
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

void ScalingStudy::add(const std::vector<ScalingRow>& rows) {
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

}  // namespace talus
