#pragma once

/// Frames as one VTKHDF file, the format of VTK 9.3 and ParaView 5.12 and later: HDF5 with a group /VTKHDF.

#include <filesystem>
#include <memory>

#include "runtime/step/frame.hpp"

namespace talus::io {

/// Writes grains as PolyData that changes over time (VTKHDF 2.0, "Temporal Poly Data"): a vertex for each
/// grain, with point data id, radius [m], velocity [m/s], and omega [rad/s], orientation (w, x, y, z) and
/// material where the first frame with grains has them. All are in full precision, and every dataset has an
/// attribute `units`.
///
///     VtkHdfWriter writer("grains.vtkhdf");
///     for (...) writer.append(frame);
///     writer.close();
class VtkHdfWriter {
 public:
  /// Replaces a file of that name. Throws FileError, as all calls do.
  explicit VtkHdfWriter(const std::filesystem::path& path);
  ~VtkHdfWriter();
  VtkHdfWriter(const VtkHdfWriter&) = delete;
  VtkHdfWriter& operator=(const VtkHdfWriter&) = delete;

  /// Throws also when the frame lacks an array that another one had.
  void append(const Frame& frame);
  /// Writes the table of steps; the file is complete behind it.
  void close();

 private:
  struct File;
  std::unique_ptr<File> file_;
};

}  // namespace talus::io
