#include "runtime/trace/replay.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "runtime/trace/detail/simulation.hpp"

namespace talus::trace {
namespace {

using namespace detail;

/// What a thread needs between two nodes of its walk when it need not wait: the mean of the gaps that are too
/// short for a wait. [ns]
double dispatch_time(const Trace& trace) {
  constexpr double longest = 1000;
  double sum = 0;
  std::size_t count = 0;
  for (const Track& track : trace.tracks) {
    const Record* last = nullptr;
    for (const Record& record : track.records) {
      if (record.epoch < 0 || is_communication(record.kind())) continue;
      if (last && last->epoch == record.epoch && last->step() == record.step()) {
        const double gap = static_cast<double>(record.begin) - last->end();
        if (gap >= 0 && gap < longest) {
          sum += gap;
          ++count;
        }
      }
      last = &record;
    }
  }
  return count > 0 ? sum / static_cast<double>(count) : 0;
}

class Player {
 public:
  Player(const Timeline& timeline, const Machine& machine, bool keep)
      : trace_(timeline.trace()),
        machine_(machine),
        groups_(groups_of(trace_)),
        stage_{timeline,
               machine_,
               Network(machine_),
               Log(machine_, keep ? &out_.trace : nullptr),
               {},
               speeds(machine_, trace_),
               trace_.predicted ? 0 : dispatch_time(trace_),
               machine_.faces()} {
    if (groups_.empty()) groups_.push_back(0);
    out_.trace.ranks = machine.ranks;
    out_.trace.threads = machine.threads;
    out_.trace.predicted = true;
    Machine& kept = out_.trace.machine.emplace();
    kept.ranks = machine.ranks;
    kept.threads = machine.threads;
    kept.map = machine.map;
    kept.ranks_per_node = machine.ranks_per_node;
    kept.node_latency = machine.node_latency;
    out_.trace.kinds = trace_.kinds;
    if (!keep) return;
    for (std::int32_t r = 0; r < machine.ranks; ++r)
      for (std::int32_t t = 0; t < machine.threads; ++t) out_.trace.tracks.push_back({r, t, {}});
  }

  Replay play() {
    std::vector<double> now(static_cast<std::size_t>(machine_.ranks), 0);
    for (std::uint32_t step : stage_.timeline.steps()) {
      const StepIndex index = stage_.timeline.index(step);
      lay_out_step(index);
      stage_.log.begin_step(step);
      if (usual_times()) {
        const double part = machine_.quantile > 0 ? machine_.quantile : 0.5;
        stage_.typical = typical_times(stage_.timeline, index, part);
        typical_tasks_ = typical_tasks(stage_.timeline, index, part);
      }
      play_step(index, now);
    }
    out_.makespan = *std::max_element(now.begin(), now.end());
    out_.work = stage_.log.work();
    out_.tasks = stage_.log.tasks();
    out_.dispatch = stage_.dispatch;
    if (!out_.trace.tracks.empty()) {
      for (const auto& rank : tasks_) {
        std::vector<Task>& tasks = out_.trace.tasks.emplace_back();
        for (const SimTask& task : rank) tasks.push_back(task.task);
      }
      sort_tracks(out_.trace);
    }
    return std::move(out_);
  }

 private:
  bool usual_times() const { return machine_.typical || machine_.quantile > 0; }

  void lay_out_step(const StepIndex& index) {
    std::vector<const Plan*> plans;
    for (const StepIndex::Rank& rank : index.ranks) {
      if (!rank.plan) throw TraceError(fmt::format("step {} has no plan of its loop", index.step));
      plans.push_back(rank.plan);
    }
    if (plans == plans_) return;
    plans_ = plans;
    weight_.assign(groups_.size(), 0);
    source_.assign(groups_.size(), 0);
    for (std::size_t s = 0; s < plans.size(); ++s)
      for (std::size_t n = 0; n < plans[s]->size(); ++n) {
        const auto at =
            std::lower_bound(groups_.begin(), groups_.end(), plans[s]->group[n]) - groups_.begin();
        if (at == static_cast<std::ptrdiff_t>(groups_.size())) continue;  // the root
        weight_[static_cast<std::size_t>(at)] += plans[s]->weight[n];
        source_[static_cast<std::size_t>(at)] = s;
      }
    // Where subdomains are is settled once, as in a run; only the program's own tasks depend on it.
    if (rank_of_.empty()) {
      rank_of_ = map_groups(weight_, machine_);
      tasks_ = lay_out_tasks(trace_, groups_, rank_of_, machine_.ranks);
    }
    layout_ = lay_out(plans_, groups_, rank_of_, machine_);
    if (out_.trace.tracks.empty()) return;
    for (Plan plan : layout_.plans) {
      plan.step = index.step;
      out_.trace.plans.push_back(std::move(plan));
    }
  }

  /// Part of the work of recorded rank `source` that rank r has.
  double share(std::size_t r, std::size_t source) const {
    double whole = 0, mine = 0;
    for (std::size_t g = 0; g < groups_.size(); ++g) {
      if (source_[g] != source) continue;
      whole += static_cast<double>(weight_[g]);
      if (rank_of_[g] == r) mine += static_cast<double>(weight_[g]);
    }
    return whole > 0 ? mine / whole : 1.0 / machine_.ranks;
  }

  /// Threads of a rank that find a subdomain to work on.
  template <class Rank>
  static double helpers(const std::vector<Rank>& rank_of, Rank rank, int threads) {
    return static_cast<double>(std::clamp<std::ptrdiff_t>(std::ranges::count(rank_of, rank), 1, threads));
  }

  TimedTask time_task(const StepIndex& index, std::size_t r, const SimTask& task, std::size_t number) const {
    TimedTask timed;
    const KindInfo& info = trace_.info(task.task.kind);
    for (const SimTask::Source& source : task.sources) {
      const StepIndex::Rank& recorded = index.ranks[static_cast<std::size_t>(source.rank)];
      const Place part = recorded.part[source.task];
      double own = stage_.timeline.self(recorded.task[source.task]), inside = stage_.timeline.self(part);
      if (usual_times() && task.task.group >= 0) {
        const double usual = typical_tasks_[static_cast<std::size_t>(source.rank)].at(task.task.kind);
        if (own + inside > (machine_.quantile > 0 ? 0 : 3 * usual)) {
          const double part_left = usual / (own + inside);
          own *= part_left;
          inside *= part_left;
        }
      }
      if (task.task.group >= 0 || info.shared) {
        const double of_rank = task.task.group >= 0 ? 1 : share(r, static_cast<std::size_t>(source.rank));
        timed.work += of_rank * (own + inside);
        timed.part += of_rank * inside;
      } else {
        timed.work = std::max(timed.work, own + inside);
      }
      if (part.exists()) timed.part_kind = stage_.timeline.record(part).kind();
      timed.calls.raise_to(recorded.calls[source.task]);
    }
    const double scale = machine_.contacts / stage_.speed_of(task.task.kind) *
                         stage_.stretch(index.step, r, ~std::uint64_t{number});
    timed.work *= scale;
    timed.part *= scale;
    return timed;
  }

  void play_step(const StepIndex& index, std::vector<double>& now) {
    const std::size_t ranks = now.size();
    go_between_steps(index, now);
    std::vector<std::vector<TimedTask>> timed(ranks);
    std::vector<std::size_t> none(ranks, 0), loop(ranks), behind(ranks), all(ranks);
    for (std::size_t r = 0; r < ranks; ++r) {
      for (std::size_t i = 0; i < tasks_[r].size(); ++i) {
        timed[r].push_back(tasks_[r][i].task.team ? TimedTask{} : time_task(index, r, tasks_[r][i], i));
        if (tasks_[r][i].task.team) loop[r] = i;
      }
      all[r] = tasks_[r].size();
      behind[r] = std::min(loop[r] + 1, all[r]);
    }
    now = play_tasks(stage_, {tasks_, timed, none, loop}, now);
    if (const std::vector<SimEpoch> epochs = epochs_of(index); !epochs.empty()) {
      const std::vector<double> begun = now;
      const LoopRun run{stage_, index, layout_, epochs};
      now = machine_.schedule == Schedule::list || machine_.unbounded ? play_list(run, begun)
                                                                      : play_fixed(run, begun);
      for (std::uint32_t r = 0; r < ranks; ++r)
        for (std::uint32_t t = 0; t < static_cast<std::uint32_t>(machine_.threads); ++t)
          stage_.log.span(stage_.log.worker(r, t), begun[r], now[r],
                          {static_cast<std::uint32_t>(loop[r]), -1, kind_team});
    }
    now = play_tasks(stage_, {tasks_, timed, behind, all}, now);
  }

  /// What the program does outside of the graph.
  void go_between_steps(const StepIndex& index, std::vector<double>& now) {
    bool any = false;
    Calls calls;
    for (const StepIndex::Rank& rank : index.ranks) calls.raise_to(rank.calls_outside);
    const bool meet = now.size() > 1 && calls.count > 0;
    std::vector<double> worked = now;
    for (std::size_t r = 0; r < now.size(); ++r)
      for (std::size_t s = 0; s < index.ranks.size(); ++s) {
        if (!index.ranks[s].outside.exists()) continue;
        worked[r] += share(r, s) * stage_.timeline.self(index.ranks[s].outside) * machine_.contacts /
                     stage_.speed_of(kind_outside);
        any = true;
      }
    if (!any) return;
    const double last = *std::max_element(worked.begin(), worked.end());
    for (std::uint32_t r = 0; r < now.size(); ++r) {
      const double end = meet ? last + stage_.network.time_of(calls) : worked[r];
      stage_.log.task(stage_.log.worker(r, 0), {now[r], end, end - worked[r]}, {0, -1, kind_outside});
      stage_.log.calls(stage_.log.worker(r, 0), now[r], worked[r], end, calls);
      now[r] = end;
    }
  }

  bool exchanges(const StepIndex& index, std::size_t epoch) const {
    for (const StepIndex::Rank& rank : index.ranks)
      for (std::size_t n = 0; n < rank.nodes; ++n)
        if (rank.plan->role[n] == static_cast<std::uint8_t>(Role::publish) && rank.at(epoch, n).exists())
          return true;
    return false;
  }

  /// The recorded epochs, with decisions as the machine needs them: a run of one rank reads its sums at once;
  /// a run of several posts them and reads them a sweep later, so it has one sweep more in the end, and
  /// undoes it (runtime/step/epoch_schedule.hpp).
  std::vector<SimEpoch> epochs_of(const StepIndex& index) const {
    const StepIndex::Rank& recorded = index.ranks[0];
    for (const StepIndex::Rank& rank : index.ranks)
      if (rank.epochs != recorded.epochs)
        throw TraceError(fmt::format("step {} has {} epochs on one rank and {} on another", index.step,
                                     recorded.epochs, rank.epochs));
    const bool alone = machine_.ranks == 1, late = !alone && trace_.ranks == 1 && machine_.late_check;
    // What called all ranks within is no check of convergence: sums that the next sweep needs.
    const auto reads_later = [&](std::size_t e) {
      return late && recorded.check[e].exists() && recorded.settled[e] == 0 && recorded.awaited[e] == 0;
    };
    std::vector<SimEpoch> epochs;
    std::size_t exchanged = 0, rounds = 0, unread = 0;
    const auto add = [&](SimEpoch& epoch, bool posts, bool waits, bool reads) {
      epoch.posts = posts;
      epoch.round = rounds;
      epoch.awaits.clear();
      if (waits) epoch.awaits.push_back(rounds);
      if (reads) epoch.awaits.push_back(unread);
      if (posts && !waits) unread = rounds;
      rounds += posts ? 1 : 0;
      epoch.exchanges_before = exchanged;
      exchanged += epoch.exchange ? 1 : 0;
      epochs.push_back(std::move(epoch));
    };
    bool read_next = false, is_unread = false;  // sums that were posted: as played, as recorded by several
    for (std::size_t e = 0; e < recorded.epochs; ++e) {
      SimEpoch epoch;
      epoch.source = e;
      epoch.gate = recorded.check[e].exists();
      epoch.settles = recorded.settled[e] != 0;
      const auto awaited = static_cast<std::size_t>(recorded.awaited[e]);
      if (alone && trace_.ranks == 1) epoch.calls = awaited;
      do_alone(index, e, epoch);
      if (!reads_later(e)) do_together(index, e, epoch);
      epoch.exchange = exchanges(index, e);
      bool posts = !alone && epoch.gate, waits = posts && !reads_later(e), reads = read_next;
      if (posts && trace_.ranks > 1) {
        // What was posted before is one call; whatever else was awaited the epoch had posted itself.
        reads = is_unread && awaited > 0;
        waits = awaited > (is_unread ? 1 : 0);
        // A gate that waits for nobody posts what the next one that does reads.
        const bool sets_out = !is_unread && awaited == 0 && next_reads(recorded, e);
        posts = waits || sets_out;
        is_unread = sets_out;
      }
      // What follows from the sums of a recorded epoch is done where they are read.
      if (read_next) do_together(index, e - 1, epoch);
      epoch.gate = epoch.gate || read_next;
      read_next = reads_later(e);
      add(epoch, posts, waits, reads);
    }
    if (read_next) {
      const std::size_t last = epochs.size() - 1, like = last >= 2 ? last - 2 : 0;
      SimEpoch sweep = epochs[like].undecided(), undo = epochs[last >= 1 ? last - 1 : 0].undecided();
      const bool waits = recorded.check[like].exists() && !reads_later(like);
      sweep.gate = undo.gate = true;
      do_together(index, last, sweep);
      add(sweep, waits, waits, true);
      add(undo, false, false, false);
    }
    return epochs;
  }

  /// Adds what a rank does by one thread within the check of recorded epoch e: its share.
  void do_alone(const StepIndex& index, std::size_t e, SimEpoch& epoch) const {
    epoch.own.assign(static_cast<std::size_t>(machine_.ranks), 0.0);
    for (std::size_t s = 0; s < index.ranks.size(); ++s) {
      const Place place = index.ranks[s].alone[e];
      if (!place.exists()) continue;
      epoch.own_kind = stage_.timeline.record(place).kind();
      const double work = detail::alone_work(stage_, index, s, e);
      for (std::size_t r = 0; r < epoch.own.size(); ++r) epoch.own[r] += share(r, s) * work;
    }
  }

  /// Adds what all ranks did together within the check of recorded epoch e. As long as the rank with the
  /// largest share needs; threads that wait help with the pieces of it, as many as there are subdomains, and
  /// no faster than the longest piece takes one of them.
  void do_together(const StepIndex& index, std::size_t e, SimEpoch& epoch) const {
    for (std::size_t k = 0; k < index.ranks[0].whole[e].size(); ++k) {
      const Record& record = stage_.timeline.record(index.ranks[0].whole[e][k]);
      const double scale = machine_.contacts / stage_.speed_of(record.kind());
      std::vector<Meetings> shares(index.ranks.size());
      std::vector<double> work(shares.size(), 0.0);  // of one thread
      double longest = 0, most = 0;
      for (std::size_t s = 0; s < work.size(); ++s) {
        if (k >= index.ranks[s].whole[e].size()) continue;
        const Place place = index.ranks[s].whole[e][k];
        shares[s] = Meetings::of(stage_.timeline.record(place).node);
        const double threads = helpers(source_, s, trace_.threads);
        work[s] = scale * stage_.timeline.self(place) / shares[s].time_on(threads);
        longest = std::max(longest, shares[s].longest * work[s]);
      }
      for (std::uint32_t r = 0; r < static_cast<std::uint32_t>(machine_.ranks); ++r) {
        double alone = 0, shared = 0;
        for (std::size_t s = 0; s < work.size(); ++s) {
          alone += share(r, s) * shares[s].alone * work[s];
          shared += share(r, s) * (1 - shares[s].alone) * work[s];
        }
        most = std::max(most, alone + std::max(shared / helpers(rank_of_, r, machine_.threads), longest));
      }
      epoch.spans.push_back({epoch.whole, epoch.whole + most, record.node, record.kind()});
      epoch.whole += most;
      if (machine_.ranks == 1) continue;
      const Meetings meetings = Meetings::of(record.node);
      epoch.meetings += meetings.gathers * stage_.network.collective() + meetings.exchanges * exchange_time();
    }
  }

  /// One exchange of copies with no sweeps to hide it: to neighbours, and up and down the tree of ranks.
  double exchange_time() const {
    const auto ranks = static_cast<std::size_t>(machine_.ranks);
    std::vector<double> messages(ranks, 0);
    bool tree = false;
    for (std::uint32_t n = 0; n < layout_.nodes.size(); ++n) {
      const SimNode& node = layout_.nodes[n];
      const double count = layout_.incoming[n] + layout_.send_begin[n + 1] - layout_.send_begin[n];
      if (node.role != Role::root) messages[node.rank] += count;
      tree = tree || (node.role == Role::root && count > 0);
    }
    const double overhead = stage_.network.overhead(), latency = stage_.network.latency(),
                 most = *std::ranges::max_element(messages);
    std::vector<double> told(ranks, 0);
    for (const int rank : layout_.tree.order) {
      double at = told[static_cast<std::size_t>(rank)];
      for (const int child : layout_.tree.children[static_cast<std::size_t>(rank)])
        told[static_cast<std::size_t>(child)] = (at += overhead) + latency + overhead;
    }
    const double there_and_back = tree ? 2 * *std::ranges::max_element(told) : 0;
    return most * overhead + std::max(latency, there_and_back);
  }

  static bool next_reads(const StepIndex::Rank& recorded, std::size_t epoch) {
    for (std::size_t e = epoch + 1; e < recorded.epochs; ++e)
      if (recorded.check[e].exists()) return recorded.awaited[e] != 0;
    return false;
  }

  const Trace& trace_;
  const Machine machine_;
  std::vector<std::uint32_t> groups_;
  Replay out_;
  Stage stage_;
  std::vector<const Plan*> plans_;
  std::vector<std::uint64_t> weight_;   ///< per group
  std::vector<std::size_t> source_;     ///< per group: the rank it was recorded on
  std::vector<std::uint32_t> rank_of_;  ///< per group
  std::vector<std::vector<SimTask>> tasks_;
  LoopLayout layout_;
  std::vector<std::map<Kind, float>> typical_tasks_;  ///< where usual_times(), of the step
};

}  // namespace

Replay replay(const Timeline& timeline, const Machine& machine, bool keep) {
  validate(machine, timeline.trace());
  return Player(timeline, machine, keep).play();
}

}  // namespace talus::trace
