#include "kernels/sweeps/cohesion.hpp"

#include <gtest/gtest.h>

namespace talus::cohesion_test {
namespace {

TEST(Cohesion, PullsTwoUnequalGrainsTogetherWithOneImpulseAndKeepsTheirMomentum) {
  constexpr double mass[] = {1, 5}, impulse = 0.3;
  Contacts contacts;
  contacts.nx = {0.6}, contacts.ny = {0}, contacts.nz = {0.8};
  contacts.first = {0}, contacts.second = {1};
  contacts.cohesion = {impulse};
  std::vector<Velocity> velocity(2);
  for (std::size_t k = 0; k < 2; ++k) velocity[k].inv_mass = 1 / mass[k];
  pull_together(contacts, {0, 1}, velocity, nullptr);
  const Vec3 n(0.6, 0, 0.8);
  EXPECT_LT((mass[0] * Eigen::Map<const Vec3>(velocity[0].u) + impulse * n).norm(), 1e-15);
  EXPECT_LT((mass[1] * Eigen::Map<const Vec3>(velocity[1].u) - impulse * n).norm(), 1e-15);
}

}  // namespace
}  // namespace talus::cohesion_test
