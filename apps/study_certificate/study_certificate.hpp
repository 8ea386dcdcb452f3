#pragma once

#include <CLI/CLI.hpp>

#include <cstdint>
#include <string>
#include <vector>

#include "runtime/step/setup.hpp"

namespace talus {

/// `talus study certificate`: true errors of certified steps against what they claim.
struct StudyCertificateOptions {
  int scenes = 1000;                  ///< per tolerance, dealt to the families one after the other
  int steps = 0;                      ///< of a scene; 0: 20, of a file all
  int size = 1;                       ///< grains of made scenes, over those that a family has for a seed
  std::uint64_t seed = 1;             ///< of the first scene; the next ones have seed + 1, ...
  std::vector<std::string> families;  ///< empty: all
  std::vector<double> tolerances;     ///< empty: 1e-3, of a file its own
  int subdomains = 0;                 ///< 0: 1, of a file its own
  std::string coupling;               ///< empty: alternating, of a file its own
  std::string scenes_from;            ///< a scene file, or a folder of them, instead of made scenes
  int keep = 10;                      ///< worst scenes kept per tolerance
  std::string out;                    ///< empty: out/study-certificate
  bool force = false;                 ///< replace earlier results in it
};

/// Adds the options to `app`; `options` must outlive the parsing.
void add_study_certificate_options(CLI::App& app, StudyCertificateOptions& options);

/// Audits the scenes, prints the calibration, writes tables, pictures, report.html and the worst scenes.
/// Returns an ExitCode: exit_failure when a bound is broken, or an error ended a run that had not given up
/// (AuditedRun::gave_up).
int study_certificate_command(const StudyCertificateOptions& options);

}  // namespace talus
