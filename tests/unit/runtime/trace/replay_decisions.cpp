/// What all ranks decide and add up together, played again.

#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <vector>

#include "runtime/trace/analysis.hpp"
#include "runtime/trace/network.hpp"
#include "runtime/trace/recorder.hpp"
#include "runtime/trace/replay.hpp"
#include "runtime/trace/task_times.hpp"
#include "tests/unit/runtime/trace/replay_helpers.hpp"
#include "tests/unit/runtime/trace/small_trace.hpp"

namespace talus::trace {
namespace {

using test::bare;
using test::makespan;

// What a task or the program between two steps asks of all ranks is in a trace of one rank, where it takes no
// time.
TEST(ReplayDecisions, RanksMeetInEveryCallThatOneRankMade) {
  Trace trace = test::two_subdomains(1);
  std::vector<Record>& records = trace.tracks[0].records;
  // A step that began at 100 ns, behind 90 ns outside.
  for (Record& record : records) record.begin += 100;
  const auto call = [](std::int64_t at, std::uint32_t bytes) {
    return Record{at, 0, bytes, -1, pack(1, kind_collective)};
  };
  records.insert(records.begin(), {Record{10, 90, 0, -1, pack(1, kind_outside)}, call(50, 0)});
  const double alone = makespan(trace, bare(1, 1));
  Machine network = bare(2, 1), none = network;
  network.latency = 1e-6;
  network.bandwidth = 1e9;
  const auto calls_alone = [&] { return makespan(trace, network) - makespan(trace, none); };
  const double before = calls_alone();
  records.insert(records.begin() + 1, {call(20, 0), call(30, 7)});
  EXPECT_DOUBLE_EQ(calls_alone() - before, 2 * 1000 + 7);
  Record& task = records[4];
  ASSERT_EQ(task.kind(), test::task);
  task.begin -= 10;  // 10 ns of work, with a call within
  task.duration = 10;
  records[0].duration -= 10;
  records.insert(records.begin() + 5, call(95, 0));
  EXPECT_DOUBLE_EQ(calls_alone() - before, 3 * 1000 + 7);
  EXPECT_DOUBLE_EQ(makespan(trace, bare(1, 1)), alone);
  // A prediction is a trace, and has them too.
  const double of_two = makespan(trace, network);
  for (const Machine& machine : {bare(1, 1), network}) {
    const Replay played = replay(Timeline(trace), machine, true);
    EXPECT_DOUBLE_EQ(makespan(played.trace, network), of_two) << machine.ranks << " ranks";
  }
}

// Durations are floats: the end of what took a second is known to 64 ns.
TEST(ReplayDecisions, CountsACallAtTheVeryEndOfALongTask) {
  Trace trace = test::two_subdomains(1);
  std::vector<Record>& records = trace.tracks[0].records;
  constexpr std::int64_t second = 1'000'000'031;
  for (Record& record : records) record.begin += second;
  const Record outside{0, static_cast<float>(second), 0, -1, pack(1, kind_outside)},
      call{second - 41, 31, 0, -1, pack(1, kind_collective)};
  ASSERT_GT(call.end(), outside.end());
  records.insert(records.begin(), {outside, call});
  EXPECT_EQ(Timeline(trace).index(1).ranks[0].calls_outside.count, 1);
}

TEST(ReplayDecisions, ChecksAfterEverySweepAreReadASweepLater) {
  Trace trace = test::two_subdomains(1);
  std::vector<Record>& records = trace.tracks[0].records;
  const auto second =
      std::find_if(records.begin(), records.end(), [](const Record& r) { return r.epoch == 1; });
  records.insert(second, {second->begin, 0, 0, 0, pack(1, kind_check)});
  for (const Schedule schedule : {Schedule::fixed, Schedule::list}) {
    Machine machine = bare(2, 1);
    machine.schedule = schedule;
    machine.late_check = true;
    const double late = makespan(trace, machine);
    machine.late_check = false;
    EXPECT_DOUBLE_EQ(late, 2 * makespan(trace, machine)) << "a sweep more, and one to undo it";
  }
}

// The last way of sums among four ranks begins when all have done the sweep behind the check; the first is
// hidden by it.
TEST(ReplayDecisions, SumsGoTheRestOfTheirWayWhenAllWait) {
  for (const Schedule schedule : {Schedule::fixed, Schedule::list}) {
    Machine machine = bare(2, 1);
    machine.schedule = schedule;
    machine.late_check = true;
    machine.latency = 40e-9;  // hidden where copies are glued
    const double two = makespan(test::all_neighbours(2, 1), machine);
    machine.ranks = 4;
    EXPECT_DOUBLE_EQ(makespan(test::all_neighbours(4, 1), machine), two + 40);
  }
}

/// Adds a copy of `epoch` that is number `e` and begins later by `now` [ns].
void repeat_epoch(const std::vector<Record>& epoch, std::int32_t e, std::int64_t now,
                  std::vector<Record>& records) {
  for (Record record : epoch) {
    record.begin += now;
    record.epoch = e;
    records.push_back(record);
  }
}

/// Two subdomains on one rank, twice: an epoch whose sums the next one needs (1 ns, two calls), another
/// without a decision, and one with a check.
Trace conjugate() {
  Trace trace = test::two_subdomains(1);
  std::vector<Record>& records = trace.tracks[0].records;
  const Record before = records.front(), behind = records.back();
  std::vector<Record> epochs[2];
  for (const Record& record : records)
    if (record.epoch >= 0 && record.kind() != kind_check) epochs[record.epoch].push_back(record);
  records = {before};
  std::int64_t now = 0;
  for (std::int32_t e = 0; e < 6; ++e) {
    repeat_epoch(epochs[0], e, now, records);
    now += 360;
    if (e % 3 == 0) {
      records.push_back({now, 1, 0, e, pack(1, kind_check)});
      for (int call = 0; call < 2; ++call) records.push_back({now, 0, 0, -1, pack(1, kind_collective)});
      ++now;
    } else if (e % 3 == 2) {
      records.push_back({now, 0, 0, e, pack(1, kind_check)});
    }
  }
  records.push_back(behind);
  records.back().begin = now;
  return trace;
}

// Sums of a check are read where others are awaited besides: none of them stands for the other.
TEST(ReplayDecisions, SumsThatAreReadLaterHideNoOthers) {
  for (const Schedule schedule : {Schedule::fixed, Schedule::list}) {
    Machine machine = bare(2, 1);
    machine.schedule = schedule;
    machine.latency = 200e-9;
    const double epoch = 130 + 200;  // the inner sweep hides 50 ns of each exchange
    EXPECT_DOUBLE_EQ(makespan(conjugate(), machine), 6 * epoch + 2 * (200 + 1) + 2 * 200);
    machine.late_check = true;  // a sweep with sums of its own, and what undoes it, more
    const Replay late = replay(Timeline(conjugate()), machine, true);
    EXPECT_DOUBLE_EQ(late.makespan, 8 * epoch + 3 * (200 + 1));
    EXPECT_DOUBLE_EQ(makespan(late.trace, machine), late.makespan) << "again";
  }
}

TEST(ReplayDecisions, ACheckThatSettlesIsReadAtOnce) {
  Trace trace = test::two_subdomains(1);
  std::vector<Record>& records = trace.tracks[0].records;
  std::ranges::find(records, kind_check, &Record::kind)->node = check_settles;
  Machine machine = bare(2, 1);
  machine.late_check = true;
  EXPECT_DOUBLE_EQ(makespan(trace, machine), 2 * 180) << "no sweep more, nothing to undo";
}

/// A task in the last check of two subdomains, which takes 10 ns more: two gathers and three exchanges. Of
/// kind sweep all ranks and threads do it together, of kind task each rank its part.
Trace with_a_look(std::int64_t length = 80, Kind kind = test::sweep, double alone = 0, double longest = 0) {
  Trace trace = test::two_subdomains(1);
  std::vector<Record>& records = trace.tracks[0].records;
  const auto check = std::ranges::find(records, kind_check, &Record::kind);
  check->duration = static_cast<float>(length + 10);
  check->node = check_settles;
  std::prev(records.end())->begin += length + 10;
  records.insert(std::next(check), {check->begin + 10, static_cast<float>(length),
                                    Meetings{2, 3, alone, longest}.packed(), -1, pack(1, kind)});
  return trace;
}

TEST(ReplayDecisions, WhatAllRanksDoInACheckIsShared) {
  const Trace trace = with_a_look();
  EXPECT_DOUBLE_EQ(makespan(trace, bare(1, 1)), 4 * 180 + 90);
  Machine machine = bare(2, 1);
  EXPECT_DOUBLE_EQ(makespan(trace, machine), 2 * 180 + 10 + 40);
  machine.latency = 30e-9;  // of the check's own sums, two gathers and three exchanges
  EXPECT_DOUBLE_EQ(makespan(trace, machine), 2 * 180 + 10 + 40 + 6 * 30);
  const Replay played = replay(Timeline(trace), machine, true);
  EXPECT_NO_THROW(validate(played.trace));
  EXPECT_NEAR(analyse(played.trace).exposed, 2 * 6 * 30, 1e-3);
}

/// 80 ns of one thread: what comes before the pieces, and then the pieces on two threads, the longest on one.
TEST(ReplayDecisions, WhatOneThreadHasToDoAloneIsNotShared) {
  const double others = makespan(test::two_subdomains(1), bare(1, 2));
  constexpr double ninth = 7.0 / 63;
  struct Case {
    double alone, longest, on_two_threads, on_two_ranks;  // of nine parts of the work
  };
  for (const auto& [alone, longest, on_two_threads, on_two_ranks] :
       {Case{0, 9, 9, 9}, {0, 6, 6, 6}, {9, 0, 9, 4.5}, {3, 2, 3 + 3, 1.5 + 3}, {3, 4, 3 + 4, 1.5 + 4}}) {
    const Trace trace = with_a_look(80, test::sweep, ninth * alone, ninth * longest);
    EXPECT_NEAR(makespan(trace, bare(1, 1)), 4 * 180 + 90, 1e-9) << alone << ' ' << longest;
    EXPECT_NEAR(makespan(trace, bare(1, 2)), others + 10 + 80 * on_two_threads / 9, 1e-9)
        << alone << ' ' << longest;
    EXPECT_NEAR(makespan(trace, bare(2, 1)), 2 * 180 + 10 + 80 * on_two_ranks / 9, 1e-9)
        << alone << ' ' << longest;
    const Replay played = replay(Timeline(trace), bare(1, 2), true);
    EXPECT_NEAR(makespan(played.trace, bare(1, 2)), played.makespan, 1) << alone << ": played again";
    EXPECT_NEAR(makespan(played.trace, bare(1, 1)), 4 * 180 + 90, 2) << alone << ": on one thread again";
  }
}

TEST(Meetings, KeepWhatTheyCount) {
  for (const auto& [alone, longest] : {std::pair{0.0, 0.0}, {1.0, 0.0}, {0.0, 1.0}, {21.0 / 63, 42.0 / 63}}) {
    const Meetings kept = Meetings::of(Meetings{Meetings::most, 17, alone, longest}.packed());
    EXPECT_EQ(kept.gathers, Meetings::most);
    EXPECT_EQ(kept.exchanges, 17);
    EXPECT_EQ(kept.alone, alone);
    EXPECT_EQ(kept.longest, longest);
  }
  for (const double alone : {0.1, 0.25, 0.5, 0.9})
    EXPECT_EQ(Meetings::of(Meetings{1, 2, alone, 1 - alone}.packed()).time_on(1), 1) << "rounding, too";
}

/// A second before four pieces of a second each, on one thread and on four, as the others would be waited
/// for.
TEST(SharedWork, TellsWhatFollowsForOtherThreads) {
  for (const auto& [work, span] : {std::pair{SharedWork{4, 0, 4, 1}, 5.0}, {SharedWork{1, 3, 4, 1}, 5.0}}) {
    Meetings told;
    work.tell(span, told);
    told = Meetings::of(told.packed());
    for (const auto& [threads, seconds] : {std::pair{1.0, 5.0}, {2.0, 3.0}, {4.0, 2.0}, {8.0, 2.0}})
      EXPECT_NEAR(5 * told.time_on(threads), seconds, 5.0 / 63) << threads;
  }
  Meetings none;
  SharedWork{}.tell(0, none);
  EXPECT_EQ(none.time_on(2), 0.5);
}

// What one rank added up for both subdomains, two ranks add up for one each; a second thread of it waits.
TEST(ReplayDecisions, WhatARankAddsUpInACheckGoesWithItsPart) {
  const Trace trace = with_a_look(80, test::task);
  EXPECT_DOUBLE_EQ(makespan(trace, bare(1, 1)), 4 * 180 + 90);
  EXPECT_DOUBLE_EQ(makespan(trace, bare(2, 1)), 2 * 180 + 10 + 40);
  EXPECT_DOUBLE_EQ(makespan(trace, bare(1, 2)), makespan(test::two_subdomains(1), bare(1, 2)) + 90);
  // A third thread finds no subdomain.
  for (const int threads : {2, 3})
    EXPECT_DOUBLE_EQ(makespan(with_a_look(), bare(1, threads)),
                     makespan(test::two_subdomains(1), bare(1, threads)) + 50);
  Machine machine = bare(2, 1);
  machine.schedule = Schedule::list;
  EXPECT_DOUBLE_EQ(makespan(trace, machine), 2 * 180 + 10 + 40);
}

TEST(ReplayDecisions, SumsOfAPredictedCheckArePlayedAgain) {
  const Replay played = replay(Timeline(with_a_look(80, test::task)), bare(2, 1), true);
  EXPECT_NO_THROW(validate(played.trace));
  EXPECT_DOUBLE_EQ(makespan(played.trace, bare(2, 1)), 2 * 180 + 10 + 40);
}

// The sweep that hides the sums of a check, and its undoing, have none of their own.
TEST(ReplayDecisions, ALateCheckAddsUpOnce) {
  Trace trace = with_a_look(80, test::task);
  std::ranges::find(trace.tracks[0].records, kind_check, &Record::kind)->node = 0;
  const Trace without = test::two_subdomains(1);
  Machine machine = bare(2, 1);
  machine.late_check = true;
  EXPECT_DOUBLE_EQ(makespan(trace, machine), makespan(without, machine) + 10 + 40);
}

/// Nor is what the ranks did together in a check before done again in them. Checks behind each of four
/// epochs, and in the first of them a look of so many ns.
Trace with_an_early_look(std::int64_t length) {
  Trace trace = test::two_subdomains(1);
  std::vector<Record>& records = trace.tracks[0].records;
  const Record before = records.front(), behind = records.back();
  std::vector<Record> epoch;
  for (const Record& record : records)
    if (record.epoch == 0 && record.kind() != kind_check) epoch.push_back(record);
  records = {before};
  std::int64_t now = 0;
  for (std::int32_t e = 0; e < 4; ++e) {
    repeat_epoch(epoch, e, now, records);
    now += 360;
    const std::int64_t look = e == 0 ? length : 0;
    records.push_back({now, static_cast<float>(look), 0, e, pack(1, kind_check)});
    if (look > 0) records.push_back({now, static_cast<float>(look), 0, -1, pack(1, test::sweep)});
    now += look;
  }
  records.push_back(behind);
  records.back().begin = now;
  return trace;
}

TEST(ReplayDecisions, TheSweepThatHidesSumsDoesNoEarlierLookAgain) {
  for (const Schedule schedule : {Schedule::fixed, Schedule::list}) {
    Machine machine = bare(2, 1);
    machine.schedule = schedule;
    machine.late_check = true;
    EXPECT_DOUBLE_EQ(makespan(with_an_early_look(80), machine),
                     makespan(with_an_early_look(0), machine) + 40);
  }
}

// More contacts make chunks longer, not more of them.
TEST(ReplayDecisions, LongerChunksAreAddedUpAsFast) {
  Machine machine = bare(1, 1);
  machine.contacts = 2;
  EXPECT_DOUBLE_EQ(makespan(with_a_look(80, test::task), machine),
                   makespan(test::two_subdomains(1), machine) + 90);
}

TEST(ReplayDecisions, ATraceThatHasANodeTwiceIsRefused) {
  Trace trace = with_a_look();
  Track& track = trace.tracks.front();
  const auto node = std::ranges::find_if(track.records, [](const Record& r) { return r.epoch == 0; });
  ASSERT_NE(node, track.records.end());
  track.records.insert(node, Record(*node));
  EXPECT_THROW(makespan(trace, bare(1, 1)), TraceError);
}

TEST(TaskTimes, AreThoseOfTheReplay) {
  const Trace trace = with_a_look();
  TaskTimes times(trace, 2, 1);
  EXPECT_FALSE(times.begin_step(2));
  ASSERT_TRUE(times.begin_step(1));
  EXPECT_THROW(times.node(0, 0), TraceError) << "whose loop is not known yet";
  times.plan(test::two_subdomains(2).plans[1]);
  EXPECT_DOUBLE_EQ(times.task(0), 0);
  // Of one subdomain: sweep, inner sweep, publish, root, glue.
  const double nodes[] = {100e-9, 50e-9, 10e-9, 0, 20e-9};
  for (std::uint32_t n = 0; n < 5; ++n) EXPECT_NEAR(times.node(n, 0), nodes[n], 1e-15) << n;
  EXPECT_NEAR(times.decision(1), 50e-9, 1e-15);
  EXPECT_THROW(times.decision(0), TraceError);
  EXPECT_THROW(times.node(0, 9), TraceError);
  EXPECT_NO_THROW(times.check(test::three_tasks()));
  EXPECT_THROW(times.check(std::vector<Task>{}), TraceError);
  times.plan(trace.plans[0]);  // of both subdomains
  EXPECT_THROW(times.node(0, 0), TraceError);
}

TEST(TaskTimes, HoldWhatTakesLongerThanTheDigitsOfARecord) {
  const std::int64_t length = 782263171;  // known to 64 ns
  TaskTimes times(with_a_look(length), 1, 0);
  ASSERT_TRUE(times.begin_step(1));
  EXPECT_NEAR(times.decision(1), 1e-9 * static_cast<double>(length), 1e-6);
}

TEST(Network, AddsUpInAMessageForEachDoublingOfRanks) {
  Machine machine = bare(16, 1);
  machine.ranks_per_node = 4;
  machine.latency = 100e-9;
  machine.overhead = 5e-9;
  machine.bandwidth = 1e9;  // a byte a ns
  machine.node_latency = 10e-9;
  machine.node_bandwidth = 2e9;
  const Network network(machine);
  const double round_between = 110, round_inside = 20;
  EXPECT_DOUBLE_EQ(network.time_of({3, 0}), 3 * (2 * round_between + 2 * round_inside));
  // 8 bytes: four times over the link in each round between nodes.
  EXPECT_DOUBLE_EQ(network.time_of({1, 8}), 2 * (round_between + 32) + 2 * (round_inside + 4));
}

}  // namespace
}  // namespace talus::trace
