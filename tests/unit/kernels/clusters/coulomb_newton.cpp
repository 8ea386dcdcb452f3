// Proximal steps of Coulomb's law to the answer of a cluster, against closed forms.

#include "kernels/clusters/coulomb_newton.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "kernels/clusters/cluster_solver.hpp"
#include "tests/unit/kernels/clusters/cluster_makers.hpp"

namespace talus::coulomb_newton_test {
namespace {

using namespace cluster_makers;

Correction corrected(const BodyProblem& problem) {
  double work = 1e9;
  return coulomb_correction(problem, {.enough = enough, .relative = 1e-3}, {}, {}, work).best;
}

/// A grain jammed in a V, a hair's breadth above both walls, which has to slide down into it: its contacts
/// carry all the friction that they can.
TEST(CoulombSteps, AJammedGrainThatHasToSlideUsesAllItsFriction) {
  for (const double a : {0.3, 0.0412, 5e-3}) {
    constexpr double mu = 0.5;
    const double gap = 0.3 * fall * std::sin(a), used = 0.6;
    BodyProblem problem = wedge(a, mu);
    for (std::size_t k = 0; k < 2; ++k) {
      ContactEquation& contact = problem.contacts[k];
      contact.offset = gap * contact.normal;
      const Vec3 up = (Vec3::UnitZ() - contact.normal.z() * contact.normal).normalized();
      problem.impulse[k] =
          fall / (2 * (std::sin(a) + used * mu * std::cos(a))) * (contact.normal + used * mu * up);
    }
    const Correction answer = corrected(problem);
    ASSERT_TRUE(answer.settled) << a;
    const double exact = (fall - gap / std::sin(a)) / (2 * (std::sin(a) + mu * std::cos(a)));
    for (std::size_t k = 0; k < 2; ++k)
      EXPECT_NEAR(impulse_of(problem, answer, k).dot(problem.contacts[k].normal), exact, 1e-3 * exact) << a;
  }
}

/// A grain that walls of a V press by a million times what moves it, friction holding it down, and that is a
/// hair's breadth above them: it has to let go of all that. A step of firmness 10^9 takes a thousandth of it
/// off.
TEST(CoulombSteps, LeapAlongForcesThatAJammedGrainHasToLetGoOf) {
  constexpr double a = 0.3, mu = 0.5, pressed = 1e6 * fall, gap = 1e-6 * fall * std::numbers::inv_pi;
  BodyProblem problem = wedge(a, mu);
  const double up_friction = fall / (2 * pressed * std::cos(a)) - std::tan(a);
  for (std::size_t k = 0; k < 2; ++k) {
    ContactEquation& contact = problem.contacts[k];
    contact.offset = gap * contact.normal;
    const Vec3 up = (Vec3::UnitZ() - contact.normal.z() * contact.normal).normalized();
    problem.impulse[k] = pressed * (contact.normal + up_friction * up);
  }
  const ClusterGoal goal{.enough = 1e-8 * fall, .relative = 1e-5};
  double work = 1e9;
  const Correction answer = coulomb_correction(problem, goal, {}, {}, work).best;
  ASSERT_TRUE(answer.settled);
  const double exact = (fall - gap / std::sin(a)) / (2 * (std::sin(a) + mu * std::cos(a)));
  for (std::size_t k = 0; k < 2; ++k)
    EXPECT_NEAR(impulse_of(problem, answer, k).dot(problem.contacts[k].normal), exact, 1e-3 * exact);
  EXPECT_NEAR(answer.motion[0].u[2], -gap / std::sin(a), 1e-3 * gap);
  work = 1e9;
  EXPECT_FALSE(coulomb_correction(problem, goal, {}, {.most_leaps = 0}, work).best.settled)
      << "it is they that help";
}

/// Two grains in a steep V with friction, wedged in by a hundred times their momentum and moving towards each
/// other, from a step of the certificate's study (wedge-429). Their shares of friction creep there from sweep
/// to sweep.
BodyProblem jammed_pair() {
  constexpr double mu = 0.10116, c = 0.999837921211138, s = 0.018003647080250772;
  BodyProblem problem;
  for (int k = 0; k < 2; ++k) {
    add_grain(problem, Vec3::Zero(), mu);
    problem.bodies.back().mass = 0.48737;
    problem.bodies.back().spin_mass = 0.4 * 0.48737;
  }
  problem.bodies[0].free = {{2.44420e-05, 8.24650e-04, -7.30200e-04},
                            {-1.65586e-04, 5.21872e-06, -1.78194e-05}};
  problem.bodies[1].free = {{1.88519e-05, -1.492447e-03, -7.10488e-04},
                            {-4.00902e-05, 1.250184e-05, 4.61219e-05}};
  add_contact(problem, 0, 1, Vec3(4.83899e-07, -1, 4.50197e-05).normalized(), mu);
  for (const double side : {1.0, -1.0})
    for (const std::int32_t grain : {0, 1})
      add_contact(problem, grain, -1, Vec3(side * c, 0, s), mu, side > 0 ? 0 : 1);
  problem.impulse = {{1.49479e-06, -5.67072e-04, 1.74594e-05},
                     {1.561525e-03, 7.85439e-05, 1.65510e-04},
                     {1.653474e-03, 8.12819e-05, 1.76321e-04},
                     {-1.575074e-03, 8.24531e-05, 1.65045e-04},
                     {-1.661287e-03, 7.48331e-05, 1.80750e-04}};
  return problem;
}

/// Signorini's and Coulomb's conditions, each on its own. `slow` [m/s] and `small` [N s] count as none.
void expect_the_law(const BodyProblem& problem, const std::vector<Vec3>& impulse, double slow, double small) {
  std::vector<Vec3> u, w;
  for (const BodyUnknown& body : problem.bodies) u.push_back(body.free.u), w.push_back(body.free.w);
  for (std::size_t k = 0; k < impulse.size(); ++k) {
    const ContactEquation& c = problem.contacts[k];
    const auto act = [&](std::int32_t body, double sign) {
      if (body < 0) return;
      const auto b = static_cast<std::size_t>(body);
      u[b] += sign * impulse[k] / problem.bodies[b].mass;
      w[b] -= c.normal.cross(impulse[k]) / problem.bodies[b].spin_mass;
    };
    act(c.first, 1);
    act(c.second, -1);
  }
  for (std::size_t k = 0; k < impulse.size(); ++k) {
    const ContactEquation& c = problem.contacts[k];
    const auto first = static_cast<std::size_t>(c.first);
    Vec3 v = u[first] + c.normal.cross(w[first]) + c.offset;
    if (c.second >= 0) {
      const auto second = static_cast<std::size_t>(c.second);
      v += c.normal.cross(w[second]) - u[second];
    }
    const double v_n = c.normal.dot(v), r_n = c.normal.dot(impulse[k]);
    const Vec3 v_t = v - v_n * c.normal, r_t = impulse[k] - r_n * c.normal;
    EXPECT_GE(v_n, -slow) << k << ": none closes";
    EXPECT_GE(r_n, -small) << k << ": none pulls";
    EXPECT_TRUE(r_n <= small || v_n <= slow) << k << ": those that carry stay closed";
    EXPECT_LE(r_t.norm(), c.mu * r_n + small) << k << ": within the cone";
    // Where a contact slides it carries all friction, against the slip.
    const Vec3 slip = v_t.norm() > slow ? Vec3(v_t.normalized()) : Vec3(Vec3::Zero());
    if (slip == Vec3::Zero()) continue;
    EXPECT_LE((r_t + c.mu * r_n * slip).norm(), 2 * c.mu * r_n * slow / v_t.norm() + small) << k;
  }
}

TEST(CoulombSteps, TwoGrainsJammedInAVObeyTheLaw) {
  const BodyProblem problem = jammed_pair();
  const ClusterAnswer answer = solve_cluster(problem, {.enough = 2.7e-7, .relative = 2e-4, .sweeps = 89});
  ASSERT_TRUE(answer.solved());
  std::vector<Vec3> impulse(problem.impulse);
  for (std::size_t k = 0; k < impulse.size(); ++k) impulse[k] += answer.impulse[k];
  expect_the_law(problem, impulse, 1e-8, 1e-9);
}

/// Grains of 1 kg on a cubic lattice, `edge` along and across and `layers` high, that touch all neighbours
/// and a floor, at rest but for the fall of a step, with a grain of mass `top` [kg] on the middle one. Each
/// column carries what is on it, or a part of that so far.
BodyProblem block(int edge, int layers, double top, double carried) {
  BodyProblem problem;
  const auto number = [&](int i, int j, int k) { return (k * edge + j) * edge + i; };
  for (int k = 0; k < layers; ++k)
    for (int j = 0; j < edge; ++j)
      for (int i = 0; i < edge; ++i) add_grain(problem, Vec3(i, j, k), 0.3);
  for (int k = 0; k < layers; ++k)
    for (int j = 0; j < edge; ++j)
      for (int i = 0; i < edge; ++i) {
        add_contact(problem, number(i, j, k), k > 0 ? number(i, j, k - 1) : -1, Vec3::UnitZ(), 0.3,
                    k > 0 ? -1 : 0);
        const double above = layers - k + (i == edge / 2 && j == edge / 2 ? top : 0);
        problem.impulse.back() = carried * fall * above * Vec3::UnitZ();
        if (i > 0) add_contact(problem, number(i, j, k), number(i - 1, j, k), Vec3::UnitX(), 0.3);
        if (j > 0) add_contact(problem, number(i, j, k), number(i, j - 1, k), Vec3::UnitY(), 0.3);
      }
  const std::int32_t heavy = add_grain(problem, Vec3(edge / 2, edge / 2, layers), 0.3);
  problem.bodies.back().mass = top;
  problem.bodies.back().spin_mass = 0.4 * top;
  add_contact(problem, heavy, number(edge / 2, edge / 2, layers - 1), Vec3::UnitZ(), 0.3);
  problem.impulse.back() = carried * fall * top * Vec3::UnitZ();
  return problem;
}

/// All of it has to stop. Steps that end while redundant forces may still creep are soft, and move little; a
/// heavy grain on light ones by so small a part of what it lacks that twenty more would leave most of it.
TEST(CoulombSteps, SayWhatIsStillToCome) {
  constexpr int edge = 5, layers = 8;
  int early = 0;
  for (const double top : {1.0, 1e5})
    for (const double carried : {0.0, 0.5, 0.9, 0.999})
      for (const double precise : {1e-3, 1e-2, 0.1, 0.3, 1.0, 10.0}) {
        const BodyProblem problem = block(edge, layers, top, carried);
        const double missing = (1 - carried) * (edge * edge * layers + top) * fall;
        double work = 1e9;
        const Correction answer =
            coulomb_correction(problem, {.enough = precise * missing, .relative = 1}, {}, {}, work).best;
        ASSERT_TRUE(answer.settled) << top << ' ' << carried << ' ' << precise;
        if (answer.missed > 0.01 * precise * missing) ++early;
        double wrong = 0;
        for (std::size_t b = 0; b < problem.bodies.size(); ++b) {
          const Twist& motion = answer.motion[b];
          wrong += problem.bodies[b].mass * (motion.u - (1 - carried) * fall * Vec3::UnitZ()).norm() +
                   problem.bodies[b].spin_mass * motion.w.norm();
        }
        EXPECT_LE(wrong, answer.uncertain() + 0.01 * precise * missing)
            << top << ' ' << carried << ' ' << precise;
        EXPECT_LE(answer.uncertain(), precise * missing) << top << ' ' << carried << ' ' << precise;
      }
  EXPECT_GE(early, 6);
}

// Walls of a V that close on a grain drive it out, at 1/sin a times their speed; not where friction is more
// than tan a. Impulses then grow without end: no search goes on for as many steps as it may.
TEST(CoulombSteps, EndWhereFrictionKeepsAGrainBetweenClosingWalls) {
  constexpr double a = 0.3;
  for (const double mu : {0.5, 0.2}) {
    BodyProblem problem = wedge(a, mu);
    for (ContactEquation& contact : problem.contacts) contact.offset = -fall * contact.normal;
    const bool kept = mu > std::tan(a);
    const ClusterGoal goal{.enough = enough, .relative = 1e-3};
    double work = 1e9;
    const StepsCorrection answer = coulomb_correction(problem, goal, {}, {}, work);
    EXPECT_EQ(answer.stuck, kept) << mu;
    EXPECT_EQ(answer.best.settled, !kept) << mu;
    EXPECT_EQ(solve_cluster(problem, goal).solved(), !kept) << mu;
    if (!kept) continue;
    double boundless = 1e9;
    coulomb_correction(problem, goal, {}, {.most_growth = 1e300}, boundless);
    EXPECT_GT(work, boundless) << "nor leaps as often as it may";
  }
}

TEST(CoulombSteps, KeepToTheirWorkAndSaySo) {
  const BodyProblem problem = wedge(0.3, 0.1);
  double work = 1;
  EXPECT_FALSE(coulomb_correction(problem, {.enough = enough, .relative = 1e-3}, {}, {}, work).best.settled);
  EXPECT_LE(work, 0);
  EXPECT_GT(work, -1e5) << "one factorisation of one grain";
  work = 1e9;
  EXPECT_TRUE(coulomb_correction(problem, {.enough = enough, .relative = 1e-3}, {}, {}, work).best.settled);
  EXPECT_LT(work, 1e9);
}

}  // namespace
}  // namespace talus::coulomb_newton_test
