#include "apps/stability_run.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <type_traits>

namespace talus::stability {

static_assert(std::is_trivially_copyable_v<Outcome>);

std::string_view name_of(Verdict verdict) {
  switch (verdict) {
    case Verdict::right:
      return "right";
    case Verdict::certified:
      return "certified";
    case Verdict::honest:
      return "honest";
    case Verdict::refused:
      return "refused";
    case Verdict::wrong:
      return "WRONG";
    case Verdict::failed:
      return "FAILED";
  }
  return "";
}

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
      : simulation_(simulation), start_(energy()), walls_(simulation.walls()) {}

  /// After a step.
  void enter() {
    const double h = simulation_.stage().time_step;
    const std::vector<WallReport> walls = simulation_.walls();
    double free = simulation_.sums().motion.energy_free;
    for (std::size_t w = 0; w < walls.size(); ++w) {
      const WallState& state = simulation_.state().wall_states[w];
      const Wall& wall = simulation_.state().walls[w];
      supplied_ += state.applied * (walls[w].position - walls_[w].position);
      if (wall.load.drive == WallDrive::velocity) supplied_ += h * walls[w].force.dot(wall.load.velocity);
      if (wall.inv_mass() > 0) free += 0.5 * state.free_velocity.squaredNorm() / wall.inv_mass();
    }
    walls_ = walls;
    scale_ = std::max(scale_, free);
    gained_ = std::max(gained_, energy() - start_ - supplied_);
  }
  double gained() const { return scale_ > 0 ? gained_ / scale_ : 0; }

 private:
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
  double start_, supplied_ = 0, gained_ = 0, scale_ = 0;
  std::vector<WallReport> walls_;
};

bool finite(const StepReport& report, const Frame& frame) {
  for (double value : {report.error_rms, report.error_max, report.balance, report.penetration_mean,
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

double certificate(const StepReport& report) {
  return std::max(report.error_rms, report.balance);
}

void run_steps(const Problem& problem, double seconds, Outcome& outcome) {
  graph::Executor executor({.threads = 1});
  Simulation simulation(problem.setup, problem.bodies, executor);
  const auto start = Clock::now();
  EnergyLedger energy(simulation);
  Frame before = simulation.frame(false);
  bool judged_any = false, stopped = false;
  std::int64_t passed = 0;
  double worst = 0, certified_before = 0;
  while (outcome.steps < problem.steps && !stopped) {
    const StepReport& report = simulation.step();
    const Frame after = simulation.frame();
    ++outcome.steps;
    outcome.iterations += report.iterations;
    outcome.penetration = std::max(outcome.penetration, report.penetration_max);
    passed += report.passed;
    energy.enter();
    outcome.energy_gained = energy.gained();
    outcome.seconds = seconds_since(start);
    if (!finite(report, after)) {
      outcome.verdict = Verdict::failed;
      return say(outcome, fmt::format("step {} left what is not a finite number", outcome.steps));
    }
    std::optional<double> error;
    if (problem.truth && (problem.truth_from_any_state || outcome.missed == 0))
      error = problem.truth({simulation, before, after});
    const double bound = problem.allowed > 0 ? problem.allowed
                                             : 2 * std::max(certificate(report) + certified_before,
                                                            problem.setup.solver.tolerance);
    if (!problem.truth_from_any_state) certified_before = certificate(report);
    const double share = error ? *error / bound : 0;
    const bool judged = error && report.converged;
    if (!(share <= worst) || (judged && !judged_any) || (!judged_any && !judged)) {
      worst = share;
      outcome.true_error = error.value_or(-1);
      outcome.error_rms = report.error_rms;
      outcome.balance = report.balance;
    }
    if (!report.converged) ++outcome.missed;
    if (judged && !(share <= 1)) {
      outcome.verdict = Verdict::wrong;
      return say(outcome, fmt::format("step {} is certified at {:.1e} and its error is {:.1e}", outcome.steps,
                                      certificate(report), *error));
    }
    judged_any = judged_any || judged;
    before = simulation.frame(false);
    stopped = outcome.seconds > seconds && outcome.steps < problem.steps;
  }
  outcome.verdict = outcome.missed > 0 || stopped ? Verdict::honest
                    : judged_any                  ? Verdict::right
                                                  : Verdict::certified;
  if (stopped)
    say(outcome,
        fmt::format("stopped after {:.0f} s, {} of {} steps", outcome.seconds, outcome.steps, problem.steps));
  else if (outcome.missed > 0)
    say(outcome, fmt::format("{} of {} steps missed the tolerance{}", outcome.missed, outcome.steps,
                             passed > 0 ? ", grains passed through what they met" : ""));
}

}  // namespace

Outcome run_scene(const Scene& scene, const RunSettings& settings) {
  Outcome outcome;
  try {
    Problem problem = scene.build();
    SolverSettings& solver = problem.setup.solver;
    if (settings.method != SolverMethod::automatic) solver.method = settings.method;
    // A truth that was computed with the scene's own settings holds for those.
    if (settings.tolerance > 0 && problem.allowed == 0 && solver.tolerance == SolverSettings{}.tolerance) {
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
