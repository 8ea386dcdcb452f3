#include "apps/study_stability/stability_run.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <string>
#include <type_traits>

namespace talus::stability {

static_assert(std::is_trivially_copyable_v<Outcome>);

namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

void say(Outcome& outcome, std::string why) {
  std::replace(why.begin(), why.end(), '\n', ' ');
  const std::size_t length = std::min(why.size(), outcome.why.size() - 1);
  std::copy_n(why.data(), length, outcome.why.data());
  outcome.why[length] = 0;
}

/// Energy of grains and walls, and what the loads put into them.
class EnergyLedger {
 public:
  explicit EnergyLedger(const Simulation& simulation)
      : simulation_(simulation), energy_(energy()), walls_(simulation.walls()) {}

  /// After a step: what it gained that no load supplied, over the kinetic energy that it would have reached
  /// without contacts.
  double enter() {
    const double h = simulation_.stage().time_step, before = energy_;
    const std::vector<WallReport> walls = simulation_.walls();
    double supplied = 0, free = simulation_.sums().motion.energy_free;
    for (std::size_t w = 0; w < walls.size(); ++w) {
      const WallState& state = simulation_.state().wall_states[w];
      const Wall& wall = simulation_.state().walls[w];
      supplied += state.applied * (walls[w].position - walls_[w].position);
      if (wall.load.drive == WallDrive::velocity) supplied += h * walls[w].force.dot(wall.load.velocity);
      if (wall.inv_mass() > 0) free += 0.5 * state.free_velocity.squaredNorm() / wall.inv_mass();
    }
    walls_ = walls;
    energy_ = energy();
    const double gained = energy_ - before - supplied;
    return gained > rounding * std::abs(before) ? gained / free : 0;
  }

 private:
  static constexpr double rounding = 1e-12;

  double energy() const {
    const Bodies& bodies = simulation_.state().bodies;
    const Decomposition& all = simulation_.state().decomposition;
    double sum = 0;
    for (std::size_t s = 0; s < bodies.size(); ++s) {
      if (!counts(all, s)) continue;
      const Velocity body = whole_velocity(all, bodies, s);
      const KineticEnergy kinetic = kinetic_energy(std::span<const Velocity>(&body, 1));
      sum += kinetic.translation + kinetic.rotation -
             simulation_.stage().gravity.dot(bodies.x[s]) / body.inv_mass;
    }
    for (const Wall& wall : simulation_.state().walls)
      if (wall.inv_mass() > 0) sum += 0.5 * wall.velocity.squaredNorm() / wall.inv_mass();
    return sum;
  }

  const Simulation& simulation_;
  double energy_;
  std::vector<WallReport> walls_;
};

bool finite(const StepReport& report, const Frame& frame) {
  for (double value :
       {report.error_rms, report.error_max, report.balance, report.velocity_error, report.penetration_mean,
        report.penetration_max, report.kinetic_translation, report.kinetic_rotation})
    if (!std::isfinite(value)) return false;
  const auto all_finite = [](const std::vector<Vec3>& values) {
    return std::all_of(values.begin(), values.end(), [](const Vec3& v) { return v.allFinite(); });
  };
  for (const WallReport& wall : frame.walls)
    if (!std::isfinite(wall.position) || !std::isfinite(wall.velocity) || !wall.force.allFinite())
      return false;
  return all_finite(frame.x) && all_finite(frame.u) && all_finite(frame.omega) &&
         all_finite(frame.contact_force);
}

/// How far a step begins from rest where the sample began, over the impulse of the loads: what moves is
/// stopped, and the gaps that it has opened by the middle of the step are fallen into.
double distance_from_start(const Problem& problem, const StepView& step, const Frame& start) {
  const double h = step.time_step();
  double moved = 0, load = 0;
  for (std::size_t k = 0; k < start.x.size(); ++k) {  // ids count from 0: the order of frames
    const Vec3& u = step.before.u[k];
    moved += problem.bodies.mass(k) * (u.norm() + (step.before.x[k] + h / 2 * u - start.x[k]).norm() / h);
    load += problem.bodies.mass(k) * step.gravity().norm();
  }
  for (std::size_t w = 0; w < start.walls.size(); ++w) {
    const double inv_mass = problem.setup.walls[w].inv_mass(), v = step.before.walls[w].velocity;
    const double gone = step.before.walls[w].position + h / 2 * v - start.walls[w].position;
    if (inv_mass > 0) moved += (std::abs(v) + std::abs(gone) / h) / inv_mass;
    load += std::abs(step.simulation.state().wall_states[w].applied);
  }
  return moved / (h * load);
}

/// Why a row without a step that missed is no more than certified.
std::string reservations(const Truth& truth, const Outcome& outcome, const std::string& growth) {
  std::string why;
  if (truth.error && outcome.judged < outcome.steps)
    why = fmt::format("{} of {} steps judged: {}", outcome.judged, outcome.steps, truth.lacks);
  if (!why.empty() && !growth.empty()) why += "; ";
  return why + growth;
}

void run_steps(const Problem& problem, double seconds, Outcome& outcome) {
  graph::Executor executor({.threads = 1});
  Simulation simulation(problem.setup, problem.bodies, executor);
  const Truth& truth = problem.truth;
  const double tolerance = problem.setup.solver.tolerance;
  // Newton's law makes energy, and to lift a grain out of another is work.
  const bool energy_bounded = (problem.setup.solver.restitution_law == RestitutionLaw::moreau ||
                               simulation.stage().laws.largest(&PairLaw::restitution) == 0) &&
                              problem.setup.solver.overlap_correction == 0;
  EnergyLedger energy(simulation);
  const Frame at_start = simulation.frame(false);
  Frame before = at_start;
  bool any_truth = false, stopped = false;
  std::int64_t passed = 0;
  double worst = 0;
  std::string growth;
  while (outcome.steps < problem.steps && !stopped) {
    std::optional<SavedState> saved;
    if (!simulation.state().decomposition.several()) saved = simulation.save();
    const auto start = Clock::now();
    const StepReport& report = simulation.step();
    outcome.seconds += seconds_since(start);
    Frame after = simulation.frame();
    ++outcome.steps;
    outcome.iterations += report.iterations;
    outcome.penetration = std::max(outcome.penetration, report.penetration_max);
    passed += report.passed;
    if (!finite(report, after)) {
      outcome.verdict = Verdict::failed;
      return say(outcome, fmt::format("step {} left what is not a finite number", outcome.steps));
    }
    const double certified = std::max(report.error_rms, report.balance);
    const double gained = energy.enter(), may_gain = 4 * std::max(certified, tolerance);
    outcome.energy_gained = std::max(outcome.energy_gained, gained);
    if (energy_bounded && gained > may_gain && growth.empty())
      growth = fmt::format("step {} gained {:.1e} of energy, its certificate allows {:.1e}", outcome.steps,
                           gained, may_gain);
    const StepView view{simulation, saved, before, after};
    std::optional<double> error;
    if (truth.error && (truth.from == TruthFrom::any_state || outcome.missed == 0)) error = truth.error(view);
    // What is told beyond what steps are swept for would excuse anything.
    const double velocities =
        std::min(report.velocity_error, simulation.setup().solver.velocity_allowed(true));
    double bound = problem.allowed > 0 ? problem.allowed : 2 * std::max({certified, velocities, tolerance});
    if (truth.from == TruthFrom::rest) bound += distance_from_start(problem, view, at_start);
    const double share = error ? *error / bound : 0;
    if (!any_truth || !(share <= worst)) {
      worst = share;
      outcome.true_error = error.value_or(-1);
      outcome.error_rms = report.error_rms;
      outcome.balance = report.balance;
    }
    any_truth = any_truth || error;
    if (!report.converged)
      ++outcome.missed;
    else if (error)
      ++outcome.judged;
    if (error && report.converged && !(share <= 1)) {
      outcome.verdict = Verdict::wrong;
      return say(outcome, fmt::format("step {} is certified at {:.1e} and its error is {:.1e}", outcome.steps,
                                      certified, *error));
    }
    before = std::move(after);
    stopped = outcome.seconds > seconds && outcome.steps < problem.steps;
  }
  const bool all_known = outcome.judged == outcome.steps && growth.empty();
  outcome.verdict = outcome.missed > 0 || stopped ? Verdict::honest
                    : all_known                   ? Verdict::right
                                                  : Verdict::certified;
  if (stopped)
    say(outcome,
        fmt::format("stopped after {:.0f} s, {} of {} steps", outcome.seconds, outcome.steps, problem.steps));
  else if (outcome.missed > 0)
    say(outcome, fmt::format("{} of {} steps missed the tolerance{}", outcome.missed, outcome.steps,
                             passed > 0 ? ", grains passed through what they met" : ""));
  else
    say(outcome, reservations(truth, outcome, growth));
}

}  // namespace

bool as_expected(const Scene& scene, const Outcome& outcome, const RunSettings& settings) {
  if (settings.method != SolverMethod::automatic || settings.tolerance > 0)
    return outcome.verdict != Verdict::wrong && outcome.verdict != Verdict::failed;
  return std::find(scene.expected.begin(), scene.expected.end(), outcome.verdict) != scene.expected.end();
}

Outcome run_scene(const Scene& scene, const RunSettings& settings) {
  Outcome outcome;
  try {
    Problem problem = scene.build();
    SolverSettings& solver = problem.setup.solver;
    if (settings.method != SolverMethod::automatic) solver.method = settings.method;
    if (settings.tolerance > 0 && solver.tolerance == SolverSettings{}.tolerance) {
      solver.tolerance = settings.tolerance;
      solver.balance_tolerance = 50 * settings.tolerance;
    }
    run_steps(problem, settings.seconds, outcome);
  } catch (const std::invalid_argument& error) {
    outcome.verdict = Verdict::refused;
    say(outcome, error.what());
  } catch (const RunawayError& error) {
    outcome.verdict = Verdict::refused;
    say(outcome, error.what());
  } catch (const std::exception& error) {
    outcome.verdict = Verdict::failed;
    say(outcome, error.what());
  }
  return outcome;
}

Outcome run_scene_apart(const Scene& scene, const RunSettings& settings) {
  int ends[2];
  if (pipe(ends) != 0) throw std::runtime_error("no pipe to the process of a scene");
  const pid_t child = fork();
  if (child < 0) throw std::runtime_error("no process for a scene");
  if (child == 0) {
    close(ends[0]);
    const Outcome outcome = run_scene(scene, settings);
    const ssize_t written = write(ends[1], &outcome, sizeof outcome);  // below PIPE_BUF: whole or not at all
    _exit(written == static_cast<ssize_t>(sizeof outcome) ? 0 : 1);
  }
  close(ends[1]);
  Outcome outcome;
  pollfd answer{ends[0], POLLIN, 0};
  const double patience = 2 * settings.seconds + 10;
  const bool answered = poll(&answer, 1, static_cast<int>(1e3 * patience)) > 0;
  if (!answered) {
    kill(child, SIGKILL);
    outcome.seconds = patience;
    say(outcome, fmt::format("hangs: ended by force after {:.0f} s", patience));
  }
  const bool whole =
      answered && read(ends[0], &outcome, sizeof outcome) == static_cast<ssize_t>(sizeof outcome);
  close(ends[0]);
  int status = 0;
  waitpid(child, &status, 0);
  if (answered && !whole) {
    outcome = {};
    say(outcome, WIFSIGNALED(status) ? fmt::format("crashed with signal {}", WTERMSIG(status))
                                     : fmt::format("ended with code {}", WEXITSTATUS(status)));
  }
  return outcome;
}

}  // namespace talus::stability
