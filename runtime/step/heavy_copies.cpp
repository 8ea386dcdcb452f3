/// Copies of what many chunks push: walls, and a cell that follows a stress.

#include <limits>

#include "runtime/step/solver_loop.hpp"

namespace talus {

/// Gives a copy of a wall to each chunk that has contacts at it, and a copy of a cell that follows a stress
/// to each other chunk that has contacts. Collective.
void SolverLoop::split_walls() {
  const Chunks& chunks = state_.chunks;
  for (WallState& wall : state_.wall_states) {
    wall.copies.clear();
    wall.impulse.setZero();
  }
  state_.copies.assign(chunks.size(), {});
  for (std::size_t c = 0; c < chunks.size(); ++c)
    if (chunks.wall[c] >= 0 && state_.contacts.count[c] > 0)
      state_.wall_states[static_cast<std::size_t>(chunks.wall[c])].copies.emplace_back(c);
  StressedCell& cell = state_.cell;
  cell.held.clear();
  cell.copies.assign(cell.loaded() ? chunks.size() : 0, {});
  for (std::size_t c = 0; c < cell.copies.size(); ++c)
    if (chunks.wall[c] < 0 && state_.contacts.count[c] > 0) cell.held.emplace_back(c);
  gluing_.begin();
  gluing_.forget_jumps();
  const CellVelocity split_cell = cell.inv_mass(static_cast<double>(cell.copies_everywhere));
  for (const ChunkId c : cell.held) cell.copies[c.at()].inv_mass = split_cell;
  for (std::size_t w = 0; w < state_.walls.size(); ++w) {
    const WallState& wall = state_.wall_states[w];
    const double split = static_cast<double>(wall.copies_everywhere) * state_.walls[w].inv_mass();
    for (const ChunkId c : wall.copies) state_.copies[c.at()].inv_mass = split;
  }
}

/// The velocity that the step has found for a cell that follows a stress, from ranks that hold a copy.
/// Collective.
void SolverLoop::settle_cell() {
  StressedCell& cell = state_.cell;
  cell.velocity.fill(cell.copies_everywhere == 0 ? 0 : -std::numeric_limits<double>::infinity());
  if (!cell.held.empty()) cell.velocity = cell.copies[cell.held.front().at()].velocity;
  ranks_.max(cell.velocity);
  speed_up(gradient_of(cell.velocity, cell.length), parameters_.time_step, parameters_.reflection,
           state_.domain, state_.flow);
}

}  // namespace talus
