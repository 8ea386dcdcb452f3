/// Kernels of blocks against those of spheres, and against the law itself.

#include "kernels/sweeps/blocks.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

#include "kernels/detection/measures.hpp"
#include "kernels/law/friction_cone.hpp"

namespace talus::blocks_test {
namespace {

/// One contact between two bodies that turn with any levers, drawn at random.
struct OneContact {
  Contacts contacts;
  std::vector<Velocity> velocity{2};
  WallCopy wall;

  explicit OneContact(std::mt19937_64& random) {
    const auto any = [&] { return 2 * static_cast<double>(random() >> 11) * 0x1p-53 - 1; };
    const auto some = [&] { return Vec3(any(), any(), any()); };
    const Vec3 n = some().normalized();
    contacts.nx = {n[0]};
    contacts.ny = {n[1]};
    contacts.nz = {n[2]};
    contacts.bias = {0.2 * any()};
    contacts.first = {0};
    contacts.second = {1};
    contacts.mu = {0};
    Mat3 a, b;
    for (int c = 0; c < 3; ++c) {
      a.col(c) = some();
      b.col(c) = some();
    }
    contacts.levers = {{a, b}};
    for (Velocity& v : velocity) {
      Eigen::Map<Vec3>(v.u) = some();
      Eigen::Map<Vec3>(v.w) = some();
      v.inv_mass = 0.1 + std::abs(any());
      v.spin_mobility = std::abs(any());
    }
    Eigen::Map<Vec3>(wall.velocity) = any() * n;
    wall.inv_mass = std::abs(any());
    contacts.rx = {0};
    contacts.ry = {0};
    contacts.rz = {0};
  }
  Vec3 n() const { return contact_normal(contacts, 0); }
  Vec3 r() const { return law_impulse(contacts, 0); }
  Vec3 surface(std::size_t body, const Mat3& lever) const {
    return Eigen::Map<const Vec3>(velocity[body].u) + lever * Eigen::Map<const Vec3>(velocity[body].w);
  }
  /// v + b n.
  Vec3 approach(bool at_wall) const {
    const Vec3 other =
        at_wall ? Vec3(Eigen::Map<const Vec3>(wall.velocity)) : surface(1, contacts.levers[0].second);
    return surface(0, contacts.levers[0].first) - other + contacts.bias[0] * n();
  }
};

/// Signorini and Coulomb, each condition by itself.
void expect_law(const Vec3& r, const Vec3& v, const Vec3& n, double mu) {
  const double r_n = r.dot(n), v_n = v.dot(n), close = 1e-9;
  const Vec3 r_t = r - r_n * n, v_t = v - v_n * n;
  EXPECT_GE(r_n, -close);
  EXPECT_GE(v_n, -close);
  EXPECT_LT(r_n * v_n, close);
  EXPECT_LE(r_t.norm(), mu * r_n + close);
  if (v_t.norm() > 1e-6 && r_n > 1e-6) {
    EXPECT_LT((r_t / r_n + mu * v_t / v_t.norm()).norm(), 1e-5);
  }
}

TEST(Blocks, OneSweepSolvesAContactWhateverItsLevers) {
  std::mt19937_64 random(3);
  int carried = 0;
  for (int k = 0; k < 3000; ++k) {
    const bool at_wall = k % 3 == 0;
    const double mu = k % 4 == 0 ? 0 : 0.3 * (k % 4);
    OneContact one(random);
    WallCopy* const wall = at_wall ? &one.wall : nullptr;
    const std::vector<Velocity> before = one.velocity;
    sweep_blocks(one.contacts, {0, 1}, one.velocity, mu, wall);
    const Vec3 r = one.r();
    expect_law(r, one.approach(at_wall), one.n(), mu);
    carried += r.norm() > 0 ? 1 : 0;
    // What the bodies gained is what r gives, and no more.
    const Vec3 gained = Eigen::Map<const Vec3>(one.velocity[0].u) - Eigen::Map<const Vec3>(before[0].u);
    EXPECT_LT((gained - before[0].inv_mass * r).norm(), 1e-13);
    const ErrorSums error = error_blocks(one.contacts, {0, 1}, one.velocity, mu, wall);
    EXPECT_LT(error.residual_max2, 1e-16);
    EXPECT_EQ(error.contacts, 1);
    EXPECT_EQ(error.active, r.dot(one.n()) > 0 ? 1 : 0);
    if (HasFailure()) FAIL() << k;
  }
  EXPECT_GT(carried, 500);
}

/// A copy carries a part of its body's mass; errors are those of the whole.
TEST(Blocks, JudgeCopiesByTheMassOfTheirBodies) {
  std::mt19937_64 random(13);
  for (int k = 0; k < 50; ++k) {
    OneContact one(random);
    one.contacts.rx[0] = 0.3;
    const ErrorSums whole = error_blocks(one.contacts, {0, 1}, one.velocity, 0.5, nullptr);
    const std::vector<std::uint16_t> parts{2, 5};
    for (std::size_t b = 0; b < 2; ++b) {
      one.velocity[b].inv_mass *= parts[b];
      one.velocity[b].spin_mobility *= parts[b];
    }
    const ErrorSums copies = error_blocks(one.contacts, {0, 1}, one.velocity, 0.5, nullptr, parts);
    EXPECT_NEAR(copies.impulse2, whole.impulse2, 1e-12 * whole.impulse2);
    EXPECT_NEAR(copies.residual2, whole.residual2, 1e-12 * whole.residual2);
  }
}

TEST(Blocks, SeeAnImpulseThatIsWrong) {
  std::mt19937_64 random(5);
  for (int k = 0; k < 300; ++k) {
    OneContact one(random);
    sweep_blocks(one.contacts, {0, 1}, one.velocity, 0.5, nullptr);
    const Vec3 r = one.r();
    if (r.dot(one.n()) < 0.01) continue;
    one.contacts.rx[0] *= 1.1;
    one.contacts.ry[0] *= 1.1;
    one.contacts.rz[0] *= 1.1;
    const Contacts wrong = one.contacts;
    one.contacts.rx[0] = 0.1 * r[0];
    one.contacts.ry[0] = 0.1 * r[1];
    one.contacts.rz[0] = 0.1 * r[2];
    accumulate_blocks(one.contacts, {0, 1}, one.velocity, nullptr);
    one.contacts = wrong;
    const ErrorSums error = error_blocks(one.contacts, {0, 1}, one.velocity, 0.5, nullptr);
    EXPECT_GT(error.residual_max2, 1e-8 * error.impulse2);
  }
}

/// Spheres, B = +-[n]x, against the closed form of kernels/law/contact_law.hpp.
TEST(Blocks, OfSpheresAreSweptAsSpheresAre) {
  const SweepKernels kernels(InstructionSet::portable);
  std::mt19937_64 random(9);
  for (int k = 0; k < 500; ++k) {
    OneContact one(random);
    Mat3 cross;
    const Vec3 n = one.n();
    cross << 0, -n[2], n[1], n[2], 0, -n[0], -n[1], n[0], 0;
    one.contacts.levers[0] = {cross, -cross};
    one.contacts.group = {1};
    OneContact sphere = one;
    sweep_blocks(one.contacts, {0, 1}, one.velocity, 0.4, nullptr);
    kernels.sweep_grains<true>(sphere.contacts, {0, 1}, sphere.velocity, 0.4);
    EXPECT_LT((one.r() - sphere.r()).norm(), 1e-11);
    for (std::size_t b = 0; b < 2; ++b)
      EXPECT_LT(
          (Eigen::Map<const Vec3>(one.velocity[b].w) - Eigen::Map<const Vec3>(sphere.velocity[b].w)).norm(),
          1e-11);
    const ErrorSums blocks = error_blocks(one.contacts, {0, 1}, one.velocity, 0.4, nullptr),
                    spheres = kernels.error_grains<true>(sphere.contacts, {0, 1}, sphere.velocity, 0.4);
    EXPECT_NEAR(blocks.impulse2, spheres.impulse2, 1e-11);
    EXPECT_NEAR(blocks.velocity2, spheres.velocity2, 1e-11);
    EXPECT_NEAR(blocks.work, spheres.work, 1e-11);
  }
}

}  // namespace
}  // namespace talus::blocks_test
