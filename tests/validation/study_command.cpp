/// `talus study error`, `talus run --error-history` and `talus plan --measure` as a user meets them.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>

#include "tests/unit/output_helpers.hpp"
#include "tests/validation/command_helpers.hpp"

namespace talus {
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

class StudyError : public testing::Test {
 protected:
  void SetUp() override { write(at("scene.toml"), pressed_box); }
  Outcome run(const std::string& arguments) { return test::run(folder_.path(), arguments); }
  fs::path at(const std::string& name) const { return folder_.path() / name; }
  ScratchDirectory folder_;
};

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
          EXPECT_GT(residual.number(checks[k], "sweeps"), residual.number(checks[k - 1], "sweeps"));
          EXPECT_GE(residual.number(checks[k], "seconds"), 0);
        }
        // The same step, so the same answer, whoever finds it.
        EXPECT_LT(truth.number(solves.back(), "velocity_error"), 0.1) << method << start << subdomains;
        EXPECT_LT(truth.number(solves.back(), "velocity_error"),
                  truth.number(solves.front(), "velocity_error") + 1e-9);
        EXPECT_EQ(truth.number(solves.back(), "error_rms"), residual.number(checks.back(), "error_rms"));
      }
  for (const std::string name : {"residual_seconds", "residual_sweeps", "velocity_seconds", "velocity_sweeps",
                                 "wall_forces_seconds", "velocity_residual"}) {
    EXPECT_TRUE(fs::exists(at("s/" + name + ".svg"))) << name;
    EXPECT_NE(content(at("s/plot.gp")).find(name + ".gnuplot.svg"), std::string::npos) << name;
  }
  EXPECT_FALSE(fs::exists(at("s/runs.csv")));
  const std::string page = content(at("s/report.html"));
  EXPECT_NE(page.find("<svg"), std::string::npos);
  EXPECT_NE(page.find("not unique"), std::string::npos) << "the page says what the reference is worth";
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

TEST_F(StudyError, GnuplotDrawsTheTables) {
  if (std::system("command -v gnuplot >/dev/null 2>&1") != 0) GTEST_SKIP() << "gnuplot is not installed";
  ASSERT_NE(run(std::string(brief) + "--only step --at-step 2 --methods nlgs,nncg --tolerances 1e-2").code,
            1);
  const std::string line = "cd '" + at("s").string() + "' && gnuplot plot.gp >out.txt 2>&1";
  ASSERT_EQ(std::system(line.c_str()), 0) << content(at("s/out.txt"));
  EXPECT_EQ(content(at("s/out.txt")), "");
  EXPECT_NE(content(at("s/residual_seconds.gnuplot.svg")).find("nncg, warm"), std::string::npos);
}

TEST_F(StudyError, RefusesWhatHasNoMeaningAndWritesNothing) {
  fs::create_directories(at("empty"));
  for (const std::string arguments :
       {"missing.toml", "scene.toml --methods newtonian", "scene.toml --tolerances 0",
        "scene.toml --tolerances x", "scene.toml --subdomains 0", "scene.toml --time-steps -1",
        "scene.toml --steps 0", "scene.toml --threads 0", "scene.toml --only both",
        "scene.toml --set solver.tolerances=1", "empty", ""}) {
    const Outcome outcome = run("study error " + arguments);
    EXPECT_EQ(outcome.code, 2) << arguments << outcome.messages;
    EXPECT_NE(outcome.messages.find("error"), std::string::npos) << arguments << outcome.messages;
    EXPECT_EQ(files_below(folder_.path()).size(), 1U) << arguments;
  }
  EXPECT_NE(run("study error scene.toml --methods newtonian").messages.find("nlgs+momentum"),
            std::string::npos)
      << "says what there is";
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
  const Outcome outcome = run("study error scene.toml --out s --only step --at-step 1000");
  EXPECT_EQ(outcome.code, 1);
  EXPECT_NE(outcome.messages.find("--at-step"), std::string::npos) << outcome.messages;
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
}

}  // namespace
}  // namespace talus
