#include "runtime/step/iteration.hpp"

#include <algorithm>
#include <cmath>

namespace talus {

std::size_t memory_used(const StepState& state) {
  return memory_used(state.bodies) + memory_used(state.candidates) + memory_used(state.chunks) +
         memory_used(state.contacts) +
         (state.free.u.capacity() + state.free.w.capacity()) * sizeof(std::array<double, 3>) +
         state.x_then.capacity() * sizeof(Vec3) + state.reach_then.capacity() * sizeof(double) +
         state.copies.capacity() * sizeof(WallCopy);
}

Iteration::Iteration(StepState& state, const StepParameters& parameters, const SolverSettings& settings)
    : state_(state), parameters_(parameters), settings_(settings) {}

void Iteration::begin() {
  const Chunks& chunks = state_.chunks;
  for (WallState& wall : state_.wall_states) {
    wall.copies.clear();
    wall.impulse.setZero();
  }
  state_.copies.assign(chunks.size(), {});
  for (std::size_t c = 0; c < chunks.size(); ++c)
    if (chunks.wall[c] >= 0 && state_.contacts.count[c] > 0)
      state_.wall_states[static_cast<std::size_t>(chunks.wall[c])].copies.push_back(
          static_cast<std::int32_t>(c));
  glued_.clear();
  for (std::size_t w = 0; w < state_.walls.size(); ++w) {
    const auto& copies = state_.wall_states[w].copies;
    const double split = static_cast<double>(copies.size()) * state_.walls[w].inv_mass();
    for (std::int32_t c : copies) state_.copies[static_cast<std::size_t>(c)].inv_mass = split;
    if (split > 0 && copies.size() > 1) glued_.push_back(static_cast<std::int32_t>(w));
  }
  sums_.assign(chunks.size(), {});
  impulses_.clear();
  history_.clear();
  result_ = {};
  segment_ = 0;
}

template <bool Friction>
void Iteration::chunk(std::size_t c, Work work) {
  Contacts& contacts = state_.contacts;
  const Chunks& chunks = state_.chunks;
  const auto begin = static_cast<std::size_t>(chunks.begin[c]);
  const ContactRange range{begin, begin + static_cast<std::size_t>(contacts.count[c])};
  std::span<Velocity> velocity = state_.bodies.velocity;
  const bool at_wall = chunks.wall[c] >= 0;
  const double mu = at_wall ? parameters_.law.mu_walls : parameters_.law.mu_grains;
  WallCopy& copy = state_.copies[c];
  switch (work) {
    case Work::accumulate: {
      const auto owned = static_cast<std::size_t>(chunks.owned_begin[c]);
      reset_to_free(
          std::span(chunks.owned).subspan(owned, static_cast<std::size_t>(chunks.owned_begin[c + 1]) - owned),
          state_.free, velocity);
      if (at_wall) {
        const Vec3& free = state_.wall_states[static_cast<std::size_t>(chunks.wall[c])].free_velocity;
        std::copy_n(free.data(), 3, copy.velocity);
        accumulate_wall<Friction>(contacts, range, velocity, copy);
      } else {
        accumulate_grains<Friction>(contacts, range, velocity);
      }
      break;
    }
    case Work::measure:
      sums_[c] = at_wall
                     ? error_wall<Friction>(contacts, range, velocity, mu, copy,
                                            state_.walls[static_cast<std::size_t>(chunks.wall[c])].inv_mass())
                     : error_grains<Friction>(contacts, range, velocity, mu);
      break;
    case Work::sweep:
      if (at_wall)
        sweep_wall<Friction>(contacts, range, velocity, mu, copy);
      else
        sweep_grains<Friction>(contacts, range, velocity, mu);
      break;
  }
}

void Iteration::node(std::uint32_t node, int epoch) {
  const Work now = work(epoch);
  if (node < state_.chunks.size()) {
    if (parameters_.friction)
      chunk<true>(node, now);
    else
      chunk<false>(node, now);
    return;
  }
  if (now == Work::measure) return;
  const auto wall = static_cast<std::size_t>(glued_[node - state_.chunks.size()]);
  glue_copies(state_.copies, state_.wall_states[wall].copies);
}

double Iteration::impulse_scale() const {
  double scale = 0;
  for (std::size_t w = 0; w < state_.walls.size(); ++w)
    scale =
        std::max({scale, impulses_.back()[w].norm(), parameters_.time_step * state_.wall_states[w].applied});
  return scale;
}

double Iteration::drift() const {
  const double scale = impulse_scale();
  if (scale == 0) return 0;
  std::size_t half = 0;
  while (half + 1 < history_.size() && 2 * history_[half + 1].iterations <= history_.back().iterations)
    ++half;
  double change = 0;
  for (std::size_t w = 0; w < state_.walls.size(); ++w)
    change = std::max(change, (impulses_.back()[w] - impulses_[half][w]).norm());
  return change / scale;
}

bool Iteration::decide(int epoch) {
  ErrorSums total;
  std::vector<Vec3> impulses(state_.walls.size(), Vec3::Zero());
  for (std::size_t c = 0; c < sums_.size(); ++c) {
    total.add(sums_[c]);
    if (state_.chunks.wall[c] >= 0)
      impulses[static_cast<std::size_t>(state_.chunks.wall[c])] +=
          Eigen::Map<const Vec3>(sums_[c].wall_impulse);
  }
  for (std::size_t w = 0; w < impulses.size(); ++w) state_.wall_states[w].impulse = impulses[w];
  impulses_.push_back(std::move(impulses));

  const double scale2 = std::max(total.impulse2, total.velocity2);
  const auto count = static_cast<double>(total.contacts);
  result_.error_rms = scale2 > 0 ? std::sqrt(total.residual2 / scale2) : 0;
  result_.error_max = scale2 > 0 ? total.residual_max / std::sqrt(scale2 / count) : 0;
  result_.contacts = total.contacts;
  result_.active = total.active;
  history_.push_back({result_.iterations, result_.error_rms});
  result_.drift = drift();

  // Before the first sweep the drift of the walls is not known yet; only an exact solution is taken as it is.
  const bool judged = result_.iterations > 0 || total.residual2 == 0;
  result_.converged =
      judged && result_.error_rms <= settings_.tolerance && result_.drift <= settings_.balance_tolerance;
  // A NaN fails every comparison: sweeping on cannot mend it, and the step's end reports it.
  if (result_.converged || std::isnan(result_.error_rms) || result_.iterations >= settings_.max_iterations)
    return false;
  const int sweeps = std::min(std::max(settings_.check_every, result_.iterations / 4),
                              settings_.max_iterations - result_.iterations);
  result_.iterations += sweeps;
  segment_ = epoch + 1 + sweeps;
  return true;
}

}  // namespace talus
