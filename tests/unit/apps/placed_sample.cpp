#include "apps/shared/placed_sample.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "apps/study_error/study_variants.hpp"
#include "io/results/results.hpp"
#include "tests/unit/io/results/output_helpers.hpp"

namespace talus {
namespace {

// Two grains of a cell that press one another along x by 3 N over a branch of 0.02 m, in 0.1 m x 0.1 m x 0.1
// m: studies and runs begin from 60 Pa.
TEST(PlacedSample, OfAStateBringsTheStressOfItsContactsAlongForStudiesToo) {
  const test::ScratchDirectory folder;
  Frame frame;
  frame.domain = periodic_domain({0.1, 0.1, 0.1});
  frame.id = {0, 1};
  frame.x = {{0.095, 0.05, 0.05}, {0.015, 0.05, 0.05}};  // across a face
  frame.radius = {0.01, 0.01};
  frame.u = {Vec3::Zero(), Vec3::Zero()};
  frame.omega = frame.u;
  frame.contact_bodies = {{0, 1}};
  frame.contact_force = {{-3, 0, 0}};
  frame.contact_normal = {{-1, 0, 0}};
  frame.contact_point = {{0.005, 0.05, 0.05}};
  frame.contact_gap = {0};
  io::ResultsWriter(folder / "results.h5", {}).append(frame);
  std::ofstream(folder / "scene.toml") << R"(
[material]
density = 2600
[cell]
lengths = [0.1, 0.1, 0.1]
[sample]
kind = "state"
file = "results.h5"
[[stage]]
time_step = 1e-4
stress = { xx = 1e3, yy = 1e3, zz = 1e3, ramp_time = 1 }
end = { steps = 1 }
)";
  io::Scene scene = io::load_scene((folder / "scene.toml").string());
  const PlacedSample placed = place_sample(scene);
  EXPECT_EQ(placed.sample.size(), 2u);
  ASSERT_EQ(placed.forces.size(), 1u);
  EXPECT_NEAR(scene.setup.stress_at_start[0], 3 * 0.02 / 1e-3, 1e-9);
  EXPECT_EQ(scene.setup.stress_at_start[1], 0);
  EXPECT_EQ(study_sample((folder / "scene.toml").string(), {}, 1).scene.setup.stress_at_start,
            scene.setup.stress_at_start);
  // What is wrong with the file is said where the scene names it.
  scene.samples.front().frame = 99;
  try {
    place_sample(scene);
    FAIL() << "there is one frame";
  } catch (const io::SceneError& error) {
    EXPECT_NE(std::string(error.what()).find("scene.toml:8: sample.file: "), std::string::npos)
        << error.what();
  }
}

}  // namespace
}  // namespace talus
