#include "kernels/detection/materials.hpp"

namespace talus {

namespace {

/// Number of the law of candidate k.
std::size_t law_of(const Candidates& candidates, const MaterialView& materials, std::size_t k) {
  const std::size_t grains = candidates.grain_pairs.size();
  return k < grains ? materials.law(candidates.grain_pairs[k])
                    : materials.law(candidates.wall_pairs[k - grains]);
}

std::int32_t law_of_range(const Candidates& candidates, const MaterialView& materials, std::size_t begin,
                          std::size_t end) {
  const std::size_t law = law_of(candidates, materials, begin);
  // Grains of a scene that names no materials are all of one.
  const std::size_t last = materials.bodies.empty() ? begin + 1 : end;
  for (std::size_t k = begin + 1; k < last; ++k)
    if (law_of(candidates, materials, k) != law) return mixed_laws;
  return static_cast<std::int32_t>(law);
}

}  // namespace

const PairLaw& law_at(const PairTable& table, const Candidates& candidates, const MaterialView& materials,
                      std::size_t k) {
  return table.laws()[law_of(candidates, materials, k)];
}

void note_laws(const Candidates& candidates, const MaterialView& materials, Chunks& chunks) {
  for (std::size_t c = 0; c < chunks.size(); ++c)
    chunks.law[c] = law_of_range(candidates, materials, static_cast<std::size_t>(chunks.begin[c]),
                                 static_cast<std::size_t>(chunks.begin[c + 1]));
}

void set_friction(const Candidates& candidates, const Chunks& chunks, std::size_t chunk,
                  const MaterialView& materials, const PairTable& table, Contacts& contacts) {
  if (contacts.mu.empty() || chunks.law[chunk] != mixed_laws) return;
  const auto begin = static_cast<std::size_t>(chunks.begin[chunk]);
  const auto end = begin + static_cast<std::size_t>(contacts.count[chunk]);
  for (std::size_t k = begin; k < end; ++k)
    contacts.mu[k] =
        law_at(table, candidates, materials, static_cast<std::size_t>(contacts.candidate[k])).friction;
}

}  // namespace talus
