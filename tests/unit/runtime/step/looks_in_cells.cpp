/// Probes and fields of periodic cells: images count as the grains do, wherever the faces lie.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "runtime/graph/one_rank.hpp"
#include "runtime/graph/pretend_ranks.hpp"
#include "runtime/step/dealing.hpp"
#include "runtime/step/simulation.hpp"
#include "tests/unit/runtime/step/loose_scenes.hpp"

namespace talus::looks_in_cells_test {
namespace {

using simulation_test::cell_edge;
using simulation_test::density;
using simulation_test::flying;
using simulation_test::loose_sample;
using simulation_test::radius;
using simulation_test::stage;

constexpr double edge = cell_edge;

Region box(const Vec3& low, const Vec3& high) {
  Region region;
  region.low = low;
  region.high = high;
  return region;
}

/// Of all images of a difference the shortest.
Vec3 nearest(const Domain& domain, const Vec3& d) {
  const PeriodicSpace& h = domain.cell;
  Vec3 best = d;
  for (int k = 0; k < 125; ++k) {
    const Vec3 n(k % 5 - 2, k / 5 % 5 - 2, k / 25 - 2);
    const Vec3 image =
        d + Vec3(h.xx * n[0] + h.xy * n[1] + h.xz * n[2], h.yy * n[1] + h.yz * n[2], h.zz * n[2]);
    if (image.norm() < best.norm()) best = image;
  }
  return best;
}

/// 216 grains that fly about in a cell and hit one another.
talus::Setup colliding(int subdomains, const Vec3& low, const Vec3& shears = Vec3::Zero()) {
  talus::Setup setup;
  setup.domain = periodic_domain(Vec3::Constant(edge), Vec3::Zero(), shears);
  setup.stages = {stage("fly", 30)};
  setup.stages[0].laws = laws_of_one_material(0.4, 0.4, 0);
  setup.decomposition.subdomains = subdomains;
  setup.probes = {{"all", box(low, low + Vec3::Constant(edge)), {}, 1},
                  {"left", box(low, low + edge * Vec3(0.3, 1, 1)), {}, 1},
                  {"right", box(low + edge * Vec3(0.3, 0, 0), low + Vec3::Constant(edge)), {}, 1}};
  setup.fields = {{"all", low, low + Vec3::Constant(edge), {12, 10, 15}, 1.3 * radius}};
  return setup;
}

/// What the frame says of the whole cell.
struct Whole {
  double mass = 0;
  Vec3 momentum = Vec3::Zero();
  Mat3 stress = Mat3::Zero();  ///< sum f (x) b/V of the contacts [Pa]
};
Whole whole_of(const Frame& frame) {
  Whole whole;
  std::map<std::int64_t, std::size_t> place;
  for (std::size_t k = 0; k < frame.id.size(); ++k) {
    place[frame.id[k]] = k;
    const double mass = density * 4 * M_PI / 3 * std::pow(frame.radius[k], 3);
    whole.mass += mass;
    whole.momentum += mass * frame.u[k];
  }
  for (std::size_t k = 0; k < frame.contact_bodies.size(); ++k) {
    const auto& [i, j] = frame.contact_bodies[k];
    const Vec3 branch = nearest(frame.domain, frame.x[place.at(i)] - frame.x[place.at(j)]);
    whole.stress += frame.contact_force[k] * branch.transpose() / (edge * edge * edge);
  }
  return whole;
}

// A box and a grid as large as the cell hold each grain once, and all of each branch, wherever they begin.
TEST(LooksInCells, AsLargeAsTheCellHoldAllOfIt) {
  graph::Executor executor({.threads = 1});
  bool pressed = false;
  for (const Vec3& low : {Vec3(0, 0, 0), Vec3(0.37 * edge, -0.61 * edge, 3.2 * edge)})
    for (const int subdomains : {1, 8}) {
      const talus::Setup setup = colliding(subdomains, low);
      Simulation simulation(setup, deal_out(flying(), setup.decomposition, graph::one_rank()), executor);
      while (!simulation.finished()) {
        simulation.step();
        const Whole whole = whole_of(simulation.frame());
        pressed = pressed || whole.stress.norm() > 1;
        const auto& all = simulation.probes().at(0);
        const double press = 1e-9 * (1 + whole.stress.norm());
        ASSERT_EQ(all.count, 216);
        EXPECT_NEAR(all.mass, whole.mass, 1e-12 * whole.mass);
        EXPECT_NEAR(all.solid_fraction, whole.mass / density / (edge * edge * edge), 1e-5);
        EXPECT_LT((all.mass * all.velocity - whole.momentum).norm(), 1e-12 * whole.mass);
        EXPECT_LT((all.contact_stress - whole.stress).norm(), press);
        const auto &left = simulation.probes().at(1), &right = simulation.probes().at(2);
        EXPECT_EQ(left.count + right.count, 216);
        EXPECT_LT((0.3 * left.contact_stress + 0.7 * right.contact_stress - whole.stress).norm(), press);
        simulation.begin_next_stage();
      }
      const Frame frame = simulation.frame();
      const Whole whole = whole_of(frame);
      const FieldGrid& field = frame.grids.at(0);
      double mass = 0;
      Vec3 momentum = Vec3::Zero();
      Mat3 stress = Mat3::Zero();
      for (std::size_t c = 0; c < field.grid.size(); ++c) {
        const CellFields cell = fields_of(field.sums, c);
        mass += cell.density * field.grid.cell_volume();
        momentum += cell.density * field.grid.cell_volume() * cell.velocity;
        stress += cell.contact_stress / static_cast<double>(field.grid.size());
      }
      EXPECT_NEAR(mass, whole.mass, 1e-12 * whole.mass) << low.transpose();
      EXPECT_LT((momentum - whole.momentum).norm(), 1e-12 * whole.mass);
      EXPECT_LT((stress - whole.stress).norm(), 1e-9 * (1 + whole.stress.norm()));
    }
  EXPECT_TRUE(pressed) << "no contact carried";
}

// Likewise in a cell that leans, and with the same bits on several ranks.
TEST(LooksInCells, LeaningCellsAreHeldByTheirBricksOnAnyRanks) {
  // Of a lattice: no grain meets an image.
  const talus::Setup setup =
      colliding(8, {0.4 * edge, 0.1 * edge, -0.7 * edge}, edge * Vec3(1.0 / 3, -1.0 / 6, 0.5));
  graph::Executor executor({.threads = 1});
  Simulation simulation(setup, deal_out(flying(), setup.decomposition, graph::one_rank()), executor);
  std::vector<Mat3> stresses;
  bool pressed = false;
  for (; !simulation.finished(); simulation.begin_next_stage()) {
    simulation.step();
    const Whole whole = whole_of(simulation.frame());
    pressed = pressed || whole.stress.norm() > 1;
    for (const ProbeReport& report : simulation.probes()) stresses.push_back(report.contact_stress);
    EXPECT_EQ(simulation.probes().at(0).count, 216);
    EXPECT_LT((simulation.probes().at(0).contact_stress - whole.stress).norm(),
              1e-9 * (1 + whole.stress.norm()));
  }
  EXPECT_TRUE(pressed) << "no contact carried";
  const std::vector<double> numbers = simulation.frame().grids.at(0).sums.numbers;
  graph::on_pretend_ranks(2, [&](const graph::Communicator& ranks) {
    graph::Executor own({.threads = 2});
    Simulation part(setup, deal_out(ranks.rank() == 0 ? flying() : Sample{}, setup.decomposition, ranks), own,
                    ranks);
    for (std::size_t k = 0; !part.finished(); part.begin_next_stage()) {
      part.step();
      for (const ProbeReport& report : part.probes()) EXPECT_EQ(report.contact_stress, stresses.at(k++));
    }
    const Frame frame = part.frame();
    if (ranks.rank() == 0) {
      EXPECT_EQ(frame.grids.at(0).sums.numbers, numbers);
    }
  });
}

// In a shear flow images one edge further up are faster by what the flow says, in probes and fields alike.
TEST(LooksInCells, ImagesMoveWithTheFlow) {
  constexpr double rate = 3;
  talus::Setup setup;
  setup.domain = periodic_domain(Vec3::Constant(edge));
  setup.stages = {stage("shear", 40)};
  setup.stages[0].shear_rates = {0, rate, 0};  // dv_x/dz
  const auto slice = [](double from, double to) { return box({0, 0, from}, {edge, edge, to}); };
  setup.probes = {{"here", slice(0, 0.5 * edge), {}, 40}, {"above", slice(edge, 1.5 * edge), {}, 40}};
  setup.fields = {{"two", Vec3::Zero(), {edge, edge, 2 * edge}, {8, 8, 20}, 0.2 * edge}};
  graph::Executor executor({.threads = 1});
  Simulation simulation(setup, loose_sample(6, 6, 6, 11), executor);
  for (; !simulation.finished(); simulation.begin_next_stage()) simulation.step();
  const auto &here = simulation.probes().at(0), &above = simulation.probes().at(1);
  ASSERT_GT(here.count, 50);
  // Nothing presses what is spread so thinly.
  EXPECT_EQ(simulation.cell()->p, 0);
  EXPECT_EQ(simulation.cell()->inertial_number, std::numeric_limits<double>::infinity());
  EXPECT_EQ(here.count, above.count);
  EXPECT_LT((above.velocity - here.velocity - Vec3(rate * edge, 0, 0)).norm(), 1e-12 * edge * rate);
  const FieldGrid field = simulation.frame().grids.at(0);
  const auto layer = [&](std::size_t z) {  // its mean velocity by mass
    double density_of_all = 0;
    Vec3 momentum = Vec3::Zero();
    for (std::size_t c = 64 * z; c < 64 * (z + 1); ++c) {
      const CellFields cell = fields_of(field.sums, c);
      density_of_all += cell.density;
      momentum += cell.density * cell.velocity;
    }
    return Vec3(momentum / density_of_all);
  };
  for (std::size_t z = 0; z < 10; ++z)
    EXPECT_LT((layer(z + 10) - layer(z) - Vec3(rate * edge, 0, 0)).norm(), 1e-2 * edge * rate) << z;
}

// A grain that flies through a cell goes through a plane once an edge, and through a disc that lies across a
// face, too.
TEST(LooksInCells, AGrainPassesASurfaceOnceAnEdge) {
  talus::Setup setup;
  setup.domain = periodic_domain({edge, edge, 0});
  setup.stages = {stage("fly", 400)};
  Region plane, disc;
  plane.kind = Region::Kind::plane;
  plane.point = {5.3 * edge, 0, 0};
  plane.normal = {2, 0, 0};
  disc.kind = Region::Kind::disc;
  disc.centre = {0.3 * edge, edge, 0};
  disc.axis = {-1, 0, 0};
  disc.radius = 0.1 * edge;
  Region elsewhere = disc, along = plane;
  elsewhere.centre = {0.3 * edge, 0.5 * edge, 0};
  along.normal = Vec3::UnitZ();
  setup.probes = {
      {"plane", plane, {}, 1}, {"disc", disc, {}, 1}, {"no", elsewhere, {}, 1}, {"up", along, {}, 1}};
  Bodies bodies;
  add_sphere(bodies, BodyId{0}, {0.7 * edge, 0.05 * edge, -1.0025 * radius}, radius, density);
  const double h = setup.stages[0].time_step, u = 7.31 * edge / (400 * h);
  bodies.velocity.back().u[0] = u;
  bodies.velocity.back().u[2] = 2 * radius / (400 * h);
  graph::Executor executor({.threads = 1});
  Simulation simulation(setup, std::move(bodies), executor);
  for (int step = 1; !simulation.finished(); ++step) {
    simulation.step();
    const auto passed = static_cast<std::int64_t>(std::floor(0.4 + u * h * step / edge));
    ASSERT_EQ(simulation.probes().at(0).passed_count, passed) << step;
    ASSERT_EQ(simulation.probes().at(1).passed_count, -passed) << step;
    ASSERT_EQ(simulation.probes().at(2).passed_count, 0);
    ASSERT_EQ(simulation.probes().at(3).passed_count, step > 200 ? 1 : 0);
    simulation.begin_next_stage();
  }
}

}  // namespace
}  // namespace talus::looks_in_cells_test
