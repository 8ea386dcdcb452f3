#include "kernels/detection/measures.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/unit/dense_sample.hpp"

namespace talus {
namespace {

/// Contacts with impulses from -100 to 300 N s, of which some overlap and some do not; walls among them.
test::Sample touched_sample(bool friction) {
  test::Sample sample = test::dense_sample(5, 21, friction, true, 60);
  test::Random random(4);
  for (double& r : sample.candidates.impulse.values()) r = test::uniform(random, -100, 300);
  test::find_contacts(sample, 0.06);
  return sample;
}

ContactSums all_of(const test::Sample& sample) {
  ContactSums sums;
  for (std::size_t c = 0; c < sample.chunks.size(); ++c)
    sums.add(measure_contacts(sample.contacts, sample.chunks, c,
                              {sample.bodies.x, sample.bodies.radius, sample.walls}));
  return sums;
}

// Love-Weber: the moment is the sum of impulse times branch; what overlaps counts, what does not, does not.
TEST(ContactSums, AreThoseOfTheDefinition) {
  for (const bool friction : {true, false}) {
    const test::Sample sample = touched_sample(friction);
    const Contacts& contacts = sample.contacts;
    ContactSums expected;
    for (std::size_t c = 0; c < sample.chunks.size(); ++c)
      for (std::size_t k = sample.range(c).begin; k < sample.range(c).end; ++k) {
        const auto i = static_cast<std::size_t>(contacts.first[k]);
        const Vec3 n(contacts.nx[k], contacts.ny[k], contacts.nz[k]);
        const Vec3 r = friction ? Vec3(contacts.rx[k], contacts.ry[k], contacts.rz[k]) : contacts.rn[k] * n;
        Vec3 branch;
        double reach = sample.bodies.radius[i];
        if (sample.chunks.wall[c] < 0) {
          const auto j = static_cast<std::size_t>(contacts.second[k]);
          branch = sample.bodies.x[i] - sample.bodies.x[j];
          reach += sample.bodies.radius[j];
        } else {
          const Wall& wall = sample.walls[static_cast<std::size_t>(sample.chunks.wall[c])];
          branch = n * n.dot(sample.bodies.x[i] - wall.point);
        }
        expected.moment += r * branch.transpose();
        expected.normal_impulse += r.dot(n);
        if (const double overlap = reach - branch.norm(); overlap > 0) {
          ++expected.overlapping;
          expected.penetration += overlap;
          expected.penetration_max = std::max(expected.penetration_max, overlap);
        }
      }
    const ContactSums sums = all_of(sample);
    EXPECT_GT(sums.overlapping, 100);
    EXPECT_EQ(sums.overlapping, expected.overlapping);
    EXPECT_NEAR(sums.penetration, expected.penetration, 1e-12 * expected.penetration);
    EXPECT_NEAR(sums.penetration_max, expected.penetration_max, 1e-14);
    EXPECT_NEAR(sums.normal_impulse, expected.normal_impulse, 1e-9);
    EXPECT_LT((sums.moment - expected.moment).norm(), 1e-12 * expected.moment.norm());
  }
}

TEST(ContactSums, KeepAMomentThatIsNoNumber) {
  test::Sample sample = touched_sample(true);
  sample.bodies.x[20][1] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(std::isnan(all_of(sample).moment.sum()));
}

}  // namespace
}  // namespace talus
