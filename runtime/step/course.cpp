/// How a step's sweeps are carried on, and when that changes: docs/decisions/0009-methods.md, 0012-stiff.md.

#include <algorithm>
#include <cmath>
#include <limits>

#include "kernels/global/balance.hpp"
#include "runtime/step/iteration.hpp"

namespace talus {

namespace {

/// The largest beta. What a run of n sweeps can use is 1 - beta = c/n, and the tolerance says about how many
/// they will be: on packings of 16,000 grains with friction 0.92 was best to 1e-3, 0.94 to 1e-4, 0.97 to 1e-6
/// (docs/decisions/0009-methods.md). Without friction problems are easier, and 0.9 was best to 1e-6.
double most_momentum(bool friction, double tolerance) {
  if (!friction) return 0.9;
  return std::clamp(1 - 0.08 * std::pow(tolerance / 1e-3, 0.15), 0.9, 0.97);
}

/// With momentum: 4-16 % fewer sweeps than 1, and 1.3 saves no more; at 1.4 packings begin to swing
/// (docs/decisions/0009-methods.md).
constexpr double over_relaxation = 1.2;
/// With less than this conjugate gradients are faster.
constexpr double least_momentum = 0.85;
/// Between two checks; what makes it so much worse is no method for this problem.
constexpr double hopeless_growth = 4;
/// What a few sweeps solve, a grain on the ground, is left to them: they add no force that nothing asks for.
constexpr int plain_sweeps = 3;
/// What momentum makes worse shows within as many sweeps.
constexpr int trusted_sweeps = 25;

/// Plain sweeps that are many for a problem of so many contacts.
double stiff_for(std::int64_t contacts) {
  return 0.1 * static_cast<double>(contacts);
}

Carry carry_of(SolverMethod method) {
  return method == SolverMethod::nncg ? Carry::conjugate : Carry::momentum;
}

}  // namespace

/// Of a step, before its first sweep.
void Iteration::first_course() {
  result_.iterations = -1;  // the first course begins with sweep 0
  SolverMethod method = settings_.method;
  if (method == SolverMethod::automatic) {
    // Damped Schwarz is no descent: what is carried on from it need not go down.
    method = decomposition_.coupling == Coupling::schwarz && state_.decomposition.several()
                 ? SolverMethod::nlgs
                 : SolverMethod::momentum;
  }
  if (method == SolverMethod::admm) method = SolverMethod::nlgs;
  begin_course(method, method == SolverMethod::momentum
                           ? most_momentum(parameters_.friction, settings_.tolerance)
                           : 0);
  result_.iterations = 0;
}

double Iteration::beta(int epoch) const {
  const Course& now = course(epoch);
  if (now.method == SolverMethod::nncg) return conjugate_beta_;
  const int sweep = number(epoch) - now.begun - plain_sweeps;
  return sweep <= 0 ? 0 : std::min(now.most, sweep / (sweep + 3.0));
}

/// Of the normal impulses, with momentum. As long as beta is 0 sweeps are plain: they solve exactly what few
/// sweeps solve.
double Iteration::omega(int epoch) const {
  return beta(epoch) > 0 ? over_relaxation : 1;
}

void Iteration::begin_course(SolverMethod method, double most) {
  course_before_ = course_;
  const int from = result_.iterations + 1;
  course_ = {method, from, from, most, single_will_do(method)};
  // A sweep that is on its way, with several ranks, belongs to the course before and keeps its beta.
  if (method == SolverMethod::nncg) conjugate_beta_ = change2_ = 0;
  if (method == SolverMethod::nlgs) return;
  if (course_.single) allocate(state_.single, state_.contacts, state_.bodies.size());
  allocate(acceleration_, carry_of(method), state_.contacts, course_.single ? 0 : state_.bodies.size(),
           state_.chunks.size());
  changes_.assign(method == SolverMethod::nncg ? state_.chunks.size() : 0, 0);
}

/// Whether sweeps in single precision make the error of this problem smaller as those in double do. Not where
/// it is small already, or bodies are so heavy that single sweeps would not move them. Small problems have no
/// time to gain.
bool Iteration::single_will_do(SolverMethod method) const {
  constexpr double least_error = 1e-5, many = 1000;
  const bool schwarz = decomposition_.coupling == Coupling::schwarz && state_.decomposition.several();
  return method == SolverMethod::momentum && settings_.precision == Precision::mixed && !schwarz && alike() &&
         candidates_everywhere_ >= many && (history_.empty() || history_.back().error_rms > least_error);
}

/// The present course, behind the sweep that may have been made since.
void Iteration::go_on_in_double() {
  course_before_ = course_;
  course_.from = result_.iterations + 1;
  course_.single = false;
  allocate(acceleration_, Carry::momentum, state_.contacts, state_.bodies.size(), state_.chunks.size());
}

/// Brings a chunk's contacts, and the bodies that it is the first to write, to where its sweep looks for
/// them. Behind a check velocities and impulses are in double precision; what goes on with momentum changes
/// behind the sweep that follows the check (least_sweeps), and takes it along.
void Iteration::change_precision(std::size_t c, ContactRange range, int epoch) {
  SingleState& single = state_.single;
  std::span<Velocity> velocity = state_.bodies.velocity;
  const bool first = epoch == sweeps_from_, now = course(epoch).single,
             before = number(epoch) > 0 && course(epoch - 1).single;
  if (now) {
    if (!before) narrow_geometry(state_.contacts, range, single.contacts);
    if (!first && before) return;
    narrow_impulses(state_.contacts, range, single.contacts);
    narrow_bodies(owned(c), velocity, single);
    if (first) fasten(owned(c), single.velocity, single.last_v);
    return;
  }
  if (first || !before) {
    if (first && course(epoch).method != SolverMethod::nlgs)
      fasten(owned(c), state_.bodies.velocity, acceleration_.last_v);
    return;
  }
  widen_impulses(single.contacts, range, state_.contacts);
  widen_bodies(owned(c), single.velocity, velocity);
  const bool goes_on = course(epoch).method == SolverMethod::momentum && number(epoch) > course(epoch).begun;
  if (!goes_on) return;
  for (const Slot slot : owned(c))
    acceleration_.last_v[static_cast<std::size_t>(slot)] = velocity[static_cast<std::size_t>(slot)];
  widen_bodies(owned(c), single.last_v, acceleration_.last_v);
  widen_steps(single.contacts.unit, range, acceleration_.steps);
}

std::span<const Slot> Iteration::owned(std::size_t c) const {
  const auto from = static_cast<std::size_t>(state_.chunks.owned_begin[c]),
             to = static_cast<std::size_t>(state_.chunks.owned_begin[c + 1]);
  return std::span(state_.chunks.owned).subspan(from, to - from);
}

/// The start of a sweep moves on along the acceleration: the chunk's impulses, with momentum within the sweep
/// itself, the bodies that it is the first to write, and its wall copy.
void Iteration::carry_on(std::size_t c, ContactRange range, int epoch) {
  const Chunks& chunks = state_.chunks;
  const Carry carry = carry_of(course(epoch).method);
  const double beta = this->beta(epoch);
  if (carry == Carry::conjugate)
    carry_impulses(beta, range, state_.contacts, acceleration_);
  else if (number(epoch) == course(epoch).begun)
    begin_steps(range, acceleration_.steps);
  const bool at_wall = chunks.wall[c] >= 0;
  if (epoch == sweeps_from_ && at_wall) fasten(c, state_.copies[c], acceleration_);
  if (course(epoch).single)
    carry_velocities(kernels_, beta, owned(c), state_.single.velocity, state_.single.last_v);
  else
    carry_velocities(kernels_, carry, beta, owned(c), state_.bodies.velocity, acceleration_);
  if (at_wall) carry_wall(carry, beta, c, state_.copies[c], acceleration_);
}

/// The last check that tells something about the present course besides the newest: at least check_every
/// sweeps before it, since errors of neighbouring sweeps go up and down. Null when there is none.
const Iteration::Check* Iteration::check_before() const {
  for (std::size_t k = history_.size() - 1; k-- > history_from_;) {
    if (history_[k].iterations + 1 < course_.begun) return nullptr;
    if (history_[k].iterations + settings_.check_every <= history_.back().iterations) return &history_[k];
  }
  return nullptr;
}

/// The second half of the sweeps has found no error a twentieth smaller than the quarter before it. Plain
/// sweeps, the slowest, take a third off in as many; what comes before is the start's, or ADMM's.
bool Iteration::stagnant() const {
  constexpr int patience = 1000;
  const std::size_t first = std::max(history_from_, patience_from_);
  const int from = history_[first].iterations, done = history_.back().iterations - from;
  if (done < patience) return false;
  double quarter = std::numeric_limits<double>::infinity(), half = quarter;
  for (std::size_t k = first; k < history_.size(); ++k) {
    const int at = history_[k].iterations - from;
    if (4 * at < done) continue;
    double& best = 2 * at < done ? quarter : half;
    best = std::min(best, history_[k].error_rms);
  }
  return half > settings_.tolerance && half > 0.95 * quarter;
}

/// Sweeps done when those that count began: ADMM is a new start.
int Iteration::started_at() const {
  return result_.stiff_calls == 0 ? 0 : history_[history_from_].iterations;
}

/// Until the next check: where the tolerance will be met if the error goes on as a power of the sweeps done,
/// which is what momentum does in the beginning, and later errs to the short side of what exponentials need
/// by little. A wrong guess costs no more than half of what was done; with momentum as much again, but few.
int Iteration::sweeps_ahead() const {
  const int start = started_at();
  const int done = result_.iterations - start;
  int sweeps = course_.method == SolverMethod::momentum
                   ? std::clamp(done, settings_.check_every, std::max(trusted_sweeps, settings_.check_every))
                   : std::max(settings_.check_every, done / 2);
  const double error = history_.back().error_rms;
  const Check* const before = check_before();
  if (before && error > settings_.tolerance && error < before->error_rms) {
    const double log_error = std::log(before->error_rms / error),
                 log_missing = std::log(error / settings_.tolerance);
    const int then = before->iterations - start;
    const double to_go = then > 0 ? done * std::expm1(log_missing / log_error * std::log(double(done) / then))
                                  : done * log_missing / log_error;
    sweeps = static_cast<int>(std::ceil(std::min<double>(sweeps, to_go)));
  }
  sweeps = std::max(least_sweeps, sweeps);
  const int exchange = decomposition_.sweeps_per_exchange;
  sweeps = (sweeps + exchange - 1) / exchange * exchange;
  return std::min(sweeps, settings_.max_iterations - result_.iterations);
}

/// The sweeps behind the check of this epoch: `sweeps_` done.
void Iteration::plan_sweeps(int epoch, int sweeps) {
  before_segment_ = result_.iterations;
  sweeps_ = before_segment_ + sweeps;
  sweeps_from_ = epoch + 1;
  segment_ = epoch + 1 + sweeps;
}

/// To plain sweeps. What the course before has made worse is not held against them.
void Iteration::give_way() {
  begin_course(SolverMethod::nlgs, 0);
  first_residual2_ = std::max(first_residual2_, total_.residual2);
}

/// After a check: momentum that ADMM has interrupted is taken up again; what has made it worse begins anew
/// with less, which also ends what it swings by; when little is left, `automatic` takes conjugate gradients.
/// What fails altogether gives way to plain sweeps.
void Iteration::choose_course() {
  const Check* const before = check_before();
  if (!before) return;
  if (course_.method == SolverMethod::nlgs && course_.most > 0) {
    begin_course(SolverMethod::momentum, course_.most);
    return;
  }
  const double growth = history_.back().error_rms / before->error_rms;
  if (course_.method == SolverMethod::momentum && growth > 1) {
    const double less = 1 - 2 * (1 - course_.most);
    if (growth < hopeless_growth && less < least_momentum && settings_.method == SolverMethod::automatic)
      begin_course(SolverMethod::nncg, 0);
    else if (less > 0 && growth < hopeless_growth)
      begin_course(SolverMethod::momentum, less);
    else
      give_way();
  } else if (course_.method == SolverMethod::nncg && growth > hopeless_growth) {
    give_way();
  }
}

std::vector<double> Iteration::carrying_walls() const {
  std::vector<double> carrying;
  for (std::size_t w = 0; w < state_.walls.size(); ++w)
    carrying.push_back(impulses_.back()[w] != Vec3::Zero() ? state_.walls[w].inv_mass() : -1);
  return carrying;
}

/// Whether what an earlier step has found out of how stiff it is goes for this one too: far from stiff, as
/// many contacts, at the same walls. A grain that has got new neighbours since may have landed, which changes
/// the answer by no more than the ratio of masses; when all have moved on ten times, nothing is known.
bool Iteration::stiffness_holds() const {
  constexpr int most_renewals = 10;
  const std::int64_t then = stiffness_.contacts, now = result_.contacts;
  const double could = stiffness_.sweeps_needed * (stiffness_.renewals > 0 ? spread_ : 1);
  return alike() && stiffness_.renewals <= most_renewals && stiffness_.sweeps_needed >= 0 &&
         2 * could < stiff_for(now) && 20 * std::abs(now - then) <= then &&
         stiffness_.carrying == carrying_walls();
}

/// About the sweeps of the present course that this step's problem takes. Collective.
double Iteration::sweeps_needed() {
  if (sweeps_needed_ < 0) {
    // To find out takes as long as ten sweeps, and two messages for each layer of grains.
    if (!stiffness_holds()) stiffness_ = {admm_.sweeps_needed(), result_.contacts, carrying_walls(), 0};
    sweeps_needed_ = stiffness_.sweeps_needed;
  }
  // A column of 100: 37,912 sweeps, with momentum 1/19 = (1 - beta)/(1 + beta) of it, with NNCG 964.
  const double speed = course_.method == SolverMethod::momentum ? (1 + course_.most) / (1 - course_.most)
                       : course_.method == SolverMethod::nncg   ? 40
                                                                : 1;
  return sweeps_needed_ / speed;
}

/// Whether this step's velocities are looked at as a whole: where that costs less than the sweeps that it may
/// save, in problems that are stiff for their size; and in tiny ones.
bool Iteration::looks_at_all() {
  constexpr double cost = 100;
  constexpr std::int64_t tiny = 64;
  if (result_.stiff_calls > 0) return true;
  if (result_.contacts <= tiny) return result_.contacts > 0;
  return sweeps_needed() >= cost && sweeps_needed_ >= stiff_for(result_.contacts);
}

/// Judges the forces that walls and heavy bodies get. By the drift of wall forces, which sweeps show; or by
/// the error of all velocities, which decides by itself. That is asked for again when the residual has fallen
/// far enough, or a quarter more sweeps are done.
bool Iteration::balanced() {
  const double tolerance = settings_.balance_tolerance;
  result_.unbalance = result_.drift;
  if (!looks_at_all()) {
    if (result_.drift > 0 && result_.drift <= tolerance)
      result_.unbalance = unbalance(result_.drift, result_.iterations, sweeps_needed());
    return result_.unbalance <= tolerance;
  }
  const bool last = result_.iterations >= settings_.max_iterations;
  // Behind ADMM sweeps still mend much, and a look costs as much as a hundred.
  constexpr int settling = 50;
  if (!last && result_.stiff_calls > 0 && result_.iterations - started_at() < settling) {
    result_.unbalance = std::numeric_limits<double>::infinity();
    return false;
  }
  // From a residual of 0 nothing is inferred.
  const double guess =
      looked_.error_rms > 0 ? looked_.error * result_.error_rms / looked_.error_rms : looked_.error;
  if (looked_.at < 0 || (looked_.at != result_.iterations &&
                         (last || !(guess > tolerance) || 4 * result_.iterations > 5 * looked_.at)))
    looked_ = {result_.iterations, result_.error_rms, admm_.velocity_error(0.2 * tolerance)};
  result_.unbalance = looked_.at == result_.iterations ? looked_.error : guess;
  return result_.unbalance <= tolerance;
}

/// `automatic` asks for ADMM when sweeps, having had their chance, left the forces out of balance, and would
/// take longer than ADMM to balance them, or have, where all velocities are looked at. Whatever it leaves
/// undone it is asked for again, ever later.
bool Iteration::ask_admm() {
  constexpr int chance = 50, calls = 3;
  if (settings_.method == SolverMethod::admm && result_.stiff_calls == 0) return true;
  const bool may = settings_.method == SolverMethod::admm || settings_.method == SolverMethod::automatic;
  if (!may) return false;
  if (result_.stiff_calls == calls) return false;
  const int since = result_.iterations - started_at();
  return since >= chance << (2 * result_.stiff_calls) &&
         (settings_.method == SolverMethod::admm || sweeps_needed() >= stiff ||
          (since >= stiff && looks_at_all())) &&
         !balanced();
}

/// With several ranks behind the sweep that hid the sums: what it did is dropped.
void Iteration::call_admm(int epoch) {
  if (ranks_.ranks() > 1)
    for (std::size_t c = 0; c < state_.chunks.size(); ++c)
      restore_impulses(state_.candidates, state_.chunks, c, state_.contacts);
  sweeps_ = result_.iterations;
  gluing_.forget_jumps();
  result_.stiff = admm_.improve(settings_.balance_tolerance, result_.stiff_calls++);
  history_from_ = history_.size();
  looked_ = {};
  // Anew from the next sweep on: what the last sweeps changed says nothing of where ADMM has gone. Plain ones
  // first: ADMM leaves light bodies behind, and momentum throws them at the heavy ones that it has settled.
  begin_course(course_.method == SolverMethod::momentum ? SolverMethod::nlgs : course_.method, course_.most);
  course_.from = course_.begun = result_.iterations;
  before_segment_ = sweeps_;
  sweeps_from_ = segment_ = epoch + 1;
}

}  // namespace talus
