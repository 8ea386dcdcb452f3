// The page of a run, from a directory of files.

#include "apps/report/run_report.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <regex>
#include <string>

#include "apps/report/sections.hpp"
#include "io/files/error.hpp"
#include "io/scene/scene.hpp"
#include "tests/unit/io/results/output_helpers.hpp"

namespace talus::run_report_test {
namespace {

using test::ScratchDirectory;

void write(const std::filesystem::path& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

constexpr const char* scene_text = R"(
name = "fall"
description = "Two <balls> & a floor"
time_step = 1e-3
gravity = [0, 0, -9.81]
[material]
density = 2600
friction = 0.3
[sample]
kind = "lattice"
cells = [1, 1, 2]
radius = 0.01
[[wall]]
name = "floor"
side = "z-"
[[stage]]
name = "down"
end = { steps = 3 }
)";

/// A run of three steps, the second of which missed; "NaN" and a cut line are what a run may leave, too.
void make_run(const ScratchDirectory& scratch, const std::string& status, const std::string& more = "") {
  const io::Scene scene = io::parse_scene(scene_text + more, "fall.toml");
  write(scratch / "scene.resolved.toml", io::resolved_scene(scene));
  write(
      scratch / "run.json",
      R"({"provenance": {"version": "1.2", "git_hash": "abc", "command_line": ["talus", "run", "my scene.toml"],
            "seed": 7}, "summary": {"status": ")" +
          status + R"(", "digest": "0123456789abcdef", "message": "", "steps": 3}})");
  write(scratch / "steps.csv",
        "step,time,time_step,contacts,active,iterations,error_rms,error_max,balance,velocity_error,overlap,"
        "kinetic_translation,kinetic_rotation,wall_s,converged\n"
        "1,0.001,0.001,1,1,10,1e-4,1e-3,1e-3,0.8,0,1,0,0.01,1\n"
        "2,0.002,0.001,1,1,10,5e-2,0.5,nan,0.9,0,1,0,0.01,0\n"
        "3,0.003,0.001,1,1,10,1e-4,1e-3,1e-3,0.1,0,1,0,0.01,1\n"
        "4,0.00");
  write(scratch / "walls.csv",
        "step,time,wall,position,velocity,force_x,force_y,force_z\n1,0.001,floor,0,0,0,3,4\n2,0.002,floor,0,"
        "0,0,0,1\n");
}

bool has(const std::string& page, const std::string& text) {
  return page.find(text) != std::string::npos;
}

TEST(RunReport, SaysWhatWasRunAndHowManyStepsMissed) {
  const ScratchDirectory scratch;
  make_run(scratch, "done");
  const std::string page = run_report(scratch.path());
  EXPECT_TRUE(has(page, "The run is done. 1 of 3 steps missed a tolerance."))
      << "a step without its end is no step";
  EXPECT_TRUE(has(page, "Two &lt;balls&gt; &amp; a floor")) << "texts are escaped";
  EXPECT_TRUE(has(page, "2 grains of radius 10 mm on a lattice"));
  EXPECT_TRUE(has(page, "until 3 steps; time step 1 ms; friction 0.3, at walls 0; gravity 9.81 m/s²"));
  EXPECT_TRUE(has(page, "talus run &apos;my scene.toml&apos;") || has(page, "talus run 'my scene.toml'"));
  EXPECT_TRUE(has(page, "0123456789abcdef"));
  EXPECT_TRUE(has(page, "tolerance 0.001")) << "it is drawn";
}

TEST(RunReport, OfARunThatHasEndedIsRefusedWhereItsStepsAreNotThere) {
  const ScratchDirectory scratch;
  const std::string header = "step,time,converged\n";
  for (const char* status : {"done", "stopped"})
    for (const std::string& steps :
         {std::string(), header, header + "1,0.1,1\n2,0.2,1\n", "a,b\n1,2\n" + header}) {
      make_run(scratch, status);
      write(scratch / "steps.csv", steps);
      EXPECT_THROW(run_report(scratch.path()), io::FileError) << status << ": " << steps;
    }
  make_run(scratch, "done");
  std::filesystem::remove(scratch / "steps.csv");
  EXPECT_THROW(run_report(scratch.path()), io::FileError);
  make_run(scratch, "failed");
  write(scratch / "steps.csv", header + "1,0.1,1\n2,0.2,1\n3,0.3,1\n4,0.4,0\n");
  EXPECT_TRUE(has(run_report(scratch.path()), "1 of 4 steps missed"))
      << "it may have failed before it was told";
  write(scratch / "steps.csv", header + "1,0.1,1\n2,0.2,1\n");
  EXPECT_TRUE(has(run_report(scratch.path()), "steps.csv has 2 of its 3 steps"))
      << "or before they were written, on a full disk";
}

TEST(RunReport, DrawsABoundOfVelocitiesWithFrictionWhereTheSceneSetsOne) {
  const ScratchDirectory unset, set;
  make_run(unset, "done");
  make_run(set, "done", "[solver]\nvelocity_tolerance = 0.37\n");
  const std::string without = run_report(unset.path()), with = run_report(set.path());
  EXPECT_TRUE(has(without, "Error of velocities"));
  EXPECT_TRUE(has(with, "tolerance 0.37"));
  EXPECT_TRUE(has(with, "beyond its tolerance: 2"));
  // Steps are swept for 0.5 there, and more may be told of one that converged.
  EXPECT_FALSE(has(without, "tolerance 0.5") || has(without, "beyond its tolerance: 2"));
}

TEST(RunReport, IsWrittenWhileTheRunGoesOn) {
  const ScratchDirectory scratch;
  make_run(scratch, "running");
  write(scratch / "status.json", R"({"stage": "down", "stage_fraction": 0.5})");
  EXPECT_TRUE(has(run_report(scratch.path()), "Stage &apos;down&apos;, 50 % done.") ||
              has(run_report(scratch.path()), "Stage 'down', 50 % done."));
  std::filesystem::remove(scratch / "steps.csv");
  std::filesystem::remove(scratch / "walls.csv");
  EXPECT_TRUE(has(run_report(scratch.path()), "No step has ended.")) << "a run that has just begun";
}

TEST(RunReport, DrawsACurveOfEachProbeAndOfTheCellWhereThereAreSome) {
  const ScratchDirectory scratch;
  make_run(scratch, "done");
  EXPECT_FALSE(has(run_report(scratch.path()), "Probes") || has(run_report(scratch.path()), "Periodic cell"));
  write(
      scratch / "probes.csv",
      "step,time,probe,count,solid_fraction,vx,vy,vz,temperature,coordination,stress_xx,stress_yy,stress_zz,"
      "passed_mass,mass_rate\n"
      "1,0.1,bed,5,0.5,0,0,-1,0,4,1,1,1,0,0\n1,0.1,hole,0,0,0,0,0,0,0,0,0,0,0.5,0.1\n"
      "2,0.2,bed,6,0.6,0,0,-1,0,4,1,1,1,0,0\n2,0.2,hole,0,0,0,0,0,0,0,0,0,0,0.6,0.2\n");
  write(
      scratch / "cell.csv",
      "step,time,stage,stress_xx,stress_yy,stress_zz,stress_xy,stress_xz,stress_yz,p,q_over_p,solid_fraction,"
      "contacts_a_grain,coordination,inertial_number\n"
      "1,0.1,squeeze,1,1,1,0,0,0,1,0,0.5,4,5,0\n2,0.2,shear,1,1,1,0,0.4,0,1,0.7,0.6,4,5,0.1\n");
  const std::string page = run_report(scratch.path());
  const std::size_t probes = page.find("Probes"), flow = page.find("mass rate [kg/s]");
  EXPECT_LT(probes, flow);
  EXPECT_LT(flow, page.find("Grains in regions"));
  EXPECT_EQ(page.find(">bed<", flow), page.find(">bed<", page.find("Grains in regions")))
      << "a probe without a flow has no curve of it";
  EXPECT_FALSE(has(page, "Granular temperature")) << "what is 0 everywhere is not drawn";
  EXPECT_LT(page.find("Periodic cell"), page.find("Inertial number"));
}

TEST(RunReport, IsRefusedWhereNoRunWasBegun) {
  const ScratchDirectory scratch;
  EXPECT_THROW(run_report(scratch.path()), std::invalid_argument);
}

TEST(RunReport, AsksNothingOfTheNetwork) {
  const ScratchDirectory scratch;
  make_run(scratch, "done");
  const std::string page = run_report(scratch.path());
  EXPECT_FALSE(has(page, "<script"));
  for (std::size_t at = page.find("http"); at != std::string::npos; at = page.find("http", at + 1))
    EXPECT_EQ(page.compare(at, 26, "http://www.w3.org/2000/svg"), 0) << page.substr(at, 60);
}

/// Luminance of "#rrggbb" by WCAG 2.
double luminance(const std::string& colour) {
  const double weight[] = {0.2126, 0.7152, 0.0722};
  double sum = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const double c = std::stoi(colour.substr(1 + 2 * k, 2), nullptr, 16) / 255.0;
    sum += weight[k] * (c <= 0.03928 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4));
  }
  return sum;
}

TEST(RunReport, TextHasAContrastOfFourAndAHalfInLightAndInDark) {
  const ScratchDirectory scratch;
  make_run(scratch, "done");
  const std::string page = run_report(scratch.path());
  const std::size_t dark = page.find("prefers-color-scheme: dark");
  ASSERT_NE(dark, std::string::npos);
  for (const std::string& style : {page.substr(0, dark), page.substr(dark)}) {
    const auto colour = [&](const std::string& name) {
      std::smatch found;
      EXPECT_TRUE(std::regex_search(style, found, std::regex("--" + name + ": (#[0-9a-f]{6})"))) << name;
      return found.empty() ? std::string("#000000") : found[1].str();
    };
    for (const char* text : {"ink", "soft", "link"})
      for (const char* ground : {"paper", "card"}) {
        const double a = luminance(colour(text)), b = luminance(colour(ground));
        EXPECT_GE((std::max(a, b) + 0.05) / (std::min(a, b) + 0.05), 4.5) << text << " on " << ground;
      }
  }
}

TEST(RunReport, AStretchOfRowsIsDrawnByItsLargestValue) {
  std::vector<double> x(100000), y(100000, 1.0);
  for (std::size_t k = 0; k < x.size(); ++k) x[k] = static_cast<double>(k);
  y[54321] = 7;
  const auto points = thinned(x, y, Thinned::largest);
  EXPECT_LE(points.size(), 500U);
  EXPECT_EQ(std::count(points.begin(), points.end(), std::array<double, 2>{54321, 7}), 1);
}

}  // namespace
}  // namespace talus::run_report_test
