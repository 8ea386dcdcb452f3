/// `talus study scaling` as a user meets it.

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/unit/io/results/output_helpers.hpp"
#include "tests/unit/replaced.hpp"
#include "tests/validation/commands/command_helpers.hpp"

namespace talus::study_scaling_command_test {
namespace {

using namespace test;

class StudyScaling : public CommandTest {
 protected:
  void SetUp() override { write(at("scene.toml"), pressed_box); }
  Outcome run(const std::string& arguments, const std::string& before = "") {
    // The study itself lets root start ranks.
    return test::run(folder_.path(), arguments,
                     "env -u OMPI_ALLOW_RUN_AS_ROOT -u OMPI_ALLOW_RUN_AS_ROOT_CONFIRM " + before);
  }
};

constexpr const char* small = "study scaling scene.toml --out s --steps 2:3 --subdomains 1,4 ";

TEST_F(StudyScaling, MeasuresPredictsAndWritesEverything) {
  write(at("others.csv"), "name,cores,speedup\nelsewhere,96,88\n");
  const Outcome outcome = run(std::string(small) +
                              "--repeat 2 --cores 2 --network today,2012 --beside others.csv --variant "
                              "decomposition.exchange=ccs --mpirun 'mpirun --oversubscribe --bind-to none'");
  ASSERT_EQ(outcome.code, 0) << outcome.messages;
  for (const std::string name :
       {"report.html", "speedup.svg", "efficiency.svg", "efficiency_iterations.svg", "efficiency_sweeps.svg",
        "weak_efficiency.svg", "hybrid.svg", "commands.sh", "slurm.sh", "strong.toml", "strong.csv",
        "beside.csv", "traces/strong-4-1.h5", "traces/strong-4-variant1-1.h5"})
    EXPECT_TRUE(fs::exists(at("s/" + name))) << name;
  EXPECT_FALSE(fs::exists(at("s/run"))) << "runs leave their times only";
  const std::string page = content(at("s/report.html"));
  EXPECT_NE(page.find("elsewhere"), std::string::npos);
  EXPECT_NE(outcome.output.find("#SBATCH"), std::string::npos);
  EXPECT_NE(outcome.output.find("talus replay"), std::string::npos);

  int measured = 0, predicted = 0;
  for (const std::string name : {"strong_scaling.csv", "weak_scaling.csv", "hybrid.csv"}) {
    const Table table = read_table(at("s/" + name));
    for (std::size_t k = 0; k < table.rows.size(); ++k) {
      const auto& row = table.rows[k];
      const bool run = row.at("source") == "run";
      ++(run ? measured : predicted);
      EXPECT_EQ(row.at("result"), run ? "measured" : "predicted") << name << k;
      EXPECT_EQ(row.at("curve").find("predicted") == std::string::npos, run) << row.at("curve");
      EXPECT_NE(page.find(row.at("curve")), std::string::npos) << row.at("curve");
      EXPECT_LE(table.number(k, "fastest"), table.number(k, "seconds"));
      EXPECT_GE(table.number(k, "slowest"), table.number(k, "seconds"));
      EXPECT_NEAR(table.number(k, "efficiency"),
                  table.number(k, "of_iterations") * table.number(k, "of_sweeps"), 1e-9);
      EXPECT_NEAR(table.number(k, "speedup"), table.number(k, "efficiency") * table.number(k, "cores"), 1e-9);
      if (row.at("source") != "replay") continue;
      EXPECT_NEAR(table.number(k, "of_sweeps"),
                  table.number(k, "work") * table.number(k, "balance") * table.number(k, "communication") *
                      table.number(k, "within"),
                  1e-9);
      EXPECT_FALSE(row.at("bound").empty());
    }
  }
  // Strong and weak: 1 x 1, 1 x 2, 2 x 1.
  EXPECT_EQ(measured, 6);
  // Strong: 1, 2 and 4 subdomains on two networks, 2 and 4 with CCS; 1 x 1, 1 x 2, 2 x 1 on one node, as
  // measured. Hybrid: 1 x 4, 2 x 2, 4 x 1. Weak: 1, 2 and 4, and what fits on one node.
  EXPECT_EQ(predicted, (3 + 2 + 3) * 2 + 3 + 3 * 2 + 3);
}

TEST_F(StudyScaling, WeakSamplesHaveAsManyGrainsPerCore) {
  ASSERT_EQ(run(std::string(small) + "--repeat 0").code, 0);
  const Table weak = read_table(at("s/weak_scaling.csv"));
  ASSERT_EQ(weak.rows.size(), 2U);
  EXPECT_EQ(weak.rows[0].at("grains"), "100");
  EXPECT_EQ(weak.rows[1].at("grains"), "400");
  // Four times the grains on four times the cores: 1 were the same time of a step.
  EXPECT_NEAR(weak.number(1, "efficiency"), weak.number(0, "seconds") / weak.number(1, "seconds"), 1e-9);
}

TEST_F(StudyScaling, BeginsFromTheEndOfARun) {
  ASSERT_EQ(run("run scene.toml --out r --threads 1 --steps 6 --set allow_unconverged=true").code, 0);
  const Outcome outcome = run(std::string(small) + "--repeat 0 --from r/results.h5 --stage shear");
  ASSERT_EQ(outcome.code, 0) << outcome.messages;
  EXPECT_NE(outcome.messages.find("no weak scaling"), std::string::npos);
  EXPECT_FALSE(fs::exists(at("s/weak_scaling.csv")));
  const std::string scene = content(at("s/strong.toml"));
  EXPECT_EQ(scene.find("\"press\""), std::string::npos) << "stages before it are over";
  // What a study has written is a scene like any other.
  EXPECT_EQ(run("run s/strong.toml --dry-run").code, 0);
  EXPECT_EQ(run("study scaling scene.toml --out t --from r/results.h5 --stage nothing").code, 2);
  EXPECT_EQ(run("study scaling scene.toml --out t --from r/results.h5 --weak 2").code, 2);
  EXPECT_FALSE(fs::exists(at("t")));
}

/// The lid comes down at some speed at the end of the run; as long as it is pushed, that is where it goes on.
TEST_F(StudyScaling, PushedWallsGoOnAtTheSpeedTheyHad) {
  ASSERT_EQ(run("run scene.toml --out r --threads 1 --steps 3 --set allow_unconverged=true").code, 0);
  const Table walls = read_table(at("r/walls.csv"));
  const std::size_t last = walls.rows.size() - 1;
  ASSERT_EQ(walls.rows[last].at("wall"), "z+");
  ASSERT_GT(walls.number(last, "velocity"), 0);
  ASSERT_NE(
      run("study scaling scene.toml --out s --steps 1:1 --subdomains 1 --repeat 0 --from r/results.h5").code,
      1);
  EXPECT_NE(content(at("s/strong.toml")).find(", -" + walls.rows[last].at("velocity") + "]"),
            std::string::npos)
      << content(at("s/strong.toml"));
}

TEST_F(StudyScaling, SaysWhenResultsAreOfAnotherSample) {
  ASSERT_EQ(run("run scene.toml --out r --threads 1 --steps 1 --set allow_unconverged=true").code, 0);
  const std::string command = std::string("study scaling scene.toml --steps 1:1 --subdomains 1 --repeat 0 ") +
                              "--set allow_unconverged=true --from r/results.h5 ";
  const Outcome same = run(command + "--out a"), fewer = run(command + "--out b --set sample.count=300"),
                finer = run(command + "--out c --set sample.radius_max=0.01");
  EXPECT_NE(same.messages.find("r/results.h5; radii"), std::string::npos) << same.messages;
  EXPECT_EQ(same.messages.find("warning"), std::string::npos) << same.messages;
  EXPECT_NE(fewer.messages.find("warning"), std::string::npos) << fewer.messages;
  EXPECT_NE(finer.messages.find("warning"), std::string::npos) << finer.messages;
}

/// A sweep too few on purpose is a study too, and says so.
TEST_F(StudyScaling, MissedTolerancesAreToldAndMustBeAllowed) {
  const std::string command =
      "study scaling scene.toml --steps 2:3 --subdomains 2 --repeat 1 --cores 1 --no-weak --set "
      "solver.tolerance=1e-9 --set solver.max_iterations=4 ";
  const Outcome missed = run(command + "--out a"),
                allowed = run(command + "--out b --set allow_unconverged=true");
  EXPECT_EQ(missed.code, 3) << missed.messages;
  EXPECT_NE(missed.messages.find("allow_unconverged"), std::string::npos) << missed.messages;
  EXPECT_EQ(allowed.code, 0) << allowed.messages;
  for (const char* out : {"a", "b"}) {
    const Table table = read_table(at(std::string(out) + "/strong_scaling.csv"));
    for (std::size_t k = 0; k < table.rows.size(); ++k) EXPECT_EQ(table.number(k, "missed"), 2) << k;
    EXPECT_NE(content(at(std::string(out) + "/report.html")).find("missed the tolerance"), std::string::npos);
  }
}

/// The first run on one core ends well; no core is left for the one that is to follow.
TEST_F(StudyScaling, AStudyThatFailsLeavesWhatItHasMeasured) {
  const Outcome outcome = run(std::string(small) + "--repeat 1 --cores 2 --no-weak --mpirun false");
  EXPECT_EQ(outcome.code, 1) << outcome.messages;
  EXPECT_EQ(read_table(at("s/strong_scaling.csv")).rows.front().at("source"), "run");
}

TEST_F(StudyScaling, PlaysItsTracesAgainOnAnotherNetwork) {
  const std::string command =
      "study scaling scene.toml --out s --steps 2:3 --subdomains 2 --repeat 0 --no-weak ";
  ASSERT_EQ(run(command).code, 0);
  const std::string trace = content(at("s/traces/strong-2-1.h5"));
  const Table before = read_table(at("s/strong_scaling.csv"));
  const Outcome again = run(command + "--reuse --latency 1e-4 --ranks-per-node 1");
  ASSERT_EQ(again.code, 0) << again.messages;
  EXPECT_EQ(again.messages.find("recorded"), std::string::npos) << again.messages;
  EXPECT_EQ(content(at("s/traces/strong-2-1.h5")), trace);
  const Table after = read_table(at("s/strong_scaling.csv"));
  EXPECT_EQ(after.rows[0].at("seconds"), before.rows[0].at("seconds")) << "one core sends nothing";
  EXPECT_GT(after.number(1, "seconds"), before.number(1, "seconds"));
  const Outcome longer =
      run("study scaling scene.toml --out s --steps 2:4 --subdomains 2 --repeat 0 --no-weak --reuse");
  EXPECT_NE(longer.messages.find("strong-2-1.h5 was of steps 2:3: recorded anew"), std::string::npos)
      << longer.messages;
  const auto files = files_below(at("s"));
  const Outcome other = run(command + "--reuse --set material.friction=0.1");
  EXPECT_EQ(other.code, 2);
  EXPECT_NE(other.messages.find("another scene"), std::string::npos) << other.messages;
  EXPECT_EQ(files_below(at("s")), files);
}

TEST_F(StudyScaling, RecordsSeveralSubdomainsAsOnCoresOfTheirOwn) {
  const std::string command =
      "study scaling scene.toml --out s --steps 2:3 --subdomains 2 --repeat 0 --no-weak ";
  const Outcome outcome = run(command + "--own-caches --variant decomposition.exchange=ccs");
  ASSERT_EQ(outcome.code, 0) << outcome.messages;
  EXPECT_TRUE(fs::exists(at("s/traces/strong-1-1.h5")));
  EXPECT_TRUE(fs::exists(at("s/traces/strong-2-own-1.h5")));
  EXPECT_FALSE(fs::exists(at("s/traces/strong-2-1.h5"))) << "one for the other would be taken up by --reuse";
  EXPECT_TRUE(fs::exists(at("s/traces/strong-2-variant1-own-1.h5")));
  EXPECT_NE(content(at("s/report.html")).find("no other subdomain"), std::string::npos);

  write(at("s/traces/strong-2-mine-1.h5"), "mine");
  ASSERT_EQ(run(command + "--force").code, 0);
  EXPECT_FALSE(fs::exists(at("s/traces/strong-2-own-1.h5"))) << "of the earlier study";
  EXPECT_FALSE(fs::exists(at("s/traces/strong-2-variant1-own-1.h5"))) << "of the earlier study";
  EXPECT_TRUE(fs::exists(at("s/traces/strong-2-mine-1.h5")));
}

TEST_F(StudyScaling, ChoosesItsOwnBoxesWhereTheSceneHasSome) {
  const Outcome outcome =
      run("study scaling scene.toml --out s --steps 2:2 --subdomains 2 --repeat 0 --weak 2 --set "
          "decomposition.boxes=[1,1,3]");
  ASSERT_EQ(outcome.code, 0) << outcome.messages;
  EXPECT_EQ(read_table(at("s/strong_scaling.csv")).rows.at(1).at("subdomains"), "2");
}

// The program itself on simulated ranks, where that build is.
TEST_F(StudyScaling, PredictsBySimulatedRanksToo) {
  if (!fs::exists(TALUS_SMPI_COMMAND)) GTEST_SKIP() << "there is no " << TALUS_SMPI_COMMAND;
  const Outcome outcome =
      run("study scaling scene.toml --out s --steps 2:3 --subdomains 4 --repeat 0 --no-weak "
          "--smpi " TALUS_SMPI_COMMAND);
  ASSERT_EQ(outcome.code, 0) << outcome.messages;
  const Table table = read_table(at("s/strong_scaling.csv"));
  ASSERT_EQ(table.rows.size(), 4U) << "1 and 4 subdomains, by replay and by SMPI";
  for (std::size_t k = 2; k < 4; ++k) {
    EXPECT_EQ(table.rows[k].at("source"), "smpi");
    EXPECT_EQ(table.rows[k].at("result"), "predicted");
    // Iterations differ by the sweep that several ranks need to hear of each other's errors.
    EXPECT_GT(table.number(k, "seconds"), 0);
  }
  EXPECT_EQ(table.number(2, "speedup"), 1);
}

TEST_F(StudyScaling, RefusesNonsenseAndWritesNothing) {
  const auto refused = [&](const std::string& arguments, const std::string& word,
                           const std::string& before = "") {
    const Outcome outcome = run("study scaling scene.toml --out s " + arguments, before);
    EXPECT_EQ(outcome.code, 2) << arguments;
    EXPECT_NE(outcome.messages.find(word), std::string::npos) << outcome.messages;
    EXPECT_FALSE(fs::exists(at("s"))) << arguments;
  };
  refused("--steps 0:0", "--steps");
  refused("--steps 3:", "--steps");
  refused("--subdomains 0", "--subdomains");
  refused("--subdomains 1000", "1000 subdomains for 400 grains");
  refused("--hybrid 7", "--hybrid 7");
  refused("--network carrier-pigeon", "today");
  refused("--variant decomposition.subdomains=3", "--subdomains");
  refused("--variant decomposition.boxes=[1,1,3]", "--subdomains");
  refused("--variant decomposition.exchnage=ccs", "exchange");
  refused("--cores 2 --mpirun no-such-program", "no-such-program");
  refused("--cores 2", "mpirun is not to be found", "PATH=/nowhere");
  refused("--smpi no-such-talus", "no-such-talus");
  refused("--beside scene.toml", "name,cores,speedup");
  refused("--steps 12:13", "the scene ends after 12 steps");
  refused("--steps 2:3 --subdomains 1,4 --weak 4000", "of 4000 cores cannot be made");
}

TEST_F(StudyScaling, SaysWhichStepsTheSceneDoesNotHave) {
  write(at("scene.toml"), replaced(pressed_box, "end = { steps = 6 }", "end = { time = 6e-3 }"));
  const Outcome outcome = run("study scaling scene.toml --out s --steps 50:60 --subdomains 2 --repeat 0");
  EXPECT_EQ(outcome.code, 1);
  EXPECT_NE(outcome.messages.find("--steps"), std::string::npos) << outcome.messages;
  EXPECT_FALSE(fs::exists(at("s/run")));
}

TEST_F(StudyScaling, OverwritesItsOwnFilesOnlyAndOnlyWhenAsked) {
  ASSERT_EQ(run(std::string(small) + "--repeat 0 --no-weak").code, 0);
  write(at("s/notes.txt"), "mine");
  write(at("s/traces/mine.h5"), "mine");
  const auto before = files_below(at("s"));
  const Outcome refused = run(std::string(small) + "--repeat 0 --no-weak");
  EXPECT_EQ(refused.code, 2);
  EXPECT_NE(refused.messages.find("--force"), std::string::npos) << refused.messages;
  EXPECT_EQ(files_below(at("s")), before);
  ASSERT_EQ(
      run("study scaling scene.toml --out s --force --steps 2:3 --subdomains 2 --repeat 0 --no-weak").code,
      0);
  EXPECT_EQ(content(at("s/notes.txt")), "mine");
  EXPECT_EQ(content(at("s/traces/mine.h5")), "mine");
  EXPECT_FALSE(fs::exists(at("s/traces/strong-4-1.h5"))) << "of the earlier study";
  ASSERT_NE(run("study error scene.toml --out s --force --threads 1 --only step --at-step 1 --methods nlgs "
                "--tolerances 1")
                .code,
            2);
  EXPECT_TRUE(fs::exists(at("s/traces/strong-2-1.h5"))) << "of another command";
  EXPECT_TRUE(fs::exists(at("s/strong_scaling.csv"))) << "of another command";
}

}  // namespace
}  // namespace talus::study_scaling_command_test
