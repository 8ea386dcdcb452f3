// Which epoch of a step does what, on one rank and on several.

#include "runtime/step/epoch_schedule.hpp"

#include <gtest/gtest.h>

#include <string>

namespace talus {
namespace {

/// One letter per epoch of [from, to): accumulate, measure, sweep, restore.
std::string works(const EpochSchedule& schedule, int from, int to) {
  std::string text;
  for (int epoch = from; epoch < to; ++epoch) text += "amsrp"[static_cast<std::size_t>(schedule.work(epoch))];
  return text;
}

TEST(EpochSchedule, AStepBeginsWithACheckOfTheImpulsesThatItHas) {
  const EpochSchedule schedule;
  EXPECT_EQ(works(schedule, 0, 2), "am");
  EXPECT_FALSE(schedule.measures_at(0));
  EXPECT_TRUE(schedule.measures_at(1));
}

TEST(EpochSchedule, OnOneRankASegmentIsSweepsAccumulateMeasure) {
  EpochSchedule schedule;
  schedule.measured();
  schedule.sweep_on(1, 3);
  EXPECT_EQ(works(schedule, 2, 7), "sssam");
  EXPECT_EQ(schedule.sweep(2), 0);
  EXPECT_EQ(schedule.sweep(4), 2);
  EXPECT_TRUE(schedule.opens_segment(2));
  EXPECT_FALSE(schedule.opens_segment(3));
  EXPECT_TRUE(schedule.closes_segment(4));
  EXPECT_TRUE(schedule.measures_at(6));
  EXPECT_EQ(schedule.checked(), 0);
  EXPECT_EQ(schedule.planned(), 3);

  schedule.measured();
  schedule.sweep_on(6, 2);
  EXPECT_EQ(works(schedule, 7, 11), "ssam");
  EXPECT_EQ(schedule.sweep(7), 3) << "sweeps are counted on";
  EXPECT_EQ(schedule.sweeps_of_segment(8), 2);
  EXPECT_EQ(schedule.planned(), 5);
}

TEST(EpochSchedule, OnSeveralRanksASweepHidesTheSums) {
  EpochSchedule schedule;
  schedule.measured();
  schedule.sweep_on(1, 2);
  schedule.read_sums_after_next(1);
  EXPECT_TRUE(schedule.reads_sums_at(2));
  schedule.sums_read();
  EXPECT_FALSE(schedule.reads_sums_at(2));
  schedule.stretch(5);
  EXPECT_EQ(works(schedule, 2, 9), "sssssam") << "the sweep that hid the sums is the first of five";
  EXPECT_EQ(schedule.sweep(3), 1);
  EXPECT_EQ(schedule.planned(), 5);
}

TEST(EpochSchedule, AStepThatWasSolvedBehindASweepEndsWithTheImpulsesOfTheCheck) {
  EpochSchedule schedule;
  schedule.measured();
  schedule.sweep_on(1, 2);
  schedule.read_sums_after_next(1);
  schedule.restore_after(2);
  EXPECT_EQ(works(schedule, 2, 4), "sr");
  EXPECT_TRUE(schedule.restores_at(3));
  EXPECT_FALSE(schedule.restores_at(2));
}

TEST(EpochSchedule, BehindAdmmAnAccumulateFollowsAndNoSweepIsCounted) {
  EpochSchedule schedule;
  schedule.measured();
  schedule.sweep_on(1, 3);
  schedule.measured();
  schedule.sweep_on(6, 2);
  schedule.read_sums_after_next(6);
  schedule.sums_read();
  schedule.again_from(7);
  EXPECT_EQ(works(schedule, 8, 10), "am");
  EXPECT_EQ(schedule.planned(), 3) << "the sweep that hid the sums is dropped";
  EXPECT_TRUE(schedule.opens_segment(8));
  schedule.measured();
  schedule.sweep_on(9, 1);
  EXPECT_EQ(schedule.sweep(10), 3);
}

TEST(EpochSchedule, SweepsOfPositionsAreTheLastThatHappens) {
  EpochSchedule schedule;
  schedule.measured();
  schedule.sweep_on(1, 2);
  schedule.read_sums_after_next(1);
  schedule.restore_after(2);
  schedule.positions_from(3, 4);
  EXPECT_EQ(works(schedule, 4, 8), "pppp");
  EXPECT_EQ(schedule.position_epoch(4), 0);
  for (int epoch = 4; epoch < 8; ++epoch) {
    EXPECT_EQ(schedule.ends_at(epoch), epoch == 7);
    EXPECT_FALSE(schedule.measures_at(epoch) || schedule.reads_sums_at(epoch) || schedule.restores_at(epoch));
  }
}

}  // namespace
}  // namespace talus
