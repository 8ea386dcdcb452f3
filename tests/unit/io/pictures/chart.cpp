// Curves as SVG, and the page they stand in.

#include "io/pictures/chart.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <regex>

#include "io/files/csv_table.hpp"
#include "io/pictures/html_page.hpp"

namespace talus::io {
namespace {

Chart two_curves() {
  return {.name = "residual",
          .title = "Residual < 1 & falling",
          .subtitle = "",
          .x_label = "time  [s]",
          .y_label = "residual  [1]",
          .series = {{"nlgs", {{0.01, 1e-1}, {0.1, 1e-2}, {1, 1e-3}}, 0, 0},
                     {"nlgs, warm", {{0.01, 1e-2}, {0.1, 1e-3}}, 0, 1}},
          .levels = {{1e-2, "tolerance"}}};
}

/// Points of the n-th polyline.
std::vector<std::array<double, 2>> polyline(const std::string& svg, std::size_t n) {
  std::size_t at = 0;
  for (std::size_t k = 0; k <= n; ++k) at = svg.find("points=\"", at) + 8;
  const std::string list = svg.substr(at, svg.find('"', at) - at);
  std::vector<std::array<double, 2>> points;
  static const std::regex pair("([-0-9.]+),([-0-9.]+)");
  for (std::sregex_iterator it(list.begin(), list.end(), pair), end; it != end; ++it)
    points.push_back({std::stod((*it)[1]), std::stod((*it)[2])});
  return points;
}

TEST(Chart, EqualFactorsAreEqualDistancesOnLogarithmicAxes) {
  const auto points = polyline(draw_chart(two_curves()), 0);
  ASSERT_EQ(points.size(), 3U);
  EXPECT_NEAR(points[2][0] - points[1][0], points[1][0] - points[0][0], 0.02);
  EXPECT_NEAR(points[2][1] - points[1][1], points[1][1] - points[0][1], 0.02);
  EXPECT_GT(points[2][1], points[0][1]) << "pixels count downwards: a smaller residual is lower";
  EXPECT_GT(points[2][0], points[0][0]);
}

TEST(Chart, CurvesShareTheirAxes) {
  const std::string svg = draw_chart(two_curves());
  EXPECT_NEAR(polyline(svg, 1)[1][1], polyline(svg, 0)[2][1], 0.02) << "both are 1e-3";
  EXPECT_NEAR(polyline(svg, 1)[1][0], polyline(svg, 0)[1][0], 0.02) << "both are 0.1 s";
}

TEST(Chart, LeavesOutWhatALogarithmCannotShow) {
  Chart chart = two_curves();
  chart.series[0].points.push_back({10, 0});
  chart.series[0].points.push_back({10, std::numeric_limits<double>::quiet_NaN()});
  chart.series[0].points.push_back({-1, 1});
  const std::string svg = draw_chart(chart);
  EXPECT_EQ(polyline(svg, 0).size(), 3U);
  EXPECT_EQ(svg, draw_chart(two_curves()));
}

TEST(Chart, OnePointAndNoneArePictures) {
  Chart chart = two_curves();
  chart.levels.clear();
  chart.series = {{"one", {{0.3, 0.004}}, 0, 0}};
  const std::string one = draw_chart(chart);
  EXPECT_EQ(one.find("nan"), std::string::npos);
  EXPECT_EQ(one.find("inf"), std::string::npos);
  EXPECT_NE(one.find("<circle"), std::string::npos);
  chart.series.clear();
  EXPECT_NE(draw_chart(chart).find("No data"), std::string::npos);
}

TEST(Chart, ValuesOfAnySizeHavePlacesInThePicture) {
  Chart chart = two_curves();
  chart.levels.clear();
  chart.log_x = chart.log_y = false;
  chart.series = {{"large", {{0, 1e17}, {1, 1e17}}, 0, 0}};
  const std::string large = draw_chart(chart);
  EXPECT_EQ(large.find("nan"), std::string::npos);
  EXPECT_EQ(large.find("inf"), std::string::npos);
  chart.series = {{"small", {{0, 1e-20}, {1, 3e-20}}, 0, 0}};
  const auto small = polyline(draw_chart(chart), 0);
  ASSERT_EQ(small.size(), 2U);
  EXPECT_GT(small[0][1], small[1][1] + 100) << "forces between grains of a nanometre are no straight line";
}

TEST(Chart, AStaircaseHoldsItsValueUpToTheNextPoint) {
  Chart chart = two_curves();
  chart.staircase = true;
  const auto points = polyline(draw_chart(chart), 0);
  ASSERT_EQ(points.size(), 6U);
  EXPECT_EQ(points[1][1], points[0][1]);
  EXPECT_EQ(points[1][0], points[2][0]);
  EXPECT_EQ(points[5][1], points[4][1]) << "the last value holds up to the edge";
}

TEST(Chart, AnAxisWritesItsPowersInOneWay) {
  Chart chart = two_curves();
  chart.levels.clear();
  chart.series = {{"wide", {{1e-6, 1e-5}, {1, 1}}, 0, 0}};
  const std::string wide = draw_chart(chart);
  EXPECT_NE(wide.find("10⁻⁵"), std::string::npos);
  EXPECT_EQ(wide.find(">0.01<"), std::string::npos);
  chart.series = {{"narrow", {{1e-3, 1e-3}, {1, 1}}, 0, 0}};
  const std::string narrow = draw_chart(chart);
  EXPECT_NE(narrow.find(">0.001<"), std::string::npos);
  EXPECT_EQ(narrow.find("10⁻"), std::string::npos);
}

TEST(Chart, ACurveUnderAnotherIsSeenOnBothSidesOfIt) {
  Chart chart = two_curves();
  chart.series[1].points = chart.series[0].points;
  const std::string svg = draw_chart(chart);
  std::vector<double> widths;
  for (std::size_t at = svg.find("<polyline"); at != std::string::npos; at = svg.find("<polyline", at + 1))
    widths.push_back(std::stod(svg.substr(svg.find("stroke-width=\"", at) + 14)));
  ASSERT_EQ(widths.size(), 2U);
  EXPECT_GT(widths[0], widths[1] + 0.5);
}

TEST(CsvTable, QuotesWhatItMustAndKeepsEveryDigit) {
  CsvTable table({"name", "value"});
  table.row("a,b", 0.1 + 0.2);
  table.row(std::string("c"), std::int64_t{7});
  EXPECT_EQ(table.text(), "name,value\n\"a,b\",0.30000000000000004\nc,7\n");
}

TEST(HtmlPage, HoldsThePictureAndEscapesTheRest) {
  const std::string page =
      html_page("a < b", "one & two", {{"Part", "x > y", draw_chart(two_curves()), {{"<c>"}, {{"1&2"}}}}});
  EXPECT_NE(page.find("<h1>a &lt; b</h1>"), std::string::npos);
  EXPECT_NE(page.find("<p>one &amp; two</p>"), std::string::npos);
  EXPECT_NE(page.find("<th>&lt;c&gt;</th>"), std::string::npos);
  EXPECT_NE(page.find("<td>1&amp;2</td>"), std::string::npos);
  EXPECT_NE(page.find("<svg"), std::string::npos);
  EXPECT_EQ(page.find("<?xml"), std::string::npos) << "a declaration is not allowed inside a page";
  EXPECT_EQ(page.find("src="), std::string::npos) << "nothing is fetched from elsewhere";
}

}  // namespace
}  // namespace talus::io
