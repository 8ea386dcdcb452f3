#pragma once

/// State that the parts of a replay share: the machine, the recording, and the prediction.

#include <algorithm>
#include <cstdint>
#include <map>
#include <vector>

#include "runtime/trace/layout.hpp"
#include "runtime/trace/network.hpp"
#include "runtime/trace/replay.hpp"
#include "runtime/trace/timeline.hpp"

namespace talus::trace::detail {

/// Records what happens on the machine, and adds up its times.
class Log {
 public:
  Log(const Machine& machine, Trace* trace)
      : threads_(static_cast<std::uint32_t>(machine.threads)), trace_(trace) {}
  void begin_step(std::uint32_t step) { step_ = step; }
  /// What a record is of: a node or task of an epoch (-1: outside the loop).
  struct What {
    std::uint32_t node;
    std::int32_t epoch;
    Kind kind;
  };
  /// [begin, end) of a task, of which `waited` was waiting. [ns]
  struct TaskTime {
    double begin, end, waited;
  };
  void task(std::uint32_t worker, const TaskTime& time, const What& what) {
    work_ += time.end - time.begin - time.waited;
    ++tasks_;
    span(worker, time.begin, time.end, what);
  }
  /// A part of a task, or a thread's stay in a team. [ns]
  void span(std::uint32_t worker, double begin, double end, const What& what);
  /// Calls of all ranks in what began at `begin`, had done its own work at `end` and knew what it had asked
  /// for at `known`: one wait, and what else is called takes no time. One rank knows at once; its calls stand
  /// at the beginning, where they are within.
  void calls(std::uint32_t worker, double begin, double end, double known, const Calls& calls);
  double work() const { return work_; }
  std::size_t tasks() const { return tasks_; }
  std::uint32_t worker(std::uint32_t rank, std::uint32_t thread) const { return rank * threads_ + thread; }

 private:
  std::uint32_t threads_;
  Trace* trace_;  ///< null: nothing is kept
  std::uint32_t step_ = 0;
  double work_ = 0;
  std::size_t tasks_ = 0;
};

/// Everything that lasts for the whole replay.
struct Stage {
  const Timeline& timeline;
  const Machine& machine;
  Network network;
  Log log;
  /// With Machine::typical or quantile, of the step: per recorded rank and kind, the median of each node, or
  /// that quantile [ns].
  std::vector<std::map<Kind, std::vector<float>>> typical{};
  std::vector<double> speed{};  ///< per kind
  double dispatch = 0;          ///< from the end of one node to the beginning of the next on a thread [ns]
  double faces = 1;             ///< what copies grow by where contacts grow

  double speed_of(Kind kind) const { return speed[static_cast<std::size_t>(kind)]; }
  /// Factor on the work of a task, by what it is: the same in every replay of the same seed.
  double stretch(std::uint64_t step, std::uint64_t worker, std::uint64_t what) const;
};

/// Computes Stage::speed.
std::vector<double> speeds(const Machine& machine, const Trace& trace);

/// Computes Stage::typical for a step.
std::vector<std::map<Kind, std::vector<float>>> typical_times(const Timeline& timeline,
                                                              const StepIndex& index, double quantile);

/// Per recorded rank and kind of the step's tasks of single subdomains, which are like one another: the
/// quantile of their times, those of the spans within included. [ns]
std::vector<std::map<Kind, float>> typical_tasks(const Timeline& timeline, const StepIndex& index,
                                                 double quantile);

/// An epoch of the loop on the machine.
struct SimEpoch {
  std::size_t source = 0;  ///< recorded epoch whose work it has
  bool gate = false;       ///< a decision behind it
  bool posts = false;      ///< the sums of the rank leave at that decision, as round `round`
  std::size_t round = 0;
  std::vector<std::size_t> awaits{};  ///< rounds that it waits for, one after the other
  std::size_t calls = 0;              ///< of all ranks, where the one that there is knows at once
  bool settles = false;               ///< its record says so (check_settles)
  /// What all ranks do together at that decision: work, and waits for one another [ns]; its parts, one after
  /// the other.
  struct Span {
    double begin = 0, end = 0;  ///< in `whole`
    std::uint32_t meetings = 0;
    Kind kind{};
  };
  double whole = 0, meetings = 0;
  std::vector<Span> spans{};
  std::vector<double> own{};  ///< [ns] per rank: what each does for its own part before that
  Kind own_kind{};
  bool exchange = false;  ///< copies are glued
  std::size_t exchanges_before = 0;

  /// The same without what is done at its decision.
  SimEpoch undecided() const {
    SimEpoch bare = *this;
    bare.whole = bare.meetings = 0;
    bare.spans.clear();
    std::ranges::fill(bare.own, 0.0);
    return bare;
  }
};

/// The loop of one step as it is to be played. All of it must outlive the playing.
struct LoopRun {
  Stage& stage;
  const StepIndex& index;
  const LoopLayout& layout;
  const std::vector<SimEpoch>& epochs;
};

/// Plays it from `start` [ns], per rank; returns when each rank has left the loop.
std::vector<double> play_fixed(const LoopRun& run, const std::vector<double>& start);
std::vector<double> play_list(const LoopRun& run, const std::vector<double>& start);

/// A task of the step on a rank.
struct TimedTask {
  double work = 0;  ///< [ns]
  double part = 0;  ///< of it, in a span of kind `part_kind` [ns]
  Kind part_kind{};
  Calls calls{};
};

/// Tasks [begin[r], end[r]) of each rank r, and what they take. References are kept.
struct StepTasks {
  const std::vector<std::vector<SimTask>>& tasks;
  const std::vector<std::vector<TimedTask>>& timed;
  const std::vector<std::size_t>&begin, &end;
};
/// Plays them from `start` [ns] per rank, each thread taking the ready task that was submitted first; returns
/// when all tasks of a rank have ended.
std::vector<double> play_tasks(Stage& stage, const StepTasks& tasks, const std::vector<double>& start);

/// Work and kind of a node in an epoch; no work and no kind where nothing was recorded.
struct NodeWork {
  double work = 0;  ///< [ns]
  bool recorded = false;
  Kind kind{};
};
NodeWork work_of(const Stage& stage, const StepIndex& index, const SimNode& node, std::uint32_t number,
                 const SimEpoch& epoch, std::size_t number_of_epoch);
/// What a node adds to its work in an epoch that exchanges. [ns]
struct ExchangeWork {
  double takes = 0;   ///< each message that it takes
  double shares = 0;  ///< what goes between threads
  double sends = 0;   ///< all messages that it sends
};
ExchangeWork exchange_work(const Stage& stage, const LoopLayout& layout, std::uint32_t node);
/// Work of the decision behind an epoch. [ns]
double check_work(const Stage& stage, const StepIndex& index, const SimEpoch& epoch);
/// What recorded rank `source` did for its own part in the check of recorded epoch `e`. [ns]
double alone_work(const Stage& stage, const StepIndex& index, std::size_t source, std::size_t e);
/// When the decision of a rank behind an epoch began, when the rank had done its own part of it, of which
/// `own` was work of its own, and when all that follows was known. [ns]
struct CheckTime {
  double own, begin, decided, end;
};
void log_check(Stage& stage, std::uint32_t worker, std::int32_t number, const SimEpoch& epoch,
               const CheckTime& time);

}  // namespace talus::trace::detail
