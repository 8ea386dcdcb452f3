#include "runtime/step/simulation.hpp"

#include <algorithm>
#include <stdexcept>

#include "runtime/graph/clock.hpp"
#include "runtime/graph/one_rank.hpp"
#include "runtime/step/cell_report.hpp"
#include "runtime/step/detail/simulation_parts.hpp"

namespace talus {

Simulation::Simulation(Setup setup, Bodies bodies, graph::Executor& executor,
                       const graph::Communicator& ranks)
    : impl_(std::make_unique<Implementation>(std::move(setup), std::move(bodies), executor, ranks)) {
  impl_->pass_ended_stages();
}

Simulation::Simulation(Setup setup, Bodies bodies, graph::Executor& executor)
    : Simulation(std::move(setup), std::move(bodies), executor, graph::one_rank()) {}

Simulation::Simulation(Setup setup, const SavedState& from, graph::Executor& executor)
    : impl_(std::make_unique<Implementation>(std::move(setup), from.bodies, executor, graph::one_rank())) {
  impl_->go_on_from(from);
  impl_->pass_ended_stages();
}

Simulation::Simulation(Setup setup, const Checkpoint& from, graph::Executor& executor,
                       const graph::Communicator& ranks)
    : impl_(std::make_unique<Implementation>(std::move(setup), from, executor, ranks)) {
  impl_->pass_ended_stages();
}

Simulation::~Simulation() = default;

void Simulation::follow(trace::Order* order) {
  impl_->graph.follow(order);
}

SavedState Simulation::save() const {
  if (impl_->state.decomposition.several())
    throw std::logic_error("a state is saved from one subdomain; this simulation has several");
  return {impl_->state.bodies,
          impl_->state.walls,
          impl_->state.candidates,
          impl_->report,
          impl_->stage_index,
          impl_->stage_steps,
          impl_->lengths_at_start,
          impl_->state.given_overlaps,
          impl_->clock,
          impl_->sheared,
          impl_->held,
          impl_->stage_begins,
          impl_->population.state(),
          impl_->state.domain,
          impl_->state.flow,
          impl_->memory,
          impl_->falls_in};
}

void Simulation::begin_from(std::vector<GivenForce> forces) {
  double any[1] = {forces.empty() ? 0.0 : 1.0};
  impl_->ranks.max(any);
  impl_->state.forces_given = any[0] > 0;
  impl_->state.given_forces = std::move(forces);
}

Checkpoint Simulation::checkpoint() const {
  return impl_->checkpoint();
}

const StepReport& Simulation::step() {
  const double start = graph::seconds_now();
  impl_->choose_time_step();
  impl_->change_grains();
  impl_->load_walls();
  const std::vector<NamedBody> named = impl_->named_now();
  impl_->named.begin_step(named, impl_->state, impl_->ranks);
  impl_->probes.begin_step(impl_->state);
  const double energy_free = free_energy_of(impl_->state);
  impl_->graph.run();
  const StepOutcome outcome = impl_->outcome();
  check_for_runaway(outcome, energy_free);
  const DeepestOverlap overlap = find_deepest_overlap(
      impl_->state, {outcome.sums.contacts.deepest, outcome.sums.bodies_beyond, outcome.sums.walls_beyond},
      impl_->setup.solver.overlap_tolerance, impl_->ranks);
  add_step(impl_->report, outcome, overlap, graph::seconds_now() - start, impl_->ranks);
  impl_->named_reports = impl_->named.end_step(named, impl_->state, impl_->parameters, impl_->ranks);
  impl_->count_step();
  impl_->probe();
  return impl_->report;
}

bool Simulation::begin_next_stage() {
  const std::size_t before = impl_->stage_index;
  impl_->pass_ended_stages();
  return impl_->stage_index != before;
}

bool Simulation::finished() const {
  return impl_->over;
}
double Simulation::stage_fraction() const {
  return std::min(1.0, impl_->done().fraction);
}
const char* Simulation::end_reached() const {
  const auto [fraction, by] = impl_->done();
  return fraction >= 1 ? by : "";
}
const Stage& Simulation::stage() const {
  return impl_->stage();
}
std::size_t Simulation::stage_index() const {
  return impl_->stage_index;
}
std::int64_t Simulation::steps_of_stage() const {
  return impl_->stage_steps;
}
const Setup& Simulation::setup() const {
  return impl_->setup;
}
const StepState& Simulation::state() const {
  return impl_->state;
}
const StepParameters& Simulation::parameters() const {
  return impl_->parameters;
}
const std::vector<ErrorCheck>& Simulation::error_history() const {
  return impl_->graph.loop().history();
}
const StepReport& Simulation::report() const {
  return impl_->report;
}
const IterationResult& Simulation::iterations() const {
  return impl_->graph.loop().result();
}
const StepSums& Simulation::sums() const {
  return impl_->graph.sums();
}
const graph::Graph& Simulation::step_graph() const {
  return impl_->graph.graph();
}

std::vector<WallReport> Simulation::walls() const {
  return wall_reports(impl_->state, impl_->parameters.impulse_time());
}

std::vector<WallReport> Simulation::groups() const {
  return group_reports(impl_->setup, impl_->state, walls());
}

const std::vector<BodyReport>& Simulation::named_bodies() const {
  return impl_->named_reports;
}

std::vector<InsertReport> Simulation::inserted() const {
  return impl_->population.inserted();
}
std::vector<RemoveReport> Simulation::removed() const {
  return impl_->population.removed();
}

const std::vector<ProbeReport>& Simulation::probes() const {
  return impl_->probes.reports();
}

std::optional<TriaxialReport> Simulation::triaxial() const {
  Vec3 strain;
  for (int axis = 0; axis < 3; ++axis) strain[axis] = impl_->strain(axis);
  return triaxial_report(impl_->outcome(), impl_->report, stage(), strain, impl_->ranks);
}

std::optional<CellReport> Simulation::cell() const {
  return cell_report(impl_->outcome(), impl_->report, impl_->ranks);
}

std::uint64_t Simulation::digest() const {
  const Decomposition& all = impl_->state.decomposition;
  std::int64_t sum[1] = {static_cast<std::int64_t>(talus::digest(impl_->state.bodies, all.counts))};
  impl_->ranks.sum(sum);
  return static_cast<std::uint64_t>(sum[0]);
}

std::int64_t Simulation::bodies() const {
  return impl_->size.bodies;
}
const MessageCount& Simulation::messages() const {
  return impl_->graph.loop().gluing().messages();
}
double Simulation::exposed() const {
  return impl_->graph.loop().gluing().exposed();
}

void Simulation::release_room() {
  impl_->graph.release_room();
}

Frame Simulation::frame(bool contacts) const {
  Frame frame;
  frame.step = impl_->report.step;
  frame.time = impl_->report.time;
  frame.stage = stage().name;
  fill_frame(impl_->state, impl_->ranks, impl_->setup.rotation, contacts && frame.step > 0,
             impl_->parameters.impulse_time(), frame);
  frame.walls = walls();
  frame.with_contacts = contacts;
  // Sums go in order of subdomain, and only the first step deals bodies out to subdomains.
  if (frame.step > 0)
    frame.grids =
        coarse_fields(impl_->setup.fields, impl_->state, impl_->parameters.impulse_time(), impl_->ranks);
  return frame;
}

}  // namespace talus
