/// A study that is asked to stop.

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <string>
#include <thread>

#include "tests/validation/commands/command_helpers.hpp"

namespace talus::stopped_study_test {
namespace {

using namespace test;

class StoppedStudy : public CommandTest {
 protected:
  /// The command with a signal as soon as it has said that it is at a scene, which it says behind the first
  /// step; exit status as waitpid gives it.
  int stopped(int signal) const {
    const pid_t child = ::fork();
    if (child == 0) {
      const int messages = ::open(at("messages").c_str(), O_WRONLY | O_CREAT, 0644);
      ::dup2(messages, STDERR_FILENO);
      ::dup2(messages, STDOUT_FILENO);
      ::execl(TALUS_COMMAND, TALUS_COMMAND, "study", "certificate", "--scenes", "1000000", "--out",
              at("study").c_str(), nullptr);
      ::_exit(127);
    }
    int status = 0;
    for (bool asked = false; ::waitpid(child, &status, WNOHANG) == 0;) {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
      if (!asked && fs::exists(at("messages")) && content(at("messages")).find("; at ") != std::string::npos)
        asked = ::kill(child, signal) == 0;
    }
    return status;
  }
};

TEST_F(StoppedStudy, OfTheCertificateWritesWhatItHasAudited) {
  const int status = stopped(SIGINT);
  ASSERT_TRUE(WIFEXITED(status)) << content(at("messages"));
  EXPECT_EQ(WEXITSTATUS(status), 75) << content(at("messages"));
  EXPECT_NE(content(at("messages")).find("stopped: SIGINT after "), std::string::npos)
      << content(at("messages"));
  const std::string steps = content(at("study/steps.csv"));
  EXPECT_GE(std::ranges::count(steps, '\n'), 2) << "names and a step";
  EXPECT_TRUE(fs::exists(at("study/report.html")));
}

}  // namespace
}  // namespace talus::stopped_study_test
