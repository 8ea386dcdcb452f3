#include <fmt/format.h>

#include "apps/shared/child_process.hpp"
#include "apps/study_scaling/scaling_report.hpp"

namespace talus {

namespace {

/// Cores of the largest machine that are asked for at once; more nodes come with more tasks.
std::string slurm_script(const ScalingLauncher& launcher, const std::vector<int>& subdomains, int repeat) {
  std::string counts;
  for (const int n : subdomains) counts += fmt::format(" {}", n);
  return fmt::format(R"(#!/bin/bash
#SBATCH --job-name=talus-scaling
#SBATCH --ntasks={}
#SBATCH --cpus-per-task=1
#SBATCH --exclusive
#SBATCH --time=04:00:00
# Strong scaling on a cluster: sbatch slurm.sh, in the folder with strong.toml and strong.csv.
# Set TALUS to the program there. The table at the end has a line per run: cores, seconds and iterations a step.
set -eu
TALUS=${{TALUS:-talus}}
for repeat in $(seq {}); do
  for n in{}; do
    # 3 says that steps missed their tolerance: their time counts all the same.
    srun -n $n --cpu-bind=cores "$TALUS" run strong.toml --out cluster/$n-$repeat --threads 1 --steps {} \
      --set decomposition.subdomains=$n || [ $? -eq 3 ]
  done
done
echo cores,seconds,iterations > cluster/times.csv
for run in cluster/*-*/steps.csv; do
  n=$(basename $(dirname $run)); n=${{n%-*}}
  awk -F, -v n=$n -v first={} -v last={} '
    NR == 1 {{ for (k = 1; k <= NF; ++k) column[$k] = k; next }}
    $column["step"] >= first && $column["step"] <= last {{ s += $column["wall_s"]; i += $column["iterations"]; ++c }}
    END {{ if (c) print n "," s / c "," i / c }}' $run >> cluster/times.csv
done
sort -t, -n cluster/times.csv
)",
                     subdomains.back(), std::max(1, repeat), counts, launcher.last, launcher.first,
                     launcher.last);
}

}  // namespace

ScalingCommands scaling_commands(const ScalingLauncher& launcher, const std::vector<int>& subdomains,
                                 int repeat) {
  ScalingCommands commands;
  commands.lines = "# Strong scaling by hand, in the folder of the study: runs, then traces to be played.\n";
  ScalingLauncher here = launcher;
  here.talus = "talus";
  const ScalingSubject subject{ScalingKind::strong, "strong.toml", "", 0};
  for (const int n : subdomains)
    commands.lines += shell_line(run_words(here, subject, {n, n, 1}, fmt::format("by-hand/{}", n))) + "\n";
  for (const int n : subdomains) {
    std::vector<std::string> words = run_words(here, subject, {n, 1, 1}, fmt::format("by-hand/trace-{}", n));
    words.insert(words.end(), {"--trace", "--trace-steps", fmt::format("{}:{}", here.first, here.last)});
    commands.lines += shell_line(words) + "\n";
    commands.lines += fmt::format("talus replay by-hand/trace-{}/trace.h5 --ranks {} --threads 1\n", n, n);
  }
  commands.slurm = slurm_script(launcher, subdomains, repeat);
  return commands;
}

}  // namespace talus
