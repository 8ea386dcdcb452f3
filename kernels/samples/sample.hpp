#pragma once

/// Where the grains of a sample are before the first step: radii, then centres.
/// Every function gives the same numbers on every machine and rank: random numbers are counter-based
/// (Random123, philox4x32: Salmon et al., SC'11), so grain k depends on (seed, k) only, and no libm function
/// but sqrt is used.

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "kernels/bodies/bodies.hpp"
#include "kernels/bodies/types.hpp"
#include "kernels/samples/size_distribution.hpp"
#include "kernels/shapes/clump_motion.hpp"
#include "kernels/shapes/region.hpp"

namespace talus {

/// Grains before the first step, stored compactly: 32 bytes a grain at rest instead of the 104 of Bodies. One
/// rank makes the sample and sends it in pieces to the ranks that turn them into Bodies
/// (runtime/step/dealing.hpp).
struct Sample {
  std::vector<BodyId> id;                       ///< empty: grain k has id k
  std::vector<Vec3> x;                          ///< centre [m]
  std::vector<double> radius;                   ///< [m]
  std::vector<std::array<double, 6>> velocity;  ///< u and R omega [m/s]; empty: at rest
  double density = 0;                           ///< [kg/m^3], of all grains where `material` is empty
  std::vector<Material> material;               ///< of each grain; empty: material_of_grains
  std::vector<double> material_density;         ///< per material [kg/m^3]; read where `material` is not empty
  bool rotates = true;                          ///< false: spin mobility and R omega are 0
  ClumpMass shape;                              ///< of all grains; clumps are at rest, and turned at random
  std::uint64_t seed = 1;                       ///< of those turns
  std::vector<BodyId> named;                    ///< bodies that the scene names, in its order

  std::size_t size() const { return x.size(); }
  double density_of(std::size_t k) const {
    return material.empty() ? density : material_density[material[k]];
  }
  BodyId id_of(std::size_t k) const { return id.empty() ? BodyId{static_cast<std::int64_t>(k)} : id[k]; }
};

/// Mass of grain k [kg].
double mass(const Sample& sample, std::size_t k);

/// A unit quaternion (w, x, y, z), evenly distributed over all turns (Marsaglia 1972, "Choosing a point from
/// the surface of a sphere"): of grain k.
std::array<double, 4> draw_orientation(std::uint64_t seed, std::uint64_t k);

/// A grain at rest on its way into the bodies.
struct Grain {
  BodyId id{};
  Vec3 x = Vec3::Zero();  ///< [m]
  double radius = 0;      ///< [m]
  double density = 0;     ///< [kg/m^3]
};
/// How the grains of a sample become bodies.
struct GrainKind {
  ClumpMass shape;
  std::uint64_t seed = 1;
  bool rotates = true;
};
void add_grain(Bodies& bodies, const Grain& grain, const GrainKind& kind);

/// Appends the grains of the sample, in order.
void append(const Sample& sample, Bodies& bodies);

/// Centres [m], in the order of `radii`, of spheres deposited one by one into the box [0, length_x] x [0,
/// length_y] with floor z = 0 (Voivret et al., Phys. Rev. E 76, 021301, 2007; section 4.1 of the paper): each
/// takes the lowest of all places where it overlaps nothing and rests on three supports - grains, side walls,
/// floor - with its weight between them, that is, where frictionless forces of the three could carry it. "All
/// places" includes pores that later grains closed from above, should a small grain fit. On the floor, where
/// every place is as low as any other, and wherever heights are equal bit for bit, the place with the older
/// supports wins. Overlaps stay below 1e-11 of the largest radius.
/// The bulk has 6 contacts a grain, three supports each, and a solid fraction of 0.61 (max/min = 1.05) to
/// 0.625 (1.5, uniform): the lowest place of the whole surface packs denser than a hollow near a random point
/// of fall. Radii [m] > 0 of any distribution. Time a grain: about 0.1 ms up to max/min = 1.5; by volume
/// fraction 0.2 ms at 2, 0.5 ms at 4, 3 ms at 8. Equal radii grow a crystal from the first corner; a spread
/// of 5 % does not. Throws std::invalid_argument if a radius is not positive or a grain is wider than the
/// box. `placed`, where there is one, hears behind each grain how many are in place.
std::vector<Vec3> deposit(std::span<const double> radii, double length_x, double length_y,
                          const std::function<void(std::size_t)>& placed = {});

/// A lattice of sites that fills the base [0, length_x] x [0, length_y] layer by layer from z = bottom
/// upwards.
struct Lattice {
  enum class Kind { cubic, hexagonal };  ///< simple cubic; hexagonal close packed, layers ABAB along z
  Kind kind = Kind::cubic;
  double spacing = 0;   ///< [m] between nearest sites, >= 2 max radius + 2 jitter
  double length_x = 0;  ///< [m]
  double length_y = 0;  ///< [m]
  double bottom = 0;    ///< [m]
  double jitter = 0;    ///< [m] >= 0, bound on the random displacement from the site; breaks the order
  std::uint64_t seed = 1;
};

/// Centres [m] in the order of `radii`: grain k on site k, x fastest, then y, then z; no overlaps, none with
/// floor and side walls. Throws std::invalid_argument if the spacing is too small or the base has no room for
/// one grain.
std::vector<Vec3> lattice(std::span<const double> radii, const Lattice& sites);

/// Centres [m] of a simple cubic lattice that begins at the lower corner of the box around the region (a box
/// or a cylinder): the first `most` of the sites in which a sphere of `radius` [m] lies in it as a whole, x
/// fastest, then y, then z. Throws std::invalid_argument if the spacing [m] is less than 2 radius.
std::vector<Vec3> lattice_in(const Region& region, double radius, double spacing, std::size_t most);

/// Centres [m] of touching spheres stacked along z in the order of `radii`; the first stands on the floor at
/// `foot`.
std::vector<Vec3> column(std::span<const double> radii, const Vec3& foot);

}  // namespace talus
