/// Several large clusters: each is judged by itself, however the problem is cut.

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "kernels/clusters/cluster_work.hpp"
#include "kernels/clusters/clusters.hpp"
#include "kernels/global/balance.hpp"
#include "tests/unit/kernels/global/column_problem.hpp"
#include "tests/unit/kernels/global/cut_problem.hpp"
#include "tests/unit/kernels/global/held_problem.hpp"

namespace talus::large_clusters_test {
namespace {

constexpr SmallClusters small{.bodies = 5, .smooth = 5, .loops = 0, .chained = 5};

/// A column that carries this part of its weight, its grains of mass `unit`.
BodyProblem column(int grains, double unit, double carried) {
  BodyProblem problem = test::column_problem(grains, 0, 1, {.mass = unit});
  double due = 0;
  for (std::size_t k = problem.contacts.size(); k-- > 0;) {
    due -= problem.bodies[k].mass * problem.bodies[k].free.u[2];
    problem.impulse[k] = Vec3(0, 0, carried * due);
  }
  return problem;
}

/// One beside the other.
BodyProblem both(const BodyProblem& one, const BodyProblem& other) {
  BodyProblem problem = one;
  const auto first = static_cast<std::int32_t>(one.bodies.size());
  for (BodyUnknown body : other.bodies) {
    body.x += Vec3(1, 0, 0);
    problem.bodies.push_back(body);
  }
  for (ContactEquation c : other.contacts) {
    c.first += first;
    if (c.second >= 0) c.second += first;
    problem.contacts.push_back(c);
  }
  problem.impulse.insert(problem.impulse.end(), other.impulse.begin(), other.impulse.end());
  problem.grains = problem.bodies.size();
  return problem;
}

/// A heavy column that is right beside a light one that carries half of its weight.
BodyProblem light_beside_heavy() {
  return both(column(30, 1, 0.5), column(60, 1000, 1));
}

test::Cut cut_into(const BodyProblem& whole, std::size_t parts) {
  std::vector<std::int32_t> part_of;
  for (std::size_t k = 0; k < whole.contacts.size(); ++k)
    part_of.push_back(static_cast<std::int32_t>(k / 7 % parts));
  return {whole, part_of, parts};
}

BodyGroups groups_of(const test::Cut& cut) {
  std::vector<ContactGraph> graphs;
  for (const BodyProblem& part : cut.parts) graphs.push_back(graph_of(part));
  const Clusters clusters = clusters_of(graphs, cut);
  return large_clusters_of(clusters, in_small_clusters(clusters, small, true), graphs, cut);
}

TEST(LargeClusters, HaveOneNumberInAllParts) {
  // A third column is small.
  const BodyProblem whole = both(light_beside_heavy(), column(4, 1, 1));
  for (const std::size_t parts : {1u, 3u, 9u}) {
    const test::Cut cut = cut_into(whole, parts);
    const BodyGroups groups = groups_of(cut);
    EXPECT_EQ(groups.count, 2) << parts;
    std::vector<std::int32_t> number(3, -2);
    for (std::size_t p = 0; p < cut.parts.size(); ++p)
      for (std::size_t b = 0; b < cut.parts[p].bodies.size(); ++b) {
        const BodyUnknown& body = cut.parts[p].bodies[b];
        const std::size_t which = body.x[0] < 0.5 ? (body.mass > 1 ? 1 : 0) : body.mass > 1 ? 1 : 2;
        if (number[which] == -2) number[which] = groups.of(p, b);
        EXPECT_EQ(groups.of(p, b), number[which]) << "of column " << which << ", " << parts << " parts";
      }
    EXPECT_EQ(number[2], -1);
    EXPECT_NE(number[0], number[1]);
    EXPECT_GE(std::min(number[0], number[1]), 0);
  }
}

TEST(LargeClusters, DoNotHideTheErrorsOfOneAnother) {
  const BodyProblem whole = light_beside_heavy();
  const double alone = velocity_error(column(30, 1, 0.5), 1e-3).relative;
  EXPECT_NEAR(alone, 1, 0.05) << "half is missing of what half carries";
  for (const std::size_t parts : {1u, 4u}) {
    test::Cut cut = cut_into(whole, parts);
    const BodyGroups groups = groups_of(cut);
    // The lowest contact sees all of it: r_n e = n m (g h)^2/4, and n m (g h/2)^2/2 are exchanged.
    EXPECT_NEAR(largest_work(test::readers_of(cut.parts), groups, cut, {}), 2, 1e-9) << parts;
    std::vector<BodyProblem> together = cut.parts;
    EXPECT_LT(velocity_error(together, cut, 1e-6).relative, 1e-3) << "the heavy one hides it; " << parts;
    EXPECT_NEAR(velocity_error(cut.parts, cut, 1e-3, groups).relative, alone, 0.05) << parts;
  }
}

/// Grains of mass `unit` side by side on the floor, which carries each of them.
BodyProblem floor_row(int grains, double unit) {
  BodyProblem problem = column(grains, unit, 1);
  for (int k = 0; k < grains; ++k) {
    const auto g = static_cast<std::size_t>(k);
    problem.bodies[g].x = Vec3(2 * k, 0, 1) * problem.bodies[g].radius;
    problem.contacts[g].second = -1;
    problem.impulse[g] = -problem.bodies[g].mass * problem.bodies[g].free.u;
    if (k == 0) continue;
    ContactEquation beside = problem.contacts[g];
    beside.normal = Vec3::UnitX();
    beside.second = k - 1;
    problem.contacts.push_back(beside);
    problem.impulse.push_back(Vec3::Zero());
  }
  return problem;
}

// A mean over both would make the tall one soft, and find a quarter of what it lacks.
TEST(LargeClusters, AreAsStiffAsTheyAreHigh) {
  const BodyProblem whole = both(column(300, 1, 0.5), floor_row(20, 1e8));
  for (const std::size_t parts : {1u, 4u}) {
    test::Cut cut = cut_into(whole, parts);
    const BodyGroups groups = groups_of(cut);
    ASSERT_EQ(groups.count, 2);
    EXPECT_NEAR(velocity_error(cut.parts, cut, 1e-3, groups).relative, 1, 0.05) << parts;
  }
}

TEST(LargeClusters, ExchangeNoLessThanTheWallsThatTheyTouchAskFor) {
  BodyProblem whole = both(column(30, 1, 0.5), column(60, 1, 1));
  whole.contacts[30].drive = 1;  // of the floor of the other
  const auto work = [](const test::Cut& cut, const ExchangeFloors& floors) {
    return largest_work(test::readers_of(cut.parts), groups_of(cut), cut, floors);
  };
  EXPECT_NEAR(work(cut_into(whole, 1), {}), 2, 1e-9) << "another one's wall";
  whole.contacts[0].drive = 1;
  const double fall = test::gravity * 1e-3, driven = fall * fall / 4 / 0.5;
  EXPECT_NEAR(work(cut_into(whole, 4), {}), driven, 1e-9 * driven);
  EXPECT_NEAR(work(cut_into(whole, 4), {.speed = 2}), driven / 4, 1e-9 * driven);
  // Half of the weight presses wall 0, of which a part moves all.
  whole.contacts[0].drive = whole.contacts[30].drive = 0;
  for (const std::size_t k : {0u, 30u}) whole.contacts[k].wall = 0;
  const double fixed[1] = {0}, light[1] = {1e6}, heavy[1] = {1 / 300.0};
  EXPECT_NEAR(work(cut_into(whole, 4), {.interest = 4, .wall_inv_masses = fixed}), 0.125, 1e-9);
  EXPECT_NEAR(work(cut_into(whole, 4), {.wall_inv_masses = light}), 1, 1e-9) << "with the column's mass";
  EXPECT_NEAR(work(cut_into(whole, 4), {.wall_inv_masses = heavy}), 2 / 1.1, 1e-9);
}

}  // namespace
}  // namespace talus::large_clusters_test
