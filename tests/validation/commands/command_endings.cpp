/// How a run of the command can end other than well, and the scenes that ship with it.

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>
#include <regex>
#include <string>

#include "io/results/results.hpp"
#include "tests/unit/io/results/output_helpers.hpp"
#include "tests/validation/commands/command_helpers.hpp"

namespace talus::command_endings_test {
namespace {

using namespace test;

const std::string scenes = TALUS_SOURCE_DIR "/apps/scenes/";

class Ending : public CommandTest {};

TEST_F(Ending, WithMissedTolerancesIsThreeAndMarkedUnlessAllowed) {
  write(at("scene.toml"), column_scene);
  const std::string strict =
      "run scene.toml --force --out results --set solver.max_iterations=1 --set solver.tolerance=1e-9";
  const Outcome missed = run(strict);
  EXPECT_EQ(missed.code, 3) << missed.messages;
  EXPECT_NE(missed.messages.find("missed the tolerance"), std::string::npos) << missed.messages;
  EXPECT_NE(missed.messages.find("Raise solver.max_iterations"), std::string::npos) << missed.messages;
  EXPECT_NE(missed.messages.find("allow_unconverged = true"), std::string::npos) << missed.messages;
  const Table steps = read_table(at("results/steps.csv"));
  ASSERT_EQ(steps.rows.size(), 4U);
  std::int64_t marked = 0;
  for (const auto& row : steps.rows) marked += row.at("converged") == "0";
  EXPECT_GT(marked, 0);
  EXPECT_EQ(summary(at("results")).at("status"), "done");
  EXPECT_EQ(summary(at("results")).at("exit_code"), 3);
  EXPECT_EQ(summary(at("results")).at("unconverged_steps"), marked);
  EXPECT_EQ(summary(at("results")).at("converged_steps"), 4 - marked);

  const Outcome allowed = run(strict + " --set allow_unconverged=true");
  EXPECT_EQ(allowed.code, 0);
  EXPECT_EQ(allowed.messages.find("accept them with"), std::string::npos) << "they are: " << allowed.messages;
  EXPECT_EQ(summary(at("results")).at("unconverged_steps"), marked);
  EXPECT_EQ(summary(at("results")).at("exit_code"), 0);
}

/// What the tolerance leaves in motion at rest is no energy from nowhere, though the step before had less.
TEST_F(Ending, OfAPackingAtRestUnderAStressIsNoRunaway) {
  write(at("scene.toml"),
        "seed = 2\ntime_step = 1e-4\nallow_unconverged = true\n[material]\ndensity = 2600\n[cell]\n"
        "lengths = [0.0105, 0.0105, 0.0105]\n[sample]\nkind = \"random\"\ncount = 30\nradius = 0.001\n"
        "[[stage]]\nstress = { xx = 1e3, yy = 1e3, zz = 1e3 }\nend = { steps = 300 }\n"
        "[solver]\nmax_iterations = 20000\n[output]\npictures = false\n");
  const Outcome outcome = run("run scene.toml --out results --threads 1");
  EXPECT_EQ(outcome.code, 0) << outcome.messages;
}

TEST_F(Ending, OfARunawayIsOneWithStepAndBody) {
  // They fall so fast that their energy is no number.
  write(at("pair.csv"), "id,x,y,z,radius\n0,0,0,0,0.01\n7,1,0,0,0.01\n");
  write(at("scene.toml"), R"(time_step = 1e-6
gravity = [0, 0, -1e200]
[material]
density = 2600
[sample]
kind = "bodies"
file = "pair.csv"
[[stage]]
name = "burst"
end = { steps = 5 }
)");
  const Outcome outcome = run("run scene.toml --out results");
  EXPECT_EQ(outcome.code, 1) << outcome.messages;
  EXPECT_NE(outcome.messages.find("step 1 (stage 'burst')"), std::string::npos) << outcome.messages;
  EXPECT_NE(outcome.messages.find("body "), std::string::npos) << outcome.messages;
  EXPECT_EQ(summary(at("results")).at("status"), "failed");
  EXPECT_EQ(summary(at("results")).at("exit_code"), 1);
  EXPECT_NE(summary(at("results")).at("message").get<std::string>().find("step 1 "), std::string::npos);
}

// 65535 subdomains of 27 grains took 22 GB until the machine had no more.
TEST_F(Ending, OfMoreSubdomainsThanMemoryHoldsIsTwo) {
  if (static_cast<double>(::sysconf(_SC_PHYS_PAGES)) * static_cast<double>(::sysconf(_SC_PAGESIZE)) > 1e11)
    GTEST_SKIP() << "this machine has the 107 GB";
  write(at("scene.toml"), column_scene);
  const Outcome outcome = run("run scene.toml --set decomposition.subdomains=65535 --out results");
  EXPECT_EQ(outcome.code, 2) << outcome.messages;
  EXPECT_NE(outcome.messages.find("65535 subdomains takes about 107 GB"), std::string::npos)
      << outcome.messages;
  EXPECT_FALSE(fs::exists(at("results")));
}

// A folder stands where a file of the run belongs: seen when the run has begun, before its first step.
TEST_F(Ending, BeforeTheFirstStepIsInRunJson) {
  write(at("scene.toml"), column_scene);
  for (const std::string name : {"trace.h5", "results.h5"}) {
    fs::create_directories(at("results/" + name));
    const Outcome outcome = run("run scene.toml --trace --force --out results");
    EXPECT_EQ(outcome.code, 1) << name << ": " << outcome.messages;
    EXPECT_EQ(summary(at("results")).at("status"), "failed") << name;
    EXPECT_EQ(summary(at("results")).at("exit_code"), 1) << name;
    EXPECT_EQ(summary(at("results")).at("bodies"), 3) << name;
    EXPECT_NE(summary(at("results")).at("message").get<std::string>().find(name), std::string::npos);
    fs::remove_all(at("results"));
  }
}

TEST_F(Ending, BySignalLeavesWholeFiles) {
  std::string endless = pressed_box;
  endless.replace(endless.find("steps = 6"), 9, "steps = 1000000000");
  write(at("scene.toml"), endless);
  for (const int signal : {SIGTERM, SIGINT}) {
    int ends[2];
    ASSERT_EQ(::pipe(ends), 0);
    const pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      ::dup2(ends[1], STDERR_FILENO);
      ::close(ends[0]);
      ::close(ends[1]);
      if (::chdir(folder_.path().c_str()) == 0)
        ::execl(TALUS_COMMAND, TALUS_COMMAND, "run", "scene.toml", "--force", "--out", "results", nullptr);
      ::_exit(127);
    }
    ::close(ends[1]);
    std::string messages;
    std::array<char, 256> buffer;
    bool asked = false;
    for (ssize_t n; (n = ::read(ends[0], buffer.data(), buffer.size())) > 0;) {
      messages.append(buffer.data(), static_cast<std::size_t>(n));
      // The first line of progress: the run is in its steps.
      if (!asked && messages.find("  step ") != std::string::npos) asked = ::kill(child, signal) == 0;
    }
    ::close(ends[0]);
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    EXPECT_TRUE(asked) << messages;
    ASSERT_TRUE(WIFEXITED(status)) << messages;
    EXPECT_EQ(WEXITSTATUS(status), 75) << messages;

    const auto end = summary(at("results"));
    EXPECT_EQ(end.at("status"), "stopped");
    EXPECT_EQ(end.at("exit_code"), 75);
    const auto steps = end.at("steps").get<std::size_t>();
    EXPECT_GE(steps, 1U);
    EXPECT_NE(messages.find("after step " + std::to_string(steps)), std::string::npos) << messages;
    EXPECT_EQ(read_table(at("results/steps.csv")).rows.size(), steps);
    EXPECT_EQ(read_table(at("results/walls.csv")).rows.size(), 6 * steps);
    EXPECT_TRUE(content(at("results/steps.csv")).ends_with("\n"));
    const std::size_t frames = io::frame_count(at("results/results.h5"));
    EXPECT_EQ(io::read_frame(at("results/results.h5"), frames - 1).step, static_cast<std::int64_t>(steps))
        << "what was reached is not lost";
  }
}

TEST_F(Ending, OnAFullDiskIsInRunJson) {
  write(at("scene.toml"), pressed_box);
  const Outcome outcome =
      test::run(folder_.path(),
                "run scene.toml --out results --threads 1 --set 'stage.press.end={steps=300}' --set "
                "output.stage_frames=false --set output.fields=false --set output.pictures=false",
                "ulimit -f 32;");
  EXPECT_EQ(outcome.code, 1) << outcome.messages;
  EXPECT_NE(outcome.messages.find("too large"), std::string::npos) << outcome.messages;
  EXPECT_EQ(summary(at("results")).at("status"), "failed") << outcome.messages;
  EXPECT_TRUE(summary(at("results")).at("digest").is_null());
}

TEST_F(Ending, OfAPlanCountsGrainsAndTheirCopies) {
  write(at("scene.toml"), pressed_box);
  const auto grains_in = [&](const std::string& subdomains) {
    const std::string output = run("plan scene.toml --set decomposition.subdomains=" + subdomains).output;
    std::smatch count;
    EXPECT_TRUE(std::regex_search(output, count, std::regex("\n  ([0-9]+) grains"))) << output;
    EXPECT_EQ(output.find(" copies of them in other subdomains") != std::string::npos, subdomains != "1");
    return count.str(1);
  };
  EXPECT_EQ(grains_in("1"), grains_in("4"));
}

TEST_F(Ending, OfAPlanIsAListOfWhatIsLeftOut) {
  write(at("scene.toml"), pressed_box);
  const Outcome outcome = run("plan scene.toml");
  ASSERT_EQ(outcome.code, 0) << outcome.messages;
  const std::size_t shear = outcome.output.find("stage 'shear'");
  ASSERT_NE(shear, std::string::npos) << outcome.output;
  const auto is = [&](const std::string& what, const std::string& state, std::size_t from) {
    const std::size_t begin = outcome.output.find("  " + what + " ", from);
    if (begin == std::string::npos) return false;
    const std::string line = outcome.output.substr(begin, outcome.output.find('\n', begin) - begin);
    return line.find(" " + state + " ") != std::string::npos;
  };
  EXPECT_TRUE(is("tangential impulses", "out", 0)) << outcome.output;
  EXPECT_TRUE(is("rotation in the sweeps", "out", 0)) << outcome.output;
  EXPECT_TRUE(is("tangential impulses", "in", shear)) << outcome.output;
  EXPECT_TRUE(is("gravity", "out", shear)) << outcome.output;
  EXPECT_TRUE(is("orientations", "out", shear)) << outcome.output;
  EXPECT_TRUE(is("moving walls", "in", shear)) << outcome.output;
  EXPECT_TRUE(is("subdomains", "out", shear)) << outcome.output;
  for (const std::string words : {"bytes per grain", "bytes per candidate", "tasks per sweep"})
    EXPECT_NE(outcome.output.find(words), std::string::npos) << words;
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_.path()), {}), 1);
}

// ---- the scenes that ship

TEST_F(Ending, OfTheFirstStepsOfShippedScenesIsGood) {
  for (const std::string scene : {"demo", "column-100", "pile-16k"}) {
    const Outcome outcome = run("run " + scenes + scene + ".toml --steps 2 --out " + scene);
    EXPECT_TRUE(outcome.code == 0 || outcome.code == 3) << scene << ": " << outcome.messages;
    // A pile is deposited at rest, and its first step says so; it must go on to say so.
    EXPECT_EQ(read_table(at(scene + "/steps.csv")).rows.size(), 2U) << scene;
  }
}

TEST_F(Ending, OfEveryShippedSceneIsGoodWhenDry) {
  for (const auto& entry : fs::directory_iterator(scenes)) {
    // 200,000 grains take a while to deposit; that they do is a benchmark's to show.
    if (entry.path().extension() != ".toml" || entry.path().stem() == "triaxial-200k") continue;
    const Outcome outcome = run("run " + entry.path().string() + " --dry-run");
    EXPECT_EQ(outcome.code, 0) << entry.path() << ": " << outcome.messages;
    EXPECT_FALSE(outcome.output.empty()) << entry.path();
  }
}

// Numbers of apps/scenes/data/iso12k/lmgc90-one-step.txt.
TEST_F(Ending, OfOneStepOfLmgc90IsThatOfLmgc90) {
  const Outcome outcome = run("run " + scenes + "replica-iso12k.toml --out results");
  ASSERT_EQ(outcome.code, 0) << outcome.messages;
  const Table steps = read_table(at("results/steps.csv"));
  ASSERT_EQ(steps.rows.size(), 1U);
  // Here those count too that only the load of their wall can close within the step.
  EXPECT_NEAR(steps.number(0, "candidates"), 34354 + 2142, 10);
  EXPECT_NEAR(steps.number(0, "active"), 21405 + 1513, 0.02 * (21405 + 1513));
  EXPECT_NEAR(steps.number(0, "kinetic_translation"), 9.224900e-03, 0.003 * 9.224900e-03);
  EXPECT_NEAR(steps.number(0, "kinetic_rotation"), 9.247193e-03, 0.003 * 9.247193e-03);
  const Table walls = read_table(at("results/walls.csv"));
  const std::map<std::string, std::string> axis{{"x+", "force_x"}, {"y+", "force_y"}, {"z+", "force_z"}};
  std::size_t pushed = 0;
  for (std::size_t row = 0; row < walls.rows.size(); ++row) {
    const auto found = axis.find(walls.rows[row].at("wall"));
    if (found == axis.end()) continue;
    ++pushed;
    EXPECT_NEAR(walls.number(row, found->second), -3076.375239, 0.001 * 3076.375239) << found->first;
  }
  EXPECT_EQ(pushed, 3U);
}

// A run whose state lay among the results that it replaces ended well, and could not be repeated.
TEST_F(Ending, ForceLeavesTheStateThatTheSceneBeginsFrom) {
  write(at("scene.toml"), column_scene);
  ASSERT_EQ(run("run scene.toml --out results").code, 0);
  write(at("on.toml"),
        "time_step = 1e-3\n[material]\ndensity = 2600\n[sample]\nkind = \"state\"\nfile = "
        "\"results/results.h5\"\n[[wall]]\nname = \"z-\"\n[[stage]]\nend = { steps = 1 }\n");
  const auto before = files_below(at("results"));
  const Outcome refused = run("run on.toml --out results --force");
  EXPECT_EQ(refused.code, 2) << refused.messages;
  EXPECT_NE(refused.messages.find("results.h5: is still to be read"), std::string::npos) << refused.messages;
  EXPECT_EQ(files_below(at("results")), before);
  EXPECT_EQ(run("run on.toml --out elsewhere --force").code, 0);
}

}  // namespace
}  // namespace talus::command_endings_test
