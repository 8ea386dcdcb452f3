/// probes.csv and the fields of frames as files.

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include "io/output/recorder.hpp"
#include "io/output/sinks.hpp"
#include "tests/unit/io/results/output_helpers.hpp"

namespace talus::io::probe_sink_test {
namespace {

using namespace talus::test;
namespace fs = std::filesystem;

std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells;
  std::istringstream text(line);
  for (std::string cell; std::getline(text, cell, ',');) cells.push_back(cell);
  return cells;
}

TEST(ProbeSink, WritesARowForEachReportWithColumnsOfEachMaterial) {
  const ScratchDirectory scratch;
  talus::Setup setup;
  setup.material_names = {"glass", "steel"};
  Recorder recorder(output_context(scratch.path(), setup), {});
  recorder.open();
  ProbeReport report;
  report.name = "gate";
  report.contact_stress(1, 2) = 12;
  report.kinetic_stress(0, 2) = 7;
  report.passed_mass = 0.5;
  report.materials.resize(2);
  report.materials[1].passed_count = 3;
  EXPECT_FALSE(fs::exists(scratch / "probes.csv"));
  recorder.record_step({.step = {.step = 4, .time = 0.25}, .probes = {report, report}});
  recorder.record_step({.step = {.step = 5}});
  recorder.close();
  std::istringstream lines(content_of(scratch / "probes.csv"));
  std::string header, row, other, none;
  std::getline(lines, header);
  std::getline(lines, row);
  std::getline(lines, other);
  EXPECT_EQ(row, other);
  EXPECT_FALSE(std::getline(lines, none));
  const std::vector<std::string> names = cells_of(header), cells = cells_of(row);
  ASSERT_EQ(names.size(), cells.size());
  const auto cell = [&](const std::string& name) {
    return cells.at(static_cast<std::size_t>(std::ranges::find(names, name) - names.begin()));
  };
  EXPECT_EQ(cell("step"), "4");
  EXPECT_EQ(cell("time"), "0.25");
  EXPECT_EQ(cell("probe"), "gate");
  EXPECT_EQ(cell("stress_yz"), "12");
  EXPECT_EQ(cell("stress_zy"), "0");
  EXPECT_EQ(cell("kinetic_xz"), "7");
  EXPECT_EQ(cell("passed_mass"), "0.5");
  EXPECT_EQ(cell("passed_count_glass"), "0");
  EXPECT_EQ(cell("passed_count_steel"), "3");
}

TEST(GridSink, WritesTheFieldsOfEachFrameAndTheirTimes) {
  const ScratchDirectory scratch;
  talus::Setup setup;
  setup.fields = {{"flow", {0, 0, -1}, {1, 2, 1}, {2, 1, 1}, 2}};
  Recorder recorder(output_context(scratch.path(), setup), {});
  recorder.open();
  Frame frame;
  frame.time = 0.5;
  frame.grids = {{"flow", {{0, 0, -1}, {0.5, 2, 2}, {2, 1, 1}}, {std::vector<double>(2 * GridSums::width)}}};
  frame.grids[0].sums.numbers[GridSums::width + GridSums::density] = 1;
  recorder.record_frame(std::move(frame));
  recorder.close();
  const std::string text = content_of(scratch / "fields/field_flow_000000.vti");
  EXPECT_NE(text.find(R"(<ImageData WholeExtent="0 2 0 1 0 1" Origin="0 0 -1" Spacing="0.5 2 2">)"),
            std::string::npos);
  // Sixteen bytes, 0 and 1, behind their number.
  EXPECT_NE(
      text.find(R"(Name="density" NumberOfComponents="1" format="binary">EAAAAAAAAAAAAAAAAAAAAAAAAAAAAPA/<)"),
      std::string::npos)
      << text;
  EXPECT_NE(content_of(scratch / "fields/field_flow.pvd")
                .find(R"(timestep="0.5" part="0" file="field_flow_000000.vti")"),
            std::string::npos);
  for (const char* name : {"probes.csv", "fields/field_flow_000000.vti", "fields/field_flow.pvd"})
    EXPECT_TRUE(is_output_name(name)) << name;
  EXPECT_FALSE(is_output_name("fields/flow.vti"));
  EXPECT_FALSE(is_output_name("fields/field_a/b.vti"));
}

}  // namespace
}  // namespace talus::io::probe_sink_test
