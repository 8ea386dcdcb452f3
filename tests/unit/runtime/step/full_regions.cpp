/// Insertions of more grains than their region has room for.

#include <gtest/gtest.h>

#include "runtime/graph/one_rank.hpp"
#include "runtime/step/simulation.hpp"

namespace talus::full_regions_test {
namespace {

/// Tried all together, a million grains would make 10^11 pairs that overlap: no memory holds them.
TEST(FullRegions, AMillionGrainsWaitForAHandful) {
  talus::Setup setup;
  Stage stage;
  stage.name = "run";
  stage.time_step = 1e-3;
  stage.end.steps = 2;
  setup.stages.push_back(stage);
  InsertRule rule;
  rule.name = "all";
  rule.region.low = {0, 0, 0};
  rule.region.high = {0.03, 0.03, 0.03};
  rule.radii.kind = SizeDistribution::Kind::constant;
  rule.radii.max = 0.005;
  rule.density = 2500;
  rule.count = 1000000;
  setup.inserts.push_back(rule);
  graph::Executor executor({.threads = 1});
  Simulation simulation(setup, Bodies{}, executor);
  simulation.step();
  const InsertReport report = simulation.inserted().front();
  EXPECT_GE(report.placed, 5);
  EXPECT_EQ(report.placed + report.waiting, 1000000);
  EXPECT_EQ(report.no_room, 1);
}

}  // namespace
}  // namespace talus::full_regions_test
