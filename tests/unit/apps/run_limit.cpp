#include "apps/commands/run_limit.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

namespace talus {
namespace {

TEST(WallLimit, ReadsTimesAsBatchSystemsWriteThem) {
  EXPECT_EQ(parse_duration("3:50:00"), 13800);
  EXPECT_EQ(parse_duration("50:30"), 3030);
  EXPECT_EQ(parse_duration("90:00"), 5400);
  EXPECT_EQ(parse_duration("0:99"), 99);
  EXPECT_EQ(parse_duration("1-02:00:00"), 93600);
  for (const char* text : {"", "60", "a:b", "1:2:3:4", "0:00", "2:60:00", "1:99", "1-2", "-1:00", "1:00 "})
    EXPECT_THROW(parse_duration(text), std::invalid_argument) << text;
}

TEST(WallLimit, LeavesRoomForAStepAFrameAndACheckpoint) {
  WallLimit limit(100);
  limit.took_step(5);
  limit.took_frame(2);
  EXPECT_FALSE(limit.reached(80));
  EXPECT_TRUE(limit.reached(82)) << "a frame stands for the checkpoint that there was none of yet";
  limit.took_save(10);
  EXPECT_FALSE(limit.reached(64));
  EXPECT_TRUE(limit.reached(66));
  // A long step of hours ago counts less and less.
  for (int k = 0; k < 1000; ++k) limit.took_step(0.1);
  EXPECT_FALSE(limit.reached(74));
  EXPECT_FALSE(WallLimit(std::nullopt).reached(1e9));
}

}  // namespace
}  // namespace talus
