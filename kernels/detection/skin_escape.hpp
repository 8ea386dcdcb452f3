#pragma once

/// Grains that have used up their margin since the last broad phase, and whether the candidates still hold
/// every contact of this step. A grain that was struck needs a wide margin for its speed, but in a dense
/// sample the grains that it can reach are its candidates already: then nothing has to be found anew.
///
/// Between grains within their margins every contact is a candidate (kernels/bodies/motion.hpp); those that
/// have left are compared with all grains and walls, in every step, by the rule of the narrow phase itself.

#include <compare>
#include <cstdint>
#include <span>
#include <vector>

#include "kernels/bodies/bodies.hpp"
#include "kernels/bodies/motion.hpp"
#include "kernels/detection/chunks.hpp"
#include "kernels/detection/domain.hpp"
#include "kernels/shapes/walls.hpp"

namespace talus {

struct Escape {
  std::int64_t id;
  double radius;  ///< [m]
  double need;    ///< [m] radius + contact_margin: within it, and another's, lies whatever it can touch
  double x[3];    ///< at the middle of the step [m]
  double u[3];    ///< at its beginning [m/s]
  auto operator<=>(const Escape&) const = default;
};

/// Two grains by their ids, the smaller first; or wall w, as -1 - w, and a grain at one of its features.
struct Encounter {
  std::int64_t a, b;
  std::int64_t feature = 0;
  auto operator<=>(const Encounter&) const = default;
};

/// Margins with which the candidates were found, and what makes contacts of candidates now.
struct Margins {
  std::span<const Vec3> x_then;        ///< centres at the last broad phase [m]
  std::span<const double> reach_then;  ///< [m]
  double time_step;                    ///< [s]
  double alert;                        ///< [m]
  Vec3 gravity = Vec3::Zero();         ///< [m/s^2]
  std::span<const Wall> walls = {};    ///< at the middle of the step
  Domain domain = {};
};

/// Appends the grains of the range that have left their margins (reach_then).
void find_skin_escapes(SlotRange range, const Bodies& bodies, const Margins& margins,
                       std::vector<Escape>& skin_escapes);

/// Appends to `needed` the contacts of an escaped grain with a grain here or a wall, and to `known` the
/// candidates here of escaped grains. Over all ranks, which are to have the same escapes, the candidates hold
/// if all_known(needed, known). `skin_escapes` are in order of id, each once; cheap where slots that follow
/// one another are near in space.
void compare_skin_escapes(std::span<const Escape> skin_escapes, const Bodies& bodies,
                          const Candidates& candidates, const Margins& margins,
                          std::vector<Encounter>& needed, std::vector<Encounter>& known);

bool all_known(std::vector<Encounter> needed, std::vector<Encounter> known);

}  // namespace talus
