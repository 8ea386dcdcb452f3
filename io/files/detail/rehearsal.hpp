#pragma once

/// Files that may crash HDF5, tried in a child process first. Where the directory of a file has no checksums
/// HDF5 follows what stands there, out of its own memory if it is damaged (docs/decisions/0031).

#include <functional>
#include <string>

namespace talus::io::detail {

/// Set by processes that are there to be lost, as a fuzzer's: they need no children.
inline bool this_process_may_die = false;

/// Lets a child process do `work`, which opens, reads or writes the file `path` and closes it again. Throws
/// the FileError that it throws, one that ends with `remedy` where the child dies of it, or asks for far more
/// time or memory than a file of that size needs, and std::logic_error for what else `work` throws, which is
/// no fault of the file. Returns normally when the work went well: what it read
/// is gone with the child, what it wrote is written.
/// False when there is no child, since the system starts none or this process needs none; nothing has
/// happened then.
///
/// The child is a copy of this process with the calling thread alone: `work` uses neither MPI nor threads.
bool done_in_a_child(const std::string& path, const std::string& remedy, const std::function<void()>& work);

/// `read()`, after a child has done the same and lived: with a copy of the same memory it makes the same
/// calls. What a damaged file breaks unseen may still show later. Without children it reads all the same:
/// nearly all files are whole.
template <class Read>
auto rehearsed(const std::string& path, const std::string& remedy, const Read& read) {
  done_in_a_child(path, remedy, [&read] { read(); });
  return read();
}

}  // namespace talus::io::detail
