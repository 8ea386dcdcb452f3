/// What `--resume` refuses, and that it then leaves all as it was.

#include <gtest/gtest.h>

#include <string>
#include <utility>

#include "io/checkpoint/checkpoint_folder.hpp"
#include "tests/unit/io/results/output_helpers.hpp"
#include "tests/unit/replaced.hpp"
#include "tests/validation/commands/command_helpers.hpp"

namespace talus::resume_refusals_test {
namespace {

using namespace test;

class ResumeRefusals : public CommandTest {
 protected:
  void SetUp() override { write(at("scene.toml"), pressed_box); }
  std::size_t checkpoints(const std::string& directory) const {
    return io::checkpoints_in(at(directory)).size();
  }
  /// Writes a scene of a grain that falls for three steps, and the file that has the grain.
  void write_fall() const {
    const std::string kind = "[sample]\nkind = \"bodies\"\nfile = \"grains.csv\"\n";
    write(at("fall.toml"), "time_step = 1e-4\n[material]\ndensity = 2600\n" + kind +
                               "[[stage]]\nname = \"fall\"\ngravity = [0, 0, -9.81]\nfriction = 0\n"
                               "end = { steps = 3 }\n[output]\npictures = false\n");
    write(at("grains.csv"), "id,x,y,z,radius\n1,0,0,0,0.01\n");
  }
  void move_grain() const { write(at("grains.csv"), "id,x,y,z,radius\n1,0,0,1,0.01\n"); }
};

TEST_F(ResumeRefusals, IsRefusedForAnotherScene) {
  ASSERT_EQ(run("run scene.toml --out parts --resume --steps 3 --threads 1").code, 0);
  const auto before = files_below(at("parts"));
  const Outcome other =
      run("run scene.toml --out parts --resume --set stage.shear.friction=0.5 --set solver.tolerance=0.5");
  EXPECT_EQ(other.code, 2);
  EXPECT_NE(other.messages.find("stage.shear.friction was 0.35 and is 0.5"), std::string::npos)
      << other.messages;
  EXPECT_NE(other.messages.find("solver.tolerance was 0.01 and is 0.5"), std::string::npos) << other.messages;
  EXPECT_EQ(files_below(at("parts")), before) << "nothing was written";
  const Outcome loads =
      run("run scene.toml --out parts --resume --threads 1 --set wall.z+.pressure=1.2e4 "
          "--set output.xyz=true --set stage.shear.end.steps=3");
  EXPECT_EQ(loads.code, 0) << loads.messages;
  EXPECT_EQ(run("run scene.toml --out parts --resume --force").code, 2);
}

/// A short run takes no checkpoint by itself, so that its results are all that tells of its scene.
TEST_F(ResumeRefusals, OfADoneRunWithoutCheckpointIsRefusedForAnotherScene) {
  ASSERT_EQ(run("run scene.toml --out out --threads 1").code, 0);
  ASSERT_EQ(checkpoints("out"), 0U);
  const auto before = files_below(at("out"));
  for (const char* change : {"wall.x+.position=0.2", "seed=2", "stage.shear.end.steps=9"}) {
    const Outcome other = run(std::string("run scene.toml --out out --threads 1 --resume --set ") + change);
    EXPECT_EQ(other.code, 2) << change << other.messages;
    const std::string key = std::string(change).substr(0, std::string(change).find('='));
    EXPECT_NE(other.messages.find(key + " was "), std::string::npos) << other.messages;
  }
  const Outcome same = run("run scene.toml --out out --threads 1 --resume");
  EXPECT_EQ(same.code, 0) << same.messages;
  EXPECT_NE(same.messages.find("is done"), std::string::npos) << same.messages;
  EXPECT_EQ(files_below(at("out")), before);
}

TEST_F(ResumeRefusals, OfADoneRunWithoutCheckpointIsRefusedForAnotherInputFile) {
  write_fall();
  const std::string line = "run fall.toml --out out --threads 1 --resume";
  ASSERT_EQ(run("run fall.toml --out out --threads 1").code, 0);
  ASSERT_EQ(checkpoints("out"), 0U);
  const auto before = files_below(at("out"));
  EXPECT_EQ(run(line).code, 0);
  move_grain();
  const Outcome other = run(line);
  EXPECT_EQ(other.code, 2) << other.messages;
  EXPECT_NE(other.messages.find("grains.csv has changed"), std::string::npos) << other.messages;
  EXPECT_EQ(files_below(at("out")), before);
}

/// It was killed before its first checkpoint: the same scene begins anew there, another one does not.
TEST_F(ResumeRefusals, OfAStoppedRunWithoutCheckpointIsRefusedForAnotherScene) {
  ASSERT_EQ(run("run scene.toml --out out --threads 1 --steps 2").code, 0);
  const auto before = files_below(at("out"));
  const Outcome other = run("run scene.toml --out out --threads 1 --resume --set stage.shear.friction=0.5");
  EXPECT_EQ(other.code, 2) << other.messages;
  EXPECT_NE(other.messages.find("stage.shear.friction was 0.35 and is 0.5"), std::string::npos)
      << other.messages;
  EXPECT_EQ(files_below(at("out")), before);
  EXPECT_EQ(run("run scene.toml --out out --threads 1 --resume --set output.xyz=true").code, 0);
}

TEST_F(ResumeRefusals, DoesNotReplaceResultsOfWhichNobodyKnowsTheScene) {
  fs::create_directory(at("out"));
  write(at("out/steps.csv"), "of another program\n");
  const Outcome refused = run("run scene.toml --out out --threads 1 --resume");
  EXPECT_EQ(refused.code, 2) << refused.messages;
  EXPECT_NE(refused.messages.find("steps.csv"), std::string::npos) << refused.messages;
  EXPECT_EQ(content(at("out/steps.csv")), "of another program\n");
  EXPECT_EQ(files_below(at("out")).size(), 1U) << "nothing was written";
  EXPECT_EQ(run("run scene.toml --out out --threads 1 --force").code, 0);
}

/// The end of a run that goes on is that of one that was never stopped: not with the lines of others in it.
TEST_F(ResumeRefusals, DoesNotGoOnInFilesThatAreNotItsOwn) {
  const std::string line = "run scene.toml --out parts --threads 1 --resume";
  ASSERT_EQ(run(line + " --steps 3").code, 0);
  const std::string steps = content(at("parts/steps.csv"));
  const std::string last_line = steps.substr(steps.rfind('\n', steps.size() - 2) + 1);
  for (const std::string& changed :
       {replaced(steps, "\n1,", "\n7,"), steps.substr(0, steps.size() - last_line.size()), last_line}) {
    write(at("parts/steps.csv"), changed);
    const auto before = files_below(at("parts"));
    const Outcome refused = run(line);
    EXPECT_EQ(refused.code, 2) << refused.messages;
    EXPECT_NE(refused.messages.find("steps.csv"), std::string::npos) << refused.messages;
    EXPECT_EQ(files_below(at("parts")), before);
  }
  fs::remove(at("parts/steps.csv"));
  const Outcome gone = run(line);
  EXPECT_EQ(gone.code, 2);
  EXPECT_NE(gone.messages.find("there is none"), std::string::npos) << gone.messages;
  EXPECT_FALSE(fs::exists(at("parts/steps.csv")));
  // What follows the checkpoint is cut off, whatever it is.
  write(at("parts/steps.csv"), steps + last_line + "half a li");
  EXPECT_EQ(run(line).code, 0);
  ASSERT_EQ(run("run scene.toml --out straight --threads 1").code, 0);
  EXPECT_EQ(content(at("parts/walls.csv")), content(at("straight/walls.csv")));
}

TEST_F(ResumeRefusals, WithoutACheckpointIsRefusedWhereNothingCanBeReadOfTheRun) {
  for (const auto& [name, content] :
       {std::pair{"run.json", "null"}, {"scene.resolved.toml", "box = "}, {"scene.resolved.toml", ""}}) {
    ASSERT_EQ(run("run scene.toml --out out --threads 1 --steps 2 --force").code, 0);
    write(at("out") / name, content);
    const auto before = files_below(at("out"));
    const Outcome refused = run("run scene.toml --out out --threads 1 --resume");
    EXPECT_EQ(refused.code, 2) << name << refused.messages;
    EXPECT_NE(refused.messages.find(name), std::string::npos) << refused.messages;
    EXPECT_EQ(files_below(at("out")), before);
  }
}

TEST_F(ResumeRefusals, IsRefusedForAnotherOrderOfStages) {
  ASSERT_EQ(run("run scene.toml --out out --threads 1 --resume --steps 3").code, 0);
  const std::string press = "[[stage]]\nname = \"press\"\nfriction = 0\nend = { steps = 6 }\n";
  write(at("scene.toml"), replaced(pressed_box, press, "") + "\n" + press);
  const Outcome other = run("run scene.toml --out out --threads 1 --resume");
  EXPECT_EQ(other.code, 2);
  EXPECT_NE(other.messages.find("order of stage was press, shear and is shear, press"), std::string::npos)
      << other.messages;
  write(at("scene.toml"), pressed_box);
  EXPECT_EQ(run("run scene.toml --out out --threads 1 --resume").code, 0);
}

TEST_F(ResumeRefusals, OfAnInputFileThatIsNotTheOneInTheCheckpoint) {
  write_fall();
  const std::string line = "run fall.toml --out out --threads 1 --resume";
  ASSERT_EQ(run(line + " --steps 2").code, 0);
  ASSERT_GT(checkpoints("out"), 0U);
  move_grain();
  const auto before = files_below(at("out"));
  const Outcome other = run(line);
  EXPECT_EQ(other.code, 2) << other.messages;
  EXPECT_NE(other.messages.find("grains.csv has changed"), std::string::npos) << other.messages;
  EXPECT_EQ(files_below(at("out")), before);
}

TEST_F(ResumeRefusals, IsNoneOfAnInputFileThatHasOnlyMoved) {
  write_fall();
  ASSERT_EQ(run("run fall.toml --out out --threads 1 --resume --steps 2").code, 0);
  ASSERT_GT(checkpoints("out"), 0U);
  fs::create_directory(at("elsewhere"));
  for (const char* name : {"fall.toml", "grains.csv"})
    fs::rename(at(name), at(std::string("elsewhere/") + name));
  const std::string line = "run elsewhere/fall.toml --out out --threads 1 --resume";
  write(at("elsewhere/other.csv"), "id,x,y,z,radius\n1,0,0,1,0.01\n");
  const Outcome other = run(line + " --set sample.file=elsewhere/other.csv");
  EXPECT_EQ(other.code, 2) << other.messages;
  const Outcome same = run(line);
  EXPECT_EQ(same.code, 0) << same.messages;
  EXPECT_NE(same.messages.find("step 3"), std::string::npos) << same.messages;
}

/// A run that ended before its scene was written has no results yet, whatever it has begun to write.
TEST_F(ResumeRefusals, AreNoneBesideALogAndASceneHalfWritten) {
  fs::create_directory(at("out"));
  write(at("out/run.log"), "talus: a word\n");
  write(at("out/scene.resolved.toml.part"), "time_st");
  EXPECT_EQ(run("run scene.toml --out out --threads 1 --resume").code, 0);
  fs::remove_all(at("out"));
  fs::create_directory(at("out"));
  write(at("out/steps.csv.part"), "of another program\n");
  EXPECT_EQ(run("run scene.toml --out out --threads 1 --resume").code, 2);
  EXPECT_EQ(files_below(at("out")).size(), 1U);
}

/// A run that goes on writes into its scene how many subdomains it had, which the user's scene leaves open.
TEST_F(ResumeRefusals, AreNoneForTheNumberOfSubdomainsThatARunHasChosen) {
  const std::string line = "run scene.toml --out out --threads 1 --resume";
  ASSERT_EQ(run(line + " --steps 3").code, 0);
  ASSERT_EQ(run(line).code, 0);
  for (const fs::path& path : io::checkpoints_in(at("out"))) fs::remove(path);
  const Outcome again = run(line);
  EXPECT_EQ(again.code, 0) << again.messages;
  EXPECT_NE(again.messages.find("is done"), std::string::npos) << again.messages;
}

TEST_F(ResumeRefusals, OfStatesThatAreMissingOrDamaged) {
  const std::string line = "run scene.toml --out out --threads 1 --resume";
  ASSERT_EQ(run(line + " --steps 5").code, 0);
  const std::string whole = content(at("out/results.h5"));
  const auto refused = [&](const char* what) {
    const auto before = files_below(at("out"));
    const Outcome outcome = run(line);
    EXPECT_EQ(outcome.code, 2) << what << outcome.messages;
    EXPECT_NE(outcome.messages.find("results.h5"), std::string::npos) << what << outcome.messages;
    EXPECT_TRUE(files_below(at("out")) == before) << what;
  };
  fs::remove(at("out/results.h5"));
  refused("missing");
  write(at("out/results.h5"), whole.substr(0, whole.size() / 2));
  refused("cut off");
  // The names in a group stand behind SNOD: those of a frame, of its bodies, its contacts and its walls.
  int groups = 0;
  for (std::size_t found = whole.find("SNOD"); found != std::string::npos;
       found = whole.find("SNOD", found + 1)) {
    write(at("out/results.h5"), std::string(whole).replace(found, 4, "snod"));
    refused("damaged");
    ++groups;
  }
  EXPECT_GE(groups, 6);
  write(at("out/results.h5"), whole);
  EXPECT_EQ(run(line).code, 0);
}

TEST_F(ResumeRefusals, AreNoneOfStepsThatAreDoneAndMakeNoMore) {
  const std::string line = "run scene.toml --out out --threads 1 --resume --steps ";
  ASSERT_EQ(run(line + "5").code, 0);
  const auto before = files_below(at("out"));
  for (const char* steps : {"5", "2"}) {
    const Outcome again = run(line + steps);
    EXPECT_EQ(again.code, 0) << again.messages;
    EXPECT_NE(again.messages.find("has made 5 steps, and --steps"), std::string::npos) << again.messages;
    EXPECT_EQ(files_below(at("out")), before) << steps;
  }
  // Of a run that was killed behind its last checkpoint the end is written, without a step.
  const std::string whole = content(at("out/run.json"));
  ASSERT_NE(whole.find("\"status\": \"done\""), std::string::npos);
  write(at("out/run.json"), replaced(whole, "\"status\": \"done\"", "\"status\": \"running\""));
  EXPECT_EQ(run(line + "5").code, 0);
  EXPECT_NE(content(at("out/run.json")).find("\"status\": \"done\""), std::string::npos);
  for (const char* name : {"steps.csv", "walls.csv"})
    EXPECT_EQ(content(at("out") / name), before.at(name)) << name;
}

TEST_F(ResumeRefusals, OfARunThatIsDoneGiveItThePageThatItLacks) {
  const std::string line = "run scene.toml --out out --threads 1 --resume";
  ASSERT_EQ(run(line).code, 0);
  fs::remove(at("out/report.html"));
  EXPECT_EQ(run(line).code, 0);
  EXPECT_TRUE(fs::exists(at("out/report.html")));
}

TEST_F(ResumeRefusals, AreNoneOfADoneRunWhoseFramesAreLostButItAndItsPageSaySo) {
  const std::string line = "run scene.toml --out out --threads 1 --resume";
  ASSERT_EQ(run(line).code, 0);
  EXPECT_EQ(run(line).messages.find("results.h5"), std::string::npos);
  fs::resize_file(at("out/results.h5"), 3000);
  const Outcome cut = run(line);
  EXPECT_EQ(cut.code, 0);
  EXPECT_NE(cut.messages.find("out/results.h5: opening as HDF5 failed"), std::string::npos) << cut.messages;
  EXPECT_EQ(run("report out").code, 0);
  EXPECT_NE(content(at("out/report.html")).find("No picture: "), std::string::npos);
  fs::remove(at("out/results.h5"));
  EXPECT_NE(run(line).messages.find("out/results.h5: is missing"), std::string::npos);
}

TEST_F(ResumeRefusals, OfCheckpointsThatAreAllDamaged) {
  const std::string line = "run scene.toml --out out --threads 1 --resume";
  ASSERT_EQ(run(line + " --steps 3").code, 0);
  for (const fs::path& path : io::checkpoints_in(at("out"))) write(path, "no checkpoint");
  const auto before = files_below(at("out"));
  const Outcome refused = run(line);
  EXPECT_EQ(refused.code, 2) << refused.messages;
  EXPECT_NE(refused.messages.find("can be gone on from"), std::string::npos) << refused.messages;
  EXPECT_EQ(files_below(at("out")), before);
}

}  // namespace
}  // namespace talus::resume_refusals_test
