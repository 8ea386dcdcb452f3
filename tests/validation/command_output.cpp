/// What `[output]` thins, seen from outside.

#include <gtest/gtest.h>

#include <string>

#include "io/results/results.hpp"
#include "tests/validation/command_helpers.hpp"

namespace talus::command_output_test {
namespace {

using namespace test;

class ThinnedOutput : public CommandTest {};

TEST_F(ThinnedOutput, HasEveryThirdLineOfWallsAndStressesAndEveryLineOfSteps) {
  write(at("scene.toml"), pressed_box);
  ASSERT_EQ(run("run scene.toml --out all").code, 0);
  ASSERT_EQ(run("run scene.toml --out thin --set output.tables_every=3").code, 0);
  EXPECT_EQ(summary(at("thin")).at("digest"), summary(at("all")).at("digest"));
  for (const char* name : {"walls.csv", "triaxial.csv"}) {
    const Table all = read_table(at("all") / name), thin = read_table(at("thin") / name);
    std::size_t next = 0;
    for (const auto& row : all.rows)
      if (std::stoi(row.at("step")) % 3 == 0) {
        ASSERT_LT(next, thin.rows.size()) << name;
        EXPECT_EQ(thin.rows[next++], row) << name;
      }
    EXPECT_EQ(next, thin.rows.size()) << name;
    EXPECT_GT(next, 0U) << name;
  }
  EXPECT_EQ(read_table(at("thin/steps.csv")).rows.size(), 12U);
}

TEST_F(ThinnedOutput, HasContactsInEverySecondFrame) {
  write(at("scene.toml"), pressed_box);
  ASSERT_EQ(run("run scene.toml --out out --set output.contacts_every=2 --set output.every_steps=2").code, 0);
  const fs::path results = at("out/results.h5");
  const std::size_t frames = io::frame_count(results);
  ASSERT_GT(frames, 4U);
  std::size_t with = 0;
  for (std::size_t k = 1; k < frames; ++k) {
    const bool has = !io::read_frame(results, k).contact_bodies.empty();
    EXPECT_EQ(has, k % 2 == 0) << k;
    with += has ? 1 : 0;
  }
  EXPECT_GT(with, 1U);
}

}  // namespace
}  // namespace talus::command_output_test
