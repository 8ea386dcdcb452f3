#include "runtime/step/certificate.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "kernels/bodies/larger.hpp"

namespace talus {

void Certificate::begin(Scales scales) {
  scales_ = std::move(scales);
  result_ = {};
  history_.clear();
  wall_impulses_.clear();
  small_check_ = large_check_ = quantile_check_ = {};
  corrected_from_ = std::numeric_limits<double>::infinity();
  corrected_at_ = -1;
  exchanged_by_small_ = {};
  small_known_ = false;
  mends_ = false;
  asked_at_ = 0;
  asked_error_ = 0;
  work_at_ = -1;
  doubts_ = 0;
}

/// The error and the drift of the wall forces, and where they stand in the history.
void Certificate::measure(const CheckSums& sums) {
  const ErrorSums& error = sums.error;
  const auto count = static_cast<double>(error.contacts);
  // Forces that fade away leave velocities that rounding makes: no sweep can mend those, so they must pass.
  const double rounding =
      scales_.rounding_velocity / std::max(settings_.tolerance, thresholds_.finest_rounding);
  residual2_ = error.residual2;
  scale2_ = larger(larger(error.impulse2, error.velocity2), count * rounding * rounding);
  result_.error_rms = scale2_ != 0 ? std::sqrt(error.residual2 / scale2_) : 0;
  result_.error_max = scale2_ != 0 ? std::sqrt(error.residual_max2 * count / scale2_) : 0;
  result_.jump = sums.jump.velocity2 > 0 ? std::sqrt(sums.jump.jump2 / sums.jump.velocity2) : 0;
  work_ = error.work;
  exchanged_ = sums.exchanged;
  rounding_ = rounding;
  result_.contacts = error.contacts;
  result_.active = error.active;
}

Verdict Certificate::judge(const CheckSums& sums, const Check& check, WholeProblem& whole) {
  const Verdict verdict = verdict_on(sums, check, whole);
  if (verdict == Verdict::exhausted || verdict == Verdict::stagnated || verdict == Verdict::diverged ||
      verdict == Verdict::impossible)
    result_.worst = whole.worst_errors();
  return verdict;
}

Verdict Certificate::verdict_on(const CheckSums& sums, const Check& check, WholeProblem& whole) {
  result_.iterations = check.iterations;
  measure(sums);
  history_.add({check.iterations, result_.error_rms, check.seconds});
  wall_impulses_.push_back(sums.wall_impulse);
  result_.drift = drift();

  // Before the first sweep the drift of the walls is not known yet; only an exact solution is taken as it is.
  const bool judged = check.iterations > 0 || residual2_ == 0;
  const bool small =
      judged && result_.error_rms <= settings_.tolerance && result_.error_max <= settings_.worst_allowed();
  const bool last = check.iterations >= settings_.max_iterations;
  result_.unbalance = result_.drift;
  result_.velocity_error = result_.velocity_claim = 0;
  const bool stagnant = history_.stagnant(settings_.tolerance, thresholds_.patience, thresholds_.stagnation);
  const bool gives_up = last || (stagnant && !check.other_ways);
  // Only a step that may end pays for an answer about the whole problem.
  const bool balance = (small || last) && balanced(whole);
  result_.converged = ((small && balance) || last) && even(whole) && small && balance;
  if (gives_up && !small && !last && check.corrects && whole.small_clusters())
    result_.unbalance = small_unbalance(whole);

  if (history_.first_since_start()) first_residual2_ = std::max(residual2_, scale2_);
  const double most = thresholds_.divergence * thresholds_.divergence * first_residual2_;
  result_.diverged = check.plain && residual2_ > most;
  if (result_.diverged) return Verdict::diverged;
  result_.stagnated = false;
  if (result_.converged) return Verdict::solved;
  // A NaN fails every comparison above.
  if (std::isnan(result_.error_rms)) return Verdict::not_finite;
  if (result_.answers >= AnswerState::locked) return Verdict::impossible;
  // What sweeps do not get at, a direct solve may have found: small clusters are put right before a step is
  // given up.
  if (gives_up && check.corrects && mends_ && correctable()) return Verdict::go_on;
  result_.stagnated = stagnant && !check.other_ways;
  if (last) return Verdict::exhausted;
  if (result_.stagnated) return Verdict::stagnated;
  return stagnant ? Verdict::stuck : Verdict::go_on;
}

/// The largest impulse of a wall, got or pushed with [N s].
double Certificate::wall_scale() const {
  double scale = 0;
  for (std::size_t w = 0; w < wall_impulses().size(); ++w)
    scale = std::max({scale, wall_impulses()[w].norm(), scales_.wall_pushes[w]});
  return scale;
}

/// Of the wall impulses between two checks, relative. The largest distance on the way: what swings may just
/// pass where it came from.
double Certificate::largest_change(std::size_t from, std::size_t to) const {
  double largest = 0;
  for (std::size_t k = from; k < to; ++k)
    for (std::size_t w = 0; w < wall_impulses().size(); ++w)
      largest = std::max(largest, (wall_impulses_[to][w] - wall_impulses_[k][w]).norm());
  return largest / wall_scale();
}

double Certificate::drift() const {
  if (wall_scale() == 0) return 0;
  const std::size_t last = history_.size() - 1;
  // Since ADMM: all that sweeps changed of what it had settled.
  if (result_.stiff_calls > 0) return largest_change(history_.start(), last);
  const std::size_t half = history_.last_in(2), quarter = history_.last_in(4);
  if (half == quarter) return thresholds_.first_drift * largest_change(half, last);
  // The checks do not stand at halves and quarters.
  const double second_quarter = 0.25 * history_[last].iterations;
  const int between = history_[half].iterations - history_[quarter].iterations;
  return left_over(largest_change(half, last), largest_change(quarter, half) * second_quarter / between);
}

bool Certificate::checks_velocities(WholeProblem& whole) const {
  if (!whole.large_clusters()) return false;
  if (result_.contacts <= thresholds_.tiny) return result_.contacts > 0;
  return result_.stiff_calls > 0 || (whole.sweeps_needed() >= thresholds_.velocity_check_cost &&
                                     whole.plain_sweeps_needed() >= stiff_for(result_.contacts));
}

/// The last answer where nothing can have changed it, a guess from the residual where that is too large, else
/// a new one.
double Certificate::repeated(WholeCheck& then, double tolerance, const std::function<double(double)>& ask) {
  const int done = result_.iterations;
  // From a residual of 0 nothing is inferred.
  const double guess = then.error_rms > 0 ? then.error * result_.error_rms / then.error_rms : then.error;
  const bool due = done >= settings_.max_iterations || !(guess > tolerance) ||
                   done > thresholds_.velocity_check_growth * then.at;
  if (then.at < 0 || (then.at != done && due))
    then = {done, result_.error_rms, ask(thresholds_.velocity_resolution * tolerance)};
  return then.at == done ? then.error : guess;
}

/// Not too many contacts are far from their law, where the user has said how many that is.
bool Certificate::even(WholeProblem& whole) {
  const double tolerance = settings_.quantile_tolerance;
  if (tolerance == 0) return true;
  result_.error_quantile =
      repeated(quantile_check_, tolerance, [&](double) { return whole.quantile_error(settings_.quantile); });
  return result_.error_quantile <= tolerance;
}

bool Certificate::balanced(WholeProblem& whole) {
  const double tolerance = settings_.balance_tolerance;
  result_.unbalance = result_.velocity_error = result_.velocity_claim = 0;
  if (result_.contacts == 0) return true;
  const bool last = result_.iterations >= settings_.max_iterations;
  const int since = result_.iterations - started_at();
  if (!last && result_.stiff_calls > 0 && result_.corrections == 0 && since < thresholds_.settling) {
    result_.unbalance = std::numeric_limits<double>::infinity();
    return false;
  }
  if (whole.small_clusters() && !last && large_ask_for_more(whole)) {
    result_.unbalance = std::numeric_limits<double>::infinity();
    return false;
  }
  if (whole.small_clusters()) result_.unbalance = small_unbalance(whole);
  const bool small_ones = result_.unbalance <= small_tolerance();
  if (!small_ones && !last) return false;
  const double others = whole.large_clusters() ? large_unbalance(whole) : 0;
  result_.unbalance = larger(result_.unbalance, others);
  return small_ones && others <= tolerance && result_.velocity_error <= velocity_tolerance();
}

double Certificate::small_unbalance(WholeProblem& whole) {
  const bool last = result_.iterations >= settings_.max_iterations;
  if (doubts_ >= thresholds_.most_doubts && !last &&
      result_.iterations < thresholds_.doubt_growth * doubted_at_)
    return std::numeric_limits<double>::infinity();
  return repeated(small_check_, small_tolerance(), [&](double enough) {
    const SmallError error = whole.small_error(enough, result_.iterations);
    exchanged_by_small_ = error.exchanged;
    small_known_ = true;
    mends_ = error.mends;
    // Sweeps go on where others can still be put right.
    result_.answers = error.mends ? std::min(error.worst, AnswerState::missing) : error.worst;
    if (error.worst != AnswerState::found) {
      ++doubts_;
      doubted_at_ = result_.iterations;
    }
    return error.relative;
  });
}

/// Sweeps go on for large clusters, by what is known without a check of them. Answers about small ones, which
/// may take as long as a hundred sweeps, can wait until the step might end; but for the first in a step and
/// behind each time that they were put right: it tells what of all that is exchanged is theirs, and mends.
bool Certificate::large_ask_for_more(WholeProblem& whole) {
  if (!whole.large_clusters() || checks_velocities(whole)) return false;
  if (!small_known_) return false;
  if (!(drifting(whole) <= settings_.balance_tolerance)) return true;
  const WorkEstimate estimate = estimate_by_work(whole);
  return estimate.known && !(estimate.error <= velocity_tolerance());
}

/// Of the forces of large clusters, what the drift of the wall forces leaves to come.
double Certificate::drifting(WholeProblem& whole) {
  if (!(result_.drift <= settings_.balance_tolerance) || result_.drift == 0) return result_.drift;
  return unbalance(result_.drift, result_.iterations, whole.sweeps_needed());
}

double Certificate::large_unbalance(WholeProblem& whole) {
  if (checks_velocities(whole)) {
    const double error = repeated(large_check_, std::min(settings_.balance_tolerance, velocity_tolerance()),
                                  [&](double enough) { return whole.large_error(enough); });
    claim(larger(error, whole.velocity_errors().credible(scales_.friction) * relative_work(whole)), whole);
    return error;
  }
  const double to_come = drifting(whole);
  if (to_come <= settings_.balance_tolerance) claim(by_work(whole), whole);
  return to_come;
}

/// Contacts that slide do work that nobody's velocity lacks, so that a step is not missed for all of it. But
/// whoever believes the step is told of it, beyond the tolerance, too: checks of velocities know little of
/// sliding, and in a bed on a belt they found 0.2 of the work where 1.8 of it were missing. All of it may be
/// missing at one wall, whose force is compared with less than what contacts exchange where grains come to
/// rest: in a column that settles in a tube the floor got 2.3 times its force. A tolerance that the user has
/// set speaks of velocities, and bounds what is told of these.
void Certificate::claim(double error, WholeProblem& whole) {
  result_.velocity_error = result_.velocity_claim = error;
  if (!scales_.friction) return;
  const double told = whole.velocity_errors().reuse().told_sliding * relative_work(whole);
  if (settings_.velocity_tolerance > 0)
    result_.velocity_error = result_.velocity_claim = larger(error, told);
  else
    result_.velocity_claim = larger(error, std::min(told * exchanged_over_walls(), thresholds_.all_wrong));
}

/// Momentum that contacts of large clusters exchange, about (for grains at most, by Cauchy and Schwarz), over
/// the largest impulse of a wall; 1 where that is more, or no wall is pressed.
double Certificate::exchanged_over_walls() const {
  const double mass = std::max(0.0, exchanged_.mass - exchanged_by_small_.mass);
  const double ratio = std::sqrt(2 * mass * exchanged_by_large().counts()) / wall_scale();
  return std::isfinite(ratio) ? std::max(1.0, ratio) : 1;
}

/// The energy that the contacts of large clusters exchange, of grains and walls of finite mass [J]. No less
/// than that of their grains if they follow the fastest wall, move as fast as rounding makes them, or as a
/// part of the impulse at a wall makes all. A wall lighter than the grains counts with their mass: it gains
/// much energy by little momentum. Walls serve small clusters, too, and count by the share of the mass.
Certificate::LargeEnergy Certificate::exchanged_by_large() const {
  const double all = exchanged_.mass;
  if (!(all > 0)) return {};
  const double mass = std::max(0.0, all - exchanged_by_small_.mass);
  double of_walls = 0, pressed = 0;
  for (std::size_t w = 0; w < scales_.wall_inv_masses.size(); ++w) {
    const double impulse = wall_impulses()[w].norm();
    of_walls += 0.5 * impulse * impulse * std::min(scales_.wall_inv_masses[w], 1 / all);
    pressed = std::max(pressed, impulse);
  }
  const double speed = std::max({scales_.drive, rounding_, thresholds_.interest * pressed / all});
  return {exchanged_.energy - exchanged_by_small_.energy + of_walls * mass / all, 0.5 * mass * speed * speed};
}

/// Small clusters hide what large ones do: where theirs is most of the energy, or unknown, the rest is a
/// difference of a sum of now and one of their last check; and nobody has told what part of the impulses at
/// walls is theirs.
bool Certificate::small_hide_large(WholeProblem& whole) const {
  if (!(exchanged_by_small_.mass > 0)) return small_known_ && whole.small_clusters();
  const LargeEnergy large = exchanged_by_large();
  return exchanged_by_small_.energy > thresholds_.hiding * exchanged_.energy || large.least > large.moved;
}

/// What stands beside a large cluster must not hide its errors: each is weighed by itself, and the worst
/// speaks.
double Certificate::relative_work(WholeProblem& whole) {
  if (!whole.several_large_clusters() && !small_hide_large(whole))
    return work_ > 0 ? work_ / exchanged_by_large().counts() : 0;
  if (work_at_ != result_.iterations) {
    work_at_ = result_.iterations;
    largest_work_ = whole.large_work(rounding_, thresholds_.interest);
  }
  return largest_work_;
}

/// Slow modes of a large cluster leave small residuals at every contact and still much momentum to be
/// exchanged. The work of those residuals shows it: for the error e of the velocities sum r . H^T e is M (V -
/// V_free) . e. What it is worth in velocities a check of these tells, now and then, and is remembered.
Certificate::WorkEstimate Certificate::estimate_by_work(WholeProblem& whole) {
  const double tolerance = velocity_tolerance(), work = relative_work(whole);
  const VelocityErrorMemory& memory = whole.velocity_errors();
  if (memory.reuse().most * work <= tolerance) return {memory.reuse().most * work, true};
  const int done = result_.iterations;
  if (asked_at_ == done) return {asked_error_, true};
  const double expected =
      memory.per_work({result_.contacts, exchanged_by_large().counts()}, scales_.friction) * work;
  // At the end of a step that is missed anyhow nothing more is asked.
  const bool stuck = (done >= settings_.max_iterations && result_.error_rms <= settings_.tolerance) ||
                     done >= std::max<double>(thresholds_.doubtful, thresholds_.doubt_again * asked_at_);
  return {expected, !memory.due() && (expected <= tolerance || !stuck)};
}

double Certificate::by_work(WholeProblem& whole) {
  const WorkEstimate estimate = estimate_by_work(whole);
  if (estimate.known) return estimate.error;
  const double work = relative_work(whole);
  VelocityErrorMemory& memory = whole.velocity_errors();
  asked_at_ = result_.iterations;
  asked_error_ = whole.large_error(thresholds_.velocity_resolution * velocity_tolerance());
  memory.found({result_.contacts, exchanged_by_large().counts()}, asked_error_, work);
  asked_error_ = larger(asked_error_, memory.credible(scales_.friction) * work);
  return asked_error_;
}

bool Certificate::correctable() const {
  return small_check_.at == result_.iterations && small_check_.error > small_tolerance() &&
         result_.corrections < thresholds_.most_corrections &&
         (result_.iterations > corrected_at_ ||
          small_check_.error <= thresholds_.correction_gain * corrected_from_);
}

void Certificate::corrected() {
  corrected_from_ = small_check_.error;
  corrected_at_ = result_.iterations;
  ++result_.corrections;
  history_.start_anew();
  small_check_ = large_check_ = quantile_check_ = {};
  small_known_ = false;
  asked_at_ = 0;
  work_at_ = -1;
}

void Certificate::solved_by_admm(const BodyAdmmResult& result) {
  result_.stiff = result;
  ++result_.stiff_calls;
  history_.start_anew();
  small_check_ = large_check_ = quantile_check_ = {};
  asked_at_ = 0;
  work_at_ = -1;
  doubts_ = 0;
}

void Certificate::forgive() {
  first_residual2_ = std::max(first_residual2_, residual2_);
}

bool certified(const IterationResult& result, double momentum_defect, std::int64_t passed, double overlap,
               const SolverSettings& settings) {
  return result.converged && momentum_defect <= settings.balance_tolerance && passed == 0 &&
         overlap <= settings.overlap_tolerance;
}

}  // namespace talus
