// The walls of the judge of `talus study certificate`, which are its own, against those of the program; and
// grains on them against closed forms.

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "apps/shared/sample_builder.hpp"
#include "apps/study_certificate/audited_run.hpp"
#include "apps/study_certificate/scene_maker.hpp"
#include "apps/study_certificate/step_walls.hpp"
#include "io/scene/scene.hpp"
#include "kernels/law/attraction.hpp"
#include "kernels/samples/sample.hpp"
#include "tests/unit/mesh_makers.hpp"

namespace talus::audit::walls_test {
namespace {

using Numbers = std::map<std::string, std::vector<double>>;

Wall wall_of(const std::string& shape, const Numbers& numbers, std::vector<Triangle> triangles = {}) {
  Wall wall;
  wall.name = shape;
  wall.normal.setZero();
  wall.shape.name = shape;
  wall.shape.values.number = numbers;
  wall.shape.values.triangles = std::move(triangles);
  make_surface(wall.shape);
  return wall;
}

std::vector<Wall> walls_of_all_shapes() {
  const Vec3 low(-0.5, -0.75, -0.25), high(0.5, 0.25, 0.75);
  const Numbers cone = {
      {"start", {0, 0, -0.5}}, {"end", {0.3, 0.1, 0.6}}, {"start_radius", {0.2}}, {"end_radius", {0.7}}};
  const Numbers rod = {{"start", {-0.4, 0, 0}}, {"end", {0.5, 0.3, 0}}, {"radius", {0.6}}};
  const auto inside = [](Numbers numbers) {
    numbers["inside"] = {1};
    return numbers;
  };
  Numbers tip = cone;
  tip["start_radius"] = {0};
  return {
      wall_of("disc", {{"centre", {0.1, 0, 0}}, {"axis", {0.3, -0.2, 1}}, {"radius", {0.6}}}),
      wall_of("rectangle", {{"corner", {-0.5, -0.4, 0}}, {"edge_a", {1, 0, 0.2}}, {"edge_b", {0, 0.9, 0}}}),
      wall_of("cylinder", rod),
      wall_of("cylinder", inside(rod)),
      wall_of("cone", cone),
      wall_of("cone", inside(cone)),
      wall_of("cone", tip),
      wall_of("cone", inside(tip)),
      wall_of("mesh", {}, test::box_mesh(low, high, 2)),
      wall_of("mesh", inside({}), test::box_mesh(low, high, 4)),
      wall_of("mesh", {}, test::funnel_mesh(0.2, 0.6, 0.7, 0.1, 9)),
  };
}

/// A motion of every kind at once.
std::vector<MotionPart> many_motions() {
  std::vector<MotionPart> parts(6);
  parts[0].velocity = {0.3, -0.2, 0.1};
  parts[1] = rotation_part({1, 2, -1}, {0.1, 0, -0.2}, 3);
  parts[2] = rotation_part(Vec3::UnitZ(), {0, 0.4, 0}, -2);
  parts[2].begin = 0.5, parts[2].end = 1.2;
  parts[3] = oscillation_part({0, 1, 1}, 0.05, 3, 0.7);
  parts[4].kind = MotionPart::Kind::table;
  parts[4].axis = Vec3::UnitX();
  MotionTable table;
  table.t = {0, 0.4, 0.9, 2};
  table.velocity = {{0, 0, 0}, {0.2, 0, 0.1}, {-0.1, 0.3, 0}, {0, 0, 0.5}};
  table.angle = {0, 0.3, 0.2, 0.9};
  integrate(table);
  parts[4].table = std::make_shared<const MotionTable>(table);
  parts[5] = rotation_part(Vec3::UnitY(), Vec3::Zero(), 1.5);
  parts[5].surface_only = true;
  return parts;
}

TEST(CertificateWalls, AreTouchedWhereThoseOfTheProgramAre) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> anywhere(-1.2, 1.2);
  int several = 0;
  for (const Wall& wall : walls_of_all_shapes()) {
    const StepWall own(wall, 0, 0);
    for (int k = 0; k < 2000; ++k) {
      const Vec3 centre(anywhere(random), anywhere(random), anywhere(random));
      std::vector<WallTouch> touches = own.touches(centre, 0.4, {});
      std::vector<SurfacePoint> points;
      collide(wall, centre, 0.4, points);
      ASSERT_EQ(touches.size(), points.size()) << wall.name << " at " << centre.transpose();
      several += touches.size() > 1 ? 1 : 0;
      for (const SurfacePoint& point : points) {
        const auto same = std::ranges::find_if(touches, [&](const WallTouch& touch) {
          return (touch.normal - point.normal).norm() < 1e-9 &&
                 std::abs(touch.distance - point.distance) < 1e-12;
        });
        EXPECT_NE(same, touches.end()) << wall.name << " at " << centre.transpose();
      }
    }
  }
  EXPECT_GT(several, 100) << "places in which a wall is touched more than once";
}

TEST(CertificateWalls, MoveAsThoseOfTheProgramDo) {
  constexpr double h = 1e-3;
  for (const double time : {0.0, 0.3, 0.4995, 0.7, 1.199, 1.9, 2.4}) {
    Wall wall = walls_of_all_shapes().front();
    wall.motion = many_motions();
    const StepWall own(wall, time, h);
    const Pose pose = pose_at(wall.motion, time + h / 2);
    const Placement middle = own.placed(h / 2);
    EXPECT_LT((pose.turn - middle.turn).norm() + (pose.shift - middle.shift).norm(), 1e-12) << time;
    const RigidVelocity rigid = mean_velocity(wall.motion, time + h / 2, h);
    const RigidVelocity belt = mean_surface_velocity(wall.motion, time + h / 2, h, rigid.pivot);
    const Vec3 n = Vec3(1, 1, -1).normalized(), c(0.3, -0.6, 0.2), u(0.7, -2, 3);
    wall.velocity = rigid.velocity;
    wall.omega = rigid.omega;
    wall.pivot = rigid.pivot;
    wall.belt = belt;
    const Vec3 expected = rigid.velocity + wall.drift_at(c, n, wall.half_way(c, n, u, h));
    EXPECT_LT((own.material_velocity(c, n, u) - expected).norm(), 1e-10) << time;
    EXPECT_GE(own.speed_near(c, 0.1), own.material_velocity(c + 0.1 * n, n, Vec3::Zero()).norm());
  }
}

constexpr double R = 0.01, density = 2600, h = 1e-3, g = 9.81;
const double mass = density * 4 / 3 * std::numbers::pi * R * R * R;

/// One grain and a wall.
struct GrainAtWall {
  Frame before;
  Bodies bodies;
  talus::Setup setup;
  Stage stage;

  GrainAtWall(const Vec3& x, Wall wall, const Vec3& gravity) {
    before.id = {0};
    before.x = {x};
    before.radius = {R};
    before.u = before.omega = {Vec3::Zero()};
    add_sphere(bodies, BodyId{0}, x, R, density);
    setup.walls = {std::move(wall)};
    stage.time_step = h;
    stage.gravity = gravity;
    stage.laws = laws_of_one_material(0, 0, 0);
  }
  StepInput input() const {
    static const std::vector<double> no_load = {0};
    return {before, setup.walls, no_load, stage, bodies, setup};
  }
};

TEST(CertificateWalls, ABallInAConeIsHeldByThreePointsOfACircle) {
  const double half_angle = 0.3, slant = std::sin(half_angle);
  const Wall cone = wall_of("cone", {{"start", {0, 0, 0}},
                                     {"end", {0, 0, 1}},
                                     {"start_radius", {0}},
                                     {"end_radius", {std::tan(half_angle)}},
                                     {"inside", {1}}});
  const GrainAtWall step({0, 0, R / slant}, cone, {0, 0, -g});
  const StepProblem problem = rebuild_step(step.input());
  ASSERT_EQ(problem.contacts.size(), 3U);
  const std::vector<Vec3> nothing(3, Vec3::Zero());
  const Reference answer = solve_reference(problem, nothing);
  ASSERT_EQ(answer.found, Found::answer);
  const double each = mass * g * h / (3 * slant);
  for (const Vec3& r : answer.exact) EXPECT_NEAR(r.norm(), each, 1e-6 * each);
}

TEST(CertificateWalls, AGrainBesideASeamOfTwoPlatesTouchesTheOneThatItStandsOn) {
  const auto plate = [](double from) {
    return wall_of("rectangle", {{"corner", {from, -1, 0}}, {"edge_a", {1, 0, 0}}, {"edge_b", {0, 2, 0}}});
  };
  for (const double x : {-0.03 * R, 0.03 * R}) {
    GrainAtWall step({x, 0, R}, plate(-1), {0, 0, -g});
    step.setup.walls.push_back(plate(0));
    step.before.u = {{0, 1, 0}};  // along the seam
    const std::vector<double> loads{0, 0};
    const StepProblem problem =
        rebuild_step({step.before, step.setup.walls, loads, step.stage, step.bodies, step.setup});
    ASSERT_EQ(problem.contacts.size(), 1U) << x;
    EXPECT_EQ(problem.contacts[0].second, x < 0 ? -1 : -2);
    EXPECT_LT((problem.contacts[0].normal - Vec3::UnitZ()).norm(), 1e-12);
  }
}

TEST(CertificateWalls, AGrainHangsFromACeilingThatHoldsIt) {
  for (const double share : {0.5, 2.0}) {
    Wall ceiling;
    ceiling.normal = -Vec3::UnitZ();
    GrainAtWall step({0, 0, -R}, ceiling, {0, 0, -g});
    step.stage.laws.set_all(cohesion_attraction, share * mass * g);
    const StepProblem problem = rebuild_step(step.input());
    ASSERT_EQ(problem.contacts.size(), 1U);
    const std::vector<Vec3> nothing(1, Vec3::Zero());
    const Reference answer = solve_reference(problem, nothing);
    ASSERT_EQ(answer.found, Found::answer);
    const double falls = std::max(0.0, 1 - share) * g * h;
    EXPECT_NEAR(answer.motion.u[0][2], -falls, 1e-9 * g * h) << share;
  }
}

// Positions are no part of a step's problem: a wall that turned once threw grains through it, and every step
// was certified.
TEST(CertificateAudit, AsksWhetherGrainsAreWhereTheirVelocitiesAndOverlapsTakeThem) {
  constexpr double radius = 0.01, overlap = 1e-4, part = 0.1;
  Frame before;
  before.x = {{0, 0, 0.3}, {0.02 - overlap, 0, 0.3}};
  before.u = {{0, 0.4, -1}, {0, 0.4, -1}};
  before.radius = {radius, radius};
  Frame after = before;
  for (Vec3& x : after.x) x += h * before.u[0];
  Stage stage;
  stage.time_step = h;
  const Bodies bodies;
  const talus::Setup setup;
  const StepInput input{before, {}, {}, stage, bodies, setup};
  const auto explained = [&](double given) { return unexplained_shift(input, given, after).within(1); };
  EXPECT_TRUE(explained(0));
  after.x[1][0] += part * overlap;
  EXPECT_TRUE(explained(part)) << "that is what overlap_correction is for";
  EXPECT_FALSE(explained(0)) << "nobody has asked for it";
  after.x[1][0] += overlap;
  EXPECT_FALSE(explained(part)) << "more than is undone in a step";
  // Where nothing overlaps, the rest of a solve that has ended: a hundred millionth of a radius.
  before.x[1][0] += radius;
  after.x[1] = before.x[1] + h * before.u[1];
  after.x[1][0] += part * 9e-9 * radius;
  EXPECT_TRUE(explained(part));
  after.x[1][0] += radius * 1e-6;
  EXPECT_FALSE(explained(part));
}

// With `overlap_correction` a grain before a paddle was once shifted by the paddle's velocity as if that were
// a length, and every step was certified.
TEST(CertificateWalls, AGrainBeforeAPaddleIsWhereItsVelocityTakesItAndNotBehindThePaddle) {
  Wall paddle =
      wall_of("rectangle", {{"corner", {-0.1, 0, -0.1}}, {"edge_a", {0.2, 0, 0}}, {"edge_b", {0, 0, 0.2}}});
  constexpr double rate = 5;
  paddle.motion = {rotation_part(Vec3::UnitZ(), {-0.1, 0, 0}, rate)};
  GrainAtWall step({0, R, 0}, paddle, Vec3::Zero());
  const StepProblem problem = rebuild_step(step.input());
  ASSERT_EQ(problem.contacts.size(), 1U);
  const double sweep = 0.1 * rate;  // of the paddle there
  EXPECT_NEAR(problem.contacts[0].drift.norm(), sweep, 0.02 * sweep);
  const std::vector<Vec3> nothing(1, Vec3::Zero());
  const Reference answer = solve_reference(problem, nothing);
  Frame after = step.before;
  after.walls.resize(1);
  after.u = answer.motion.u;
  after.x[0] += h / 2 * after.u[0];
  EXPECT_TRUE(unexplained_shift(step.input(), 0.1, after).within(1));
  after.x[0] -= 0.1 * problem.contacts[0].drift;
  EXPECT_FALSE(unexplained_shift(step.input(), 0.1, after).within(1));
}

/// Runs a scene and expects of its audit that the problems are those of the run, and the errors within twice
/// the claims. Returns how many steps were judged.
int judged_steps(MadeScene made, int steps) {
  io::place_walls(made.scene, made.grains);
  Bodies bodies;
  append(made.grains, bodies);
  const AuditedRun run = audit_run(made.scene, bodies, {steps, {}});
  EXPECT_EQ(run.ended, "") << made.name();
  int judged = 0;
  for (const AuditedStep& step : run.steps) {
    EXPECT_NE(step.judged, Judged::other_problem) << made.name() << " " << step.step << ": " << step.why;
    if (step.judged != Judged::yes || !step.certified || step.overlapping) continue;
    ++judged;
    const TrueErrors& errors = step.errors;
    EXPECT_LT(std::max({errors.velocity, errors.wall_force, errors.contact_force, errors.cluster}),
              2 * step.claimed)
        << made.name() << " " << step.step;
  }
  return judged;
}

TEST(CertificateWalls, OfTheFamiliesMakeTheProblemsOfTheirRuns) {
  int judged = 0;
  for (const char* family : {"drum", "hopper", "paddle", "mesh", "shaken", "sticky", "apart"})
    for (std::uint64_t seed = 11; seed <= 16; ++seed)
      judged += judged_steps(make_scene(family, seed, {.steps = 8}), 8);
  EXPECT_GT(judged, 200);
}

// Grains that go by up to 0.4 of their radius a step pass one another and the edges of walls.
TEST(CertificateWalls, OfFastGrainsAreJudgedByWhereTheseGo) {
  int judged = 0;
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> part(0.05, 0.4);
  for (const char* family : {"hopper", "paddle", "mesh", "clumps"})
    for (std::uint64_t seed = 21; seed <= 28; ++seed) {
      MadeScene made = make_scene(family, seed, {.steps = 6});
      const double step = made.scene.setup.stages.front().time_step;
      for (std::size_t k = 0; k < made.grains.x.size(); ++k) {
        const Vec3 direction = Vec3(normal(random), normal(random), normal(random)).normalized();
        made.grains.velocity[k] = {0, 0, 0};
        for (std::size_t c = 0; c < 3; ++c)
          made.grains.velocity[k][c] =
              part(random) * made.grains.radius[k] / step * direction[static_cast<Eigen::Index>(c)];
      }
      judged += judged_steps(std::move(made), 6);
    }
  EXPECT_GT(judged, 60);
}

TEST(CertificateWalls, ThatComeAndGoAreThereInTheirStages) {
  for (const bool comes : {false, true}) {
    MadeScene made = make_scene("deposition", 4, {.steps = 4});
    Stage second = made.scene.setup.stages.front();
    made.scene.setup.stages = {second, second};
    made.scene.setup.stages.back().name = "later";
    for (Stage& stage : made.scene.setup.stages) stage.end.steps = 2;
    Wall& floor = made.scene.setup.walls.front();
    (comes ? floor.from_stage : floor.until_stage) = "later";
    io::place_walls(made.scene, made.grains);
    Bodies bodies;
    append(made.grains, bodies);
    const AuditedRun run = audit_run(made.scene, bodies, {4, {}});
    ASSERT_EQ(run.steps.size(), 4U) << run.ended;
    for (const AuditedStep& step : run.steps)
      EXPECT_NE(step.judged, Judged::other_problem) << step.step << ": " << step.why;
    const std::int64_t with = run.steps[comes ? 2 : 0].contacts, without = run.steps[comes ? 0 : 2].contacts;
    EXPECT_GT(with, without);
  }
}

}  // namespace
}  // namespace talus::audit::walls_test
