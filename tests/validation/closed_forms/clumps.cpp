/// Rigid dumbbells and other clumps: what a body with a tensor of inertia does, by closed forms.

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "tests/validation/clump_scenes.hpp"

namespace talus::validation::closed_form_clumps_test {
namespace {

TEST(Clumps, HaveMassAndInertiaOfTheirBalls) {
  const Ball balls[] = {{{2, 1, 1}, 0.1}, {{2, 1.2, 1}, 0.1}};
  const PlacedClump placed = make_clump(balls);
  EXPECT_LT((placed.centre - Vec3(2, 1.1, 1)).norm(), 1e-14);
  EXPECT_NEAR(placed.radius, 0.2, 1e-14);
  EXPECT_NEAR(placed.clump.inertia[0] * mass * 0.04, along, 1e-14);
  EXPECT_NEAR(placed.clump.inertia[1] * mass * 0.04, across, 1e-14);
  EXPECT_NEAR(placed.clump.inertia[2] * mass * 0.04, across, 1e-14);
  for (std::size_t k = 0; k < 2; ++k) {
    const Ball& ball = placed.clump.balls[k];
    const Mat3 Q = rotation_of(placed.orientation);
    EXPECT_LT((placed.centre + placed.radius * (Q * ball.centre) - balls[k].centre).norm(), 1e-14);
    EXPECT_NEAR(placed.radius * ball.radius, 0.1, 1e-14);
  }
  EXPECT_THROW(make_clump({}), std::invalid_argument);
  const Ball nonsense[] = {{{0, 0, 0}, -1}};
  EXPECT_THROW(make_clump(nonsense), std::invalid_argument);
}

/// Largest change of energy of a clump of three unequal moments that turns freely for two seconds, about an
/// axis near the unstable one. Its angular momentum stays.
double drift_of_energy(double time_step) {
  ClumpScene scene(time_step);
  const Ball balls[] = {{{0, 0, 0}, 0.1}, {{0.25, 0, 0}, 0.08}, {{0, 0.17, 0}, 0.07}};
  const PlacedClump placed = make_clump(balls);
  scene.setup.clumps = {placed.clump};
  const Vec3 omega = rotation_of(placed.orientation) * Vec3(1, 12, 1);
  add_clump(scene.bodies, scene.setup.clumps, 1, BodyId{0},
            {Vec3::Zero(), placed.orientation, placed.radius, 1000, Vec3(0.1, 0, 0), omega});
  Experiment run(scene);
  run.steps(1);
  const Vec3 spin = spin_of(run, 0);
  const double energy = run.kinetic_energy();
  double drift = 0;
  Vec3 turned = Vec3::Zero();
  while (run.time() < 2) {
    run.step();
    drift = std::max(drift, std::abs(run.kinetic_energy() / energy - 1));
    EXPECT_LT((spin_of(run, 0) - spin).norm(), 1e-11 * spin.norm());
    turned = turned.cwiseMax((omega_of(run, 0) - omega).cwiseAbs());
  }
  EXPECT_GT(turned.norm(), 8) << "it must tumble, or nothing was tested";
  return drift;
}

TEST(Clumps, TumbleWithTheirAngularMomentumAndOfSecondOrderInEnergy) {
  const double coarse = drift_of_energy(2e-3), fine = drift_of_energy(1e-3);
  EXPECT_LT(coarse, 1e-2);
  EXPECT_GT(coarse / fine, 3.5);
}

TEST(Clumps, AreHitAtOneEndAndTurn) {
  for (const double e : {0.0, 0.5, 1.0}) {
    ClumpScene scene;
    scene.stage().laws.set_all(&PairLaw::restitution, e);
    scene.dumbbell(Vec3::Zero(), about(Vec3(1, 1, 0).normalized(), 0));
    const double v = 2;
    scene.sphere({0.5 * length, 0, -0.2205}, r, 0.5, {0, 0, v});
    Experiment run(scene);
    run.steps(40);
    // Without a rebound they stay together while the end turns: only until then is there a closed form.
    const double close = e > 0 ? 1e-9 : 1e-3;
    const double s = 0.5 * length, w = 1 / 0.5 + 1 / mass + s * s / across, impulse = (1 + e) * v / w;
    EXPECT_NEAR(run.u(1)[2], v - impulse / 0.5, close) << e;
    EXPECT_NEAR(run.u(0)[2], impulse / mass, close) << e;
    EXPECT_NEAR(omega_of(run, 0)[1], -s * impulse / across, 3 * close) << e;
    EXPECT_NEAR(momentum(run)[2], 0.5 * v, 1e-12);
  }
}

TEST(Clumps, LieOnAFloorWithTheirWeight) {
  for (const double mu : {0.0, 0.5}) {
    ClumpScene scene;
    scene.friction(mu);
    scene.slope(0);
    scene.dumbbell({0, 0, r}, about(Vec3::UnitZ(), 0.7));
    Experiment run(scene);
    run.steps(100);
    EXPECT_NEAR(run.wall_force(0)[2], mass * g_earth, 1e-9);
    EXPECT_LT(run.u().norm() + omega_of(run, 0).norm() * r, 1e-11);
    EXPECT_NEAR(run.x()[2], r, 1e-12);
  }
}

/// Two balls hold up to 2 c.
TEST(Clumps, HangOnACeilingByCohesionOfTheirBalls) {
  const double weight = mass * g_earth;
  for (const double cohesion : {0.49 * weight, 0.51 * weight}) {
    ClumpScene scene;
    scene.stage().laws.set_all(cohesion_attraction, cohesion);
    scene.stage().gravity = {0, 0, -g_earth};
    scene.wall("ceiling", {0, 0, 1}, -Vec3::UnitZ());
    scene.dumbbell({0, 0, 1 - r}, about(Vec3::UnitZ(), 0.4));
    Experiment run(scene);
    run.steps(100);
    const bool holds = 2 * cohesion > weight;
    if (holds) {
      EXPECT_NEAR(run.wall_force(0)[2], weight, 1e-9 * weight);
      EXPECT_NEAR(run.x()[2], 1 - r, 1e-9);
    } else {
      EXPECT_LT(run.x()[2], 1 - r - 0.01);
    }
  }
}

/// A dumbbell held between two walls: its stress is what the walls give, and its frame says how it turns.
TEST(Clumps, AreMeasuredByTheirBalls) {
  ClumpScene scene;
  scene.dumbbell({0.2, 0.1, 0.1}, about(Vec3::UnitX(), 0.3));
  add_box(scene, 0.4);
  scene.setup.walls[1].load.drive = WallDrive::force;
  scene.setup.walls[1].load.force = 50;
  scene.setup.walls[1].load.mass = 1;
  Experiment run(scene);
  run.steps(5);
  const Simulation& simulation = run.simulation();
  EXPECT_NEAR(run.wall_force(0)[0], 50, 1e-9);
  const Mat3 stress = simulation.sums().contacts.moment / h;
  EXPECT_NEAR(stress(0, 0), 50 * 0.4, 1e-8) << "force times the length between the walls";
  EXPECT_LT(simulation.sums().contacts.penetration_max, 1e-12);
  const Frame frame = simulation.frame(true);
  for (const Vec3& point : frame.contact_point)
    if (point[0] < 0.2) {
      EXPECT_NEAR(point[0], 0, 1e-12);
    }

  ClumpScene turning;
  const Vec3 omega(0, 2, 1);
  turning.dumbbell(Vec3::Zero(), Eigen::Quaterniond::Identity(), Vec3::Zero(), omega);
  Experiment free(turning);
  free.step();
  EXPECT_LT((free.simulation().frame(false).omega[0] - omega).norm(), 1e-2);
}

/// The floor pushes s beside the centre of mass: m a_z = N - m g with a_z + alpha s = 0 at the contact.
TEST(Clumps, FallOverOnASmoothFloor) {
  ClumpScene scene;
  scene.slope(0);
  const double angle = 0.8, s = 0.5 * length * std::cos(angle);
  scene.dumbbell({0, 0, r + 0.5 * length * std::sin(angle)}, about(Vec3::UnitY(), angle));
  Experiment run(scene);
  run.step();
  const double pushed = mass * g_earth / (1 + mass * s * s / across);
  EXPECT_NEAR(run.wall_force(0)[2], pushed, 1e-9 * pushed);
  EXPECT_NEAR(run.u()[2], h * (pushed / mass - g_earth), 1e-12);
  EXPECT_NEAR(run.u().head<2>().norm(), 0, 1e-14);
  EXPECT_NEAR(std::abs(omega_of(run, 0)[1]), h * pushed * s / across, 1e-9);
}

/// Across the slope it rolls as a whole, with the inertia about its axis; along it, it slides or stays.
TEST(Clumps, RollDownASlopeAcrossAndStayOnItAlong) {
  const double angle = 0.3;
  for (const bool lies_along : {false, true}) {
    ClumpScene scene;
    scene.friction(0.8);
    scene.slope(angle);
    scene.dumbbell({0, 0, r}, about(Vec3::UnitZ(), lies_along ? 0 : pi / 2));
    Experiment run(scene);
    run.steps(200);
    const double rolling = g_earth * std::sin(angle) / (1 + along / (mass * r * r)) * run.time();
    EXPECT_NEAR(run.u()[0], lies_along ? 0 : rolling, 1e-6 * rolling);
    EXPECT_NEAR(omega_of(run, 0)[1] * r, run.u()[0], 1e-6 * rolling);
  }
}

/// Clumps of one ball are spheres, by another kernel. Its arms reach to the middle of a gap, where those of
/// spheres have their radius.
TEST(Clumps, OfOneBallMoveAsSpheresDo) {
  const auto heap = [](bool clumps) {
    Scene scene(h);
    scene.friction(0.4);
    scene.slope(0.1);
    scene.wall("end", {0.8, 0, 0}, -Vec3::UnitX());
    const Ball one[] = {{Vec3::Zero(), r}};
    if (clumps) scene.setup.clumps.push_back(make_clump(one).clump);
    for (int k = 0; k < 4; ++k) {
      const Vec3 centre(0.25 + 0.21 * (k % 3) + 0.1 * (k / 3), 0, r + 0.185 * (k / 3));
      if (clumps)
        add_clump(scene.bodies, scene.setup.clumps, 1, BodyId{k},
                  {centre, {1, 0, 0, 0}, r, density(), {0.3, 0, -0.1}, {0, 0, 1}});
      else
        scene.sphere(centre, r, ball_mass, {0.3, 0, -0.1}).w[2] = r;
    }
    return scene;
  };
  Experiment spheres(heap(false)), clumps(heap(true));
  for (int k = 0; k < 300; ++k) {
    spheres.step();
    clumps.step();
  }
  for (std::int64_t id = 0; id < 4; ++id) {
    EXPECT_LT((spheres.u(id) - clumps.u(id)).norm(), 1e-4) << id;
    EXPECT_LT((spheres.w(id) - clumps.w(id)).norm(), 1e-4) << id;
    EXPECT_LT((spheres.x(id) - clumps.x(id)).norm(), 1e-5) << id;
  }
}

TEST(Clumps, KeepMomentumAndAngularMomentumAmongThemselves) {
  for (const double mu : {0.0, 0.5}) {
    Experiment run(cloud(3, 0.3, mu));
    run.step();
    const Vec3 p = momentum(run), L = angular_momentum(run);
    std::int64_t contacts = 0;
    for (int k = 0; k < 300; ++k) contacts += run.step().active;
    EXPECT_GT(contacts, 30);
    EXPECT_LT((momentum(run) - p).norm(), 1e-11);
    EXPECT_LT((angular_momentum(run) - L).norm(), 1e-11);
  }
}

TEST(Clumps, NeverGainEnergyInABox) {
  for (const double mu : {0.0, 0.4}) {
    ClumpScene scene = cloud(3, 0, mu);
    add_box(scene, 3 * 0.42);
    Experiment run(scene);
    double energy = run.kinetic_energy();
    const double first = energy;
    for (int k = 0; k < 300; ++k) {
      run.step();
      // A free turn keeps the energy to second order in the step, contacts never add any.
      EXPECT_LE(run.kinetic_energy(), energy + 1e-6 * first) << mu << " step " << k;
      energy = run.kinetic_energy();
    }
    EXPECT_LT(energy, 0.5 * first);
  }
}

TEST(Clumps, FallIntoAHeapByTheForcesOfItsWalls) {
  ClumpScene scene = cloud(3, 0, 0.4);
  add_box(scene, 3 * 0.42);
  scene.stage().gravity = {0, 0, -g_earth};
  scene.setup.solver.tolerance = 1e-4;
  Experiment run(scene);
  double all = 0;
  for (std::size_t s = 0; s < 27; ++s) all += run.simulation().state().bodies.mass(s);
  Vec3 before = momentum(run);
  double deepest = 0;
  for (int k = 0; k < 700; ++k) {
    deepest = std::max(deepest, run.step().penetration_max);
    Vec3 force = all * run.simulation().stage().gravity;
    for (std::size_t wall = 0; wall < 6; ++wall) force += run.wall_force(wall);
    const Vec3 now = momentum(run);
    EXPECT_LT((now - before - h * force).norm(), 1e-10 * all) << k;
    before = now;
  }
  EXPECT_GT(run.simulation().report().active, 40) << "no heap";
  EXPECT_LT(deepest, 0.02);
}

/// What a scene does must not depend on how it is cut.
TEST(Clumps, MoveTheSameInSubdomains) {
  const auto scene_of = [](int subdomains, Coupling coupling) {
    ClumpScene scene = cloud(3, 0, 0);
    add_box(scene, 3 * 0.42);
    scene.setup.walls[5].load.drive = WallDrive::force;
    scene.setup.walls[5].load.force = 100;
    scene.setup.walls[5].load.mass = 5;
    scene.setup.decomposition.subdomains = subdomains;
    scene.setup.decomposition.coupling = coupling;
    scene.setup.decomposition.repartition_every = 3;
    return scene;
  };
  for (const Coupling coupling : {Coupling::nscdd, Coupling::alternating}) {
    Experiment reference(scene_of(1, coupling)), cut(scene_of(4, coupling)),
        threads(scene_of(4, coupling), 2);
    for (int k = 0; k < 60; ++k) {
      reference.step();
      cut.step();
      threads.step();
    }
    EXPECT_EQ(cut.simulation().digest(), threads.simulation().digest());
    const StepState& state = cut.simulation().state();
    EXPECT_GT(state.bodies.size(), 27u) << "nobody stands in two subdomains";
    for (std::int64_t id = 0; id < 27; ++id)
      EXPECT_LT((reference.u(id) - cut.u(id)).norm() + (reference.w(id) - cut.w(id)).norm(), 1e-5) << id;
  }
}

TEST(Clumps, MoveTheSameByAdmm) {
  const auto scene_of = [](SolverMethod method, double mu) {
    ClumpScene scene = cloud(2, 0, mu);
    add_box(scene, 0.84);
    scene.stage().gravity = {0, 0, -g_earth};
    scene.setup.solver.method = method;
    return scene;
  };
  for (const double mu : {0.0, 0.3}) {
    Experiment sweeps(scene_of(SolverMethod::nlgs, mu)), admm(scene_of(SolverMethod::admm, mu));
    for (int k = 0; k < 50; ++k) {
      sweeps.step();
      admm.step();
    }
    for (std::int64_t id = 0; id < 8; ++id)
      EXPECT_LT((sweeps.u(id) - admm.u(id)).norm() + (sweeps.w(id) - admm.w(id)).norm(), 1e-4) << id;
  }
}

// The torque of a wall was once taken about where contacts stand at the end of a step: 0.2 % too large.
TEST(Clumps, InADrumTheTorqueThatTurnsItDoesItsWork) {
  ClumpScene scene;
  scene.stage().gravity = {0, 0, -g_earth};
  scene.friction(0.4);
  scene.surface("cylinder", {{"start", {0, -2, 0}}, {"end", {0, 2, 0}}, {"radius", {0.7}}, {"inside", {1}}});
  constexpr double rate = 3;
  scene.setup.walls[0].motion = {rotation_part(Vec3::UnitY(), Vec3::Zero(), rate)};
  scene.dumbbell({0, 0, -0.4}, about(Vec3::UnitY(), 0.3), {0.5, 0, 0});
  scene.dumbbell({0.2, 0.1, 0.1}, about({1, 1, 0}, 1));
  Experiment run(scene);
  double worked = 0;
  for (int k = 0; k < 1000; ++k) {
    const double step = run.step().time_step;
    const WallReport& drum = run.simulation().walls()[0];
    ASSERT_NEAR(drum.work - worked, step * rate * drum.torque[1], 1e-12 * (1 + std::abs(drum.work)));
    worked = drum.work;
  }
  EXPECT_GT(worked, 1);
}

}  // namespace
}  // namespace talus::validation::closed_form_clumps_test
