#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "io/results/column_dictionary.hpp"
#include "runtime/step/frame.hpp"

namespace talus::io {

/// The columns of probes.csv (docs/formats.md), some of their own for each material that has a name.
TableMeaning probes_meaning(std::span<const std::string> materials);

/// Its header line, with line end.
std::string probes_csv_header(std::span<const std::string> materials);

/// Appends one line, with line end. The report has one entry per name, or one where materials have none.
void append_probes_row(std::string& text, const StepReport& step, const ProbeReport& report,
                       std::span<const std::string> materials);

}  // namespace talus::io
