// The figures that docs/tutorial.md gives of the demo are those of the demo.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <regex>

#include "io/results/csv_reader.hpp"
#include "tests/validation/commands/command_helpers.hpp"

namespace talus::tutorial_test {
namespace {

using namespace talus::test;

/// The numbers that the tutorial has in place of the groups of a pattern; spaces stand for any white space.
std::vector<double> figures(const std::string& page, const std::string& pattern) {
  std::smatch found;
  const std::string spaced = std::regex_replace(pattern, std::regex(" "), "\\s+");
  EXPECT_TRUE(std::regex_search(page, found, std::regex(spaced))) << pattern;
  std::vector<double> numbers;
  for (std::size_t k = 1; k < found.size(); ++k)
    numbers.push_back(std::stod(std::regex_replace(found[k].str(), std::regex(","), "")));
  return numbers;
}

TEST(Tutorial, GivesTheFiguresOfTheDemo) {
  const ScratchDirectory scratch;
  const Outcome ran = run(scratch.path(), "run '" TALUS_SOURCE_DIR
                                          "/apps/scenes/demo.toml' --out out --threads 1 "
                                          "--quiet");
  ASSERT_EQ(ran.code, 0) << ran.messages;
  const std::string page = content(TALUS_SOURCE_DIR "/docs/tutorial.md");
  const io::TableColumns steps =
      io::read_columns(scratch / "out/steps.csv",
                       {"iterations", "contacts", "error_rms", "penetration_mean", "penetration_max"});
  const std::vector<double>& sweeps = steps["iterations"];
  const double all_sweeps = std::accumulate(sweeps.begin(), sweeps.end(), 0.0);
  const auto count = static_cast<double>(sweeps.size());

  const auto run_size = figures(page, "It is ([0-9]+) time steps and ([0-9,]+) sweeps");
  EXPECT_EQ(run_size[0], count);
  EXPECT_NEAR(run_size[1], all_sweeps, 500);
  const auto line = figures(page, "step 635 t 635 ms ([0-9]+) contacts ([0-9]+) it err ([0-9.e-]+) ");
  EXPECT_EQ(line[0], steps["contacts"][634]);
  EXPECT_EQ(line[1], sweeps[634]);
  EXPECT_NEAR(line[2], steps["error_rms"][634], 0.05e-4);
  const auto iterations = figures(page, "`iterations`: ([0-9]+) on average in the demo, and ([0-9]+) in");
  EXPECT_NEAR(iterations[0], all_sweeps / count, 0.5);
  EXPECT_EQ(iterations[1], *std::ranges::max_element(sweeps));
  const auto overlaps = figures(page, "in the demo ([0-9.]+) % on average and ([0-9]+) % at worst");
  const std::vector<double>& overlap = steps["penetration_mean"];
  EXPECT_NEAR(overlaps[0], 100 * std::accumulate(overlap.begin(), overlap.end(), 0.0) / count, 0.005);
  EXPECT_NEAR(overlaps[1], 100 * *std::ranges::max_element(steps["penetration_max"]), 0.5);

  const io::TableColumns triaxial = io::read_columns(
      scratch / "out/triaxial.csv", {"q_over_p", "strain_z", "strain_volume", "solid_fraction"}, "stage");
  const auto shear =
      static_cast<std::size_t>(std::ranges::find(triaxial.texts, "shear") - triaxial.texts.begin());
  const auto begin = triaxial["q_over_p"].begin() + static_cast<std::ptrdiff_t>(shear);
  const auto peak = std::max_element(begin, triaxial["q_over_p"].end());
  const auto row = static_cast<std::size_t>(peak - triaxial["q_over_p"].begin());
  const auto curve = figures(page, "q/p peaks at ([0-9.]+) after ([0-9]+) %, .* grows by ([0-9]+) %");
  EXPECT_NEAR(curve[0], *peak, 0.005);
  EXPECT_NEAR(curve[1], -100 * triaxial["strain_z"][row], 0.5);
  EXPECT_NEAR(curve[2], 100 * triaxial["strain_volume"].back(), 0.5);
  EXPECT_NEAR(figures(page, "solid fraction ([0-9.]+) in a box")[0], triaxial["solid_fraction"][shear - 1],
              0.0005);
}

}  // namespace
}  // namespace talus::tutorial_test
