// The directory of a run, and how files appear in it.

#include "io/files/output_directory.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "io/files/error.hpp"
#include "io/output/sinks.hpp"
#include "tests/unit/io/results/output_helpers.hpp"

namespace talus::io {
namespace {

namespace fs = std::filesystem;
using namespace talus::test;

void touch(const fs::path& path) {
  std::ofstream(path) << "mine";
}

/// For a run that ends at once.
void prepare(const std::filesystem::path& directory, bool force) {
  const DirectoryLock lock = prepare_output_directory(directory, force, is_output_name, {});
}

TEST(OutputDirectory, IsCreatedWithItsParents) {
  const ScratchDirectory scratch;
  prepare(scratch / "a/b", false);
  EXPECT_TRUE(fs::is_directory(scratch / "a/b"));
  prepare(scratch / "a/b", false);  // empty: nothing to lose
}

TEST(OutputDirectory, ThatHoldsAnythingIsRefusedAndLeftAlone) {
  const ScratchDirectory scratch;
  touch(scratch / "steps.csv");
  const std::string message = message_of<FileError>([&] { prepare(scratch.path(), false); });
  EXPECT_NE(message.find(scratch.path().string()), std::string::npos) << message;
  EXPECT_NE(message.find("--force"), std::string::npos) << message;
  EXPECT_EQ(content_of(scratch / "steps.csv"), "mine");
}

// A state, or bodies under a name that outputs have too, was removed and then asked for.
TEST(OutputDirectory, ForceRemovesNothingWhereItWouldRemoveWhatIsStillToBeRead) {
  const ScratchDirectory scratch;
  for (const char* name : {"bodies.csv", "run.json"}) touch(scratch / name);
  const std::string input = (scratch / "x/../bodies.csv").string();  // under whatever name
  fs::create_directories(scratch / "x");
  const std::string message = message_of<FileError>([&] {
    const DirectoryLock lock =
        prepare_output_directory(scratch.path(), true, is_output_name, {"/nowhere", input});
  });
  EXPECT_NE(message.find("bodies.csv"), std::string::npos) << message;
  EXPECT_NE(message.find("--out"), std::string::npos) << message;
  for (const char* name : {"bodies.csv", "run.json"}) EXPECT_EQ(content_of(scratch / name), "mine") << name;
}

TEST(OutputDirectory, ForceRemovesOurFilesAndNeverTheUsers) {
  const ScratchDirectory scratch;
  fs::create_directories(scratch / "fields");
  const std::vector<std::string> ours{"run.json",
                                      "scene.resolved.toml",
                                      "steps.csv",
                                      "results.h5",
                                      "fields/grains_000012.vtp",
                                      "fields/forces_1000000.vtp",
                                      "fields.pvd",
                                      "run.json.part",
                                      "fclib_000012.hdf5",
                                      "fclib_000012.hdf5.4711.part",
                                      "triaxial.svg"};
  const std::vector<std::string> users{
      "notes.txt",          "fields/mine.vtp",          "fields/grains_12.vtp",
      "steps.csv.bak",      "fields/grains_final1.vtp", "fields/steps.csv",
      "fclib_000012.hdf5.1"};
  for (const auto& name : ours) touch(scratch / name);
  for (const auto& name : users) touch(scratch / name);
  fs::create_directories(scratch / "walls.csv");  // a directory of that name is not ours
  touch(scratch / "elsewhere");
  fs::create_symlink(scratch / "elsewhere", scratch / "notes-of-others.txt");
  prepare(scratch.path(), true);
  for (const auto& name : ours) EXPECT_FALSE(fs::exists(scratch / name)) << name;
  for (const auto& name : users) EXPECT_TRUE(fs::exists(scratch / name)) << name;
  EXPECT_TRUE(fs::is_directory(scratch / "walls.csv"));
  EXPECT_TRUE(fs::is_symlink(scratch / "notes-of-others.txt"));
}

TEST(OutputDirectory, ForceWritesThroughNoLink) {
  for (const std::string name : {"triaxial.csv", "results.h5", "run.log", "status.json", "steps.csv.part"}) {
    const ScratchDirectory scratch, elsewhere;
    touch(elsewhere / "file");
    touch(scratch / "steps.csv");
    fs::create_symlink(elsewhere / "file", scratch / name);
    const std::string message = message_of<FileError>([&] { prepare(scratch.path(), true); });
    EXPECT_NE(message.find(name + ": is a symbolic link"), std::string::npos) << message;
    EXPECT_TRUE(fs::exists(scratch / "steps.csv")) << "nothing was touched";
    EXPECT_EQ(content_of(elsewhere / "file"), "mine");
  }
}

TEST(OutputDirectory, ALinkThatLeadsNowhereIsNamed) {
  const ScratchDirectory scratch;
  fs::create_symlink("nowhere", scratch / "run");
  const std::string message = message_of<FileError>([&] { prepare(scratch / "run", true); });
  EXPECT_NE(message.find("run: is a symbolic link that leads nowhere"), std::string::npos) << message;
}

TEST(OutputDirectory, ForceSparesWhatIsBehindALinkedFolder) {
  const ScratchDirectory scratch, elsewhere;
  touch(elsewhere / "grains_000000.vtp");
  touch(scratch / "steps.csv");
  fs::create_directory_symlink(elsewhere.path(), scratch / "fields");
  const std::string message = message_of<FileError>([&] { prepare(scratch.path(), true); });
  EXPECT_NE(message.find("fields: is a symbolic link"), std::string::npos) << message;
  EXPECT_TRUE(fs::exists(scratch / "steps.csv"));
  EXPECT_TRUE(fs::is_symlink(scratch / "fields"));
  EXPECT_EQ(content_of(elsewhere / "grains_000000.vtp"), "mine");
}

TEST(OutputDirectory, IsRefusedAsLongAsAnotherRunWritesThere) {
  const ScratchDirectory scratch;
  {
    const DirectoryLock lock = prepare_output_directory(scratch / "run", false, is_output_name, {});
    touch(scratch / "run/steps.csv");
    for (const bool force : {false, true}) {
      const std::string message = message_of<FileError>([&] { prepare(scratch / "run", force); });
      EXPECT_NE(message.find("another run is writing there"), std::string::npos) << message;
    }
    EXPECT_EQ(content_of(scratch / "run/steps.csv"), "mine");
  }
  EXPECT_NO_THROW(prepare(scratch / "run", true));
  EXPECT_TRUE(fs::is_empty(scratch / "run")) << "the lock leaves nothing behind";
}

TEST(OutputDirectory, OfScratchGoesWithTheScopeAndNothingElseDoes) {
  const ScratchDirectory scratch;
  fs::create_directory(scratch / "run");
  touch(scratch / "run/thesis.txt");
  {
    const ScratchFolder folder(scratch / "run");
    touch(folder.path() / "log");
    EXPECT_EQ(folder.path().parent_path(), scratch.path());
  }
  EXPECT_EQ(std::distance(fs::directory_iterator(scratch.path()), {}), 1);
  EXPECT_EQ(content_of(scratch / "run/thesis.txt"), "mine");
}

TEST(OutputFile, MayNotBeWhatIsReadNorAFolder) {
  const ScratchDirectory scratch;
  touch(scratch / "trace.h5");
  fs::create_symlink("trace.h5", scratch / "link.h5");
  EXPECT_NO_THROW(check_output_files({scratch / "trace.h5"}, {scratch / "other.h5", ""}, false));
  for (const char* out : {"trace.h5", "link.h5", ".", "nowhere/other.h5"})
    EXPECT_THROW(check_output_files({scratch / "trace.h5"}, {scratch / out}, true), FileError) << out;
  EXPECT_THROW(check_output_files({}, {"/dev/null"}, true), FileError);
}

TEST(OutputFile, ReplacesNothingUnlessForcedAndIsAskedForOnce) {
  const ScratchDirectory scratch;
  touch(scratch / "table.csv");
  const std::string message =
      message_of<FileError>([&] { check_output_files({}, {scratch / "table.csv"}, false); });
  EXPECT_NE(message.find("--force"), std::string::npos) << message;
  EXPECT_NO_THROW(check_output_files({}, {scratch / "table.csv"}, true));
  for (const char* same : {"new.csv", "./new.csv", "../new.csv"}) {
    const fs::path place = same == std::string("../new.csv") ? scratch / "sub" / same : scratch / same;
    fs::create_directories(scratch / "sub");
    EXPECT_THROW(check_output_files({}, {scratch / "new.csv", place}, true), FileError) << same;
  }
  EXPECT_THROW(check_output_files({}, {"of_no_test.csv", "./of_no_test.csv"}, true), FileError);
}

TEST(OutputDirectory, ThatCannotBeMadeIsNamed) {
  const ScratchDirectory scratch;
  touch(scratch / "file");
  for (const char* name : {"file", "file/below"}) {
    const std::string message = message_of<FileError>([&] { prepare(scratch / name, true); });
    EXPECT_NE(message.find((scratch / "file").string()), std::string::npos) << message;
  }
  EXPECT_EQ(content_of(scratch / "file"), "mine");
}

TEST(WholeFile, KeepsTheOldContentWhenTheNewDoesNotFit) {
  const ScratchDirectory scratch;
  write_whole(scratch / "run.json", "old");
  std::string message;
  {
    const FileSizeLimit limit(4096);
    message = message_of<FileError>([&] { write_whole(scratch / "run.json", std::string(100000, 'x')); });
  }
  EXPECT_NE(message.find("run.json"), std::string::npos) << message;
  EXPECT_NE(message.find("File too large"), std::string::npos) << message;
  EXPECT_EQ(content_of(scratch / "run.json"), "old");
  EXPECT_FALSE(fs::exists(scratch / "run.json.part"));
}

}  // namespace
}  // namespace talus::io
