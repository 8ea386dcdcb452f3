/// A rank that dies takes the others along, within seconds, and leaves no file that cannot be read.

#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <thread>
#include <utility>

#include "io/results/results.hpp"
#include "tests/mpi/launcher.hpp"

namespace talus::test {
namespace {

/// Two ranks of a run without end, their standard error read here. Ended, if nothing else has, with the
/// object.
class TwoRanks {
 public:
  explicit TwoRanks(const fs::path& folder) : folder_(folder) {
    int ends[2];
    if (::pipe(ends) != 0) throw std::runtime_error("no pipe");
    launcher_ = ::fork();
    if (launcher_ == 0) {
      ::dup2(ends[1], STDERR_FILENO);
      ::close(ends[0]);
      ::close(ends[1]);
      // Each rank leaves its process id: exec keeps that of the shell.
      const std::string line = "exec env " + launcher(2) +
                               " sh -c 'echo $$ > pid.$OMPI_COMM_WORLD_RANK; exec \"" TALUS_COMMAND
                               "\" run scene.toml --threads 1 --out results'";
      if (::chdir(folder.c_str()) == 0) ::execl("/bin/sh", "sh", "-c", line.c_str(), nullptr);
      ::_exit(127);
    }
    ::close(ends[1]);
    errors_ = ends[0];
  }
  TwoRanks(const TwoRanks&) = delete;
  TwoRanks& operator=(const TwoRanks&) = delete;
  ~TwoRanks() {
    if (launcher_ > 0) {
      ::kill(launcher_, SIGTERM);
      ::waitpid(launcher_, nullptr, 0);
    }
    ::close(errors_);
  }

  /// Reads until `word` was printed or nothing more can be.
  bool printed(const std::string& word) {
    while (messages_.find(word) == std::string::npos)
      if (!read_more()) return false;
    return true;
  }

  pid_t process(int rank) const { return std::stoi(content(folder_ / ("pid." + std::to_string(rank)))); }

  /// Exit status of mpirun as waitpid gives it. A run that hangs is ended by the time limit of the test.
  int wait() {
    while (read_more()) {
    }
    int status = 0;
    ::waitpid(std::exchange(launcher_, 0), &status, 0);
    return status;
  }
  const std::string& messages() const { return messages_; }

 private:
  bool read_more() {
    std::array<char, 256> buffer;
    const ssize_t n = ::read(errors_, buffer.data(), buffer.size());
    if (n > 0) messages_.append(buffer.data(), static_cast<std::size_t>(n));
    return n > 0;
  }

  fs::path folder_;
  pid_t launcher_ = 0;
  int errors_ = -1;
  std::string messages_;
};

/// False for a process that has ended, also when nobody has asked for its exit code.
bool lives(pid_t process) {
  std::ifstream file("/proc/" + std::to_string(process) + "/stat");
  std::string text;
  if (!std::getline(file, text)) return false;
  const std::size_t name_ends = text.rfind(") ");
  return name_ends != std::string::npos && text.substr(name_ends + 2, 1) != "Z";
}

class KilledRank : public OnRanks, public testing::WithParamInterface<int> {};

TEST_P(KilledRank, EndsTheOthersAndLeavesNothingHalfWritten) {
  std::string endless = six_subdomains;
  endless.replace(endless.find("steps = 5"), 9, "steps = 1000000000");
  endless.replace(endless.find("every_steps = 4"), 15, "every_steps = 1");
  write(at("scene.toml"), endless);
  TwoRanks ranks(folder_.path());
  ASSERT_TRUE(ranks.printed("  step ")) << ranks.messages();
  const pid_t dead = ranks.process(GetParam()), other = ranks.process(1 - GetParam());
  ASSERT_EQ(::kill(dead, SIGKILL), 0);
  const int status = ranks.wait();
  ASSERT_TRUE(WIFEXITED(status)) << ranks.messages();
  EXPECT_NE(WEXITSTATUS(status), 0) << ranks.messages();
  while (lives(other)) std::this_thread::yield();

  // Whatever has its final name can be read.
  const fs::path results = at("results");
  EXPECT_TRUE(nlohmann::json::parse(content(results / "run.json")).contains("summary"));
  // Rank 0 may have died in the milliseconds that io/results/results.hpp excepts.
  if (GetParam() != 0) {
    const std::size_t frames = io::frame_count(results / "results.h5");
    EXPECT_GE(frames, 1U);
    EXPECT_EQ(io::read_frame(results / "results.h5", frames - 1).id.size(), 400U);
  }
  std::size_t fields = 0;
  for (const auto& [name, text] : files_below(results)) {
    if (name.ends_with(".csv")) {
      EXPECT_TRUE(text.ends_with("\n")) << name;
    } else if (name.ends_with(".vtp") || name.ends_with(".pvd")) {
      EXPECT_TRUE(text.ends_with("</VTKFile>\n")) << name;
      ++fields;
    }
  }
  EXPECT_GE(fields, 3U);
}

INSTANTIATE_TEST_SUITE_P(OfTwo, KilledRank, testing::Values(0, 1),
                         [](const auto& rank) { return "Rank" + std::to_string(rank.param); });

}  // namespace
}  // namespace talus::test
