#include "tests/fuzz/targets.hpp"

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

template <class Error, class Read>
void expect_only(const Read& read) {
  try {
    read();
  } catch (const Error&) {
    // What a reader is to say of such a file.
  }
}

}  // namespace

void read_scene(Bytes bytes) {
  const std::string text(bytes.begin(), bytes.end());
  expect_only<io::SceneError>([&] {
    const io::Scene scene = io::parse_scene(text, "fuzz.toml");
    // What is said of a scene is a scene again.
    io::parse_scene(io::resolved_scene(scene), "fuzz.toml");
  });
}

void read_bodies(Bytes bytes) {
  const GivenFile file(bytes);
  expect_only<io::SceneError>([&] { io::read_bodies(file.path(), 2600); });
}

void read_mesh(Bytes bytes) {
  const GivenFile file(bytes);
  expect_only<io::FileError>([&] { io::read_stl(file.path()); });
}

void read_fclib(Bytes bytes) {
  const GivenFile file(bytes);
  expect_only<io::FileError>([&] { io::read_fclib_problem(file.path()); });
}

void read_results(Bytes bytes) {
  const GivenFile file(bytes);
  expect_only<io::FileError>([&] {
    const std::size_t frames = io::frame_count(file.path());
    for (std::size_t k = 0; k < frames && k < 4; ++k) io::read_frame(file.path(), k);
  });
}

void read_checkpoint(Bytes bytes) {
  const GivenFile file(bytes);
  expect_only<io::FileError>([&] {
    io::read_checkpoint_head(file.path());
    io::read_checkpoint_parts(file.path(), {0});
  });
}

void read_trace(Bytes bytes) {
  const GivenFile file(bytes);
  expect_only<io::FileError>([&] { io::read_trace(file.path()); });
}

}  // namespace talus::fuzz
