#pragma once

/// The checkpoints in the directory of a run: checkpoint_000120.h5 behind step 120, of which the last few are
/// kept, and archive_000120.h5, which nobody removes.

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace talus::io {

/// Name of the checkpoint behind a step, relative to the directory.
std::string checkpoint_name(std::int64_t step, bool archived);
/// Whether a file of that name is a checkpoint, archived or not.
bool is_checkpoint_name(const std::string& name);

/// Those in a directory, the latest step first.
std::vector<std::filesystem::path> checkpoints_in(const std::filesystem::path& directory);

/// Removes all but the last `keep` >= 1 of those that are not archived, and what killed runs have left half
/// written. What cannot be removed stays.
void remove_old_checkpoints(const std::filesystem::path& directory, int keep);

}  // namespace talus::io
