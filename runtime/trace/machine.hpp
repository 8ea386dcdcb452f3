#pragma once

/// The machine of a replay.

#include <cmath>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>

namespace talus::trace {

struct Trace;

/// How subdomains are mapped to ranks.
enum class RankMap : std::uint8_t {
  block,   ///< consecutive ones, as many each: what the program does
  cyclic,  ///< dealt out one by one
  weight,  ///< consecutive ones of nearly equal planned work
};

/// How the nodes of a rank are scheduled on its threads.
enum class Schedule : std::uint8_t {
  fixed,  ///< what the program does: owners by weight, each walks its nodes by (colour, index)
  list,   ///< any thread of the rank takes the ready node that is first by (epoch, colour, index)
};

/// Throw std::invalid_argument for other names.
RankMap rank_map_named(std::string_view name);
Schedule schedule_named(std::string_view name);
std::string name_of(RankMap map);
std::string name_of(Schedule schedule);

struct Machine {
  int ranks = 1;
  int threads = 1;  ///< of a rank
  RankMap map = RankMap::block;
  Schedule schedule = Schedule::fixed;
  double latency = 1.5e-6;       ///< of a message between nodes [s]
  double bandwidth = 12e9;       ///< of a node's link, each way, shared by its ranks [byte/s]
  double overhead = 3e-7;        ///< of a thread, for each message it sends or takes [s]
  int ranks_per_node = 1;        ///< consecutive ranks; their messages do not use the link
  double node_latency = 5e-7;    ///< inside a node [s]
  double node_bandwidth = 10e9;  ///< inside a node, per message [byte/s]
  double line = 5e-8;  ///< to hand a cache line of 64 bytes over to another core [s]; paid, half by each
                       ///< side, for velocities that go between threads of a rank and did not when recorded
  double noise = 0;    ///< each task takes up to this part longer, evenly distributed
  std::uint64_t seed = 1;  ///< of the noise
  double speed = 1;        ///< of a core, relative to the recorded one
  std::map<std::string, double>
      speed_of;          ///< by the name of a kind of tasks, which it holds for instead: what
                         ///< was recorded out of the cache gains more from caches than others
  double contacts = 1;   ///< per subdomain, relative to the recorded ones: chunks take longer in proportion,
                         ///< messages grow as the faces, with the power 2/3
  bool typical = false;  ///< a node that took more than three times its median of the step took the median,
                         ///< and a task of a subdomain that of all its like: the recorded machine was shared
                         ///< with other programs
  double quantile = 0;  ///< in (0, 1]: every node takes this quantile of its times of the step instead, and a
                        ///< task of a subdomain that of all its like: a machine so busy that most times are
                        ///< too long; imbalance between coarse tasks is lost. 0: off
  bool late_check =
      true;  ///< with several ranks the sums of a convergence check travel behind the next sweep
  bool unbounded = false;  ///< as many threads as there is work for (schedule list), and messages that do not
                           ///< share links: the longest chain of tasks
  bool operator==(const Machine&) const = default;
  /// Factor by which the faces of subdomains grow, and with them copies and messages.
  double faces() const { return std::pow(contacts, 2.0 / 3); }
};

/// Throws std::invalid_argument when a number is out of its range, or there are more ranks than subdomains.
void validate(const Machine& machine, const Trace& trace);

/// The machine that a trace was recorded on, its ranks on one node; the latency is the median of the messages
/// that were waited for, the map that of the recorded ranks. Of a prediction the machine that it was made
/// for, as far as its times do not tell and the next replay needs it: ranks, threads, map, ranks_per_node,
/// node_latency. Cost: that of sends_of().
Machine recorded_machine(const Trace& trace);

}  // namespace talus::trace
