/// Walls that are no planes: closed forms of a ball in a cone, in a cylinder and on the rim of a disc, and a
/// mesh against the plane that it is made of.

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/mesh_makers.hpp"
#include "tests/validation/experiment.hpp"

namespace talus::validation::closed_form_surfaces_test {
namespace {

constexpr double h = 1e-3, radius = 0.05, mass = 0.8;

TEST(BallInACylinder, RestsAtTheBottomAndSwingsAboutIt) {
  const double tube = 0.5, arm = tube - radius, angle = 0.05;
  Scene scene(h / 4);
  scene.stage().gravity = {0, 0, -g_earth};
  scene.surface("cylinder", {{"start", {0, -1, 0}}, {"end", {0, 1, 0}}, {"radius", {tube}}, {"inside", {1}}});
  scene.sphere({arm * std::sin(angle), 0, -arm * std::cos(angle)}, radius, mass);
  Experiment run(std::move(scene));
  // Without friction it slides as a pendulum; the first crossing of the middle takes a quarter of the period.
  while (run.x()[0] > 0) run.step();
  const double quarter = 0.5 * pi * std::sqrt(arm / g_earth) * (1 + angle * angle / 16);
  EXPECT_NEAR(run.time(), quarter, 0.02 * quarter);
  EXPECT_NEAR(std::hypot(run.x()[0], run.x()[2]), arm, 1e-3 * radius);
}

TEST(BallOnTheRimOfADisc, FeelsTheDirectionFromTheRimToItsCentre) {
  // Pressed to the rim by gravity along the line from the centre to the rim: it stays, and the rim carries
  // its weight.
  const Vec3 out = Vec3(0.6, 0, 0.8), rim(0.5, 0, 0);
  Scene scene(h);
  scene.stage().gravity = -g_earth * out;
  scene.surface("disc", {{"centre", {0, 0, 0}}, {"axis", {0, 0, 1}}, {"radius", {0.5}}});
  scene.sphere(rim + radius * out, radius, mass);
  Experiment run(std::move(scene));
  run.steps(20);
  EXPECT_TRUE(run.simulation().report().converged);
  EXPECT_LT((run.wall_force(0) - mass * g_earth * out).norm(), 1e-7);
  EXPECT_LT((run.x() - rim - radius * out).norm(), 1e-9);
}

/// A ball, or a clump of one, at rest beyond the alert distance of a floor that it reaches within the step by
/// its fall alone: it uses up the gap, as one does that was near from the beginning.
TEST(BallAboveAFloor, IsStoppedAlsoWhereOnlyTheFallOfTheStepBringsItThere) {
  const double gap = 0.5 * g_earth * h * h;
  for (const char* floor : {"plane", "disc", "mesh"})
    for (const bool clump : {false, true}) {
      Scene scene(h);
      scene.stage().gravity = {0, 0, -g_earth};
      scene.setup.detection.alert = 0.1 * gap;
      const std::string shape = floor;
      if (shape == "plane") scene.wall(shape, Vec3::Zero(), Vec3::UnitZ());
      if (shape == "disc")
        scene.surface(shape, {{"centre", {0, 0, 0}}, {"axis", {0, 0, 1}}, {"radius", {1}}});
      if (shape == "mesh") scene.surface(shape, {}, test::box_mesh({-1, -1, -0.1}, {1, 1, 0}, 3));
      const Vec3 centre(0.1, 0.2, radius + gap);
      if (clump) {
        const Ball one[] = {{Vec3::Zero(), radius}};
        scene.setup.clumps.push_back(make_clump(one).clump);
        add_clump(scene.bodies, scene.setup.clumps, 1, BodyId{0},
                  {centre, {1, 0, 0, 0}, radius, 2600, Vec3::Zero(), Vec3::Zero()});
      } else {
        scene.sphere(centre, radius, mass);
      }
      Experiment run(std::move(scene));
      run.step();
      EXPECT_NEAR(run.u()[2], -gap / h, 1e-9) << shape << (clump ? ", clump" : ", sphere");
    }
}

/// A ball that rolls and slides over a floor, made of a plane or of triangles, with the velocity of every
/// step.
std::vector<Vec3> roll(bool of_triangles) {
  Scene scene(h);
  scene.stage().gravity = {0, 0, -g_earth};
  scene.friction(0.2);
  if (of_triangles)
    scene.surface("mesh", {}, test::box_mesh({-1, -1, -0.1}, {1, 1, 0}, 9));
  else
    scene.wall("floor", Vec3::Zero(), Vec3::UnitZ());
  scene.sphere({-0.4, -0.3, radius}, radius, mass, {0.9, 0.65, 0});
  Experiment run(std::move(scene));
  std::vector<Vec3> velocities;
  for (int k = 0; k < 600; ++k) {
    run.step();
    velocities.push_back(run.u());
    velocities.push_back(run.w());
  }
  return velocities;
}

TEST(BallOnAMesh, FeelsNoEdgeBetweenTrianglesOfAPlane) {
  const std::vector<Vec3> plane = roll(false), mesh = roll(true);
  ASSERT_EQ(plane.size(), mesh.size());
  double worst = 0;
  for (std::size_t k = 0; k < plane.size(); ++k) worst = std::max(worst, (plane[k] - mesh[k]).norm());
  EXPECT_LT(worst, 1000 * epsilon) << "of velocities of about 1 m/s, over 600 steps";
  EXPECT_LT(std::abs(mesh.back()[2]), 1e-12);
}

/// A floor z = 0 (a tube's, along y = 0) of two walls that meet without a step at x = 0, or at x = 0 and 0.1.
void floor_with_a_seam(const std::string& kind, Scene& scene) {
  const auto plate = [&](double from, double to) {
    scene.surface("rectangle",
                  {{"corner", {from, -1, 0}}, {"edge_a", {to - from, 0, 0}}, {"edge_b", {0, 2, 0}}});
  };
  const auto tube = [&](double from, double to) {
    scene.surface("cylinder",
                  {{"start", {from, 0, 1}}, {"end", {to, 0, 1}}, {"radius", {1}}, {"inside", {1}}});
  };
  if (kind == "plates") plate(-1, 0), plate(0, 1);
  if (kind == "plates, the other first") plate(0, 1), plate(-1, 0);
  if (kind == "plates that overlap") plate(-1, 0.003), plate(-0.002, 1);
  if (kind == "tubes") tube(-1, 0), tube(0, 1);
  if (kind == "plate and mesh")
    plate(-1, 0), scene.surface("mesh", {}, test::box_mesh({0, -1, -0.1}, {1, 1, 0}, 3));
  if (kind == "plate and rounded mesh") {
    // As binary STL files have it: the edge at 0.1 is 1.5e-9 beyond that of the plate.
    plate(-1, 0.1);
    std::vector<Triangle> triangles = test::box_mesh({0.1, -1, -0.1}, {1, 1, 0}, 3);
    for (Triangle& triangle : triangles)
      for (Vec3& corner : triangle) corner = corner.cast<float>().cast<double>();
    scene.surface("mesh", {}, std::move(triangles));
  }
  if (kind == "disc in a plane")
    scene.wall("floor", Vec3::Zero(), Vec3::UnitZ()),
        scene.surface("disc", {{"centre", {0.05, 0, 0}}, {"axis", {0, 0, 1}}, {"radius", {0.05}}});
}

// A ball beside the seam stumbled over the edge of the wall that it had yet to reach: its nearest point is in
// front of the ball, and no higher than the floor.
TEST(BallOverASeam, FeelsNoEdgeBetweenWallsThatMeetInOnePlane) {
  for (const std::string kind : {"plates", "plates, the other first", "plates that overlap", "tubes",
                                 "plate and mesh", "plate and rounded mesh", "disc in a plane"})
    for (const bool clump : {false, true}) {
      constexpr double r = 0.01;
      Scene scene(h);
      scene.stage().gravity = {0, 0, -g_earth};
      scene.stage().laws.set_all(&PairLaw::restitution, 0.8);
      floor_with_a_seam(kind, scene);
      const Vec3 x(-0.05037, 0, r), u(1, 0, 0);
      if (clump) {
        const Ball one[] = {{Vec3::Zero(), r}};
        scene.setup.clumps.push_back(make_clump(one).clump);
        add_clump(scene.bodies, scene.setup.clumps, 1, BodyId{0},
                  {x, {1, 0, 0, 0}, r, 2600, u, Vec3::Zero()});
      } else {
        scene.sphere(x, r, 4.0 / 3 * pi * r * r * r * 2600, u);
      }
      const double weight = 4.0 / 3 * pi * r * r * r * 2600 * g_earth;
      Experiment run(std::move(scene));
      double first = 0, second = 0;
      for (int step = 0; step < 200; ++step) {
        run.step();
        first = std::max(first, run.wall_force(0)[2]), second = std::max(second, run.wall_force(1)[2]);
        const double carried = run.wall_force(0)[2] + run.wall_force(1)[2];
        ASSERT_NEAR(carried, weight, 1e-6 * weight) << kind << (clump ? ", clump" : "") << ", step " << step;
      }
      EXPECT_LT((run.u() - u).norm(), 1e-6) << kind << (clump ? ", clump" : "");
      // On the disc both are touched, and who carries is open.
      if (kind != "disc in a plane") {
        EXPECT_GT(std::min(first, second), 0.1 * weight) << kind << ": both bear it in their turn";
      }
    }
}

// An edge that does stick out is one: a plate that begins higher by a tenth of the radius.
TEST(BallOverASeam, StumblesOverAStep) {
  constexpr double r = 0.01;
  Scene scene(h);
  scene.stage().gravity = {0, 0, -g_earth};
  scene.wall("floor", Vec3::Zero(), Vec3::UnitZ());
  scene.surface("rectangle", {{"corner", {0, -1, 0.1 * r}}, {"edge_a", {1, 0, 0}}, {"edge_b", {0, 2, 0}}});
  scene.sphere({-0.05, 0, r}, r, mass, {1, 0, 0});
  Experiment run(std::move(scene));
  run.steps(60);
  EXPECT_LT(run.u()[0], 0.95);
  EXPECT_GT(run.x()[2], 1.05 * r);
}

// A ball that plugs the outlet of a funnel, a little off its axis, rests on the ring where cone and tube
// meet.
TEST(BallInAnOutlet, IsHeldByTheRingWhereConeAndTubeMeet) {
  constexpr double tube = 0.01, r = 0.012;
  for (const double off : {0.0, 1e-8, 1e-6, 1e-4}) {
    Scene scene(h);
    scene.stage().gravity = {0, 0, -g_earth};
    scene.surface("cylinder",
                  {{"start", {0, 0, -0.1}}, {"end", {0, 0, 0}}, {"radius", {tube}}, {"inside", {1}}});
    scene.surface("cone", {{"start", {0, 0, 0}},
                           {"end", {0, 0, 0.1}},
                           {"start_radius", {tube}},
                           {"end_radius", {0.11}},
                           {"inside", {1}}});
    const double height = std::sqrt(r * r - tube * tube);
    scene.sphere({off * r, 0, height + off * r}, r, mass);
    Experiment run(std::move(scene));
    run.steps(300);
    EXPECT_NEAR(run.wall_force(0)[2] + run.wall_force(1)[2], mass * g_earth, 1e-3 * mass * g_earth) << off;
    EXPECT_NEAR(run.x()[2], height, 1e-3 * r) << off;
    EXPECT_LT(std::hypot(run.x()[0], run.x()[1]), 1e-3 * r) << off;
  }
}

// At the middle of the step a trap door is as high as the floor, to rounding, but it falls faster than the
// ball.
TEST(BallOnATrapDoor, IsHeldByTheFloorThatTheDoorLeaves) {
  constexpr double r = 0.01, speed = 0.4;
  for (const double above : {0.0, 1e-7 * r, -1e-7 * r}) {
    Scene scene(h);
    scene.stage().gravity = {0, 0, -g_earth};
    const auto plate = [&](double z) {
      scene.surface("rectangle", {{"corner", {-1, -1, z}}, {"edge_a", {2, 0, 0}}, {"edge_b", {0, 2, 0}}});
    };
    plate(0);
    plate(above + 0.5 * h);
    MotionPart falling;
    falling.velocity = {0, 0, -1};
    scene.setup.walls.back().motion = {falling};
    scene.sphere({0, 0, r + 0.5 * h * speed}, r, mass, {0, 0, -speed});
    Experiment run(std::move(scene));
    run.step();
    EXPECT_NEAR(run.u()[2], 0, 1e-6) << above;
    EXPECT_NEAR(run.wall_force(0)[2], mass * (speed / h + g_earth), 1e-3 * mass * speed / h) << above;
  }
}

// A plate that rises out of the floor keeps its edge: what lies higher is nearer.
TEST(BallBesideAFlap, IsPushedByItsEdgeAsItRises) {
  constexpr double r = 0.01;
  Scene scene(h);
  scene.wall("floor", Vec3::Zero(), Vec3::UnitZ());
  scene.surface("rectangle", {{"corner", {0, -1, 0}}, {"edge_a", {1, 0, 0}}, {"edge_b", {0, 2, 0}}});
  MotionPart rising;
  rising.velocity = {0, 0, 0.02};
  scene.setup.walls.back().motion = {rising};
  scene.sphere({-0.3 * r, 0, r}, r, mass);
  Experiment run(std::move(scene));
  run.steps(100);
  EXPECT_LT(run.u()[0], -0.005);
  EXPECT_GT((run.x() - Vec3(0, 0, 0.002)).norm(), 0.99 * r) << "it is not in the edge";
}

TEST(BallInAMeshCorner, IsHeldByItsFacesAndNotByTheirEdge) {
  Scene scene(h);
  scene.stage().gravity = {-g_earth, 0, -g_earth};
  scene.surface("mesh", {{"inside", {1}}}, test::box_mesh({0, 0, 0}, {1, 1, 1}, 5));
  scene.sphere({radius, 0.47, radius}, radius, mass);
  Experiment run(std::move(scene));
  run.steps(10);
  const Frame frame = run.simulation().frame();
  ASSERT_EQ(frame.contact_force.size(), 2u);
  EXPECT_LT((run.wall_force(0) - mass * g_earth * Vec3(1, 0, 1)).norm(), 1e-8);
  EXPECT_LT((run.x() - Vec3(radius, 0.47, radius)).norm(), 1e-10);
}

// The drift of a wall that turns was taken for a displacement: a ball jumped by the numbers of a velocity.
TEST(BallPushedByAPaddle, IsShiftedByOverlapsOnlyWhileTheyAreUndone) {
  const Vec3 away(0.3, 0, 0);
  const double rate = 2, part = 0.1, speed = rate * away.norm();
  for (const std::string paddle : {"plane", "rectangle", "mesh"}) {
    Scene scene(h);
    scene.setup.solver.overlap_correction = part;
    if (paddle == "plane") scene.wall(paddle, Vec3::Zero(), Vec3::UnitZ());
    if (paddle == "rectangle")
      scene.surface(paddle, {{"corner", {-1, -1, 0}}, {"edge_a", {2, 0, 0}}, {"edge_b", {0, 2, 0}}});
    if (paddle == "mesh") scene.surface(paddle, {}, test::box_mesh({-1, -1, -0.1}, {1, 1, 0}, 3));
    scene.setup.walls.back().motion = {rotation_part(-Vec3::UnitY(), Vec3::Zero(), rate)};
    scene.sphere(away + Vec3(0, 0, radius), radius, mass);
    Experiment run(std::move(scene));
    double impulse = 0;
    for (int step = 0; step < 50; ++step) {
      const Vec3 x = run.x(), u = run.u();
      run.step();
      impulse += h * run.wall_force(0)[2];
      // An overlap is what the paddle sweeps over in a step, at most.
      EXPECT_LT((run.x() - x - 0.5 * h * (u + run.u())).norm(), part * h * speed)
          << paddle << ", step " << step;
    }
    EXPECT_GT(impulse, 0.99 * mass * speed) << paddle;
  }
}

}  // namespace
}  // namespace talus::validation::closed_form_surfaces_test
