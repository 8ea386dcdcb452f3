#include "io/trace/smpi_platform.hpp"

#include <fmt/format.h>

#include <stdexcept>

#include "runtime/graph/detail/mpi_call.hpp"

namespace talus::io {

std::string smpi_platform(const trace::Machine& machine) {
  const trace::Machine plain;
  if (machine.noise != plain.noise || machine.contacts != plain.contacts)
    throw std::invalid_argument(
        "a platform for SMPI has no noise and no scale of contacts: SMPI runs the real program");
  if (!machine.speed_of.empty())
    throw std::invalid_argument("a platform for SMPI has one speed for all kinds of tasks");
  if (machine.schedule != plain.schedule)
    throw std::invalid_argument("a platform for SMPI has no schedule: that is the program's");
  if (machine.threads != 1)
    throw std::invalid_argument(
        fmt::format("simulated ranks have one thread each, and the machine has {}", machine.threads));
  const int nodes = (machine.ranks + machine.ranks_per_node - 1) / machine.ranks_per_node;
  std::string settings;
  const auto set = [&](const char* key, const std::string& value) {
    settings += fmt::format("    <prop id=\"{}\" value=\"{}\"/>\n", key, value);
  };
  // The network as given, without the corrections that SimGrid knows for networks of 2010.
  set("smpi/lat-factor", "0:1");
  set("smpi/bw-factor", "0:1");
  set("network/crosstraffic", "0");
  set("network/weight-S", "0");
  set("network/TCP-gamma", "0");
  constexpr double flops = graph::detail::host_flops;
  set("smpi/host-speed", fmt::format("{}f", flops));
  set("smpi/simulate-computation", "no");  // the program takes its own time (graph::detail::MpiCall)
  for (const char* key : {"smpi/os", "smpi/ois", "smpi/or"})
    set(key, fmt::format("0:{}:0", machine.overhead));
  for (const char* key : {"smpi/test", "smpi/iprobe", "smpi/wtime"}) set(key, "0");
  for (const char* key : {"smpi/send-is-detached-thresh", "smpi/async-small-thresh"}) set(key, "2147483647");
  set("smpi/coll-selector", "ompi");
  return fmt::format(
      "<?xml version='1.0'?>\n"
      "<!DOCTYPE platform SYSTEM \"https://simgrid.org/simgrid.dtd\">\n"
      "<platform version=\"4.1\">\n"
      "  <config>\n{}  </config>\n"
      "  <cluster id=\"machine\" prefix=\"node-\" suffix=\"\" radical=\"0-{}\" speed=\"{}f\" core=\"{}\" "
      "bw=\"{}Bps\" lat=\"{}s\" loopback_bw=\"{}Bps\" loopback_lat=\"{}s\"/>\n"
      "</platform>\n",
      settings, nodes - 1, flops * machine.speed, machine.ranks_per_node, machine.bandwidth,
      machine.latency / 2, machine.node_bandwidth, machine.node_latency);
}

std::string smpi_hosts(const trace::Machine& machine) {
  std::string hosts;
  for (int rank = 0; rank < machine.ranks; ++rank)
    hosts += fmt::format("node-{}\n", rank / machine.ranks_per_node);
  return hosts;
}

}  // namespace talus::io
