/// HDF5 files that crash HDF5 itself, given to the commands that read them.

#include <gtest/gtest.h>

#include <string>

#include "tests/validation/commands/command_helpers.hpp"

namespace talus::damaged_files_test {
namespace {

using namespace test;

class DamagedFile : public CommandTest {
 protected:
  /// Of the corpus that is replayed: some hundred bytes, in which the names of the first group are said to
  /// have no end. HDF5 reads on out of its memory.
  void copy(const std::string& kind, const std::string& name) const {
    fs::copy_file(fs::path(TALUS_SOURCE_DIR) / "tests/fuzz/corpus" / kind / name, at(name));
  }
  void expect_refused(const std::string& arguments, const std::string& name, int code) const {
    const auto before = files_below(folder_.path());
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.code, code) << outcome.messages;
    EXPECT_NE(outcome.messages.find(name + ": "), std::string::npos) << outcome.messages;
    EXPECT_EQ(files_below(folder_.path()), before);
  }
};

TEST_F(DamagedFile, OfResultsIsAnErrorAndNothingIsWritten) {
  copy("results", "heap_without_end.h5");
  write(at("scene.toml"), R"(time_step = 1e-3
[material]
density = 2600
[sample]
kind = "state"
file = "heap_without_end.h5"
[[stage]]
end = { steps = 3 }
)");
  expect_refused("convert heap_without_end.h5 --to lammps", "heap_without_end.h5", 2);
  expect_refused("convert heap_without_end.h5 --to vtkhdf", "heap_without_end.h5", 2);
  expect_refused("run scene.toml --out out", "heap_without_end.h5", 2);
}

TEST_F(DamagedFile, OfAContactProblemIsAnErrorAndNothingIsWritten) {
  copy("fclib", "heap_without_end.hdf5");
  expect_refused("solve heap_without_end.hdf5 --out solved.hdf5", "heap_without_end.hdf5", 2);
  expect_refused("solve .", "heap_without_end.hdf5", 2);
}

/// A run that goes on writes into the file, so that a child has to do it.
TEST_F(DamagedFile, OfResultsThatARunGoesOnInIsAnError) {
  write(at("scene.toml"), column_scene);
  ASSERT_EQ(run("run scene.toml --out out --resume --steps 2").code, 0);
  std::string results = content(at("out/results.h5"));
  results.replace(results.find("HEAP") + 8, 8, 8, '\xff');
  write(at("out/results.h5"), results);
  const Outcome outcome = run("run scene.toml --out out --resume");
  EXPECT_EQ(outcome.code, 2) << outcome.messages;
  EXPECT_NE(outcome.messages.find("results.h5: "), std::string::npos) << outcome.messages;
}

}  // namespace
}  // namespace talus::damaged_files_test
