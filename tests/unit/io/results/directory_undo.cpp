/// A kill while HDF5 rewrites the directory of results.h5 is undone, to the byte.

#include "io/results/detail/directory_undo.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <fstream>
#include <iterator>
#include <random>

#include "io/files/error.hpp"
#include "io/results/detail/patient_read.hpp"
#include "io/results/results.hpp"
#include "runtime/graph/one_rank.hpp"
#include "tests/unit/io/results/output_helpers.hpp"

namespace talus::directory_undo_test {
namespace {

namespace fs = std::filesystem;

std::string bytes_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

Frame frame_of(std::int64_t step) {
  Frame frame;
  frame.step = step;
  frame.stage = "press";
  for (std::int64_t k = 0; k < 5; ++k) {
    frame.id.push_back(k);
    frame.x.emplace_back(k, step, 0);
    frame.radius.push_back(0.5);
    frame.u.emplace_back(0, 0, 1);
  }
  frame.walls = {{"floor", 0, 0, Vec3::Zero()}};
  return frame;
}

// Enough frames for several leaves of the tree and larger heaps of names.
TEST(DirectoryUndo, BringsTheFileBackToTheByte) {
  const test::ScratchDirectory folder;
  const fs::path path = folder / "results.h5", undo = folder / "results.h5.undo";
  io::ResultsWriter writer(path, {"floor"});
  std::mt19937 random(1);
  for (std::int64_t step = 0; step < 40; ++step) {
    const std::string before = bytes_of(path);
    io::detail::keep_directory(path.string());
    ASSERT_TRUE(fs::exists(undo)) << step;
    const std::string kept = bytes_of(undo);
    EXPECT_LT(kept.size(), 20000U) << "a few kilobytes, however large the frames are";
    writer.append(frame_of(step));
    EXPECT_FALSE(fs::exists(undo)) << "what is complete needs none";
    const std::string after = bytes_of(path);
    // Killed in the middle: some of what changed in place is there, and some is not.
    std::string torn = after;
    for (std::size_t k = 0; k < before.size(); ++k)
      if (after[k] != before[k] && random() % 2 == 0) torn[k] = before[k];
    std::ofstream(path, std::ios::binary) << torn;
    std::ofstream(undo, std::ios::binary) << kept;
    io::detail::bring_back_directory(path.string());
    EXPECT_TRUE(bytes_of(path) == before) << "frame " << step;
    EXPECT_FALSE(fs::exists(undo));
    std::ofstream(path, std::ios::binary) << after;
  }
  EXPECT_EQ(io::frame_count(path), 40U);
}

TEST(DirectoryUndo, IsTakenBackByAWriterThatGoesOn) {
  const test::ScratchDirectory folder;
  const fs::path path = folder / "results.h5", undo = folder / "results.h5.undo";
  std::string kept, torn;
  {
    io::ResultsWriter writer(path, {"floor"});
    for (std::int64_t step = 0; step < 6; ++step) {
      if (step == 5) io::detail::keep_directory(path.string());
      if (step == 5) kept = bytes_of(undo);
      writer.append(frame_of(step));
    }
  }
  std::fstream damage(path, std::ios::in | std::ios::out | std::ios::binary);
  damage.seekp(40);  // the end of the file, in the superblock
  damage.write("\0\0\0\0\0\0\0\0", 8);
  damage.close();
  std::ofstream(undo, std::ios::binary) << kept;
  io::ResultsWriter again(path, {"floor"}, graph::one_rank(), {}, 4);
  again.append(frame_of(17));
  ASSERT_EQ(io::frame_count(path), 5U);
  EXPECT_EQ(io::read_frame(path, 3).step, 3);
  EXPECT_EQ(io::read_frame(path, 4).step, 17);
}

// As a reader meets the file while a run writes a frame: it looks again, and finds what is whole by then.
TEST(DirectoryUndo, TellsReadersToLookAgain) {
  const test::ScratchDirectory folder;
  const fs::path path = folder / "results.h5", undo = folder / "results.h5.undo";
  io::ResultsWriter writer(path, {"floor"});
  writer.append(frame_of(0));
  const std::string whole = bytes_of(path);
  const auto tear = [&] { fs::resize_file(path, whole.size() / 2); };
  const auto mend = [&] { std::ofstream(path, std::ios::binary) << whole; };
  const auto frames = [&] { return io::frame_count(path); };
  tear();
  std::ofstream(undo, std::ios::binary) << "kept";
  int waits = 0;
  const auto wait = [&] {
    if (++waits == 3) mend(), fs::remove(undo);
    return waits < 10;
  };
  EXPECT_EQ(io::detail::read_patiently(path.string(), frames, wait), 1U);
  EXPECT_EQ(waits, 3);

  // The writer ends while the reader looks: only the time of the file tells.
  tear();
  fs::last_write_time(path, fs::last_write_time(path) - std::chrono::hours(1));
  int looks = 0;
  const auto overtaken = [&] {
    if (++looks > 1) return frames();
    mend();
    throw io::FileError(path.string(), "half a frame");
  };
  EXPECT_EQ(io::detail::read_patiently(path.string(), overtaken, [] { return true; }), 1U);

  tear();
  waits = 0;
  EXPECT_THROW(io::detail::read_patiently(path.string(), frames, wait), io::FileError)
      << "nobody writes to it";
  EXPECT_EQ(waits, 0);
}

TEST(DirectoryUndo, LeavesOtherFilesAlone) {
  const test::ScratchDirectory folder;
  std::ofstream(folder / "results.h5") << "no HDF5 at all";
  io::detail::keep_directory((folder / "results.h5").string());
  EXPECT_FALSE(fs::exists(folder / "results.h5.undo"));
  io::detail::bring_back_directory((folder / "results.h5").string());
  EXPECT_EQ(bytes_of(folder / "results.h5"), "no HDF5 at all");
}

}  // namespace
}  // namespace talus::directory_undo_test
