#include <numbers>

#include "kernels/law/attraction.hpp"

namespace talus {

/// 2 pi w_A l (Derjaguin, Muller and Toporov 1975, "Effect of contact deformations on the adhesion of
/// particles"): theirs is the limit of stiff bodies, and these are rigid. w_A is twice the surface energy
/// where both bodies are of one material.
const Attraction adhesion_attraction = {"work_of_adhesion", "J/m²",
                                        "Work that parts two surfaces, per area: what touches holds up to 2 "
                                        "pi times it times the reduced radius.",
                                        [](double number, const TouchingRadii& radii) {
                                          return 2 * std::numbers::pi * number * radii.reduced();
                                        }};

}  // namespace talus
