// Elimination body by body, against a dense matrix.

#include "kernels/clusters/block_elimination.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cstdint>
#include <numeric>
#include <random>
#include <vector>

#include "tests/unit/kernels/clusters/cluster_makers.hpp"

namespace talus::block_elimination_test {
namespace {

using namespace cluster_makers;
using Pair = BlockElimination::Pair;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// Grains that turn (mu > 0) or do not, and walls behind them.
BodyProblem bodies(int grains, double mu, int walls) {
  BodyProblem problem;
  for (int k = 0; k < grains; ++k) add_grain(problem, Vec3::Zero(), mu);
  for (int k = 0; k < walls; ++k) {
    BodyUnknown wall;
    wall.mass = 5;
    wall.kind = BodyKind::wall;
    wall.axis = Vec3::UnitX();
    problem.bodies.push_back(wall);
  }
  return problem;
}

/// A wall that touches all, a grain that touches none, pairs that are named twice and in both orders; blocks
/// that are not symmetric, of a matrix whose symmetric part is positive definite.
TEST(BlockElimination, SolvesWhatADenseSolverSolves) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  for (const double mu : {0.0, 0.5})
    for (int trial = 0; trial < 20; ++trial) {
      const int grains = 2 + trial * 2;
      const BodyProblem problem = bodies(grains, mu, 1);
      const Freedoms freedoms(problem);
      std::vector<Pair> pairs;
      for (std::int32_t k = 0; k + 1 < grains; ++k) pairs.push_back({k, grains});
      std::uniform_int_distribution<std::int32_t> any(0, grains - 2);
      for (int k = 0; k < 3 * grains; ++k)
        if (const Pair pair{any(random), any(random)}; pair[0] != pair[1]) {
          pairs.push_back(pair);
          if (k % 3 == 0) pairs.push_back({pair[1], pair[0]});
        }
      BlockElimination system(freedoms, freedoms.masses(), pairs);
      Eigen::MatrixXd A = freedoms.masses().asDiagonal();
      for (const Pair& pair : pairs) {
        // H S H^T of two bodies, S with a positive symmetric part.
        Eigen::Matrix<double, 12, 3> H;
        for (double& x : H.reshaped()) x = normal(random);
        Mat3 skew;
        for (double& x : skew.reshaped()) x = normal(random);
        const Mat3 S = 2 * Mat3::Identity() + 3 * (skew - skew.transpose());
        const Eigen::Matrix<double, 12, 12> all = H * S * H.transpose();
        for (int a = 0; a < 2; ++a)
          for (int b = 0; b < 2; ++b) {
            const Matrix6 block = all.block<6, 6>(6 * a, 6 * b);
            const auto i = static_cast<std::size_t>(pair[static_cast<std::size_t>(a)]),
                       j = static_cast<std::size_t>(pair[static_cast<std::size_t>(b)]);
            system.add(pair[static_cast<std::size_t>(a)], pair[static_cast<std::size_t>(b)], block);
            A.block(freedoms.begin(i), freedoms.begin(j), freedoms.count(i), freedoms.count(j)) +=
                block.topLeftCorner(freedoms.count(i), freedoms.count(j));
          }
      }
      system.factorise();
      Eigen::VectorXd f(freedoms.size());
      for (double& x : f) x = normal(random);
      const Eigen::VectorXd exact = A.fullPivLu().solve(f);
      EXPECT_LE((system.solve(f) - exact).norm(), 1e-10 * exact.norm()) << mu << " " << grains;
    }
}

/// Contacts a billion times firmer than bodies are heavy, more of them than bodies can follow: what is left
/// of bodies' masses among such numbers is what moves them.
TEST(BlockElimination, KeepsTheMassesBehindFirmContacts) {
  using Long = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;
  std::mt19937 random(11);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 20; ++trial) {
    constexpr int grains = 5;
    const BodyProblem problem = bodies(grains, 0.5, 0);
    const Freedoms freedoms(problem);
    std::vector<Pair> pairs;
    for (std::int32_t a = 0; a < grains; ++a)
      for (std::int32_t b = 0; b < a; ++b) pairs.push_back({a, b});
    BlockElimination system(freedoms, freedoms.masses(), pairs);
    Long A = freedoms.masses().cast<long double>().asDiagonal();
    Eigen::VectorXd f(freedoms.size());
    for (double& x : f) x = normal(random);
    for (const Pair& pair : pairs) {
      Eigen::Matrix<double, 12, 3> H;
      for (double& x : H.reshaped()) x = normal(random);
      // Along one direction all together have nothing against it: that of a common shift.
      H.middleRows<3>(6) = -H.topRows<3>();
      const Eigen::Matrix<double, 12, 12> all = 1e9 * H * H.transpose();
      for (std::size_t a = 0; a < 2; ++a)
        for (std::size_t b = 0; b < 2; ++b) {
          const Matrix6 block =
              all.block<6, 6>(6 * static_cast<Eigen::Index>(a), 6 * static_cast<Eigen::Index>(b));
          system.add(pair[a], pair[b], block);
          A.block<6, 6>(6 * pair[a], 6 * pair[b]) += block.cast<long double>();
        }
    }
    system.factorise();
    const Eigen::VectorXd exact = A.fullPivLu().solve(f.cast<long double>()).cast<double>();
    const Eigen::VectorXd first = system.solve(f);
    EXPECT_LE((first - exact).norm(), 1e-4 * exact.norm()) << trial;
    const Eigen::VectorXd rest = f - (A * first.cast<long double>()).cast<double>();
    EXPECT_LE((first + system.solve(rest) - exact).norm(), 1e-8 * exact.norm()) << trial;
  }
}

/// A chain named in any order couples no more bodies than touch: eliminated from its ends.
TEST(BlockElimination, AChainCostsAsMuchAsItHasBodies) {
  constexpr int n = 100;
  const BodyProblem problem = bodies(n, 0.5, 0);
  const Freedoms freedoms(problem);
  std::vector<std::int32_t> name(n);
  std::iota(name.begin(), name.end(), 0);
  std::shuffle(name.begin(), name.end(), std::mt19937(3));
  std::vector<Pair> pairs;
  for (std::size_t k = 0; k + 1 < n; ++k) pairs.push_back({name[k], name[k + 1]});
  const BlockElimination system(freedoms, freedoms.masses(), pairs);
  EXPECT_EQ(system.work(), 6.0 * 6 * 6 * (3 * (n - 1) + 1));
}

TEST(BlockElimination, ASingularBodyHasNoFiniteSolution) {
  const BodyProblem problem = bodies(2, 0.5, 0);
  const Freedoms freedoms(problem);
  BlockElimination system(freedoms, freedoms.masses(), std::vector<Pair>{{0, 1}});
  system.add(0, 0, -Matrix6(freedoms.masses().head<6>().asDiagonal()));
  system.factorise();
  EXPECT_FALSE(system.solve(Eigen::VectorXd::Ones(freedoms.size())).allFinite());
}

}  // namespace
}  // namespace talus::block_elimination_test
