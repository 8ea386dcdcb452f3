/// Streams of the command that are closed, full or left by their reader: results are missed, messages are
/// not.

#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

#include "tests/unit/io/results/output_helpers.hpp"
#include "tests/validation/commands/command_helpers.hpp"

namespace talus::command_streams_test {
namespace {

using namespace test;

class Streams : public CommandTest {
 protected:
  /// Exit code of a shell line in the folder of the test; "talus" in it is the command.
  int shell(const std::string& line) const {
    const std::string whole =
        "cd '" + folder_.path().string() + "'; talus() { '" TALUS_COMMAND "' \"$@\"; }; " + line;
    const int status = std::system(("bash -c '" + escaped(whole) + "'").c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

 private:
  static std::string escaped(const std::string& text) {
    std::string out;
    for (const char c : text) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return out;
  }
};

TEST_F(Streams, ResultsThatStdoutDoesNotTakeAreAnError) {
  write(at("scene.toml"), column_scene);
  ASSERT_EQ(shell("talus run scene.toml --out done --trace 2>/dev/null"), 0);
  for (const std::string command :
       {"--version", "--help", "scene-reference", "plan scene.toml", "run scene.toml --dry-run",
        "status done", "status done --json", "trace show done/trace.h5", "replay done/trace.h5",
        "partition scene.toml --subdomains 2 --force", "study stability --list"}) {
    EXPECT_EQ(shell("talus " + command + " >/dev/full 2>messages"), 1) << command;
    EXPECT_NE(content(at("messages")).find("stdout"), std::string::npos) << command;
    EXPECT_EQ(shell("talus " + command + " >&- 2>messages"), 1) << command;
    EXPECT_EQ(shell("talus " + command + " >/dev/null 2>messages"), 0) << command;
  }
}

TEST_F(Streams, AReaderThatHasGoneIsNotTold) {
  EXPECT_EQ(shell("exec 3> >(exec true); wait $!; talus scene-reference >&3 2>messages"), 1);
  EXPECT_EQ(content(at("messages")), "");
}

TEST_F(Streams, MessagesThatStderrDoesNotTakeEndNothing) {
  write(at("scene.toml"), column_scene);
  int number = 0;
  for (const std::string messages : {"2>/dev/full", "2>&-", "2> >(exec true)"}) {
    const std::string out = "out" + std::to_string(number++);
    EXPECT_EQ(shell("talus run scene.toml --out " + out + " " + messages), 0) << messages;
    EXPECT_EQ(summary(at(out)).at("status"), "done") << messages;
    EXPECT_TRUE(content(at(out) / "run.log").starts_with("talus: ")) << messages;
    // Errors keep their exit code, also those that are told of while another is handled.
    EXPECT_EQ(shell("talus run nothing.toml " + messages), 2) << messages;
    for (const std::string command : {"plan", "partition --subdomains 2", "solve", "status", "trace show",
                                      "trace export --format svg", "replay", "study error", "study scaling"})
      EXPECT_EQ(shell("talus " + command + " nothing.toml " + messages), 2) << command << " " << messages;
    EXPECT_EQ(shell("talus run scene.toml --dry-run " + messages + " >/dev/null"), 0) << messages;
  }
}

TEST_F(Streams, ANegativeSeedIsNamedAsItWasGiven) {
  write(at("scene.toml"), column_scene);
  for (const std::string command : {"study error scene.toml --seeds=-1", "study certificate --seed=-1"}) {
    EXPECT_EQ(shell("talus " + command + " 2>messages"), 2) << command;
    const std::string said = content(at("messages"));
    EXPECT_NE(said.find("--seed"), std::string::npos) << said;
    EXPECT_NE(said.find("got -1"), std::string::npos) << said;
  }
}

TEST_F(Streams, ScenesThatAreNoFilesOrTooLargeAreRefusedAtOnce) {
  write(at("scene.toml"), column_scene);
  EXPECT_EQ(shell("mkfifo pipe; timeout 5 \"" TALUS_COMMAND "\" run pipe 2>messages"), 2);
  EXPECT_NE(content(at("messages")).find("is a pipe"), std::string::npos);
  EXPECT_EQ(shell("talus run scene.toml --set sample.cells=[1000,1000,2000] 2>messages"), 2);
  EXPECT_NE(content(at("messages")).find("GB to run"), std::string::npos) << content(at("messages"));
  EXPECT_FALSE(fs::exists(at("out")));
}

// A file of results took the number of the stream, and messages went into it.
TEST_F(Streams, FilesOfResultsAreNoStreams) {
  write(at("scene.toml"), column_scene);
  ASSERT_EQ(shell("talus run scene.toml --out open 2>/dev/null"), 0);
  ASSERT_EQ(shell("talus run scene.toml --out closed 0<&- 1>&- 2>&-"), 0);
  EXPECT_EQ(summary(at("closed")).at("digest"), summary(at("open")).at("digest"));
  EXPECT_EQ(content(at("closed/walls.csv")), content(at("open/walls.csv")));
}

}  // namespace
}  // namespace talus::command_streams_test
