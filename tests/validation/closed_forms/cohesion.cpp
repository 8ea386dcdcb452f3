/// Cohesion: what touches holds up to a force c.

#include <gtest/gtest.h>

#include "tests/validation/experiment.hpp"

namespace talus::validation::closed_form_cohesion_test {
namespace {

constexpr double h = 1e-3, radius = 0.1, mass = 2, weight = mass * g_earth;

/// Grains that hang from a ceiling, one below the other.
Scene hanging(int grains, double c) {
  Scene scene(h);
  scene.wall("ceiling", Vec3::Zero(), -Vec3::UnitZ());
  scene.stage().gravity = Vec3(0, 0, -g_earth);
  scene.stage().laws.set_all(cohesion_attraction, c);
  for (int k = 0; k < grains; ++k) scene.sphere({0, 0, -radius - 2 * radius * k}, radius, mass);
  return scene;
}

TEST(Cohesion, GrainHangsFromACeilingThatHoldsItsWeightAndFallsFromAWeakerOne) {
  Experiment held(hanging(1, 1.001 * weight));
  held.steps(500);
  EXPECT_NEAR(held.x()[2], -radius, 1e-12);
  EXPECT_NEAR(held.wall_force(0)[2], weight, 1e-9 * weight) << "the ceiling pulls it up";
  Experiment falls(hanging(1, 0.999 * weight));
  falls.steps(2000);
  EXPECT_LT(falls.x()[2], -2 * radius);
  EXPECT_EQ(falls.wall_force(0)[2], 0);
}

/// What pulls at a grain in a step is in its frame, also where the contact parts.
TEST(Cohesion, ThatDoesNotHoldIsAForceInTheFrameOfItsStep) {
  const double c = 0.25 * weight;
  Experiment run(hanging(1, c));
  run.step();
  const Frame frame = run.simulation().frame();
  EXPECT_NEAR(frame.u.at(0)[2], -(weight - c) / mass * h, 1e-12);
  ASSERT_EQ(frame.contact_force.size(), 1u);
  EXPECT_NEAR(frame.contact_force[0][2], c, 1e-9 * weight);
}

/// What pulls through a thousandth of the radius is a well, which a ball leaves that is fast enough: also one
/// that loses nothing as it rebounds.
TEST(Cohesion, HoldsABallThatReboundsTooSlowlyToLeaveItAndNotAFasterOne) {
  const double c = 10, well = c * 1e-3 * radius;
  for (const double e : {0.0, 0.5, 0.99, 1.0})
    for (const double share : {0.01, 0.5, 6.0}) {
      const double speed = std::sqrt(2 * share * well / mass), step = 0.02 * 1e-3 * radius / speed;
      Scene scene(step);
      scene.wall("floor", Vec3::Zero(), Vec3::UnitZ());
      scene.stage().laws.set_all(cohesion_attraction, c);
      scene.stage().laws.set_all(&PairLaw::restitution, e);
      scene.sphere({0, 0, radius}, radius, mass, {0, 0, -speed});
      Experiment run(std::move(scene));
      run.steps(500);
      const double left = e * e * share - 1;  // of the energy, behind the first rebound, over the well
      if (left < 0)
        EXPECT_LT(run.x()[2] - radius, 1e-3 * radius) << "e = " << e << ", " << share << " of the well";
      else
        EXPECT_NEAR(run.u()[2], std::sqrt(2 * left * well / mass), 0.05 * speed) << "e = " << e;
    }
}

/// Beyond the reach of cohesion an elastic grain pushes others as if there were none: with a contact there,
/// that parts, the last one would be braked.
TEST(Cohesion, TakesNoEnergyFromElasticGrainsBeyondItsReach) {
  constexpr double r = 0.01;
  for (const RestitutionLaw law : {RestitutionLaw::moreau, RestitutionLaw::newton})
    for (const double last : {0.0401, 0.04012, 0.0403, 0.0406}) {
      Scene scene(h);
      scene.setup.solver.restitution_law = law;
      scene.stage().laws.set_all(cohesion_attraction, 1e-9);
      scene.stage().laws.set_all(&PairLaw::restitution, 1);
      scene.sphere({0, 0, 0}, r, 0.01, {1, 0, 0});
      scene.sphere({0.0201, 0, 0}, r, 0.01);
      scene.sphere({last, 0, 0}, r, 0.01, {0.1, 0, 0});
      Experiment run(std::move(scene));
      const double before = run.kinetic_energy();
      run.steps(50);
      EXPECT_NEAR(run.kinetic_energy(), before, 1e-6 * before) << last;
    }
}

/// Nor from pairs without cohesion that stand in one chunk with pairs that have it.
TEST(Cohesion, TakesNoEnergyFromElasticGrainsOfAnotherMaterial) {
  constexpr double r = 0.01;
  Scene scene(h);
  scene.stage().laws = PairTable(2, {.restitution = 1});
  LawNumber(cohesion_attraction).in(scene.stage().laws.between(material_of_grains, material_of_grains)) =
      1e-9;
  scene.sphere({0, 0, 0}, r, 0.01, {1, 0, 0});
  scene.sphere({0.0201, 0, 0}, r, 0.01);
  scene.sphere({0.020105 + 2 * r, 0, 0}, r, 0.01, {1e-3, 0, 0});  // 5e-6 m apart, within a reach of 1e-5
  scene.bodies.material = {material_of_grains, material_of_grains, material_of_walls};
  Experiment run(std::move(scene));
  const double before = run.kinetic_energy();
  run.steps(50);
  EXPECT_NEAR(run.kinetic_energy(), before, 1e-6 * before);
}

/// A grain that sticks to a wall and rests, with nothing else at work: what rounding leaves of its momentum
/// over what rounding leaves of the forces is no error.
TEST(Cohesion, AGrainAtRestWithoutWeightIsCertifiedForGood) {
  Scene scene(1e-4);
  scene.setup.solver = {};
  scene.wall("floor", Vec3::Zero(), Vec3::UnitZ());
  scene.stage().laws.set_all(cohesion_attraction, 0.1);
  scene.stage().laws.set_all(&PairLaw::restitution, 0.5);
  scene.sphere({0, 0, 0.01002}, 0.01, 0.011, {0, 0, -0.01});
  Experiment run(std::move(scene));
  for (int step = 0; step < 400; ++step) {
    run.step();
    ASSERT_TRUE(run.simulation().report().converged) << step;
  }
}

/// Nothing is at work but what pulls the grains together: the trifle by which a step is off is no runaway.
TEST(Cohesion, ALatticeAtRestStaysThereByEveryMethod) {
  constexpr double r = 0.002;
  for (const SolverMethod method : {SolverMethod::automatic, SolverMethod::nlgs, SolverMethod::admm}) {
    Scene scene(4.47e-5);
    scene.setup.solver = {};
    scene.setup.solver.method = method;
    scene.wall("floor", Vec3::Zero(), Vec3::UnitZ());
    scene.stage().laws.set_all(cohesion_attraction, 4.5e-3);
    for (int k = 0; k < 16; ++k)
      scene.sphere(r * Vec3(1 + 2 * (k % 2), 1 + 2 * (k / 2 % 2), 1 + 2 * (k / 4)), r, 3.35e-5);
    Experiment run(std::move(scene));
    run.steps(3);
    EXPECT_NEAR(run.x(15)[2], 7 * r, 1e-6 * r);
  }
}

TEST(Cohesion, TwoGrainsHoldUpToCAndPartAboveIt) {
  for (const bool holds : {true, false}) {
    Scene scene = hanging(2, 1e6);
    LawNumber(cohesion_attraction).in(scene.stage().laws.between(material_of_grains, material_of_grains)) =
        (holds ? 1.001 : 0.999) * weight;
    Experiment run(std::move(scene));
    run.steps(2000);
    EXPECT_NEAR(run.x(0)[2], -radius, 1e-12) << "the upper one hangs from the ceiling";
    if (holds) {
      EXPECT_NEAR(run.x(1)[2], -3 * radius, 1e-12);
      EXPECT_NEAR(run.wall_force(0)[2], 2 * weight, 1e-9 * weight);
      const Frame frame = run.simulation().frame();
      ASSERT_EQ(frame.contact_force.size(), 2u);
      for (std::size_t k = 0; k < 2; ++k) {
        if (frame.contact_bodies[k][1] < 0) continue;
        EXPECT_NEAR(frame.contact_force[k].dot(frame.contact_normal[k]), -weight, 1e-9 * weight) << "tension";
      }
    } else {
      EXPECT_LT(run.x(1)[2], -4 * radius);
      EXPECT_NEAR(run.wall_force(0)[2], weight, 1e-9 * weight);
    }
  }
}

// The cone of r_n + c: a block on a vertical wall is held by mu c.
TEST(Cohesion, BlockSticksToAVerticalWallByFrictionOfItsCohesion) {
  const double mu = 0.4;
  for (const double part : {0.99, 1.01}) {
    Scene scene(h);
    scene.wall("wall", Vec3::Zero(), Vec3::UnitX());
    scene.stage().gravity = Vec3(0, 0, -g_earth);
    scene.friction(mu);
    scene.stage().laws.set_all(cohesion_attraction, part * weight / mu);
    scene.setup.rotation = false;
    scene.sphere({radius, 0, 0}, radius, mass);
    Experiment run(std::move(scene));
    run.steps(500);
    EXPECT_NEAR(run.u()[2], -g_earth * std::max(0.0, 1 - part) * 500 * h, 1e-10) << part;
    EXPECT_NEAR(run.wall_force(0)[0], 0, 1e-9 * weight) << "nothing presses it";
  }
}

// A pushed wall is pulled by what sticks to it: it and the grain follow the force as one body.
TEST(Cohesion, PushedWallDragsTheGrainThatSticksToIt) {
  const double force = 3, wall_mass = 1;
  Scene scene(h);
  Wall& wall = scene.wall("wall", Vec3::Zero(), Vec3::UnitX());
  wall.load.drive = WallDrive::force;
  wall.load.force = -force;
  wall.load.mass = wall_mass;
  scene.stage().laws.set_all(cohesion_attraction, 10);
  scene.sphere({radius, 0, 0}, radius, mass);
  Experiment run(std::move(scene));
  run.steps(200);
  EXPECT_NEAR(run.u()[0], -force / (mass + wall_mass) * 200 * h, 1e-10);
  EXPECT_NEAR(run.wall_force(0)[0], -force * mass / (mass + wall_mass), 1e-9);
}

TEST(Cohesion, ChainHangsTheSameInOneSubdomainAndInSeveralAndByEveryMethod) {
  const int grains = 12;
  for (const SolverMethod& method :
       {SolverMethod::nlgs, SolverMethod::automatic, SolverMethod::admm, SolverMethod::nncg})
    for (const int subdomains : {1, 3}) {
      Scene scene = hanging(grains, 1.5 * grains * weight);
      scene.setup.solver.method = method;
      scene.setup.solver.tolerance = 1e-8;
      scene.setup.solver.balance_tolerance = 1e-3;
      scene.setup.decomposition.subdomains = subdomains;
      Experiment run(std::move(scene));
      run.steps(20);
      EXPECT_TRUE(run.simulation().report().converged) << subdomains;
      EXPECT_NEAR(run.wall_force(0)[2], grains * weight, 2e-3 * grains * weight) << subdomains;
      EXPECT_NEAR(run.x(grains - 1)[2], -(2 * grains - 1) * radius, 1e-6) << subdomains;
    }
}

}  // namespace
}  // namespace talus::validation::closed_form_cohesion_test
