#include "runtime/step/iteration.hpp"

#include <algorithm>
#include <cmath>

#include "kernels/balance.hpp"

namespace talus {

std::size_t memory_used(const StepState& state) {
  return memory_used(state.bodies) + memory_used(state.candidates) + memory_used(state.chunks) +
         memory_used(state.contacts) + memory_used(state.decomposition) +
         (state.free.u.capacity() + state.free.w.capacity()) * sizeof(std::array<double, 3>) +
         state.x_then.capacity() * sizeof(Vec3) + state.reach_then.capacity() * sizeof(double) +
         state.copies.capacity() * sizeof(WallCopy);
}

Iteration::Iteration(StepState& state, const StepParameters& parameters, const SolverSettings& settings,
                     const DecompositionSettings& decomposition, const graph::Communicator& ranks)
    : state_(state),
      parameters_(parameters),
      settings_(settings),
      decomposition_(decomposition),
      ranks_(ranks),
      gluing_(state, decomposition, ranks),
      admm_(state, parameters, decomposition, ranks) {}

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
  gluing_.begin();
  for (std::size_t w = 0; w < state_.walls.size(); ++w) {
    const WallState& wall = state_.wall_states[w];
    const double split = static_cast<double>(wall.copies_everywhere) * state_.walls[w].inv_mass();
    for (std::int32_t c : wall.copies) state_.copies[static_cast<std::size_t>(c)].inv_mass = split;
  }
  const bool damped = decomposition_.coupling == Coupling::schwarz && decomposition_.damping &&
                      state_.decomposition.several();
  before_.resize(damped ? chunks.size() : 0);
  sums_.assign(chunks.size(), {});
  impulses_.clear();
  history_.clear();
  result_ = {};
  jump_ = {};
  history_from_ = 0;
  sweeps_needed_ = -1;
  sweeps_from_ = segment_ = 0;
}

template <bool Friction>
void Iteration::sweep(std::size_t c, ContactRange range, double mu) {
  const Chunks& chunks = state_.chunks;
  std::span<Velocity> velocity = state_.bodies.velocity;
  const bool at_wall = chunks.wall[c] >= 0;
  const bool damped = !before_.empty() && chunks.boundary[c] != 0;
  if (damped) copy_impulses<Friction>(state_.contacts, range, before_[c]);
  if (at_wall)
    sweep_wall<Friction>(state_.contacts, range, velocity, mu, state_.copies[c]);
  else
    sweep_grains<Friction>(state_.contacts, range, velocity, mu);
  if (damped)
    relax<Friction>(state_.contacts, range, before_[c], state_.decomposition.multiplicity, velocity,
                    at_wall ? &state_.copies[c] : nullptr);
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
  // With Schwarz a copy has the whole mass.
  const Multiplicities multiplicity = decomposition_.coupling == Coupling::nscdd && chunks.boundary[c] != 0
                                          ? Multiplicities(state_.decomposition.multiplicity)
                                          : Multiplicities();
  WallCopy& copy = state_.copies[c];
  const auto owned_begin = static_cast<std::size_t>(chunks.owned_begin[c]);
  const auto owned =
      std::span(chunks.owned)
          .subspan(owned_begin, static_cast<std::size_t>(chunks.owned_begin[c + 1]) - owned_begin);
  switch (work) {
    case Work::accumulate: {
      reset_to_free(owned, state_.free, velocity);
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
                                            state_.walls[static_cast<std::size_t>(chunks.wall[c])].inv_mass(),
                                            multiplicity)
                     : error_grains<Friction>(contacts, range, velocity, mu, multiplicity);
      break;
    case Work::sweep:
      sweep<Friction>(c, range, mu);
      break;
  }
}

Gluing::Mode Iteration::gluing_mode(int epoch) const {
  if (work(epoch) == Work::accumulate) return Gluing::Mode::fresh;
  const int sweeps = epoch - sweeps_from_ + 1;
  if (epoch + 1 == segment_) return Gluing::Mode::measured;
  return sweeps % decomposition_.sweeps_per_exchange == 0 ? Gluing::Mode::iterate : Gluing::Mode::local;
}

void Iteration::node(std::uint32_t node, int epoch) {
  const Work now = work(epoch);
  const std::size_t chunks = state_.chunks.size();
  if (node < chunks) {
    if (parameters_.friction)
      chunk<true>(node, now);
    else
      chunk<false>(node, now);
    // Long messages advance only while somebody calls MPI.
    if (ranks_.ranks() > 1 && node % 4 == 0) ranks_.progress();
    return;
  }
  if (now == Work::measure) return;
  const Gluing::Mode mode = gluing_mode(epoch);
  const std::size_t here = state_.decomposition.here.size(), task = node - chunks;
  if (task < here)
    gluing_.publish(task, mode);
  else if (task == here)
    gluing_.centre(mode);
  else
    gluing_.glue(task - here - 1, mode);
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
  // Since ADMM, all that sweeps changed of what it had settled; otherwise the second half of the sweeps.
  std::size_t from = history_from_;
  if (result_.stiff_calls == 0)
    while (from + 1 < history_.size() && 2 * history_[from + 1].iterations <= history_.back().iterations)
      ++from;
  double change = 0;
  for (std::size_t w = 0; w < state_.walls.size(); ++w)
    change = std::max(change, (impulses_.back()[w] - impulses_[from][w]).norm());
  return change / scale;
}

/// Per subdomain in order of chunk, then over subdomains in their order: the same sums on any number of
/// ranks.
void Iteration::add_up() {
  constexpr std::size_t head = 9;
  const std::size_t walls = state_.walls.size(), width = head + 3 * walls;
  const Decomposition& all = state_.decomposition;
  std::vector<double> rows(all.here.size() * width, 0.0);
  std::vector<ErrorSums> sums(all.here.size());
  for (std::size_t c = 0; c < sums_.size(); ++c) {
    const auto e = static_cast<std::size_t>(state_.chunks.subdomain[c]);
    sums[e].add(sums_[c]);
    if (state_.chunks.wall[c] < 0) continue;
    double* wall = &rows[e * width + head + 3 * static_cast<std::size_t>(state_.chunks.wall[c])];
    for (std::size_t k = 0; k < 3; ++k) wall[k] += sums_[c].wall_impulse[k];
  }
  for (std::size_t e = 0; e < all.here.size(); ++e) {
    const JumpSums jump = gluing_.jumps().empty() ? JumpSums{} : gluing_.jumps()[e];
    const double values[head] = {static_cast<double>(all.here[e]),
                                 sums[e].residual2,
                                 sums[e].residual_max,
                                 sums[e].impulse2,
                                 sums[e].velocity2,
                                 static_cast<double>(sums[e].contacts),
                                 static_cast<double>(sums[e].active),
                                 jump.jump2,
                                 jump.velocity2};
    std::copy_n(values, head, &rows[e * width]);
  }
  rows = ranks_.gather_records(std::span<const double>(rows));
  std::vector<const double*> by_subdomain(static_cast<std::size_t>(all.partition.subdomains));
  for (std::size_t k = 0; k < rows.size(); k += width)
    by_subdomain[static_cast<std::size_t>(rows[k])] = &rows[k];
  total_ = {};
  jump_ = {};
  std::vector<Vec3> impulses(walls, Vec3::Zero());
  for (const double* row : by_subdomain) {
    ErrorSums part;
    part.residual2 = row[1];
    part.residual_max = row[2];
    part.impulse2 = row[3];
    part.velocity2 = row[4];
    part.contacts = static_cast<std::int64_t>(row[5]);
    part.active = static_cast<std::int64_t>(row[6]);
    total_.add(part);
    jump_.jump2 += row[7];
    jump_.velocity2 += row[8];
    for (std::size_t w = 0; w < walls; ++w) impulses[w] += Eigen::Map<const Vec3>(row + head + 3 * w);
  }
  for (std::size_t w = 0; w < walls; ++w) state_.wall_states[w].impulse = impulses[w];
  impulses_.push_back(std::move(impulses));
}

/// About the sweeps that this step's problem takes; looked up once a step, when somebody asks. On several
/// ranks nobody sees the whole problem, and drift is taken at its word.
double Iteration::sweeps_needed() {
  if (sweeps_needed_ < 0) sweeps_needed_ = admm_.available() ? admm_.sweeps_needed() : 0;
  return sweeps_needed_;
}

bool Iteration::balanced() {
  result_.unbalance = result_.drift;
  if (result_.stiff_calls > 0)
    result_.unbalance += result_.stiff.balance_defect;
  else if (result_.drift > 0 && result_.drift <= settings_.balance_tolerance)
    result_.unbalance = unbalance(result_.drift, result_.iterations, sweeps_needed());
  return result_.unbalance <= settings_.balance_tolerance;
}

/// With `automatic`, ADMM is for problems that sweeps, having had their chance, did not get balanced, and
/// would not in fewer sweeps than it costs. Whatever it leaves undone it is asked for again, ever later.
bool Iteration::ask_admm() {
  constexpr int chance = 50, worth = 1000, calls = 3;
  if (settings_.stiff == StiffSolver::off || !admm_.available()) return false;
  if (settings_.stiff == StiffSolver::always && result_.stiff_calls == 0) return true;
  if (result_.stiff_calls == calls || balanced()) return false;
  const int since = result_.iterations - (result_.stiff_calls == 0 ? 0 : history_[history_from_].iterations);
  return since >= chance << (2 * result_.stiff_calls) && sweeps_needed() >= worth;
}

bool Iteration::decide(int epoch) {
  add_up();
  const ErrorSums& total = total_;

  const double scale2 = std::max(total.impulse2, total.velocity2);
  const auto count = static_cast<double>(total.contacts);
  result_.error_rms = scale2 > 0 ? std::sqrt(total.residual2 / scale2) : 0;
  result_.error_max = scale2 > 0 ? total.residual_max / std::sqrt(scale2 / count) : 0;
  result_.jump = jump_.velocity2 > 0 ? std::sqrt(jump_.jump2 / jump_.velocity2) : 0;
  result_.contacts = total.contacts;
  result_.active = total.active;
  history_.push_back({result_.iterations, result_.error_rms});
  result_.drift = drift();
  // Before the first sweep the drift of the walls is not known yet; only an exact solution is taken as it is.
  const bool judged = result_.iterations > 0 || total.residual2 == 0;
  result_.converged = judged && result_.error_rms <= settings_.tolerance &&
                      std::max(result_.drift, result_.unbalance) <= settings_.balance_tolerance;
  // A sweep never makes the residual of a step a thousand times worse; an exchange that adds up too much
  // does.
  if (history_.size() == history_from_ + 1) first_residual2_ = std::max(total.residual2, scale2);
  constexpr double hopeless = 1e3;
  result_.diverged = total.residual2 > hopeless * hopeless * first_residual2_;
  if (result_.diverged) return false;
  // A NaN fails every comparison: sweeping on cannot mend it, and the step's end reports it.
  if (result_.converged || std::isnan(result_.error_rms) || result_.iterations >= settings_.max_iterations)
    return false;
  if (ask_admm()) {
    result_.stiff = admm_.improve();
    ++result_.stiff_calls;
    // What the walls carried before says nothing about the drift of what they carry now.
    history_from_ = history_.size();
    segment_ = epoch + 1;
    return true;
  }
  const int sweeps = std::min(std::max(settings_.check_every, result_.iterations / 4),
                              settings_.max_iterations - result_.iterations);
  result_.iterations += sweeps;
  sweeps_from_ = epoch + 1;
  segment_ = epoch + 1 + sweeps;
  return true;
}

}  // namespace talus
