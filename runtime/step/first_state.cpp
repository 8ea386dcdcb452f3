#include "runtime/step/first_state.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "kernels/shapes/clump_motion.hpp"
#include "runtime/step/stage_loads.hpp"
#include "runtime/step/wall_motions.hpp"

namespace talus {

namespace {

/// Throws when a stage has no law for a material of the bodies.
void demand_laws(const Setup& setup, const Bodies& bodies) {
  for (const Stage& stage : setup.stages)
    for (const Material material : bodies.material)
      if (!stage.laws.knows(material))
        throw std::invalid_argument(fmt::format(
            "stage '{}': its laws do not have material {}, of which there are bodies", stage.name, material));
}

}  // namespace

StepState first_state(const Setup& setup, Bodies bodies, const graph::Communicator& ranks) {
  validate(setup);
  validate(bodies);
  validate_shapes(bodies, setup.clumps);
  demand_laws(setup, bodies);
  StepState state;
  state.decomposition = make_decomposition(setup.decomposition, ranks);
  state.bodies = std::move(bodies);
  if (state.decomposition.several())  // the first subdomain holds all until the first step deals them out
    std::fill(state.decomposition.slot_begin.begin() + 1, state.decomposition.slot_begin.end(),
              state.bodies.size());
  else
    reorder(state.bodies, morton_order(state.bodies));
  if (!setup.rotation)
    for (Velocity& v : state.bodies.velocity) {
      v.spin_mobility = 0;
      std::fill(std::begin(v.w), std::end(v.w), 0.0);
    }
  // Alike on all ranks, even on those without a clump.
  if (!setup.clumps.empty() && state.bodies.shape.empty()) state.bodies.shape.assign(state.bodies.size(), 0);
  if ((setup.orientation || !setup.clumps.empty()) && state.bodies.orientation.empty())
    state.bodies.orientation.assign(state.bodies.size(), {1, 0, 0, 0});
  state.walls = setup.walls;
  simplify_motions(state.walls);
  state.clumps = setup.clumps;
  state.domain = setup.domain;
  state.domain.flows = std::ranges::any_of(setup.stages, &Stage::flows);
  state.wall_states.resize(state.walls.size());
  state.free.u.resize(state.bodies.size());
  return state;
}

StepState restored_state(const Setup& setup, const Checkpoint& from, const graph::Communicator& ranks) {
  validate(setup);
  StepState state = restore_state(setup, from, ranks);
  demand_laws(setup, state.bodies);
  for (std::size_t k = 0; k <= static_cast<std::size_t>(from.head.stage_index); ++k)
    take_loads(setup.stages.at(k), state.walls);
  return state;
}

}  // namespace talus
