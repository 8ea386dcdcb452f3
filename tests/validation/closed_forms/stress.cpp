/// Periodic cells that follow a stress: closed forms, and random packings against a plain solver of the same
/// step that shares no code with Talus.

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <array>
#include <cmath>
#include <map>
#include <ostream>
#include <random>
#include <utility>
#include <vector>

#include "runtime/step/runaway.hpp"
#include "tests/validation/experiment.hpp"

namespace talus::validation::closed_form_stress_test {
namespace {

constexpr double radius = 0.05, mass = 0.8, diameter = 2 * radius;

/// A cubic lattice of n x n x n grains that touch, filling the cell.
Scene lattice(double h, int n) {
  Scene scene(h);
  scene.setup.domain = periodic_domain(Vec3::Constant(n * diameter));
  scene.setup.decomposition.coupling = Coupling::nscdd;
  for (int k = 0; k < n * n * n; ++k)
    scene.sphere({diameter * (k % n + 0.5), diameter * (k / n % n + 0.5), diameter * (k / n / n + 0.5)},
                 radius, mass);
  return scene;
}

/// Of the grains, in (0, 1) or 0.
class WithRestitution : public testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(Cells, WithRestitution, testing::Values(0.0, 0.5));

TEST_P(WithRestitution, ACubicLatticeCarriesItsStressInEveryContactFromTheFirstStepOn) {
  const std::array<double, 3> stress = {1e3, 2e3, 5e2};
  Scene scene = lattice(1e-3, 4);
  scene.stage().laws.set_all(&PairLaw::restitution, GetParam());
  for (std::size_t k = 0; k < 3; ++k) scene.stage().stress.to[k] = stress[k];
  Experiment run(std::move(scene));
  for (int step = 0; step < 5; ++step) {
    ASSERT_TRUE(run.step().converged) << "step " << step;
    const auto cell = run.simulation().cell();
    ASSERT_TRUE(cell);
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(cell->stress[k], stress[k], 1e-8 * stress[k]) << "step " << step << " component " << k;
      EXPECT_NEAR(cell->edges[k], 4 * diameter, 1e-9);
    }
    for (std::size_t k = 3; k < 6; ++k) EXPECT_NEAR(cell->stress[k], 0, 1e-8 * stress[0]);
  }
  // Along a column every contact carries the same; how the columns of an axis share the stress is open.
  const Frame frame = run.simulation().frame();
  ASSERT_EQ(frame.contact_force.size(), 3U * 64);
  std::array<std::map<std::pair<int, int>, std::vector<double>>, 3> columns;
  for (std::size_t k = 0; k < frame.contact_force.size(); ++k) {
    Eigen::Index axis = 0;
    const double force = frame.contact_force[k].cwiseAbs().maxCoeff(&axis);
    const Vec3& x = frame.x[static_cast<std::size_t>(frame.contact_bodies[k][0])];
    const auto place = [&](Eigen::Index of) { return static_cast<int>(x[(axis + of) % 3] / diameter); };
    columns[static_cast<std::size_t>(axis)][{place(1), place(2)}].push_back(force);
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    ASSERT_EQ(columns[axis].size(), 16U);
    double sum = 0;
    for (const auto& [place, forces] : columns[axis]) {
      for (const double force : forces) EXPECT_NEAR(force, forces.front(), 1e-6 * stress[axis]);
      sum += forces.front();
    }
    EXPECT_NEAR(sum, stress[axis] * 16 * diameter * diameter, 1e-7 * sum);
  }
}

/// What contacts and forces of the lattice say of themselves: n along the axes, forces as the stresses are.
TEST(CubicLatticeUnderStress, HasTheFabricAndTheForcesOfItsAxes) {
  Scene scene = lattice(1e-3, 4);
  scene.stage().stress.to = {1e3, 1e3, 4e3, {}, {}, {}};
  Experiment run(std::move(scene));
  ASSERT_TRUE(run.step().converged);
  const auto cell = run.simulation().cell();
  ASSERT_TRUE(cell);
  for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(cell->fabric[k], 1.0 / 3, 1e-12);
  EXPECT_NEAR(cell->a_c, 0, 1e-12);
  // chi_n = diag(1, 1, 4)/6 of its trace; 15/2 dev = 15/2 (-1, -1, 2)/6, and sqrt(3/2) |.| of that.
  EXPECT_NEAR(cell->a_n, 7.5 * 3 / 6, 1e-7);
  EXPECT_NEAR(cell->a_t, 0, 1e-7);
  EXPECT_NEAR(cell->q_over_p, 1.5, 1e-7);
  EXPECT_NEAR(0.4 * (cell->a_c + cell->a_n + 1.5 * cell->a_t), cell->q_over_p, 1e-7);
}

/// Nothing touches: the cell alone, h'' = -(V sigma/(M d^2)) h, and grains that move with it.
TEST_P(WithRestitution, AnEmptyCellFallsInAsItsMassSays) {
  const double h = 1e-4, stress = 50, edge = 1;
  Scene scene(h);
  scene.setup.domain = periodic_domain(Vec3::Constant(edge), Vec3(0.3, -2, 1));
  scene.setup.decomposition.coupling = Coupling::nscdd;
  scene.setup.cell_inertia = 3;
  scene.stage().laws.set_all(&PairLaw::restitution, GetParam());
  scene.stage().stress.to[2] = stress;
  scene.sphere(Vec3(0.3, -2, 1) + Vec3(0.2, 0.3, 0.2), radius, mass);
  scene.sphere(Vec3(0.3, -2, 1) + Vec3(0.7, 0.8, 0.7), radius, 2 * mass);
  Experiment run(std::move(scene));
  const double inertia = 3 * 3 * mass * diameter * diameter;
  run.steps(200);
  // 1/2 z'^2 + (A sigma/(3 M d^2)) z^3 is constant.
  const Domain& domain = run.simulation().state().domain;
  const double z = domain.cell.zz, speed = domain.rates.zz, A = edge * edge;
  EXPECT_LT(z, 0.9 * edge) << "it fell";
  EXPECT_NEAR(0.5 * speed * speed, A * stress / (3 * inertia) * (edge * edge * edge - z * z * z),
              1e-3 * speed * speed);
  EXPECT_EQ(domain.cell.xx, edge);
  for (const auto& [id, place] : {std::pair{0, 0.2}, std::pair{1, 0.7}}) {
    EXPECT_NEAR((run.x(id)[2] - 1) / z, place, 1e-12) << "a grain keeps its place in the cell";
    EXPECT_NEAR(run.u(id)[2], speed * place, 1e-12);
    EXPECT_EQ(run.u(id)[0], 0);
  }
}

TEST(CellUnderMoreShearThanItBears, EndsWithAReason) {
  Scene scene = lattice(1e-2, 4);
  scene.stage().stress.to = {1e3, 1e3, 1e3, {}, 2e3, {}};
  Experiment run(std::move(scene));
  try {
    run.steps(2000);
    FAIL() << "it went on";
  } catch (const RunawayError& error) {
    EXPECT_NE(std::string(error.what()).find("shear stress"), std::string::npos) << error.what();
  }
}

/// Two grains in a cell of 1 m that fly apart along z, and both along `together`; zz follows `stress` [Pa].
Scene gas(const Vec3& together, double speed, double stress) {
  Scene scene(1e-4);
  scene.setup.domain = periodic_domain(Vec3::Constant(1));
  scene.setup.decomposition.coupling = Coupling::nscdd;
  scene.sphere({0.2, 0.2, 0.2}, radius, mass, together + Vec3(0, 0, speed));
  scene.sphere({0.7, 0.7, 0.7}, radius, mass, together - Vec3(0, 0, speed));
  scene.stage().stress.to[2] = stress;
  return scene;
}
constexpr double own_stress = 2 * mass;  ///< sum of m v_z^2 / V at 1 m/s [Pa]

/// A gas pushes back: with the stress that it has, the cell stays as it is.
TEST(GasInACellUnderItsOwnStress, HoldsTheCell) {
  Experiment run(gas(Vec3::Zero(), 1, own_stress));
  run.steps(50);
  EXPECT_NEAR(run.simulation().state().domain.cell.zz, 1, 1e-12);
  EXPECT_NEAR(run.simulation().state().domain.rates.zz, 0, 1e-12);
}

/// What all grains do together pushes nothing, however fast it is.
TEST(GasThatFliesAsAWhole, HoldsTheCellAsOneThatStays) {
  Scene scene = gas({5, -3, 7}, 1, own_stress);
  scene.stage().stress.to[0] = 0;
  Experiment run(std::move(scene));
  run.steps(50);
  EXPECT_NEAR(run.simulation().state().domain.cell.xx, 1, 1e-12);
  EXPECT_NEAR(run.simulation().state().domain.cell.zz, 1, 1e-12);
}

/// Velocities whose squares are less than any number are no harm.
TEST(GasThatHardlyMoves, LeavesTheCellAsItIs) {
  for (const double speed : {1e-150, 1e-158, 1e-200, 1e-320}) {
    Experiment run(gas(Vec3::Zero(), speed, 0));
    run.steps(3);
    EXPECT_EQ(run.simulation().state().domain.cell.zz, 1) << speed;
    EXPECT_LT(std::abs(run.simulation().cell()->kinetic_stress[2]), 1e-290) << speed;
  }
}

/// Nor does free fall.
TEST(LatticeThatFalls, CarriesTheStressOfItsCell) {
  const double pressure = 1e3;
  Scene scene = lattice(1e-3, 4);
  for (std::size_t k = 0; k < 3; ++k) scene.stage().stress.to[k] = pressure;
  scene.stage().gravity = {0, 0, -10};
  Experiment run(std::move(scene));
  for (int step = 0; step < 200; ++step) ASSERT_TRUE(run.step().converged) << "step " << step;
  for (std::size_t k = 0; k < 3; ++k)
    EXPECT_NEAR(run.simulation().cell()->stress[k], pressure, 1e-6 * pressure);
}

/// Cohesion pulls at the cell, too: a lattice that a stress pulls apart holds up to it.
TEST(CohesiveLattice, HoldsACellThatIsPulledApart) {
  const double pull = 900, strength = 1e3 * diameter * diameter;
  Scene scene = lattice(1e-3, 4);
  scene.stage().laws.set_all(cohesion_attraction, strength);
  for (std::size_t k = 0; k < 3; ++k) scene.stage().stress.to[k] = -pull;
  Experiment run(std::move(scene));
  for (int step = 0; step < 5; ++step) {
    ASSERT_TRUE(run.step().converged) << "step " << step;
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_NEAR(run.simulation().cell()->stress[k], -pull, 1e-7 * pull) << "step " << step;
  }
}

/// One contact of a plain solver.
struct PlainContact {
  std::size_t first, second;
  Vec3 normal, branch;
  double bias;
  Vec3 drift;  ///< velocity of the second's image beyond that of the second
  Vec3 impulse = Vec3::Zero();
};

/// The step that a cell of grains at rest makes under a stress: every pair of images, plain sequential
/// sweeps over velocities of grains, spins times radius and the gradient. Written from docs/theory.md.
struct PlainStep {
  double h = 0, mu = 0, inertia = 0;
  Mat3 edges;
  Mat3 free = Mat3::Zero();  ///< 1 for components that follow a stress
  Mat3 gradient = Mat3::Zero();
  std::vector<Vec3> x, u, w;
  std::vector<double> r, m;
  std::vector<PlainContact> contacts;

  void find(double alert) {
    for (std::size_t i = 0; i < x.size(); ++i)
      for (std::size_t j = i + 1; j < x.size(); ++j)
        for (int a = -1; a <= 1; ++a)
          for (int b = -1; b <= 1; ++b)
            for (int c = -1; c <= 1; ++c) {
              const Vec3 image = edges * Vec3(a, b, c), d = x[i] - x[j] - image;
              const double gap = d.norm() - r[i] - r[j];
              if (gap > alert) continue;
              contacts.push_back({i, j, d.normalized(), d, std::max(gap, 0.0) / h, gradient * image});
            }
  }
  void push(const PlainContact& c, const Vec3& dr) {
    u[c.first] += dr / m[c.first];
    u[c.second] -= dr / m[c.second];
    const Vec3 turn = dr.cross(c.normal);
    w[c.first] += turn * 2.5 / m[c.first];
    w[c.second] += turn * 2.5 / m[c.second];
    gain += (dr * c.branch.transpose()).cwiseProduct(free) / inertia;
  }
  Vec3 velocity(const PlainContact& c) const {
    return u[c.first] - u[c.second] - c.drift - (w[c.first] + w[c.second]).cross(c.normal) + gain * c.branch;
  }
  /// Returns the largest change of an impulse in the last sweep.
  double solve(int sweeps) {
    double change = 0;
    for (int sweep = 0; sweep < sweeps; ++sweep) {
      change = 0;
      for (PlainContact& c : contacts) {
        const double mobility = 1 / m[c.first] + 1 / m[c.second];
        const double of_cell = c.branch.squaredNorm() / inertia;
        const Vec3 v = velocity(c), before = c.impulse;
        const double r_n = before.dot(c.normal),
                     r_n_new = std::max(0.0, r_n - (v.dot(c.normal) + c.bias) / (mobility + of_cell));
        Vec3 t = before - r_n * c.normal - (v - v.dot(c.normal) * c.normal) / (3.5 * mobility + of_cell);
        if (t.norm() > mu * r_n_new) t *= mu * r_n_new / t.norm();
        c.impulse = r_n_new * c.normal + t;
        push(c, c.impulse - before);
        change = std::max(change, (c.impulse - before).norm());
      }
    }
    return change;
  }
  Mat3 gain = Mat3::Zero();
};

struct Case {
  double mu;
  SolverMethod method;
  int subdomains = 1;
  friend std::ostream& operator<<(std::ostream& out, const Case& c) {
    return out << c.method.name() << ", friction " << c.mu << ", subdomains " << c.subdomains;
  }
};
class RandomPackings : public testing::TestWithParam<Case> {};

/// 30 grains squeezed together at random, pushed by a stress that shears them, too.
TEST_P(RandomPackings, MoveUnderAStressAsAPlainSolverOfTheSameStepSays) {
  const auto [mu, method, subdomains] = GetParam();
  const double h = 1e-3, edge = 0.34;
  const std::array<double, 6> stress = {2e3, 1e3, 1.5e3, 3e2, -2e2, 0};
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place(0, edge);
  Scene scene(h);
  scene.setup.domain = periodic_domain(Vec3::Constant(edge));
  scene.setup.decomposition.coupling = Coupling::nscdd;
  scene.setup.decomposition.subdomains = subdomains;
  scene.setup.cell_inertia = 0.5;
  scene.setup.solver.method = method;
  scene.setup.solver.overlap_tolerance = 10;
  scene.setup.detection.alert = 0.01;
  scene.friction(mu);
  for (std::size_t k = 0; k < 5; ++k) scene.stage().stress.to[k] = stress[k];
  scene.stage().shear_rates = {0, 0, 0.7};
  PlainStep plain;
  plain.h = h;
  plain.mu = mu;
  plain.edges = edge * Mat3::Identity();
  double all = 0;
  for (int k = 0; k < 30; ++k) {
    const Vec3 x(place(random), place(random), place(random));
    const Vec3 u = 0.1 / edge * Vec3(place(random), place(random), place(random));
    scene.sphere(x, radius, mass * (1 + k % 3), u);
    plain.x.push_back(x + 0.5 * h * u);
    plain.u.push_back(u);
    plain.w.push_back(Vec3::Zero());
    plain.r.push_back(radius);
    plain.m.push_back(mass * (1 + k % 3));
    all += plain.m.back();
  }
  plain.inertia = 0.5 * all * diameter * diameter;
  // From rest: what the stress and the grains' own motion give the cell, and the rate of yz at once.
  Mat3 kinetic = Mat3::Zero(), aim = Mat3::Zero();
  Vec3 together = Vec3::Zero();  // what all do together presses nothing
  for (std::size_t k = 0; k < 30; ++k) together += plain.m[k] / all * plain.u[k];
  for (std::size_t k = 0; k < 30; ++k)
    kinetic += plain.m[k] * (plain.u[k] - together) * (plain.u[k] - together).transpose();
  aim << stress[0], stress[3], stress[4], 0, stress[1], 0, 0, 0, stress[2];
  plain.free << 1, 1, 1, 0, 1, 0, 0, 0, 1;
  plain.gradient = h * (kinetic - edge * edge * edge * aim).cwiseProduct(plain.free) / plain.inertia;
  plain.gradient(1, 2) = 0.7;
  for (std::size_t k = 0; k < 30; ++k) plain.u[k] += plain.gradient * plain.x[k];
  plain.find(0.01);
  ASSERT_GT(plain.contacts.size(), 40U);
  ASSERT_LT(plain.solve(20000), 1e-13);

  Experiment run(std::move(scene));
  const StepReport& report = run.step();
  ASSERT_TRUE(report.converged) << report.error_rms << " " << report.balance;
  EXPECT_EQ(static_cast<std::size_t>(report.contacts), plain.contacts.size());
  const Mat3 G = plain.gradient + plain.gain, rates = matrix_of(run.simulation().state().domain.rates);
  EXPECT_LT((rates - G * edge).norm(), 1e-8 * (G * edge).norm()) << rates << "\n" << G * edge;
  for (std::size_t k = 0; k < 30; ++k)
    EXPECT_LT((run.u(static_cast<std::int64_t>(k)) - plain.u[k] - plain.gain * plain.x[k]).norm(), 1e-7)
        << "grain " << k;
}
INSTANTIATE_TEST_SUITE_P(Solved, RandomPackings,
                         testing::Values(Case{0.0, SolverMethod::automatic},
                                         Case{0.4, SolverMethod::automatic}, Case{0.0, SolverMethod::nlgs},
                                         Case{0.4, SolverMethod::nlgs}, Case{0.4, SolverMethod::nncg},
                                         Case{0.0, SolverMethod::admm}, Case{0.4, SolverMethod::admm},
                                         Case{0.4, SolverMethod::automatic, 4}));

}  // namespace
}  // namespace talus::validation::closed_form_stress_test
