/// Full disks and a rank without memory: all ranks end within seconds, the reason is in run.json, and what is
/// mended goes on.

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <chrono>
#include <fstream>
#include <thread>
#include <vector>

#include "io/results/results.hpp"
#include "tests/mpi/launcher.hpp"

namespace talus::faults_test {
namespace {

using namespace test;

/// Nothing waits longer for ranks that cannot go on [s].
constexpr double patience = 10;

/// So few grains that a frame is mostly what HDF5 writes around arrays: its closing of the file is where a
/// full disk shows.
const std::string few_grains = R"(box = true
time_step = 1e-3
allow_unconverged = true
[material]
density = 2600
[sample]
kind = "deposition"
count = 12
base = [0.06, 0.06]
radius_distribution = "uniform"
radius_min = 0.008
radius_max = 0.012
[decomposition]
subdomains = 2
[[stage]]
name = "press"
end = { steps = 30 }
[checkpoint]
every_steps = 3
[output]
every_steps = 1
fields = false
pictures = false
)";

class Faulty : public OnRanks {
 protected:
  void SetUp() override { write(at("scene.toml"), few_grains); }

  /// `line` with the folder "disk", a disk of so many kB that goes with it. Skips the test where that takes
  /// rights it has not.
  Outcome on_disk(int kilobytes, const std::string& line) const {
    return shell(
        fmt::format("mkdir -p disk; unshare -m sh -c 'mount -t tmpfs -o size={}k none disk || exit 99; {}'",
                    kilobytes, line));
  }
  Outcome shell(const std::string& line) const {
    write(at("line.sh"), line + "\n");
    const std::string all = fmt::format("cd '{0}' && sh line.sh >out.txt 2>err.txt", folder_.path().string());
    const int status = std::system(all.c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, content(at("out.txt")), content(at("err.txt"))};
  }
  static std::string command(int ranks) {
    return "timeout 60 env " + launcher(ranks) + " \"" TALUS_COMMAND "\" run scene.toml --threads 1 ";
  }
};

double seconds_since(std::chrono::steady_clock::time_point began) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
}

TEST_F(Faulty, FullDiskEndsAllRanksWithTheReason) {
  if (on_disk(64, "exit 0").code != 0) GTEST_SKIP() << "a disk of its own takes the right to mount one";
  // mpirun takes seconds to end ranks that fail: of several, half of the disks.
  for (const int ranks : {1, 2}) {
    for (const int kilobytes : ranks == 1 ? std::vector{72, 92, 100, 112, 120} : std::vector{92, 112}) {
      const auto began = std::chrono::steady_clock::now();
      const Outcome outcome = on_disk(
          kilobytes, command(ranks) + "--out disk/results; code=$?; cp disk/results/run.json .; exit $code");
      EXPECT_LT(seconds_since(began), patience) << ranks << " ranks, " << kilobytes << " kB";
      EXPECT_EQ(outcome.code, 1) << ranks << " ranks, " << kilobytes << " kB: " << outcome.messages;
      EXPECT_NE(outcome.messages.find("No space left"), std::string::npos) << outcome.messages;
      const auto end = summary(folder_.path());
      EXPECT_EQ(end.at("status"), "failed") << ranks << " ranks, " << kilobytes << " kB";
      EXPECT_FALSE(end.at("message").get<std::string>().empty());
    }
  }
}

/// Earlier frames are whole, and the end is that of a run that always had room.
TEST_F(Faulty, DiskThatFillsAndIsFreedLosesNothing) {
  if (on_disk(64, "exit 0").code != 0) GTEST_SKIP() << "a disk of its own takes the right to mount one";
  const Outcome straight = run(1, "run scene.toml --threads 1 --out straight");
  ASSERT_EQ(straight.code, 0) << straight.messages;
  const std::size_t frames = io::frame_count(at("straight/results.h5"));
  for (const int ranks : {1, 2}) {
    for (const int room : ranks == 1 ? std::vector{96, 160, 200, 240} : std::vector{96, 200}) {
      // The rest of a disk of 4 MB is taken; the run fails; it is given back; the same line goes on.
      const std::string line = command(ranks) + "--resume --out disk/results";
      const Outcome outcome =
          on_disk(4096, fmt::format("head -c $(((4096 - {}) * 1024)) /dev/zero >disk/taken; {}; first=$?; "
                                    "cp disk/results/results.h5 early.h5; rm disk/taken; {}; code=$?; "
                                    "rm -rf parts; cp -r disk/results parts; echo first $first; exit $code",
                                    room, line, line));
      const std::string history = fmt::format("{} ranks, {} kB: {}", ranks, room, outcome.messages);
      EXPECT_NE(outcome.output.find("first 1"), std::string::npos) << outcome.output << history;
      ASSERT_EQ(outcome.code, 0) << history;
      EXPECT_EQ(digest_of("parts"), digest_of("straight")) << history;
      ASSERT_EQ(io::frame_count(at("parts/results.h5")), frames) << history;
      for (std::size_t k = 0; k < frames; ++k)
        EXPECT_EQ(io::read_frame(at("parts/results.h5"), k).x,
                  io::read_frame(at("straight/results.h5"), k).x);
      for (std::size_t k = 0; k < io::frame_count(at("early.h5")); ++k)
        EXPECT_EQ(io::read_frame(at("early.h5"), k).x, io::read_frame(at("straight/results.h5"), k).x)
            << history;
    }
  }
}

/// Rank 1 may take no more memory than it has before its grains come to it. Rank 0 waits for it, and cannot
/// say what happened.
TEST_F(Faulty, RankWithoutMemoryEndsAllRanksWithTheReason) {
  std::string scene = few_grains;
  const auto replace = [&scene](const std::string& text, const std::string& by) {
    scene.replace(scene.find(text), text.size(), by);
  };
  replace("kind = \"deposition\"", "kind = \"lattice\"");
  replace("count = 12", "count = 400000");
  replace("base = [0.06, 0.06]", "base = [1, 1]");
  write(at("scene.toml"), scene);
  // Enough for MPI, which may hang where it has too little, and too little for 200,000 grains.
  const std::string limited = "sh -c '[ $OMPI_COMM_WORLD_RANK = 0 ] || ulimit -v 290000; exec \"$0\" \"$@\"'";
  const auto began = std::chrono::steady_clock::now();
  const Outcome outcome = shell("timeout 60 env " + launcher(2) + " " + limited +
                                " \"" TALUS_COMMAND "\" run scene.toml --threads 1 --out results --steps 3");
  if (outcome.messages.find("rank 1: ") == std::string::npos || !fs::exists(at("results/run.json")))
    GTEST_SKIP() << "the limit was not met in the run: " << outcome.messages;
  EXPECT_LT(seconds_since(began), 4 * patience) << "with the making of 400,000 grains: " << outcome.messages;
  EXPECT_EQ(outcome.code, 1) << outcome.messages;
  EXPECT_EQ(summary(at("results")).at("status"), "failed") << outcome.messages;
  EXPECT_NE(summary(at("results")).at("message").get<std::string>().find("rank 1: "), std::string::npos);
}

}  // namespace
}  // namespace talus::faults_test
