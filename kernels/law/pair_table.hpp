#pragma once

/// Which contact law holds between two materials.

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "kernels/bodies/types.hpp"
#include "kernels/law/attraction.hpp"

namespace talus {

/// The law of the contacts between two materials.
struct PairLaw {
  double friction = 0;                                     ///< Coulomb's mu >= 0
  double restitution = 0;                                  ///< Newton's e in [0, 1], of the normal velocity
  double rolling_resistance = 0;                           ///< mu_r >= 0 (kernels/law/rolling_law.hpp)
  std::array<double, attractions.size()> attraction = {};  ///< number of each, in their units
  bool operator==(const PairLaw&) const = default;

  /// What holds two bodies together, of all attractions [N].
  double cohesion_of(const TouchingRadii& radii) const {
    double c = 0;
    for (std::size_t k = 0; k < attraction.size(); ++k)
      if (attraction[k] > 0) c += attractions[k]->force(attraction[k], radii);
    return c;
  }
  /// How far two bodies still hold one another, over the smaller radius; 0 without attraction.
  double reach() const { return cohesion_of({1, 1}) > 0 ? CohesionRule{}.reach : 0; }
};

/// One number of a law: a member, or that of an attraction.
class LawNumber {
 public:
  constexpr LawNumber(double PairLaw::*member) : member_(member) {}
  constexpr LawNumber(const Attraction& attraction)
      : place_(static_cast<std::size_t>(std::ranges::find(attractions, &attraction) - attractions.begin())) {}

  double& in(PairLaw& law) const { return member_ != nullptr ? law.*member_ : law.attraction[place_]; }
  double in(const PairLaw& law) const { return member_ != nullptr ? law.*member_ : law.attraction[place_]; }

 private:
  double PairLaw::*member_ = nullptr;
  std::size_t place_ = 0;
};

/// The laws of all pairs of materials, in an order in which more materials do not move those that there are:
/// (0, 0), (0, 1), (1, 1), (0, 2), ...
class PairTable {
 public:
  /// Of a scene that names no materials, without friction and restitution.
  PairTable() : PairTable(2) {}
  /// The same law for all pairs. `materials` >= 1.
  explicit PairTable(std::size_t materials, const PairLaw& law = {})
      : laws_(materials * (materials + 1) / 2, law) {}

  /// Place of a pair in laws(), whichever material comes first.
  static std::size_t number(Material a, Material b) {
    const std::size_t low = std::min(a, b), high = std::max(a, b);
    return high * (high + 1) / 2 + low;
  }
  /// Whether a material is one of those of the table.
  bool knows(Material material) const { return number(material, material) < laws_.size(); }
  PairLaw& between(Material a, Material b) { return laws_[number(a, b)]; }
  const PairLaw& between(Material a, Material b) const { return laws_[number(a, b)]; }
  std::span<PairLaw> laws() { return laws_; }
  std::span<const PairLaw> laws() const { return laws_; }

  /// Gives every pair the same value, e.g. of friction.
  void set_all(LawNumber number, double value) {
    for (PairLaw& law : laws_) number.in(law) = value;
  }
  /// The largest value of any pair; of a NaN nothing is seen.
  double largest(LawNumber number) const {
    double most = 0;
    for (const PairLaw& law : laws_) most = std::max(most, number.in(law));
    return most;
  }
  /// Some bodies hold one another.
  bool attract() const {
    return std::ranges::any_of(attractions, [&](const Attraction* one) { return largest(*one) > 0; });
  }
  bool operator==(const PairTable&) const = default;

 private:
  std::vector<PairLaw> laws_;
};

/// The laws of a scene that names no materials.
inline PairTable laws_of_one_material(double friction, double wall_friction, double restitution) {
  PairTable table(2, {friction, restitution});
  table.between(material_of_grains, material_of_walls).friction = wall_friction;
  return table;
}

}  // namespace talus
