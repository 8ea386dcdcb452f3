// Pictures of frames.

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "io/files/detail/with_unit.hpp"
#include "io/pictures/detail/svg.hpp"
#include "io/pictures/picture.hpp"
#include "runtime/graph/one_rank.hpp"
#include "tests/unit/io/results/output_helpers.hpp"

namespace talus::io {
namespace {

using namespace talus::test;

TEST(Picture, DrawsTheGrainsAndForcesOfTheSlabOnly) {
  Frame frame = three_grains();
  frame.x[2].y() = 5;  // far outside of the slab about the middle of the others
  frame.x[0].y() = -4.9;
  const auto setup = setup_with_two_walls();
  const std::string all = draw_forces(three_grains(), setup.walls, {});
  EXPECT_TRUE(well_formed(all));
  EXPECT_EQ(occurrences(all, "<circle"), 3u);
  EXPECT_NE(all.find("3 grains, 2 contacts"), std::string::npos);
  const std::string one = draw_forces(frame, setup.walls, {});
  EXPECT_EQ(occurrences(one, "<circle"), 1u);
  EXPECT_NE(one.find("1 grains, 0 contacts"), std::string::npos);
  EXPECT_EQ(one.find("nan"), std::string::npos);
}

// What a rank gathers for the pictures is as small as they are, and they are the same.
TEST(Picture, OfASlabIsThatOfTheWholeSample) {
  Frame frame = three_grains();
  frame.x[2].y() = 5;
  frame.x[0].y() = -4.9;
  const auto setup = setup_with_two_walls();
  const auto [slab, sample] = gather_slab(frame, graph::one_rank());
  EXPECT_EQ(slab.id.size(), 1U);
  EXPECT_EQ(sample.grains, 3);
  EXPECT_EQ(draw_forces(slab, setup.walls, {.sample = sample}), draw_forces(frame, setup.walls, {}));
  EXPECT_EQ(draw_velocities(slab, {.walls = setup.walls, .sample = sample}),
            draw_velocities(frame, {.walls = setup.walls}));
}

/// Widths of the lines of forces in order, those of the legend last.
std::vector<double> force_widths(const std::string& svg) {
  std::vector<double> widths;
  for (const std::string& line : split(svg, '\n'))
    for (const char* colour : {"#e8a27c", "#d3652f", "#8f2d0c"})
      if (line.starts_with("<line") && line.find(colour) != std::string::npos)
        widths.push_back(std::stod(line.substr(line.find("stroke-width=\"") + 14)));
  return widths;
}

TEST(Picture, ForcesFarBelowTheLoadOfTheSceneAreDrawnThinAndSaidToBeSmall) {
  const auto setup = setup_with_two_walls();
  const std::string loaded = draw_forces(three_grains(), setup.walls, {});
  const std::string noise = draw_forces(three_grains(), setup.walls, {.load = {.pressure = 1e5}});
  EXPECT_GT(force_widths(loaded).front(), 1);
  EXPECT_LT(force_widths(noise).front(), 0.1 * force_widths(loaded).front());
  EXPECT_NE(noise.find("hardly loaded"), std::string::npos);
  EXPECT_EQ(loaded.find("hardly loaded"), std::string::npos);
}

TEST(Picture, NamesItsAxesAndItsLegendDoesNotCollide) {
  Frame frame = three_grains();
  for (Vec3& force : frame.contact_force) force *= 123456.789;
  const std::string svg = draw_forces(frame, setup_with_two_walls().walls, {});
  EXPECT_TRUE(well_formed(svg));
  EXPECT_EQ(occurrences(svg, ">x</text>"), 1u);
  EXPECT_EQ(occurrences(svg, ">z</text>"), 1u);
  double last_end = 0;
  for (const std::string& line : split(svg, '\n')) {
    if (!line.starts_with("<text") || !line.ends_with("N</text>")) continue;
    const double x = std::stod(line.substr(9));
    const std::string text = line.substr(line.find('>') + 1, line.rfind("</") - line.find('>') - 1);
    EXPECT_GT(x, last_end) << text;
    last_end = x + detail::text_width(text, 12);
  }
  EXPECT_GT(last_end, 0);
}

TEST(Picture, ShowsTheWholeOfARoundWallAboutFewGrains) {
  Wall shell;
  shell.name = "shell";
  shell.shape = {"cylinder",
                 {.number = {{"start", {0, -1, 0}}, {"end", {0, 1, 0}}, {"radius", {1}}, {"inside", {1}}},
                  .file = "",
                  .triangles = {}},
                 nullptr};
  make_surface(shell.shape);
  Frame frame = three_grains();
  frame.contact_bodies.clear(), frame.contact_point.clear(), frame.contact_normal.clear();
  frame.contact_gap.clear(), frame.contact_force.clear();
  frame.x = {Vec3(-0.5, 0, -0.6), Vec3(0, 0, -0.7), Vec3(0.5, 0, -0.6)};
  frame.walls = {WallReport{"shell"}};
  const std::vector<Wall> walls{shell};
  const std::string svg = draw_velocities(frame, {.walls = walls});
  // A line for each flat of the shell that reaches into the view, and the scale; grains alone show none.
  EXPECT_GT(occurrences(svg, "stroke-width=\"3.00\""), 20u);
  EXPECT_EQ(occurrences(draw_velocities(frame, {}), "stroke-width=\"3.00\""), 1u);
}

TEST(Picture, OfAPartitionColoursGrainsBySubdomainAndByMultiplicity) {
  const std::vector<std::int32_t> subdomain{0, 1, 1}, multiplicity{1, 2, 9};
  const std::string text = draw_partition(three_grains(), subdomain, multiplicity, {"a <b>", 2, 0});
  EXPECT_TRUE(well_formed(text));
  EXPECT_NE(text.find("a &lt;b&gt;"), std::string::npos);
  EXPECT_EQ(occurrences(text, "<circle"), 3u + 3u + 5u);  // either panel, and the legend
  std::map<std::string, int> fills;
  for (const std::string& line : split(text, '\n'))
    if (line.starts_with("<circle")) ++fills[split(line, '"')[7]];
  EXPECT_EQ(fills["#10151a"], 2);  // m = 9 shares the darkest grey with 5: a grain and the legend
  std::multiset<int> counts;
  for (const auto& [fill, count] : fills) counts.insert(count);
  EXPECT_EQ(counts, (std::multiset<int>{1, 1, 1, 2, 2, 2, 2})) << "two subdomains: once and twice";
  EXPECT_THROW(draw_partition(three_grains(), subdomain, {}, {}), std::invalid_argument);
}

TEST(Picture, OfNothingIsStillAPicture) {
  EXPECT_TRUE(well_formed(draw_partition(Frame{}, {}, {}, {})));
  EXPECT_TRUE(well_formed(draw_forces(Frame{}, {}, {})));
  const std::string text = draw_triaxial({}, {});
  EXPECT_TRUE(well_formed(text));
  EXPECT_NE(text.find("No data yet"), std::string::npos);
}

TEST(Picture, OfATriaxialTestShowsOneStageAndLeavesOutWhatIsNotFinite) {
  std::vector<TriaxialReport> reports;
  for (int k = 0; k <= 10; ++k) {
    TriaxialReport report = triaxial_row(k, "shear <1>");
    report.strain = {0, 0, -0.01 * k};
    report.q_over_p = 0.1 * k;
    report.strain_volume = 0.001 * k;
    reports.push_back(report);
  }
  reports[4].q_over_p = std::numeric_limits<double>::quiet_NaN();
  reports.push_back(triaxial_row(11, "unloading"));
  reports.back().strain = {9, 9, 9};
  const std::string text = draw_triaxial(reports, {.stage = "shear <1>", .axis = 2});
  EXPECT_TRUE(well_formed(text));
  EXPECT_NE(text.find("shear &lt;1&gt;"), std::string::npos);
  EXPECT_NE(text.find("peak q/p = 1.000 at 10 %"), std::string::npos);
  EXPECT_EQ(text.find("nan"), std::string::npos);
  const std::size_t begin = text.find("points=\"") + 8;
  EXPECT_EQ(occurrences(text.substr(begin, text.find('"', begin) - begin), ","), 10u);
}

// What a step gives that missed its tolerance is no result: neither peak nor last value.
TEST(Picture, OfATriaxialTestTakesItsPeakFromStepsThatConverged) {
  std::vector<TriaxialReport> reports;
  for (int k = 0; k <= 10; ++k) {
    TriaxialReport report = triaxial_row(k, "shear");
    report.strain = {0, 0, -0.01 * k};
    report.q_over_p = k == 5 || k == 10 ? 7 : 0.1 * k;
    report.converged = k != 5 && k != 10;
    reports.push_back(report);
  }
  const std::string text = draw_triaxial(reports, {.stage = "shear", .axis = 2});
  EXPECT_TRUE(well_formed(text));
  EXPECT_NE(text.find("peak q/p = 0.900 at 9 %;  at 9 %: q/p = 0.900"), std::string::npos) << text;
  EXPECT_NE(text.find("2 of 11 steps drawn missed their tolerance"), std::string::npos);
  for (TriaxialReport& report : reports) report.converged = true;
  const std::string sound = draw_triaxial(reports, {.stage = "shear", .axis = 2});
  EXPECT_EQ(sound.find("missed"), std::string::npos);
  EXPECT_EQ(occurrences(text, "<circle"), occurrences(sound, "<circle") + 2 * 2) << "a mark in both diagrams";
  for (TriaxialReport& report : reports) report.converged = false;
  EXPECT_NE(draw_triaxial(reports, {.stage = "shear", .axis = 2}).find("no step converged"),
            std::string::npos);
}

TEST(Ticks, AreRoundAndCoverTheRange) {
  EXPECT_EQ(detail::nice_ticks(0, 10, 5), (std::vector<double>{0, 2, 4, 6, 8, 10}));
  const auto ticks = detail::nice_ticks(-0.03, 0.91, 5);
  EXPECT_LE(ticks.front(), -0.03);
  EXPECT_GE(ticks.back(), 0.91);
}

TEST(Units, HavePrefixes) {
  EXPECT_EQ(detail::with_unit(1234, "Pa"), "1.23 kPa");
  EXPECT_EQ(detail::with_unit(0.001, "s"), "1 ms");
  EXPECT_EQ(detail::with_unit(-2.5e-6, "m"), "-2.5 µm");
  EXPECT_EQ(detail::with_unit(0.99996, "m"), "1 m");
  EXPECT_EQ(detail::with_unit(0, "N"), "0 N");
}

}  // namespace
}  // namespace talus::io
