#include "tests/fuzz/targets.hpp"

#include <hdf5.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "io/checkpoint/checkpoint_file.hpp"
#include "io/fclib/fclib.hpp"
#include "io/files/error.hpp"
#include "io/files/stl.hpp"
#include "io/results/results.hpp"
#include "io/scene/bodies_file.hpp"
#include "io/scene/scene.hpp"
#include "io/trace/trace_file.hpp"

namespace talus::fuzz {

namespace {

namespace fs = std::filesystem;

/// As the command does (apps/commands/main.cpp).
const herr_t no_cleaning_at_exit = H5dont_atexit();

/// What HDF5 could not close of a damaged file would be found again under the next file's name.
void forget_open_files() {
  if (no_cleaning_at_exit >= 0 && H5Fget_obj_count(H5F_OBJ_ALL, H5F_OBJ_ALL) > 0) H5close();
}

/// The bytes as a file, in memory where the system has such files; the same name for all of a process.
class GivenFile {
 public:
  explicit GivenFile(Bytes bytes) {
    std::ofstream(path_, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  }
  GivenFile(const GivenFile&) = delete;
  GivenFile& operator=(const GivenFile&) = delete;
  ~GivenFile() {
    std::error_code ignored;
    fs::remove(path_, ignored);
  }
  const std::string& path() const { return path_; }

 private:
  const std::string path_ =
      (fs::is_directory("/dev/shm") ? std::string("/dev/shm") : fs::temp_directory_path().string()) +
      "/talus-fuzz-" + std::to_string(::getpid());
};

/// False where the reader throws what it is to say of a file that it refuses.
template <class Error, class Read>
bool reads(const Read& read) {
  try {
    read();
    return true;
  } catch (const Error&) {
    return false;
  }
}

}  // namespace

bool read_scene(Bytes bytes) {
  const std::string text(bytes.begin(), bytes.end());
  return reads<io::SceneError>([&] {
    const io::Scene scene = io::parse_scene(text, "fuzz.toml");
    // What is said of a scene is a scene again.
    io::parse_scene(io::resolved_scene(scene), "fuzz.toml");
  });
}

bool read_bodies(Bytes bytes) {
  const GivenFile file(bytes);
  return reads<io::SceneError>([&] { io::read_bodies(file.path(), 2600); });
}

bool read_mesh(Bytes bytes) {
  const GivenFile file(bytes);
  return reads<io::FileError>([&] { io::read_stl(file.path()); });
}

bool read_fclib(Bytes bytes) {
  const GivenFile file(bytes);
  const bool read = reads<io::FileError>([&] { io::read_fclib_problem(file.path()); });
  forget_open_files();
  return read;
}

bool read_results(Bytes bytes) {
  const GivenFile file(bytes);
  const bool read = reads<io::FileError>([&] {
    const std::size_t frames = io::frame_count(file.path());
    for (std::size_t k = 0; k < frames && k < 4; ++k) io::read_frame(file.path(), k);
  });
  forget_open_files();
  return read;
}

bool read_checkpoint(Bytes bytes) {
  const GivenFile file(bytes);
  const bool read = reads<io::FileError>([&] {
    io::read_checkpoint_head(file.path());
    io::read_checkpoint_parts(file.path(), {0});
  });
  forget_open_files();
  return read;
}

bool read_trace(Bytes bytes) {
  const GivenFile file(bytes);
  const bool read = reads<io::FileError>([&] { io::read_trace(file.path()); });
  forget_open_files();
  return read;
}

}  // namespace talus::fuzz
