#pragma once

/// The arrays of a frame in results.h5, and how the rows of several ranks come into them.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "io/files/detail/hdf5_write.hpp"
#include "io/results/results.hpp"
#include "runtime/graph/communicator.hpp"
#include "runtime/step/frame.hpp"

namespace talus::io::detail {

/// An array of numbers of 8 bytes, of which each rank has a run of rows.
struct FrameArray {
  const char* group;  ///< "bodies", "contacts", "walls" or "cell"
  const char* name;
  const char* units;
  bool real;    ///< doubles; else integers of 64 bits
  bool narrow;  ///< stored in 4 bytes
  std::size_t columns;
  std::span<const std::byte> values;  ///< rows of this rank, one after the other
  std::size_t begin, all;             ///< the first of them in the array; rows of all ranks

  std::size_t rows() const { return values.size() / (8 * columns); }
  std::size_t stored_bytes() const { return all * columns * (narrow ? 4 : 8); }
};

/// What walls have in a frame. Every rank knows all of them; rank 0 writes them.
struct WallColumns {
  explicit WallColumns(const std::vector<WallReport>& walls);
  std::vector<double> position, velocity;
  std::vector<Vec3> force, normal;
  std::vector<std::int64_t> present;
  // Of poses; empty unless a wall that is no plane has moved.
  std::vector<std::array<double, 9>> rotation;  ///< row by row
  std::vector<Vec3> translation;
};

/// The periodic cell of a frame, edges in rows: empty between walls. Every rank knows it; rank 0 writes it.
struct CellColumns {
  explicit CellColumns(const Domain& domain);
  std::vector<double> origin;      ///< lower corner [m]
  std::vector<Vec3> edges, rates;  ///< a, b, c [m]; how fast they change [m/s]
};

/// The arrays of a frame, the same on all ranks but for their values. Collective. `part`, `walls` and `cell`
/// must outlive them.
std::vector<FrameArray> frame_arrays(const Frame& part, const WallColumns& walls, const CellColumns& cell,
                                     const FrameFormat& format, const graph::Communicator& ranks);

/// Creates the arrays and their groups within `frame`; with compression, in chunks. Returns where each
/// begins in the file [byte]: -1 for one without rows or in chunks.
std::vector<std::int64_t> lay_out(Place frame, const std::vector<FrameArray>& arrays, int compression);

/// Writes the rows of this rank at their places in the file, beside HDF5. Throws FileError.
void write_in_place(const std::string& path, const std::vector<FrameArray>& arrays,
                    const std::vector<std::int64_t>& begin);

/// Rank 0 gets the rows of the others in pieces and gives them to HDF5, which compresses them. Collective;
/// all ranks throw FileError where rank 0 cannot write. `frame` is rank 0's.
void write_gathered(Place frame, const std::vector<FrameArray>& arrays, const graph::Communicator& ranks);

}  // namespace talus::io::detail
