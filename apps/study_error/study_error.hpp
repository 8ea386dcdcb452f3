#pragma once

#include <CLI/CLI.hpp>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace talus {

/// `talus study error`. Empty lists stand for what is said in brackets.
struct StudyErrorOptions {
  std::string subject;                 ///< scene file, or a folder of FCLIB files
  std::string out;                     ///< [out/error-NAME]
  bool force = false;                  ///< replace an earlier study in `out`
  std::vector<std::string> overrides;  ///< "a.b=c"
  std::vector<std::string> methods;    ///< [all there are]
  std::vector<double> tolerances;      ///< [1e-2, 1e-3, 1e-4; of FCLIB files 1e-4, 1e-8]
  std::vector<double> time_steps;      ///< factors of the scene's time steps [1]
  std::vector<int> subdomains;         ///< [1]
  std::vector<int> threads;            ///< [one per core]
  std::vector<std::uint64_t> seeds;    ///< [the scene's]
  std::string only;                    ///< "step", "run" or "" for both
  std::int64_t at_step = 10;           ///< steps before the one that is solved again and again
  std::optional<std::int64_t> steps;   ///< of a whole run; 20, or all that the scene has
  int max_sweeps = 5000;               ///< of a solve of the one step
  double max_seconds = 60;             ///< of a solve
};

/// Adds the options of `talus study error` to `app`. `options` must outlive the parsing, which refuses
/// options that would do nothing for the subject or with --only.
void add_study_error_options(CLI::App& app, StudyErrorOptions& options);

/// Measures and writes the study (docs/formats.md). Progress and errors go to stderr. Returns an ExitCode:
/// exit_failure when the step, or whole runs, could be solved in no way, exit_tolerance_missed when a
/// reference, or an FCLIB problem with every method, missed its tolerance.
int study_error_command(const StudyErrorOptions& options);

}  // namespace talus
