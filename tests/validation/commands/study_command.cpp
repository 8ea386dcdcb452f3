/// `talus study error`, `talus run --error-history` and `talus plan --measure` as a user meets them.

#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <regex>
#include <set>

#include "tests/unit/io/results/output_helpers.hpp"
#include "tests/validation/commands/command_helpers.hpp"

namespace talus::study_command_test {
namespace {

using namespace test;

/// The rows of a study that are of one curve.
template <class Is>
std::vector<std::size_t> rows_where(const Table& table, Is is) {
  std::vector<std::size_t> found;
  for (std::size_t k = 0; k < table.rows.size(); ++k)
    if (is(table.rows[k])) found.push_back(k);
  return found;
}

class StudyError : public CommandTest {
 protected:
  void SetUp() override { write(at("scene.toml"), pressed_box); }
  /// true_error.csv of the first step of a column of so many grains.
  Table first_step(const std::string& scene, int grains, const std::string& methods,
                   const std::string& tolerance) {
    write(at("column.toml"), scene);
    const Outcome outcome =
        run("study error column.toml --out s --threads 1 --only step --at-step 0 --methods " + methods +
            " --tolerances " + tolerance + " --set sample.cells=[1,1," + std::to_string(grains) + "]");
    EXPECT_EQ(outcome.code, 0) << outcome.messages;
    return read_table(at("s/true_error.csv"));
  }
};

// A grain at rest in a wedge, which pushes on either wall with ten times its weight: ten sweeps leave it
// falling with nine tenths of g h, as alternate projections do. Its velocity is wrong by that part of what
// the contacts have to stop, however large their forces are.
TEST_F(StudyError, AVelocityIsWrongByAPartOfWhatTheContactsHaveToStop) {
  const double half_angle = 0.05, c = std::cos(half_angle), s = std::sin(half_angle);
  write(at("grain.csv"), fmt::format("id,x,y,z,radius\n0,0,0,{},0.01\n", 0.01 / s));
  const auto wall = [&](const char* name, double x) {
    return fmt::format("[[wall]]\nname = \"{}\"\nnormal = [{}, 0, {}]\npoint = [0, 0, 0]\n", name, x, s);
  };
  write(at("wedge.toml"),
        "gravity = [0, 0, -9.81]\ntime_step = 1e-3\nmaterial = { density = 2600 }\n"
        "sample = { kind = \"bodies\", file = \"grain.csv\" }\n" +
            wall("left", c) + wall("right", -c) + "[[stage]]\nend = { steps = 1 }\n");
  const Outcome outcome = run(
      "study error wedge.toml --out s --threads 1 --only step --at-step 0 --methods nlgs --tolerances 1e-6");
  ASSERT_TRUE(outcome.code == 0 || outcome.code == 3) << outcome.messages;
  const Table truth = read_table(at("s/true_error.csv"));
  ASSERT_EQ(truth.number(0, "sweeps"), 10);
  double vx = 0, vz = -1;  // over g h
  for (int k = 0; k < 10; ++k)
    for (const double side : {c, -c}) {
      const double approach = side * vx + s * vz;
      vx -= approach * side;
      vz -= approach * s;
    }
  EXPECT_NEAR(truth.number(0, "velocity_error"), std::hypot(vx, vz), 1e-3);
}

constexpr const char* brief = "study error scene.toml --out s --threads 1 --set stage.press.friction=0.35 ";

TEST_F(StudyError, OneStepIsSolvedInEveryWayUntilItsTolerance) {
  // Without friction velocities are unique.
  const Outcome outcome =
      run("study error scene.toml --out s --threads 1 --only step --at-step 3 --max-sweeps 3000 "
          "--tolerances 1e-2,1e-4 --subdomains 1,3");
  ASSERT_TRUE(outcome.code == 0 || outcome.code == 3) << outcome.messages;
  const Table residual = read_table(at("s/residual.csv")), truth = read_table(at("s/true_error.csv"));
  for (const std::string method : {"auto", "nlgs", "nlgs+momentum", "nncg"})
    for (const std::string start : {"cold", "warm"})
      for (const std::string subdomains : {"1", "3"}) {
        const auto of = [&](const auto& row) {
          return row.at("method") == method && row.at("start") == start && row.at("subdomains") == subdomains;
        };
        const auto checks = rows_where(residual, of), solves = rows_where(truth, of);
        ASSERT_GE(checks.size(), 2U) << method << start << subdomains;
        EXPECT_EQ(residual.number(checks.front(), "sweeps"), 0);
        EXPECT_LE(residual.number(checks.back(), "error_rms"), 1e-4) << method << start << subdomains;
        for (std::size_t k = 1; k < checks.size(); ++k) {
          // A direct solve of small clusters is looked at with no sweep behind it.
          EXPECT_GE(residual.number(checks[k], "sweeps"), residual.number(checks[k - 1], "sweeps"));
          EXPECT_GE(residual.number(checks[k], "seconds"), 0);
        }
        // The same step, so the same answer, whoever finds it.
        EXPECT_LT(truth.number(solves.back(), "velocity_error"), 0.1) << method << start << subdomains;
        EXPECT_LT(truth.number(solves.back(), "velocity_error"),
                  truth.number(solves.front(), "velocity_error") + 1e-9);
        EXPECT_EQ(truth.number(solves.back(), "error_rms"), residual.number(checks.back(), "error_rms"));
      }
  for (const std::string name : {"residual_seconds", "residual_sweeps", "velocity_seconds", "velocity_sweeps",
                                 "wall_forces_seconds", "velocity_residual"})
    EXPECT_TRUE(fs::exists(at("s/" + name + ".svg"))) << name;
  EXPECT_FALSE(fs::exists(at("s/runs.csv")));
  const std::string page = content(at("s/report.html"));
  EXPECT_NE(page.find("<svg"), std::string::npos);
  EXPECT_NE(page.find("not unique"), std::string::npos) << "the page says what the reference is worth";
}

/// Colours of the lines in the legends of all pictures in a folder, per name up to a comma.
std::map<std::string, std::set<std::string>> colours_in(const fs::path& folder) {
  static const std::regex entry(
      "<line [^>]*stroke=\"(#[0-9a-f]+)\"[^>]*/>\\s*<text [^>]*>([^<,]+)[^<]*</text>");
  std::map<std::string, std::set<std::string>> colours;
  for (const auto& file : fs::directory_iterator(folder)) {
    if (file.path().extension() != ".svg") continue;
    const std::string picture = content(file.path());
    for (std::sregex_iterator found(picture.begin(), picture.end(), entry), end; found != end; ++found)
      colours[(*found)[2]].insert((*found)[1]);
  }
  return colours;
}

TEST_F(StudyError, AMethodHasTheSameColourInEveryPictureOfEveryStudy) {
  const std::string step = "study error scene.toml --threads 1 --only step --at-step 3 --tolerances 1e-2 ";
  ASSERT_EQ(run(step + "--out all --methods auto,nlgs,nncg").code, 0);
  ASSERT_EQ(run(step + "--out one --methods nncg,nlgs").code, 0);
  const auto all = colours_in(at("all")), one = colours_in(at("one"));
  std::set<std::string> different;
  for (const std::string method : {"auto", "nlgs", "nncg"}) {
    ASSERT_EQ(all.count(method), 1U) << method;
    EXPECT_EQ(all.at(method).size(), 1U) << method;
    different.insert(*all.at(method).begin());
  }
  for (const std::string method : {"nlgs", "nncg"}) {
    ASSERT_EQ(one.count(method), 1U) << method;
    EXPECT_EQ(one.at(method), all.at(method)) << method;
  }
  EXPECT_EQ(different.size(), 3U);
}

/// The residual of a long column is small long before anything is carried: `auto`, which the reference tries
/// first, ends on the balance, and the reference must ask more of that than anybody else.
TEST_F(StudyError, TheReferenceIsTheAnswerInStiffSamplesToo) {
  const Table truth = first_step(column_scene, 60, "nlgs+momentum,admm", "1e-2");
  const auto last = [&](const char* method) {
    return rows_where(truth, [&](const auto& row) { return row.at("method") == method; }).back();
  };
  EXPECT_LT(truth.number(last("admm"), "wall_force_error"), 1e-3) << "ADMM is right";
  EXPECT_GT(truth.number(last("nlgs+momentum"), "wall_force_error"), 1e-3)
      << "and sweeps stop where they may";
}

/// With gravity such a column hangs in the balance of the scene; a variant asked for a hundredth of the
/// scene's tolerance is asked for a hundredth of its balance as well.
TEST_F(StudyError, ATighterToleranceTightensTheBalance) {
  const Table truth = first_step(column_scene, 60, "auto", "1e-5");
  EXPECT_LT(truth.number(truth.rows.size() - 1, "wall_force_error"), 5e-3) << "the scene's balance is 5e-2";
}

/// Likewise for whole runs; what these are held against is found by `auto`, asked for more.
TEST_F(StudyError, WholeRunsTightenTheBalanceToo) {
  write(at("column.toml"), column_scene);
  const auto error = [&](const std::string& method, const std::string& tolerance) {
    const Outcome outcome =
        run("study error column.toml --out s --force --threads 1 --only run --steps 1 --methods " + method +
            " --tolerances " + tolerance + " --set sample.cells=[1,1,60]");
    EXPECT_EQ(outcome.code, 0) << outcome.messages;
    return read_table(at("s/runs.csv")).number(0, "position_error");
  };
  EXPECT_LT(error("auto", "1e-5"), 1e-6);
  EXPECT_LT(error("admm", "1e-2"), error("nlgs+momentum", "1e-2"))
      << "the reference is no better than sweeps";
}

/// Velocities are nothing but the solver's noise there, and no measure of its errors.
TEST_F(StudyError, VelocityErrorsOfASamplePressedAtRestAreThoseOfItsForces) {
  std::string pressed = column_scene;
  pressed.replace(pressed.find("gravity"), pressed.find("time_step") - pressed.find("gravity"), "");
  pressed.insert(pressed.find("[[stage]]"),
                 "[[wall]]\nname = \"lid\"\nside = \"z+\"\ndrive = \"force\"\nforce = 1\n\n");
  const Table truth = first_step(pressed, 20, "nlgs", "1e-2");
  ASSERT_FALSE(truth.rows.empty());
  for (std::size_t k = 0; k < truth.rows.size(); ++k) {
    EXPECT_LT(truth.number(k, "velocity_error"), 2 * truth.number(k, "wall_force_error"));
    EXPECT_GT(truth.number(k, "velocity_error"), 0.5 * truth.number(k, "wall_force_error"));
  }
}

TEST_F(StudyError, WarmStartsBeginNearerThanColdOnes) {
  ASSERT_NE(run(std::string(brief) + "--only step --at-step 4 --methods nlgs --tolerances 1e-2").code, 1);
  const Table residual = read_table(at("s/residual.csv"));
  const auto first = [&](const char* start) {
    return residual.number(
        rows_where(residual, [&](const auto& row) { return row.at("start") == start; }).front(), "error_rms");
  };
  EXPECT_LT(first("warm"), first("cold"));
}

TEST_F(StudyError, AFirstStepHasNoImpulsesToBeginFrom) {
  const Outcome outcome =
      run("study error scene.toml --out s --only step --at-step 0 --methods nlgs --tolerances 1e-2");
  ASSERT_NE(outcome.code, 1) << outcome.messages;
  const Table residual = read_table(at("s/residual.csv"));
  EXPECT_TRUE(rows_where(residual, [](const auto& row) { return row.at("start") == "warm"; }).empty());
  EXPECT_FALSE(residual.rows.empty());
}

TEST_F(StudyError, WholeRunsComeNearerTheReferenceAsTheToleranceFalls) {
  const Outcome outcome =
      run(std::string(brief) +
          "--only run --steps 6 --methods nlgs,auto --tolerances 0.3,1e-3 --set "
          "solver.balance_tolerance=1e9 --set solver.max_iterations=20000 --time-steps 1,0.5");
  ASSERT_TRUE(outcome.code == 0 || outcome.code == 3) << outcome.messages;
  const Table runs = read_table(at("s/runs.csv"));
  ASSERT_EQ(runs.rows.size(), 8U) << "methods x time steps x tolerances";
  for (std::size_t k = 0; k < 8; k += 2) {
    EXPECT_EQ(runs.number(k, "steps"), runs.number(k, "time_step") == 1 ? 6 : 12);
    EXPECT_GT(runs.number(k + 1, "sweeps"), runs.number(k, "sweeps"));
    EXPECT_GT(runs.number(k, "seconds"), 0);
  }
  // At the time step of the reference only the solver's error is left.
  for (const std::size_t k : {2U, 6U}) {
    EXPECT_EQ(runs.number(k, "time_step"), 0.5);
    EXPECT_LT(runs.number(k + 1, "position_error"), runs.number(k, "position_error"));
    EXPECT_LT(runs.number(k + 1, "stress_error"), runs.number(k, "stress_error"));
  }
  EXPECT_TRUE(fs::exists(at("s/run_stress_seconds.svg")));
  EXPECT_TRUE(fs::exists(at("s/run_position_seconds.svg")));
}

TEST_F(StudyError, TimeStepsLongerThanAStageMakeOneStepOfIt) {
  const Outcome outcome = run(std::string(brief) +
                              "--only run --steps 8 --methods nlgs --tolerances 1e-2 --time-steps 5 --set "
                              "stage.press.end.steps=2");
  ASSERT_NE(outcome.code, 1) << outcome.messages;
  // Two steps of the first stage become one, six of the second too.
  EXPECT_EQ(read_table(at("s/runs.csv")).number(0, "steps"), 2);
}

TEST_F(StudyError, LeavesOutWhatTheSceneDoesNotHave) {
  write(at("column.toml"), column_scene);
  const Outcome outcome =
      run("study error column.toml --out s --threads 1 --only run --steps 2 --methods nlgs "
          "--tolerances 1e-1 --set allow_unconverged=true");
  ASSERT_NE(outcome.code, 1) << outcome.messages;
  EXPECT_NE(outcome.messages.find("positions off by"), std::string::npos) << outcome.messages;
  EXPECT_EQ(outcome.messages.find("nan"), std::string::npos) << outcome.messages;
}

TEST_F(StudyError, AStudyThatIsStoppedLeavesWhatItHasMeasured) {
  // Killed behind the second result: a reader that goes away ends no command.
  test::run(
      folder_.path(),
      std::string(brief) +
          "--tolerances 1e-4 --at-step 2 --subdomains 1,2,3 2>&1 | { sed '/auto, 2 subdomains, cold/q'; "
          "kill -9 $(cat '" +
          at("pid").string() + "'); }",
      "sh -c 'echo $$ > pid; exec \"$@\"' -");
  EXPECT_FALSE(read_table(at("s/true_error.csv")).rows.empty());
  EXPECT_TRUE(fs::exists(at("s/report.html")));
  EXPECT_FALSE(fs::exists(at("s/runs.csv"))) << "it was not stopped";
}

TEST_F(StudyError, RefusesWhatHasNoMeaningAndWritesNothing) {
  fs::create_directories(at("empty"));
  for (const std::string arguments :
       {"missing.toml", "scene.toml --methods newtonian", "scene.toml --tolerances 0",
        "scene.toml --tolerances x", "scene.toml --subdomains 0", "scene.toml --time-steps -1",
        "scene.toml --steps 0", "scene.toml --threads 0", "scene.toml --only both",
        "scene.toml --set solver.tolerances=1", "empty", "", "scene.toml --time-steps 50 --steps 4",
        "scene.toml --only run --time-steps 8 --set 'stage.press.end={time=3e-3}'",
        "scene.toml --only run --steps 500 --set 'stage.press.end={steps=2}' --set "
        "'stage.shear.end={steps=2}'",
        // A time of exactly half a step, in numbers that are exact.
        "scene.toml --only run --time-steps 4 --set time_step=0.0009765625 --set "
        "'stage.press.end={time=0.001953125}'"}) {
    const Outcome outcome = run("study error " + arguments);
    EXPECT_EQ(outcome.code, 2) << arguments << outcome.messages;
    EXPECT_NE(outcome.messages.find("error"), std::string::npos) << arguments << outcome.messages;
    EXPECT_EQ(files_below(folder_.path()).size(), 1U) << arguments;
  }
  for (const std::string idle :
       {"scene.toml --only run --at-step 1", "scene.toml --only run --max-sweeps 1",
        "scene.toml --only run --max-seconds 1", "scene.toml --only step --steps 1",
        "scene.toml --only step --time-steps 1", "empty --set seed=1", "empty --subdomains 1",
        "empty --threads 1", "empty --seeds 1", "empty --only step", "empty --steps 1",
        "empty --time-steps 1", "empty --at-step 1", "empty --max-sweeps 1"}) {
    const Outcome outcome = run("study error " + idle);
    EXPECT_EQ(outcome.code, 2) << idle;
    EXPECT_NE(outcome.messages.find("has no meaning"), std::string::npos) << idle << outcome.messages;
    EXPECT_EQ(files_below(folder_.path()).size(), 1U) << idle;
  }
  EXPECT_NE(run("study error scene.toml --methods newtonian").messages.find("nlgs+momentum"),
            std::string::npos)
      << "says what there is";
  EXPECT_NE(run("study error scene.toml --time-steps 50 --steps 4").messages.find("--time-steps 50"),
            std::string::npos);
}

/// Momentum is refused with Schwarz, when the reference is there.
TEST_F(StudyError, WithoutAResultIsAFailure) {
  for (const std::string part : {"step --at-step 1", "run --steps 2"}) {
    const Outcome outcome = run(std::string(brief) +
                                "--force --methods nlgs+momentum --tolerances 1e-1 --set "
                                "decomposition.coupling=schwarz --only " +
                                part);
    EXPECT_EQ(outcome.code, 1) << part << outcome.messages;
    EXPECT_NE(outcome.messages.find("Schwarz"), std::string::npos) << outcome.messages;
    EXPECT_NE(outcome.messages.find("reference"), std::string::npos) << outcome.messages;
  }
}

TEST_F(StudyError, CutsTheBoxesOfTheSceneOrOthers) {
  const Outcome outcome =
      run(std::string(brief) +
          "--methods auto --tolerances 1e-1 --at-step 1 --steps 2 --subdomains 1,3,4 --set "
          "decomposition.boxes=[1,1,3]");
  EXPECT_NE(outcome.code, 1) << outcome.messages;
  const Table runs = read_table(at("s/runs.csv")), truth = read_table(at("s/true_error.csv"));
  for (const std::string subdomains : {"1", "3", "4"}) {
    const auto of = [&](const auto& row) { return row.at("subdomains") == subdomains; };
    EXPECT_FALSE(rows_where(runs, of).empty()) << subdomains << outcome.messages;
    EXPECT_FALSE(rows_where(truth, of).empty()) << subdomains << outcome.messages;
  }
}

TEST_F(StudyError, ReplacesItsOwnFilesOnlyAndOnlyWithForce) {
  const std::string command = std::string(brief) + "--only step --at-step 1 --methods nlgs --tolerances 1e-1";
  ASSERT_NE(run(command).code, 1);
  write(at("s/notes.txt"), "mine");
  write(at("s/run_stress_seconds.svg"), "of an earlier study");
  const auto before = files_below(at("s"));
  const Outcome refused = run(command);
  EXPECT_EQ(refused.code, 2);
  EXPECT_NE(refused.messages.find("--force"), std::string::npos) << refused.messages;
  EXPECT_EQ(files_below(at("s")), before);
  ASSERT_NE(run(command + " --force").code, 2);
  EXPECT_EQ(content(at("s/notes.txt")), "mine");
  EXPECT_FALSE(fs::exists(at("s/run_stress_seconds.svg")));
}

TEST_F(StudyError, SaysWhenTheSceneEndsBeforeTheStep) {
  const Outcome outcome = run("study error scene.toml --out s --only step --at-step 12");
  EXPECT_EQ(outcome.code, 2);
  EXPECT_NE(outcome.messages.find("after step 12"), std::string::npos) << outcome.messages;
  EXPECT_FALSE(fs::exists(at("s")));
  EXPECT_NE(run("study error scene.toml --out s --only step --at-step 11 --methods nlgs --tolerances 1").code,
            2);
  // Nobody knows before when a sample comes to rest.
  const Outcome late =
      run("study error scene.toml --out t --only step --at-step 12 --set "
          "'stage.press.end={equilibrium=1e9, equilibrium_hold=0}'");
  EXPECT_EQ(late.code, 1);
  EXPECT_NE(late.messages.find("--at-step"), std::string::npos) << late.messages;
}

TEST_F(StudyError, ARunWritesTheErrorsOfChosenSteps) {
  ASSERT_EQ(run("run scene.toml --out r --threads 1 --error-history 2,5:6 --set allow_unconverged=true").code,
            0);
  const Table history = read_table(at("r/error_history.csv")), steps = read_table(at("r/steps.csv"));
  EXPECT_EQ(history.header, "step,iterations,seconds,error_rms");
  std::set<int> seen;
  for (std::size_t k = 0; k < history.rows.size(); ++k) {
    const int step = static_cast<int>(history.number(k, "step"));
    seen.insert(step);
    const bool last = k + 1 == history.rows.size() || history.number(k + 1, "step") != step;
    if (last) {
      // The last check is the certificate of the step.
      EXPECT_EQ(history.rows[k].at("error_rms"),
                steps.rows.at(static_cast<std::size_t>(step) - 1).at("error_rms"));
      EXPECT_EQ(history.rows[k].at("iterations"),
                steps.rows.at(static_cast<std::size_t>(step) - 1).at("iterations"));
      EXPECT_LE(history.number(k, "seconds"), steps.number(static_cast<std::size_t>(step) - 1, "wall_s"));
    } else {
      EXPECT_LE(history.number(k, "seconds"), history.number(k + 1, "seconds"));
    }
  }
  EXPECT_EQ(seen, (std::set<int>{2, 5, 6}));
  ASSERT_EQ(run("run scene.toml --out plain --threads 1 --set allow_unconverged=true").code, 0);
  EXPECT_FALSE(fs::exists(at("plain/error_history.csv")));
  EXPECT_EQ(summary(at("plain")).at("digest"), summary(at("r")).at("digest")) << "looking changes nothing";
  for (const std::string steps_text : {"0", "x", "5:2", "1:", ",", "1;2"}) {
    const Outcome outcome = run("run scene.toml --out bad --error-history '" + steps_text + "'");
    EXPECT_EQ(outcome.code, 2) << steps_text;
    EXPECT_FALSE(fs::exists(at("bad"))) << steps_text;
  }
}

TEST_F(StudyError, PlanMeasuresWhatOmissionsSave) {
  const Outcome plain = run("plan scene.toml --threads 1"),
                measured = run("plan scene.toml --threads 1 --measure");
  ASSERT_EQ(measured.code, 0) << measured.messages;
  EXPECT_EQ(measured.output.substr(0, plain.output.size()), plain.output) << "measuring only adds";
  EXPECT_EQ(plain.output.find("measured here"), std::string::npos);
  const std::size_t table = measured.output.find("measured here");
  ASSERT_NE(table, std::string::npos);
  for (const std::string part : {"friction", "rotation, with friction", "pushed walls", "several subdomains",
                                 "a rank per subdomain", "trace"})
    EXPECT_NE(measured.output.find("\n  " + part, table), std::string::npos) << measured.output;
  // Tangential impulses and spins are bytes that a frictionless scene does not hold.
  std::istringstream row(measured.output.substr(measured.output.find("\n  friction", table) + 28));
  std::string in_scene, saved;
  double with_ns = 0, without_ns = 0, with_bytes = 0, without_bytes = 0;
  row >> in_scene >> with_ns >> without_ns >> saved;
  std::string percent;
  row >> percent >> with_bytes >> without_bytes;
  EXPECT_GT(with_ns, 0);
  EXPECT_GT(with_bytes, without_bytes) << measured.output;
  const Outcome rolling =
      run("plan scene.toml --threads 1 --measure --set stage.press.friction=0.35 "
          "--set stage.press.rolling_resistance=0.1");
  EXPECT_EQ(rolling.code, 0) << "without friction nothing rolls either: " << rolling.messages;
}

TEST_F(StudyError, PlanSaysWhereThereIsNothingToMeasure) {
  ASSERT_EQ(run("new pour --kind silo").code, 0);
  const Outcome planned = run("plan pour.toml --threads 1 --set orientation=true"),
                measured = run("plan pour.toml --threads 1 --measure");
  EXPECT_EQ(planned.code, 0) << planned.messages;
  EXPECT_NE(planned.output.find("no grains yet"), std::string::npos) << planned.output;
  EXPECT_NE(planned.output.find("asked for: 32 bytes per grain"), std::string::npos) << planned.output;
  EXPECT_EQ(measured.code, 2);
  EXPECT_NE(measured.messages.find("pour.toml: --measure: nothing is swept in the first step"),
            std::string::npos)
      << measured.messages;
}

}  // namespace
}  // namespace talus::study_command_test
