#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "kernels/bodies/record.hpp"
#include "kernels/bodies/types.hpp"

namespace talus {

/// What the sweeps read and write of one sphere: one cache line. Its halves are vectors of four, each with
/// its mobility at the end; without friction the sweeps touch the first half only.
/// A sphere of radius R turns as w = R omega [m/s], so that no radius and no tangent frame is needed at a
/// contact (docs/theory.md, "Spheres"): with n pointing to it from the other body, the surface at the contact
/// point moves with u - w x n; the other body's with u + w x n.
/// A clump, whose inertia is a tensor I, turns as w = S omega with S = (I/J)^1/2 [m] about its present axes,
/// where J = I_mean/R^2 stands in for I/R^2. So its energy is 1/2 J w^2 as that of a sphere, and all that
/// only adds, averages or weighs velocities need not know what a body is.
template <class Number>
struct alignas(record_numbers * sizeof(Number)) VelocityOf {
  Number u[3]{};           ///< velocity of the centre [m/s]
  Number inv_mass{};       ///< 1/m [1/kg]; 0 for a body that nothing moves
  Number w[3]{};           ///< R omega [m/s]
  Number spin_mobility{};  ///< R^2/I [1/kg]; 0 for a body that does not turn
};
using Velocity = VelocityOf<double>;
using SingleVelocity = VelocityOf<float>;  ///< mobilities in other units: single_precision.hpp
static_assert(sizeof(Velocity) == record_numbers * sizeof(double) &&
              sizeof(SingleVelocity) == record_numbers * sizeof(float));

/// The bodies of this process, one entry per slot. All arrays have the same length, except `orientation`,
/// which is empty unless the scene asks for orientations or has clumps, `material`, unless it names
/// materials, and `shape`, unless it has clumps.
struct Bodies {
  std::vector<BodyId> id;
  std::vector<Vec3> x;                             ///< centre [m]
  std::vector<double> radius;                      ///< [m]; of a clump: that of Clump
  std::vector<Velocity> velocity;                  ///< V, end of the last step or iterate of this one
  std::vector<std::array<double, 4>> orientation;  ///< unit quaternion (w, x, y, z) or empty
  std::vector<Material> material;                  ///< empty: all are material_of_grains
  std::vector<ShapeNumber> shape;                  ///< empty: all are spheres

  std::size_t size() const { return id.size(); }
  double mass(std::size_t slot) const {
    return velocity[slot].inv_mass > 0 ? 1 / velocity[slot].inv_mass : 0;
  }
};

/// Range of masses [kg] that bodies and walls of finite mass may have. Solvers multiply masses with ratios of
/// masses, and square what they get: within these limits no such number overflows or vanishes.
inline constexpr double least_mass = 1e-60, most_mass = 1e60;
inline bool mass_is_sound(double mass) {
  return mass >= least_mass && mass <= most_mass;
}

/// Mass of a solid sphere [kg].
double sphere_mass(double radius, double density);

/// Appends a solid sphere at rest; its material, where bodies have one, is left to the caller. radius > 0
/// [m], density > 0 [kg/m^3]; with `rotates` false its spin mobility is 0.
void add_sphere(Bodies& bodies, BodyId id, const Vec3& centre, double radius, double density,
                bool rotates = true);

/// Reserves room for `count` bodies in all, so that filling the arrays does not move them.
void reserve(Bodies& bodies, std::size_t count, bool orientation = false);

/// Volume of the spheres [m^3], summed in slot order.
double total_volume(const Bodies& bodies);

/// Translational and rotational kinetic energy [J], summed in slot order. For a solid sphere I = 2/5 m R^2,
/// so 1/2 I omega^2 = 1/2 w^2 / (R^2/I).
struct KineticEnergy {
  double translation{};
  double rotation{};
};
KineticEnergy kinetic_energy(std::span<const Velocity> velocity);

/// Permutes every array: new slot k holds what stood in order[k]. `order` is a permutation of 0..n-1, or a
/// part of one: bodies that it does not name are dropped.
void reorder(Bodies& bodies, std::span<const Slot> order);

/// Slots in Morton order of the centres: close in space, close in memory. Ties are broken by id.
std::vector<Slot> morton_order(const Bodies& bodies);

/// Throws std::invalid_argument with id and value unless every array has its length, every centre and
/// velocity is finite, every radius and mass positive and finite.
void validate(const Bodies& bodies);

/// Bytes held by the arrays.
std::size_t memory_used(const Bodies& bodies);

/// 64-bit hash of the exact bits of (id, x, radius, u, w, orientation) of every body for which `counts` is
/// not 0 (empty: of all): a sum over bodies, so that it depends neither on their order nor on how they are
/// dealt to ranks. Equal if and only if (up to hash collisions) the states are equal bit for bit.
std::uint64_t digest(const Bodies& bodies, std::span<const char> counts = {});

}  // namespace talus
