#include "kernels/sweeps/sweep.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "kernels/detection/measures.hpp"
#include "tests/unit/dense_sample.hpp"

namespace talus::sweep_test {
namespace {

using test::dense_sample;
using test::Random;
using test::Sample;
using test::uniform;
using test::uniform_vector;

/// What the formulas say: sweep_kernels.cpp holds every instruction set against it, bit by bit.
const test::ReferenceSweeps reference;

constexpr double eps = 2.3e-16;

Vec3 u_of(const Velocity& v) {
  return {v.u[0], v.u[1], v.u[2]};
}
Vec3 w_of(const Velocity& v) {
  return {v.w[0], v.w[1], v.w[2]};
}

/// One pass over all chunks between grains.
template <bool Friction>
void sweep_all(Sample& sample, double mu) {
  for (std::size_t c = 0; c < sample.chunks.size(); ++c)
    if (sample.chunks.wall[c] < 0)
      reference.sweep_grains<Friction>(sample.contacts, sample.range(c), sample.bodies.velocity, mu);
}

void set_bias(Sample& sample, double bias) {
  std::fill(sample.contacts.bias.begin(), sample.contacts.bias.end(), bias);
}

/// One contact between two random grains, with a random impulse to start from.
struct OneContact {
  Contacts contacts;
  std::vector<Velocity> velocity;
  Vec3 n;
  double bias;

  explicit OneContact(Random& random, bool friction) : velocity(2) {
    n = uniform_vector(random, -1, 1).normalized();
    bias = uniform(random, -0.3, 0.3);
    for (Velocity& v : velocity) {
      for (double& u : v.u) u = uniform(random, -1, 1);
      for (double& w : v.w) w = uniform(random, -1, 1);
      v.inv_mass = std::pow(10, uniform(random, -2, 2));
      v.spin_mobility = 2.5 * v.inv_mass;
    }
    contacts.nx = {n[0]};
    contacts.ny = {n[1]};
    contacts.nz = {n[2]};
    contacts.bias = {bias};
    contacts.first = {0};
    contacts.second = {1};
    if (friction) {
      contacts.rx = {uniform(random, -0.1, 0.1)};
      contacts.ry = {uniform(random, -0.1, 0.1)};
      contacts.rz = {uniform(random, -0.1, 0.1)};
    } else {
      contacts.rn = {uniform(random, 0, 0.1)};
    }
  }

  /// Velocity of the first surface against the second at the contact, from omega x arm with the arms' signs.
  Vec3 relative_velocity() const {
    const Vec3 surface_a = u_of(velocity[0]) + w_of(velocity[0]).cross(-n);
    const Vec3 surface_b = u_of(velocity[1]) + w_of(velocity[1]).cross(n);
    return surface_a - surface_b;
  }
};

TEST(Sweep, SolvesOneContactExactlyInEachRegime) {
  Random random(1);
  int open = 0, stick = 0, slide = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    OneContact one(random, true);
    const double mu = uniform(random, 0, 1.5);
    reference.sweep_grains<true>(one.contacts, {0, 1}, one.velocity, mu);
    const Vec3 r = contact_impulse(one.contacts, 0), v = one.relative_velocity();
    const double r_n = r.dot(one.n), v_n = v.dot(one.n) + one.bias;
    const Vec3 r_t = r - r_n * one.n, v_t = v - v.dot(one.n) * one.n;
    const double w_nn = one.velocity[0].inv_mass + one.velocity[1].inv_mass;
    const double velocity_error = 100 * eps * (1 + w_nn), impulse_error = 100 * eps * (1 + 1 / w_nn);
    if (r_n <= impulse_error) {
      ++open;
      EXPECT_LE(r.norm(), impulse_error);
      EXPECT_GE(v_n, -velocity_error);
      continue;
    }
    EXPECT_NEAR(v_n, 0, velocity_error);
    if (r_t.norm() < mu * r_n - impulse_error) {
      ++stick;
      EXPECT_NEAR(v_t.norm(), 0, velocity_error);
    } else {
      ++slide;
      EXPECT_NEAR(r_t.norm(), mu * r_n, impulse_error);
      // Friction against the sliding: r_t = -mu r_n v_t / |v_t|.
      EXPECT_NEAR(r_t.dot(v_t), -r_t.norm() * v_t.norm(), velocity_error * (1 + r_t.norm()));
    }
  }
  EXPECT_GT(std::min({open, stick, slide}), 100)
      << open << " open, " << stick << " stick, " << slide << " slide";
}

TEST(Sweep, SolvesOneFrictionlessContactExactly) {
  Random random(2);
  for (int trial = 0; trial < 500; ++trial) {
    OneContact one(random, false);
    const Vec3 spin = w_of(one.velocity[0]);
    reference.sweep_grains<false>(one.contacts, {0, 1}, one.velocity, 0);
    const double v_n = one.n.dot(u_of(one.velocity[0]) - u_of(one.velocity[1])) + one.bias;
    const double error = 100 * eps * (1 + one.velocity[0].inv_mass + one.velocity[1].inv_mass);
    EXPECT_GE(v_n, -error);
    EXPECT_GE(one.contacts.rn[0], 0);
    if (one.contacts.rn[0] > 0) {
      EXPECT_NEAR(v_n, 0, error);
    }
    EXPECT_EQ(w_of(one.velocity[0]), spin) << "without friction nothing turns";
  }
}

TEST(Sweep, AgainstAWallOfFiniteMassSolvesOneContactAndMovesItAlongItsNormal) {
  Random random(3);
  for (double wall_inv_mass : {0.0, 0.2, 5.0})
    for (int trial = 0; trial < 300; ++trial) {
      OneContact one(random, true);
      WallCopy wall{{0.1 * one.n[0], 0.1 * one.n[1], 0.1 * one.n[2]}, wall_inv_mass};
      const Vec3 before(wall.velocity), impulse_before = contact_impulse(one.contacts, 0);
      reference.sweep_wall<true>(one.contacts, {0, 1}, one.velocity, 0.4, wall);
      const Vec3 after(wall.velocity), r = contact_impulse(one.contacts, 0);
      const double v_n = one.n.dot(u_of(one.velocity[0]) - after) + one.bias;
      const double error = 100 * eps * (1 + one.velocity[0].inv_mass + wall_inv_mass);
      EXPECT_GE(v_n, -error);
      if (r.dot(one.n) > 0) {
        EXPECT_NEAR(v_n, 0, error);
      }
      EXPECT_LE((after - before + wall_inv_mass * (r - impulse_before).dot(one.n) * one.n).norm(), error);
    }
}

TEST(Sweep, OverRelaxedGoesBeyondTheSolutionOfAContactAndSettlesThereWithTheNext) {
  Random random(4);
  for (int trial = 0; trial < 300; ++trial) {
    OneContact plain(random, true);
    plain.contacts.bias[0] = -20;  // pressed together: it stays closed
    OneContact over = plain;
    SweepSteps steps{{0}, {0}, {0}, {}};
    const double before = contact_impulse(over.contacts, 0).dot(over.n);
    reference.sweep_grains<true>(plain.contacts, {0, 1}, plain.velocity, 0.4);
    reference.sweep_grains<true>(over.contacts, {0, 1}, over.velocity, 0.4, SweepMomentum{0, 1.2, steps});
    const double exact = contact_impulse(plain.contacts, 0).dot(plain.n),
                 beyond = contact_impulse(over.contacts, 0).dot(over.n);
    EXPECT_NEAR(beyond - before, 1.2 * (exact - before), 1e-12 * (std::abs(exact) + std::abs(before)));
    reference.sweep_grains<true>(over.contacts, {0, 1}, over.velocity, 0.4);
    EXPECT_NEAR(contact_impulse(over.contacts, 0).dot(over.n), exact, 1e-12 * (std::abs(exact) + before));
  }
}

/// Sums of m u and of x cross m u + I omega over the grains.
struct Momentum {
  Vec3 linear = Vec3::Zero(), angular = Vec3::Zero();
  double linear_scale = 0, angular_scale = 0;
};

/// A contact acts midway between the surfaces where spheres overlap or stand apart. The sweep lets it act at
/// each sphere's own surface; the arms differ by half the gap times the tangential impulse, so that angular
/// momentum is exact for spheres that just touch. `x` are centres of such spheres.
Momentum momentum(const Bodies& bodies) {
  Momentum sum;
  for (std::size_t s = 0; s < bodies.size(); ++s) {
    const Velocity& v = bodies.velocity[s];
    const Vec3 p = u_of(v) / v.inv_mass;
    const Vec3 spin = bodies.radius[s] * w_of(v) / v.spin_mobility;  // I omega = (I/R^2) R w
    sum.linear += p;
    sum.angular += bodies.x[s].cross(p) + spin;
    sum.linear_scale += p.norm();
    sum.angular_scale += bodies.x[s].norm() * p.norm() + spin.norm();
  }
  return sum;
}

TEST(Sweep, ConservesLinearMomentumOfADensePacking) {
  for (bool friction : {false, true}) {
    Sample sample = dense_sample(8, 6, friction, false, 100);
    const Momentum before = momentum(sample.bodies);
    for (int k = 0; k < 20; ++k) friction ? sweep_all<true>(sample, 0.5) : sweep_all<false>(sample, 0);
    const Momentum after = momentum(sample.bodies);
    EXPECT_LE((after.linear - before.linear).norm(), 100 * eps * before.linear_scale);
  }
}

// Random chains of spheres that touch exactly: each next one is put on the surface of an earlier one.
TEST(Sweep, ConservesAngularMomentumOfTouchingSpheres) {
  Random random(8);
  Sample sample;
  add_sphere(sample.bodies, BodyId{0}, Vec3::Zero(), 1, 1000);
  for (int k = 1; k < 300; ++k) {
    const auto on = static_cast<std::size_t>(uniform(random, 0, k));
    const double radius = uniform(random, 0.3, 2);
    add_sphere(sample.bodies, BodyId{k},
               sample.bodies.x[on] +
                   (sample.bodies.radius[on] + radius) * uniform_vector(random, -1, 1).normalized(),
               radius, uniform(random, 500, 3000));
    sample.candidates.grain_pairs.push_back({static_cast<Slot>(on), static_cast<Slot>(k)});
  }
  for (Velocity& v : sample.bodies.velocity)
    for (std::size_t c = 0; c < 3; ++c) {
      v.u[c] = uniform(random, -1, 1);
      v.w[c] = uniform(random, -1, 1);
    }
  std::sort(sample.candidates.grain_pairs.begin(), sample.candidates.grain_pairs.end(),
            [](const GrainPair& a, const GrainPair& b) {
              return std::pair(a.first, a.second) < std::pair(b.first, b.second);
            });
  sample.candidates.impulse.assign_zeros(sample.candidates.size());
  sample.chunks = cut_chunks(sample.candidates, sample.bodies.size(), 50);
  test::find_contacts(sample, 0.01);
  const Momentum before = momentum(sample.bodies);
  for (int k = 0; k < 30; ++k) sweep_all<true>(sample, 0.5);
  const Momentum after = momentum(sample.bodies);
  const auto moved =
      std::count_if(sample.contacts.rx.begin(), sample.contacts.rx.end(), [](double r) { return r != 0; });
  EXPECT_GT(moved, 100);
  EXPECT_LE((after.linear - before.linear).norm(), 100 * eps * before.linear_scale);
  EXPECT_LE((after.angular - before.angular).norm(), 1000 * eps * before.angular_scale);
}

double energy(const Sample& sample) {
  const KineticEnergy e = kinetic_energy(sample.bodies.velocity);
  return e.translation + e.rotation;
}

TEST(Sweep, OfInelasticContactsGivesNoEnergy) {
  for (std::uint64_t seed : {1, 2, 3}) {
    // Started from zero each contact's impulse descends along the energy, with any friction.
    for (double mu : {0.0, 0.3, 2.0}) {
      Sample sample = dense_sample(7, seed, true, false, 100);
      set_bias(sample, 0);
      const double before = energy(sample);
      sweep_all<true>(sample, mu);
      EXPECT_LE(energy(sample), before);
    }
    // Without friction every later sweep descends, too.
    Sample sample = dense_sample(7, seed, false, false, 100);
    set_bias(sample, 0);
    for (int k = 0; k < 30; ++k) {
      const double before = energy(sample);
      sweep_all<false>(sample, 0);
      EXPECT_LE(energy(sample), before * (1 + 10 * eps));
    }
  }
}

TEST(Accumulate, GivesTheSweptVelocityAfreshFromTheImpulses) {
  for (bool friction : {false, true}) {
    Sample sample = dense_sample(7, 4, friction, false, 100);
    std::vector<Velocity> afresh = sample.bodies.velocity;
    for (int k = 0; k < 50; ++k) friction ? sweep_all<true>(sample, 0.5) : sweep_all<false>(sample, 0);
    for (std::size_t c = 0; c < sample.chunks.size(); ++c)
      friction ? reference.accumulate_grains<true>(sample.contacts, sample.range(c), afresh)
               : reference.accumulate_grains<false>(sample.contacts, sample.range(c), afresh);
    double impulse_speed = 0;  // the largest that one impulse gives to a grain
    for (std::size_t c = 0; c < sample.chunks.size(); ++c)
      for (std::size_t k = sample.range(c).begin; k < sample.range(c).end; ++k)
        impulse_speed = std::max(
            impulse_speed,
            contact_impulse(sample.contacts, k).norm() *
                sample.bodies.velocity[static_cast<std::size_t>(sample.contacts.first[k])].spin_mobility);
    for (std::size_t s = 0; s < sample.bodies.size(); ++s) {
      const Velocity& swept = sample.bodies.velocity[s];
      EXPECT_LE((u_of(swept) - u_of(afresh[s])).norm(), 50 * 10 * eps * (1 + impulse_speed));
      EXPECT_LE((w_of(swept) - w_of(afresh[s])).norm(), 50 * 10 * eps * (1 + impulse_speed));
    }
  }
}

/// Natural map by searching the cone: the nearest point of {r_n >= 0, |r_t| <= mu r_n} to z lies in the plane
/// of n and z_t, on the edge (a ray) or at z itself.
double natural_map(const Vec3& r, const Vec3& v, const Vec3& n, double bias, double w_nn, double mu) {
  const Vec3 v_t = v - v.dot(n) * n;
  const Vec3 z = r - (v + (bias + mu * v_t.norm()) * n) / w_nn;
  const Vec3 z_t = z - z.dot(n) * n;
  Vec3 nearest = Vec3::Zero();
  double distance = z.norm();
  const Vec3 edge = z_t.norm() > 0 ? Vec3((n + mu * z_t.normalized()) / std::sqrt(1 + mu * mu)) : n;
  const Vec3 on_edge = std::max(0.0, z.dot(edge)) * edge;
  if ((z - on_edge).norm() < distance) {
    nearest = on_edge;
    distance = (z - on_edge).norm();
  }
  if (z.dot(n) >= 0 && z_t.norm() <= mu * z.dot(n)) nearest = z;
  return w_nn * (r - nearest).norm();
}

TEST(NaturalMap, MatchesASearchForTheNearestPointOfTheCone) {
  Random random(5);
  for (int trial = 0; trial < 3000; ++trial) {
    const bool friction = trial % 4 != 0;
    const OneContact one(random, friction);
    const double mu = friction ? uniform(random, 0, 1.5) : 0;
    const double w_nn = one.velocity[0].inv_mass + one.velocity[1].inv_mass;
    const ErrorSums sums = friction ? reference.error_grains<true>(one.contacts, {0, 1}, one.velocity, mu)
                                    : reference.error_grains<false>(one.contacts, {0, 1}, one.velocity, mu);
    // Without friction the tangential part of v is no error; the normal line is the cone.
    Vec3 v = one.relative_velocity();
    if (!friction) v = one.n.dot(u_of(one.velocity[0]) - u_of(one.velocity[1])) * one.n;
    const double expected = natural_map(contact_impulse(one.contacts, 0), v, one.n, one.bias, w_nn, mu);
    EXPECT_NEAR(std::sqrt(sums.residual_max2), expected, 100 * eps * (10 + w_nn));
    EXPECT_NEAR(sums.residual2, expected * expected, 100 * eps * (10 + w_nn) * (10 + w_nn));
    EXPECT_NEAR(sums.work, contact_impulse(one.contacts, 0).dot(one.n) * expected, 1000 * eps * (10 + w_nn));
    EXPECT_EQ(sums.contacts, 1);
    EXPECT_EQ(sums.active, contact_impulse(one.contacts, 0).dot(one.n) > 0 ? 1 : 0);
  }
}

TEST(NaturalMap, IsZeroAtTheExactSolution) {
  Random random(6);
  for (int trial = 0; trial < 500; ++trial) {
    OneContact one(random, true);
    const double mu = uniform(random, 0, 1.5);
    reference.sweep_grains<true>(one.contacts, {0, 1}, one.velocity, mu);
    const ErrorSums sums = reference.error_grains<true>(one.contacts, {0, 1}, one.velocity, mu);
    EXPECT_LE(std::sqrt(sums.residual_max2),
              200 * eps * (1 + one.velocity[0].inv_mass + one.velocity[1].inv_mass));
  }
}

// A ball that leaves a smooth wall straight up, in a scene where grains rub: mu = 0 and nothing tangential.
TEST(NaturalMap, IsZeroForAnOpenContactWithoutFrictionOrTangentialVelocity) {
  Random random(1);
  OneContact one(random, true);
  one.contacts.nx = one.contacts.ny = one.contacts.rx = one.contacts.ry = one.contacts.rz = {0};
  one.contacts.nz = {1};
  one.velocity[0] = {{0, 0, 3}, 1, {0, 0, 0}, 2.5};
  one.contacts.bias = {0};
  EXPECT_EQ(reference.error_wall<true>(one.contacts, {0, 1}, one.velocity, 0, WallCopy{}).residual_max2, 0);
}

TEST(NaturalMap, FallsByOrdersOfMagnitudeAsAPackingIsSwept) {
  Sample sample = dense_sample(6, 7, true, false, 100);
  const auto rms = [&] {
    ErrorSums sums;
    for (std::size_t c = 0; c < sample.chunks.size(); ++c)
      sums.add(reference.error_grains<true>(sample.contacts, sample.range(c), sample.bodies.velocity, 0.3));
    return std::sqrt(sums.residual2 / static_cast<double>(sums.contacts));
  };
  const double before = rms();
  for (int k = 0; k < 1000; ++k) sweep_all<true>(sample, 0.3);
  EXPECT_LT(rms(), 1e-4 * before);
}

}  // namespace
}  // namespace talus::sweep_test
