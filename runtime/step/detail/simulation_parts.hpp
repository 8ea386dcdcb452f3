#pragma once

/// What a Simulation holds, and how a step and a stage begin and end.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include "kernels/detection/domain.hpp"
#include "runtime/step/appearing_walls.hpp"
#include "runtime/step/cell.hpp"
#include "runtime/step/cell_loads.hpp"
#include "runtime/step/cell_report.hpp"
#include "runtime/step/dealing.hpp"
#include "runtime/step/first_state.hpp"
#include "runtime/step/named_bodies.hpp"
#include "runtime/step/probes.hpp"
#include "runtime/step/runaway.hpp"
#include "runtime/step/simulation.hpp"
#include "runtime/step/stage_end.hpp"
#include "runtime/step/stage_loads.hpp"
#include "runtime/step/step_report.hpp"
#include "runtime/step/time_step.hpp"
#include "runtime/step/wall_motions.hpp"
#include "runtime/step/wall_reports.hpp"

namespace talus {

/// Size of the sample as a run begins, with the grains to be inserted in mind: none is smaller than
/// `smallest`, and there are materials and orientations if some of them may have one.
inline SampleSize first_size(const Setup& setup, SampleSize size) {
  size.smallest = smallest_ever(setup, size.bodies > 0 ? size.smallest : 0);
  size.orientation = size.orientation || setup.orientation || !setup.clumps.empty();
  size.materials = size.materials || (!setup.inserts.empty() && !setup.material_names.empty());
  return size;
}

/// Grains that may come, roughly: enough to share the work of a step among threads.
inline std::int64_t expected_grains(const Setup& setup) {
  constexpr std::int64_t unknown = 16384;
  std::int64_t grains = 0;
  for (const InsertRule& rule : setup.inserts) grains += rule.count.value_or(unknown);
  return grains;
}

struct Simulation::Implementation {
  Implementation(Setup given, Bodies bodies, graph::Executor& executor, const graph::Communicator& ranks_)
      : setup(std::move(given)),
        ranks(ranks_),
        state(first_state(setup, std::move(bodies), ranks_)),
        size(first_size(setup, measure_sample(state.bodies, ranks_, setup.clumps))),
        population(setup, state.bodies, ranks_),
        probes(setup),
        graph(state, parameters, setup,
              StepGraph::shares_for(size.bodies + expected_grains(setup),
                                    state.decomposition.partition.subdomains),
              executor, ranks_) {
    state.decomposition.orientation = size.orientation;
    state.decomposition.materials = size.materials;
    state.decomposition.shapes = !setup.clumps.empty();
    choose_distances();
    begin_stage();
  }

  void go_on_from(const SavedState& from) {
    // The bodies exactly as they were saved: the candidates name slots.
    state.bodies = from.bodies;
    state.walls = from.walls;
    stage_index = from.stage_index;
    stage_begins = from.stage_begins;
    begin_stage();
    state.walls = from.walls;
    state.candidates = from.candidates;
    state.domain = from.domain;
    state.flow = from.flow;
    state.given_overlaps = from.given_overlaps;
    report = from.report;
    stage_steps = from.steps_of_stage;
    clock = from.clock;
    held = from.held;
    falls_in = from.falls_in;
    sheared = from.sheared;
    memory = from.memory;
    population.go_on_from(from.population);
    // The impulses are those of the last step.
    if (stage().chooses_time_step && report.step > 0) parameters.time_step = report.time_step;
    lengths_at_start = from.lengths_of_box;
  }

  Implementation(Setup given, const Checkpoint& from, graph::Executor& executor,
                 const graph::Communicator& ranks_)
      : setup(std::move(given)),
        ranks(ranks_),
        state(restored_state(setup, from, ranks_)),
        size(from.head.size),
        population(setup, from.head.population),
        probes(setup),
        report(from.head.report),
        graph(state, parameters, setup, static_cast<std::uint32_t>(from.head.shares), executor, ranks_) {
    choose_distances();
    const CheckpointHead& head = from.head;
    probes.go_on_from(head.probes);
    stage_index = static_cast<std::size_t>(head.stage_index);
    stage_begins = head.stage_begins;
    std::ranges::copy(head.stress_at_start, setup.stress_at_start.begin());
    prescribe();
    parameters.time_step = head.time_step;
    clock = head.clock;
    if (stage().chooses_time_step) clock.move_end(stage().end.time);
    stage_steps = head.stage_steps;
    held = head.held;
    falls_in = head.falls_in;
    sheared = head.sheared;
    memory = head.memory;
    lengths_at_start = head.lengths_at_start;
    for (std::size_t w = 0; w < state.walls.size(); ++w) {
      const std::vector<double> load = numbers_of(state.walls[w].load);
      if (std::equal(load.begin(), load.end(),
                     head.wall_loads.begin() + static_cast<std::ptrdiff_t>(load.size() * w)))
        continue;
      put_load(state.walls[w], state.walls, state.domain);
      state.candidates_valid = false;  // a wall that is free now has chunks of another kind
    }
    resolve_stages(setup, stage_index, stage_begins, state.walls);
    set_walls(setup, report.time, parameters.time_step, state);
    graph.restore(from);
  }

  Checkpoint checkpoint() const {
    Checkpoint to;
    save_state(state, to);
    graph.save(to);
    CheckpointHead& head = to.head;
    head.size = size;
    head.shares = graph.shares_of_subdomain();
    head.population = population.state();
    head.probes = probes.state();
    head.stage_index = static_cast<std::int64_t>(stage_index);
    head.stage_steps = stage_steps;
    head.stage_begins = stage_begins;
    head.stress_at_start.assign(setup.stress_at_start.begin(), setup.stress_at_start.end());
    head.over = over;
    head.held = held;
    head.falls_in = falls_in;
    head.sheared = sheared;
    head.memory = memory;
    head.time_step = parameters.time_step;
    head.impulse_time = parameters.impulse_time();
    head.lengths_at_start = lengths_at_start;
    head.clock = clock;
    head.report = report;
    return to;
  }

  /// Chooses alert distance, skin, and how far from one another two bodies may turn (GapRule::turning), in
  /// smallest radii: no body fits in between.
  void choose_distances() {
    constexpr double farthest_turning = 0.5;
    const double unit = smallest_radius();
    parameters.alert = alert_distance(setup.detection, unit);
    parameters.turning = farthest_turning * unit;
    parameters.skin = skin_distance(setup.detection, unit);
    if (!setup.domain.repeats) return;
    double largest[1] = {0};
    for (const double radius : state.bodies.radius) largest[0] = std::max(largest[0], radius);
    ranks.max(largest);
    largest_radius = largest[0];
    check_cell(setup.domain, largest_radius, parameters.alert + parameters.skin);
  }

  /// The same check, for a cell that has been squeezed since.
  void check_edges() const {
    try {
      check_cell(state.domain, largest_radius, parameters.alert + parameters.skin);
    } catch (const std::invalid_argument& error) {
      throw NoSpaceError(fmt::format("{}: {}", next_step().text(), error.what()));
    }
  }

  const Stage& stage() const { return setup.stages[stage_index]; }

  /// Sets the next step's time step. Forces stay the same, so impulses scale with the time step.
  void take_time_step(double h) {
    if (parameters.time_step > 0 && h != parameters.time_step)
      for (double& value : state.candidates.impulse.values()) value *= h / parameters.time_step;
    parameters.time_step = h;
  }

  /// Before the first step of a stage.
  void wind_clock() {
    if (!stage().chooses_time_step) {
      take_time_step(stage().time_step);
      return;
    }
    clock =
        StageClock(time_step_bounds(stage(), setup.solver, smallest_radius()), stage().end.time, report.time);
    if (parameters.time_step == 0) parameters.time_step = clock.step();
  }

  double smallest_radius() const { return std::isfinite(size.smallest) ? size.smallest : 1; }

  /// What the stage prescribes, except its loads and its time step.
  void prescribe() {
    parameters = parameters_of(setup, stage(), parameters);
    prescribe_cell(setup, stage(), size, state.cell);
    state.free.w.resize(parameters.rotates ? state.bodies.size() : 0);
  }

  void begin_stage() {
    if (stage_begins.size() == stage_index) stage_begins.push_back(report.time);
    resolve_stages(setup, stage_index, stage_begins, state.walls);
    take_loads(stage(), state.walls);
    for (Wall& wall : state.walls) put_load(wall, state.walls, state.domain);
    wind_clock();
    const double last_reflection = parameters.reflection;
    prescribe();
    if (state.candidates_valid && !state.decomposition.several()) {
      // Later stages: the sample has flowed, sort it again. Several subdomains are sorted when they are dealt
      // out.
      const std::vector<Slot> order = morton_order(state.bodies);
      std::vector<Slot> place(order.size());
      for (std::size_t k = 0; k < order.size(); ++k)
        place[static_cast<std::size_t>(order[k])] = static_cast<Slot>(k);
      reorder(state.bodies, order);
      renumber(state.candidates, place);
    }
    if (state.candidates_valid) {
      // Forces stay the same when the law changes.
      for (double& value : state.candidates.impulse.values())
        value *= (1 + last_reflection) / (1 + parameters.reflection);
      convert_impulses(state.candidates, parameters.impulses(), state.bodies.x, state.walls, state.domain);
      state.candidates_valid = false;
    }
    stage_steps = 0;
    held = falls_in = sheared = 0;
    memory = {};
    lengths_at_start = state.domain.lengths(state.walls);
  }

  StepName next_step() const { return {report.step + 1, setup.stages[stage_index].name}; }
  /// Outcome of the step that the graph has run last.
  StepOutcome outcome() const {
    return {next_step(), setup, size, parameters, state, graph.sums(), graph.loop().result()};
  }

  void choose_time_step() {
    set_walls(setup, report.time, parameters.time_step, state);
    if (!stage().chooses_time_step) return;
    prepare_walls(report.time, parameters.time_step, step_before(), state, ranks);
    double longest = std::min(longest_time_step(state, setup, parameters, smallest_radius(), ranks),
                              longest_step_of_flow(state, setup.solver, parameters, smallest_radius(),
                                                   2 * largest_radius + parameters.alert));
    // Grains to be inserted in the step are not among the bodies yet.
    if (const double speed = population.fastest(span()); speed > 0)
      longest = std::min(longest, TimeStepRule{}.longest_way * smallest_radius() / speed);
    clock.choose(longest);
    if (strains_too_far(parameters.velocity_gradient.cwiseAbs().maxCoeff(), clock.step()))
      throw RunawayError(fmt::format(
          "{}: the cell is strained by more than {} in the shortest step that is allowed, {:.3g} s; give a "
          "shorter time_step_min",
          next_step().text(), TimeStepRule{}.longest_strain, clock.step()));
    take_time_step(clock.step());
  }

  /// Length of the last step [s]; before the first one, of that.
  double step_before() const { return report.step > 0 ? report.time_step : parameters.time_step; }
  /// The step that is about to be made.
  StepSpan span() const {
    return {report.time, report.time + parameters.time_step, &stage(), stage_begins[stage_index]};
  }

  /// Bodies whose paths are reported: of the setup, then inserted ones.
  std::vector<NamedBody> named_now() const {
    std::vector<NamedBody> bodies = setup.named;
    for (NamedBody& body : population.tracked()) bodies.push_back(std::move(body));
    return bodies;
  }

  /// Grains that come and go with the step.
  void change_grains() {
    if (!population.has_rules() || !population.change(span(), state, ranks)) return;
    state.free.u.resize(state.bodies.size());
    state.free.w.resize(parameters.rotates ? state.bodies.size() : 0);
    const SampleSize now = measure_sample(state.bodies, ranks, setup.clumps, &state.decomposition);
    size.bodies = now.bodies;
    size.mean_diameter = now.mean_diameter;
    size.total_mass = now.total_mass;
    size.volume = now.volume;
  }

  /// After a step: counts time and steps of the stage.
  void count_step() {
    ++stage_steps;
    if (stage().chooses_time_step) {
      clock.advance();
      report.time = clock.time();
    }
    const StageEnd& end = stage().end;
    const double shear_rate = shear_rate_now();
    sheared += report.time_step * shear_rate;
    if (end.by_memory()) {
      const Mat3& moment = graph.sums().contacts.moment;
      const double volume = state.domain.volume(state.walls);
      const double p = volume > 0 ? moment.trace() / (3 * volume * parameters.impulse_time()) : 0;
      memory.add(end, {report.time_step, report.time_step * shear_rate, stress_ratio(moment),
                       report.solid_fraction, inertial_time(size, p), shear_rate});
    }
    held = end.equilibrium && report.equilibrium <= *end.equilibrium ? held + report.time_step : 0;
    const StepSpan last{report.time - report.time_step, report.time, &stage(), stage_begins[stage_index]};
    if (held > 0 && population.expects_grains(last)) held = 0;
    falls_in = held > 0 ? fall_time(outcome()) : 0;
  }

  void probe() {
    const bool dealt = graph.sums().broad_phase && state.decomposition.several();
    probes.end_step({report.step, report.time, parameters.impulse_time(), dealt}, state, ranks);
  }

  /// Loads and motions of the walls for the step: applied forces and free velocities.
  void load_walls() {
    state.time = report.time;
    if (stage_steps == 0) demand_grains_outside(stage(), next_step().text(), state, ranks);
    if (state.domain.flows) check_edges();
    if (state.domain.flows)
      begin_flow(drive_cell(setup, {stage_index, report.time - stage_begins[stage_index], stage_begins},
                            parameters, state, ranks),
                 parameters.time_step, parameters.reflection, state.domain, state.flow);
    demand_motion(report.time, parameters.time_step, next_step().text(), state.walls);
    prepare_walls(report.time, parameters.time_step, step_before(), state, ranks);
    apply_loads(parameters, next_step(), state);
  }

  double strain(int axis) const {
    return Domain::strain(state.domain.lengths(state.walls)[axis], lengths_at_start[axis]);
  }

  /// Rate of shear of the cell [1/s].
  double shear_rate_now() const {
    if (!state.domain.flows) return 0;
    return shear_rate(gradient_before(state.domain, 0));
  }

  StageDone done() const {
    const StageEnd& end = stage().end;
    return stage_done(stage(), {stage_steps, clock, end.strain ? strain(end.strain_axis) : 0, sheared, held,
                                falls_in, memory});
  }

  void pass_ended_stages() {
    while (!over && done().fraction >= 1) {
      if (stage_index + 1 == setup.stages.size())
        over = true;
      else {
        ++stage_index;
        begin_stage();
      }
    }
  }

  Setup setup;
  const graph::Communicator& ranks;
  StepState state;
  SampleSize size;
  double largest_radius = 0;  ///< in a periodic cell [m]
  Population population;
  Probes probes;
  StepParameters parameters;
  StepReport report;
  StepGraph graph;
  StageClock clock;    ///< of a stage that chooses its time steps
  double sheared = 0;  ///< path of the cell's shear since the stage began
  double held = 0;     ///< time for which the stage's bound on equilibrium has held [s]
  /// Where it has: fall_time of the last step [s], whose loads a resumed run has yet to find.
  double falls_in = 0;
  StageMemory memory;  ///< of ends that look back
  std::size_t stage_index = 0;
  std::vector<double> stage_begins;  ///< times of the run at which stages up to this one began [s]
  std::int64_t stage_steps = 0;
  bool over = false;
  Vec3 lengths_at_start = Vec3::Zero();
  NamedBodies named;
  std::vector<BodyReport> named_reports;  ///< of the last step
};

}  // namespace talus
