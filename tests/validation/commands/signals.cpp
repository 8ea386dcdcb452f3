/// What commands do about signals before, or without, the checkpoints of a run (resume_command.cpp).

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <string>
#include <thread>
#include <vector>

#include "tests/unit/replaced.hpp"
#include "tests/validation/commands/command_helpers.hpp"

namespace talus::signals_test {
namespace {

using namespace test;

class Signalled : public CommandTest {
 protected:
  /// The command in the folder of the test, with signals as soon as its messages hold `said`; exit status as
  /// waitpid gives it.
  int run_until(const std::string& said, std::vector<std::string> arguments,
                const std::vector<int>& signals) const {
    const pid_t child = ::fork();
    if (child == 0) {
      const int messages = ::open(at("messages").c_str(), O_WRONLY | O_CREAT, 0644);
      ::dup2(messages, STDERR_FILENO);
      ::dup2(messages, STDOUT_FILENO);
      std::string command = TALUS_COMMAND;
      std::vector<char*> words{command.data()};
      for (std::string& argument : arguments) words.push_back(argument.data());
      words.push_back(nullptr);
      if (::chdir(folder_.path().c_str()) == 0) ::execv(TALUS_COMMAND, words.data());
      ::_exit(127);
    }
    int status = 0;
    for (bool asked = false; ::waitpid(child, &status, WNOHANG) == 0;) {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
      if (asked || !fs::exists(at("messages")) || messages().find(said) == std::string::npos) continue;
      for (const int signal : signals) ::kill(child, signal);
      asked = true;
    }
    return status;
  }
  std::string messages() const { return content(at("messages")); }
};

TEST_F(Signalled, StudyOfTheCertificateWritesWhatItHasAudited) {
  const int status =
      run_until("; at ", {"study", "certificate", "--scenes", "1000000", "--out", "study"}, {SIGINT});
  ASSERT_TRUE(WIFEXITED(status)) << messages();
  EXPECT_EQ(WEXITSTATUS(status), 75) << messages();
  EXPECT_NE(messages().find("stopped: SIGINT after "), std::string::npos) << messages();
  const std::string steps = content(at("study/steps.csv"));
  EXPECT_GE(std::ranges::count(steps, '\n'), 2) << "names and a step";
  EXPECT_TRUE(fs::exists(at("study/report.html")));
}

constexpr const char* long_deposition = R"(
time_step = 1e-3
gravity = [0, 0, -9.81]
material = { density = 2600 }
[sample]
kind = "deposition"
count = 1000000
base = [1, 1]
radius = 0.005
[[stage]]
end = { steps = 1 }
)";

// It took some seconds of a job's time to find a place for each grain, and SIGUSR1 ended the job.
TEST_F(Signalled, RunThatPlacesItsGrainsEndsWithNothingWrittenAndNotByWhatAsksForACheckpoint) {
  write(at("scene.toml"), long_deposition);
  const int status = run_until(" grains deposited", {"run", "scene.toml", "--out", "out", "--threads", "1"},
                               {SIGUSR1, SIGTERM});
  ASSERT_TRUE(WIFEXITED(status)) << messages();
  EXPECT_EQ(WEXITSTATUS(status), 75) << messages();
  EXPECT_NE(messages().find("stopped: SIGTERM before the first step; nothing was written"), std::string::npos)
      << messages();
  EXPECT_FALSE(fs::exists(at("out")));
}

// Scenes that were audited were lost when the signal came as the next one's grains were placed.
TEST_F(Signalled, StudyOfTheCertificateWritesWhatItHasWhereItPlacesGrains) {
  write(at("a.toml"), replaced(pressed_box, "count = 400", "count = 100"));
  write(at("b.toml"), long_deposition);
  const int status = run_until(" grains deposited",
                               {"study", "certificate", "--scenes-from", ".", "--out", "study"}, {SIGTERM});
  ASSERT_TRUE(WIFEXITED(status)) << messages();
  EXPECT_EQ(WEXITSTATUS(status), 75) << messages();
  EXPECT_GE(std::ranges::count(content(at("study/steps.csv")), '\n'), 2) << "names and a step";
}

}  // namespace
}  // namespace talus::signals_test
