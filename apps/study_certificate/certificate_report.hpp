#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "apps/study_certificate/calibration.hpp"

namespace talus::audit {

/// Writes calibration.csv, steps.csv, the pictures and report.html. Throws io::FileError.
void write_certificate_report(const std::filesystem::path& directory, std::span<const StepOfScene> steps,
                              std::span<const CalibrationRow> rows, const std::string& summary);

/// The rows for people, aligned; those of families only with `families`.
std::string calibration_table(std::span<const CalibrationRow> rows, bool families);

/// True for names of what the study writes, kept scenes among them.
bool is_certificate_name(const std::string& name);

}  // namespace talus::audit
