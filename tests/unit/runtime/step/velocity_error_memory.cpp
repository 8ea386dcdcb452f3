// What is remembered of the errors of velocities, and for how long.

#include "runtime/step/velocity_error_memory.hpp"

#include <gtest/gtest.h>

namespace talus::velocity_error_memory_test {
namespace {

constexpr VelocityErrorMemory::Problem problem{1000, 1.0};

TEST(VelocityErrorMemory, ExpectsTheWorstOfAProblemThatWasNotChecked) {
  const VelocityErrorMemory memory;
  EXPECT_TRUE(memory.due());
  EXPECT_EQ(memory.per_work(problem, false), VelocityErrorReuse{}.most);
}

TEST(VelocityErrorMemory, ExpectsTwiceTheWorseOfTheLastTwoChecks) {
  VelocityErrorMemory memory;
  memory.found(problem, 0.03, 0.01);
  EXPECT_NEAR(memory.per_work(problem, false), 6, 1e-12);
  memory.found(problem, 0.01, 0.01);
  EXPECT_NEAR(memory.per_work(problem, false), 6, 1e-12);
  memory.found(problem, 0.02, 0.01);
  EXPECT_NEAR(memory.per_work(problem, false), 4, 1e-12);
}

TEST(VelocityErrorMemory, KeepsWithinItsLimits) {
  VelocityErrorMemory memory;
  memory.found(problem, 0.001, 1);
  EXPECT_EQ(memory.per_work(problem, false), VelocityErrorReuse{}.least);
  memory.found(problem, 100, 1);
  EXPECT_EQ(memory.per_work(problem, false), VelocityErrorReuse{}.most);
  memory.found(problem, 1, 0);
  EXPECT_EQ(memory.per_work(problem, false), VelocityErrorReuse{}.most) << "no work at all";
}

TEST(VelocityErrorMemory, ExpectsLessWhereContactsSlideButBelievesLess) {
  VelocityErrorMemory memory;
  memory.found(problem, 0.001, 1);
  EXPECT_LT(memory.per_work(problem, true), memory.per_work(problem, false));
  EXPECT_EQ(memory.per_work(problem, true), VelocityErrorReuse{}.least_sliding);
  EXPECT_GT(memory.credible(true), memory.credible(false));
  EXPECT_LE(memory.credible(true), memory.per_work(problem, true));
}

TEST(VelocityErrorMemory, HoldsForProblemsThatAreMuchTheSame) {
  VelocityErrorMemory memory;
  memory.found(problem, 1, 1);
  const double most = VelocityErrorReuse{}.most;
  EXPECT_EQ(memory.per_work({1100, 4}, false), 2);
  EXPECT_EQ(memory.per_work({900, 0.25}, false), 2);
  EXPECT_EQ(memory.per_work({1101, 1}, false), most) << "more contacts";
  EXPECT_EQ(memory.per_work({899, 1}, false), most) << "fewer";
  EXPECT_EQ(memory.per_work({1000, 4.1}, false), most) << "they exchange more";
  EXPECT_EQ(memory.per_work({1000, 0.24}, false), most) << "or less";
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
