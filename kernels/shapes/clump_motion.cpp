#include "kernels/shapes/clump_motion.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

namespace talus {

namespace {

/// Principal values of S = (I/J)^1/2 [m], J = I_mean/R^2.
Vec3 spin_lengths(const Clump& clump, double radius) {
  return radius * (clump.inertia / clump.mean_inertia()).cwiseSqrt();
}

Mat3 with_axes(const Mat3& axes, const Vec3& values) {
  return axes * values.asDiagonal() * axes.transpose();
}

}  // namespace

void add_unturning(Bodies& bodies, BodyId id, const ClumpBody& body, const ClumpMass& of, bool rotates) {
  if (bodies.shape.empty()) bodies.shape.assign(bodies.size(), 0);
  if (bodies.orientation.empty()) bodies.orientation.assign(bodies.size(), {1, 0, 0, 0});
  const double R = body.radius, mass = body.density * of.volume * R * R * R;
  Velocity v;
  v.inv_mass = 1 / mass;
  v.spin_mobility = rotates ? 1 / (mass * of.inertia) : 0;
  Eigen::Map<Vec3>(v.u) = body.u;
  bodies.id.push_back(id);
  bodies.x.push_back(body.centre);
  bodies.radius.push_back(R);
  bodies.velocity.push_back(v);
  bodies.orientation.push_back(body.orientation);
  bodies.shape.push_back(of.number);
}

void add_clump(Bodies& bodies, std::span<const Clump> clumps, ShapeNumber number, BodyId id,
               const ClumpBody& body, bool rotates) {
  const Clump& clump = clumps[number - std::size_t{1}];
  add_unturning(bodies, id, body, mass_of(number, clump), rotates);
  if (rotates)
    Eigen::Map<Vec3>(bodies.velocity.back().w) =
        with_axes(rotation_of(body.orientation), spin_lengths(clump, body.radius)) * body.omega;
}

Mat3 turning_of(const ClumpView& view, std::size_t slot, double radius) {
  if (!view.is_clump(slot)) return Mat3::Identity() / radius;
  return with_axes(rotation_of(view.orientation[slot]), spin_lengths(view.of(slot), radius).cwiseInverse());
}

void turn_clumps(SlotRange range, Bodies& bodies, std::span<const Clump> clumps, double time_step) {
  if (bodies.shape.empty()) return;
  for (std::size_t s = range.begin; s < range.end; ++s) {
    if (bodies.shape[s] == 0) continue;
    const Vec3 lengths = spin_lengths(clumps[bodies.shape[s] - std::size_t{1}], bodies.radius[s]);
    const Vec3 inverse = lengths.cwiseInverse();
    std::array<double, 4>& q = bodies.orientation[s];
    Eigen::Map<Vec3> w(bodies.velocity[s].w);
    const Vec3 momentum = with_axes(rotation_of(q), lengths) * w;  // over J
    const auto omega = [&](const std::array<double, 4>& at) {
      return Vec3(with_axes(rotation_of(at), inverse.cwiseAbs2()) * momentum);
    };
    const std::array<double, 4> amid = turned(q, omega(q).data(), 1, 0.5 * time_step);
    q = turned(q, omega(amid).data(), 1, time_step);
    w = with_axes(rotation_of(q), inverse) * momentum;
  }
}

void validate_shapes(const Bodies& bodies, std::span<const Clump> clumps) {
  for (std::size_t s = 0; s < bodies.shape.size(); ++s)
    if (bodies.shape[s] > clumps.size())
      throw std::invalid_argument("body " + std::to_string(static_cast<std::int64_t>(bodies.id[s])) +
                                  " is of shape " + std::to_string(bodies.shape[s]) + ", of " +
                                  std::to_string(clumps.size()) + " clumps");
}

}  // namespace talus
