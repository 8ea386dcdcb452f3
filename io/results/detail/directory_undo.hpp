#pragma once

/// What a frame changes of a results.h5 that is there, kept beside it while the frame is being written: a
/// kill in the milliseconds in which HDF5 rewrites the directory of the file would leave one that nobody can
/// read, and with it all frames before.
///
/// An append writes behind the end of the file, and changes before it the superblock and the directory of
/// /frames alone: a heap of names, a B-tree and its leaves, of the first version of the format (H5F_LIBVER's
/// default), whose places are read from the file ("HDF5 File Format Specification", sections II.A, III.A,
/// III.B, III.D). Files of another version get no such guard.

#include <string>

namespace talus::io::detail {

/// Writes `path`.undo: the bytes of superblock and directory, and the length of the file. What cannot be kept
/// is not guarded, and nothing more.
void keep_directory(const std::string& path);
/// Whether there is a `path`.undo: a frame is being written, or its writer was killed.
bool directory_is_kept(const std::string& path);
/// The change is complete: `path`.undo goes.
void drop_directory(const std::string& path);
/// Where there is a `path`.undo, the file becomes what it was then. Throws FileError.
void bring_back_directory(const std::string& path);

}  // namespace talus::io::detail
