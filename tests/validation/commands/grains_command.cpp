/// Grains that come and go, from outside: tables, messages, a run that is stopped, and what is warned of.

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "tests/unit/io/results/output_helpers.hpp"
#include "tests/unit/replaced.hpp"
#include "tests/validation/commands/command_helpers.hpp"

namespace talus::grains_command_test {
namespace {

using namespace test;

const std::string rain = R"(name = "rain"
time_step = 1e-3
gravity = [0, 0, -9.81]
allow_unconverged = true

[[material]]
name = "glass"
density = 2500
[[material]]
name = "sand"
density = 2600

[[insert]]
name = "glass"
radius = 0.005
rate = 300
velocity = [0, 0, -1]
region = { shape = "cylinder", start = [0, 0, 0.1], end = [0, 0, 0.14], radius = 0.04 }
[[insert]]
name = "sand"
material = "sand"
radius = 0.004
count = 40
from = 0.05
region = { shape = "box", low = [0.05, -0.04, 0], high = [0.1, 0.04, 0.05] }
[[remove]]
name = "out"
region = { shape = "box", low = [-1, -1, -1], high = [0, 1, 0.02] }

[[wall]]
name = "floor"
side = "z-"
position = 0

[[stage]]
end = { steps = 200 }
)";

class Grains : public CommandTest {
 protected:
  Outcome run(const std::string& scene, const std::string& more) {
    write(folder_.path() / "scene.toml", scene);
    return test::run(folder_.path(), "run scene.toml --threads 1 " + more);
  }
};

TEST_F(Grains, TablesCountWhatCameAndWent) {
  const Outcome outcome = run(rain, "--out out");
  ASSERT_EQ(outcome.code, 0) << outcome.messages;
  const Table came = read_table(at("out/inserted.csv")), went = read_table(at("out/removed.csv"));
  ASSERT_EQ(came.rows.size(), 400u);  // two insertions a step
  ASSERT_EQ(went.rows.size(), 400u);  // two materials a step
  EXPECT_EQ(came.number(398, "placed"), 60);
  EXPECT_EQ(came.number(399, "placed"), 40);
  EXPECT_EQ(went.rows[398].at("material"), "glass");
  EXPECT_GT(went.number(398, "count"), 0);
  EXPECT_NEAR(went.number(398, "mass") / went.number(398, "count"), 4.0 / 3 * M_PI * 1.25e-7 * 2500, 1e-12);
  EXPECT_NE(outcome.messages.find("insert 'glass': 60 grains placed"), std::string::npos) << outcome.messages;
  const nlohmann::json said = summary(at("out"));
  EXPECT_EQ(said["bodies_at_end"].get<double>(),
            said["bodies"].get<double>() + 100 - went.number(398, "count") - went.number(399, "count"));
}

TEST_F(Grains, ARunThatWasStoppedGoesOnToTheSameBitsAndTables) {
  for (const std::string more : {"", " --set decomposition.subdomains=3"}) {
    ASSERT_EQ(run(rain, "--force --out whole" + more).code, 0);
    ASSERT_EQ(run(rain, "--force --out parts --steps 70 --set checkpoint.every_steps=70" + more).code, 0);
    fs::remove(at("parts/run.json"));  // what it says is in the checkpoint, too
    ASSERT_EQ(run(rain, "--out parts --resume" + more).code, 0);
    EXPECT_EQ(summary(at("whole"))["digest"], summary(at("parts"))["digest"]);
    for (const char* number : {"bodies", "bodies_at_end"})
      EXPECT_EQ(summary(at("whole"))[number], summary(at("parts"))[number]) << number;
    for (const char* table : {"inserted.csv", "removed.csv"})
      EXPECT_EQ(content(at("whole") / table), content(at("parts") / table));
  }
}

TEST_F(Grains, ThatNeverFallDueAreWarnedOf) {
  const Outcome outcome = run(replaced(rain, "from = 0.05", "from = 50"), "--out out");
  EXPECT_EQ(outcome.code, 0) << outcome.messages;
  EXPECT_NE(outcome.messages.find("insert 'sand' placed no grain: none was due"), std::string::npos)
      << outcome.messages;
  EXPECT_EQ(outcome.messages.find("insert 'glass' placed no grain"), std::string::npos) << outcome.messages;
}

TEST_F(Grains, WithoutRoomTheRunGoesOnAndSaysSo) {
  const Outcome outcome = run(replaced(rain, "count = 40", "count = 4000"), "--out out");
  EXPECT_EQ(outcome.code, 0) << outcome.messages;
  EXPECT_NE(outcome.messages.find("insert 'sand' had no room for a grain in 1"), std::string::npos)
      << outcome.messages;
  const Table came = read_table(at("out/inserted.csv"));
  EXPECT_EQ(came.number(399, "placed") + came.number(399, "waiting"), 4000);
  EXPECT_GT(came.number(399, "no_room"), 100);
}

TEST_F(Grains, AStepWithInsertionsCanBeStudied) {
  write(at("rain.toml"), rain);
  const Outcome outcome = CommandTest::run(
      "study error rain.toml --out study --at-step 60 --only step --tolerances 1e-2 --methods nlgs");
  EXPECT_EQ(outcome.code, 0) << outcome.messages;
}

TEST_F(Grains, WithNoneAtTheBeginningThereIsNothingToCut) {
  write(at("rain.toml"), rain);
  for (const std::string command :
       {"partition rain.toml --subdomains 2", "study scaling rain.toml --cores 1"}) {
    const Outcome outcome = CommandTest::run(command + " --out cut");
    EXPECT_EQ(outcome.code, 2) << command;
    EXPECT_NE(outcome.messages.find("no grain is there at the beginning"), std::string::npos)
        << outcome.messages;
    EXPECT_FALSE(fs::exists(at("cut"))) << command;
  }
}

TEST_F(Grains, ARegionBehindAWallIsWarnedOf) {
  const Outcome outcome = run(replaced(rain, "low = [0.05, -0.04, 0], high = [0.1, 0.04, 0.05]",
                                       "low = [0.05, -0.04, -0.1], high = [0.1, 0.04, 0]"),
                              "--out out --dry-run");
  EXPECT_EQ(outcome.code, 0);
  EXPECT_NE(outcome.messages.find("insert 'sand' lies in or behind walls"), std::string::npos)
      << outcome.messages;
}

TEST_F(Grains, ADepositionThatIsSortedBySizeIsWarnedOf) {
  const std::string deposition = R"(time_step = 1e-3
[material]
density = 2500
[sample]
kind = "deposition"
count = 300
base = [0.05, 0.05]
radius_distribution = "uniform"
radius_min = 0.001
radius_max = 0.006
[[wall]]
name = "z-"
[[stage]]
end = { steps = 1 }
)";
  EXPECT_NE(run(deposition, "--out out --dry-run").messages.find("sorted by size"), std::string::npos);
  EXPECT_EQ(
      run(replaced(deposition, "0.001", "0.004"), "--out out --dry-run").messages.find("sorted by size"),
      std::string::npos);
}

}  // namespace
}  // namespace talus::grains_command_test
