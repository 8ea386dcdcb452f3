/// Clusters of grains that touch and collide all at once, with friction, restitution, spins and walls: no
/// step gains energy.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <random>

#include "tests/validation/experiment.hpp"

namespace talus::validation {
namespace {

/// Reproducible numbers on any machine.
class Dice {
 public:
  explicit Dice(std::uint64_t seed) : random_(seed) {}
  double real(double from, double to) {
    return from + (to - from) * static_cast<double>(random_() >> 11) * 0x1p-53;
  }
  int whole(int from, int to) {
    return from + static_cast<int>(random_() % static_cast<unsigned>(to - from + 1));
  }
  Vec3 vector(double size) { return {real(-size, size), real(-size, size), real(-size, size)}; }
  Vec3 direction() {
    for (;;)
      if (const Vec3 v = vector(1); v.norm() > 0.1 && v.norm() < 1) return v.normalized();
  }

 private:
  std::mt19937_64 random_;
};

constexpr double density = 1000, h = 1e-7;  // [kg/m^3], [s]: nothing moves far in a step

/// Where a grain of radius r touches one that there is, and comes near no other; false when it does not.
bool place(Dice& dice, const Bodies& bodies, double r, Vec3& x) {
  const auto at = static_cast<std::size_t>(dice.whole(0, static_cast<int>(bodies.size()) - 1));
  x = bodies.x[at] + (bodies.radius[at] + r) * (1 - 1e-4) * dice.direction();
  for (std::size_t s = 0; s < bodies.size(); ++s)
    if ((bodies.x[s] - x).norm() < (bodies.radius[s] + r) * (1 - 2e-4)) return false;
  return true;
}

/// 2 to 30 grains in one cluster, up to 3 planes that touch it, three materials with numbers of their own.
Scene cluster(std::uint64_t seed, RestitutionLaw law) {
  Dice dice(seed);
  Scene scene(h);
  scene.setup.solver.restitution_law = law;
  scene.setup.solver.max_iterations = 5000;
  Bodies& bodies = scene.bodies;
  const int grains = dice.whole(2, 30);
  while (static_cast<int>(bodies.size()) < grains) {
    const double r = dice.real(0.05, 0.15);
    Vec3 x = Vec3::Zero();
    if (!bodies.id.empty() && !place(dice, bodies, r, x)) continue;
    add_sphere(bodies, BodyId{static_cast<std::int64_t>(bodies.size())}, x, r, density);
    const Vec3 u = dice.vector(1) - 3 * x, w = dice.vector(1);  // inwards
    std::copy_n(u.data(), 3, bodies.velocity.back().u);
    std::copy_n(w.data(), 3, bodies.velocity.back().w);
    bodies.material.push_back(static_cast<Material>(dice.whole(0, 2)));
  }
  for (int k = dice.whole(0, 3); k > 0; --k) {
    const Vec3 n = dice.direction();
    double low = 0;
    for (std::size_t s = 0; s < bodies.size(); ++s)
      low = std::min(low, n.dot(bodies.x[s]) - bodies.radius[s]);
    Wall& wall = scene.wall("wall" + std::to_string(k), (low + 1e-5) * n, n);
    if (dice.whole(0, 1) == 1) wall.load = {.drive = WallDrive::force, .force = 0, .mass = dice.real(1, 100)};
  }
  scene.stage().laws = PairTable(3);
  const bool alike = dice.whole(0, 1) == 0;
  const double mu = dice.real(0, 1), e = dice.whole(0, 3) == 0 ? 1 : dice.real(0, 1);
  for (PairLaw& pair : scene.stage().laws.laws())
    pair = {.friction = alike ? mu : dice.real(0, 1), .restitution = alike ? e : dice.real(0, 1)};
  return scene;
}

/// Kinetic energy [J] as whoever reads the frames computes it: of solid spheres and walls.
double energy_of(const Frame& frame, const std::vector<Wall>& walls) {
  double energy = 0;
  for (std::size_t k = 0; k < frame.u.size(); ++k) {
    const double r = frame.radius[k], m = density * 4 / 3 * pi * r * r * r;
    energy += 0.5 * m * frame.u[k].squaredNorm() + 0.2 * m * r * r * frame.omega[k].squaredNorm();
  }
  for (std::size_t w = 0; w < walls.size(); ++w)
    if (walls[w].load.pushed()) energy += 0.5 * walls[w].load.mass * std::pow(frame.walls[w].velocity, 2);
  return energy;
}

struct Gains {
  std::int64_t impacts = 0;  ///< contacts that carried
  std::int64_t clusters = 0;
  std::int64_t missed = 0;  ///< steps that are not solved to 1e-12
  double most = 0;          ///< gain of a solved step over the energy before it
  double most_missed = 0;   ///< likewise over its error, of the others
};

Gains collide(std::uint64_t first_seed, std::int64_t impacts, RestitutionLaw law) {
  Gains gains;
  for (std::uint64_t seed = first_seed; gains.impacts < impacts; ++seed) {
    Experiment run(cluster(seed, law));
    const std::vector<Wall> walls = run.simulation().setup().walls;
    double before = energy_of(run.simulation().frame(), walls);
    ++gains.clusters;
    for (int k = 0; k < 2; ++k) {
      const StepReport& report = run.step();
      const double after = energy_of(run.simulation().frame(), walls), gain = after / before - 1;
      gains.impacts += report.active;
      if (report.error_rms <= 1e-12) {
        gains.most = std::max(gains.most, gain);
      } else {
        ++gains.missed;
        gains.most_missed = std::max(gains.most_missed, gain / report.error_rms);
      }
      before = after;
    }
  }
  return gains;
}

void report(const Gains& gains) {
  std::printf("%ld impacts in %ld clusters: gain at most %.2e; %ld steps above 1e-12: at most %.2g x error\n",
              static_cast<long>(gains.impacts), static_cast<long>(gains.clusters), gains.most,
              static_cast<long>(gains.missed), gains.most_missed);
}

TEST(EnergyOfImpacts, GrowsByRoundingAtMostInAHundredThousand) {
  const Gains gains = collide(1000000, 100000, RestitutionLaw::moreau);
  report(gains);
  EXPECT_LE(gains.most, 1e-11);
  EXPECT_LE(gains.most_missed, 10);
}

// The same clusters tell Newton's law, which makes energy: the test above can fail.
TEST(EnergyOfImpacts, GrowsWithNewtonsLaw) {
  EXPECT_GT(collide(1, 1000, RestitutionLaw::newton).most, 0.01);
}

}  // namespace
}  // namespace talus::validation
