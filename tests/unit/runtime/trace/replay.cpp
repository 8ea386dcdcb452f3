#include "runtime/trace/replay.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "io/trace/smpi_platform.hpp"
#include "runtime/trace/analysis.hpp"
#include "runtime/trace/network.hpp"
#include "tests/unit/runtime/trace/replay_helpers.hpp"
#include "tests/unit/runtime/trace/small_trace.hpp"

namespace talus::trace {
namespace {

using test::bare;
using test::makespan;

TEST(Replay, OfAChainIsItsSumOnAnyNumberOfThreads) {
  const Trace chain = test::one_loop({0, 1, 2, 3}, {{0, 1}, {1, 2}, {2, 3}}, {10, 20, 30, 40});
  for (int threads : {1, 2, 3}) EXPECT_DOUBLE_EQ(makespan(chain, bare(1, threads)), 100) << threads;
}

TEST(Replay, OfAForkIsTheLongestBranchWithEnoughThreads) {
  // One node, then three beside each other: 10 + 40 with a thread for each.
  const Trace fork = test::one_loop({0, 1, 1, 1}, {{0, 1}, {0, 2}, {0, 3}}, {10, 20, 30, 40});
  EXPECT_DOUBLE_EQ(makespan(fork, bare(1, 1)), 100);
  Machine machine = bare(1, 4);
  EXPECT_DOUBLE_EQ(makespan(fork, machine), 50);
  machine.unbounded = true;
  EXPECT_DOUBLE_EQ(makespan(fork, machine), 50);
}

TEST(Replay, OwnersAreThoseOfTheProgram) {
  // Four equal nodes without conflicts: two halves, 10 + 20 and 30 + 40. Free threads do better.
  const Trace apart = test::one_loop({0, 0, 0, 0}, {}, {10, 20, 30, 40});
  Machine machine = bare(1, 2);
  EXPECT_DOUBLE_EQ(makespan(apart, machine), 70);
  machine.schedule = Schedule::list;
  EXPECT_DOUBLE_EQ(makespan(apart, machine), 60);  // 10 + 30 and 20 + 40
}

TEST(Replay, EpochsOverlapWhereNothingConflicts) {
  // Two nodes on two threads for three epochs: no barrier between epochs, so each thread just goes on.
  const Trace loop = test::one_loop({0, 0}, {}, {10, 30}, 3);
  EXPECT_DOUBLE_EQ(makespan(loop, bare(1, 2)), 90);
  // With a conflict they alternate.
  const Trace tied = test::one_loop({0, 1}, {{0, 1}}, {10, 30}, 3);
  EXPECT_DOUBLE_EQ(makespan(tied, bare(1, 2)), 120);
}

TEST(Replay, HidesAMessageBehindTheInnerSweep) {
  // Two ranks; per epoch 100 (boundary) + 10 (publish) + 50 (inner) + 20 (glue). A message that needs less
  // than 50 ns is hidden, of one that needs more the rest is seen, in each of the two epochs.
  const Trace trace = test::two_subdomains(1);
  Machine machine = bare(2, 1);
  machine.latency = 30e-9;
  const double check = 30;  // one level of the tree of the decision, blocking
  EXPECT_DOUBLE_EQ(makespan(trace, machine), 2 * 180 + check);
  machine.latency = 80e-9;
  EXPECT_DOUBLE_EQ(makespan(trace, machine), 2 * (180 + 30) + 80);
}

TEST(Replay, BytesTakeTheirTimeOnTheLink) {
  const Trace trace = test::two_subdomains(1);
  Machine machine = bare(2, 1);
  machine.bandwidth = 1000 / 70e-9;  // the message of 1000 bytes takes 70 ns
  EXPECT_DOUBLE_EQ(makespan(trace, machine), 2 * (180 + 20));
  machine.contacts = 8;  // sweeps grow with the volume; messages, publish and glue with the faces
  EXPECT_DOUBLE_EQ(makespan(trace, machine), 2 * (8 * 150 + 4 * (10 + 20)));
}

TEST(Replay, OverheadIsPaidBySenderAndTaker) {
  const Trace trace = test::two_subdomains(1);
  Machine machine = bare(2, 1);
  machine.overhead = 5e-9;
  // Publish and glue take 5 ns more; so do both ends of the decision's message.
  EXPECT_DOUBLE_EQ(makespan(trace, machine), 2 * (180 + 10) + 10);
}

TEST(Replay, AMessageLeavesWhenThoseBeforeItHave) {
  // Three ranks, two messages each way, 20 ns of a core a message: what is sent first leaves 20 ns earlier,
  // and is taken while the other is under way. Were both sent at the end of publish, and taken when the last
  // has come, every rank would need 100 + 10 + 40 + latency + 40 + 20 in each epoch: 620 ns.
  const Trace trace = test::all_neighbours(3, 1);
  Machine machine = bare(3, 1);
  machine.latency = 100e-9;
  machine.overhead = 20e-9;
  const double sums = 2 * (100 + 2 * 20);
  EXPECT_DOUBLE_EQ(makespan(trace, machine), 600 + sums);
}

TEST(Replay, OfTwoRecordedRanksOnOneAddsThemUp) {
  const Trace two = test::two_subdomains(2);
  EXPECT_DOUBLE_EQ(makespan(two, bare(1, 1)), 2 * 2 * 180);
  EXPECT_DOUBLE_EQ(makespan(two, bare(2, 1)), 2 * 180);
}

// Rank 0 waits longer for rank 1, but goes on with what comes from rank 2.
TEST(CriticalPath, GoesToTheSenderOfTheLastMessage) {
  Trace trace = test::all_neighbours(3, 3);
  for (Track& track : trace.tracks)
    for (Record& record : track.records) {
      record.begin *= 100;
      record.duration *= 100;
    }
  std::vector<Record>& records = trace.tracks[0].records;
  const auto glue = std::ranges::find(records, test::glue, &Record::kind);
  const std::int64_t begin = glue->begin;
  for (auto later = std::next(glue); later != records.end(); ++later) later->begin += 3500;
  glue->duration += 3500;
  records.insert(std::next(glue), {{begin, 3000, message_name(1, 0), 0, pack(1, kind_receive)},
                                   {begin + 3000, 500, message_name(2, 0), 0, pack(1, kind_receive)}});
  const Timeline timeline(trace);
  const std::vector<PathHop> path = critical_path(timeline, timeline.index(1));
  const auto lane_of = [](const PathHop& hop) { return hop.place.track; };
  const auto crossing = std::ranges::find_if(
      path, [](std::uint32_t track) { return track != 0; }, lane_of);
  ASSERT_NE(crossing, path.end());
  EXPECT_EQ(crossing->place.track, 2u);
  EXPECT_EQ(timeline.record(crossing->place).kind(), test::publish);
}

TEST(CriticalPath, GoesFromTakerToSenderUpAndDownTheTreeOfRanks) {
  const Trace recorded = test::all_neighbours(40, 1, true);
  Machine machine = bare(40, 1);
  machine.latency = 1e-5;
  const Trace played = replay(Timeline(recorded), machine, true).trace;
  const Timeline timeline(played);
  const std::vector<PathHop> path = critical_path(timeline, timeline.index(1));
  int crossings = 0;
  for (std::size_t k = 1; k < path.size(); ++k) {
    const Record &later = timeline.record(path[k - 1].place), &before = timeline.record(path[k].place);
    if (later.kind() == kind_check || before.epoch < 0) continue;  // sums; tasks of no length
    const bool crosses =
        played.tracks[path[k].place.track].rank != played.tracks[path[k - 1].place.track].rank;
    crossings += crosses;
    EXPECT_NEAR(path[k - 1].from - path[k].until, crosses ? 1e4 : 0, 1) << "hop " << k;
  }
  // In each of two epochs to the root and back, over ranks between.
  EXPECT_GE(crossings, 8);
}

TEST(Replay, WaitsAreRecordedAsWaits) {
  const Trace trace = test::two_subdomains(1);
  for (const Schedule schedule : {Schedule::fixed, Schedule::list}) {
    Machine machine = bare(2, 1);
    machine.schedule = schedule;
    machine.latency = 80e-9;
    const Replay played = replay(Timeline(trace), machine, true);
    EXPECT_NO_THROW(validate(played.trace));
    const Summary sum = analyse(played.trace);
    EXPECT_TRUE(sum.predicted);
    EXPECT_DOUBLE_EQ(played.work, 2 * 2 * 180);
    EXPECT_NEAR(sum.work, played.work, 1e-3);  // records are single precision
    EXPECT_NEAR(sum.exposed, 2 * (2 * 30 + 80), 1e-3);
    EXPECT_NEAR(sum.idle, 0, 1e-3);
    EXPECT_EQ(sum.messages, 4u);
  }
}

TEST(Replay, OfAReplayIsTheSame) {
  const Trace trace = test::two_subdomains(1);
  Machine machine = bare(2, 1);
  machine.latency = 30e-9;
  const Replay once = replay(Timeline(trace), machine, true);
  EXPECT_NO_THROW(validate(once.trace));
  EXPECT_DOUBLE_EQ(makespan(once.trace, machine), once.makespan);
}

TEST(Replay, TypicalTimesLeaveInterruptionsOut) {
  // A node of 10 ns in five epochs, once interrupted for 1000 ns.
  Trace trace = test::one_loop({0}, {}, {10}, 5);
  for (Record& record : trace.tracks[0].records) {
    if (record.begin >= 40) record.begin += 990;
    if (record.epoch == 3 && record.kind() == test::sweep) record.duration = 1000;
  }
  Machine machine = bare(1, 1);
  EXPECT_DOUBLE_EQ(makespan(trace, machine), 1040);
  machine.typical = true;
  EXPECT_DOUBLE_EQ(makespan(trace, machine), 50);
}

TEST(Replay, TypicalTimesLeaveInterruptedTasksOfSubdomainsOut) {
  // Five alike before the loop, one of them interrupted.
  Trace trace = test::one_loop({0}, {}, {10});
  trace.tasks[0].clear();
  std::vector<Record> before;
  for (std::uint32_t i = 0; i < 5; ++i) {
    trace.tasks[0].push_back({"task", test::task, 0, false, {}});
    before.push_back({100 * i, i == 2 ? 90.0F : 8.0F, i, -1, pack(1, test::task)});
  }
  trace.tasks[0].push_back({"loop", kind_team, -1, true, {0, 1, 2, 3, 4}});
  std::vector<Record>& records = trace.tracks[0].records;
  std::erase_if(records, [](const Record& record) { return record.epoch < 0; });
  for (Record& record : records) record.begin += 1000;
  records.insert(records.begin(), before.begin(), before.end());
  Machine machine = bare(1, 1);
  EXPECT_DOUBLE_EQ(makespan(trace, machine), 4 * 8 + 90 + 10);
  machine.typical = true;
  EXPECT_DOUBLE_EQ(makespan(trace, machine), 5 * 8 + 10);
}

TEST(Replay, AQuantileStandsForAllTimesOfANode) {
  // Ten epochs of 10 ns, seven of them on a busy machine.
  Trace trace = test::one_loop({0}, {}, {10}, 10);
  std::int64_t late = 0;
  for (Record& record : trace.tracks[0].records) {
    record.begin += late;
    if (record.kind() != test::sweep || record.epoch < 3) continue;
    record.duration = 25;
    late += 15;
  }
  Machine machine = bare(1, 1);
  EXPECT_DOUBLE_EQ(makespan(trace, machine), 3 * 10 + 7 * 25);
  machine.quantile = 0.2;
  EXPECT_DOUBLE_EQ(makespan(trace, machine), 10 * 10);
  machine.quantile = 1.5;
  EXPECT_THROW(makespan(trace, machine), std::invalid_argument);
}

TEST(Replay, RefusesMachinesWhoseStepsEndBeyondItsClock) {
  const Trace trace = test::one_loop({0}, {}, {10}, 10);
  const auto refused = [&](const std::string& what, const auto& set) {
    Machine machine = bare(1, 1);
    set(machine);
    try {
      makespan(trace, machine);
      ADD_FAILURE() << what;
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find(what), std::string::npos) << error.what();
    }
  };
  for (const double far : {1e9, 1e300, std::numeric_limits<double>::infinity(), std::nan("")}) {
    refused("latency [s] must be 0 to 1000, got", [&](Machine& machine) { machine.latency = far; });
    refused("noise must be 0 to", [&](Machine& machine) { machine.noise = far; });
    refused("contacts scale must be", [&](Machine& machine) { machine.contacts = far; });
    refused("speed must be", [&](Machine& machine) { machine.speed = 1 / far; });
    refused("bandwidth [B/s] must be", [&](Machine& machine) { machine.bandwidth = 1 / far; });
  }
  refused("ranks must be at least 1, got -1", [](Machine& machine) { machine.ranks = -1; });
  refused("ranks per node must be at least 1", [](Machine& machine) { machine.ranks_per_node = 0; });
}

TEST(Replay, KeepsNodesApartThatMeetBetweenNanoseconds) {
  Machine machine = bare(2, 1);
  machine.bandwidth = 12e9;  // 83 1/3 ns a message: every second glue ends within a nanosecond
  const Replay played = replay(Timeline(test::two_subdomains(1)), machine, true);
  EXPECT_NEAR(analyse(played.trace).work, played.work, 2);
}

TEST(Replay, NoiseIsTheSameForTheSameSeed) {
  const Trace trace = test::two_subdomains(1);
  Machine machine = bare(1, 1);
  machine.noise = 0.5;
  const double once = makespan(trace, machine);
  EXPECT_EQ(makespan(trace, machine), once);
  EXPECT_GT(once, 720);
  EXPECT_LT(once, 1.5 * 720);
  machine.seed = 2;
  EXPECT_NE(makespan(trace, machine), once);
}

/// What a thread needs from one node to the next, 10 ns, is seen between records.
Trace with_gaps(Trace trace) {
  std::int64_t gaps = 0;
  for (Record& record : trace.tracks[0].records) record.begin += 10 * gaps++;
  return trace;
}

TEST(Replay, NoMachineBeatsItsBounds) {
  const Trace trace = with_gaps(
      test::one_loop({0, 1, 0, 1, 2}, {{0, 1}, {1, 2}, {2, 3}, {3, 4}, {0, 4}}, {13, 7, 29, 3, 17}, 5));
  Machine chain = bare(1, 1);
  chain.unbounded = true;
  const double longest = makespan(trace, chain);
  const double work = replay(Timeline(trace), bare(1, 1), false).work;
  for (const Schedule schedule : {Schedule::fixed, Schedule::list})
    for (int threads : {1, 2, 3, 5}) {
      Machine machine = bare(1, threads);
      machine.schedule = schedule;
      EXPECT_GE(makespan(trace, machine), longest) << threads;
      EXPECT_GE(makespan(trace, machine), work / threads) << threads;
    }
}

// Links that are shared, and slow: who sends in another order may be the sooner for it.
TEST(Replay, NoNetworkBeatsTheLongestChain) {
  Trace trace = with_gaps(test::all_neighbours(8, 1, true));
  for (Plan& plan : trace.plans)
    for (std::size_t k = 0; k < plan.messages.size(); ++k)
      plan.messages[k].bytes = static_cast<std::uint32_t>(1 + (k * 7919) % 1500);
  for (const int ranks : {2, 4, 8})
    for (const int ranks_per_node : {1, 2})
      for (const double bandwidth : {1e9, 5e9, 2e10}) {
        Machine machine = bare(ranks, 1);
        machine.ranks_per_node = ranks_per_node;
        machine.bandwidth = bandwidth;
        machine.latency = 100e-9;
        machine.overhead = 5e-9;
        Machine chain = machine;
        chain.unbounded = true;
        for (const Schedule schedule : {Schedule::fixed, Schedule::list})
          for (const int threads : {1, 2, 4}) {
            machine.schedule = schedule;
            machine.threads = chain.threads = threads;
            EXPECT_GE(makespan(trace, machine), makespan(trace, chain))
                << ranks << " x " << threads << ", " << ranks_per_node << " a node, " << bandwidth;
          }
      }
}

TEST(Replay, KindsOfTasksMayHaveSpeedsOfTheirOwn) {
  const Trace trace = test::two_subdomains(1);
  const double alone = makespan(trace, bare(1, 1));
  Machine machine = bare(1, 1);
  machine.speed = 2;
  EXPECT_DOUBLE_EQ(makespan(trace, machine), alone / 2);
  double publishes = 0;
  for (const Record& record : trace.tracks[0].records)
    if (trace.info(record.kind()).name == "publish") publishes += static_cast<double>(record.duration);
  ASSERT_GT(publishes, 0);
  machine.speed_of["publish"] = 4;
  EXPECT_DOUBLE_EQ(makespan(trace, machine), (alone - publishes) / 2 + publishes / 4);
}

TEST(RecordedMachine, HasTheMapOfItsRanks) {
  for (const RankMap map : {RankMap::block, RankMap::cyclic}) {
    Machine machine = bare(2, 1);
    machine.map = map;
    Trace trace = replay(Timeline(test::all_neighbours(4, 1)), machine, true).trace;
    const Machine there = recorded_machine(trace);
    EXPECT_EQ(name_of(there.map), name_of(map)) << "a prediction knows its machine";
    EXPECT_EQ(there.node_latency, machine.node_latency);
    trace.machine.reset();
    EXPECT_EQ(name_of(recorded_machine(trace).map), name_of(map));
  }
}

TEST(SmpiPlatform, RefusesWhatItCannotSay) {
  const auto refuses = [](auto change) {
    Machine machine;
    machine.ranks = 2;
    EXPECT_NO_THROW(io::smpi_platform(machine));
    change(machine);
    EXPECT_THROW(io::smpi_platform(machine), std::invalid_argument);
  };
  refuses([](Machine& machine) { machine.noise = 0.1; });
  refuses([](Machine& machine) { machine.speed_of["sweep"] = 2; });
  refuses([](Machine& machine) { machine.schedule = Schedule::list; });
}

TEST(Replay, RefusesMachinesThatMakeNoSense) {
  const Trace trace = test::two_subdomains(1);
  EXPECT_THROW(makespan(trace, bare(3, 1)), std::invalid_argument);  // more ranks than subdomains
  EXPECT_THROW(makespan(trace, bare(1, 0)), std::invalid_argument);
  Machine slow = bare(1, 1);
  slow.bandwidth = 0;
  EXPECT_THROW(makespan(trace, slow), std::invalid_argument);
  Machine misspelt = bare(1, 1);
  misspelt.speed_of["swep"] = 2;
  EXPECT_THROW(makespan(trace, misspelt), std::invalid_argument);
  EXPECT_THROW(rank_map_named("random"), std::invalid_argument);
}

TEST(Network, MessagesOfOneNodeShareItsLink) {
  Machine machine;
  machine.ranks = 4;
  machine.ranks_per_node = 2;
  machine.latency = 100e-9;
  machine.bandwidth = 1e9;  // a byte a ns
  machine.node_latency = 10e-9;
  machine.node_bandwidth = 2e9;
  Network network(machine);
  EXPECT_DOUBLE_EQ(network.arrival(0, 2, 50, 0), 150);
  EXPECT_DOUBLE_EQ(network.arrival(1, 3, 50, 0), 200);      // leaves behind the first
  EXPECT_DOUBLE_EQ(network.arrival(0, 1, 50, 0), 35);       // inside the node
  EXPECT_DOUBLE_EQ(network.arrival(0, 2, 50, 1000), 1150);  // the link is free again
}

}  // namespace
}  // namespace talus::trace
