#pragma once

#include <filesystem>
#include <string>

namespace talus {

/// The page of a run, also while it goes on: HTML that needs nothing but itself. Throws std::invalid_argument
/// where no run was begun in the directory, io::FileError where a table is not as Talus wrote it.
std::string run_report(const std::filesystem::path& directory);

struct ReportOptions {
  std::string directory;
  std::string out;     ///< file; "": report.html in the directory, which replaces an earlier one
  bool force = false;  ///< replace a file `out` that is there
};

/// Writes it. Returns an ExitCode.
int report_command(const ReportOptions& options);

}  // namespace talus
