#pragma once

/// The machine of a replay as SimGrid describes machines, for the real program on simulated ranks.

#include <string>

#include "runtime/trace/replay.hpp"

namespace talus::io {

/// A platform of SimGrid 3.32 (XML) that smpirun reads: as many nodes as `machine` has, cores of the
/// measuring machine's speed times machine.speed, and the network of trace::Network: a link each way per
/// node, with the latency of the message split between the two; nothing shared inside a node; the overhead as
/// what a rank waits at each message it sends or takes. Messages leave at once, whether somebody waits for
/// them or not; MPI's polls cost nothing. The file holds all settings of
/// SMPI; which rank has which subdomain is up to the program (decomposition.mapping). What SimGrid does not
/// have (noise, contacts, speeds by kind, schedule), or several threads: throws std::invalid_argument.
std::string smpi_platform(const trace::Machine& machine);

/// For smpirun's -hostfile: the nodes of consecutive ranks, one line a rank.
std::string smpi_hosts(const trace::Machine& machine);

}  // namespace talus::io
