#pragma once

/// Records the tasks of a run while it runs:
///
///     trace::Recorder recorder({.rank = 0, .threads = 2, .sink = [&](trace::Block&& block) { ... }});
///     recorder.begin_step(7);                       // ends the step before
///     ...
///     const std::int64_t begin = recorder.now();
///     work();
///     recorder.track(thread).add(begin, recorder.now(), node, epoch, kind);
///     ...
///     recorder.finish();                            // hands over what is left
///
/// Each thread writes to a buffer of its own; a full one goes to the sink, on the thread that filled it, and
/// the sink may block: memory stays bounded, nothing is lost. Cost (bench_trace, bench_tracing): one reading
/// of the clock for each task, a second one where it had to wait.

#include <omp.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <mutex>
#include <optional>
#include <vector>

#include "runtime/trace/ticks.hpp"
#include "runtime/trace/trace.hpp"

namespace talus::trace {

/// Records of one thread, on their way to the file; or a plan; or, before all others, the tasks of every
/// step.
struct Block {
  std::int32_t rank = 0, thread = 0;
  std::vector<Record> records;
  std::optional<Plan> plan;
  std::vector<Task> tasks{};
};

struct RecorderOptions {
  int rank = 0;
  int threads = 1;
  std::uint32_t first_step = 1, last_step = largest_step;  ///< the steps that are recorded
  std::size_t block = 1U << 16;                            ///< records in a buffer
  /// Before a thread begins with the nodes of another subdomain it reads the data that they will read,
  /// outside of all records. Recorded times are then those of a core whose caches hold one subdomain.
  bool own_caches = false;
  std::function<void(Block&&)> sink;  ///< may throw; by any thread
};

class Recorder {
 public:
  /// One thread's buffer, on cache lines of its own, since each is written all the time.
  class alignas(64) Track {
   public:
    void add(std::int64_t begin, std::int64_t end, std::uint32_t node, std::int32_t epoch, Kind kind) {
      records_.push_back({begin, static_cast<float>(end - begin), node, epoch, owner_->step_and_kind(kind)});
      // Stores retire in order: one that misses holds back those of the next task.
      __builtin_prefetch(records_.data() + records_.size() + records_ahead, 1);
      if (records_.size() == owner_->options_.block) owner_->hand_over(*this);
    }
    /// Adds a span within the task that the thread is running.
    void add_span(std::int64_t begin, std::int64_t end, std::uint32_t node, Kind kind) {
      add(begin, end, node, epoch_, kind);
    }
    /// The epoch that the thread is in, for spans; -1 outside the loop.
    void at_epoch(std::int32_t epoch) { epoch_ = epoch; }

   private:
    friend class Recorder;
    static constexpr std::size_t records_ahead = 8;  ///< three cache lines
    Recorder* owner_ = nullptr;
    std::int32_t thread_ = 0;
    std::int32_t epoch_ = -1;
    std::vector<Record> records_;
  };

  /// Throws std::invalid_argument without threads, sink or room in a buffer.
  explicit Recorder(RecorderOptions options);
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  /// The tasks of every step, by id; before the first step.
  void declare(std::vector<Task> tasks) { tasks_ = std::move(tasks); }
  const std::vector<Task>& tasks() const { return tasks_; }
  int rank() const { return options_.rank; }

  /// Called by one thread, between steps: all that follows belongs to `step`, up to end_step. An exception of
  /// the sink, on any thread, is thrown once by end_step, since a task or a span must not fail for it. After
  /// that nothing more is handed over.
  void begin_step(std::uint32_t step);
  void end_step();
  /// The loop's plan, from this step on. `plan.rank` and `plan.step` are filled in.
  void plan(Plan plan);
  /// Hands over all that is buffered. Called by one thread, between steps. Throws like end_step.
  void finish();

  bool own_caches() const { return options_.own_caches; }
  /// False outside the steps to be recorded.
  bool active() const { return active_; }
  /// [ns] since the recorder was made.
  std::int64_t now() const { return ticks_.now(); }
  Track& track(int thread) { return tracks_[static_cast<std::size_t>(thread)]; }
  /// Of the calling thread of the team.
  Track& track() { return track(omp_get_thread_num()); }
  /// A task of the step has run on `thread`.
  void task(int thread, std::uint32_t id, std::int64_t begin) {
    track(thread).add(begin, now(), id, -1, id < tasks_.size() ? tasks_[id].kind : kind_team);
  }

 private:
  std::uint32_t step_and_kind(Kind kind) const { return pack(step_, kind); }
  void hand_over(Track& track);
  void pass(Block&& block);
  void report_failure();

  const RecorderOptions options_;
  const Ticks ticks_;
  std::vector<Task> tasks_;
  std::vector<Track> tracks_;
  std::optional<Plan> pending_;  ///< made while nothing was recorded
  std::uint32_t step_ = 0;
  std::uint32_t last_ = 0;  ///< step that was recorded
  bool active_ = false;
  std::int64_t left_ = -1;  ///< end of the step before, if it was recorded
  bool declared_ = false;   ///< the tasks were handed over
  std::mutex mutex_;        ///< guards what follows
  bool failed_ = false;
  std::exception_ptr failure_;  ///< not yet reported
};

/// Records the time from here to the end of the block; nothing without a recorder or when it does not record.
class Span {
 public:
  /// Spans in a check, like those in the step's tasks, belong to no node and have epoch -1.
  enum Where { here, in_check };
  Span(Recorder* recorder, Kind kind, std::uint32_t node = 0, Where where = here)
      : recorder_(recorder && recorder->active() ? recorder : nullptr),
        kind_(kind),
        where_(where),
        node_(node) {
    if (recorder_) begin_ = recorder_->now();
  }
  Span(const Span&) = delete;
  Span& operator=(const Span&) = delete;
  ~Span() { end(); }
  /// What is known at its end only.
  void set_node(std::uint32_t node) { node_ = node; }
  /// Ends it here.
  void end() {
    if (recorder_ && where_ == in_check)
      recorder_->track().add(begin_, recorder_->now(), node_, -1, kind_);
    else if (recorder_)
      recorder_->track().add_span(begin_, recorder_->now(), node_, kind_);
    recorder_ = nullptr;
  }

 private:
  Recorder* recorder_;
  Kind kind_;
  Where where_;
  std::uint32_t node_;
  std::int64_t begin_ = 0;
};

/// Work that threads have shared, piece by piece, in a span that a trace records [s].
struct SharedWork {
  double elapsed = 0;  ///< while they did
  double waited = 0;   ///< for other ranks
  double all = 0;      ///< of all pieces, each as long as its thread took
  double longest = 0;  ///< of the longest one

  /// Puts the shares of the work of a span of so many seconds into `meetings`: what nobody shared is one
  /// thread's.
  void tell(double span, Meetings& meetings) const {
    const double rest = std::max(span - elapsed - waited, 0.0), work = rest + all;
    if (!(work > 0)) return;
    meetings.alone = rest / work;
    meetings.longest = longest / work;
  }
};

}  // namespace talus::trace
