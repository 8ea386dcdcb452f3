#pragma once

/// HDF5's C interface with owners for its identifiers and errors that name the file.
/// The library is not built for threads: at most one thread of the process may be inside HDF5 at a time.

#include <hdf5.h>

#include <cstddef>
#include <string>
#include <utility>

namespace talus::io::detail {

/// What HDF5 says about its last failure: the innermost description, or "unknown reason".
std::string hdf5_reason();

/// Keeps HDF5 from printing its error stack to the terminal while it lives; our exceptions say what is
/// needed.
class QuietHdf5 {
 public:
  QuietHdf5();
  QuietHdf5(const QuietHdf5&) = delete;
  QuietHdf5& operator=(const QuietHdf5&) = delete;
  ~QuietHdf5();

 private:
  H5E_auto2_t function_ = nullptr;
  void* data_ = nullptr;
};

/// Owner of one HDF5 identifier.
class Hdf5Object {
 public:
  using Close = herr_t (*)(hid_t);
  Hdf5Object(hid_t id, Close close) : id_(id), close_(close) {}
  Hdf5Object(Hdf5Object&& other) noexcept
      : id_(std::exchange(other.id_, H5I_INVALID_HID)), close_(other.close_) {}
  Hdf5Object& operator=(Hdf5Object&&) = delete;
  ~Hdf5Object() {
    if (id_ >= 0) close_(id_);
  }
  hid_t id() const { return id_; }
  /// Gives the identifier up, for those who must know whether closing worked.
  hid_t release() { return std::exchange(id_, H5I_INVALID_HID); }

 private:
  hid_t id_;
  Close close_;
};

/// `id` in an owner. Throws FileError "file: action failed: reason" when HDF5 returned an error.
Hdf5Object hold(hid_t id, Hdf5Object::Close close, const std::string& file, const std::string& action);

/// Throws the same error when `status` is negative.
void demand(long long status, const std::string& file, const std::string& action);

/// The type of texts in UTF-8 of up to `bytes`, the rest zeros. Never of variable length: those stand in
/// heaps of the file, in which a flipped bit can make HDF5 go in circles.
Hdf5Object text_type(const std::string& file, std::size_t bytes);

}  // namespace talus::io::detail
