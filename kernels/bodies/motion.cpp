#include "kernels/bodies/motion.hpp"

#include <algorithm>
#include <cmath>

namespace talus {

namespace {
double square(const double (&v)[3]) {
  return v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
}
}  // namespace

void predict(SlotRange range, std::span<Vec3> x, std::span<const Velocity> velocity, double time_step) {
  for (std::size_t s = range.begin; s < range.end; ++s)
    for (std::size_t c = 0; c < 3; ++c)
      x[s][static_cast<Eigen::Index>(c)] += 0.5 * time_step * velocity[s].u[c];
}

void free_velocities(SlotRange range, std::span<const Velocity> velocity, double time_step,
                     const Vec3& gravity, FreeVelocity& free) {
  for (std::size_t s = range.begin; s < range.end; ++s)
    for (std::size_t c = 0; c < 3; ++c) {
      free.u[s][c] = velocity[s].u[c] + time_step * gravity[static_cast<Eigen::Index>(c)];
      if (!free.w.empty()) free.w[s][c] = velocity[s].w[c];
    }
}

void add_gain(SlotRange range, std::span<const Vec3> x, const AffineGain& gain, FreeVelocity& free) {
  for (std::size_t s = range.begin; s < range.end; ++s) {
    const Vec3 more = gain.at(x[s]);
    for (std::size_t c = 0; c < 3; ++c) free.u[s][c] += more[static_cast<Eigen::Index>(c)];
  }
}

void add_gain(SlotRange range, std::span<const Vec3> x, const AffineGain& gain,
              std::span<Velocity> velocity) {
  for (std::size_t s = range.begin; s < range.end; ++s) Eigen::Map<Vec3>(velocity[s].u) += gain.at(x[s]);
}

void reset_to_free(std::span<const Slot> slots, const FreeVelocity& free, std::span<Velocity> velocity) {
  for (Slot slot : slots) {
    const auto s = static_cast<std::size_t>(slot);
    std::copy_n(free.u[s].begin(), 3, velocity[s].u);
    if (!free.w.empty()) std::copy_n(free.w[s].begin(), 3, velocity[s].w);
  }
}

void MotionSums::add(const MotionSums& other) {
  energy.translation += other.energy.translation;
  energy.rotation += other.energy.rotation;
  energy_free += other.energy_free;
  impulse += other.impulse;
  impulse_scale += other.impulse_scale;
  if (!(other.speed2_max <= speed2_max)) {  // a NaN wins
    speed2_max = other.speed2_max;
    fastest = other.fastest;
  }
}

namespace {

/// What the free velocity of a body at x, of mid-step, has gained.
Vec3 gain_at(const Vec3& x, const StepFinish& end) {
  return end.cell ? Vec3(end.gain + end.cell->at(x)) : end.gain;
}

/// V = Vbar + E (Vbar - V-) of body s: written so, a body that meets nothing keeps its velocity to the bit.
void reflect(Velocity& v, const FreeVelocity& free, std::size_t s, const Vec3& gain, const StepFinish& end) {
  for (std::size_t c = 0; c < 3; ++c) {
    const double before = free.u[s][c] - gain[static_cast<Eigen::Index>(c)];
    v.u[c] += end.reflection * (v.u[c] - before);
    if (!free.w.empty()) v.w[c] += end.reflection * (v.w[c] - free.w[s][c]);
  }
}

template <bool Reflects>
MotionSums finish_with(SlotRange range, std::span<Vec3> x, std::span<Velocity> velocity,
                       const FreeVelocity& free, const StepFinish& end) {
  const CopyShares& copies = end.copies;
  MotionSums sums;
  for (std::size_t s = range.begin; s < range.end; ++s) {
    Velocity& v = velocity[s];
    Vec3 u(v.u[0], v.u[1], v.u[2]);
    Vec3 u_free(free.u[s][0], free.u[s][1], free.u[s][2]);
    const Vec3 change = u - u_free;
    if constexpr (Reflects) {
      const Vec3 gain = gain_at(x[s], end);
      reflect(v, free, s, gain, end);
      u = {v.u[0], v.u[1], v.u[2]};
      u_free += end.reflection * gain;  // the loads' whole share
    }
    x[s] += 0.5 * end.time_step * u;
    const double share =
        copies.multiplicity.empty() ? 1 : static_cast<double>(copies.parts[s]) / copies.multiplicity[s];
    const double mass = share / v.inv_mass, u2 = u.squaredNorm();
    const Vec3 gained = mass * change;
    sums.energy.translation += 0.5 * mass * u2;
    sums.energy_free += 0.5 * mass * u_free.squaredNorm();
    if (v.spin_mobility > 0) {
      const double spin = 0.5 * share * square(v.w) / v.spin_mobility;
      sums.energy.rotation += spin;
      sums.energy_free += free.w.empty() ? spin
                                         : 0.5 * share *
                                               (free.w[s][0] * free.w[s][0] + free.w[s][1] * free.w[s][1] +
                                                free.w[s][2] * free.w[s][2]) /
                                               v.spin_mobility;
    }
    sums.impulse += gained;
    sums.impulse_scale += gained.norm();
    const double speed2 = u2 + square(v.w);
    if (!(speed2 <= sums.speed2_max) || sums.fastest < 0) {
      sums.speed2_max = speed2;
      sums.fastest = static_cast<Slot>(s);
      if (std::isnan(speed2)) return sums;
    }
  }
  return sums;
}

}  // namespace

MotionSums finish(SlotRange range, std::span<Vec3> x, std::span<Velocity> velocity, const FreeVelocity& free,
                  const StepFinish& end) {
  return end.reflection > 0 ? finish_with<true>(range, x, velocity, free, end)
                            : finish_with<false>(range, x, velocity, free, end);
}

void find_ends(SlotRange range, const Bodies& bodies, const FreeVelocity& free, const StepFinish& end,
               Bodies& ends) {
  for (std::size_t s = range.begin; s < range.end; ++s) {
    Velocity v = bodies.velocity[s];
    if (end.reflection > 0) reflect(v, free, s, gain_at(bodies.x[s], end), end);
    ends.x[s] = bodies.x[s] + 0.5 * end.time_step * Eigen::Map<const Vec3>(v.u);
    if (!ends.velocity.empty()) ends.velocity[s] = v;
  }
}

std::array<double, 4> turned(const std::array<double, 4>& q, const double* w, double radius,
                             double time_step) {
  const double speed = std::sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
  if (speed == 0) return q;
  const double half = 0.5 * time_step * speed / radius;
  const double c = std::cos(half), k = std::sin(half) / speed;
  const double x = k * w[0], y = k * w[1], z = k * w[2];
  const auto [qw, qx, qy, qz] = q;
  std::array<double, 4> p = {c * qw - x * qx - y * qy - z * qz, c * qx + x * qw + y * qz - z * qy,
                             c * qy + y * qw + z * qx - x * qz, c * qz + z * qw + x * qy - y * qx};
  const double norm = std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2] + p[3] * p[3]);
  for (double& component : p) component /= norm;
  return p;
}

void rotate(SlotRange range, Bodies& bodies, double time_step) {
  for (std::size_t s = range.begin; s < range.end; ++s)
    if (bodies.shape.empty() || bodies.shape[s] == 0)
      bodies.orientation[s] =
          turned(bodies.orientation[s], bodies.velocity[s].w, bodies.radius[s], time_step);
}

double contact_margin(double speed, double time_step, double alert) {
  return std::max(0.5 * alert, time_step * speed);
}

}  // namespace talus
