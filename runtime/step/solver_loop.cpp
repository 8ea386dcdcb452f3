#include "runtime/step/solver_loop.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "runtime/graph/clock.hpp"
#include "runtime/step/check_spacing.hpp"
#include "runtime/step/check_sums.hpp"
#include "runtime/step/loop_nodes.hpp"
#include "runtime/step/task_kinds.hpp"
#include "runtime/trace/recorder.hpp"

namespace talus {

using Work = EpochSchedule::Work;

namespace {

/// When sweeps begin in single precision (docs/decisions/0015-single-precision.md).
struct SinglePrecisionUse {
  /// Only while error_rms is above this, > 0: floats alone stall near 1e-6.
  double least_error = 1e-5;
  /// Fewest candidates of all ranks: smaller problems gain no time.
  double least_candidates = 1000;
};
constexpr SinglePrecisionUse single_use;

TaskKind kind_of_work(Work work) {
  switch (work) {
    case Work::accumulate:
      return TaskKind::accumulate;
    case Work::measure:
      return TaskKind::measure;
    case Work::restore:
      return TaskKind::restore;
    case Work::position:
      return TaskKind::position;
    case Work::sweep:
      break;
  }
  return TaskKind::sweep;
}

/// Kind of a node that is not work of a chunk.
TaskKind kind_of_role(graph::LoopRole role) {
  switch (role) {
    case graph::LoopRole::publish:
      return TaskKind::publish;
    case graph::LoopRole::glue:
      return TaskKind::glue;
    case graph::LoopRole::take:
      return TaskKind::take;
    case graph::LoopRole::tell:
      return TaskKind::tell;
    case graph::LoopRole::work:
    case graph::LoopRole::collect:
    case graph::LoopRole::root:
      break;
  }
  return TaskKind::root;
}

/// A step as its method sees it.
class StepView final : public MethodView {
 public:
  StepView(Certificate& certificate, WholeProblem& problem) : certificate_(certificate), problem_(problem) {}
  int sweeps_since_start() const override {
    return certificate_.result().iterations - certificate_.started_at();
  }
  int admm_calls() const override { return certificate_.result().stiff_calls; }
  double sweeps_needed() override { return problem_.sweeps_needed(); }
  bool checks_velocities() override {
    return certificate_.found_wrong() || certificate_.checks_velocities(problem_);
  }
  bool balanced() override { return certificate_.balanced(problem_); }

 private:
  Certificate& certificate_;
  WholeProblem& problem_;
};

}  // namespace

InstructionSet settled(InstructionSet set, const graph::Communicator& ranks) {
  if (set != InstructionSet::automatic || ranks.ranks() == 1) return set;
  double weakest[1] = {-static_cast<double>(best_instruction_set())};
  ranks.max(weakest);
  return static_cast<InstructionSet>(static_cast<int>(-weakest[0]));
}

SolverLoop::SolverLoop(StepState& state, const StepParameters& parameters, const SolverSettings& settings,
                       const DecompositionSettings& decomposition, const graph::Communicator& ranks)
    : state_(state),
      parameters_(parameters),
      settings_(settings),
      decomposition_(decomposition),
      ranks_(ranks),
      kernels_(settled(settings.simd, ranks)),
      gluing_(state, decomposition, ranks),
      global_(state, parameters, decomposition, gluing_, ranks),
      work_(state, parameters, kernels_, schedule_, courses_),
      positions_(state, parameters, settings, kernels_, work_),
      certificate_(settings),
      problem_(state, global_, courses_, certificate_) {}

void SolverLoop::plan() {
  gluing_.plan(parameters_.rotates);
  problem_.plan(ranks_);
  const double lightest = problem_.largest_inv_mass();
  state_.single.contacts.unit = lightest > 0 ? unit_of_mass(lightest) : 1;
  work_.plan(decomposition_.balance == BalanceBy::time);
  positions_.plan();
}

void SolverLoop::plan_tree() {
  std::uint64_t contacts = 0;
  for (std::size_t c = 0; c < state_.chunks.size(); ++c)
    contacts += 1 + static_cast<std::uint64_t>(state_.contacts.count[c]);
  gluing_.plan_tree(contacts);
}

const graph::LoopPlan& SolverLoop::plan_nodes(int threads) {
  plan_ = graph::plan_loop(loop_spec(state_, gluing_, decomposition_, ranks_, threads), gluing_.tree());
  return plan_;
}

bool SolverLoop::schwarz() const {
  return decomposition_.coupling == Coupling::schwarz && state_.decomposition.several();
}

void SolverLoop::begin() {
  split_walls();
  work_.begin(schwarz() && decomposition_.damping, ranks_.ranks() > 1);
  positions_.forget();
  began_ = graph::seconds_now();
  Certificate::Scales scales;
  scales.rounding_velocity =
      std::numeric_limits<double>::epsilon() * problem_.farthest() / parameters_.time_step;
  for (const WallState& wall : state_.wall_states)
    scales.wall_pushes.push_back(parameters_.impulse_time() * wall.applied);
  for (std::size_t w = state_.walls.size(), k = 0; w < pushed_vectors(state_); ++w, k += 3)
    scales.wall_pushes.push_back(state_.cell.loaded() ? Eigen::Map<const Vec3>(&state_.cell.push[k]).norm()
                                                      : 0);
  for (std::size_t w = 0; w < state_.walls.size(); ++w) {
    scales.wall_inv_masses.push_back(state_.walls[w].inv_mass());
    if (scales.wall_inv_masses[w] == 0)
      scales.drive = std::max(scales.drive, state_.wall_states[w].free_velocity.norm());
  }
  scales.wall_inv_masses.resize(pushed_vectors(state_), state_.cell.loaded() ? 1 / state_.cell.mass : 0);
  scales.friction = parameters_.laws.largest(&PairLaw::friction) > 0;
  certificate_.begin(std::move(scales));
  problem_.begin();
  pending_.reset();
  schedule_ = {};
  method_ =
      methods()
          .of(settings_.method)
          .make({settings_, parameters_.friction, schwarz() || parameters_.rolls || parameters_.clumps});
  begin_course(method_->begin(), 0);
}

void SolverLoop::begin_course(const SweepPlan& plan, int from) {
  courses_.begin(plan, from, single_will_do(plan.kind));
  work_.make_room();
}

/// Whether sweeps in single precision reduce the error of this problem as those in double do. They do not if
/// the error is small already, or bodies are so heavy that single sweeps would not move them.
bool SolverLoop::single_will_do(SweepKind kind) const {
  const ErrorHistory& history = certificate_.history();
  return kind == SweepKind::momentum && settings_.precision == Precision::mixed && !schwarz() &&
         problem_.grains_alike() && problem_.candidates() >= single_use.least_candidates &&
         (history.empty() || history.last().error_rms > single_use.least_error);
}

Gluing::Mode SolverLoop::gluing_mode(int epoch) const {
  const Work work = schedule_.work(epoch);
  if (work == Work::accumulate || work == Work::restore) return Gluing::Mode::fresh;
  if (work == Work::position) return Gluing::Mode::iterate;
  if (schedule_.closes_segment(epoch)) return Gluing::Mode::measured;
  return schedule_.sweeps_of_segment(epoch) % decomposition_.sweeps_per_exchange == 0 ? Gluing::Mode::iterate
                                                                                      : Gluing::Mode::local;
}

void SolverLoop::node(std::uint32_t node, int epoch) {
  const auto [role, group] = plan_.nodes[node];
  if (role == graph::LoopRole::work) {
    if (schedule_.work(epoch) == Work::position)
      positions_.run(node, schedule_.position_epoch(epoch));
    else
      work_.run(node, epoch);
    // Long messages advance only while somebody calls MPI.
    if (ranks_.ranks() > 1 && node % 4 == 0 && ranks_.any_thread()) ranks_.progress();
    return;
  }
  if (schedule_.work(epoch) == Work::measure) return;
  const Gluing::Mode mode = gluing_mode(epoch);
  const bool single = in_single(epoch);
  const SubdomainPlace e(group);  // means nothing for collect and root
  switch (role) {
    case graph::LoopRole::work:
      return;
    case graph::LoopRole::publish:
      return gluing_.publish(e, mode, single);
    case graph::LoopRole::collect:
      return gluing_.collect(mode);
    case graph::LoopRole::root:
      return gluing_.root(mode);
    case graph::LoopRole::glue:
      return gluing_.glue(e, mode, single);
    case graph::LoopRole::take:
      return take(e, epoch);
    case graph::LoopRole::tell:
      return gluing_.tell(e, mode);
  }
}

/// Before its boundary is swept a taken copy is written by take alone. So take copies its mass to the record
/// of single precision, before the first sweep that needs it there.
void SolverLoop::take(SubdomainPlace e, int epoch) {
  if (work_.single(epoch) && !work_.single_before(epoch))
    narrow_bodies(gluing_.taken(e), state_.bodies.velocity, state_.single);
  gluing_.take(e, in_single(epoch));
}

std::optional<trace::Kind> SolverLoop::kind(std::uint32_t node, int epoch) const {
  const Work now = schedule_.work(epoch);
  const graph::LoopRole role = plan_.nodes[node].role;
  if (role == graph::LoopRole::work) return kind_of(kind_of_work(now));
  if (now == Work::measure || gluing_mode(epoch) == Gluing::Mode::local) return std::nullopt;
  return kind_of(kind_of_role(role));
}

std::optional<std::size_t> SolverLoop::subdomain_of(std::uint32_t node) const {
  const std::uint32_t group = plan_.nodes[node].group;
  return group == graph::LoopPlan::none ? std::nullopt : std::optional<std::size_t>(group);
}

bool SolverLoop::decide(int epoch) {
  if (goes_on(epoch)) return true;
  problem_.end();
  if (state_.cell.loaded()) settle_cell();
  return false;
}

bool SolverLoop::goes_on(int epoch) {
  if (schedule_.work(epoch) == Work::position) {
    positions_.end();
    return false;
  }
  if (decide_on_velocities(epoch)) return true;
  if (!positions_.wanted() || result().contacts == 0 || !std::isfinite(result().error_rms)) return false;
  positions_.begin();
  schedule_.positions_from(epoch, positions_.epochs());
  return true;
}

/// After a measure: judges the sums, or starts to gather them, and plans the next sweeps.
bool SolverLoop::measured(int epoch) {
  const bool waits = ranks_.ranks() == 1 || settles(epoch);
  schedule_.measured();
  measured_ = graph::seconds_now();
  trace::Span span(ranks_.trace(), kind_of(TaskKind::sums), 0, trace::Span::in_check);
  std::vector<double> rows = check_rows(state_, {work_.errors(), work_.cell_impulses()}, gluing_.jumps());
  span.end();
  std::vector<std::size_t> lengths(static_cast<std::size_t>(ranks_.ranks()), 0);
  for (std::int32_t rank : state_.decomposition.rank_of)
    lengths[static_cast<std::size_t>(rank)] += check_row_width(pushed_vectors(state_));
  pending_ = ranks_.start_gather(std::move(rows), lengths);
  if (waits) {
    if (!judge()) return false;
    if (ask_remedy())
      call_remedy(epoch);
    else
      schedule_.sweep_on(epoch, sweeps_ahead());
    return true;
  }
  // The fewest sweeps; the rest is planned when the result of this check is known.
  schedule_.sweep_on(epoch, std::min(least_sweeps, settings_.max_iterations - schedule_.checked()));
  schedule_.read_sums_after_next(epoch);
  return true;
}

/// After a sweep: reads the sums whose gathering was started before it, if there are any.
bool SolverLoop::swept(int epoch) {
  if (conjugate(epoch)) turn_conjugate();
  if (!schedule_.reads_sums_at(epoch)) return true;
  schedule_.sums_read();
  if (!judge())
    schedule_.restore_after(epoch);
  else if (ask_remedy())
    call_remedy(epoch);
  else
    schedule_.stretch(sweeps_ahead());
  return true;
}

void SolverLoop::turn_conjugate() {
  const std::vector<double> own = number_rows(state_, work_.changes());
  const std::vector<double> everywhere = ranks_.gather_records(std::span<const double>(own));
  courses_.turn(add_number_rows(everywhere, state_.decomposition.partition.subdomains));
}

int SolverLoop::sweeps_ahead() const {
  return sweeps_until_check(certificate_.history(), courses_.now(), certificate_.started_at(), settings_,
                            decomposition_.sweeps_per_exchange);
}

/// Judges the sums of the last measure. False: the step ends with them.
bool SolverLoop::judge() {
  const CheckSums sums =
      add_check_rows(pending_->wait(), pushed_vectors(state_), state_.decomposition.partition.subdomains);
  imbalance_ = sums.imbalance;
  for (std::size_t w = 0; w < state_.walls.size(); ++w) state_.wall_states[w].impulse = sums.wall_impulse[w];
  if (state_.domain.repeats)
    for (std::size_t k = 0; k < cell_freedoms; ++k)
      state_.cell.impulse[k] =
          sums.wall_impulse[state_.walls.size() + k / 3][static_cast<Eigen::Index>(k % 3)];
  const SweepPlan now = courses_.now().plan;
  const std::optional<SweepPlan> other = method_->after_stagnation(now);
  const Verdict verdict = certificate_.judge(sums,
                                             {.iterations = schedule_.checked(),
                                              .seconds = measured_ - began_,
                                              .plain = now.kind == SweepKind::plain,
                                              .other_ways = other.has_value(),
                                              .corrects = method_->corrects()},
                                             problem_);
  if (verdict != Verdict::go_on && verdict != Verdict::stuck) return false;
  std::optional<SweepPlan> next;
  const ErrorHistory& history = certificate_.history();
  if (verdict == Verdict::stuck) {
    certificate_.be_patient();
    next = other;
  } else if (const ErrorCheck* before = history.before_last(courses_.now().begun, settings_.check_every)) {
    next = method_->after_check(now, history.last().error_rms / before->error_rms);
  }
  if (next) {
    begin_course(*next, schedule_.checked() + 1);
    if (next->kind == SweepKind::plain) certificate_.forgive();
  }
  if (courses_.now().single && !single_will_do(courses_.now().plan.kind)) {
    courses_.go_on_in_double(schedule_.checked() + 1);
    work_.make_room();
  }
  return true;
}

bool SolverLoop::ask_remedy() {
  corrects_ = method_->corrects() && certificate_.correctable() && global_.correction_helps();
  if (corrects_) return true;
  StepView view(certificate_, problem_);
  return method_->calls_admm(view);
}

/// With several ranks, after the sweep during which the sums travelled: the result of that sweep is dropped.
void SolverLoop::call_remedy(int epoch) {
  if (ranks_.ranks() > 1) work_.restore();
  gluing_.forget_jumps();
  if (corrects_) {
    global_.correct();
    certificate_.corrected();
  } else {
    certificate_.solved_by_admm(
        global_.improve(settings_.balance_tolerance, certificate_.result().stiff_calls));
  }
  // The changes of the last sweeps say nothing of impulses that were replaced, so acceleration begins anew.
  begin_course(method_->after_admm(courses_.now().plan), schedule_.checked());
  schedule_.again_from(epoch);
}

}  // namespace talus
