#include "runtime/step/iteration.hpp"

#include "runtime/step/task_kinds.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "kernels/bodies/larger.hpp"
#include "kernels/global/balance.hpp"
#include "kernels/sweeps/fetch_lines.hpp"
#include "runtime/graph/clock.hpp"
#include "runtime/trace/recorder.hpp"

namespace talus {

std::size_t memory_used(const StepState& state) {
  return memory_used(state.bodies) + memory_used(state.candidates) + memory_used(state.chunks) +
         memory_used(state.contacts) + memory_used(state.decomposition) +
         (state.free.u.capacity() + state.free.w.capacity()) * sizeof(std::array<double, 3>) +
         state.x_then.capacity() * sizeof(Vec3) + state.reach_then.capacity() * sizeof(double) +
         memory_used(state.single) + state.copies.capacity() * sizeof(WallCopy);
}

InstructionSet settled(InstructionSet set, const graph::Communicator& ranks) {
  if (set != InstructionSet::automatic || ranks.ranks() == 1) return set;
  double weakest[1] = {-static_cast<double>(best_instruction_set())};
  ranks.max(weakest);
  return static_cast<InstructionSet>(static_cast<int>(-weakest[0]));
}

Iteration::Iteration(StepState& state, const StepParameters& parameters, const SolverSettings& settings,
                     const DecompositionSettings& decomposition, const graph::Communicator& ranks)
    : state_(state),
      parameters_(parameters),
      settings_(settings),
      decomposition_(decomposition),
      ranks_(ranks),
      kernels_(settled(settings.simd, ranks)),
      gluing_(state, decomposition, ranks),
      admm_(state, parameters, decomposition, gluing_, ranks) {}

void Iteration::plan() {
  gluing_.plan(parameters_.rotates);
  ++stiffness_.renewals;
  struct Row {
    double least, most, candidates;
  };
  Row all{std::numeric_limits<double>::infinity(), 0, static_cast<double>(state_.candidates.size())};
  for (const Velocity& v : state_.bodies.velocity) {
    all.least = std::min(all.least, v.inv_mass);
    all.most = std::max(all.most, v.inv_mass);
  }
  const std::vector<Row> everywhere = ranks_.gather_records(std::span<const Row>(&all, 1));
  all.candidates = 0;
  for (const Row& row : everywhere) {
    all.least = std::min(all.least, row.least);
    all.most = std::max(all.most, row.most);
    all.candidates += row.candidates;
  }
  spread_ = all.most / all.least;
  candidates_everywhere_ = all.candidates;
  state_.single.contacts.unit = all.most > 0 ? unit_of_mass(all.most) : 1;
  busy_.assign(decomposition_.balance == BalanceBy::time ? state_.chunks.size() : 0, 0.0);
}

void Iteration::plan_tree() {
  std::uint64_t contacts = 0;
  for (std::size_t c = 0; c < state_.chunks.size(); ++c)
    contacts += 1 + static_cast<std::uint64_t>(state_.contacts.count[c]);
  gluing_.plan_tree(contacts);
}

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
  gluing_.forget_jumps();
  for (std::size_t w = 0; w < state_.walls.size(); ++w) {
    const WallState& wall = state_.wall_states[w];
    const double split = static_cast<double>(wall.copies_everywhere) * state_.walls[w].inv_mass();
    for (std::int32_t c : wall.copies) state_.copies[static_cast<std::size_t>(c)].inv_mass = split;
  }
  const bool damped = decomposition_.coupling == Coupling::schwarz && decomposition_.damping &&
                      state_.decomposition.several();
  before_.resize(damped ? chunks.size() : 0);
  sums_.assign(chunks.size(), {});
  began_ = graph::seconds_now();
  impulses_.clear();
  history_.clear();
  result_ = {};
  jump_ = {};
  pending_.reset();
  sweeps_from_ = segment_ = 0;
  read_at_ = restore_at_ = -1;
  sweeps_ = before_segment_ = 0;
  history_from_ = patience_from_ = 0;
  sweeps_needed_ = -1;
  looked_ = {};
  first_course();
}

template <bool Friction>
void Iteration::sweep(std::size_t c, ContactRange range, double mu, int epoch) {
  const Chunks& chunks = state_.chunks;
  std::span<Velocity> velocity = state_.bodies.velocity;
  const bool at_wall = chunks.wall[c] >= 0;
  const bool damped = !before_.empty() && chunks.side[c] != ChunkSide::inside;
  if (damped) copy_impulses<Friction>(state_.contacts, range, before_[c]);
  if (course(epoch).method == SolverMethod::momentum) {
    const SweepMomentum momentum{beta(epoch), omega(epoch), acceleration_.steps};
    SingleState& single = state_.single;
    if (course(epoch).single && at_wall)
      kernels_.sweep_wall<Friction>(state_.contacts, single.contacts, range, single.velocity, mu,
                                    state_.copies[c], momentum);
    else if (course(epoch).single)
      kernels_.sweep_grains<Friction>(state_.contacts, single.contacts, range, single.velocity, mu, momentum);
    else if (at_wall)
      kernels_.sweep_wall<Friction>(state_.contacts, range, velocity, mu, state_.copies[c], momentum);
    else
      kernels_.sweep_grains<Friction>(state_.contacts, range, velocity, mu, momentum);
  } else if (at_wall) {
    kernels_.sweep_wall<Friction>(state_.contacts, range, velocity, mu, state_.copies[c]);
  } else {
    kernels_.sweep_grains<Friction>(state_.contacts, range, velocity, mu);
  }
  if (damped)
    relax<Friction>(state_.contacts, range, before_[c], state_.decomposition.multiplicity, velocity,
                    at_wall ? &state_.copies[c] : nullptr);
}

template <bool Friction>
void Iteration::chunk(std::size_t c, int epoch) {
  const Work work = this->work(epoch);
  Contacts& contacts = state_.contacts;
  const Chunks& chunks = state_.chunks;
  const auto begin = static_cast<std::size_t>(chunks.begin[c]);
  const ContactRange range{begin, begin + static_cast<std::size_t>(contacts.count[c])};
  std::span<Velocity> velocity = state_.bodies.velocity;
  const bool at_wall = chunks.wall[c] >= 0;
  const double mu = at_wall ? parameters_.law.mu_walls : parameters_.law.mu_grains;
  const Multiplicities parts =
      chunks.side[c] != ChunkSide::inside ? Multiplicities(state_.decomposition.parts) : Multiplicities();
  WallCopy& copy = state_.copies[c];
  switch (work) {
    case Work::restore:
    case Work::accumulate: {
      if (work == Work::restore) restore_impulses(state_.candidates, chunks, c, contacts);
      // Behind sweeps; at the start of a step, and behind ADMM, the impulses are those of `contacts`.
      const bool from_single = work == Work::accumulate && epoch > sweeps_from_ && single(epoch - 1);
      if (from_single) widen_impulses(state_.single.contacts, range, contacts);
      if (course_.method != SolverMethod::nlgs) {
        if (from_single)
          loosen(owned(c), state_.single.velocity, state_.single.last_v);
        else if (!course_.single)
          loosen(owned(c), state_.bodies.velocity, acceleration_.last_v);
        if (at_wall) loosen(c, copy, acceleration_);
      }
      reset_to_free(owned(c), state_.free, velocity);
      if (at_wall) {
        const Vec3& free = state_.wall_states[static_cast<std::size_t>(chunks.wall[c])].free_velocity;
        std::copy_n(free.data(), 3, copy.velocity);
        kernels_.accumulate_wall<Friction>(contacts, range, velocity, copy);
      } else {
        kernels_.accumulate_grains<Friction>(contacts, range, velocity);
      }
      break;
    }
    case Work::measure:
      sums_[c] = at_wall ? kernels_.error_wall<Friction>(
                               contacts, range, velocity, mu, copy,
                               state_.walls[static_cast<std::size_t>(chunks.wall[c])].inv_mass(), parts)
                         : kernels_.error_grains<Friction>(contacts, range, velocity, mu, parts);
      if (ranks_.ranks() > 1) store_impulses(contacts, chunks, c, state_.candidates);
      break;
    case Work::sweep:
      change_precision(c, range, epoch);
      if (course(epoch).method != SolverMethod::nlgs) carry_on(c, range, epoch);
      sweep<Friction>(c, range, mu, epoch);
      if (course(epoch).method == SolverMethod::nncg)
        changes_[c] = change_squared(range, contacts, velocity, copy.inv_mass, acceleration_);
      break;
  }
}

std::vector<double> Iteration::busy() const {
  std::vector<double> sums(state_.decomposition.here.size(), 0.0);
  for (std::size_t c = 0; c < busy_.size(); ++c)
    sums[static_cast<std::size_t>(state_.chunks.subdomain[c])] += busy_[c];
  return sums;
}

Gluing::Mode Iteration::gluing_mode(int epoch) const {
  if (work(epoch) == Work::accumulate || work(epoch) == Work::restore) return Gluing::Mode::fresh;
  const int sweeps = epoch - sweeps_from_ + 1;
  if (epoch + 1 == segment_) return Gluing::Mode::measured;
  return sweeps % decomposition_.sweeps_per_exchange == 0 ? Gluing::Mode::iterate : Gluing::Mode::local;
}

void Iteration::node(std::uint32_t node, int epoch) {
  const Work now = work(epoch);
  const std::size_t chunks = state_.chunks.size();
  if (node < chunks) {
    const double start = busy_.empty() ? 0 : graph::seconds_now();
    if (parameters_.friction)
      chunk<true>(node, epoch);
    else
      chunk<false>(node, epoch);
    if (!busy_.empty()) busy_[node] += graph::seconds_now() - start;
    // Long messages advance only while somebody calls MPI.
    if (ranks_.ranks() > 1 && node % 4 == 0 && ranks_.any_thread()) ranks_.progress();
    return;
  }
  if (now == Work::measure) return;
  const Gluing::Mode mode = gluing_mode(epoch);
  const auto [task, subdomain] = gluing_.node(node - chunks);
  switch (task) {
    case Gluing::Task::publish:
      return gluing_.publish(*subdomain, mode, single(epoch));
    case Gluing::Task::collect:
      return gluing_.collect(mode);
    case Gluing::Task::root:
      return gluing_.root(mode);
    case Gluing::Task::glue:
      return gluing_.glue(*subdomain, mode, single(epoch));
    case Gluing::Task::take:
      return take(*subdomain, epoch);
    case Gluing::Task::tell:
      return gluing_.tell(*subdomain, mode);
  }
}

/// Nobody but take writes a taken copy before its boundary is swept: its mass comes to where single sweeps
/// look for it with the first of them.
void Iteration::take(std::size_t e, int epoch) {
  const bool now = single(epoch), before = number(epoch) > 0 && course(epoch - 1).single;
  if (now && !before) narrow_bodies(gluing_.taken(e), state_.bodies.velocity, state_.single);
  gluing_.take(e, now);
}

std::optional<trace::Kind> Iteration::kind(std::uint32_t node, int epoch) const {
  const Work now = work(epoch);
  const std::size_t chunks = state_.chunks.size();
  if (node >= chunks) {
    if (now == Work::measure || gluing_mode(epoch) == Gluing::Mode::local) return std::nullopt;
    // In the order of Gluing::Task.
    constexpr TaskKind kinds[] = {TaskKind::publish, TaskKind::root, TaskKind::root,
                                  TaskKind::glue,    TaskKind::take, TaskKind::tell};
    return kind_of(kinds[static_cast<std::size_t>(gluing_.node(node - chunks).task)]);
  }
  switch (now) {
    case Work::accumulate:
      return kind_of(TaskKind::accumulate);
    case Work::measure:
      return kind_of(TaskKind::measure);
    case Work::restore:
      return kind_of(TaskKind::restore);
    case Work::sweep:
      break;
  }
  return kind_of(TaskKind::sweep);
}

std::optional<std::size_t> Iteration::subdomain_of(std::uint32_t node) const {
  const std::size_t chunks = state_.chunks.size();
  if (node < chunks) return static_cast<std::size_t>(state_.chunks.subdomain[node]);
  return gluing_.node(node - chunks).subdomain;
}

void Iteration::fetch(std::size_t subdomain) const {
  const auto fetch = [](std::size_t begin, std::size_t end, const auto&... columns) {
    // A column that this scene has not got is empty.
    (fetch_lines(std::span(std::as_const(columns))
                     .subspan(std::min(begin, columns.size()), columns.size() < end ? 0 : end - begin)),
     ...);
  };
  const Contacts& contacts = state_.contacts;
  const SingleContacts& single = state_.single.contacts;
  const Decomposition& all = state_.decomposition;
  const std::size_t first = all.several() ? all.slot_begin[subdomain] : 0,
                    last = all.several() ? all.slot_begin[subdomain + 1] : state_.bodies.size();
  // What single sweeps want comes last, and is nearest then.
  fetch(first, last, state_.free.u, state_.free.w, state_.bodies.velocity, acceleration_.last_v,
        acceleration_.step_v);
  for (const bool in_single : {false, true})
    for (std::size_t c = 0; c < state_.chunks.size(); ++c) {
      if (static_cast<std::size_t>(state_.chunks.subdomain[c]) != subdomain) continue;
      const auto begin = static_cast<std::size_t>(state_.chunks.begin[c]);
      const std::size_t end = begin + static_cast<std::size_t>(contacts.count[c]);
      if (in_single)
        fetch(begin, end, single.nx, single.ny, single.nz, single.bias, single.rx, single.ry, single.rz,
              single.rn, acceleration_.steps.x, acceleration_.steps.y, acceleration_.steps.z,
              acceleration_.steps.n, contacts.first_record, contacts.second_record, contacts.group);
      else
        fetch(begin, end, contacts.nx, contacts.ny, contacts.nz, contacts.bias, contacts.rx, contacts.ry,
              contacts.rz, contacts.rn);
    }
  fetch(first, last, state_.single.velocity, state_.single.last_v);
  gluing_.fetch(subdomain);
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
  const auto last_check_in = [&](int part) {
    std::size_t from = history_from_;
    while (from + 1 < history_.size() && part * history_[from + 1].iterations <= history_.back().iterations)
      ++from;
    return from;
  };
  // Largest distance on the way: what swings may just pass where it came from.
  const auto change = [&](std::size_t from, std::size_t to) {
    double largest = 0;
    for (std::size_t k = from; k < to; ++k)
      for (std::size_t w = 0; w < state_.walls.size(); ++w)
        largest = std::max(largest, (impulses_[to][w] - impulses_[k][w]).norm());
    return largest / scale;
  };
  // At the first check nothing tells how the change goes on. Where a few sweeps follow warm impulses in a
  // pile, up to six times as much is still to come (`talus study stability`, time-step-pile).
  constexpr double first_look = 4;
  const std::size_t last = history_.size() - 1;
  // Since ADMM: all that sweeps changed of what it had settled.
  if (result_.stiff_calls > 0) return change(history_from_, last);
  const std::size_t half = last_check_in(2), quarter = last_check_in(4);
  if (half == quarter) return first_look * change(half, last);
  // The checks do not stand at halves and quarters.
  const double second_quarter = 0.25 * history_[last].iterations;
  const int between = history_[half].iterations - history_[quarter].iterations;
  return left_over(change(half, last), change(quarter, half) * second_quarter / between);
}

namespace {

/// Of a subdomain: its number, eight sums and three impulses per wall.
constexpr std::size_t row_head = 9;

std::vector<const double*> sorted_rows(std::span<const double> rows, std::size_t width,
                                       std::int32_t subdomains) {
  std::vector<const double*> sorted(static_cast<std::size_t>(subdomains));
  for (std::size_t k = 0; k < rows.size(); k += width) sorted[static_cast<std::size_t>(rows[k])] = &rows[k];
  return sorted;
}

}  // namespace

/// Per subdomain in order of chunk; add_up adds over subdomains in their order: the same sums on any number
/// of ranks.
std::vector<double> Iteration::rows_of_subdomains() const {
  const std::size_t walls = state_.walls.size(), width = row_head + 3 * walls;
  const Decomposition& all = state_.decomposition;
  std::vector<double> rows(all.here.size() * width, 0.0);
  std::vector<ErrorSums> sums(all.here.size());
  for (std::size_t c = 0; c < sums_.size(); ++c) {
    const auto e = static_cast<std::size_t>(state_.chunks.subdomain[c]);
    sums[e].add(sums_[c]);
    if (state_.chunks.wall[c] < 0) continue;
    double* wall = &rows[e * width + row_head + 3 * static_cast<std::size_t>(state_.chunks.wall[c])];
    for (std::size_t k = 0; k < 3; ++k) wall[k] += sums_[c].wall_impulse[k];
  }
  for (std::size_t e = 0; e < all.here.size(); ++e) {
    const JumpSums jump = gluing_.jumps().empty() ? JumpSums{} : gluing_.jumps()[e];
    const double values[row_head] = {static_cast<double>(all.here[e]),
                                     sums[e].residual2,
                                     sums[e].residual_max2,
                                     sums[e].impulse2,
                                     sums[e].velocity2,
                                     static_cast<double>(sums[e].contacts),
                                     static_cast<double>(sums[e].active),
                                     jump.jump2,
                                     jump.velocity2};
    std::copy_n(values, row_head, &rows[e * width]);
  }
  return rows;
}

void Iteration::add_up(std::span<const double> rows) {
  const std::size_t walls = state_.walls.size(), width = row_head + 3 * walls;
  total_ = {};
  jump_ = {};
  std::int64_t fullest = 0;
  std::vector<Vec3> impulses(walls, Vec3::Zero());
  for (const double* row : sorted_rows(rows, width, state_.decomposition.partition.subdomains)) {
    ErrorSums part;
    part.residual2 = row[1];
    part.residual_max2 = row[2];
    part.impulse2 = row[3];
    part.velocity2 = row[4];
    part.contacts = static_cast<std::int64_t>(row[5]);
    part.active = static_cast<std::int64_t>(row[6]);
    total_.add(part);
    fullest = std::max(fullest, part.contacts);
    jump_.jump2 += row[7];
    jump_.velocity2 += row[8];
    for (std::size_t w = 0; w < walls; ++w) impulses[w] += Eigen::Map<const Vec3>(row + row_head + 3 * w);
  }
  imbalance_ = total_.contacts > 0
                   ? static_cast<double>(fullest) * state_.decomposition.partition.subdomains /
                             static_cast<double>(total_.contacts) -
                         1
                   : 0;
  for (std::size_t w = 0; w < walls; ++w) state_.wall_states[w].impulse = impulses[w];
  impulses_.push_back(std::move(impulses));
}

bool Iteration::decide(int epoch) {
  if (epoch == restore_at_) return false;
  bool goes_on = true;
  if (work(epoch) == Work::measure)
    goes_on = measured(epoch);
  else
    goes_on = swept(epoch);
  return goes_on;
}

/// Behind a measure: the sums are judged, or set out, and the next sweeps planned.
bool Iteration::measured(int epoch) {
  result_.iterations = sweeps_;
  measured_ = graph::seconds_now();
  const Decomposition& all = state_.decomposition;
  trace::Span span(ranks_.trace(), kind_of(TaskKind::sums), 0, trace::Span::in_check);
  std::vector<double> rows = rows_of_subdomains();
  span.end();
  std::vector<std::size_t> lengths(static_cast<std::size_t>(ranks_.ranks()), 0);
  for (std::int32_t rank : all.rank_of)
    lengths[static_cast<std::size_t>(rank)] += row_head + 3 * state_.walls.size();
  pending_ = ranks_.start_gather(std::move(rows), lengths);
  if (ranks_.ranks() == 1 || settles(epoch)) {
    add_up(pending_->wait());
    if (!judge()) return false;
    if (ask_admm())
      call_admm(epoch);
    else
      plan_sweeps(epoch, sweeps_ahead());
    return true;
  }
  // One for sure; how many more follows when it is known how this check came out.
  plan_sweeps(epoch, std::min(least_sweeps, settings_.max_iterations - sweeps_));
  read_at_ = epoch + 1;
  return true;
}

/// Behind a sweep: what was set out before it is read.
bool Iteration::swept(int epoch) {
  if (course(epoch).method == SolverMethod::nncg) turn_conjugate();
  if (epoch != read_at_) return true;
  read_at_ = -1;
  add_up(pending_->wait());
  if (!judge())
    restore_at_ = epoch + 1;
  else if (ask_admm())
    call_admm(epoch);
  else
    plan_sweeps(sweeps_from_ - 1, sweeps_ahead());
  return true;
}

/// The ratio of Fletcher and Reeves, from what the last two sweeps changed; added up like the error.
void Iteration::turn_conjugate() {
  const Decomposition& all = state_.decomposition;
  std::vector<double> rows(2 * all.here.size(), 0.0);
  for (std::size_t e = 0; e < all.here.size(); ++e) rows[2 * e] = all.here[e];
  for (std::size_t c = 0; c < changes_.size(); ++c)
    rows[2 * static_cast<std::size_t>(state_.chunks.subdomain[c]) + 1] += changes_[c];
  double change2 = 0;
  const std::vector<double> everywhere = ranks_.gather_records(std::span<const double>(rows));
  for (const double* row : sorted_rows(everywhere, 2, all.partition.subdomains)) change2 += row[1];
  conjugate_beta_ = change2_ > 0 && change2 <= change2_ ? change2 / change2_ : 0;
  change2_ = change2;
}

/// Judges the sums of the check after result_.iterations sweeps. False: the step ends with them.
bool Iteration::judge() {
  const ErrorSums& total = total_;

  const auto count = static_cast<double>(total.contacts);
  // Forces that fade away leave velocities that rounding makes: in gaps, over a step.
  const double rounding = std::numeric_limits<double>::epsilon() * parameters_.alert / parameters_.time_step;
  const double scale2 = larger(larger(total.impulse2, total.velocity2), count * rounding * rounding);
  result_.error_rms = scale2 != 0 ? std::sqrt(total.residual2 / scale2) : 0;
  result_.error_max = scale2 != 0 ? std::sqrt(total.residual_max2 * count / scale2) : 0;
  result_.jump = jump_.velocity2 > 0 ? std::sqrt(jump_.jump2 / jump_.velocity2) : 0;
  result_.contacts = total.contacts;
  result_.active = total.active;
  history_.push_back({result_.iterations, result_.error_rms, measured_ - began_});
  result_.drift = drift();

  // Before the first sweep the drift of the walls is not known yet; only an exact solution is taken as it is.
  const bool judged = result_.iterations > 0 || total.residual2 == 0;
  const bool small = judged && result_.error_rms <= settings_.tolerance;
  const bool last = result_.iterations >= settings_.max_iterations;
  result_.unbalance = result_.drift;
  // Looking at the whole problem costs as much as a few sweeps: where it is needed only.
  const bool balance = (small || last) && balanced();
  result_.converged = small && balance;
  // A plain sweep never makes the residual of a step a thousand times worse; an exchange that adds up too
  // much does.
  if (history_.size() == history_from_ + 1) first_residual2_ = std::max(total.residual2, scale2);
  constexpr double hopeless = 1e3;
  result_.diverged =
      course_.method == SolverMethod::nlgs && total.residual2 > hopeless * hopeless * first_residual2_;
  if (result_.diverged) return false;
  // A NaN fails every comparison: sweeping on cannot mend it, and the step's end reports it.
  result_.stagnated = !result_.converged && stagnant();
  if (result_.stagnated && settings_.method == SolverMethod::automatic &&
      course_.method != SolverMethod::nlgs) {
    // Momentum can go in circles about what plain sweeps reach.
    result_.stagnated = false;
    patience_from_ = history_.size() - 1;
    give_way();
  }
  if (result_.converged || std::isnan(result_.error_rms) || last || result_.stagnated) return false;
  choose_course();
  if (course_.single && !single_will_do(course_.method)) go_on_in_double();
  return true;
}

}  // namespace talus
