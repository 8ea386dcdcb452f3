#include "apps/commands/plan_measure.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <functional>
#include <limits>

#include "apps/shared/median.hpp"
#include "apps/shared/print.hpp"
#include "apps/shared/sample_builder.hpp"
#include "runtime/step/decomposition.hpp"
#include "runtime/step/simulation.hpp"
#include "runtime/step/time_step.hpp"

namespace talus {

namespace {

constexpr int sweeps_measured = 400, sweeps_between_checks = 50;
constexpr double friction_put_in = 0.35;
constexpr int subdomains_put_in = 8;

struct Cost {
  double ns = 0;     ///< of a sweep, per contact
  double bytes = 0;  ///< held, per contact
  MessageCount messages;
  double contacts = 0;
};

/// Plain sweeps over the first step, and nothing but them; the time is that of the fastest stretch between
/// two checks, since others who use the cores can only make it longer.
Cost sweep_first_step(Setup setup, const Bodies& bodies, graph::Executor& executor) {
  setup.solver.method = SolverMethod::nlgs;
  setup.solver.tolerance = std::numeric_limits<double>::min();
  setup.solver.max_iterations = sweeps_measured;
  setup.solver.check_every = sweeps_between_checks;
  Simulation simulation(setup, bodies, executor);
  const StepReport& report = simulation.step();
  Cost cost;
  cost.contacts = static_cast<double>(std::max<std::int64_t>(report.contacts, 1));
  const std::vector<ErrorCheck>& checks = simulation.error_history();
  double fastest = checks.size() > 1 ? std::numeric_limits<double>::infinity() : 0;
  for (std::size_t k = 1; k < checks.size(); ++k)
    fastest = std::min(fastest, (checks[k].seconds - checks[k - 1].seconds) /
                                    (checks[k].iterations - checks[k - 1].iterations));
  cost.ns = 1e9 * fastest / cost.contacts;
  cost.bytes = static_cast<double>(memory_used(simulation.state())) / cost.contacts;
  cost.messages = simulation.messages();
  return cost;
}

/// Time of sending and taking a message of `bytes` bytes to oneself [s].
double message_seconds(std::size_t bytes, const graph::Communicator& ranks) {
  constexpr int turns = 200;
  std::vector<double> out(std::max<std::size_t>(bytes / sizeof(double), 1)), in(out.size());
  const auto receive = ranks.open_receive(ranks.rank(), graph::Communicator::first_tag, in),
             send = ranks.open_send(ranks.rank(), graph::Communicator::first_tag, out);
  std::vector<double> seconds;
  for (int k = 0; k < turns; ++k) {
    const auto start = std::chrono::steady_clock::now();
    receive->start();
    send->start();
    receive->wait();
    send->wait();
    seconds.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  return median(std::move(seconds));
}

/// The scene's first stage in several forms.
class Forms {
 public:
  Forms(const io::Scene& scene, const Bodies& bodies) : base_(scene.setup) {
    for (const auto& [name, load] : base_.stages.front().loads)
      for (Wall& wall : base_.walls)
        if (wall.name == name) wall.load = load;
    base_.stages.resize(1);
    base_.stages.front().loads.clear();
    base_.stages.front().end = {};
    base_.stages.front().end.steps = 1;
    // One form must not differ from another in what is not its point.
    base_.decomposition.balance = BalanceBy::contacts;
    for (std::size_t k = 0; k < bodies.size(); ++k) {
      mass_ += bodies.mass(k);
      smallest_ = std::min(smallest_, bodies.radius[k]);
    }
  }

  Setup friction(bool in) const {
    Setup setup = base_;
    PairTable& laws = setup.stages.front().laws;
    if (!in) {
      laws.set_all(&PairLaw::friction, 0);
      laws.set_all(&PairLaw::rolling_resistance, 0);  // nothing rolls without friction
    } else if (laws.largest(&PairLaw::friction) == 0)
      laws.between(material_of_grains, material_of_grains).friction = friction_put_in;
    return setup;
  }
  const Setup& as_it_is() const { return base_; }
  Setup rotation(bool in) const {
    Setup setup = friction(true);
    setup.rotation = in;
    return setup;
  }
  static bool may_be_pushed(const Wall& wall) { return wall.surface() == nullptr && wall.motion.empty(); }
  Setup pushed_walls(bool in) const {
    Setup setup = base_;
    const bool any = has_pushed_walls();
    for (Wall& wall : setup.walls) {
      // Still pressing, or there would be nothing to solve: a hundredth of the smallest radius in the step.
      if (!in && wall.load.pushed())
        wall.load = {.drive = WallDrive::velocity,
                     .velocity = 0.01 * smallest_ / first_time_step(setup) * wall.normal};
      if (in && !any && may_be_pushed(wall))
        wall.load = {.drive = WallDrive::force, .force = 9.81 * mass_, .mass = 0.1 * mass_};
    }
    return setup;
  }
  Setup subdomains(bool in) const {
    Setup setup = base_;
    setup.decomposition = with_subdomains(setup.decomposition, in ? several() : 1);
    return setup;
  }

  bool has_friction() const { return base_.stages.front().laws.largest(&PairLaw::friction) > 0; }
  bool has_rotation() const { return has_friction() && base_.rotation; }
  bool has_pushed_walls() const {
    return std::ranges::any_of(base_.walls, [](const Wall& wall) { return wall.load.pushed(); });
  }
  bool has_subdomains() const { return base_.decomposition.subdomains > 1; }
  bool has_walls() const { return std::ranges::any_of(base_.walls, may_be_pushed); }

 private:
  double first_time_step(const Setup& setup) const {
    const Stage& first = setup.stages.front();
    return first.chooses_time_step ? time_step_bounds(first, setup.solver, smallest_).longest
                                   : first.time_step;
  }
  int several() const { return has_subdomains() ? base_.decomposition.subdomains : subdomains_put_in; }

  Setup base_;
  double mass_ = 0;                                            ///< of the grains [kg]
  double smallest_ = std::numeric_limits<double>::infinity();  ///< radius [m]
};

/// The fastest of each, in turns, so that a busy moment of the machine meets both.
std::pair<Cost, Cost> compare(const std::pair<Setup, graph::Executor&>& with,
                              const std::pair<Setup, graph::Executor&>& without, const Bodies& bodies,
                              int repeats) {
  std::pair<Cost, Cost> best;
  for (int k = 0; k < repeats; ++k) {
    const Cost a = sweep_first_step(with.first, bodies, with.second),
               b = sweep_first_step(without.first, bodies, without.second);
    if (k == 0 || a.ns < best.first.ns) best.first = a;
    if (k == 0 || b.ns < best.second.ns) best.second = b;
  }
  return best;
}

}  // namespace

std::vector<MeasuredSaving> measure_savings(const io::Scene& scene, int threads, int repeats,
                                            const graph::Communicator& ranks) {
  io::Scene turning = scene;  // Simulation takes spins away, but gives none
  turning.setup.rotation = true;
  Bodies bodies;
  append(build_sample(turning), bodies);
  const Forms forms(scene, bodies);
  graph::Executor executor({.threads = threads});
  if (bodies.size() == 0 || sweep_first_step(forms.as_it_is(), bodies, executor).ns == 0)
    throw NothingToMeasure(
        "--measure: nothing is swept in the first step, as no grains press one another or a wall there: "
        "begin "
        "from a state in which they do ([sample] kind = \"state\")");
  std::vector<MeasuredSaving> savings;
  const auto add = [&](const char* part, bool in_scene, Setup (Forms::*form)(bool) const) {
    const auto [with, without] =
        compare({(forms.*form)(true), executor}, {(forms.*form)(false), executor}, bodies, repeats);
    savings.push_back({part, in_scene, with.ns, without.ns, with.bytes, without.bytes});
    return with;
  };
  add("friction", forms.has_friction(), &Forms::friction);
  add("rotation, with friction", forms.has_rotation(), &Forms::rotation);
  if (forms.has_walls()) add("pushed walls", forms.has_pushed_walls(), &Forms::pushed_walls);
  const Cost cut = add("several subdomains", forms.has_subdomains(), &Forms::subdomains);

  // A rank of its own for every subdomain: each message is sent and taken once an iteration.
  const double count = static_cast<double>(cut.messages.messages);
  if (count > 0) {
    const double each =
        message_seconds(static_cast<std::size_t>(cut.messages.bytes / cut.messages.messages), ranks);
    const double bytes = 2 * static_cast<double>(cut.messages.bytes) / cut.contacts;  // kept by both sides
    savings.push_back({"a rank per subdomain", false,
                       savings.back().with_ns + 1e9 * each * count / cut.contacts, savings.back().with_ns,
                       savings.back().with_bytes + bytes, savings.back().with_bytes});
  }

  // Recorded, and thrown away instead of written.
  trace::RecorderOptions recording{.threads = threads, .sink = [](trace::Block&&) {}};
  const std::size_t buffers = recording.block * sizeof(trace::Record) * static_cast<std::size_t>(threads);
  trace::Recorder recorder(std::move(recording));
  graph::Executor traced({.threads = threads, .trace = &recorder});
  const Setup base = forms.subdomains(forms.has_subdomains());
  const auto [with, without] = compare({base, traced}, {base, executor}, bodies, repeats);
  savings.push_back({"trace", false, with.ns, without.ns,
                     without.bytes + static_cast<double>(buffers) / without.contacts, without.bytes});
  return savings;
}

void print_savings(const std::vector<MeasuredSaving>& savings, int threads, int repeats) {
  print_out(
      "\nmeasured here: plain sweeps over the first step, {} thread{}, fastest stretch of {} x {} sweeps\n",
      threads, threads == 1 ? "" : "s", repeats, sweeps_measured);
  print_out("  {:<26}{:<7}{:>10}{:>10}{:>9}   {:>9}{:>10}{:>9}\n", "", "in the", "ns a", "contact", "",
            "bytes a", "contact", "");
  print_out("  {:<26}{:<7}{:>10}{:>10}{:>9}   {:>9}{:>10}{:>9}\n", "part", "scene", "with", "without",
            "saved", "with", "without", "saved");
  const auto saved = [](double with, double without) {
    return with > 0 ? fmt::format("{:.0f} %", 100 * (with - without) / with) : std::string("-");
  };
  for (const MeasuredSaving& s : savings)
    print_out("  {:<26}{:<7}{:>10.1f}{:>10.1f}{:>9}   {:>9.0f}{:>10.0f}{:>9}\n", s.part,
              s.in_scene ? "in" : "out", s.with_ns, s.without_ns, saved(s.with_ns, s.without_ns),
              s.with_bytes, s.without_bytes, saved(s.with_bytes, s.without_bytes));
}

}  // namespace talus
