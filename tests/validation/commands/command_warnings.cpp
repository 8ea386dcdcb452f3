/// What `talus run` says of scenes that are sound and seldom meant, and of steps that are too long.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <string>

#include "io/results/results.hpp"
#include "tests/unit/io/results/output_helpers.hpp"
#include "tests/unit/replaced.hpp"
#include "tests/validation/commands/command_helpers.hpp"

namespace talus {
namespace {

using namespace test;

class Warnings : public CommandTest {
 protected:
  /// All warnings of a dry run of the scene.
  std::string of(const std::string& scene) {
    write(at("scene.toml"), scene);
    const Outcome outcome = run("run scene.toml --dry-run");
    EXPECT_EQ(outcome.code, 0) << outcome.messages;
    std::string found, line;
    for (std::istringstream lines(outcome.messages); std::getline(lines, line);)
      if (line.find("warning") != std::string::npos) found += line + "\n";
    return found;
  }
};

TEST_F(Warnings, AreNoneWhereNothingIsOdd) {
  EXPECT_EQ(of(column_scene), "");
  EXPECT_EQ(of(pressed_box), "");
  EXPECT_EQ(of(cell_scene), "");
}

TEST_F(Warnings, OfWhatIsToHappenWhenTheRunHasEnded) {
  const std::string region = "region = { shape = \"box\", low = [0, 0, 0], high = [1, 1, 1] }\n",
                    end = " is never reached: the run ends by";
  EXPECT_NE(of(column_scene + "[[remove]]\nname = \"r\"\nat = [1e-3, 900]\n" + region)
                .find("remove 'r': at = 900 s" + end),
            std::string::npos);
  EXPECT_NE(of(column_scene + "[[probe]]\nname = \"p\"\nevery = 900\n" + region)
                .find("probe 'p': every = 900 s" + end),
            std::string::npos);
  // The last step is the fourth, and removes what is due before its end.
  EXPECT_NE(of(column_scene + "[[remove]]\nname = \"r\"\nat = [4e-3]\n" + region)
                .find("remove 'r': at = 0.004 s" + end),
            std::string::npos);
  EXPECT_NE(of(column_scene + "[[remove]]\nname = \"r\"\nat = [1]\nstage = \"rest\"\n" + region)
                .find("remove 'r': at = 1 s is never reached: its stage ends by 0.004 s"),
            std::string::npos);
  EXPECT_NE(of(column_scene + "[[remove]]\nname = \"r\"\nfrom = 900\n" + region)
                .find("remove 'r': from = 900 s" + end),
            std::string::npos);
  EXPECT_EQ(of(column_scene + "[[remove]]\nat = [1e-3]\n" + region + "[[probe]]\nevery = 1e-3\n" + region),
            "");
}

TEST_F(Warnings, OfASceneWithoutWalls) {
  const std::size_t begin = column_scene.find("[[wall]]"), end = column_scene.find("[[stage]]");
  EXPECT_NE(of(std::string(column_scene).erase(begin, end - begin)).find("no walls"), std::string::npos);
}

TEST_F(Warnings, OfGravityThatNoWallStandsAgainst) {
  EXPECT_NE(of(replaced(column_scene, "-9.81", "9.81"))
                .find("gravity of stage 'rest' is (0, 0, 9.81) m/s^2, upwards"),
            std::string::npos);
  EXPECT_NE(of(replaced(column_scene, "[0, 0, -9.81]", "[9.81, 0, 0]")).find("no wall stands against it"),
            std::string::npos);
  EXPECT_EQ(of(replaced(replaced(column_scene, "[0, 0, -9.81]", "[9.81, 0, 0]"), "density = 2600",
                        "density = 2600\ncohesion = 1e-3")),
            "")
      << "it may hang";
  EXPECT_NE(of("gravity = [0, 0, -9.81]\n" +
               replaced(cell_scene, "density = 2600", "density = 2600\ncohesion = 1e-3"))
                .find("no wall stands against it"),
            std::string::npos)
      << "there is nothing to hang from";
}

TEST_F(Warnings, OfALatticeThatIsLargerThanItsCell) {
  const std::string lattice = replaced(cell_scene, "\"random\"\ncount = 20\nradius = 0.005",
                                       "\"lattice\"\ncells = [3, 3, 3]\nspacing = 1\nradius = 0.005");
  EXPECT_EQ(of(lattice), "");
  const std::string warnings = of(replaced(lattice, "0.1, 0.1, 0.1", "0.1, 0.1, 0.027"));
  EXPECT_NE(warnings.find("9 overlaps of more than 10 %"), std::string::npos) << warnings;
}

TEST_F(Warnings, OfLengthsInOtherUnitsAndPlacesThatAreTooFarAway) {
  EXPECT_NE(of(replaced(column_scene, "radius = 0.01", "radius = 10")).find("10 mm are 0.01 m"),
            std::string::npos);
  const std::string far = replaced(with_bodies(column_scene), "steps = 4", "time = 1e30");
  write(at("grains.csv"), "id,x,y,z,radius\n42,1e10,0,0.01,0.01\n");
  const std::string warnings = of(far);
  EXPECT_NE(warnings.find("grains lie 1e+10 m from the origin"), std::string::npos) << warnings;
  EXPECT_NE(warnings.find("end.time = 1e+30 s takes 1e+33 steps"), std::string::npos) << warnings;
}

TEST_F(Warnings, NameTheLineOfWhatTheySpeakOf) {
  EXPECT_NE(of(replaced(column_scene, "2600", "2.6")).find("scene.toml:6: material.density = "),
            std::string::npos);
}

TEST_F(Warnings, OfADensityInOtherUnits) {
  EXPECT_NE(of(replaced(column_scene, "2600", "2.6"))
                .find("2.6 kg/m^3 is less than that of foam; 2.6 g/cm^3 are 2600 kg/m^3"),
            std::string::npos);
  EXPECT_NE(of(replaced(column_scene, "2600", "2.6e6")).find("more than that of any element"),
            std::string::npos);
  EXPECT_EQ(of(replaced(column_scene, "2600", "1e-3")).find("g/cm^3"), std::string::npos)
      << "0.001 is no unit";
}

TEST_F(Warnings, OfFrictionInPerCent) {
  EXPECT_NE(of(replaced(column_scene, "friction = 0.35", "friction = 35"))
                .find("is 35, more than surfaces have; 35 % are 0.35"),
            std::string::npos);
  EXPECT_EQ(of(replaced(column_scene, "friction = 0.35", "friction = 2")), "");
  const std::string rough = of(replaced(column_scene, "friction = 0.35", "friction = 1e9"));
  EXPECT_NE(rough.find("more than surfaces have"), std::string::npos);
  EXPECT_EQ(rough.find('%'), std::string::npos) << "who wants no sliding says so by a large number";
}

TEST_F(Warnings, OfABeltThatIsToMoveAlongItsNormal) {
  const auto belt = [](const std::string& velocity) {
    return replaced(column_scene, "side = \"z-\"",
                    "side = \"z-\"\n[[wall.motion]]\nkind = \"velocity\"\nvelocity = " + velocity +
                        "\nsurface_only = true");
  };
  EXPECT_NE(of(belt("[0, 0, 0.5]")).find("surface of wall 'floor' is to move along its normal"),
            std::string::npos);
  EXPECT_EQ(of(belt("[0.1, 0, 0.5]")), "");
}

TEST_F(Warnings, OfRollingResistanceWithoutFriction) {
  EXPECT_NE(of(replaced(column_scene, "friction = 0.35",
                        "friction = 0.35\nwall_friction = 0\nrolling_resistance = 0.1"))
                .find("rolling_resistance of grains and walls does nothing in stage"),
            std::string::npos);
}

TEST_F(Warnings, OfATableThatJumpsOffTheMiddleOfAStep) {
  write(at("stroke.csv"), "t,x,y,z\n0,0,0,0\n0.05,0,0,0\n1,0,0,0.95\n");
  const std::string scene =
      replaced(replaced(column_scene, "friction = 0.35", "restitution = 0.5"), "side = \"z-\"",
               "side = \"z-\"\nmotion = [{ kind = \"table\", file = \"stroke.csv\" }]");
  EXPECT_NE(of(scene).find("'floor' jumps at 0.05 s of"), std::string::npos) << of(scene);
  EXPECT_NE(of(scene).find("the time 0.0505 s"), std::string::npos);
  write(at("stroke.csv"), "t,x,y,z\n0,0,0,0\n0.0503,0,0,0\n1,0,0,0.95\n");
  EXPECT_NE(of(scene).find("the time 0.0505 s"), std::string::npos);
  write(at("stroke.csv"), "t,x,y,z\n0,0,0,0\n0.05,0,0,0\n1,0.95,0,0\n");
  EXPECT_EQ(of(scene), "") << "a floor that begins to slide throws nobody";
  write(at("stroke.csv"), "t,x,y,z\n0,0,0,0\n0.0505,0,0,0\n1,0,0,0.95\n");
  EXPECT_EQ(of(scene), "");
}

TEST_F(Warnings, OfAStressThatRisesFromNothingWhereAFlowPressedTheGrains) {
  const std::string first =
      "[[stage]]\nname = \"squeeze\"\nstrain_rates = [0, 0, -1]\n"
      "stress = { xx = 1e3, yy = 1e3 }\nend = { steps = 2 }\n";
  const auto second = [&](const std::string& stress) {
    std::string scene = cell_scene;
    scene.erase(scene.find("[[stage]]"));
    return scene + first + "[[stage]]\nname = \"hold\"\nstress = { " + stress + " }\nend = { steps = 2 }\n";
  };
  EXPECT_NE(of(second("xx = 1e3, yy = 1e3, zz = 1e3, ramp_time = 0.1"))
                .find("the stress of stage 'hold' rises from 0 Pa along z, as stage 'squeeze' follows none"),
            std::string::npos);
  EXPECT_EQ(of(second("xx = 1e3, yy = 1e3, zz = 1e3")), "") << "without a ramp it is given at once";
  EXPECT_EQ(of(second("xx = 2e3, yy = 1e3, ramp_time = 0.1")), "") << "these were followed before";
}

TEST_F(Warnings, OfMoreSubdomainsThanGrains) {
  EXPECT_NE(of(column_scene + "\n[decomposition]\nsubdomains = 500\n").find("500 subdomains for"),
            std::string::npos);
}

TEST_F(Warnings, AreInTheSummaryOfTheRun) {
  write(at("scene.toml"), replaced(column_scene, "2600", "2.6"));
  ASSERT_EQ(run("run scene.toml --out results").code, 0);
  const auto warnings = summary(at("results")).at("warnings");
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_NE(warnings[0].get<std::string>().find("2.6 kg/m^3"), std::string::npos);
}

/// One grain on a floor that a lid touches, which comes down at `speed` [m/s].
std::string under_a_lid(const std::string& speed) {
  std::string scene = with_bodies(column_scene);
  scene.replace(scene.find("side = \"z-\""), 11, "side = \"z-\"\nposition = 0");
  return scene + R"(
[[wall]]
name = "lid"
side = "z+"
position = 0.02
drive = "velocity"
velocity = [0, 0, -)" +
         speed + "]\n";
}

/// No velocities keep both contacts from approaching.
TEST_F(Warnings, OfWallsThatCloseOnGrainsThatCannotGetAway) {
  write(at("scene.toml"), under_a_lid("0.01"));
  write(at("grains.csv"), "id,x,y,z,radius\n42,0,0,0.01,0.01\n");
  const Outcome outcome = run("run scene.toml --out results");
  EXPECT_EQ(outcome.code, 3) << outcome.messages;
  EXPECT_NE(outcome.messages.find("in 4 steps walls close on grains that cannot get away"), std::string::npos)
      << outcome.messages;
  EXPECT_LT(summary(at("results")).at("iterations").get<int>(), 400) << "they end early";
}

/// A plate that comes down on a wedge of 20 degrees, whose half angle is less than that of friction: the
/// grain is nipped. No sweeps and no shorter step mend that, and none are advised.
TEST_F(Warnings, OfWallsThatNipAGrainWhichFrictionHolds) {
  std::string scene = with_bodies(column_scene);
  scene.replace(scene.find("side = \"z-\""), 11, "side = \"z-\"\nposition = 0");
  write(at("scene.toml"), scene + R"(
[[wall]]
name = "blade"
normal = [0, 0.34202, -0.93969]
point = [0, 0, 0.0212]
drive = "velocity"
velocity = [0, 0, -0.05]
)");
  write(at("grains.csv"), "id,x,y,z,radius\n42,0,0,0.01,0.01\n");
  const Outcome outcome =
      run("run scene.toml --out results --set stage.0.end.steps=60 --set material.wall_friction=0.35");
  EXPECT_EQ(outcome.code, 3) << outcome.messages;
  EXPECT_NE(outcome.messages.find("steps walls close on grains that friction does not let get away"),
            std::string::npos)
      << outcome.messages;
  EXPECT_EQ(outcome.messages.find("max_iterations"), std::string::npos) << outcome.messages;
  EXPECT_NE(outcome.messages.find(". More sweeps or a shorter time_step do not mend the"), std::string::npos)
      << outcome.messages;
  EXPECT_EQ(outcome.messages.find("would do"), std::string::npos) << outcome.messages;
  const auto results = summary(at("results"));
  EXPECT_GT(results.at("impossible_steps").get<int>(), 5);
  EXPECT_LT(results.at("iterations").get<int>(), 6000) << "they end early";
}

// The lid goes into the grain. A shorter time step mends nothing where walls close on it, so none is
// promised; and what the terminal said stands in the files as well.
TEST_F(Warnings, OfTheEndStandInTheFilesAndPromiseNothingWhereStepsHaveNoSolution) {
  write(at("scene.toml"), under_a_lid("0.5"));
  write(at("grains.csv"), "id,x,y,z,radius\n42,0,0,0.01,0.01\n");
  const Outcome outcome = run("run scene.toml --out results");
  EXPECT_EQ(outcome.code, 3) << outcome.messages;
  EXPECT_NE(outcome.messages.find("overlaps beyond"), std::string::npos) << outcome.messages;
  EXPECT_EQ(outcome.messages.find("would do"), std::string::npos) << outcome.messages;
  EXPECT_EQ(outcome.messages.find("moreau"), std::string::npos) << "it is the law already";
  const auto results = summary(at("results"));
  EXPECT_TRUE(results.at("sufficient_time_step").is_null());
  ASSERT_EQ(results.at("findings").size(), 3U) << results.at("findings");
  const std::string page = content(at("results/report.html"));
  for (const std::string finding : results.at("findings")) {
    EXPECT_NE(outcome.messages.find("warning: " + finding), std::string::npos) << finding;
    EXPECT_NE(page.find(finding), std::string::npos) << finding;
  }
}

/// A grain that begins on the floor at 3 m/s, 0.3 radii in a step, half of which it is in before it rebounds.
std::string bouncing() {
  std::string scene = with_bodies(column_scene);
  scene.replace(scene.find("[0, 0, -9.81]"), 13, "[0, 0, 0]");
  scene.replace(scene.find("friction = 0.35"), 15, "friction = 0\nrestitution = 0.5");
  scene.replace(scene.find("side = \"z-\""), 11, "side = \"z-\"\nposition = 0");
  return scene.replace(scene.find("steps = 4"), 9, "time = 0.02");
}

// The step is exact and the position is not. Its time step follows from how far it was missed, and does.
TEST_F(Warnings, NameTheOverlapOfAStepThatIsTooLongAndTheStepThatWouldDo) {
  write(at("scene.toml"), bouncing());
  write(at("grains.csv"), "id,x,y,z,radius,vx,vy,vz\n42,0,0,0.01,0.01,0,0,-3\n");
  const Outcome outcome = run("run scene.toml --out results");
  EXPECT_EQ(outcome.code, 3) << outcome.messages;
  EXPECT_NE(
      outcome.messages.find("overlaps beyond solver.overlap_tolerance = 0.05: the deepest, 0.075 of the "
                            "smaller radius, of body 42 and wall 'floor' in step 1"),
      std::string::npos)
      << outcome.messages;
  EXPECT_EQ(outcome.messages.find("max_iterations"), std::string::npos) << "sweeps are no help";
  const Table steps = read_table(at("results/steps.csv"));
  double worst = 0;
  for (std::size_t k = 0; k < steps.rows.size(); ++k) {
    const bool missed = steps.number(k, "overlap") > 0.05;
    EXPECT_EQ(steps.rows[k].at("converged"), missed ? "0" : "1");
    EXPECT_EQ(steps.rows[k].at("overlap_body"), missed ? "42" : "-1");
    EXPECT_EQ(steps.rows[k].at("overlap_with"), "-1") << "the first wall";
    worst = std::max(worst, steps.number(k, "overlap"));
  }
  const auto results = summary(at("results"));
  EXPECT_EQ(results.at("worst_overlap").get<double>(), worst);
  const double enough = results.at("sufficient_time_step").get<double>();
  EXPECT_NEAR(enough, 0.5 * 1e-3 * 0.05 / worst, 1e-12);

  const Outcome shorter = run("run scene.toml --out shorter --set time_step=" + std::to_string(enough));
  EXPECT_EQ(shorter.code, 0) << shorter.messages;
  EXPECT_TRUE(summary(at("shorter")).at("sufficient_time_step").is_null());
  EXPECT_EQ(run("run scene.toml --out lenient --set solver.overlap_tolerance=0.2").code, 0);
}

TEST_F(Warnings, AreNotNeededWhereTheTimeStepIsChosen) {
  write(at("scene.toml"), bouncing());
  write(at("grains.csv"), "id,x,y,z,radius,vx,vy,vz\n42,0,0,0.0115,0.01,0,0,-2\n");
  const Outcome outcome = run("run scene.toml --out results --set time_step=auto --set time_step_max=1e-3");
  EXPECT_EQ(outcome.code, 0) << outcome.messages;
  const Table steps = read_table(at("results/steps.csv"));
  double time = 0, least = 1;
  for (std::size_t k = 0; k < steps.rows.size(); ++k) {
    time += steps.number(k, "time_step");
    least = std::min(least, steps.number(k, "time_step"));
    EXPECT_NEAR(steps.number(k, "time"), time, 1e-12);
  }
  EXPECT_DOUBLE_EQ(steps.number(steps.rows.size() - 1, "time"), 0.02);
  EXPECT_LT(least, 5e-4);
  EXPECT_EQ(run("run results/scene.resolved.toml --out again").code, 0);
  EXPECT_EQ(summary(at("again")).at("digest"), summary(at("results")).at("digest"));
}

TEST_F(Warnings, SayWhatAChosenTimeStepLacks) {
  write(at("scene.toml"), bouncing());
  write(at("grains.csv"), "id,x,y,z,radius\n42,0,0,0.0115,0.01\n");
  const Outcome outcome = run("run scene.toml --dry-run --set time_step=auto");
  EXPECT_EQ(outcome.code, 2);
  EXPECT_NE(outcome.messages.find("time_step_max"), std::string::npos) << outcome.messages;
  EXPECT_EQ(run("run scene.toml --dry-run --set time_step_max=1e-3").code, 2)
      << "without auto it says nothing";
}

// Of clumps the balls count, and not the spheres that hold them: those of dumbbells overlap at each distance.
TEST_F(Warnings, OfClumpsAreOfBallsThatBeginDeepInsideOthers) {
  std::string text = with_bodies(column_scene);
  text.insert(text.find("[sample]") + 8, "\nshape = \"dumbbell\"");
  write(at("scene.toml"), text);
  int overlapping = 0, apart = 0;
  for (const double distance : {0.008, 0.011, 0.013, 0.016, 0.0195}) {
    write(at("grains.csv"), fmt::format("id,x,y,z,radius\n3,0,0,1,0.01\n4,0,0,{},0.01\n", 1 + distance));
    const Outcome outcome = run("run scene.toml --out out --force --steps 1");
    const Frame frame = io::read_frame(at("out/results.h5"), 0);
    ASSERT_EQ(frame.orientation.size(), 2U) << outcome.messages;
    double nearest = 1;
    for (const double a : {-0.5, 0.5})
      for (const double b : {-0.5, 0.5}) {
        const auto ball = [&](std::size_t k, double along) {
          const auto& q = frame.orientation[k];
          const Eigen::Quaterniond turn(q[0], q[1], q[2], q[3]);
          return Vec3(frame.x[k] + turn * Vec3(along * 0.01, 0, 0));
        };
        nearest = std::min(nearest, (ball(0, a) - ball(1, b)).norm());
      }
    const double depth = (0.01 - nearest) / 0.005;
    const auto says = [&](const std::string& text) {
      return outcome.messages.find(text) != std::string::npos;
    };
    const bool warned = says("of more than 10 % of the smaller radius");
    EXPECT_EQ(warned, depth > 0.1) << distance << ": " << depth << '\n' << outcome.messages;
    if (warned) {
      EXPECT_TRUE(says(fmt::format("the deepest of {:.0f} %", 100 * depth))) << outcome.messages;
    }
    ++(depth > 0.1 ? overlapping : apart);
  }
  EXPECT_GT(overlapping, 0);
  EXPECT_GT(apart, 0);
}

}  // namespace
}  // namespace talus
