#include "io/files/detail/descriptor.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <string>
#include <system_error>
#include <utility>

#include "io/files/error.hpp"

namespace talus::io::detail {

std::string last_error() {
  return std::generic_category().message(errno);
}

Descriptor::Descriptor(const std::filesystem::path& path, int flags)
    : path_(path), descriptor_(::open(path.c_str(), flags | O_CLOEXEC, 0666)) {
  if (descriptor_ < 0) throw FileError(path_.string(), "cannot be opened for writing: " + last_error());
}

Descriptor::~Descriptor() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void Descriptor::write(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor_, bytes.data(), bytes.size());
    if (written < 0) {
      if (errno == EINTR) continue;
      throw FileError(path_.string(), "cannot be written: " + last_error());
    }
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
}

void Descriptor::write_at(std::int64_t place, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::pwrite(descriptor_, bytes.data(), bytes.size(), place);
    if (written < 0) {
      if (errno == EINTR) continue;
      throw FileError(path_.string(), "cannot be written: " + last_error());
    }
    bytes.remove_prefix(static_cast<std::size_t>(written));
    place += written;
  }
}

void Descriptor::demand_room(std::int64_t from, std::int64_t bytes) {
  if (::fallocate(descriptor_, FALLOC_FL_KEEP_SIZE, from, bytes) == 0) return;
  if (errno == EOPNOTSUPP || errno == ENOSYS) return;
  throw FileError(path_.string(),
                  "cannot get " + std::to_string(bytes) + " bytes of the disk: " + last_error());
}

void Descriptor::cut(std::int64_t bytes) {
  const off_t length = ::lseek(descriptor_, 0, SEEK_END);
  if (length < bytes)
    throw FileError(path_.string(), "is shorter than the checkpoint says; begin anew in another directory");
  if (length > bytes) end_at(bytes);
}

void Descriptor::end_at(std::int64_t bytes) {
  if (::ftruncate(descriptor_, bytes) != 0)
    throw FileError(path_.string(), "cannot be cut back: " + last_error());
}

void Descriptor::sync() {
  // Pipes and the like cannot be synchronised, and say EINVAL.
  if (::fsync(descriptor_) != 0 && errno != EINVAL)
    throw FileError(path_.string(), "cannot be completed: " + last_error());
}

void Descriptor::close() {
  if (descriptor_ < 0) return;
  if (::close(std::exchange(descriptor_, -1)) != 0) {
    throw FileError(path_.string(), "cannot be completed: " + last_error());
  }
}

}  // namespace talus::io::detail
