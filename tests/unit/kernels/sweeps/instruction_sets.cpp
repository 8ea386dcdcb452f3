/// A whole simulation has the same numbers whatever instructions it is made of.

#include "kernels/simd/instruction_set.hpp"

#include <gtest/gtest.h>

#include "runtime/step/simulation.hpp"
#include "tests/unit/dense_sample.hpp"

namespace talus {
namespace {

struct Case {
  double friction;
  SolverMethod method;
  Precision precision;
};

/// Of four steps of 512 grains between walls, three of which press and move.
std::uint64_t digest_of(const Case& c, InstructionSet set) {
  talus::Setup setup = test::pressed_setup(test::box_of_walls(-0.6, 7.6), c.friction, 4, 1e6, 1e4);
  setup.solver.method = c.method;
  setup.solver.precision = c.precision;
  setup.solver.simd = set;
  graph::Executor executor({.threads = 1});
  Simulation simulation(setup, test::jittered_lattice(8, 5, 0.1), executor);
  for (int k = 0; k < 4; ++k) simulation.step();
  return simulation.digest();
}

TEST(InstructionSets, GiveASimulationTheSameDigest) {
  if (test::sets_to_test().size() == 1) GTEST_SKIP() << "this processor runs the portable set only";
  for (const double friction : {0.3, 0.0})
    for (const Case& c : {Case{friction, SolverMethod::nlgs, Precision::full},
                          Case{friction, SolverMethod::momentum, Precision::full},
                          Case{friction, SolverMethod::automatic, Precision::mixed}}) {
      const std::uint64_t expected = digest_of(c, InstructionSet::portable);
      for (const InstructionSet set : test::sets_to_test())
        EXPECT_EQ(digest_of(c, set), expected) << name_of(set) << ", friction " << friction;
    }
}

}  // namespace
}  // namespace talus
