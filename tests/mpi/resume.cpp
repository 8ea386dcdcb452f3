/// Runs that are stopped and go on, on any ranks and threads: results of the run that was never stopped.
/// TALUS_TRIALS gives the number of trials of each scene, and TALUS_KILLS that of kills (300 for a long
/// test).

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <random>
#include <thread>

#include "io/results/results.hpp"
#include "tests/mpi/launcher.hpp"

namespace talus::resume_test {
namespace {

using namespace test;

int times(const char* name, int otherwise) {
  const char* given = std::getenv(name);
  return given ? std::atoi(given) : otherwise;
}

/// What is summed up over a run, and what a frame has besides.
const std::string probes = R"(
[[probe]]
name = "middle"
region = { shape = "plane", point = [0.06, 0.06, 0.06], normal = [1, 0.3, 0.2] }
[[probe]]
name = "part"
every = 0.0035
region = { shape = "cylinder", start = [0, 0.06, 0.05], end = [0.12, 0.06, 0.05], radius = 0.04 }
[[field]]
low = [0, 0, 0]
high = [0.12, 0.12, 0.12]
cells = [6, 6, 6]
width = 0.03
)";

class Resumed : public OnRanks {
 protected:
  void SetUp() override {
    std::string scene = six_subdomains;
    for (std::size_t at; (at = scene.find("steps = 5 }")) != std::string::npos;)
      scene.replace(at, 11, "steps = 12 }");
    write(at_("scene.toml"), scene + probes);
  }
  fs::path at_(const std::string& name) const { return folder_.path() / name; }

  static std::map<std::string, std::string> results_in(const fs::path& folder) {
    std::map<std::string, std::string> results = files_below(folder);
    std::erase_if(results, [](const auto& file) {
      const std::string& name = file.first;
      return name == "run.json" || name == "report.html" || name == "run.log" || name == "status.json" ||
             name == "results.h5" || name.starts_with("checkpoint_");
    });
    results["steps.csv"] = without(results.at("steps.csv"), "wall_s");
    if (results.contains("error_history.csv"))
      results["error_history.csv"] = without(results["error_history.csv"], "seconds");
    nlohmann::json end = summary(folder);
    end.erase("wall_s");
    results["summary"] = end.dump();
    return results;
  }
  /// Of results.h5: HDF5 writes the time of the day into it, so that its bytes are no measure.
  static void expect_same_frames(const fs::path& one, const fs::path& other) {
    ASSERT_EQ(io::frame_count(one / "results.h5"), io::frame_count(other / "results.h5"));
    for (std::size_t k = 0; k < io::frame_count(one / "results.h5"); ++k) {
      const Frame a = io::read_frame(one / "results.h5", k), b = io::read_frame(other / "results.h5", k);
      EXPECT_EQ(a.step, b.step);
      EXPECT_EQ(a.stage, b.stage);
      EXPECT_EQ(a.id, b.id);
      EXPECT_EQ(a.x, b.x);
      EXPECT_EQ(a.u, b.u);
      EXPECT_EQ(a.contact_bodies, b.contact_bodies);
      EXPECT_EQ(a.contact_force, b.contact_force);
      for (std::size_t w = 0; w < a.walls.size(); ++w) EXPECT_EQ(a.walls[w].force, b.walls[w].force);
    }
  }
  void expect_same(const std::string& one, const std::string& other, const std::string& history) const {
    const auto a = results_in(at_(one)), b = results_in(at_(other));
    for (const auto& [name, text] : a) {
      ASSERT_TRUE(b.contains(name)) << name << history;
      EXPECT_TRUE(b.at(name) == text) << name << history;
    }
    EXPECT_EQ(a.size(), b.size()) << history;
    expect_same_frames(at_(one), at_(other));
  }
  int any(int low, int high) { return std::uniform_int_distribution<int>(low, high)(random_); }

  std::mt19937 random_{3};
};

TEST_F(Resumed, AnywhereOnAnyRanksEndInTheSameBits) {
  const std::vector<std::string> scenes{
      "",
      "--set decomposition.coupling=nscdd --set decomposition.partitioner=metis --set "
      "decomposition.mapping=cyclic --set output.xyz=true",
      "--set material.restitution=0.4 --set gravity='[0,0,-9.81]' --set decomposition.exchange=ccs",
      "--set solver.overlap_correction=0.2 --set solver.method=admm --set orientation=true",
      "--set time_step=auto --set gravity='[0,0,-9.81]' --set output.pictures=true --set "
      "solver.tolerance=0.02 --set solver.max_iterations=400 --error-history 1:100 --set "
      "output.tables_every=5 "
      "--set output.contacts_every=2 --set output.compression=1 --set output.precision=single"};
  constexpr int steps = 24;
  for (const std::string& keys : scenes) {
    const std::string line = "run scene.toml " + keys;
    const Outcome straight = run(1, line + " --force --out straight --threads 1");
    ASSERT_EQ(straight.code, 0) << straight.messages;
    const int all = summary(at_("straight")).at("steps");
    EXPECT_GE(all, steps / 2);
    for (int trial = 0; trial < times("TALUS_TRIALS", 1); ++trial) {
      fs::remove_all(at_("parts"));
      std::string history = " of " + keys + ":";
      int at = 0;
      for (int stops = any(1, 3); stops >= 0; --stops) {
        const int ranks = any(1, 3), threads = any(1, 2);
        at = std::min(all - 1, at + any(1, all / 3));
        history += fmt::format(" {} on {}x{},", at, ranks, threads);
        const Outcome part = run(ranks, fmt::format("{} --resume --out parts --threads {}{}", line, threads,
                                                    stops > 0 ? fmt::format(" --steps {}", at) : ""));
        ASSERT_EQ(part.code, 0) << history << part.messages;
      }
      expect_same("straight", "parts", history);
    }
  }
}

/// A run in the background, of which the first process is killed: the command, or one of its ranks.
class Killed {
 public:
  Killed(const fs::path& folder, int ranks, const std::string& arguments) {
    child_ = ::fork();
    if (child_ != 0) return;
    ::setpgid(0, 0);
    const std::string line = "cd '" + folder.string() + "'; exec " +
                             (ranks > 1 ? "env " + launcher(ranks) + " " : std::string()) +
                             "'" TALUS_COMMAND "' " + arguments + " >/dev/null 2>&1";
    ::execl("/bin/sh", "sh", "-c", line.c_str(), nullptr);
    ::_exit(127);
  }
  Killed(const Killed&) = delete;
  Killed& operator=(const Killed&) = delete;
  ~Killed() {
    if (child_ > 0) end();
  }
  /// Exit code when it ends within that time; -1 when it is killed then.
  int wait(double seconds) {
    const auto until = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
    int status = 0;
    while (std::chrono::steady_clock::now() < until) {
      if (::waitpid(child_, &status, WNOHANG) == child_) {
        child_ = 0;
        return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    end();
    return -1;
  }

 private:
  /// The launcher ends what it has started when it loses a rank; a killed launcher leaves its ranks, which
  /// end when they miss it.
  void end() {
    const std::string rank = "pkill -KILL -o -P " + std::to_string(child_);
    if (std::system(rank.c_str()) != 0) ::kill(child_, SIGKILL);
    ::waitpid(child_, nullptr, 0);
    child_ = 0;
  }
  pid_t child_ = 0;
};

TEST_F(Resumed, AfterKillsAtAnyMomentEndInTheSameBits) {
  const std::string line =
      "run scene.toml --set checkpoint.every_steps=2 --set output.every_steps=1 --set "
      "stage.hold.end.steps=30";
  const auto began = std::chrono::steady_clock::now();
  const Outcome straight = run(1, line + " --out straight --threads 1");
  const double takes = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  ASSERT_EQ(straight.code, 0) << straight.messages;
  int kills = 0;
  for (const int wanted = times("TALUS_KILLS", 12); kills < wanted;) {
    fs::remove_all(at_("parts"));
    std::string history;
    int code = -1;
    for (int here = 0; code < 0; ++here) {
      const int ranks = any(1, 4) == 4 ? 2 : 1;
      // In the end it is left alone.
      const double seconds =
          here > 12 ? 200 : std::uniform_real_distribution<double>(0.02, takes)(random_) + 0.4 * (ranks - 1);
      history += fmt::format(" {} ranks, {:.2f} s;", ranks, seconds);
      Killed running(folder_.path(), ranks, line + " --resume --out parts --threads 1");
      code = running.wait(seconds);
      kills += code < 0;
      if (code == 2) {  // the lock of a rank that has not ended yet
        std::this_thread::sleep_for(std::chrono::seconds(1));
        code = -1;
      }
    }
    ASSERT_EQ(code, 0) << history;
    expect_same("straight", "parts", history);
    if (HasFailure()) return;
  }
}

/// What ends all ranks, whichever of them hears of it.
TEST_F(Resumed, AfterASignalToOneRankGoOn) {
  const std::string line = "run scene.toml --set stage.hold.end.steps=4000 --threads 1 --resume --out parts";
  const std::string ranks = launcher(2) + " sh -c 'echo $$ > pid.$OMPI_COMM_WORLD_RANK; exec \"$0\" \"$@\"'";
  for (const auto& [signal, rank] : {std::pair{SIGTERM, 1}, {SIGXCPU, 0}}) {
    std::thread sender([&, signal = signal, rank = rank] {
      for (int k = 0; k < 600; ++k) {
        std::this_thread::sleep_for(std::chrono::milliseconds(100));
        const fs::path pid = at_(fmt::format("pid.{}", rank)), steps = at_("parts/status.json");
        if (!fs::exists(pid) || !fs::exists(steps) ||
            content(steps).find("stage_fraction") == std::string::npos)
          continue;
        ::kill(std::stoi(content(pid)), signal);
        return;
      }
    });
    const Outcome stopped = test::run(folder_.path(), line, ranks);
    sender.join();
    EXPECT_EQ(stopped.code, 75) << stopped.messages;
    EXPECT_EQ(summary(at_("parts")).at("status"), "stopped");
    for (const int k : {0, 1}) fs::remove(at_(fmt::format("pid.{}", k)));
    fs::remove(at_("parts/status.json"));
  }
}

}  // namespace
}  // namespace talus::resume_test
