// Small clusters of contacts: the same problems and the same answers, wherever their parts lie.

#include "kernels/clusters/cluster_problem.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <tuple>

#include "kernels/bodies/index.hpp"
#include "kernels/clusters/contact_matrix.hpp"
#include "kernels/clusters/step_error.hpp"
#include "tests/unit/kernels/clusters/cluster_makers.hpp"
#include "tests/unit/kernels/global/cut_problem.hpp"

namespace talus::cluster_problem_test {
namespace {

constexpr double radius = 0.01, fall = -0.01;

/// Loose heaps of 1 to 12 grains on a floor, wall 0, far from one another; every other contact carries
/// something. With `plate` a wall of that mass lies on the first heap.
BodyProblem heaps(int count, double mu, double plate, std::uint32_t seed) {
  std::mt19937 draw(seed);
  const auto unit = [&] { return static_cast<double>(draw()) / static_cast<double>(std::mt19937::max()); };
  BodyProblem problem;
  std::vector<std::int32_t> lid;
  for (int heap = 0; heap < count; ++heap) {
    const auto first = static_cast<std::int32_t>(problem.bodies.size());
    const int grains = 1 + static_cast<int>(12 * unit());
    for (int g = 0; g < grains; ++g) {
      BodyUnknown body;
      body.mass = 1 + unit();
      body.spin_mass = mu > 0 ? 0.4 * body.mass : 0;
      body.radius = radius;
      body.x = Vec3(heap, 0.02 * (g % 3), 0.018 * (g / 3) + 0.01);
      body.free.u = Vec3(0.002 * (unit() - 0.5), 0.002 * (unit() - 0.5), fall * (1 + unit()));
      problem.bodies.push_back(body);
    }
    const auto touch = [&](std::int32_t a, std::int32_t b, const Vec3& n) {
      cluster_makers::add_contact(problem, a, b, n, mu, b < 0 ? 0 : -1);
      if (problem.contacts.size() % 2 == 0) problem.impulse.back() = 0.3 * n * std::abs(fall);
    };
    for (std::int32_t a = first; a < first + grains; ++a) {
      if (problem.bodies[at(a)].x[2] < 0.011) touch(a, -1, Vec3::UnitZ());
      for (std::int32_t b = first; b < a; ++b) {
        const Vec3 to = problem.bodies[at(a)].x - problem.bodies[at(b)].x;
        if (to.norm() < 0.03) touch(a, b, to.normalized());
      }
    }
    if (heap == 0) lid = {first, first + grains - 1};
  }
  problem.grains = problem.bodies.size();
  if (plate > 0) {
    BodyUnknown wall;
    wall.mass = plate;
    wall.kind = BodyKind::wall;
    wall.axis = -Vec3::UnitZ();
    wall.free.u = Vec3(0, 0, fall);
    problem.bodies.push_back(wall);
    cluster_makers::add_contact(problem, lid.back(), static_cast<std::int32_t>(problem.grains),
                                -Vec3::UnitZ(), mu, 1);
  }
  return problem;
}

/// Every contact in one of `count` parts, none in the first: parts may be empty.
std::vector<std::int32_t> dealt(const BodyProblem& problem, int count, std::uint32_t seed) {
  std::mt19937 draw(seed);
  std::vector<std::int32_t> part;
  for (std::size_t k = 0; k < problem.contacts.size(); ++k)
    part.push_back(1 + static_cast<std::int32_t>(draw() % static_cast<unsigned>(count - 1)));
  return part;
}

/// By how much a contact breaks Signorini's and Coulomb's laws, as they stand in any text on mechanics, with
/// no projection and no De Saxce: impulses over `unit` [N s], velocities as the impulse that they are worth
/// to a mass of 1 kg.
double violation(const BodyProblem& problem, const std::vector<Vec3>& r, double unit) {
  const std::vector<Twist> V = velocities_of(problem, r);
  double worst = 0;
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
    const ContactEquation& c = problem.contacts[k];
    const Vec3 v = relative_velocity(c, V) + c.offset;
    const double rn = c.normal.dot(r[k]), vn = c.normal.dot(v);
    const Vec3 rt = r[k] - rn * c.normal, vt = v - vn * c.normal;
    const double slip = vt.norm();
    worst = std::max({worst, -rn, -vn, std::min(rn, vn), rt.norm() - c.mu * rn});
    // A contact that slides is at the limit, against the slip.
    if (slip > 1e-7 && c.mu > 0) worst = std::max(worst, (rt + c.mu * rn * vt / slip).norm());
  }
  return worst / unit;
}

/// Of a step that has had so many, an answer may cost more than any of these problems needs.
constexpr int sweeps = 100'000;

TEST(ClusterProblem, IsMendedToWhatSignoriniAndCoulombAskFor) {
  for (const double mu : {0.0, 0.1, 0.4, 1.0})
    for (const std::uint32_t seed : {1u, 2u, 3u, 4u, 5u}) {
      BodyProblem problem = heaps(4, mu, 30, seed);
      const double unit = 12 * std::abs(fall);  // of a heap
      ASSERT_GT(violation(problem, problem.impulse, unit), 1e-2);
      const StepError error = step_error(problem, {.enough = 1e-6, .sweeps = sweeps});
      for (std::size_t k = 0; k < problem.impulse.size(); ++k) problem.impulse[k] += error.change[0][k];
      EXPECT_LT(violation(problem, problem.impulse, unit), 1e-5) << "mu " << mu << ", seed " << seed;
    }
}

TEST(ClusterProblem, WhoseLinearSystemOverflowsHasNoErrorThatPasses) {
  BodyProblem problem = heaps(1, 0, 0, 3);
  for (BodyUnknown& body : problem.bodies) body.mass *= 1e302;  // firm contacts are beyond all numbers
  EXPECT_FALSE(step_error(problem, {.enough = 1e-3}).relative() <= 0.05);
}

TEST(ClusterProblem, IsTheSameWhereverItsContactsLie) {
  for (const double mu : {0.0, 0.4})
    for (const double plate : {0.0, 30.0})
      for (const std::uint32_t seed : {1u, 2u, 3u, 4u}) {
        const BodyProblem whole = heaps(6, mu, plate, seed);
        const test::Cut cut(whole, dealt(whole, 5, seed), 5);
        const ErrorGoal goal{.enough = 1e-4, .sweeps = sweeps};
        const StepError one = step_error(whole, goal), parts = step_error(cut.parts, cut, goal);
        const auto what = [&] {
          return ::testing::Message() << "mu " << mu << ", plate " << plate << ", seed " << seed;
        };
        ASSERT_GT(one.velocity, 0.01) << what();
        EXPECT_NEAR(parts.velocity, one.velocity, 1e-3 * one.velocity) << what();
        EXPECT_NEAR(parts.wall, one.wall, 1e-3 * one.wall) << what();
        EXPECT_TRUE(parts.mends && parts.worst == AnswerState::found) << what();
        // What it mends is mended in every part.
        test::Cut mended = cut;
        for (std::size_t p = 0; p < mended.parts.size(); ++p)
          for (std::size_t k = 0; k < parts.change[p].size(); ++k)
            mended.parts[p].impulse[k] += parts.change[p][k];
        EXPECT_LT(step_error(mended.parts, mended, goal).velocity, 1e-3) << what();
      }
}

/// Grains at (x, y, z) of a cubic lattice of nx by ny by nz, which touch their neighbours along each axis;
/// the lowest stand on wall 0.
BodyProblem lattice(int nx, int ny, int nz) {
  BodyProblem problem;
  const auto at_place = [&](int x, int y, int z) { return x + nx * (y + ny * z); };
  for (int z = 0; z < nz; ++z)
    for (int y = 0; y < ny; ++y)
      for (int x = 0; x < nx; ++x) cluster_makers::add_grain(problem, 2 * radius * Vec3(x, y, z), 0);
  for (int z = 0; z < nz; ++z)
    for (int y = 0; y < ny; ++y)
      for (int x = 0; x < nx; ++x) {
        const std::int32_t own = at_place(x, y, z);
        if (x > 0) cluster_makers::add_contact(problem, own, at_place(x - 1, y, z), Vec3::UnitX(), 0);
        if (y > 0) cluster_makers::add_contact(problem, own, at_place(x, y - 1, z), Vec3::UnitY(), 0);
        cluster_makers::add_contact(problem, own, z > 0 ? at_place(x, y, z - 1) : -1, Vec3::UnitZ(), 0,
                                    z > 0 ? -1 : 0);
      }
  return problem;
}

TEST(SmallClusters, OfNoMoreBodiesThanAskedAreNoChainsNorSmoothOnesEither) {
  const SmallClusters given, few = given.within(150), none = given.within(0);
  const auto is_small = [](const SmallClusters& small, int columns, int rows, bool friction) {
    const BodyProblem problem = lattice(columns, 1, rows);
    const test::Cut cut(problem, std::vector<std::int32_t>(problem.contacts.size(), 0), 1);
    const std::vector<ContactGraph> graphs{graph_of(cut.parts[0])};
    return in_small_clusters(clusters_of(graphs, cut), small, friction)[0][0] != 0;
  };
  EXPECT_TRUE(is_small(given, 1, 200, true) && is_small(given, 1, 400, false) && is_small(few, 1, 150, true));
  EXPECT_FALSE(is_small(few, 1, 151, true) || is_small(few, 1, 151, false) || is_small(none, 1, 1, true));
}

TEST(SmallClusters, AreThoseOfFewBodiesAndChainsHoweverTheyAreCut) {
  constexpr SmallClusters small{.bodies = 20, .smooth = 30, .loops = 10, .chained = 300};
  struct Case {
    BodyProblem problem;
    bool is_small;
    const char* what;
  };
  const Case cases[] = {{lattice(1, 1, 1), true, "a grain on a floor"},
                        {lattice(3, 3, 2), true, "few bodies, many loops"},
                        {lattice(1, 1, 21), true, "a column: no loop"},
                        {lattice(300, 1, 1), true, "a row on a floor: walls join nothing"},
                        {lattice(301, 1, 1), false, "a row that is too long"},
                        {lattice(2, 1, 11), true, "a ladder of 22: 10 loops"},
                        {lattice(2, 1, 12), false, "a ladder of 24: 11 loops"}};
  for (const auto& [problem, is_small, what] : cases)
    for (const int parts : {1, 4}) {
      const test::Cut cut(
          problem,
          parts == 1 ? std::vector<std::int32_t>(problem.contacts.size(), 0) : dealt(problem, parts, 3),
          parts);
      std::vector<ContactGraph> graphs;
      for (const BodyProblem& part : cut.parts) graphs.push_back(graph_of(part));
      const auto in = in_small_clusters(clusters_of(graphs, cut), small, true);
      for (std::size_t p = 0; p < graphs.size(); ++p)
        for (const auto& [first, second] : graphs[p].pairs)
          EXPECT_EQ(in[p][at(first)] != 0, is_small) << what << ", parts " << parts;
      const auto smooth = in_small_clusters(clusters_of(graphs, cut), small, false);
      for (std::size_t p = 0; p < graphs.size(); ++p)
        for (const auto& [first, second] : graphs[p].pairs)
          EXPECT_EQ(smooth[p][at(first)] != 0, is_small || problem.bodies.size() <= 30) << what;
    }
}

TEST(ClusterProblem, HasEachBodyAndContactOnce) {
  const BodyProblem whole = heaps(6, 0.4, 30, 7);
  const test::Cut cut(whole, dealt(whole, 4, 7), 4);
  const BodyParts parts(cut.parts, cut);
  std::vector<ContactGraph> graphs;
  for (const BodyProblem& part : cut.parts) graphs.push_back(graph_of(part));
  std::size_t contacts = 0, walls = 0;
  double mass = 0;
  for (const ClusterProblem& cluster : cluster_problems(parts, clusters_of(graphs, cut))) {
    contacts += cluster.contacts.size();
    for (const BodyUnknown& body : cluster.problem.bodies) {
      mass += body.mass;
      walls += body.kind == BodyKind::wall ? 1 : 0;
    }
    EXPECT_LE(cluster.problem.grains, cluster.problem.bodies.size());
    for (std::size_t b = 0; b < cluster.problem.bodies.size(); ++b)
      EXPECT_EQ(cluster.problem.bodies[b].kind == BodyKind::wall, b >= cluster.problem.grains)
          << "walls stand behind grains";
  }
  double all = 0;
  for (const BodyUnknown& body : whole.bodies) all += body.mass;
  EXPECT_EQ(contacts, whole.contacts.size());
  EXPECT_EQ(walls, 1u);
  EXPECT_NEAR(mass, all, 1e-12 * all);
}

// Of a cluster that lies in two parts: each number that a direct solve asks for is another one.
TEST(ClusterProblem, HasEveryNumberOfItsBodiesAndContactsWhereverTheyLie) {
  double last = 0;
  const auto next = [&] { return last += 0.5; };
  const auto vector = [&] { return Vec3(next(), next(), next()); };
  BodyProblem whole;
  std::vector<Levers> levers(2);
  for (int k = 0; k < 3; ++k) {
    cluster_makers::add_grain(whole, Vec3::Zero(), 0.3);
    BodyUnknown& body = whole.bodies.back();
    for (double* number : {&body.mass, &body.spin_mass, &body.radius}) *number = next();
    for (Vec3* number : {&body.x, &body.axis, &body.shears, &body.free.u, &body.free.w}) *number = vector();
  }
  for (std::int32_t k = 0; k < 2; ++k) {
    cluster_makers::add_contact(whole, k, k + 1, vector(), next());
    ContactEquation& c = whole.contacts.back();
    for (Vec3* number : {&c.offset, &c.branch, &whole.impulse.back()}) *number = vector();
    c.pull = next(), c.drive = next(), c.wall = 7 + k;
    levers[at(k)].first = vector() * vector().transpose();
    levers[at(k)].second = vector() * vector().transpose();
    c.levers = &levers[at(k)];
    whole.rolling.push_back({next(), vector(), vector()});
  }
  test::Cut cut(whole, {0, 1}, 2);
  for (const std::size_t p : {0u, 1u}) cut.parts[p].rolling = {whole.rolling[p]};
  std::vector<ContactGraph> graphs;
  for (const BodyProblem& part : cut.parts) graphs.push_back(graph_of(part));
  const std::vector<ClusterProblem> found =
      cluster_problems(BodyParts(cut.parts, cut), clusters_of(graphs, cut));
  ASSERT_EQ(found.size(), 1u);
  const BodyProblem& made = found[0].problem;
  ASSERT_EQ(made.bodies.size(), 3u);
  ASSERT_EQ(made.contacts.size(), 2u);
  for (std::size_t b = 0; b < 3; ++b) {
    const BodyUnknown &is = made.bodies[b], &was = whole.bodies[b];
    EXPECT_EQ(
        std::tie(is.mass, is.spin_mass, is.radius, is.kind, is.x, is.axis, is.shears, is.free.u, is.free.w),
        std::tie(was.mass, was.spin_mass, was.radius, was.kind, was.x, was.axis, was.shears, was.free.u,
                 was.free.w))
        << b;
  }
  for (std::size_t k = 0; k < 2; ++k) {
    const ContactEquation &is = made.contacts[k], &was = whole.contacts[k];
    EXPECT_EQ(std::tie(is.mu, is.pull, is.drive, is.wall, is.cell, is.normal, is.branch, is.offset, is.first,
                       is.second),
              std::tie(was.mu, was.pull, was.drive, was.wall, was.cell, was.normal, was.branch, was.offset,
                       was.first, was.second))
        << k;
    EXPECT_EQ(made.impulse[k], whole.impulse[k]);
    EXPECT_EQ(std::tie(made.rolling[k].arm, made.rolling[k].spin, made.rolling[k].moment),
              std::tie(whole.rolling[k].arm, whole.rolling[k].spin, whole.rolling[k].moment));
    ASSERT_NE(is.levers, nullptr);
    EXPECT_EQ(std::tie(is.levers->first, is.levers->second), std::tie(levers[k].first, levers[k].second));
  }
}

TEST(ContactMatrix, GivesTheVelocitiesOfTheBodies) {
  BodyProblem problem = heaps(3, 0.4, 30, 11);
  const ContactMatrix matrix = matrix_of(problem);
  std::vector<double> u(matrix.r.size());
  relative_velocity(matrix.problem, matrix.r, u);
  const std::vector<Twist> V = velocities_of(problem, problem.impulse);
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
    const ContactEquation& c = problem.contacts[k];
    const Vec3 v = relative_velocity(c, V) + c.offset;
    EXPECT_LT((matrix.frames[k] * Eigen::Map<const Vec3>(&u[3 * k]) - v).norm(), 1e-12) << k;
    EXPECT_LT((matrix.impulses()[k] - problem.impulse[k]).norm(), 1e-15) << k;
  }
}

}  // namespace
}  // namespace talus::cluster_problem_test
