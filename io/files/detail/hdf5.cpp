#include "io/files/detail/hdf5.hpp"

#include <algorithm>

#include "io/files/error.hpp"

namespace talus::io::detail {
namespace {

/// After a write that failed (a full disk) the library's clean-up at exit crashes, and would turn exit code 1
/// into a signal; every file is closed where it is written. To be said before anything else is asked of it.
[[maybe_unused]] const bool without_exit_handler = H5dont_atexit() >= 0;

/// H5E_WALK_UPWARD begins (n = 0) at the function that met the trouble first.
herr_t keep_first(unsigned n, const H5E_error2_t* error, void* text) {
  if (n == 0 && error->desc != nullptr) *static_cast<std::string*>(text) = error->desc;
  return 0;
}

[[noreturn]] void fail(const std::string& file, const std::string& action) {
  throw FileError(file, action + " failed: " + hdf5_reason());
}

}  // namespace

std::string hdf5_reason() {
  std::string reason = "unknown reason";
  H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, keep_first, &reason);
  return reason;
}

QuietHdf5::QuietHdf5() {
  H5Eget_auto2(H5E_DEFAULT, &function_, &data_);
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
}

QuietHdf5::~QuietHdf5() {
  H5Eset_auto2(H5E_DEFAULT, function_, data_);
}

Hdf5Object hold(hid_t id, Hdf5Object::Close close, const std::string& file, const std::string& action) {
  if (id < 0) fail(file, action);
  return {id, close};
}

void demand(long long status, const std::string& file, const std::string& action) {
  if (status < 0) fail(file, action);
}

Hdf5Object text_type(const std::string& file, std::size_t bytes) {
  Hdf5Object type = hold(H5Tcopy(H5T_C_S1), H5Tclose, file, "preparing a text");
  demand(H5Tset_size(type.id(), std::max<std::size_t>(bytes, 1)), file, "preparing a text");
  demand(H5Tset_strpad(type.id(), H5T_STR_NULLPAD), file, "preparing a text");
  demand(H5Tset_cset(type.id(), H5T_CSET_UTF8), file, "preparing a text");
  return type;
}

}  // namespace talus::io::detail
