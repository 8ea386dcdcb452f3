/// Coarse graining: the function and its integral along a branch against quadratures, sums over a grid
/// against those of the grains.

#include "kernels/fields/coarse_grid.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

namespace talus::coarse_grid_test {
namespace {

constexpr double width = 0.02, epsilon = std::numeric_limits<double>::epsilon();

/// Integral of f over 0 .. end by the trapezoidal rule.
template <class F>
double integral(double end, int panels, const F& f) {
  double sum = 0;
  for (int k = 0; k <= panels; ++k)
    sum += (k == 0 || k == panels ? 0.5 : 1) * f(end * k / panels) * end / panels;
  return sum;
}

TEST(Lucy, IsOneInAllAndItsWidthIsTheRootOfTheMeanSquareDistance) {
  const Lucy lucy(width);
  const auto shell = [&](double r) { return 4 * std::numbers::pi * r * r * lucy.at({r, 0, 0}); };
  EXPECT_NEAR(integral(2 * width, 2000, shell), 1, 1e-6);
  EXPECT_NEAR(integral(2 * width, 2000, [&](double r) { return r * r * shell(r); }), width * width,
              1e-6 * width * width);
  EXPECT_EQ(lucy.at({0, 2.001 * width, 0}), 0);
}

TEST(Lucy, ItsMeanAlongAWayIsThatOfItsPoints) {
  const Lucy lucy(width);
  const Vec3 ends[][2] = {{{0, 0, 0}, {0.03, 0, 0}},               // through its centre
                          {{-0.1, 0.01, 0}, {0.1, 0.012, 0.001}},  // right through, far beyond
                          {{0.015, 0.015, 0}, {0.02, 0.01, 0.01}},
                          {{0.1, 0, 0}, {0.1, 0.1, 0}}};  // past it
  for (const auto& way : ends) {
    const Vec3 &a = way[0], &b = way[1];
    const double mean = integral(1, 200000, [&](double s) { return lucy.at(a + s * (b - a)); });
    EXPECT_NEAR(lucy.along(a, b), mean, 1e-7 * lucy.at(Vec3::Zero())) << a.transpose();
    EXPECT_NEAR(lucy.along(b, a), mean, 1e-7 * lucy.at(Vec3::Zero())) << a.transpose();
  }
}

Grid grid() {
  return {{-0.1, -0.1, -0.1}, {0.013, 0.016, 0.02}, {16, 13, 10}};
}

GridSums no_sums(const Grid& of) {
  return {std::vector<double>(of.size() * GridSums::width)};
}

double sum_of(const GridSums& sums, const Grid& of, std::size_t number) {
  double sum = 0;
  for (std::size_t c = 0; c < of.size(); ++c) sum += sums.numbers[c * GridSums::width + number];
  return sum * of.cell_volume();
}

TEST(CoarseGrid, HoldsTheMassMomentumAndMomentOfWhatIsInIt) {
  const Grid of = grid();
  GridSums sums = no_sums(of);
  const Lucy lucy(width);
  double mass = 0, volume = 0, flux = 0;
  Vec3 momentum = Vec3::Zero();
  Mat3 moment = Mat3::Zero();
  for (int k = 0; k < 50; ++k) {
    const SpreadGrain grain{{0.05 * std::sin(k), 0.05 * std::sin(3.0 * k + 1), 0.05 * std::cos(7.0 * k)},
                            {std::cos(k), 2, -0.1 * k},
                            1 + 0.1 * k,
                            1e-6};
    add_grain(of, lucy, grain, sums);
    mass += grain.mass;
    volume += grain.volume;
    momentum += grain.mass * grain.u;
    flux += grain.mass * grain.u[0] * grain.u[2];
    const Vec3 end = 0.8 * grain.x, force(1, k, 0.5);
    add_contact(of, lucy, {grain.x, end, force * (grain.x - end).transpose()}, sums);
    moment += force * (grain.x - end).transpose();
  }
  // Some thousand terms, each with some roundings.
  const double rounding = 1e4 * epsilon;
  EXPECT_NEAR(sum_of(sums, of, GridSums::density), mass, rounding * mass);
  EXPECT_NEAR(sum_of(sums, of, GridSums::volume), volume, rounding * volume);
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_NEAR(sum_of(sums, of, GridSums::momentum + i), momentum[static_cast<Eigen::Index>(i)],
                rounding * momentum.norm());
  EXPECT_NEAR(sum_of(sums, of, GridSums::momentum_flux + 2), flux, rounding * 50 * mass);
  for (std::size_t c = 0; c < 9; ++c)
    EXPECT_NEAR(sum_of(sums, of, GridSums::contact + c),
                moment(static_cast<Eigen::Index>(c / 3), static_cast<Eigen::Index>(c % 3)),
                rounding * moment.norm());
}

/// Half of a grain's mass is beyond the face of a grid on which it lies, not pressed into what is left.
TEST(CoarseGrid, LeavesOutWhatLiesBeyondIt) {
  const Grid whole{{-0.1, -0.1, -0.1}, {0.01, 0.01, 0.01}, {20, 20, 20}};
  const Grid half{{0, -0.1, -0.1}, {0.01, 0.01, 0.01}, {10, 20, 20}};
  const Lucy lucy(width);
  GridSums all = no_sums(whole), part = no_sums(half);
  add_grain(whole, lucy, {{0, 0, 0}, {1, 2, 3}, 5, 1}, all);
  add_grain(half, lucy, {{0, 0, 0}, {1, 2, 3}, 5, 1}, part);
  EXPECT_NEAR(sum_of(all, whole, 0), 5, 1e4 * epsilon);
  EXPECT_NEAR(sum_of(part, half, 0), 2.5, 1e4 * epsilon);
}

/// A grain that flew through a plane wall has its contact there as far behind it as it came. Its branch here
/// goes along x through all of a row of cells, so these hold their share of the moment: their length over
/// that of the branch.
TEST(CoarseGrid, ABranchOfAnyLengthCostsNoMoreThanTheGridAndLeavesItsShareThere) {
  const Grid of{{-0.1, -0.1, -0.1}, {0.01, 0.01, 0.01}, {20, 20, 20}};
  const Lucy lucy(width);
  for (const double length : {1e4, 1e8, 1e13}) {
    GridSums sums = no_sums(of);
    add_contact(of, lucy, {{-1, 0.001, 0.002}, {length - 1, 0.001, 0.002}, length * Mat3::Identity()}, sums);
    // A Riemann sum of a polynomial over eight cells of the cutoff.
    for (const std::size_t diagonal : {0U, 4U, 8U})
      EXPECT_NEAR(sum_of(sums, of, GridSums::contact + diagonal), 0.2, 0.002) << length;
  }
}

TEST(CoarseGrid, OneVelocityIsThatOfEveryCellAndHasNoTemperature) {
  const Grid of = grid();
  GridSums sums = no_sums(of);
  const Vec3 u(0.3, -2, 5);
  for (int k = 0; k < 5; ++k) add_grain(of, Lucy(width), {{0.01 * k, 0, 0}, u, 1.0 + k, 1}, sums);
  int cells = 0;
  for (std::size_t c = 0; c < of.size(); ++c) {
    const CellFields fields = fields_of(sums, c);
    if (fields.density == 0) {
      EXPECT_EQ(fields.velocity, Vec3::Zero());
      continue;
    }
    ++cells;
    EXPECT_LT((fields.velocity - u).norm(), 100 * epsilon * u.norm());
    EXPECT_LT(fields.kinetic_stress.norm(), 100 * epsilon * fields.density * u.squaredNorm());
  }
  EXPECT_GT(cells, 20);
}

/// Grains at rest on one another: what gravity takes, the stress gives back, d(stress_zz)/dz = -density x g,
/// at any place that the floor does not reach.
TEST(CoarseGrid, StressOfAColumnAtRestBalancesItsWeight) {
  const Lucy lucy(width);
  const double d = 0.013, g = 9.81, m = 0.4;
  constexpr int grains = 12;
  const auto stress = [&](const Vec3& at) {
    double sum = 0;
    for (int k = 1; k < grains;
         ++k) {  // between grain k and the one below it, which carries it and all above
      const Vec3 upper(0, 0, k * d), lower(0, 0, (k - 1) * d);
      sum += m * g * (grains - k) * d * lucy.along(upper - at, lower - at);
    }
    return sum;
  };
  const double step = 1e-6;
  for (const Vec3& at :
       {Vec3(0, 0, 6 * d), Vec3(0.01, 0.005, 5.3 * d), Vec3(0.02, 0, 11 * d), Vec3(0, 0.001, 12 * d)}) {
    double density = 0;
    for (int k = 0; k < grains; ++k) density += m * lucy.at(Vec3(0, 0, k * d) - at);
    const Vec3 up(0, 0, step);
    EXPECT_GT(density, 0);
    EXPECT_NEAR((stress(at + up) - stress(at - up)) / (2 * step), -density * g,
                1e-5 * m * g * lucy.at(Vec3::Zero()))
        << at.transpose();
  }
}

}  // namespace
}  // namespace talus::coarse_grid_test
