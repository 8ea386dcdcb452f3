#include "runtime/graph/communicator.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

namespace talus::graph {
namespace {

TEST(ThreadLevel, RanksOfSeveralThreadsNeedAnMpiThatTheyMayAllCall) {
  for (const char* level : {"single", "funneled"}) {
    EXPECT_THROW(demand_thread_level(level, 2, 2), std::invalid_argument) << level;
    EXPECT_NO_THROW(demand_thread_level(level, 2, 1)) << level;
    EXPECT_NO_THROW(demand_thread_level(level, 1, 2)) << level << ": one rank sends nothing";
  }
  for (const char* level : {"serialized", "multiple"})
    EXPECT_NO_THROW(demand_thread_level(level, 2, 2)) << level;
}

TEST(ThreadLevel, OneRankNeedsNoMpi) {
  const Communicator alone;
  EXPECT_EQ(alone.ranks(), 1);
  EXPECT_EQ(alone.thread_level(), "none");
  EXPECT_NO_THROW(demand_thread_level(alone.thread_level(), alone.ranks(), 8));
}

}  // namespace
}  // namespace talus::graph
