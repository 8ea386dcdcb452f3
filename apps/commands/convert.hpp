#pragma once

#include <string>

namespace talus {

struct ConvertOptions {
  std::string run;     ///< directory of the results, or a results.h5
  std::string format;  ///< "lammps" or "vtkhdf"
  std::string out;     ///< file; "": grains.lammpstrj or grains.vtkhdf beside results.h5
  bool force = false;  ///< replace the file
};

/// Writes the frames of a run in the format of another program. Returns an ExitCode.
int convert_command(const ConvertOptions& options);

}  // namespace talus
