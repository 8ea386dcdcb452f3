#include "kernels/law/attraction.hpp"

namespace talus {

/// The same force for all sizes (Radjai and Richefeu 2009).
const Attraction cohesion_attraction = {
    "cohesion", "N",
    "Force that parts grains that touch one another or a wall, up to a gap of 0.001 of the smaller radius: "
    "to hold a rebound, grains have to move much less than that in a step.",
    [](double number, const TouchingRadii& /*radii*/) { return number; }};

}  // namespace talus
