#pragma once

/// What a trace holds. Everything that follows from the plan of the loop (colours, conflicts, owners,
/// messages) is stored once per plan; a task that ran leaves one record of 24 bytes that points into it.
/// Example: record {begin 1200, duration 7300, node 17, epoch 4, step 3, kind "sweep"} on track (rank 0,
/// thread 1): at 1.2 us this thread began to work on node 17 of the plan of step 3, in epoch 4, and had
/// finished 7.3 us later. It could begin because the nodes that conflict with node 17 and have lower colours
/// had ended epoch 4, those with higher colours epoch 3.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "runtime/graph/loop_plan.hpp"
#include "runtime/graph/tree.hpp"
#include "runtime/trace/machine.hpp"

namespace talus::trace {

/// Place of a kind in Trace::kinds.
enum class Kind : std::uint8_t {};

/// The phase to which the time of a kind counts; the first five are the columns of Table 3 of Visseq, Alart
/// and Dureisseix (2013).
enum class Phase : std::uint8_t {
  partitioning,
  detection,
  sweeps,    ///< "Inloop 1": Gauss-Seidel and what glues the copies
  exchange,  ///< "Inloop 2": messages of the iterations, packing and waiting included
  update,
  waiting,  ///< for other threads, inside the loop
  outside,  ///< between steps
};
inline constexpr std::size_t phase_count = 7;
const char* name_of(Phase phase);

/// The program that is traced defines the kinds of records.
struct KindInfo {
  std::string name;
  Phase phase = Phase::outside;
  bool blocked = false;  ///< waits for messages and does no work of its own
  /// True for work that one thread of a rank does once and that grows with the rank's part of the sample: a
  /// task, or a span within a check. Other kinds are work of all ranks and threads.
  bool shared = false;
  bool operator==(const KindInfo&) const = default;
};

/// Kinds that the runtime itself records, which every trace has first.
inline constexpr Kind kind_team{0};        ///< one thread's stay in a team task
inline constexpr Kind kind_outside{1};     ///< from the end of one step to the beginning of the next
inline constexpr Kind kind_collective{2};  ///< inside a call of all ranks; node = bytes it adds up
inline constexpr Kind kind_receive{3};     ///< waits for a message; node = message_name
inline constexpr Kind kind_send{4};        ///< starts a message; node = message_name
inline constexpr Kind kind_check{5};       ///< decides after an epoch; node = 0 or check_settles
/// A check that reads its own sums at once on any number of ranks; others are read a sweep later by several.
inline constexpr std::uint32_t check_settles = 1;
std::vector<KindInfo> runtime_kinds();
/// Communication between ranks: never a task, but a span within one.
inline bool is_communication(Kind kind) {
  return kind == kind_send || kind == kind_receive || kind == kind_collective;
}

/// Of a task that all ranks do together, what its time on another machine follows from. Within a check it is
/// Record::node of its span.
struct Meetings {
  static constexpr std::uint16_t most = 1023;
  /// How often they communicate, at most `most` each: gathers of numbers on all ranks, and exchanges of
  /// copies between all subdomains.
  std::uint16_t gathers = 0, exchanges = 0;
  /// Of the work of a rank, in [0, 1] and together at most 1: what one thread does before and after the
  /// others can help, and the longest of the pieces that they share, such as the direct solve of a cluster.
  /// Kept in parts of 1/63.
  double alone = 0, longest = 0;

  std::uint32_t packed() const {
    const auto kept = [](double share) { return static_cast<std::uint32_t>(std::lround(parts * share)); };
    const std::uint32_t first = kept(alone);
    return std::uint32_t{gathers} << 22 | std::uint32_t{exchanges} << 12 | first << 6 |
           std::min(kept(longest), std::uint32_t{parts} - first);
  }
  static Meetings of(std::uint32_t packed) {
    return {static_cast<std::uint16_t>(packed >> 22), static_cast<std::uint16_t>(packed >> 12 & most),
            (packed >> 6 & parts) / double{parts}, (packed & parts) / double{parts}};
  }
  /// The time that so many threads, >= 1, take, over that of one.
  double time_on(double threads) const { return alone + std::max((1 - alone) / threads, longest); }

 private:
  static constexpr std::uint8_t parts = 63;
};

/// One task, or one span within a task (then it lies within the task's time, on the same track).
struct Record {
  std::int64_t begin = 0;   ///< [ns] on the clock of the rank, from the beginning of the trace
  float duration = 0;       ///< [ns]; exact to the ns below 16 ms
  std::uint32_t node = 0;   ///< of the plan, in the loop; of the step's tasks else
  std::int32_t epoch = -1;  ///< in the loop, from 0; -1 outside
  std::uint32_t step_and_kind = 0;

  std::uint32_t step() const { return step_and_kind >> 8; }  ///< from 1
  Kind kind() const { return static_cast<Kind>(step_and_kind & 0xffU); }
  double end() const { return static_cast<double>(begin) + static_cast<double>(duration); }
};
static_assert(sizeof(Record) == 24, "records are written to files as they are");

inline constexpr std::uint32_t largest_step = 0xffffffU;
inline std::uint32_t pack(std::uint32_t step, Kind kind) {
  return step << 8 | static_cast<std::uint32_t>(kind);
}

/// Part of a node of the loop in the exchange of messages.
enum class Role : std::uint8_t {
  compute,  ///< nothing
  publish,  ///< sends what its group publishes to other groups
  root,     ///< of a rank: what goes through one rank; before it, on ranks between, what goes up to it
  glue,     ///< receives what others have published
  take,     ///< of a group of a later subdomain colour, before its border: receives what groups of earlier
            ///< colours published
  tell,     ///< sends its group's part to the root; without a tell, publish sends it
};

/// Of a node of a loop as it is run. A trace calls collect a root, too: it is the rank's first of two.
Role role_of(graph::LoopRole role);

/// Names the root as the end of a message.
inline constexpr std::uint16_t root_group = 0xffffU;

/// Sent in each epoch that exchanges, from the publish of one group to the glue of another (`from` to `to`),
/// or to its take if the subdomain colour of the first is the earlier; or to and from the root. Groups on one
/// rank need no message.
struct Message {
  std::uint16_t from = 0, to = 0;
  std::uint32_t bytes = 0;
};
inline std::uint32_t message_name(std::uint32_t from, std::uint32_t to) {
  return from << 16 | to;
}

/// The loop of one rank, from step `step` until the next plan of that rank: n nodes.
struct Plan {
  std::int32_t rank = 0;
  std::uint32_t step = 0;
  std::vector<std::uint32_t> colour;     ///< n
  std::vector<std::uint32_t> group;      ///< n: subdomain among all; of the root 0xffff
  std::vector<std::uint8_t> role;        ///< n: of Role
  std::vector<std::uint32_t> weight;     ///< n: expected work, in contacts; 0 for what no work is planned for
  std::vector<std::uint32_t> place;      ///< n: order in space within the rank, for owners; of publish, take,
                                         ///< tell and glue the subdomain colour of their group
  std::vector<std::uint32_t> owner;      ///< n: thread
  std::vector<std::uint32_t> offset;     ///< n + 1, into neighbour
  std::vector<std::uint32_t> neighbour;  ///< conflicting nodes
  std::vector<Message> messages;         ///< that leave a group of this rank, and those from the root

  std::size_t size() const { return colour.size(); }
  std::span<const std::uint32_t> neighbours(std::size_t node) const {
    return std::span(neighbour).subspan(offset[node], offset[node + 1] - offset[node]);
  }
};

/// Adds what the plan's groups have to do in an iteration, as graph::grow_tree() wants it, to the load of the
/// rank that each is on: rank_of(group).
template <class RankOf>
void add_load(const Plan& plan, const RankOf& rank_of, std::span<graph::RankLoad> load) {
  for (std::size_t n = 0; n < plan.size(); ++n) {
    if (plan.group[n] == root_group) continue;
    graph::RankLoad& rank = load[rank_of(plan.group[n])];
    rank.work += plan.weight[n];
    rank.waits = rank.waits || static_cast<Role>(plan.role[n]) == Role::take;
  }
  for (const Message& message : plan.messages)
    if (message.from != root_group && message.to != root_group)
      load[rank_of(message.from)].work += graph::load_of_neighbour;
}

/// A task of every step of one rank.
struct Task {
  std::string name;
  Kind kind{};
  std::int32_t group = -1;                  ///< subdomain whose work it is, -1: the rank's
  bool team = false;                        ///< the loop
  std::vector<std::uint32_t> predecessors;  ///< earlier tasks of the rank
};

/// What one thread of one rank did, in order of begin; a span within a task comes after it.
struct Track {
  std::int32_t rank = 0, thread = 0;
  std::vector<Record> records;
};

struct Trace {
  int ranks = 1, threads = 1;
  bool predicted = false;          ///< by replay; else recorded
  std::optional<Machine> machine;  ///< that a prediction was made for: recorded_machine()
  std::vector<KindInfo> kinds;
  std::vector<std::vector<Task>> tasks;  ///< per rank
  std::vector<Plan> plans;               ///< of every rank, ascending steps within a rank
  std::vector<Track> tracks;             ///< ranks x threads, rank by rank

  const Track& track(int rank, int thread) const {
    return tracks[static_cast<std::size_t>(rank) * static_cast<std::size_t>(threads) +
                  static_cast<std::size_t>(thread)];
  }
  const KindInfo& info(Kind kind) const { return kinds[static_cast<std::size_t>(kind)]; }
  std::size_t record_count() const;
};

/// The trace cannot be used: it is not a trace, is cut off, or has steps that were recorded in part only.
class TraceError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Throws TraceError when sizes do not match, or an index points at nothing. Cost: every number once.
void validate(const Trace& trace);

/// Sorts the records of all tracks as Track wants them. Cost: nothing for what is sorted.
void sort_tracks(Trace& trace);

/// The plan that `rank` ran in `step`; null before its first.
const Plan* plan_of(const Trace& trace, int rank, std::uint32_t step);

/// Bytes held.
std::size_t memory_used(const Trace& trace);

}  // namespace talus::trace
