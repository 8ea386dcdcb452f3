// Scenes to start from, and what shells and `man` know of the command.

#include <gtest/gtest.h>

#include "tests/validation/commands/command_helpers.hpp"

namespace talus::new_command_test {
namespace {

using namespace talus::test;

class NewScene : public testing::TestWithParam<const char*> {};

TEST_P(NewScene, IsSoundAndRuns) {
  const ScratchDirectory scratch;
  const Outcome made = run(scratch.path(), std::string("new first --kind ") + GetParam());
  ASSERT_EQ(made.code, 0) << made.messages;
  const Outcome checked = run(scratch.path(), "run first.toml --dry-run");
  EXPECT_EQ(checked.code, 0) << checked.messages;
  EXPECT_EQ(checked.messages.find("warning"), std::string::npos) << checked.messages;
  const Outcome ran = run(scratch.path(), "run first.toml --out out --steps 20 --threads 1 --quiet");
  EXPECT_EQ(ran.code, 0) << ran.messages;
  EXPECT_NE(content(scratch / "out/report.html").find("20 steps"), std::string::npos)
      << "every run has its page";
}

INSTANTIATE_TEST_SUITE_P(Kinds, NewScene, testing::Values("triaxial", "silo", "drum", "heap", "periodic"),
                         [](const auto& kind) { return std::string(kind.param); });

TEST(NewCommand, ReplacesNothingUnaskedAndRefusesWhatNoSceneCanBe) {
  const ScratchDirectory scratch;
  write(scratch / "mine.toml", "mine");
  EXPECT_EQ(run(scratch.path(), "new mine --kind silo").code, 2);
  EXPECT_EQ(content(scratch / "mine.toml"), "mine");
  EXPECT_EQ(run(scratch.path(), "new mine --kind silo --force").code, 0) << "as the refusal says";
  EXPECT_NE(content(scratch / "mine.toml"), "mine");
  const Outcome unknown = run(scratch.path(), "new other --kind volcano");
  EXPECT_EQ(unknown.code, 2);
  EXPECT_NE(unknown.messages.find("triaxial, silo, drum, heap, periodic"), std::string::npos)
      << unknown.messages;
  EXPECT_EQ(run(scratch.path(), "new 'a b' --kind silo").code, 2)
      << "a name with a space is that of no scene";
  EXPECT_NE(run(scratch.path(), "new " + std::string(300, 'x') + " --kind silo").messages.find("at most 100"),
            std::string::npos);
  EXPECT_NE(run(scratch.path(), "new heap.toml --kind heap").messages.find("leave .toml out"),
            std::string::npos);
  EXPECT_FALSE(fs::exists(scratch / "other.toml") || fs::exists(scratch / "a b.toml"));
}

TEST(Help, HasNoWordsOfTheProgramsInside) {
  const ScratchDirectory scratch;
  for (const char* command : {"run", "status", "report", "view", "movie", "convert", "plan", "partition",
                              "solve", "trace show", "trace export", "replay", "study error", "study scaling",
                              "study stability", "study certificate", "new"}) {
    const Outcome help = run(scratch.path(), std::string(command) + " --help");
    EXPECT_EQ(help.code, 0);
    for (const char* inside : {"->", ":{", "{auto"})
      EXPECT_EQ(help.output.find(inside), std::string::npos) << command << ": " << help.output;
  }
}

TEST(Options, OfOtherProgramsAreAnsweredWithWhatThereIsHere) {
  const ScratchDirectory scratch;
  const Outcome ranks = run(scratch.path(), "run scene.toml --ranks 2");
  EXPECT_EQ(ranks.code, 2);
  EXPECT_NE(ranks.messages.find("has no option --ranks; ranks are those of MPI: `mpirun -n 4"),
            std::string::npos)
      << ranks.messages;
  const Outcome misspelt = run(scratch.path(), "run scene.toml --therads 2");
  EXPECT_NE(misspelt.messages.find("did you mean '--threads'?"), std::string::npos) << misspelt.messages;
}

/// A run whose results other commands draw and convert.
class ResultsOfARun : public CommandTest {
 protected:
  void SetUp() override {
    write(at("scene.toml"), pressed_box);
    ASSERT_EQ(run("run scene.toml --out out --steps 2 --quiet --threads 1").code, 0);
  }
  void expect_refused(const std::string& arguments, int code, const std::string& named) const {
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.code, code) << arguments << "\n" << outcome.messages;
    EXPECT_NE(outcome.messages.find("talus: error: "), std::string::npos) << arguments;
    EXPECT_NE(outcome.messages.find(named), std::string::npos) << arguments << "\n" << outcome.messages;
  }
};

TEST_F(ResultsOfARun, ThatCannotBeWrittenEndWithOneCodeWhateverTheCommand) {
  // Tests run as root, too, who may write anywhere: a folder with the name of the unfinished file is in the
  // way.
  for (const char* name : {"page.html", "image.png", "film/frame_000000.png", "dump.txt", "grains.vtkhdf"}) {
    fs::create_directories(at(std::string(name) + ".part/keep"));
  }
  expect_refused("report out --out page.html", 1, "page.html.part");
  expect_refused("view out --width 64 --out image.png", 1, "image.png.part");
  expect_refused("movie out --width 64 --out film", 1, "frame_000000.png.part");
  expect_refused("movie out --width 64 --out /proc/film", 1, "/proc/film");
  expect_refused("convert out --to lammps --out dump.txt", 1, "dump.txt.part");
  expect_refused("convert out --to vtkhdf --out grains.vtkhdf", 1, "grains.vtkhdf.part");
}

TEST_F(ResultsOfARun, AreNotWrittenWhereThereIsNoFolderWhateverTheCommand) {
  write(at("file"), "mine");
  expect_refused("report out --out file/page.html", 2, "file/page.html");
  expect_refused("view out --width 64 --out file/image.png", 2, "file/image.png");
  expect_refused("movie out --width 64 --out file/film", 2, "file");
  expect_refused("movie out --width 64 --out file", 2, "file");
  expect_refused("convert out --to lammps --out file/dump.txt", 2, "file/dump.txt");
  EXPECT_EQ(content(at("file")), "mine");
}

TEST_F(ResultsOfARun, AreNotReplacedByWhatIsMadeOfThem) {
  const auto before = files_below(at("out"));
  for (const char* name : {"results.h5", "run.json", "steps.csv", "scene.resolved.toml"}) {
    const std::string out = std::string(" --out out/") + name;
    expect_refused("report out" + out, 2, name);
    expect_refused("view out --width 64 --force" + out, 2, name);
    expect_refused("convert out --to lammps --force" + out, 2, name);
  }
  EXPECT_EQ(files_below(at("out")), before);
}

TEST_F(ResultsOfARun, WhoseRunJsonIsDamagedAreRefusedByItsName) {
  for (const char* damage : {"{\"summary\": ", "", "[]", "{\"summary\": 3}", "{\"provenance\": []}",
                             "{\"summary\": {\"status\": 3}}"}) {
    write(at("out/run.json"), damage);
    for (const char* command : {"report out", "status out", "status out --json"})
      expect_refused(command, 2, "run.json");
  }
}

TEST(ViewCommand, DrawsOneFrameOrAllAndRefusesWhatThereIsNot) {
  const ScratchDirectory scratch;
  write(scratch / "scene.toml", pressed_box);
  ASSERT_EQ(run(scratch.path(), "run scene.toml --out out --steps 2 --quiet --threads 1").code, 0);
  const Outcome view = run(scratch.path(), "view out --width 200");
  EXPECT_EQ(view.code, 0) << view.messages;
  EXPECT_EQ(content(scratch / "out/view.png").substr(1, 3), "PNG");
  EXPECT_EQ(run(scratch.path(), "view out --width 200").code, 2) << "nothing is replaced unless asked";
  EXPECT_EQ(run(scratch.path(), "view out --width 200 --force").code, 0);
  EXPECT_EQ(run(scratch.path(), "view out --force --colour taste").code, 2);
  EXPECT_EQ(run(scratch.path(), "view out --force --frame 99").code, 2);
  const std::string slice = "view out --width 200 --colour velocity_y --slice x -o slice.svg";
  EXPECT_EQ(run(scratch.path(), slice).code, 0);
  EXPECT_NE(content(scratch / "slice.svg").find("velocity along y"), std::string::npos);
  EXPECT_EQ(run(scratch.path(), "view out --force --slice w").code, 2);
  const Outcome movie = run(scratch.path(), "movie out --width 200 -o film", "env PATH=/nowhere");
  EXPECT_EQ(movie.code, 0) << movie.messages;
  EXPECT_NE(movie.messages.find("there is no ffmpeg"), std::string::npos) << movie.messages;
  EXPECT_TRUE(fs::exists(scratch / "film/frame_000001.png"));
  EXPECT_NE(content(scratch / "out/report.html").find("class=\"grains\""), std::string::npos)
      << "small samples are turned by hand";
}

TEST(Completion, KnowsCommandsOptionsAndGroups) {
  const ScratchDirectory scratch;
  write(scratch / "complete.sh",
        "source <(\"$1\" completion bash); shift\n"
        "COMP_WORDS=(talus \"$@\"); COMP_CWORD=$#; _talus; echo \"${COMPREPLY[*]}\"\n");
  const auto completed = [&](const std::string& words) {
    const Outcome outcome = run(scratch.path(), words, "bash complete.sh");
    EXPECT_EQ(outcome.code, 0) << outcome.messages;
    return outcome.output;
  };
  EXPECT_EQ(completed("sta"), "status\n");
  EXPECT_EQ(completed("run --for"), "--force\n");
  EXPECT_EQ(completed("study err"), "error\n");
  EXPECT_EQ(completed("run comp"), "complete.sh\n") << "files, where no option begins like this";
}

TEST(ManPage, HasEveryCommandAndItsOptions) {
  const ScratchDirectory scratch;
  const Outcome page = run(scratch.path(), "man");
  ASSERT_EQ(page.code, 0) << page.messages;
  for (const char* part :
       {".TH TALUS 1", ".SS \"talus run\"", ".SS \"talus study error\"", "\n.B \\-\\-resume\n",
        "\n.B scene FILE\n", ".SS \"talus convert\"", ".SH EXIT STATUS"})
    EXPECT_NE(page.output.find(part), std::string::npos) << part;
  const Outcome version = run(scratch.path(), "--version");
  for (const char* part : {"talus ", "commit ", "features: ", "licence: Apache-2.0"})
    EXPECT_NE(version.output.find(part), std::string::npos) << version.output;
}

}  // namespace
}  // namespace talus::new_command_test
