#include "runtime/step/state.hpp"

namespace talus {

StepFinish finish_of(const StepState& state, const StepParameters& parameters) {
  return {.time_step = parameters.time_step,
          .copies = {},
          .reflection = parameters.reflection,
          .gain = parameters.impulse_time() * parameters.gravity,
          .cell = state.domain.flows ? &state.flow.gain : nullptr};
}

std::size_t memory_used(const StepState& state) {
  return memory_used(state.bodies) + memory_used(state.candidates) + memory_used(state.chunks) +
         memory_used(state.contacts) + memory_used(state.decomposition) +
         (state.free.u.capacity() + state.free.w.capacity()) * sizeof(std::array<double, 3>) +
         state.x_then.capacity() * sizeof(Vec3) + state.reach_then.capacity() * sizeof(double) +
         memory_used(state.single) + state.copies.capacity() * sizeof(WallCopy) +
         (state.given_overlaps ? state.given_overlaps->capacity() * sizeof(GivenOverlap) : 0);
}

}  // namespace talus
