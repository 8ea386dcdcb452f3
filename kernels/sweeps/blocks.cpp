#include "kernels/sweeps/blocks.hpp"

#include <Eigen/Geometry>
#include <algorithm>

#include "kernels/bodies/index.hpp"
#include "kernels/detection/measures.hpp"
#include "kernels/law/contact_law.hpp"
#include "kernels/law/friction_cone.hpp"

namespace talus {

namespace {

using Map = Eigen::Map<Vec3>;
using ConstMap = Eigen::Map<const Vec3>;

Vec3 surface_velocity(const Velocity& body, const Mat3& lever) {
  return ConstMap(body.u) + lever * ConstMap(body.w);
}

Vec3 relative_velocity(const Contacts& contacts, std::size_t k, std::span<const Velocity> velocity,
                       const WallCopy* wall) {
  const Levers& levers = contacts.levers[k];
  const Vec3 v = surface_velocity(velocity[at(contacts.first[k])], levers.first);
  if (wall != nullptr) return v - (ConstMap(wall->velocity) + drift_of(contacts, k));
  const Vec3 between = v - surface_velocity(velocity[at(contacts.second[k])], levers.second);
  return contacts.drifts_between ? Vec3(between - drift_of(contacts, k)) : between;
}

/// Adds the share of a body in W; the record holds 1/`parts` of the body's mass.
void add_mobility(const Velocity& body, const Mat3& lever, double parts, Mat3& W) {
  W.diagonal().array() += body.inv_mass / parts;
  if (body.spin_mobility > 0) W += body.spin_mobility / parts * lever * lever.transpose();
}

Mat3 mobility_of(const Contacts& contacts, std::size_t k, std::span<const Velocity> velocity,
                 const WallCopy* wall, Multiplicities parts) {
  const auto parts_of = [&](std::size_t slot) { return parts.empty() ? 1.0 : double{1} * parts[slot]; };
  const std::size_t i = at(contacts.first[k]);
  Mat3 W = Mat3::Zero();
  add_mobility(velocity[i], contacts.levers[k].first, parts_of(i), W);
  if (wall != nullptr) {
    const Vec3 n = contact_normal(contacts, k);
    W += wall->inv_mass * n * n.transpose();
  } else {
    const std::size_t j = at(contacts.second[k]);
    add_mobility(velocity[j], contacts.levers[k].second, parts_of(j), W);
  }
  return W;
}

void push(Velocity& body, const Mat3& lever, const Vec3& impulse) {
  Map(body.u) += body.inv_mass * impulse;
  if (body.spin_mobility > 0) Map(body.w) += body.spin_mobility * (lever.transpose() * impulse);
}

/// Gives an impulse on the first body of contact k to both.
void push(const Contacts& contacts, std::size_t k, const Vec3& impulse, std::span<Velocity> velocity,
          WallCopy* wall) {
  const Levers& levers = contacts.levers[k];
  push(velocity[at(contacts.first[k])], levers.first, impulse);
  if (wall == nullptr) return push(velocity[at(contacts.second[k])], levers.second, -impulse);
  const Vec3 n = contact_normal(contacts, k);
  Map(wall->velocity) -= wall->inv_mass * n.dot(impulse) * n;
}

/// Rows n, t_1, t_2.
Mat3 frame_of(const Vec3& n) {
  Mat3 frame;
  frame.row(0) = n;
  frame.row(1) = n.unitOrthogonal();
  frame.row(2) = n.cross(Vec3(frame.row(1)));
  return frame;
}

double friction_at(const Contacts& contacts, std::size_t k, ChunkFriction friction) {
  return friction.own ? contacts.mu[k] : friction.mu;
}

Space<double> space_of(const Vec3& v) {
  return {v[0], v[1], v[2]};
}

}  // namespace

void sweep_blocks(Contacts& contacts, ContactRange range, std::span<Velocity> velocity,
                  ChunkFriction friction, WallCopy* wall) {
  for (std::size_t k = range.begin; k < range.end; ++k) {
    const Vec3 before = law_impulse(contacts, k), n = contact_normal(contacts, k);
    const Vec3 v = relative_velocity(contacts, k, velocity, wall) + contacts.bias[k] * n;
    const Mat3 W = mobility_of(contacts, k, velocity, wall, {}), frame = frame_of(n);
    const LocalBlock block = local_block(frame * W * frame.transpose(), friction_at(contacts, k, friction));
    const Vec3 after = frame.transpose() * solve_local(block, frame * (v - W * before), frame * before).r;
    push(contacts, k, after - before, velocity, wall);
    set_law_impulse(contacts, k, after);
  }
}

void accumulate_blocks(const Contacts& contacts, ContactRange range, std::span<Velocity> velocity,
                       WallCopy* wall) {
  for (std::size_t k = range.begin; k < range.end; ++k)
    push(contacts, k, contact_impulse(contacts, k), velocity, wall);
}

ErrorSums error_blocks(const Contacts& contacts, ContactRange range, std::span<const Velocity> velocity,
                       ChunkFriction friction, const WallCopy* wall, Multiplicities parts) {
  ErrorSums sums;
  for (std::size_t k = range.begin; k < range.end; ++k) {
    const Vec3 n = contact_normal(contacts, k), r = law_impulse(contacts, k);
    Approach<double> contact{};
    contact.n = space_of(n);
    contact.v = space_of(relative_velocity(contacts, k, velocity, wall));
    contact.bias = contacts.bias[k];
    contact.w_nn = n.dot(mobility_of(contacts, k, velocity, wall, parts) * n);
    const LawError<double> error = error_of_law(space_of(r), contact, friction_at(contacts, k, friction));
    sums.residual2 += error.residual2;
    sums.residual_max2 = std::max(sums.residual_max2, error.residual2);
    sums.impulse2 += error.impulse2;
    sums.velocity2 += error.velocity2;
    sums.work += error.work;
    sums.active += error.r_n > 0 ? 1 : 0;
    ++sums.contacts;
    if (wall != nullptr) Map(sums.wall_impulse) += r;
  }
  return sums;
}

}  // namespace talus
