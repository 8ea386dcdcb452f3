#pragma once

#include <CLI/CLI.hpp>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace talus {

/// `talus study scaling`. Empty lists stand for what is said in brackets.
struct StudyScalingOptions {
  std::string scene;                   ///< scene file
  std::string out;                     ///< [out/scaling-NAME]
  bool force = false;                  ///< replace an earlier study in `out`
  bool reuse = false;                  ///< the same, but for its traces, which are played again
  std::vector<std::string> overrides;  ///< "a.b=c"
  std::string from;                    ///< results.h5 whose last frame is the sample; "": as the scene says
  std::string stage;                   ///< to begin with [the first]
  std::string steps = "3:6";           ///< first and last step that count
  std::vector<int> subdomains;         ///< [1,2,4,8,16], one a core
  std::vector<int> weak;               ///< those of weak scaling [as subdomains where the sample can grow]
  bool no_weak = false;
  std::vector<int> hybrid;            ///< subdomains whose cores are divided in all ways [the most]
  std::vector<std::string> variants;  ///< each "a.b=c", or several with spaces between
  std::vector<std::string> networks;  ///< names of scaling_networks() [today]
  std::optional<double> latency, bandwidth, overhead;  ///< of a network of the user's
  std::optional<int> ranks_per_node;
  int repeat = 5;            ///< real runs of each machine; 0: none
  int record = 1;            ///< traces of each number of subdomains
  bool own_caches = false;   ///< record several subdomains as on cores of their own (RecorderOptions)
  bool typical = false;      ///< Machine::typical
  double quantile = 0;       ///< Machine::quantile
  std::optional<int> cores;  ///< for real runs [all]
  std::string mpirun;        ///< words before the command when there are ranks [mpirun, bound to cores]
  std::string beside;        ///< CSV of other speedups: name,cores,speedup
  std::string smpi;          ///< talus built for simulated ranks; "": none
  std::string smpirun = "smpirun";
};

/// Adds the options of `talus study scaling` to `app`. `options` must outlive the parsing.
void add_study_scaling_options(CLI::App& app, StudyScalingOptions& options);

/// Measures, predicts and writes the study (docs/formats.md). Progress and errors go to stderr, the commands
/// to stdout. Returns an ExitCode; exit_tolerance_missed when steps that count missed their tolerance and the
/// scene does not allow it.
int study_scaling_command(const StudyScalingOptions& options);

}  // namespace talus
