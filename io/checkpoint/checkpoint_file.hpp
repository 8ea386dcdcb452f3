#pragma once

/// A checkpoint as one HDF5 file (layout: docs/checkpoints.md). Rank 0 lays out the file, whose datasets are
/// contiguous and allocated at once; then every rank writes its rows where they belong, with plain writes. So
/// no rank waits for another inside HDF5, a rank that cannot write says so, and HDF5 need not know of MPI.

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "runtime/graph/communicator.hpp"
#include "runtime/step/checkpoint.hpp"

namespace talus::io {

/// What a file holds.
struct CheckpointFile {
  Checkpoint state;
  std::string run;  ///< what the command itself goes on from, as NumberWriter writes it; rank 0's is kept
  /// By name: the scene as its file had it, as it was resolved, its overrides, and the files it reads.
  std::map<std::string, std::string> texts;
};

/// Writes `path`.part, on the disk before it gets its name. Collective; all ranks throw FileError when one
/// cannot write, and a file of that name stays as it was. Returns the bytes of the file.
std::int64_t write_checkpoint(const std::filesystem::path& path, const CheckpointFile& content,
                              const graph::Communicator& ranks);

/// What all ranks know alike; parts are left out. Throws FileError when the file is none, of another version
/// or damaged.
CheckpointFile read_checkpoint_head(const std::filesystem::path& path);

/// The parts of these subdomains. Throws FileError when their checksums are not those of the file.
std::vector<CheckpointPart> read_checkpoint_parts(const std::filesystem::path& path,
                                                  const std::vector<std::int32_t>& subdomains);

}  // namespace talus::io
