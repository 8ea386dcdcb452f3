/// Stopping a run and going on with it, from outside: signals, limits and `talus status`. What is refused:
/// resume_refusals.cpp.

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "io/checkpoint/checkpoint_folder.hpp"
#include "tests/unit/io/results/output_helpers.hpp"
#include "tests/unit/replaced.hpp"
#include "tests/validation/commands/command_helpers.hpp"

namespace talus::resume_command_test {
namespace {

using namespace test;

class Resume : public CommandTest {
 protected:
  void SetUp() override {
    write(at("scene.toml"), pressed_box);
    std::string endless = pressed_box;
    endless.replace(endless.rfind("steps = 6"), 9, "steps = 1000000000");
    write(at("endless.toml"), endless);
  }
  std::size_t checkpoints(const std::string& directory) const {
    return io::checkpoints_in(at(directory)).size();
  }

  /// The endless scene until `act(process)`, asked again and again once steps are done, says that it has done
  /// what it wanted. Exit status as waitpid gives it.
  int run_until(const std::string& directory, const std::function<bool(pid_t)>& act) {
    const pid_t child = ::fork();
    if (child == 0) {
      const int null = ::open("/dev/null", O_WRONLY);
      ::dup2(null, STDERR_FILENO);
      if (::chdir(folder_.path().c_str()) == 0)
        ::execl(TALUS_COMMAND, TALUS_COMMAND, "run", "endless.toml", "--resume", "--threads", "1", "--out",
                directory.c_str(), nullptr);
      ::_exit(127);
    }
    int status = 0;
    for (bool done = false; ::waitpid(child, &status, WNOHANG) == 0;) {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      const fs::path beat = at(directory) / "status.json";
      if (!done && fs::exists(beat) && content(beat).find("stage_fraction") != std::string::npos)
        done = act(child);
    }
    return status;
  }
};

TEST_F(Resume, AfterSignalsThatAskForAnEnd) {
  for (const int signal : {SIGTERM, SIGINT, SIGHUP, SIGXCPU}) {
    const int status = run_until("stopped", [&](pid_t process) { return ::kill(process, signal) == 0; });
    ASSERT_TRUE(WIFEXITED(status)) << signal;
    EXPECT_EQ(WEXITSTATUS(status), 75) << signal;
    EXPECT_EQ(summary(at("stopped")).at("status"), "stopped");
    EXPECT_EQ(summary(at("stopped")).at("exit_code"), 75);
    const std::int64_t steps = summary(at("stopped")).at("steps");
    EXPECT_TRUE(fs::exists(at("stopped") / io::checkpoint_name(steps, false)))
        << "each goes on from the last";
    fs::remove(at("stopped/status.json"));
  }
  EXPECT_EQ(checkpoints("stopped"), 2U) << "as many as [checkpoint] keep says";
}

TEST_F(Resume, NeedsNoStopForACheckpointByASignal) {
  const int status = run_until("saved", [&, asked = false](pid_t process) mutable {
    if (!asked) asked = ::kill(process, SIGUSR1) == 0;
    return checkpoints("saved") > 0 && ::kill(process, SIGTERM) == 0;
  });
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 75);
  EXPECT_EQ(checkpoints("saved"), 2U);
}

// The second signal may find the first one's work done: then the run has ended as it was asked to.
TEST_F(Resume, IsNotWaitedForByASecondSignal) {
  const int status = run_until("twice", [](pid_t process) {
    ::kill(process, SIGSTOP);
    ::kill(process, SIGTERM);
    ::kill(process, SIGINT);
    return ::kill(process, SIGCONT) == 0;
  });
  EXPECT_TRUE(WIFSIGNALED(status)) << status;
  const Outcome told = run("status twice");
  EXPECT_NE(told.output.find("dead"), std::string::npos) << told.output;
  EXPECT_EQ(told.output.find("a second"), std::string::npos) << "it goes no further: " << told.output;
  EXPECT_NE(told.output.find("when last heard of: step"), std::string::npos) << "it may have come further";
}

TEST_F(Resume, BeforeTheTimeIsUp) {
  // A machine that others keep busy may hold any one run up; the program is late where it is late each time.
  double least = 1e3;
  Outcome limited;
  for (int attempt = 0; attempt < 3 && least >= 3; ++attempt) {
    const auto began = std::chrono::steady_clock::now();
    limited = run("run endless.toml --out limited --force --max-walltime 0:03 --threads 1");
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - began;
    least = std::min(least, took.count());
  }
  EXPECT_EQ(limited.code, 75) << limited.messages;
  EXPECT_LT(least, 3);
  EXPECT_NE(limited.messages.find("the time is up"), std::string::npos) << limited.messages;
  EXPECT_EQ(checkpoints("limited"), 1U);
  EXPECT_FALSE(fs::exists(at("limited/report.html"))) << "what can be made later is";
  EXPECT_EQ(run("report limited").code, 0);
  const Outcome granted =
      run("run endless.toml --out limited --resume --threads 1", "SLURM_JOB_END_TIME=$(($(date +%s) + 3))");
  EXPECT_EQ(granted.code, 75) << granted.messages;
  EXPECT_GT(summary(at("limited")).at("steps").get<int>(), 6);
  for (const std::string wrong : {"3600", "1:70:00", "soon", "0:00"})
    EXPECT_EQ(run("run endless.toml --out none --max-walltime " + wrong).code, 2) << wrong;
  EXPECT_FALSE(fs::exists(at("none")));
}

// A run of three days (docs/tutorial.md), in small: the same line again and again until it is done.
TEST_F(Resume, IsTheSameLineUntilItIsDone) {
  const std::string line =
      "run scene.toml --out days --resume --set stage.shear.end.steps=100 --set allow_unconverged=true "
      "--threads 1";
  ASSERT_EQ(run("run scene.toml --out straight --set stage.shear.end.steps=100 --set allow_unconverged=true "
                "--threads 1")
                .code,
            0);
  int runs = 0;
  for (int code = 75; code == 75; ++runs) {
    ASSERT_LT(runs, 200);
    const Outcome part = run(line + " --max-walltime 0:01");
    code = part.code;
    ASSERT_TRUE(code == 0 || code == 75) << part.messages;
  }
  for (const std::string name : {"walls.csv", "triaxial.csv", "triaxial.svg", "fields.pvd"})
    EXPECT_EQ(content(at("days") / name), content(at("straight") / name)) << name;
  EXPECT_EQ(summary(at("days")).at("digest"), summary(at("straight")).at("digest"));
  // Once more: nothing is left to do, and nothing is touched.
  const auto before = files_below(at("days"));
  const Outcome again = run(line);
  EXPECT_EQ(again.code, 0) << again.messages;
  EXPECT_NE(again.messages.find("is done"), std::string::npos) << again.messages;
  EXPECT_EQ(files_below(at("days")), before);
  // Further than it was meant to go.
  const Outcome further =
      run("run scene.toml --out days --resume --set stage.shear.end.steps=110 --set allow_unconverged=true "
          "--threads 1");
  EXPECT_EQ(further.code, 0) << further.messages;
  EXPECT_EQ(summary(at("days")).at("steps"), 116);
  const auto json = nlohmann::json::parse(content(at("days/run.json")));
  EXPECT_EQ(json.at("provenance").at("resumed").back().at("changes").front(),
            "stage.shear.end.steps was 100 and is 110");
}

// An end moved before where the run is, and back to where it was at the checkpoint.
TEST_F(Resume, GoesOnToItsFirstEndBehindANearerOne) {
  const std::string line = "run scene.toml --out out --threads 1 --resume";
  ASSERT_EQ(run("run scene.toml --out straight --threads 1").code, 0);
  ASSERT_EQ(run(line + " --steps 9").code, 0);
  const Outcome there = run(line + " --set stage.shear.end.steps=3");
  EXPECT_NE(there.messages.find("no step was made"), std::string::npos) << there.messages;
  const Outcome nearer = run(line + " --set stage.shear.end.steps=2");
  EXPECT_EQ(nearer.code, 0) << nearer.messages;
  EXPECT_NE(nearer.messages.find("no step was made"), std::string::npos) << nearer.messages;
  EXPECT_EQ(summary(at("out")).at("steps"), 9);
  const Outcome back = run(line);
  EXPECT_EQ(back.code, 0) << back.messages;
  EXPECT_EQ(summary(at("out")).at("steps"), 12);
  EXPECT_EQ(summary(at("out")).at("digest"), summary(at("straight")).at("digest"));
  EXPECT_EQ(content(at("out/walls.csv")), content(at("straight/walls.csv")));
  const Outcome again = run(line);
  EXPECT_NE(again.messages.find("is done"), std::string::npos) << again.messages;
}

TEST_F(Resume, EndsWithTheCodeOfStepsThatMiss) {
  const std::string line =
      "run scene.toml --out out --threads 1 --resume --set solver.max_iterations=3 --set "
      "solver.direct_bodies=0 ";
  const Outcome begun = run(line + "--steps 6"), rest = run(line);
  EXPECT_EQ(begun.code, 3) << begun.messages;
  EXPECT_EQ(rest.code, 3) << rest.messages;
}

TEST_F(Resume, LeavesADoneRunAloneWhateverBecameOfItsTables) {
  const std::string line = "run scene.toml --out out --threads 1 --resume";
  ASSERT_EQ(run(line).code, 0);
  ASSERT_GT(checkpoints("out"), 0U);
  write(at("out/steps.csv"), "step,mine\n");
  const auto before = files_below(at("out"));
  const Outcome again = run(line);
  EXPECT_EQ(again.code, 0) << again.messages;
  EXPECT_NE(again.messages.find("is done"), std::string::npos) << again.messages;
  EXPECT_EQ(files_below(at("out")), before);
}

TEST_F(Resume, GoesBackToTheCheckpointBeforeADamagedOne) {
  ASSERT_EQ(run("run scene.toml --out straight --threads 1").code, 0);
  const std::string line = "run scene.toml --out parts --resume --threads 1 --set checkpoint.every_steps=2";
  ASSERT_EQ(run(line + " --steps 8").code, 0);
  ASSERT_EQ(checkpoints("parts"), 2U);
  const fs::path last = io::checkpoints_in(at("parts")).front();
  std::string bytes = content(last);
  // In the middle of the columns, where HDF5 looks at nothing.
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 16);
  write(last, bytes);
  write(at("parts/checkpoint_000099.h5.part"), "half of one");
  const Outcome gone_on = run(line);
  EXPECT_EQ(gone_on.code, 0) << gone_on.messages;
  EXPECT_NE(gone_on.messages.find("damaged"), std::string::npos) << gone_on.messages;
  EXPECT_NE(gone_on.messages.find("behind step 6"), std::string::npos) << gone_on.messages;
  EXPECT_EQ(summary(at("parts")).at("digest"), summary(at("straight")).at("digest"));
  EXPECT_FALSE(fs::exists(at("parts/checkpoint_000099.h5.part")));
}

TEST_F(Resume, BeginsAnewWhereThereIsNoCheckpoint) {
  ASSERT_EQ(run("run scene.toml --out straight --threads 1").code, 0);
  ASSERT_EQ(run("run scene.toml --out parts --threads 1 --steps 5").code, 0);
  write(at("parts/notes.txt"), "mine");
  const Outcome anew = run("run scene.toml --out parts --resume --threads 1");
  EXPECT_EQ(anew.code, 0) << anew.messages;
  EXPECT_EQ(content(at("parts/walls.csv")), content(at("straight/walls.csv")));
  EXPECT_EQ(content(at("parts/notes.txt")), "mine");
}

TEST_F(Resume, KeepsWhatWasSaidOfTheSceneWhenItBegan) {
  write(at("light.toml"), replaced(column_scene, "2600", "2.6"));
  for (const std::string part : {"--steps 2", ""})
    ASSERT_EQ(run("run light.toml --out parts --resume --threads 1 " + part).code, 0);
  const auto warnings = summary(at("parts")).at("warnings");
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_NE(warnings[0].get<std::string>().find("2.6 kg/m^3"), std::string::npos);
}

/// They are about the point where a wall began, wherever it has got to.
TEST_F(Resume, GoesOnWithTheTorquesOfWallsThatMove) {
  for (const std::string moves : {"drive = \"velocity\"\nvelocity = [0.1, 0, 0]\n",
                                  "[[wall.motion]]\nkind = \"velocity\"\nvelocity = [0.1, 0, 0]\n"}) {
    std::string scene = replaced(column_scene, "side = \"z-\"\n", "side = \"z-\"\n" + moves);
    write(at("moves.toml"), replaced(scene, "steps = 4", "steps = 20"));
    ASSERT_EQ(run("run moves.toml --out straight --force --threads 1").code, 0);
    fs::remove_all(at("parts"));
    for (const std::string part : {"--steps 10", ""})
      ASSERT_EQ(run("run moves.toml --out parts --resume --threads 1 " + part).code, 0);
    EXPECT_EQ(content(at("parts/walls.csv")), content(at("straight/walls.csv"))) << moves;
  }
}

TEST_F(Resume, DoesWithoutACheckpointThatTheDiskDoesNotTake) {
  const Outcome full = run(
      "run scene.toml --out full --threads 1 --set checkpoint.every_steps=3 --set output.stage_frames=false "
      "--set output.fields=false --set output.pictures=false --set output.every_steps=100",
      "ulimit -f 64;");
  EXPECT_EQ(full.code, 0) << full.messages;
  EXPECT_NE(full.messages.find("no checkpoint behind step 3"), std::string::npos) << full.messages;
  EXPECT_EQ(checkpoints("full"), 0U);
  EXPECT_EQ(summary(at("full")).at("steps"), 12);
}

TEST_F(Resume, KeepsArchivedCheckpoints) {
  ASSERT_EQ(
      run("run scene.toml --out kept --threads 1 --set checkpoint.every_steps=1 --set checkpoint.keep=3 "
          "--set checkpoint.archive_every=5")
          .code,
      0);
  for (const std::string name : {"archive_000005.h5", "archive_000010.h5", "checkpoint_000012.h5"})
    EXPECT_TRUE(fs::exists(at("kept") / name)) << name;
  EXPECT_EQ(checkpoints("kept"), 5U);
}

// Which states stay must not depend on where a queue stopped the run.
TEST_F(Resume, ArchivesWhatItWouldHaveArchivedWithoutAStop) {
  const std::string line =
      "run scene.toml --out kept --resume --threads 1 --set checkpoint.every_steps=2 --set "
      "checkpoint.archive_every=2";
  for (const std::string steps : {" --steps 3", " --steps 7", ""})
    ASSERT_EQ(run(line + steps).code, 0) << steps;
  std::vector<std::string> archives;
  for (const auto& entry : fs::directory_iterator(at("kept")))
    if (const std::string name = entry.path().filename(); name.starts_with("archive_"))
      archives.push_back(name);
  std::sort(archives.begin(), archives.end());
  EXPECT_EQ(archives,
            (std::vector<std::string>{"archive_000004.h5", "archive_000008.h5", "archive_000012.h5"}));
}

TEST_F(Resume, IsToldOfByStatusAndLog) {
  std::string alive;
  const int status = run_until("watched", [&](pid_t process) {
    alive = run("status watched --json").output;
    return ::kill(process, SIGKILL) == 0;
  });
  ASSERT_TRUE(WIFSIGNALED(status));
  const auto json = nlohmann::json::parse(alive);
  EXPECT_EQ(json.at("state"), "running");
  EXPECT_GE(json.at("step").get<int>(), 1);
  EXPECT_TRUE(json.contains("stage"));
  EXPECT_EQ(nlohmann::json::parse(run("status watched --json").output).at("state"), "dead");
  EXPECT_EQ(run("status nowhere").code, 2);

  const Outcome quiet = run("run scene.toml --out quiet --quiet --threads 1 --resume");
  EXPECT_EQ(quiet.code, 0);
  EXPECT_EQ(quiet.messages, "");
  const std::string log = content(at("quiet/run.log"));
  for (const std::string words : {"400 grains", "stage 'press' ended", "results in quiet"})
    EXPECT_NE(log.find(words), std::string::npos) << words << " in " << log;
  const Outcome done = run("status quiet");
  EXPECT_NE(done.output.find("done"), std::string::npos) << done.output;
  EXPECT_NE(done.output.find("stage 'shear', 100 % done"), std::string::npos) << done.output;
  EXPECT_NE(done.output.find("checkpoint_000012.h5"), std::string::npos) << done.output;
}

// A lost terminal, or a full log, is no reason to lose a simulation.
TEST_F(Resume, IsNotNeededWhenTheTerminalIsLost) {
  for (const std::string lost : {"2>/dev/full", "2>&-"}) {
    const std::string line = "cd '" + folder_.path().string() +
                             "' && '" TALUS_COMMAND "' run scene.toml --out lost --force --threads 1 " + lost;
    const int status = std::system(line.c_str());
    EXPECT_EQ(WEXITSTATUS(status), 0) << lost;
    EXPECT_EQ(summary(at("lost")).at("status"), "done");
  }
}

}  // namespace
}  // namespace talus::resume_command_test
