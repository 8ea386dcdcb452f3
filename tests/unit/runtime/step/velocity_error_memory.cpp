// What is remembered of the errors of velocities, and for how long.

#include "runtime/step/velocity_error_memory.hpp"

#include <gtest/gtest.h>

namespace talus::velocity_error_memory_test {
namespace {

constexpr VelocityErrorMemory::Problem problem{1000, 1.0};

TEST(VelocityErrorMemory, ExpectsTheWorstOfAProblemThatWasNotChecked) {
  const VelocityErrorMemory memory;
  EXPECT_TRUE(memory.due());
  EXPECT_EQ(memory.per_work(problem), VelocityErrorReuse{}.most);
}

TEST(VelocityErrorMemory, ExpectsTwiceTheWorseOfTheLastTwoChecks) {
  VelocityErrorMemory memory;
  memory.found(problem, 0.03, 0.01);
  EXPECT_NEAR(memory.per_work(problem), 6, 1e-12);
  memory.found(problem, 0.01, 0.01);
  EXPECT_NEAR(memory.per_work(problem), 6, 1e-12);
  memory.found(problem, 0.02, 0.01);
  EXPECT_NEAR(memory.per_work(problem), 4, 1e-12);
}

TEST(VelocityErrorMemory, KeepsWithinItsLimits) {
  VelocityErrorMemory memory;
  memory.found(problem, 0.001, 1);
  EXPECT_EQ(memory.per_work(problem), VelocityErrorReuse{}.least);
  memory.found(problem, 100, 1);
  EXPECT_EQ(memory.per_work(problem), VelocityErrorReuse{}.most);
  memory.found(problem, 1, 0);
  EXPECT_EQ(memory.per_work(problem), VelocityErrorReuse{}.most) << "no work at all";
}

TEST(VelocityErrorMemory, HoldsForProblemsThatAreMuchTheSame) {
  VelocityErrorMemory memory;
  memory.found(problem, 1, 1);
  const double most = VelocityErrorReuse{}.most;
  EXPECT_EQ(memory.per_work({1100, 4}), 2);
  EXPECT_EQ(memory.per_work({900, 0.25}), 2);
  EXPECT_EQ(memory.per_work({1101, 1}), most) << "more contacts";
  EXPECT_EQ(memory.per_work({899, 1}), most) << "fewer";
  EXPECT_EQ(memory.per_work({1000, 4.1}), most) << "they exchange more";
  EXPECT_EQ(memory.per_work({1000, 0.24}), most) << "or less";
}

TEST(VelocityErrorMemory, AsksAgainAfterManySweepsOnly) {
  VelocityErrorMemory memory;
  memory.swept(1000000);
  EXPECT_TRUE(memory.due()) << "never asked";
  memory.found(problem, 1, 1);
  EXPECT_FALSE(memory.due());
  memory.swept(9999);
  EXPECT_FALSE(memory.due());
  memory.swept(1);
  EXPECT_TRUE(memory.due());
}

}  // namespace
}  // namespace talus::velocity_error_memory_test
