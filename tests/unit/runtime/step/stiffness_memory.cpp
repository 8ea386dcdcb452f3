#include "runtime/step/stiffness_memory.hpp"

#include <gtest/gtest.h>

namespace talus {
namespace {

/// How often the estimate was made for two steps, each asked twice: 1 when the first answer was kept.
struct Steps {
  StiffnessMemory::Problem first{1000, {-1, 0.5}}, second{1000, {-1, 0.5}};
  double answer = 40, stiff = 100;
  int renewals = 0;  ///< between the steps
  double spread = 2;

  int estimates() const {
    StiffnessMemory memory;
    memory.renew(spread);
    int made = 0;
    const auto estimate = [&] { return ++made, answer; };
    for (const auto* problem : {&first, &second}) {
      memory.begin_step();
      for (int k = 0; k < 2; ++k) EXPECT_EQ(memory.sweeps_needed(*problem, stiff, estimate), answer);
      for (int k = 0; k < renewals && problem == &first; ++k) memory.renew(spread);
    }
    return made;
  }
};

TEST(StiffnessMemory, AnAnswerFarFromStiffHoldsForTheNextStep) {
  EXPECT_EQ(Steps{}.estimates(), 1);
}

TEST(StiffnessMemory, NotNearStiffness) {
  EXPECT_EQ(Steps{.answer = 50}.estimates(), 2);
}

TEST(StiffnessMemory, NotForManyMoreContacts) {
  EXPECT_EQ((Steps{.second = {1050, {-1, 0.5}}}.estimates()), 1);
  EXPECT_EQ((Steps{.second = {1051, {-1, 0.5}}}.estimates()), 2);
}

TEST(StiffnessMemory, NotWhenAnotherWallCarries) {
  EXPECT_EQ((Steps{.second = {1000, {0.1, 0.5}}}.estimates()), 2);
}

TEST(StiffnessMemory, BehindNewCandidatesOnlyWhereNoLandingCouldMakeItStiff) {
  EXPECT_EQ((Steps{.answer = 24, .renewals = 1}.estimates()), 1);
  EXPECT_EQ((Steps{.answer = 25, .renewals = 1}.estimates()), 2);
}

TEST(StiffnessMemory, NotWhenAllHaveMovedOn) {
  EXPECT_EQ((Steps{.answer = 1, .renewals = 10}.estimates()), 1);
  EXPECT_EQ((Steps{.answer = 1, .renewals = 11}.estimates()), 2);
}

TEST(StiffnessMemory, NotWhereOneGrainOutweighsAThousand) {
  EXPECT_EQ((Steps{.answer = 1e-3, .spread = 999}.estimates()), 1);
  EXPECT_EQ((Steps{.answer = 1e-3, .spread = 1000}.estimates()), 2);
}

}  // namespace
}  // namespace talus
