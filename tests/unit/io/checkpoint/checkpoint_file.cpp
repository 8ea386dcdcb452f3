#include "io/checkpoint/checkpoint_file.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>

#include "io/checkpoint/checkpoint_folder.hpp"
#include "io/checkpoint/number_text.hpp"
#include "io/files/detail/hdf5_write.hpp"
#include "io/files/error.hpp"
#include "runtime/graph/one_rank.hpp"
#include "runtime/graph/pretend_ranks.hpp"
#include "tests/unit/io/results/output_helpers.hpp"

namespace talus::checkpoint_file_test {
namespace {

/// Three subdomains with 4, 0 and 3 bodies, of which a rank has those in `here`.
io::CheckpointFile small_file(const std::vector<std::int32_t>& here) {
  io::CheckpointFile file;
  file.state.head.subdomains = 3;
  file.state.head.partitioner = "boxes";
  file.state.head.table_cells = {1, 1, 1};
  file.state.head.held = 0.1;
  file.state.head.report.equilibrium = std::numeric_limits<double>::infinity();
  file.state.here = here;
  const std::size_t bodies[] = {4, 0, 3};
  for (const std::int32_t e : here) {
    CheckpointPart part;
    for (std::size_t k = 0; k < bodies[e]; ++k) {
      part.id.push_back(10 * e + static_cast<std::int64_t>(k));
      part.x.push_back({0.1 * e, 1e-300, -0.0});
      part.groups.push_back(static_cast<std::uint8_t>(k));
      part.pushes.push_back(0.5F);
    }
    file.state.parts.push_back(part);
  }
  file.run = "run = 1\n";
  file.texts = {{"scene.toml", "name = 'x'\n"}, {"empty", ""}};
  return file;
}

TEST(CheckpointFiles, HoldTheSameFromAnyRanks) {
  const test::ScratchDirectory folder;
  for (const int ranks : {1, 2, 3}) {
    const auto path = folder / ("checkpoint_" + std::to_string(ranks) + ".h5");
    graph::on_pretend_ranks(ranks, [&](const graph::Communicator& world) {
      std::vector<std::int32_t> here;
      for (std::int32_t e = world.rank(); e < 3; e += ranks) here.push_back(e);
      EXPECT_EQ(io::write_checkpoint(path, small_file(here), world) > 0, world.rank() == 0);
    });
    const io::CheckpointFile read = io::read_checkpoint_head(path);
    EXPECT_EQ(read.run, "run = 1\n");
    EXPECT_EQ(read.texts.at("scene.toml"), "name = 'x'\n");
    EXPECT_EQ(read.texts.at("empty"), "");
    EXPECT_EQ(read.state.head.held, 0.1);
    EXPECT_TRUE(std::isinf(read.state.head.report.equilibrium));
    const std::vector<CheckpointPart> parts = io::read_checkpoint_parts(path, {2, 0, 1});
    const io::CheckpointFile expected = small_file({2, 0, 1});
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_EQ(parts[k].id, expected.state.parts[k].id) << ranks;
      EXPECT_EQ(parts[k].x, expected.state.parts[k].x) << ranks;
      EXPECT_EQ(parts[k].groups, expected.state.parts[k].groups) << ranks;
    }
  }
}

// Any flipped bit is either one that HDF5 does not look at and nobody reads, or it shows as an error.
TEST(CheckpointFiles, TellOfEveryFlippedBitThatMatters) {
  const test::ScratchDirectory folder;
  const auto path = folder / "checkpoint_000001.h5";
  const io::CheckpointFile expected = small_file({0, 1, 2});
  io::write_checkpoint(path, expected, graph::one_rank());
  std::ifstream in(path, std::ios::binary);
  const std::string whole{std::istreambuf_iterator<char>(in), {}};
  int told = 0;
  for (std::size_t place = 0; place < whole.size(); place += 37) {
    std::string bytes = whole;
    bytes[place] = static_cast<char>(bytes[place] ^ (1 << place % 8));
    std::ofstream(path, std::ios::binary) << bytes;
    try {
      const io::CheckpointFile read = io::read_checkpoint_head(path);
      const auto parts = io::read_checkpoint_parts(path, {0, 1, 2});
      EXPECT_EQ(read.run, expected.run) << place;
      EXPECT_EQ(read.state.head.held, expected.state.head.held) << place;
      for (std::size_t k = 0; k < 3; ++k) {
        EXPECT_EQ(parts[k].id, expected.state.parts[k].id) << place;
        EXPECT_EQ(parts[k].pushes, expected.state.parts[k].pushes) << place;
      }
    } catch (const io::FileError&) {
      ++told;
    }
  }
  EXPECT_GT(told, 10);
}

TEST(CheckpointFiles, ThatCannotBeWrittenLeaveTheLastOne) {
  const test::ScratchDirectory folder;
  const auto path = folder / "checkpoint_000001.h5";
  io::write_checkpoint(path, small_file({0, 1, 2}), graph::one_rank());
  {
    const test::FileSizeLimit full(4096);
    EXPECT_THROW(io::write_checkpoint(path, small_file({0, 1, 2}), graph::one_rank()), io::FileError);
    // On several ranks all of them are told.
    graph::on_pretend_ranks(2, [&](const graph::Communicator& world) {
      const std::vector<std::int32_t> here = world.rank() == 0 ? std::vector{0, 1} : std::vector{2};
      EXPECT_THROW(io::write_checkpoint(path, small_file(here), world), io::FileError);
    });
  }
  EXPECT_EQ(io::read_checkpoint_parts(path, {0}).front().id.size(), 4U);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1);
}

TEST(CheckpointFiles, OfOtherKindsAreRefused) {
  const test::ScratchDirectory folder;
  std::ofstream(folder / "checkpoint_000001.h5") << "no HDF5";
  EXPECT_THROW(io::read_checkpoint_head(folder / "checkpoint_000001.h5"), io::FileError);
}

// HDF5 follows what a damaged directory says out of its own memory, unless checksums tell.
TEST(CheckpointFiles, WithoutChecksumsOfTheirDirectoryAreNotGivenToHdf5) {
  const test::ScratchDirectory folder;
  const std::string path = (folder / "checkpoint_000001.h5").string();
  const auto refusal = [&] {
    return test::message_of<io::FileError>([&] { io::read_checkpoint_head(path); });
  };
  H5Fclose(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT));
  EXPECT_NE(refusal().find("has no checksums"), std::string::npos) << refusal();
  io::write_checkpoint(path, small_file({0, 1, 2}), graph::one_rank());
  EXPECT_NO_THROW(io::read_checkpoint_head(path));
  for (const std::size_t place : {0U, 8U, 44U}) {  // signature, version, the head's own checksum
    std::string bytes = test::content_of(path);
    bytes[place] = static_cast<char>(bytes[place] ^ 1);
    std::ofstream(path, std::ios::binary) << bytes;
    EXPECT_NE(refusal(), "") << place;
    bytes[place] = static_cast<char>(bytes[place] ^ 1);
    std::ofstream(path, std::ios::binary) << bytes;
  }
}

// Version 4 did not know what the ends of stages remember.
TEST(CheckpointFiles, OfEarlierVersionsAreRefusedByTheirNumber) {
  const test::ScratchDirectory folder;
  const std::string path = (folder / "checkpoint_000001.h5").string();
  io::write_checkpoint(path, small_file({0, 1, 2}), graph::one_rank());
  {
    const io::detail::Hdf5Object access = io::detail::file_access(path);
    const io::detail::Hdf5Object file = io::detail::hold(H5Fopen(path.c_str(), H5F_ACC_RDWR, access.id()),
                                                         H5Fclose, path, "opening the file");
    ASSERT_GE(H5Adelete(file.id(), "talus_checkpoint"), 0);
    io::detail::write_attribute({file.id(), path}, "talus_checkpoint", std::int64_t{4});
  }
  const std::string message = test::message_of<io::FileError>([&] { io::read_checkpoint_head(path); });
  EXPECT_NE(message.find("version 4"), std::string::npos) << message;
}

TEST(CheckpointFolder, KeepsTheLastAndThoseThatAreArchived) {
  const test::ScratchDirectory folder;
  for (const char* name : {"checkpoint_000009.h5", "checkpoint_000010.h5", "checkpoint_1000000.h5",
                           "archive_000003.h5", "checkpoint_000011.h5.part", "checkpoint_mine.h5"})
    std::ofstream(folder / name) << name;
  EXPECT_EQ(io::checkpoints_in(folder.path()).front().filename(), "checkpoint_1000000.h5");
  io::remove_old_checkpoints(folder.path(), 2);
  for (const char* name :
       {"checkpoint_000010.h5", "checkpoint_1000000.h5", "archive_000003.h5", "checkpoint_mine.h5"})
    EXPECT_TRUE(std::filesystem::exists(folder / name)) << name;
  for (const char* name : {"checkpoint_000009.h5", "checkpoint_000011.h5.part"})
    EXPECT_FALSE(std::filesystem::exists(folder / name)) << name;
}

TEST(NumberText, ReadsBackToTheBit) {
  const io::NumberWriter write;
  const Vec3 v(0.1, -0.0, 1e-310);
  const std::vector<double> reals{1.0 / 3, std::numeric_limits<double>::infinity()};
  write("v", v);
  write("reals", reals);
  write("none", std::vector<std::int64_t>{});
  write("yes", true);
  write("words", std::vector<std::string>{"steps.csv", "walls.csv"});
  const io::NumberReader read(write.text(), "file");
  Vec3 v_read;
  std::vector<double> reals_read;
  std::vector<std::int64_t> none_read{1};
  bool yes = false;
  std::vector<std::string> words;
  read("v", v_read);
  read("reals", reals_read);
  read("none", none_read);
  read("yes", yes);
  read("words", words);
  EXPECT_EQ(v_read, v);
  EXPECT_TRUE(std::signbit(v_read[1]));
  EXPECT_EQ(reals_read, reals);
  EXPECT_TRUE(none_read.empty());
  EXPECT_TRUE(yes);
  EXPECT_EQ(words.size(), 2U);
  EXPECT_THROW(read("missing", yes), io::FileError);
  EXPECT_THROW(read("words", yes), io::FileError);
}

}  // namespace
}  // namespace talus::checkpoint_file_test
