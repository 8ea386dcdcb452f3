#include "runtime/step/answer_memory.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace talus {
namespace {

TEST(AnswerMemory, GivesLessToStepsBehindThoseThatFoundNoneAndAllOfItNowAndThen) {
  AnswerMemory memory;
  std::vector<int> credited;
  for (int step = 0; step < 22; ++step) {
    credited.push_back(memory.credited(2000));
    memory.ended(true);
  }
  EXPECT_EQ(credited[0], 2000) << "nothing is known yet";
  EXPECT_EQ(credited[1], 1000);
  EXPECT_EQ(credited[4], 125);
  EXPECT_EQ(credited[19], 125) << "no less than a sixteenth";
  EXPECT_EQ(credited[20], 2000) << "jammed grains may have come free";
  EXPECT_EQ(credited[21], 1000);
  memory.ended(false);
  EXPECT_EQ(memory.credited(2000), 2000) << "an answer was found";
}

}  // namespace
}  // namespace talus
