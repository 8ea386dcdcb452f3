#pragma once

/// Overlaps that a step ends with and could not prevent: of pairs that were no contacts of it, since only
/// what others did to them within the step has brought them together (docs/theory.md, "Overlap").

#include <functional>
#include <span>

#include "kernels/detection/contacts.hpp"
#include "kernels/detection/measures.hpp"

namespace talus {

/// Two balls, or a ball and a wall, that are in one another.
struct FoundOverlap {
  Slot first;
  Slot second;        ///< -1 at a wall
  std::int32_t wall;  ///< its number, or -1
  double depth;       ///< > 0 [m]
  double smaller_radius;
  double part() const { return depth / smaller_radius; }
};
using VisitOverlap = std::function<void(const FoundOverlap&)>;

/// Visits the candidates of chunk `chunk` that were no contacts and overlap with the poses of the end of the
/// step, by more than the part `least` >= 0 of the smaller radius. At walls, and of clumps, contacts are
/// visited, too.
void find_unseen_overlaps(const Candidates& candidates, const Contacts& contacts, const Chunks& chunks,
                          std::size_t chunk, const Poses& poses, double least, const VisitOverlap& visit);

/// Visits all pairs of bodies, and of bodies and walls, that overlap, with no need of candidates. Slots with
/// one `id` are copies of one body, and no pair.
void find_all_overlaps(const Poses& poses, std::span<const BodyId> id, const VisitOverlap& visit);

}  // namespace talus
