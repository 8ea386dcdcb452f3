#pragma once

/// results.h5: the state at every output time, in full precision (layout: docs/formats.md).
///
///   /walls/name                  names, in the order of the setup; material [w] where materials have names
///   /materials/name              names, by number, where they have some
///   /frames/000000               attributes step, time, stage; contacts: 0 where they are left out
///   /frames/000000/bodies        id [n], x [n,3], radius [n], u [n,3]; where computed omega [n,3] and
///                                orientation [n,4]; where materials have names, material [n]
///   /frames/000000/contacts      bodies [m,2], point [m,3], normal [m,3], gap [m], force [m,3]
///   /frames/000000/walls         position [w], velocity [w], force [w,3], normal [w,3], present [w]; where
///   one
///                                has moved that is no plane rotation [w,9], translation [w,3]
///   /frames/000000/cell          of a periodic cell: origin [3], edges [3,3], rates [3,3], an edge a row
///
/// n bodies, m contacts with a force, w walls; every dataset has an attribute `units`. Arrays are stored
/// plain unless FrameFormat says otherwise. Rank 0 lays a frame out, and every rank writes its rows at their
/// places, beside HDF5: its own parallel writing is collective, and a rank whose disk is full would leave the
/// others waiting in H5Fclose (docs/decisions/0025-checkpoints.md). Compressed rows all go through rank 0.
///
/// HDF5 is not built for threads: one thread of the process at a time, for writer and readers alike.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "runtime/graph/communicator.hpp"
#include "runtime/step/frame.hpp"

namespace talus::io {

/// What of a frame is read: contacts are most of it. `forces`: velocities where they are there; `grains`:
/// likewise, and no contacts; `places`: neither contacts nor velocities.
enum class FrameParts { all, without_contacts, forces, grains, places };

/// Throws std::invalid_argument naming the array whose length does not fit the others; `omega`,
/// `orientation` and `material` may be empty, and `u` where places are all that is asked for.
void validate(const Frame& frame, FrameParts parts = FrameParts::all);

/// What of a frame is kept, and how.
struct FrameFormat {
  enum class Precision { full, single };
  Precision precision = Precision::full;  ///< of the reals of bodies and contacts
  int compression = 0;                    ///< 0, or how hard shuffle and deflate try, 1 to 9
  bool velocities = true;                 ///< u and omega of bodies
  bool contact_geometry = true;           ///< point, normal and gap of contacts
};

/// What the file says of all frames.
struct ResultsNames {
  std::vector<std::string> walls;
  std::vector<std::int64_t> wall_materials = {};  ///< numbers; empty where materials have no names
  std::vector<std::string> materials = {};        ///< by number; empty likewise
  bool clumps = false;                            ///< bodies have shapes, which no frame holds

  ResultsNames() = default;
  ResultsNames(std::vector<std::string> wall_names) : walls(std::move(wall_names)) {}
  ResultsNames(std::initializer_list<std::string> wall_names) : walls(wall_names) {}
};

namespace detail {
struct FrameArray;
}

/// Writes results.h5 frame by frame; one file, of the same content for any number of ranks.
/// The file is closed between frames, and not locked, so that it can be read while the run goes on. A frame
/// gets its name last, when all of it is there: after a kill the file holds the frames before. A kill in the
/// few milliseconds in which the file's directory is written leaves results.h5.undo as well, which a run that
/// goes on brings back.
class ResultsWriter {
 public:
  /// Replaces a file of that name. Throws FileError. `ranks` must outlive the writer.
  ResultsWriter(const std::filesystem::path& path, const ResultsNames& names);
  /// Collective, as are the frames.
  /// With `kept` the file is there: its first frames stay, as many, the others are removed, and it goes on.
  ResultsWriter(const std::filesystem::path& path, const ResultsNames& names,
                const graph::Communicator& ranks, FrameFormat format = {},
                std::optional<std::size_t> kept = {});

  /// Appends a frame, of which each rank has its part; frame.walls are those of the constructor, in the same
  /// order. Throws FileError on all ranks when one cannot write; std::invalid_argument when the arrays do not
  /// fit together.
  void append(const Frame& frame);

  std::size_t frames_written() const { return frames_; }

 private:
  void append_here(const Frame& part, const std::vector<detail::FrameArray>& arrays);

  std::string path_;
  std::vector<std::string> wall_names_;
  const graph::Communicator& ranks_;
  FrameFormat format_;
  std::size_t frames_ = 0;
};

/// Of a results.h5 that a run goes on with, whose directory is brought back first: throws FileError unless it
/// holds the first `kept` frames, and HDF5 can read which arrays all its frames have.
void demand_kept_frames(const std::filesystem::path& path, std::size_t kept);

/// Whether its bodies are clumps, of whose shapes frames have the bounding spheres only; files of
/// earlier versions do not tell. Throws FileError when it is no results.h5.
bool holds_clumps(const std::filesystem::path& path);

/// Names of the materials of its bodies, by number; empty where they have none. Throws FileError when it is
/// no results.h5.
std::vector<std::string> material_names(const std::filesystem::path& path);

/// Number of frames in a results.h5. Throws FileError when it is none.
std::size_t frame_count(const std::filesystem::path& path);

/// The same. Throws FileError where there is none, and says when one is written.
std::size_t demand_frames(const std::filesystem::path& path);

/// Frame `index`, bit for bit as it was written. Throws FileError when there is no such frame, or its arrays
/// were left out, and names the key that writes them.
Frame read_frame(const std::filesystem::path& path, std::size_t index, FrameParts parts = FrameParts::all);

}  // namespace talus::io
