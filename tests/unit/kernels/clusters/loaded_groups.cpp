// Which bodies of a cluster push one another.

#include "kernels/clusters/loaded_groups.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "tests/unit/kernels/clusters/cluster_makers.hpp"

namespace talus::loaded_groups_test {
namespace {

using namespace cluster_makers;
using Numbers = std::vector<std::size_t>;

/// Grains 0 to 2 in a row from left to right, beside a wall of finite mass, 3; each touches its neighbours,
/// the wall and the floor.
BodyProblem row() {
  BodyProblem problem;
  for (int k = 0; k < 3; ++k) add_grain(problem, Vec3(0.02 * k, 0, 0.01), 0);
  BodyUnknown wall;
  wall.mass = 1;
  wall.kind = BodyKind::wall;
  wall.axis = -Vec3::UnitY();
  problem.bodies.push_back(wall);
  for (std::int32_t k = 0; k < 2; ++k) add_contact(problem, k + 1, k, Vec3::UnitX(), 0);  // 0, 1
  for (std::int32_t k = 0; k < 3; ++k) add_contact(problem, k, 3, -Vec3::UnitY(), 0, 1);  // 2, 3, 4
  for (std::int32_t k = 0; k < 3; ++k) add_contact(problem, k, -1, Vec3::UnitZ(), 0, 0);  // 5, 6, 7
  return problem;
}

TEST(LoadedGroups, AreJoinedByContactsThatCarryHoweverLittle) {
  BodyProblem problem = row();
  problem.impulse[0] = 1e-12 * Vec3::UnitX();  // 0 and 1
  problem.impulse[7] = Vec3::UnitZ();          // the floor joins nothing
  const std::vector<LoadedGroup> groups = loaded_groups(problem, carrying(problem));
  ASSERT_EQ(groups.size(), 3U);
  EXPECT_EQ(groups[0].bodies, (Numbers{0, 1}));
  EXPECT_EQ(groups[0].contacts, (Numbers{0, 5, 6})) << "all among them, the floor's too";
  EXPECT_EQ(groups[0].problem.grains, 2U);
  EXPECT_EQ(groups[1].bodies, Numbers{2});
  EXPECT_EQ(groups[1].contacts, Numbers{7});
  EXPECT_EQ(groups[1].problem.contacts[0].first, 0);
  EXPECT_EQ(groups[2].bodies, Numbers{3});
  EXPECT_EQ(groups[2].problem.grains, 0U);
  EXPECT_TRUE(groups[2].problem.bodies[0].kind == BodyKind::wall);
}

TEST(LoadedGroups, AreJoinedByAWallOfFiniteMassWhereItPresses) {
  BodyProblem problem = row();
  problem.impulse[2] = problem.impulse[4] = -Vec3::UnitY();  // the wall on 0 and 2
  const std::vector<LoadedGroup> groups = loaded_groups(problem, carrying(problem));
  ASSERT_EQ(groups.size(), 2U);
  EXPECT_EQ(groups[0].bodies, (Numbers{0, 2, 3}));
  EXPECT_EQ(groups[0].contacts, (Numbers{2, 4, 5, 7}));
  EXPECT_EQ(groups[0].problem.contacts[1].first, 1);
  EXPECT_EQ(groups[0].problem.contacts[1].second, 2);
  EXPECT_EQ(groups[1].bodies, Numbers{1});
}

TEST(LoadedGroups, OfACellThatFollowsAStressAreOne) {
  BodyProblem problem = row();
  BodyUnknown cell;
  cell.mass = 1;
  cell.kind = BodyKind::cell;
  problem.bodies.push_back(cell);
  for (ContactEquation& c : problem.contacts) c.cell = 4;
  EXPECT_EQ(loaded_groups(problem, carrying(problem)).size(), 1U);
}

TEST(LoadedGroups, ClosingIsTheMomentumOfAnInelasticImpact) {
  const BodyProblem problem = row();
  std::vector<Twist> V(4);
  V[0].u = Vec3::UnitX();
  EXPECT_DOUBLE_EQ(closing(problem, problem.contacts[0], V), 0.5) << "two grains of 1 kg";
  EXPECT_EQ(closing(problem, problem.contacts[1], V), 0);
  V[0].u = -Vec3::UnitX();
  EXPECT_EQ(closing(problem, problem.contacts[0], V), 0) << "they part";
}

}  // namespace
}  // namespace talus::loaded_groups_test
