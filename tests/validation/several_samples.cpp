/// Scenes of several samples and bodies with names, from outside.

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "io/results/results.hpp"
#include "tests/unit/io/results/output_helpers.hpp"
#include "tests/unit/replaced.hpp"
#include "tests/validation/commands/command_helpers.hpp"

namespace talus::several_samples_test {
namespace {

using namespace test;

const std::string ball_over_bed = R"(name = "ball"
time_step = 5e-4
gravity = [0, 0, -9.81]

[[material]]
name = "glass"
density = 2500
[[material]]
name = "steel"
density = 7800

[[sample]]
name = "bed"
kind = "lattice"
count = 60
base = [0.06, 0.06]
origin = [-0.03, -0.03, 0]
radius = 0.005
[[sample]]
kind = "body"
name = "ball"
material = "steel"
radius = 0.01
position = [0, 0, 0.2]
velocity = [0, 0, -1]

[[wall]]
name = "floor"
side = "z-"

[[stage]]
end = { steps = 40 }
)";

class SeveralSamples : public CommandTest {
 protected:
  Outcome run(const std::string& scene, const std::string& more = "--out out --force") {
    write(folder_.path() / "scene.toml", scene);
    return test::run(folder_.path(), "run scene.toml " + more);
  }
};

/// A mixture of two materials, each drawn at random: the second where the first has left room.
TEST_F(SeveralSamples, DrawnAtRandomShareACell) {
  const std::string mixture = R"(time_step = 1e-5
[cell]
lengths = [0.02, 0.02, 0.02]
[[material]]
name = "glass"
density = 2500
[[material]]
name = "steel"
density = 7800
[[sample]]
kind = "random"
count = 300
radius = 0.0008
[[sample]]
kind = "random"
count = 60
radius = 0.0012
material = "steel"
[[stage]]
end = { steps = 1 }
)";
  const Outcome outcome = run(mixture);
  ASSERT_EQ(outcome.code, 0) << outcome.messages;
  const Frame frame = io::read_frame(at("out/results.h5"), 0);
  ASSERT_EQ(frame.x.size(), 360U);
  for (std::size_t a = 0; a < frame.x.size(); ++a)
    for (std::size_t b = 0; b < a; ++b)
      EXPECT_GE(frame.domain.separation(frame.x[a], frame.x[b]).norm(), frame.radius[a] + frame.radius[b]);
}

/// Nothing touches the ball: it falls as a body does, and feels no force.
TEST_F(SeveralSamples, ABodyWithANameLeavesItsPath) {
  ASSERT_EQ(run(ball_over_bed).code, 0);
  const Table path = read_table(at("out/bodies.csv"));
  ASSERT_EQ(path.rows.size(), 40u);
  for (const std::size_t row : {std::size_t{0}, std::size_t{39}}) {
    const double t = path.number(row, "time");
    EXPECT_EQ(path.rows[row].at("body"), "ball");
    EXPECT_NEAR(path.number(row, "vz"), -1 - 9.81 * t, 1e-12);
    EXPECT_NEAR(path.number(row, "z"), 0.2 - t - 0.5 * 9.81 * t * t, 1e-12 + 0.5 * 9.81 * t * 5e-4);
    EXPECT_NEAR(path.number(row, "force_z"), 0, 1e-10);
  }
}

/// On the floor it weighs what its material says.
TEST_F(SeveralSamples, TheForceOnARestingBodyIsItsWeight) {
  std::string scene = replaced(ball_over_bed, "position = [0, 0, 0.2]", "position = [0.1, 0, 0.01]");
  scene = replaced(scene, "velocity = [0, 0, -1]", "velocity = [0, 0, 0]");
  ASSERT_EQ(run(scene).code, 0);
  const Table path = read_table(at("out/bodies.csv"));
  const double weight = 4.0 / 3 * M_PI * 1e-6 * 7800 * 9.81;
  EXPECT_NEAR(path.number(39, "force_z"), weight, 1e-6 * weight);
}

/// A cell that begins to flow, or ceases to, carries a body along, and its image beyond a face moves
/// otherwise: contacts do neither. With gravity, flow and crossings the momentum that is left is rounding.
TEST_F(SeveralSamples, TheFlowOfACellIsNoForceOfContacts) {
  const std::string scene = R"(time_step = 1e-3
gravity = [0, 1, -9.81]
[material]
density = 2600
[cell]
lengths = [1.0, 1.2, 0.9]
origin = [-3, 5, 7]
[[sample]]
kind = "body"
name = "ball"
radius = 0.1
position = [-2.75, 5.5, 7.75]
velocity = [20, -10, 5]
[[stage]]
strain_rates = [0.5, -0.5, 0.2]
shear_rates = [0.3, 9.0, -0.4]
end = { time = 0.1 }
[[stage]]
end = { time = 0.1 }
)";
  ASSERT_EQ(run(scene).code, 0);
  const Table path = read_table(at("out/bodies.csv"));
  ASSERT_EQ(path.rows.size(), 200u);
  const double mass = 4.0 / 3 * M_PI * 1e-3 * 2600, momentum = mass * 23;
  int jumps = 0;
  for (std::size_t row = 0; row < path.rows.size(); ++row) {
    for (const char* force : {"force_x", "force_y", "force_z"})
      EXPECT_NEAR(path.number(row, force), 0, 1e-11 * momentum / 1e-3) << force << ", row " << row;
    jumps += row > 0 && std::abs(path.number(row, "x") - path.number(row - 1, "x")) > 0.5;
  }
  EXPECT_GT(jumps, 1) << "it is to cross a face";
}

TEST_F(SeveralSamples, TheSameBitsOnAnyRanksOfThreeSubdomains) {
  ASSERT_EQ(run(ball_over_bed, "--out one --set decomposition.subdomains=3").code, 0);
  ASSERT_EQ(run(ball_over_bed, "--out two --threads 1 --set decomposition.subdomains=3").code, 0);
  EXPECT_EQ(summary(at("one"))["digest"], summary(at("two"))["digest"]);
  EXPECT_EQ(content(at("one/bodies.csv")), content(at("two/bodies.csv")));
}

TEST_F(SeveralSamples, ARunGoesOnWithItsNamedBodies) {
  ASSERT_EQ(run(ball_over_bed, "--out whole").code, 0);
  ASSERT_EQ(run(ball_over_bed, "--out parts --resume --steps 17").code, 0);
  ASSERT_EQ(run(ball_over_bed, "--out parts --resume").code, 0);
  EXPECT_EQ(summary(at("whole"))["digest"], summary(at("parts"))["digest"]);
  EXPECT_EQ(content(at("whole/bodies.csv")), content(at("parts/bodies.csv")));
}

TEST_F(SeveralSamples, ThatOverlapAreRefusedWithARemedyAndNothingIsWritten) {
  const Outcome outcome = run(replaced(ball_over_bed, "position = [0, 0, 0.2]", "position = [0, 0, 0.015]"));
  EXPECT_EQ(outcome.code, 2);
  EXPECT_NE(outcome.messages.find("samples 0 ('bed') and 1 ('ball') overlap"), std::string::npos)
      << outcome.messages;
  EXPECT_NE(outcome.messages.find("Move one of them"), std::string::npos);
  EXPECT_FALSE(fs::exists(at("out")));
}

}  // namespace
}  // namespace talus::several_samples_test
