/// `talus run` and `talus plan` as a user meets them: exit codes, messages, files.

#include <gtest/gtest.h>
#include <hdf5.h>

#include <algorithm>
#include <string>
#include <vector>

#include "tests/unit/io/results/output_helpers.hpp"
#include "tests/unit/replaced.hpp"
#include "tests/validation/commands/command_helpers.hpp"

namespace talus::command_test {
namespace {

using namespace test;

class Command : public CommandTest {
 protected:
  std::size_t entries() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_.path()), {}));
  }
  bool says(const Outcome& outcome, const std::string& words) const {
    return outcome.messages.find(words) != std::string::npos;
  }
};

// ---- bad input: exit code 2, nothing written

TEST_F(Command, WithoutWhatItNeedsSaysSoAndReturnsTwo) {
  for (const std::string arguments :
       {"", "run", "plan", "solve", "walk scene.toml", "run a.toml b.toml", "run a.toml --threads many",
        "run a.toml --step 3", "run a.toml --threads 999999999", "study error a.toml --threads 1,999999999",
        "replay a.h5 --threads 999999999", "solve a.hdf5 --tol -1"}) {
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.code, 2) << arguments;
    EXPECT_TRUE(says(outcome, "--help")) << arguments << ": " << outcome.messages;
    EXPECT_LT(outcome.messages.size(), 240U) << outcome.messages;
  }
  // A variable of a script that is not set.
  for (const std::string arguments : {"run scene.toml --out ''", "status ''", "solve p.hdf5 --csv ''",
                                      "replay t.h5 --out ''", "plan ''", "run scene.toml --set ''"}) {
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.code, 2) << arguments;
    EXPECT_TRUE(says(outcome, "the value is empty")) << arguments << ": " << outcome.messages;
  }
  EXPECT_TRUE(says(run("run scene.toml --steps 1e3"), "--steps = 1e3 is no number of the kind")) << "whole";
  EXPECT_TRUE(says(run("rnu scene.toml"), "'rnu' is no command of talus; did you mean 'run'?"));
  EXPECT_TRUE(says(run("study eror scene.toml"), "`talus study --help`"));
  EXPECT_TRUE(says(run("study error scene.toml --bad"), "`talus study error --help`"));
  EXPECT_EQ(entries(), 0U);
}

TEST_F(Command, HelpAndVersionAreNoErrors) {
  for (const std::string arguments :
       {"--help", "--version", "run --help", "plan --help", "solve --help", "scene-reference"}) {
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.code, 0) << arguments;
    EXPECT_FALSE(outcome.output.empty()) << arguments;
    EXPECT_TRUE(outcome.messages.empty()) << arguments << ": " << outcome.messages;
  }
}

TEST_F(Command, RefusesBadScenesWithFileLineAndWhatWasMeantAndWritesNothing) {
  struct Mistake {
    std::string right, wrong, meant;
  };
  const std::vector<Mistake> mistakes = {{"friction = 0.35", "frictoin = 0.35", "friction"},
                                         {"density = 2600", "density = \"heavy\"", "material.density"},
                                         {"radius_min = 0.008", "radius_min = -0.008", "must be > 0"},
                                         {"base = [0.12, 0.12]", "base = [0.12]", "sample.base"},
                                         {"drive = \"pressure\"", "drive = \"presure\"", "pressure"},
                                         {"wall = \"z+\"", "wall = \"lid\"", "lid"},
                                         {"end = { steps = 6 }", "end = {}", "end"},
                                         {"[[stage]]", "[[stage", "TOML"}};
  for (const Mistake& mistake : mistakes) {
    std::string text = pressed_box;
    const std::size_t place = text.find(mistake.right);
    text.replace(place, mistake.right.size(), mistake.wrong);
    const auto line = 1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(place), '\n');
    write(at("scene.toml"), text);
    for (const std::string command :
         {"run scene.toml --out results", "run scene.toml --dry-run", "plan scene.toml"}) {
      const Outcome outcome = run(command);
      EXPECT_EQ(outcome.code, 2) << mistake.wrong;
      EXPECT_TRUE(says(outcome, "scene.toml:" + std::to_string(line) + ":")) << line << outcome.messages;
      EXPECT_TRUE(says(outcome, mistake.meant)) << mistake.wrong << ": " << outcome.messages;
      EXPECT_EQ(std::count(outcome.messages.begin(), outcome.messages.end(), '\n'), 1) << outcome.messages;
      EXPECT_TRUE(outcome.output.empty()) << outcome.output;
      EXPECT_EQ(entries(), 1U) << mistake.wrong;
    }
  }
}

// What only the grains tell: walls that cross, a file of bodies that is missing or damaged.
TEST_F(Command, RefusesSamplesThatDoNotFitAndWritesNothing) {
  const auto refuses = [&](const std::string& arguments, const std::string& word) {
    const std::size_t before = entries();
    const Outcome outcome = run("run scene.toml --out results " + arguments);
    EXPECT_EQ(outcome.code, 2) << outcome.messages;
    EXPECT_TRUE(says(outcome, word)) << outcome.messages;
    EXPECT_EQ(entries(), before);
  };
  write(at("scene.toml"), pressed_box);
  refuses("--set wall.z+.position=-1", "z+");
  refuses("--set 'sample.base=[0.01, 0.01]'", "0.01");
  write(at("scene.toml"), with_bodies(pressed_box));
  refuses("", "grains.csv");
  write(at("grains.csv"), "id,x,y,z,radius\n0,0,0,0,0.01\n1,0,0,0.02,many\n");
  refuses("", "grains.csv:3:");
}

TEST_F(Command, RefusesMissingScenesAndBadOverridesAndWritesNothing) {
  write(at("scene.toml"), pressed_box);
  const std::vector<std::pair<std::string, std::string>> mistakes = {
      {"run none.toml", "none.toml: cannot open the scene: No such file"},
      {"run .", "directory"},
      {"run scene.toml --set solver.tolerence=1e-4", "tolerance"},
      {"run scene.toml --set solver.tolerance=small", "--set solver.tolerance=small"},
      {"run scene.toml --set stage.sheer.friction=1", "stage.sheer"},
      {"run scene.toml --set seed", "--set seed"},
      {"run scene.toml --steps 0", "--steps"},
      {"run scene.toml --threads 0", "--threads"},
      {"run scene.toml --threads -1", "--threads"}};
  for (const auto& [arguments, word] : mistakes) {
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.code, 2) << arguments;
    EXPECT_TRUE(says(outcome, word)) << arguments << ": " << outcome.messages;
    EXPECT_EQ(entries(), 1U) << arguments;
  }
}

// ---- the directory of the results

TEST_F(Command, LeavesAnExistingDirectoryAloneUnlessForced) {
  write(at("scene.toml"), column_scene);
  ASSERT_EQ(run("run scene.toml --out results").code, 0);
  write(at("results/notes.txt"), "mine");
  const auto before = files_below(at("results"));
  const Outcome refused = run("run scene.toml --out results --steps 1");
  EXPECT_EQ(refused.code, 2);
  EXPECT_TRUE(says(refused, "--force")) << refused.messages;
  EXPECT_EQ(files_below(at("results")), before);

  EXPECT_EQ(run("run scene.toml --out results --steps 1 --force").code, 0);
  EXPECT_EQ(summary(at("results")).at("steps"), 1);
  EXPECT_EQ(read_table(at("results/steps.csv")).rows.size(), 1U);
  EXPECT_EQ(content(at("results/notes.txt")), "mine");
}

TEST_F(Command, ReplacesNothingForASceneItCannotRun) {
  write(at("scene.toml"), column_scene);
  ASSERT_EQ(run("run scene.toml --out results").code, 0);
  const auto before = files_below(at("results"));
  EXPECT_EQ(run("run scene.toml --out results --force --set seeed=2").code, 2);
  EXPECT_EQ(files_below(at("results")), before);
}

// What a step could not go on from is seen before anything is removed.
TEST_F(Command, KeepsEarlierResultsWhenABodyHasNoMass) {
  write(at("scene.toml"), column_scene);
  ASSERT_EQ(run("run scene.toml --out results").code, 0);
  const auto before = files_below(at("results"));
  write(at("scene.toml"), with_bodies(column_scene));
  const std::vector<std::pair<std::string, std::string>> mistakes = {
      {"radius\n0,0,0,1,0.01\n7,0,0,2,1e-120\n", "1e-120"},
      {"radius\n0,0,0,1,0.01\n7,0,0,0,1e120\n", "must be within 1e+15, got 1e120"},
      {"radius,vx,vy,vz,wx,wy,wz\n7,0,0,0,1e10,0,0,0,1e14,0,0\n", "angular velocity"}};
  for (const auto& [rows, word] : mistakes) {
    write(at("grains.csv"), "id,x,y,z," + rows);
    const Outcome outcome = run("run scene.toml --out results --force");
    EXPECT_EQ(outcome.code, 2) << outcome.messages;
    EXPECT_TRUE(says(outcome, "grains.csv: body 7: ") || says(outcome, "grains.csv:3: ")) << outcome.messages;
    EXPECT_TRUE(says(outcome, word)) << outcome.messages;
    EXPECT_EQ(files_below(at("results")), before);
  }
}

TEST_F(Command, NamesADirectoryItCannotWriteTo) {
  write(at("scene.toml"), column_scene);
  write(at("file"), "not a directory");
  for (const std::string place : {"file", "file/below", "/proc/talus"}) {
    const Outcome outcome = run("run scene.toml --out " + place);
    EXPECT_EQ(outcome.code, 2) << place;
    EXPECT_TRUE(says(outcome, place)) << outcome.messages;
  }
}

// No file may grow beyond 4 kB, 32 kB: what a full disk looks like at the start and in the middle.
TEST_F(Command, EndsWithOneAndTheNameOfTheFileWhenTheDiskIsFull) {
  write(at("scene.toml"), pressed_box);
  const std::map<std::string, std::string> first_to_fail{{"8", "columns.json"}, {"64", "results.h5"}};
  for (const auto& [blocks, file] : first_to_fail) {
    const Outcome outcome = run("run scene.toml --out results --force", "ulimit -f " + blocks + ";");
    EXPECT_EQ(outcome.code, 1) << outcome.messages;
    EXPECT_TRUE(says(outcome, "error: ")) << outcome.messages;
    EXPECT_TRUE(says(outcome, "results/" + file)) << outcome.messages;
  }
  EXPECT_EQ(summary(at("results")).at("status"), "failed");
  EXPECT_EQ(summary(at("results")).at("exit_code"), 1);
}

TEST_F(Command, WritesToTheSceneDirectoryUnlessToldOtherwise) {
  write(at("scene.toml"), column_scene);
  EXPECT_EQ(run("run scene.toml --steps 1").code, 0);
  EXPECT_TRUE(fs::exists(at("out/column/run.json")));
  EXPECT_EQ(run("run scene.toml --steps 1 --set output.directory=elsewhere").code, 0);
  EXPECT_TRUE(fs::exists(at("elsewhere/run.json")));
}

// ---- what a run leaves behind

TEST_F(Command, WritesEveryFileOfItsPageAndTheyRead) {
  write(at("scene.toml"), pressed_box);
  const Outcome outcome = run("run scene.toml --out results");
  ASSERT_EQ(outcome.code, 0) << outcome.messages;
  EXPECT_TRUE(outcome.output.empty()) << outcome.output;

  const Table steps = read_table(at("results/steps.csv"));
  EXPECT_EQ(steps.header,
            "step,time,time_step,candidates,contacts,active,iterations,error_rms,error_max,error_quantile,"
            "worst_contact_body,worst_contact_with,worst_body,worst_body_error,balance,velocity_error,jump,"
            "penetration_mean,penetration_max,overlap,overlap_body,overlap_with,kinetic_translation,"
            "kinetic_rotation,solid_fraction,equilibrium,migrants,imbalance,wall_s,converged");
  ASSERT_EQ(steps.rows.size(), 12U);
  for (std::size_t k = 0; k < 12; ++k) {
    EXPECT_EQ(steps.number(k, "step"), static_cast<double>(k + 1));
    EXPECT_NEAR(steps.number(k, "time"), 1e-3 * static_cast<double>(k + 1), 1e-12);
    EXPECT_GE(steps.number(k, "candidates"), steps.number(k, "contacts"));
    EXPECT_GE(steps.number(k, "contacts"), steps.number(k, "active"));
    EXPECT_LE(steps.number(k, "error_rms"), 1e-2);
    EXPECT_EQ(steps.rows[k].at("converged"), "1");
  }
  const Table walls = read_table(at("results/walls.csv"));
  EXPECT_EQ(walls.header,
            "step,time,wall,position,velocity,force_x,force_y,force_z,torque_x,torque_y,torque_z,work");
  EXPECT_EQ(walls.rows.size(), 12U * 6U);
  const Table triaxial = read_table(at("results/triaxial.csv"));
  ASSERT_EQ(triaxial.rows.size(), 12U);
  EXPECT_EQ(triaxial.rows[5].at("stage"), "press");
  EXPECT_EQ(triaxial.rows[6].at("stage"), "shear");

  // Steps 0, 4, 6 (end of a stage), 8, 12.
  const auto sums = summary(at("results"));
  EXPECT_EQ(sums.at("status"), "done");
  EXPECT_EQ(sums.at("exit_code"), 0);
  EXPECT_EQ(sums.at("steps"), 12);
  EXPECT_EQ(sums.at("frames"), 5);
  EXPECT_EQ(sums.at("bodies"), 400);
  EXPECT_EQ(sums.at("digest").get<std::string>().size(), 16U);
  EXPECT_TRUE(says(outcome, sums.at("digest").get<std::string>())) << outcome.messages;
  const auto provenance = nlohmann::json::parse(content(at("results/run.json"))).at("provenance");
  for (const char* key : {"git_hash", "compiler", "flags", "host", "cores_online", "threads", "seed"})
    EXPECT_TRUE(provenance.contains(key)) << key;

  EXPECT_GT(H5Fis_hdf5(at("results/results.h5").c_str()), 0);
  for (const char* name :
       {"fields.pvd", "fields/grains.pvd", "fields/forces.pvd", "triaxial.svg", "forces.svg"})
    EXPECT_GT(fs::file_size(at("results") / name), 100U) << name;
  for (int frame = 0; frame < 5; ++frame)
    for (const std::string kind : {"grains", "forces"})
      EXPECT_TRUE(fs::exists(at("results/fields/" + kind + "_00000" + std::to_string(frame) + ".vtp")));
  for (const auto& [name, text] : files_below(at("results"))) EXPECT_FALSE(name.ends_with(".part")) << name;
}

TEST_F(Command, StopsAfterSoManyStepsAndTakesOverrides) {
  write(at("scene.toml"), pressed_box);
  EXPECT_EQ(run("run scene.toml --out results --steps 3 --set seed=7 --set stage.press.time_step=2e-3 "
                "--set output.fields=false --set output.pictures=false")
                .code,
            0);
  const Table steps = read_table(at("results/steps.csv"));
  ASSERT_EQ(steps.rows.size(), 3U);
  EXPECT_NEAR(steps.number(2, "time"), 6e-3, 1e-12);
  EXPECT_EQ(nlohmann::json::parse(content(at("results/run.json"))).at("provenance").at("seed"), 7);
  EXPECT_FALSE(fs::exists(at("results/fields.pvd")));
  EXPECT_FALSE(fs::exists(at("results/forces.svg")));
}

TEST_F(Command, SaysWhatAStepOptionAskedForAndDidNotGet) {
  write(at("scene.toml"), column_scene);
  const Outcome late =
      run("run scene.toml --out results --error-history 2,50 --trace --trace-steps 90:99 --steps 3");
  EXPECT_EQ(late.code, 0) << late.messages;
  EXPECT_TRUE(says(late, "--error-history 2,50: the run ended after step 3")) << late.messages;
  EXPECT_TRUE(says(late, "--trace-steps 90:99: the run ended after step 3")) << late.messages;
  EXPECT_EQ(summary(at("results")).at("message"), "stopped after 3 steps by --steps; the scene has more");

  const Outcome all =
      run("run scene.toml --force --out results --error-history 1:3 --dump-fclib 4 --steps 4");
  EXPECT_EQ(all.code, 0) << all.messages;
  EXPECT_FALSE(says(all, "the run ended after")) << all.messages;
  EXPECT_EQ(summary(at("results")).at("message"), "");

  // Nor can a dump say what couples all contacts of a cell under a stress.
  write(at("cell.toml"), replaced(cell_scene, "[[stage]]", "[[stage]]\nstress = { zz = 1e3 }"));
  const Outcome cell = run("run cell.toml --force --out results --dump-fclib 1");
  EXPECT_EQ(cell.code, 2) << cell.messages;
  EXPECT_TRUE(says(cell, "the cell follows a stress")) << cell.messages;

  // A file that was asked for and is not there: whoever waits for it must hear of it.
  const Outcome none = run("run scene.toml --force --out results --dump-fclib 4 --dump-fclib 20");
  EXPECT_EQ(none.code, 1) << none.messages;
  EXPECT_TRUE(says(none, "no dump of step 20: the run ended after step 4")) << none.messages;
  EXPECT_TRUE(fs::exists(at("results/fclib_000004.hdf5")));
  EXPECT_EQ(summary(at("results")).at("status"), "done");
  EXPECT_EQ(summary(at("results")).at("exit_code"), 1);
}

/// A run of the scene with other ends of its stage 'rest' and of a stage 'then' behind it.
class StageEnds : public Command {
 protected:
  Outcome of(std::string scene, const std::string& first, const std::string& then) {
    scene.replace(scene.find("steps = 4"), 9, first);
    write(at("scene.toml"), scene + "\n[[stage]]\nname = \"then\"\nend = { " + then + " }\n");
    const Outcome outcome = run("run scene.toml --out results");
    EXPECT_EQ(outcome.code, 0) << outcome.messages;
    return outcome;
  }
};

TEST_F(StageEnds, AreSaidWithHowFarFromRest) {
  const Outcome outcome = of(column_scene, "steps = 2, equilibrium = 1e-12",
                             "steps = 50, equilibrium = 0.1, equilibrium_hold = 0");
  EXPECT_TRUE(says(outcome, "stage 'rest' ended after 2 steps: steps reached, equilibrium "))
      << outcome.messages;
  EXPECT_TRUE(says(outcome, "(asked 1e-12)")) << outcome.messages;
  EXPECT_TRUE(says(outcome, "stage 'then' ended after 1 step: equilibrium reached")) << outcome.messages;
  const Table steps = read_table(at("results/steps.csv"));
  double worst = 0;
  for (std::size_t k = 0; k < steps.rows.size(); ++k)
    worst = std::max(worst, steps.number(k, "penetration_max"));
  EXPECT_GT(worst, 0);
  EXPECT_EQ(summary(at("results")).at("worst_penetration").get<double>(), worst);
}

// A floor and a lid make no box, but they bound the sample: the lid rises by a sixtieth of its height a step.
TEST_F(StageEnds, MayBeAStrainOrATime) {
  std::string lidded = column_scene;
  lidded.insert(lidded.find("[[stage]]"),
                "[[wall]]\nname = \"lid\"\nside = \"z+\"\ndrive = \"velocity\"\nvelocity = [0, 0, 1]\n\n");
  const Outcome outcome = of(lidded, "strain = 0.02, time = 1", "steps = 50, time = 2e-3");
  EXPECT_TRUE(says(outcome, "stage 'rest' ended after 2 steps: strain reached\n")) << outcome.messages;
  EXPECT_TRUE(says(outcome, "stage 'then' ended after 2 steps: time reached\n")) << outcome.messages;
}

TEST_F(Command, WarnsOfGrainsThatBeginDeepInsideOthersOrWalls) {
  std::string text = with_bodies(column_scene);
  text.replace(text.find("side = \"z-\""), 11, "side = \"z-\"\nposition = 0");
  write(at("scene.toml"), text);
  write(at("grains.csv"), "id,x,y,z,radius\n3,0,0,0.01,0.01\n4,0,0,0.0292,0.01\n9,1,0,0.008,0.01\n");
  const Outcome wall = run("run scene.toml --dry-run");
  EXPECT_EQ(wall.code, 0);
  EXPECT_TRUE(says(wall,
                   "1 overlap of more than 10 % of the smaller radius, the deepest of 20 % between grain 9 "
                   "and wall 'floor'"))
      << wall.messages;
  EXPECT_TRUE(says(wall, "solver.overlap_correction")) << wall.messages;
  write(at("grains.csv"), "id,x,y,z,radius\n3,0,0,0.01,0.01\n4,0,0,0.025,0.01\n9,1,0,0.008,0.01\n");
  EXPECT_TRUE(says(run("run scene.toml --dry-run"), "2 overlaps")) << "and the worst is that of two grains";
  EXPECT_TRUE(says(run("run scene.toml --dry-run"), "50 % between grains 3 and 4"));
  write(at("grains.csv"), "id,x,y,z,radius\n3,0,0,0.0095,0.01\n4,0,0,0.0287,0.01\n");
  EXPECT_FALSE(says(run("run scene.toml --dry-run"), "overlap"));
}

TEST_F(Command, DryRunPrintsTheResolvedSceneAndWritesNothing) {
  write(at("scene.toml"), pressed_box);
  const Outcome dry = run("run scene.toml --dry-run --set seed=5 --out results");
  EXPECT_EQ(dry.code, 0);
  EXPECT_NE(dry.output.find("seed = 5"), std::string::npos);
  EXPECT_EQ(entries(), 1U);
  ASSERT_EQ(run("run scene.toml --set seed=5 --out results --steps 1").code, 0);
  EXPECT_EQ(content(at("results/scene.resolved.toml")), dry.output);
}

TEST_F(Command, GivesTheSameBitsOnAnyNumberOfThreadsAndFromTheResolvedScene) {
  write(at("scene.toml"), pressed_box);
  ASSERT_EQ(run("run scene.toml --out one --threads 1").code, 0);
  const std::string digest = summary(at("one")).at("digest");
  for (const std::string threads : {"2", "3", "4", "8"}) {
    ASSERT_EQ(run("run scene.toml --force --out many --threads " + threads).code, 0);
    EXPECT_EQ(summary(at("many")).at("digest"), digest) << threads << " threads";
    EXPECT_EQ(content(at("many/walls.csv")), content(at("one/walls.csv"))) << threads << " threads";
  }
  ASSERT_EQ(run("run one/scene.resolved.toml --out again").code, 0);
  EXPECT_EQ(summary(at("again")).at("digest"), digest);
  const std::string resolved = content(at("one/scene.resolved.toml"));
  EXPECT_NE(run("run one/scene.resolved.toml --out one --force --set seed=2").code, 0) << "it is still read";
  EXPECT_EQ(content(at("one/scene.resolved.toml")), resolved);
  ASSERT_EQ(run("run scene.toml --out other --set seed=2").code, 0);
  EXPECT_NE(summary(at("other")).at("digest"), digest);
}

}  // namespace
}  // namespace talus::command_test
