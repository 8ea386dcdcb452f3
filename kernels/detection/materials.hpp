#pragma once

/// Materials, and hence laws, of candidates and contacts.

#include <span>

#include "kernels/bodies/types.hpp"
#include "kernels/detection/contacts.hpp"
#include "kernels/law/pair_table.hpp"
#include "kernels/shapes/walls.hpp"

namespace talus {

/// Materials of the bodies and walls of a scene.
struct MaterialView {
  std::span<const Material> bodies;  ///< per slot; empty: material_of_grains
  std::span<const Wall> walls;

  Material of(Slot slot) const {
    return bodies.empty() ? material_of_grains : bodies[static_cast<std::size_t>(slot)];
  }
  /// Number in its PairTable of the law between two grains, or a grain and a wall.
  std::size_t law(const GrainPair& pair) const { return PairTable::number(of(pair.first), of(pair.second)); }
  std::size_t law(const WallPair& pair) const {
    return PairTable::number(of(pair.body), walls[static_cast<std::size_t>(pair.wall)].material);
  }
};

/// Fills Chunks::law.
void note_laws(const Candidates& candidates, const MaterialView& materials, Chunks& chunks);

/// The law of candidate k.
const PairLaw& law_at(const PairTable& table, const Candidates& candidates, const MaterialView& materials,
                      std::size_t k);

/// Friction of contact k, of this chunk.
inline double friction_of(const PairTable& table, const Chunks& chunks, std::size_t chunk,
                          const Contacts& contacts, std::size_t k) {
  if (!contacts.rn.empty()) return 0;
  const std::int32_t law = chunks.law[chunk];
  return law == mixed_laws ? contacts.mu[k] : table.laws()[static_cast<std::size_t>(law)].friction;
}

/// Gives the contacts of a chunk that mixes laws their friction; does nothing for other chunks.
void set_friction(const Candidates& candidates, const Chunks& chunks, std::size_t chunk,
                  const MaterialView& materials, const PairTable& table, Contacts& contacts);

}  // namespace talus
