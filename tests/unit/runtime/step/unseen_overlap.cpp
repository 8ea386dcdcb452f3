/// A step answers for every pair that is in one another at its end, contacts or not: light and heavy bodies
/// that fly into one another, and a loop over all pairs, with formulas of its own, as the truth.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <mutex>

#include "kernels/shapes/clump_motion.hpp"
#include "runtime/graph/one_rank.hpp"
#include "runtime/graph/pretend_ranks.hpp"
#include "runtime/step/simulation.hpp"
#include "tests/unit/dense_sample.hpp"

namespace talus::unseen_overlap_test {
namespace {

constexpr double radius = 0.01, h = 1e-3, edge = 0.133;

struct Scene {
  talus::Setup setup;
  Bodies bodies;
};

/// Balls, or bodies of two balls, some of which fly by up to 0.4 radii in a step.
Scene flying(std::uint64_t seed, bool clumps, double skin) {
  Scene scene;
  const std::array balls{Ball{{0, 0, 0}, 0.6 * radius}, Ball{{0.8 * radius, 0, 0}, 0.6 * radius}};
  const PlacedClump placed = make_clump(balls);
  if (clumps) scene.setup.clumps.push_back(placed.clump);
  test::Random random(seed);
  for (int k = 0; k < 125; ++k) {
    const Vec3 site(k % 5, k / 5 % 5, k / 25);
    const Vec3 x =
        edge / 5 * (site + Vec3::Constant(0.5)) + test::uniform_vector(random, -0.25, 0.25) * radius;
    const double density = test::uniform(random, 0, 1) < 0.5 ? 20 : 20000;
    if (clumps)
      add_clump(scene.bodies, scene.setup.clumps, 1, BodyId{k},
                {.centre = x,
                 .radius = placed.radius,
                 .density = density,
                 .u = Vec3::Zero(),
                 .omega = Vec3::Zero()});
    else
      add_sphere(scene.bodies, BodyId{k}, x, radius, density);
    if (test::uniform(random, 0, 1) > 0.3) continue;
    const Vec3 u = test::uniform_vector(random, -0.4, 0.4) * radius / h;
    std::ranges::copy(u, scene.bodies.velocity.back().u);
  }
  Stage& stage = scene.setup.stages.emplace_back();
  stage.name = "fly";
  stage.time_step = h;
  stage.laws = laws_of_one_material(0.3, 0.3, 0.8);
  stage.end.steps = 30;
  scene.setup.detection.skin = skin;
  scene.setup.decomposition.subdomains = 6;
  return scene;
}

/// The place of ball `number` of a body, by the sandwich product of its quaternion.
Vec3 place_of(const StepState& state, std::size_t s, std::size_t number) {
  const Bodies& bodies = state.bodies;
  if (state.clumps.empty()) return bodies.x[s];
  const auto& [w, i, j, k] = bodies.orientation[s];
  const Eigen::Quaterniond q(w, i, j, k);
  return bodies.x[s] + q * Vec3(bodies.radius[s] * state.clumps[0].balls[number].centre);
}

/// The shortest of the ways between images, of bodies that stand in the cell or beside it [m].
double distance(const Domain& domain, const Vec3& between) {
  if (!domain.repeats) return between.norm();
  const PeriodicSpace& c = domain.cell;
  const Vec3 a(c.xx, 0, 0), b(c.xy, c.yy, 0), d(c.xz, c.yz, c.zz);
  double nearest = between.norm();
  for (int i = -1; i <= 1; ++i)
    for (int j = -1; j <= 1; ++j)
      for (int k = -1; k <= 1; ++k) nearest = std::min(nearest, (between + i * a + j * b + k * d).norm());
  return nearest;
}

/// Over the radius of the balls, which are all of one size, as they began apart.
double deepest_of_all(const StepState& state) {
  const std::size_t balls = state.clumps.empty() ? 1 : 2, n = state.bodies.size();
  const double ball = state.clumps.empty() ? radius : 0.6 * radius;
  double deepest = 0;
  for (std::size_t a = 0; a < n * balls; ++a) {
    const Vec3 x = place_of(state, a / balls, a % balls);
    for (std::size_t b = 0; b < a; ++b)
      if (state.bodies.id[a / balls] != state.bodies.id[b / balls])
        deepest =
            std::max(deepest, 2 - distance(state.domain, x - place_of(state, b / balls, b % balls)) / ball);
    for (const Wall& wall : state.walls)
      deepest = std::max(deepest, 1 - wall.normal.dot(x - wall.point) / ball);
  }
  return deepest;
}

struct Claims {
  std::vector<double> overlap;
  std::vector<std::optional<BodyPair>> named;
  int unseen = 0;  ///< steps whose deepest overlap was that of no contact
};

Claims claims_of(const Scene& scene, const graph::Communicator& ranks, bool compare) {
  graph::Executor executor({.threads = 1});
  Simulation simulation(scene.setup, ranks.rank() == 0 ? scene.bodies : Bodies{}, executor, ranks);
  Claims claims;
  for (; !simulation.finished(); simulation.begin_next_stage()) {
    const StepReport& report = simulation.step();
    claims.overlap.push_back(report.overlap);
    claims.named.push_back(report.overlapping);
    if (!compare) continue;
    const double truth = deepest_of_all(simulation.state());
    EXPECT_NEAR(report.overlap, truth, 1e-9) << "step " << report.step;
    EXPECT_EQ(report.overlapping.has_value(), truth > 0.05) << "step " << report.step;
    if (truth > 0.05) {
      EXPECT_FALSE(report.converged);
    }
    claims.unseen += truth > report.penetration_max + 1e-6 ? 1 : 0;
  }
  return claims;
}

/// Compared with the truth on one rank, and on three with those of one.
int compare(const Scene& scene) {
  const Claims alone = claims_of(scene, graph::one_rank(), true);
  std::mutex comparing;
  graph::on_pretend_ranks(3, [&](const graph::Communicator& ranks) {
    const Claims claims = claims_of(scene, ranks, false);
    const std::lock_guard lock(comparing);
    EXPECT_EQ(claims.overlap, alone.overlap);
    EXPECT_EQ(claims.named, alone.named);
  });
  return alone.unseen;
}

void put_in_a_box(Scene& scene) {
  scene.setup.walls = test::box_of_walls(0, edge);
}
void put_in_a_cell(Scene& scene) {
  scene.setup.domain = periodic_domain(Vec3::Constant(edge));
  scene.setup.stages[0].shear_rates = {0, 3, 0};
  scene.setup.stages[0].strain_rates = {-1, 0, 1};
}

/// With a wide skin all of them are candidates; without, bodies leave the reach in which these were looked
/// for.
void compare_with_both_skins(std::uint64_t seed, bool clumps, void (*put)(Scene&)) {
  int unseen = 0;
  for (const double skin : {0.5 * radius, 0.0}) {
    Scene scene = flying(seed, clumps, skin);
    put(scene);
    unseen += compare(scene);
  }
  EXPECT_GT(unseen, 4);
}

TEST(OverlapOfThoseThatAreNoContacts, IsThatOfAStepBetweenWalls) {
  compare_with_both_skins(3, false, put_in_a_box);
}

TEST(OverlapOfThoseThatAreNoContacts, IsThatOfAStepInACellThatFlows) {
  compare_with_both_skins(4, false, put_in_a_cell);
}

TEST(OverlapOfThoseThatAreNoContacts, IsThatOfAStepOfClumps) {
  compare_with_both_skins(5, true, put_in_a_box);
  compare_with_both_skins(6, true, put_in_a_cell);
}

// A ball that sticks to a light lid draws it down within the step, onto another that is no candidate of it.
TEST(OverlapOfThoseThatAreNoContacts, IsThatOfALidThatComesFurtherThanItWasLookedFor) {
  Scene scene;
  add_sphere(scene.bodies, BodyId{0}, Vec3(0, 0, -0.8 * radius), radius, 1e6);
  add_sphere(scene.bodies, BodyId{1}, Vec3(5 * radius, 0, -1.1 * radius), radius, 1e6);
  scene.bodies.velocity[0].u[2] = -0.4 * radius / h;
  Wall& lid = scene.setup.walls.emplace_back();
  lid.name = "lid";
  lid.normal = -Vec3::UnitZ();
  lid.load.drive = WallDrive::force;
  lid.load.force = 1e-9;
  lid.load.mass = 1e-6;
  Stage& stage = scene.setup.stages.emplace_back();
  stage.name = "draw";
  stage.time_step = h;
  stage.laws = laws_of_one_material(0, 0, 0);
  stage.laws.set_all(cohesion_attraction, 1e6);
  stage.end.steps = 1;
  scene.setup.detection = {.alert = 1e-3 * radius, .skin = 0};
  scene.setup.decomposition.subdomains = 1;
  const Claims claims = claims_of(scene, graph::one_rank(), false);
  ASSERT_EQ(claims.named.size(), 1U);
  EXPECT_NEAR(claims.overlap[0], 0.1, 1e-6);
  EXPECT_EQ(claims.named[0], (BodyPair{1, -1}));
}

// A heavy ball throws a light one at another that no candidate tells of, in the last step of a run.
TEST(OverlapOfThoseThatAreNoContacts, IsSeenInTheLastStep) {
  Scene scene;
  add_sphere(scene.bodies, BodyId{0}, Vec3(0, 0, 0), radius, 1e6);
  add_sphere(scene.bodies, BodyId{1}, Vec3(2.1 * radius, 0, 0), radius, 1);
  add_sphere(scene.bodies, BodyId{2}, Vec3(4.4 * radius, 0, 0), radius, 1);
  scene.bodies.velocity[0].u[0] = 0.45 * radius / h;
  Stage& stage = scene.setup.stages.emplace_back();
  stage.name = "hit";
  stage.time_step = h;
  stage.laws = laws_of_one_material(0, 0, 1);
  stage.end.steps = 1;
  scene.setup.detection.skin = 0;
  scene.setup.decomposition.subdomains = 1;
  const Claims claims = claims_of(scene, graph::one_rank(), true);
  // Thrown at 0.9 radii in a step, for half of it, over a gap of 0.3 radii.
  ASSERT_EQ(claims.named.size(), 1U);
  EXPECT_NEAR(claims.overlap[0], 0.15, 1e-5);
  EXPECT_EQ(claims.named[0], (BodyPair{1, 2}));
}

}  // namespace
}  // namespace talus::unseen_overlap_test
