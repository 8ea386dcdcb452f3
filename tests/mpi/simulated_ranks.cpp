/// The command built for simulated ranks (preset smpi), on machines that the command describes. Skipped where
/// that build is not.

#include <algorithm>
#include <cstdlib>

#include "io/trace/trace_file.hpp"
#include "runtime/trace/analysis.hpp"
#include "tests/mpi/launcher.hpp"

namespace talus::test {
namespace {

class SimulatedRanks : public OnRanks {
 protected:
  void SetUp() override {
    if (!fs::exists(TALUS_SMPI_COMMAND)) GTEST_SKIP() << "there is no " << TALUS_SMPI_COMMAND;
    write(at("scene.toml"), six_subdomains);
    const Outcome one =
        run(1, "run scene.toml --set decomposition.subdomains=9 --out one --threads 1 --trace");
    ASSERT_EQ(one.code, 0) << one.messages;
  }

  /// The machine of a replay with so many ranks, as smpirun wants it.
  std::string machine(int ranks, const std::string& options = "") const {
    const std::string file = fmt::format("machine{}.xml", ranks);
    const Outcome replay =
        run(1, fmt::format("replay one/trace.h5 --ranks {} {} --smpi-platform {}", ranks, options, file));
    EXPECT_EQ(replay.code, 0) << replay.messages;
    return fmt::format("-platform {}", file);
  }

  /// The code that smpirun ends with; what it says goes to OUT.txt.
  int simulate(int ranks, const std::string& machine, const std::string& out,
               const std::string& options = "") const {
    const std::string line =
        fmt::format("cd '{}' && smpirun -np {} {} '" TALUS_SMPI_COMMAND
                    "' run scene.toml --set decomposition.subdomains=9 --out {} {} >{}.txt 2>&1",
                    folder_.path().string(), ranks, machine, out, options, out);
    const int status = std::system(line.c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

  /// Of the whole run on the simulated machine [s].
  double seconds(const std::string& out) const { return summary(at(out)).at("wall_s"); }
};

TEST_F(SimulatedRanks, ChangeNoBitOfTheResults) {
  for (int ranks : {1, 2, 9}) {
    const std::string out = fmt::format("r{}", ranks);
    EXPECT_EQ(simulate(ranks, machine(ranks), out), 0) << file(".", out + ".txt");
    EXPECT_EQ(digest_of(out), digest_of("one")) << ranks;
    EXPECT_TRUE(file(out, "walls.csv") == file("one", "walls.csv")) << ranks;
  }
}

// Clocks are those of the simulated machine: a network a thousand times slower takes so much longer, on the
// same host, in the same run.
TEST_F(SimulatedRanks, TakeTheTimeOfTheirNetwork) {
  ASSERT_EQ(simulate(9, machine(9, "--latency 1e-3"), "slow"), 0) << file(".", "slow.txt");
  EXPECT_EQ(digest_of("slow"), digest_of("one"));
  const long iterations = summary(at("slow")).at("iterations");
  // Each iteration has an exchange; its messages need a latency at least.
  EXPECT_GT(seconds("slow"), 1e-3 * static_cast<double>(iterations));
}

// With the same times of tasks and the same network nothing is left but the two models: no clock is in it.
// Where small clusters are put right, several ranks walk other epochs than one; so the balance is let pass.
TEST_F(SimulatedRanks, AgreeWithTheReplayOnGivenTimes) {
  const std::string passing = " --set solver.balance_tolerance=100";
  ASSERT_EQ(run(1, "run scene.toml --set decomposition.subdomains=9 --out plain --threads 1" + passing).code,
            0);
  for (int step : {2, 3}) {  // the second cuts space anew, the third does not
    const std::string trace = fmt::format("step{}/trace.h5", step);
    const Outcome one = run(1, fmt::format("run scene.toml --set decomposition.subdomains=9 --out step{} "
                                           "--threads 1 --trace --trace-steps {}:{}{}",
                                           step, step, step, passing));
    ASSERT_EQ(one.code, 0) << one.messages;
    for (int ranks : {1, 2, 9}) {
      const std::string out = fmt::format("given{}_{}", step, ranks);
      const Outcome replay =
          run(1, fmt::format("replay {} --ranks {} --quantile 0.5 --smpi-platform {}.xml --out {}.h5", trace,
                             ranks, out, out));
      ASSERT_EQ(replay.code, 0) << replay.messages;
      ASSERT_EQ(simulate(ranks, fmt::format("-platform {}.xml", out), out, "--task-times " + trace + passing),
                3)
          << file(".", out + ".txt");
      EXPECT_EQ(digest_of(out), digest_of("plain")) << ranks;
      const double played = 1e-9 * trace::analyse(io::read_trace(at(out + ".h5"))).makespan,
                   simulated =
                       read_table(at(out) / "steps.csv").number(static_cast<std::size_t>(step - 1), "wall_s");
      EXPECT_NEAR(simulated, played, 0.15 * played) << "step " << step << ", ranks " << ranks;
    }
  }
}

TEST_F(SimulatedRanks, ShareNodesAsTheReplayDoes) {
  machine(4, "--ranks-per-node 2");
  EXPECT_EQ(file(".", "machine4.xml.hosts"), "node-0\nnode-0\nnode-1\nnode-1\n");
  EXPECT_EQ(simulate(4, "-hostfile machine4.xml.hosts -platform machine4.xml", "r4"), 0)
      << file(".", "r4.txt");
  EXPECT_EQ(digest_of("r4"), digest_of("one"));
}

// Those that wait for rank 0's files must have simulated time pass, or would wait for ever. Without walls
// there is nothing to add up for them: SimGrid's sums of nothing end with SIGFPE.
TEST_F(SimulatedRanks, EndARunaway) {
  const std::string three = machine(3);
  write(at("scene.toml"), R"(
time_step = 1e-6
gravity = [1e200, 0, 0]
[material]
density = 2600
[sample]
kind = "bodies"
file = "grains.csv"
[[stage]]
end = { steps = 30 }
)");
  write(at("grains.csv"), "id,x,y,z,radius\n0,0,0,1,0.01\n7,1,0,1,0.01\n");
  EXPECT_NE(simulate(3, three, "burst"), 0) << file(".", "burst.txt");
  EXPECT_EQ(summary(at("burst")).at("status"), "failed") << file(".", "burst.txt");
}

TEST_F(SimulatedRanks, RefuseAMachineThatSimGridHasNot) {
  for (const char* option : {"--noise 0.1", "--threads 2", "--contacts-scale 2"}) {
    const Outcome refused =
        run(1, fmt::format("replay one/trace.h5 --ranks 2 {} --smpi-platform no.xml", option));
    EXPECT_EQ(refused.code, 2) << option;
    EXPECT_FALSE(fs::exists(at("no.xml"))) << option;
  }
}

}  // namespace
}  // namespace talus::test
