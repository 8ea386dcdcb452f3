#include "kernels/bodies/bodies.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <numeric>
#include <stdexcept>
#include <string>

#include "kernels/bodies/morton.hpp"
#include "kernels/bodies/permute.hpp"

namespace talus {

namespace {
constexpr double four_thirds_pi = 4.18879020478639098;
}

double sphere_mass(double radius, double density) {
  return four_thirds_pi * density * radius * radius * radius;
}

void add_sphere(Bodies& bodies, BodyId id, const Vec3& centre, double radius, double density, bool rotates) {
  const double mass = sphere_mass(radius, density);
  Velocity rest;
  rest.inv_mass = 1 / mass;
  rest.spin_mobility = rotates ? 2.5 / mass : 0;  // R^2 / (2/5 m R^2)
  bodies.id.push_back(id);
  bodies.x.push_back(centre);
  bodies.radius.push_back(radius);
  bodies.velocity.push_back(rest);
  if (!bodies.orientation.empty()) bodies.orientation.push_back({1, 0, 0, 0});
  if (!bodies.shape.empty()) bodies.shape.push_back(0);
}

void reserve(Bodies& bodies, std::size_t count, bool orientation) {
  bodies.id.reserve(count);
  bodies.x.reserve(count);
  bodies.radius.reserve(count);
  bodies.velocity.reserve(count);
  if (orientation) bodies.orientation.reserve(count);
}

double total_volume(const Bodies& bodies) {
  double volume = 0;
  for (double r : bodies.radius) volume += r * r * r;
  return four_thirds_pi * volume;
}

KineticEnergy kinetic_energy(std::span<const Velocity> velocity) {
  KineticEnergy energy;
  for (const Velocity& v : velocity) {
    const double u2 = v.u[0] * v.u[0] + v.u[1] * v.u[1] + v.u[2] * v.u[2];
    const double w2 = v.w[0] * v.w[0] + v.w[1] * v.w[1] + v.w[2] * v.w[2];
    if (v.inv_mass > 0) energy.translation += 0.5 * u2 / v.inv_mass;
    if (v.spin_mobility > 0) energy.rotation += 0.5 * w2 / v.spin_mobility;
  }
  return energy;
}

void reorder(Bodies& bodies, std::span<const Slot> order) {
  permute(bodies.id, order);
  permute(bodies.x, order);
  permute(bodies.radius, order);
  permute(bodies.velocity, order);
  permute(bodies.orientation, order);
  permute(bodies.material, order);
  permute(bodies.shape, order);
}

std::vector<Slot> morton_order(const Bodies& bodies) {
  const std::size_t n = bodies.size();
  std::vector<Slot> order(n);
  std::iota(order.begin(), order.end(), 0);
  if (n < 2) return order;
  Vec3 low = bodies.x[0], high = bodies.x[0];
  for (const Vec3& x : bodies.x) {
    low = low.cwiseMin(x);
    high = high.cwiseMax(x);
  }
  const double extent = (high - low).maxCoeff();
  const double scale = extent > 0 ? 2097151.0 / extent : 0;
  std::vector<std::uint64_t> key(n);
  for (std::size_t k = 0; k < n; ++k) {
    const Vec3 s = (bodies.x[k] - low) * scale;
    key[k] = morton_key(static_cast<std::uint32_t>(s[0]), static_cast<std::uint32_t>(s[1]),
                        static_cast<std::uint32_t>(s[2]));
  }
  std::sort(order.begin(), order.end(), [&](Slot a, Slot b) {
    const auto ka = static_cast<std::size_t>(a), kb = static_cast<std::size_t>(b);
    return key[ka] != key[kb] ? key[ka] < key[kb] : bodies.id[ka] < bodies.id[kb];
  });
  return order;
}

void validate(const Bodies& bodies) {
  const std::size_t n = bodies.size();
  if (bodies.x.size() != n || bodies.radius.size() != n || bodies.velocity.size() != n ||
      (!bodies.orientation.empty() && bodies.orientation.size() != n) ||
      (!bodies.material.empty() && bodies.material.size() != n) ||
      (!bodies.shape.empty() && (bodies.shape.size() != n || bodies.orientation.size() != n)))
    throw std::invalid_argument("the arrays of the bodies differ in length");
  for (std::size_t k = 0; k < n; ++k) {
    const Velocity& v = bodies.velocity[k];
    const auto refuse = [&](const std::string& what) {
      throw std::invalid_argument("body " + std::to_string(static_cast<std::int64_t>(bodies.id[k])) + ": " +
                                  what);
    };
    if (!bodies.x[k].allFinite()) refuse("its centre is not finite");
    if (!(bodies.radius[k] > 0) || !std::isfinite(bodies.radius[k]))
      refuse("its radius must be positive and finite, not " + std::to_string(bodies.radius[k]) + " m");
    if (!mass_is_sound(1 / v.inv_mass)) refuse("its mass must lie in 1e-60 to 1e60 kg");
    if (!(v.spin_mobility >= 0) || !std::isfinite(v.spin_mobility))
      refuse("its R^2/I must be finite and not negative");
    for (int c = 0; c < 3; ++c)
      if (!std::isfinite(v.u[c]) || !std::isfinite(v.w[c])) refuse("its velocity is not finite");
  }
}

std::size_t memory_used(const Bodies& bodies) {
  return bodies.id.capacity() * sizeof(BodyId) + bodies.x.capacity() * sizeof(Vec3) +
         bodies.radius.capacity() * sizeof(double) + bodies.velocity.capacity() * sizeof(Velocity) +
         bodies.orientation.capacity() * sizeof(std::array<double, 4>) +
         bodies.material.capacity() * sizeof(Material) + bodies.shape.capacity() * sizeof(ShapeNumber);
}

std::uint64_t digest(const Bodies& bodies, std::span<const char> counts) {
  std::uint64_t sum = 0;
  for (std::size_t k = 0; k < bodies.size(); ++k) {
    if (!counts.empty() && !counts[k]) continue;
    std::uint64_t hash = 0x9e3779b97f4a7c15ULL;
    const auto mix = [&hash](std::uint64_t word) {  // one round of the splitmix64 finaliser per word
      hash = (hash ^ word) * 0xbf58476d1ce4e5b9ULL;
      hash = (hash ^ (hash >> 27)) * 0x94d049bb133111ebULL;
      hash ^= hash >> 31;
    };
    const auto mix_real = [&mix](double value) { mix(std::bit_cast<std::uint64_t>(value)); };
    mix(static_cast<std::uint64_t>(bodies.id[k]));
    for (int c = 0; c < 3; ++c) mix_real(bodies.x[k][c]);
    mix_real(bodies.radius[k]);
    for (double u : bodies.velocity[k].u) mix_real(u);
    for (double w : bodies.velocity[k].w) mix_real(w);
    if (!bodies.orientation.empty())
      for (double q : bodies.orientation[k]) mix_real(q);
    sum += hash;
  }
  return sum;
}

}  // namespace talus
