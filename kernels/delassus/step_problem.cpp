#include "kernels/delassus/step_problem.hpp"

#include <Eigen/Geometry>
#include <algorithm>

#include "kernels/detection/materials.hpp"
#include "kernels/detection/measures.hpp"

namespace talus {
namespace {

/// What a contact does to one of its bodies: u += mobility shift r, w += spin_mobility turn r, r in the
/// contact's frame; and what it sees of it: v = shift' u + turn' w.
struct Lever {
  std::size_t contact;
  Mat3 shift, turn;
};

/// Columns n, t, s.
Mat3 frame_of(const Vec3& n) {
  Mat3 axes;
  axes.col(0) = n;
  axes.col(1) = n.unitOrthogonal();
  axes.col(2) = n.cross(axes.col(1));
  return axes;
}

/// n x (.) for each axis of the frame: the surface at the contact moves with u -+ w x n
/// (kernels/bodies/bodies.hpp).
Mat3 turned(const Vec3& n, const Mat3& axes) {
  Mat3 turn;
  for (Eigen::Index k = 0; k < 3; ++k) turn.col(k) = n.cross(Vec3(axes.col(k)));
  return turn;
}

Vec3 vector_of(const std::array<double, 3>& values) {
  return {values[0], values[1], values[2]};
}

void add_block(std::vector<MatrixEntry>& entries, std::size_t a, std::size_t b, const Mat3& block) {
  for (Eigen::Index i = 0; i < 3; ++i)
    for (Eigen::Index j = 0; j < 3; ++j)
      entries.push_back(
          {static_cast<std::int64_t>(3 * a) + i, static_cast<std::int64_t>(3 * b) + j, block(i, j)});
}

}  // namespace

namespace {

/// Velocities without contact impulses: free ones, and what cohesion adds to them.
struct Pulled {
  FreeVelocity free;
  std::vector<Vec3> wall;
};

Pulled pulled_together(const StepView& step) {
  Pulled pulled{step.free, {step.wall_free.begin(), step.wall_free.end()}};
  const Contacts& c = step.contacts;
  for (std::size_t chunk = 0; chunk < step.chunks.size() && !c.cohesion.empty(); ++chunk) {
    const auto begin = static_cast<std::size_t>(step.chunks.begin[chunk]);
    const std::int32_t wall = step.chunks.wall[chunk];
    for (std::size_t k = begin; k < begin + static_cast<std::size_t>(c.count[chunk]); ++k) {
      const Vec3 pull = c.cohesion[k] * contact_normal(c, k);
      const auto move = [&](Slot slot, double sign) {
        const auto body = static_cast<std::size_t>(slot);
        Eigen::Map<Vec3>(pulled.free.u[body].data()) += sign * step.bodies[body].inv_mass * pull;
      };
      move(c.first[k], -1);
      if (wall < 0)
        move(c.second[k], 1);
      else
        pulled.wall[static_cast<std::size_t>(wall)] +=
            step.walls[static_cast<std::size_t>(wall)].inv_mass() * pull;
    }
  }
  return pulled;
}

}  // namespace

StepProblem assemble_step(const StepView& step) {
  const Contacts& c = step.contacts;
  const Pulled without = pulled_together(step);
  const bool turns = !step.free.w.empty();
  std::vector<std::vector<Lever>> of_body(step.bodies.size()), of_wall(step.walls.size());
  std::vector<double> q, mu;
  StepProblem result;
  std::size_t contact = 0;
  for (std::size_t chunk = 0; chunk < step.chunks.size(); ++chunk) {
    const auto begin = static_cast<std::size_t>(step.chunks.begin[chunk]);
    const auto end = begin + static_cast<std::size_t>(c.count[chunk]);
    const std::int32_t wall = step.chunks.wall[chunk];
    for (std::size_t k = begin; k < end; ++k, ++contact) {
      const Vec3 n(c.nx[k], c.ny[k], c.nz[k]);
      const Mat3 axes = frame_of(n), turn = turned(n, axes);
      Vec3 v(c.bias[k], 0, 0);
      const auto meet = [&](Slot slot, double sign) {
        const auto body = static_cast<std::size_t>(slot);
        v += sign * axes.transpose() * vector_of(without.free.u[body]);
        if (turns) v -= turn.transpose() * vector_of(without.free.w[body]);
        of_body[body].push_back({contact, sign * axes, -turn});
      };
      meet(c.first[k], 1);
      if (wall < 0) {
        meet(c.second[k], -1);
      } else {
        v -= axes.transpose() * without.wall[static_cast<std::size_t>(wall)];
        of_wall[static_cast<std::size_t>(wall)].push_back({contact, -axes, Mat3::Zero()});
      }
      q.insert(q.end(), {v[0], v[1], v[2]});
      mu.push_back(friction_of(step.laws, step.chunks, chunk, c, k));
      const Vec3 r = axes.transpose() * law_impulse(c, k);
      result.r.insert(result.r.end(), {r[0], r[1], r[2]});
    }
  }

  std::vector<MatrixEntry> entries;
  for (std::size_t body = 0; body < of_body.size(); ++body) {
    const Velocity& mobility = step.bodies[body];
    for (const Lever& a : of_body[body]) {
      for (const Lever& b : of_body[body]) {
        Mat3 block = mobility.inv_mass * a.shift.transpose() * b.shift;
        if (turns) block += mobility.spin_mobility * a.turn.transpose() * b.turn;
        add_block(entries, a.contact, b.contact, block);
      }
    }
  }
  // A pushed wall moves along its normal only.
  for (std::size_t wall = 0; wall < of_wall.size(); ++wall) {
    const double inv_mass = step.walls[wall].inv_mass();
    if (inv_mass == 0) continue;
    const Vec3& normal = step.walls[wall].normal;
    for (const Lever& a : of_wall[wall])
      for (const Lever& b : of_wall[wall])
        add_block(entries, a.contact, b.contact,
                  inv_mass * (a.shift.transpose() * normal) * (normal.transpose() * b.shift));
  }
  result.problem = assemble_delassus(entries, q, mu);
  return result;
}

}  // namespace talus
