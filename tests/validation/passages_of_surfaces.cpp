/// Bodies that get behind thin surfaces, or into solids, where no contact brings them back: a step that lets
/// them is told, whatever the body and the surface, and so is a stage.

#include <gtest/gtest.h>

#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "runtime/graph/pretend_ranks.hpp"
#include "runtime/step/runaway.hpp"
#include "tests/unit/mesh_makers.hpp"
#include "tests/validation/clump_scenes.hpp"

namespace talus::validation::passages_of_surfaces_test {
namespace {

constexpr double step_length = 1e-3;  // [s]

/// A body at rest at the origin, its lowest point at z = -r, and a surface 0.5 m below that moves upwards: of
/// no thickness, or of a tenth of r.
Experiment sweep(const std::string& shape, bool clump, double speed, double begin) {
  ClumpScene scene(step_length);
  if (!clump) scene.setup.clumps.clear();
  const double z = -0.5 - begin;
  if (shape == "rectangle")
    scene.surface(shape, {{"corner", {-1, -1, z}}, {"edge_a", {2, 0, 0}}, {"edge_b", {0, 2, 0}}});
  else if (shape == "disc")
    scene.surface(shape, {{"centre", {0, 0, z}}, {"axis", {0, 0, 1}}, {"radius", {1}}});
  else
    scene.surface(shape, {}, test::box_mesh({-1, -1, z - 0.1 * r}, {1, 1, z}, 2));
  scene.setup.walls.back().motion = {MotionPart{.velocity = {0, 0, speed}}};
  scene.stage().laws.set_all(&PairLaw::restitution, 0.5);  // what bounces is not held before it touches
  if (clump)
    scene.dumbbell(Vec3::Zero(), about(Vec3::UnitY(), 0.3));
  else
    scene.sphere(Vec3::Zero(), r, mass);
  return Experiment(std::move(scene));
}

TEST(Surfaces, ThatSweepPastABodyWithoutTouchingItAreTold) {
  int missed = 0;
  for (const std::string shape : {"rectangle", "disc", "mesh"})
    for (const bool clump : {false, true})
      for (const double far : {2.5, 5.0, 40.0, 1500.0})
        for (int cut = 0; cut < 4; ++cut) {
          const double speed = far * r / step_length;
          Experiment run = sweep(shape, clump, speed, 0.25 * cut * far * r);
          std::int64_t passed = 0;
          while (run.time() * speed < 0.5 + far * r * (2 + 0.25 * cut)) passed += run.step().passed;
          if (run.u() != Vec3::Zero()) continue;
          ++missed;
          EXPECT_GT(passed, 0) << shape << (clump ? ", dumbbell, " : ", sphere, ") << far << ", " << cut;
        }
  EXPECT_GT(missed, 50) << "else nothing is looked at here";
}

/// A ball that comes to lie deep in a solid, where none of its triangles is near any more.
TEST(Surfaces, OfAThickSolidTellOfABodyThatEndsDeepInIt) {
  int entered = 0;
  for (const bool clump : {false, true})
    for (const double far : {2.5, 4.0, 5.0, 8.0})
      for (int cut = 0; cut < 8; ++cut) {
        ClumpScene scene(step_length);
        if (!clump) scene.setup.clumps.clear();
        scene.surface("mesh", {}, test::box_mesh({-4, -4, -4}, {4, 4, 0}));
        scene.stage().laws.set_all(&PairLaw::restitution, 0.5);
        const double way = far * r;
        const Vec3 begin(0.3, 0.2, 0.15 + (2 + cut / 8.0) * way), u(0, 0, -way / step_length);
        if (clump)
          scene.dumbbell(begin, about(Vec3::UnitY(), 0.3), u);
        else
          scene.sphere(begin, r, mass, u);
        Experiment run(std::move(scene));
        std::int64_t passed = 0;
        for (int k = 0; k < 4; ++k) passed += run.step().passed;
        if (run.x()[2] > 0) continue;
        ++entered;
        EXPECT_GT(passed, 0) << (clump ? "dumbbell, " : "sphere, ") << far << ", " << cut;
      }
  EXPECT_GT(entered, 10) << "else nothing is looked at here";
}

/// A surface that appears in the second stage, where a dumbbell is, and a sphere.
ClumpScene appearing(const std::string& shape, ShapeNumbers numbers, std::vector<Triangle> triangles) {
  ClumpScene scene(step_length);
  scene.surface(shape, std::move(numbers), std::move(triangles));
  scene.setup.walls.back().from_stage = "second";
  scene.stage().end.steps = 2;
  scene.setup.stages.push_back(scene.stage());
  scene.setup.stages.back().name = "second";
  scene.dumbbell(Vec3(0, 0, 1));
  scene.sphere(Vec3::Zero(), r, mass);
  return scene;
}

/// Steps of both stages on so many ranks, a subdomain each; the message of what ends them.
std::string ended_by(ClumpScene scene, int ranks = 1) {
  scene.setup.decomposition.subdomains = ranks;
  std::string message;
  std::mutex adding;
  graph::on_pretend_ranks(ranks, [&](const graph::Communicator& world) {
    graph::Executor executor({.threads = 1});
    Simulation simulation(scene.setup, world.rank() == 0 ? scene.bodies : Bodies{}, executor, world);
    try {
      for (int step = 0; step < 4; ++step, simulation.begin_next_stage()) simulation.step();
    } catch (const RunawayError& error) {
      const std::lock_guard lock(adding);
      EXPECT_TRUE(message.empty() || message == error.what()) << "ranks disagree";
      message = error.what();
    }
  });
  return message;
}

std::vector<Triangle> box(double low, double high) {
  return test::box_mesh({-1, -1, low}, {1, 1, high});
}

TEST(Surfaces, ThatAppearAroundACentreOutOfWhichNoContactLeadsEndTheRun) {
  const std::string of_sphere = ended_by(appearing("mesh", {}, box(-0.5, 0.5)));
  EXPECT_NE(of_sphere.find("step 3 (stage 'second'): wall 'mesh' appears"), std::string::npos) << of_sphere;
  EXPECT_NE(of_sphere.find("grain 1, or of a ball of it, lies 0.5 m inside"), std::string::npos) << of_sphere;
  const std::string of_clump = ended_by(appearing("mesh", {}, box(0.75, 1.25)));
  EXPECT_NE(of_clump.find("grain 0, or of a ball of it, lies 0.25 m inside"), std::string::npos) << of_clump;
  // Of a container, in whose solid all that is outside lies, only what it meets counts.
  const std::string of_container = ended_by(appearing("mesh", {{"inside", {1}}}, box(-2, 0.9375)));
  EXPECT_NE(of_container.find("grain 0, or of a ball of it, lies 0.0625 m inside"), std::string::npos)
      << of_container;
  EXPECT_EQ(ended_by(appearing("mesh", {{"inside", {1}}}, box(-0.5, 0.5))), "");
  // One that cuts into a sphere pushes it, and says how deep.
  EXPECT_EQ(ended_by(appearing("mesh", {}, box(-0.5, -0.0625))), "");
  // A cylinder has contacts with what lies in it.
  EXPECT_EQ(
      ended_by(appearing("cylinder", {{"start", {0, -1, 0}}, {"end", {0, 1, 0}}, {"radius", {0.5}}}, {})),
      "");
}

TEST(Surfaces, ThatAppearAreToldOfAlikeOnAnyRanks) {
  for (const auto& [low, high] : {std::pair(-0.5, 0.5), std::pair(0.75, 1.25), std::pair(-0.5, 1.25)}) {
    const std::string alone = ended_by(appearing("mesh", {}, box(low, high)));
    EXPECT_NE(alone, "") << low;
    EXPECT_EQ(ended_by(appearing("mesh", {}, box(low, high)), 2), alone) << low;
  }
}

TEST(Surfaces, ThatAppearFindWhatIsRemovedWithTheStageGone) {
  ClumpScene scene = appearing("mesh", {}, box(-0.5, 0.5));
  RemoveRule& rule = scene.setup.removes.emplace_back();
  rule.name = "dig";
  rule.region.low = Vec3::Constant(-0.5);
  rule.region.high = Vec3::Constant(0.5);
  rule.times.stage = "second";
  EXPECT_EQ(ended_by(scene), "");
}

}  // namespace
}  // namespace talus::validation::passages_of_surfaces_test
