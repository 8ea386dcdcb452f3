#pragma once

/// The complete state of a run between two steps. A run that continues from it gives the same bits as one
/// that was never stopped, on any ranks and threads (docs/checkpoints.md lists every member of a simulation
/// that outlives a step, and where it is kept). Files know names and numbers only; the two visitors below
/// hand these out.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "kernels/bodies/types.hpp"
#include "runtime/graph/communicator.hpp"
#include "runtime/step/answer_memory.hpp"
#include "runtime/step/dealing.hpp"
#include "runtime/step/frame.hpp"
#include "runtime/step/population.hpp"
#include "runtime/step/probes.hpp"
#include "runtime/step/setup.hpp"
#include "runtime/step/stage_end.hpp"
#include "runtime/step/state.hpp"
#include "runtime/step/stiffness_memory.hpp"
#include "runtime/step/time_step.hpp"
#include "runtime/step/velocity_error_memory.hpp"

namespace talus {

/// Data of one subdomain, the same whatever rank it is on. n copies of bodies by slot, slots counted from the
/// subdomain's first; c candidates, chunk after chunk; k chunks; s copies of bodies that stand in other
/// subdomains, too. Columns that the scene does not need are empty.
struct CheckpointPart {
  std::vector<std::int64_t> id;                    ///< n
  std::vector<std::array<double, 3>> x;            ///< n [m]
  std::vector<double> radius;                      ///< n [m]
  std::vector<std::array<double, 8>> velocity;     ///< n records of VelocityOf
  std::vector<std::array<double, 4>> orientation;  ///< n or none
  std::vector<std::uint8_t> material, shape;       ///< n or none
  std::vector<std::array<double, 3>> x_then;       ///< n [m]
  std::vector<double> reach_then;                  ///< n [m]
  std::vector<std::uint16_t> multiplicity, parts;  ///< n, or none with one subdomain
  std::vector<std::uint8_t> taken, counts;         ///< likewise; Decomposition
  std::vector<std::array<double, 2>> whole;        ///< likewise [1/kg]

  std::vector<std::array<std::int32_t, 2>> grain_pairs;  ///< slots
  std::vector<std::array<std::int32_t, 3>> wall_pairs;   ///< wall, slot, feature
  std::vector<std::uint16_t> balls;                      ///< per grain pair, or none
  std::vector<std::uint8_t> acts;  ///< c: its row of impulses is stored, as some bit of it is not 0
  std::vector<double> impulses;    ///< the rows stored [N s]
  std::vector<float> pushes;       ///< c or none: PositionCorrection
  std::vector<std::uint16_t>
      order;  ///< per grain pair, or none: which candidate of its chunk stands in this place
  std::vector<std::uint8_t> groups;  ///< of the contacts between grains, chunk after chunk, or none
  std::vector<std::array<std::int32_t, 4>> chunks;  ///< k: candidates, wall or -1, ChunkSide, contacts

  // SubdomainInterface, under its names.
  std::vector<std::int32_t> shared, owner;              ///< s
  std::vector<std::array<std::int32_t, 3>> neighbours;  ///< subdomain, begin, end
  std::vector<std::int32_t> exchange, copies_begin, hubs;
  std::vector<std::array<std::int32_t, 2>> copies;  ///< neighbour, place
};

/// visit(name, column) for each column of a part.
template <class Part, class Visit>
void each_column(Part& part, const Visit& visit) {
  visit("id", part.id);
  visit("x", part.x);
  visit("radius", part.radius);
  visit("velocity", part.velocity);
  visit("orientation", part.orientation);
  visit("material", part.material);
  visit("shape", part.shape);
  visit("x_then", part.x_then);
  visit("reach_then", part.reach_then);
  visit("multiplicity", part.multiplicity);
  visit("parts", part.parts);
  visit("taken", part.taken);
  visit("counts", part.counts);
  visit("whole", part.whole);
  visit("grain_pairs", part.grain_pairs);
  visit("wall_pairs", part.wall_pairs);
  visit("balls", part.balls);
  visit("acts", part.acts);
  visit("impulses", part.impulses);
  visit("pushes", part.pushes);
  visit("order", part.order);
  visit("groups", part.groups);
  visit("chunks", part.chunks);
  visit("shared", part.shared);
  visit("owner", part.owner);
  visit("neighbours", part.neighbours);
  visit("exchange", part.exchange);
  visit("copies_begin", part.copies_begin);
  visit("hubs", part.hubs);
  visit("copies", part.copies);
}

/// Data that are the same on all ranks.
struct CheckpointHead {
  // How space is cut: Decomposition and its Partition.
  std::int32_t subdomains = 1;
  std::string partitioner;
  Vec3 frame_low = Vec3::Zero(), frame_lengths = Vec3::Zero(), frame_scale = Vec3::Zero();
  std::vector<std::int64_t> cuts;         ///< axis, key, below, above of each
  std::vector<std::int64_t> table_cells;  ///< 3
  std::vector<std::int64_t> table;
  std::vector<std::int64_t> subdomain_colour;
  std::vector<double> cost;
  bool blind = false;
  bool orientation = false, materials = false, shapes = false;
  std::int64_t migrants = 0;
  double imbalance = 0;

  SampleSize size;
  std::int64_t shares = 0;  ///< of each subdomain in the step's graph
  PopulationState population;
  ProbeState probes;

  // Walls, in the order of the setup.
  std::vector<double> wall_points, wall_velocities, wall_then;  ///< 3 each
  std::vector<double> wall_impulses;                            ///< 3 each
  std::vector<double> wall_torques;                             ///< 3 each
  std::vector<double> wall_applied, wall_margins, wall_work;
  double time_then = 0;            ///< time of the run to which the places at the last broad phase belong [s]
  std::vector<double> wall_loads;  ///< numbers_of(load) of each, in force

  /// Of a cell that flows, else empty: xx, yy, zz, xy, xz, yz of its edges [m], of their rates [m/s], and of
  /// the edges at the last broad phase [m].
  std::vector<double> cell_edges, cell_rates, cell_edges_then;
  std::vector<double> stress_at_start;  ///< Setup::stress_at_start

  bool candidates_valid = false;
  std::int64_t impulse_kind = 3;
  bool overlaps_given = false;
  std::vector<std::int64_t> overlap_pairs;  ///< body and with of each pair
  std::vector<double> overlap_depths;       ///< [m]

  // Simulation.
  std::int64_t stage_index = 0, stage_steps = 0;
  std::vector<double> stage_begins;  ///< times of the run at which stages up to this one began [s]
  bool over = false;
  double sheared = 0;
  double held = 0, falls_in = 0;
  StageMemory memory;
  double time_step = 0;
  double impulse_time = 0;  ///< of the last step [s]: forces are impulses over it
  Vec3 lengths_at_start = Vec3::Zero();
  StageClock clock;
  StepReport report;

  // StepGraph and SolverLoop.
  std::int64_t graph_steps = 0, partitioned = 0;
  double imbalance_then = 0;
  std::int64_t contacts_before = 0;
  double imbalance_before = 0;
  double farthest = 0;
  StiffnessMemory stiffness;
  VelocityErrorMemory velocity_errors;
  AnswerMemory answers;
};

/// visit(name, member) for each member of a head that is a number, a text, a Vec3, or a vector of numbers.
template <class Head, class Visit>
void each_member(Head& head, const Visit& visit) {
  visit("subdomains", head.subdomains);
  visit("partitioner", head.partitioner);
  visit("frame_low", head.frame_low);
  visit("frame_lengths", head.frame_lengths);
  visit("frame_scale", head.frame_scale);
  visit("cuts", head.cuts);
  visit("table_cells", head.table_cells);
  visit("table", head.table);
  visit("subdomain_colour", head.subdomain_colour);
  visit("cost", head.cost);
  visit("blind", head.blind);
  visit("orientation", head.orientation);
  visit("materials", head.materials);
  visit("shapes", head.shapes);
  visit("migrants", head.migrants);
  visit("imbalance", head.imbalance);
  visit("bodies", head.size.bodies);
  visit("smallest", head.size.smallest);
  visit("mean_diameter", head.size.mean_diameter);
  visit("total_mass", head.size.total_mass);
  visit("volume", head.size.volume);
  visit("size_orientation", head.size.orientation);
  visit("size_materials", head.size.materials);
  visit("shares", head.shares);
  PopulationState::each_number(head.population, visit);
  ProbeState::each_number(head.probes, visit);
  visit("wall_points", head.wall_points);
  visit("wall_velocities", head.wall_velocities);
  visit("wall_then", head.wall_then);
  visit("wall_impulses", head.wall_impulses);
  visit("wall_torques", head.wall_torques);
  visit("wall_applied", head.wall_applied);
  visit("wall_work", head.wall_work);
  visit("time_then", head.time_then);
  visit("wall_margins", head.wall_margins);
  visit("wall_loads", head.wall_loads);
  visit("cell_edges", head.cell_edges);
  visit("cell_rates", head.cell_rates);
  visit("cell_edges_then", head.cell_edges_then);
  visit("stress_at_start", head.stress_at_start);
  visit("candidates_valid", head.candidates_valid);
  visit("impulse_kind", head.impulse_kind);
  visit("overlaps_given", head.overlaps_given);
  visit("overlap_pairs", head.overlap_pairs);
  visit("overlap_depths", head.overlap_depths);
  visit("stage_index", head.stage_index);
  visit("stage_steps", head.stage_steps);
  visit("stage_begins", head.stage_begins);
  visit("over", head.over);
  visit("sheared", head.sheared);
  visit("held", head.held);
  visit("falls_in", head.falls_in);
  StageMemory::each_number(head.memory, visit);
  visit("time_step", head.time_step);
  visit("impulse_time", head.impulse_time);
  visit("lengths_at_start", head.lengths_at_start);
  StageClock::each_number(head.clock, visit);
  each_number(head.report, visit);
  visit("graph_steps", head.graph_steps);
  visit("partitioned", head.partitioned);
  visit("imbalance_then", head.imbalance_then);
  visit("contacts_before", head.contacts_before);
  visit("imbalance_before", head.imbalance_before);
  visit("farthest", head.farthest);
  StiffnessMemory::each_number(head.stiffness, visit);
  VelocityErrorMemory::each_number(head.velocity_errors, visit);
  AnswerMemory::each_number(head.answers, visit);
}

struct Checkpoint {
  CheckpointHead head;
  std::vector<std::int32_t> here;     ///< subdomains of this rank, ascending
  std::vector<CheckpointPart> parts;  ///< one for each of these
};

/// A load as 8 numbers: drive, velocity, pressure, force, mass, weight.
std::vector<double> numbers_of(const WallLoad& load);

/// The state as a part of a checkpoint: all but what StepGraph keeps.
void save_state(const StepState& state, Checkpoint& to);

/// The state of a run of `setup` whose loads are those of the stage; restore_contacts fills in its chunks and
/// contacts. Throws std::invalid_argument when there are more ranks than subdomains, or the columns do not
/// fit one another or the setup.
StepState restore_state(const Setup& setup, const Checkpoint& from, const graph::Communicator& ranks);

/// Edges and rates of a periodic cell that flows; others stay as they are. Throws std::invalid_argument where
/// the domain is no cell, or numbers are missing.
void restore_cell(const CheckpointHead& head, Domain& domain);

/// Groups of candidates that are cut into the same chunks as were saved.
std::vector<CandidateGroup> restored_groups(const StepState& state, const Checkpoint& from);

/// Restores the places of contacts and candidates in their chunks, which are already cut and have their
/// rooms. The next narrow phase starts from these places.
void restore_contacts(const Checkpoint& from, StepState& state);

}  // namespace talus
