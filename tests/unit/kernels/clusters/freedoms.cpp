// The freedoms of a cluster's bodies: what a force does to them is the transpose of how they move a contact.

#include "kernels/clusters/freedoms.hpp"

#include <gtest/gtest.h>

#include <random>

#include "tests/unit/kernels/clusters/cluster_makers.hpp"

namespace talus::freedoms_test {
namespace {

/// Two grains that turn and a wall of finite mass; `cell`: in a cell that follows a stress, of which one
/// shear stands.
BodyProblem three_bodies(bool cell) {
  BodyProblem problem;
  cluster_makers::add_grain(problem, Vec3::Zero(), 0.5);
  cluster_makers::add_grain(problem, Vec3(0.02, 0, 0), 0.5);
  BodyUnknown wall;
  wall.mass = 7;
  wall.kind = BodyKind::wall;
  wall.axis = Vec3::UnitZ();
  problem.bodies.push_back(wall);
  if (!cell) return problem;
  BodyUnknown of;
  of.kind = BodyKind::cell;
  of.mass = of.spin_mass = 3;
  of.radius = 3;
  of.axis = Vec3::Ones();
  of.shears = Vec3(1, 0, 1);
  problem.bodies.push_back(of);
  return problem;
}

// Contacts that slide are solved along the edge of their cone, which is no direction between centres.
TEST(Freedoms, OfAForceAreThoseThatMoveItsContact) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> number(-1, 1);
  const auto vector = [&] { return Vec3(number(random), number(random), number(random)); };
  const Mat3 N = cross_matrix(Vec3::UnitX());
  const Levers levers{N, -N};
  for (const bool cell : {false, true})
    for (const bool sliding : {false, true})
      for (const std::int32_t second : {1, 2, -1}) {
        const BodyProblem problem = three_bodies(cell);
        const Freedoms freedoms(problem);
        ContactEquation contact;
        contact.first = 0;
        contact.second = second;
        contact.normal = Vec3::UnitX();
        if (cell) {
          contact.cell = 3;
          contact.branch = second == 1 ? 0.9 * contact.normal : Vec3(Vec3::Zero());
        }
        if (sliding) {
          contact.normal = vector().normalized();
          contact.levers = &levers;
        }
        const Vec3 direction = vector();
        Eigen::VectorXd x(freedoms.size());
        for (double& value : x) value = number(random);
        const std::vector<Twist> motion = freedoms.twists(x);
        double work = 0;
        for (const Freedoms::Part& part : freedoms.column(contact, direction))
          work += part.value.head(part.count).dot(x.segment(part.begin, part.count));
        // A freedom of the cell that stands is there, and moves nothing.
        std::vector<Twist> allowed = motion;
        for (std::size_t b = 0; b < allowed.size(); ++b) restrict_to_freedoms(problem.bodies[b], allowed[b]);
        EXPECT_NEAR(work, direction.dot(relative_velocity(contact, allowed)), 1e-14)
            << cell << sliding << second;
      }
}

}  // namespace
}  // namespace talus::freedoms_test
