#pragma once

/// Communication interface of the program: collective calls for what happens once a step or more rarely, and
/// channels for what travels in every iteration. Implementations:
///
///   OneRank             one_rank.hpp           a rank alone: nothing is sent, MPI is not called
///   make_communicator   mpi_communicator.hpp   the ranks of mpirun
///   on_pretend_ranks    pretend_ranks.hpp      for tests: threads of one process in the place of ranks
///
/// Decorators, around any of these:
///
///   DelayedMessages     delayed_messages.hpp   messages arrive later
///   simulated_time()    simulated_time.hpp     calls take the time of a simulated machine

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace talus::trace {
class Recorder;
}

namespace talus::graph {

/// Throws std::invalid_argument if there are several ranks of several threads each and MPI's thread level is
/// below "serialized", since tasks that call MPI run on any thread. `level`: Communicator::thread_level.
void demand_thread_level(const std::string& level, int ranks, int threads);

/// A message of fixed length that is sent again and again. A sender calls `start` when its buffer is full,
/// and `done` until true before it fills it again; a receiver calls `start` when its buffer may be
/// overwritten, then `done` until true. Used by one thread at a time.
class Channel {
 public:
  Channel() = default;
  virtual ~Channel() = default;
  Channel(const Channel&) = delete;
  Channel& operator=(const Channel&) = delete;
  virtual void start() = 0;
  /// True when the message has been sent or received, or when none was started. On a simulated machine
  /// (clock.hpp) a receiver is done only after wait().
  virtual bool done() = 0;
  /// Polls until done, and yields the core after some polls: another rank may need it. Returns the time spent
  /// [s].
  virtual double wait();
};

/// Messages of one round of a gather. Their lengths may differ from round to round.
class Round {
 public:
  Round() = default;
  virtual ~Round() = default;
  Round(const Round&) = delete;
  Round& operator=(const Round&) = delete;
  /// Starts to send `out` to rank `to` and to receive into `in` from rank `from`; both must stay until end().
  virtual void begin(int to, std::span<const double> out, int from, std::span<double> in) = 0;
  /// Returns when both messages have been transferred.
  virtual void end() = 0;
};

/// A barrier that this rank has entered and does not wait at.
class Meeting {
 public:
  Meeting() = default;
  virtual ~Meeting() = default;
  Meeting(const Meeting&) = delete;
  Meeting& operator=(const Meeting&) = delete;
  /// True when all ranks have entered it.
  virtual bool complete() = 0;
};

class PendingGather;

/// What a rank knows of itself and the others.
struct RankProperties {
  int rank = 0, ranks = 1;
  int ranks_on_node = 1;              ///< on this machine
  std::string thread_level = "none";  ///< MPI grants "none", "single", "funneled", "serialized", "multiple"
  bool any_thread = true;             ///< any thread may use channels; if false, only thread 0 may
  int largest_tag = 32767;  ///< of a channel; MPI guarantees no more than this, Open MPI has 2^31 - 1
};

class Communicator {
 public:
  virtual ~Communicator() = default;
  Communicator(const Communicator&) = delete;
  Communicator& operator=(const Communicator&) = delete;

  int rank() const noexcept { return properties_.rank; }
  int ranks() const noexcept { return properties_.ranks; }
  const std::string& thread_level() const noexcept { return properties_.thread_level; }
  bool any_thread() const noexcept { return properties_.any_thread; }
  int largest_tag() const noexcept { return properties_.largest_tag; }
  int ranks_on_node() const noexcept { return properties_.ranks_on_node; }
  const RankProperties& properties() const noexcept { return properties_; }
  /// From now on collective calls record spans in `trace`, which must outlive them; null ends that. The users
  /// of channels record the messages of channels. A single rank records its calls too, although they do
  /// nothing: a replay on more ranks needs their number. There start_gather alone is not recorded. An
  /// exchange or a gather counts as two calls, the first of which sends the lengths. While this records, only
  /// threads of the recorder's team may make calls.
  virtual void record_to(trace::Recorder* trace) const { trace_ = trace; }
  trace::Recorder* trace() const noexcept { return trace_; }

  // Collective: every rank calls, in the same order.
  /// Sends to[r] to rank r, one part per rank, each below 2 GiB. `room(r, bytes)` returns the buffer for what
  /// rank r sends here. It is not called for this rank itself: to[rank()] is not sent.
  virtual void exchange(std::span<const std::span<const std::byte>> to,
                        const std::function<std::byte*(std::size_t, std::size_t)>& room) const = 0;
  /// Sum, or maximum, of each value over all ranks, in place; all ranks pass equally many values.
  virtual void sum(std::span<std::int64_t> values) const = 0;
  virtual void max(std::span<double> values) const = 0;
  /// The parts of all ranks in order of rank.
  virtual std::vector<std::byte> gather(std::span<const std::byte> part) const = 0;
  /// Non-blocking gather(): the messages of its first round travel while other work goes on. There are
  /// ceil(log2(ranks)) rounds; PendingGather::wait() does the others. `lengths`: how many numbers each rank
  /// brings.
  std::unique_ptr<PendingGather> start_gather(std::vector<double> part,
                                              std::span<const std::size_t> lengths) const;
  /// Sends the parts of all ranks to rank 0, in order of rank. There `take` gets them in pieces of at most
  /// `piece` > 0 bytes, each from one rank; on other ranks `take` is not called.
  virtual void to_first(std::span<const std::byte> part, std::size_t piece,
                        const std::function<void(std::span<const std::byte>)>& take) const = 0;

  /// Lets messages under way advance; cheap, from any thread that may use channels.
  virtual void progress() const {}
  /// True when all ranks have called it; false when some have not after `seconds`, since they are dead or
  /// wait for a rank that has failed. Only abort() can end the run then.
  bool meet(double seconds) const;
  /// Ends all ranks with exit code `code`. For a rank that has failed while others wait for it.
  [[noreturn]] virtual void abort(int code) const = 0;

  /// Sends to[r] to rank r and returns what each rank sent here. Nothing is copied on the way, and what is
  /// for this rank is moved.
  template <class Record>
  std::vector<std::vector<Record>> exchange_records(std::vector<std::vector<Record>> to) const;
  template <class Record>
  std::vector<Record> gather_records(std::span<const Record> part) const;
  /// to_first() for records, in pieces of about 256 kB.
  template <class Record, class Take>
  void records_to_first(std::span<const Record> part, const Take& take) const;

  // Messages between two ranks. Callers use tags from first_tag on for their channels.
  static constexpr int gather_tag = 1, first_tag = 2;
  /// Opens the sending and the receiving end; both ranks must name the same tag and length. `buffer` must
  /// outlive the channel.
  virtual std::unique_ptr<Channel> open_send(int to, int tag, std::span<double> buffer) const = 0;
  virtual std::unique_ptr<Channel> open_receive(int from, int tag, std::span<double> buffer) const = 0;
  virtual std::unique_ptr<Round> open_round() const = 0;
  /// Collective, but does not block.
  virtual std::unique_ptr<Meeting> start_meeting() const = 0;

 protected:
  explicit Communicator(RankProperties properties) : properties_(std::move(properties)) {}

 private:
  RankProperties properties_;
  mutable trace::Recorder* trace_ = nullptr;  ///< observes only: recording does not change what is sent
};

/// See Communicator::start_gather. Every rank must call wait() before it destroys this.
class PendingGather {
 public:
  PendingGather(const Communicator& ranks, std::vector<double> part, std::span<const std::size_t> lengths);
  /// The parts of all ranks in order of rank.
  const std::vector<double>& wait();

 private:
  std::size_t back(std::size_t from, std::size_t places) const { return (from + ranks_ - places) % ranks_; }
  /// Number of parts in the message of a round.
  std::size_t parts() const { return std::min(have_, ranks_ - have_); }
  std::size_t length(std::size_t of) const { return begin_[of + 1] - begin_[of]; }
  void begin_round();
  void end_round();

  std::size_t rank_, ranks_;
  std::size_t have_ = 1;  ///< parts held: of this rank and of the have_ - 1 ranks before it, cyclically
  std::vector<std::size_t> begin_;  ///< ranks + 1, in all_
  std::vector<double> all_, out_, in_;
  std::unique_ptr<Round> round_;
  trace::Recorder* trace_;
};

template <class Record>
std::vector<std::vector<Record>> Communicator::exchange_records(std::vector<std::vector<Record>> to) const {
  static_assert(std::is_trivially_copyable_v<Record>);
  std::vector<std::span<const std::byte>> bytes;
  for (const auto& part : to) bytes.push_back(std::as_bytes(std::span(part)));
  std::vector<std::vector<Record>> from(to.size());
  exchange(bytes, [&](std::size_t r, std::size_t size) {
    from[r].resize(size / sizeof(Record));
    return reinterpret_cast<std::byte*>(from[r].data());
  });
  from[static_cast<std::size_t>(rank())] = std::move(to[static_cast<std::size_t>(rank())]);
  return from;
}

template <class Record>
std::vector<Record> Communicator::gather_records(std::span<const Record> part) const {
  static_assert(std::is_trivially_copyable_v<Record>);
  const std::vector<std::byte> bytes = gather(std::as_bytes(part));
  std::vector<Record> all(bytes.size() / sizeof(Record));
  if (!all.empty()) std::memcpy(all.data(), bytes.data(), bytes.size());
  return all;
}

template <class Record, class Take>
void Communicator::records_to_first(std::span<const Record> part, const Take& take) const {
  static_assert(std::is_trivially_copyable_v<Record>);
  constexpr std::size_t records = std::max<std::size_t>(1, (std::size_t{1} << 18) / sizeof(Record));
  std::vector<Record> aligned;
  to_first(std::as_bytes(part), records * sizeof(Record), [&](std::span<const std::byte> bytes) {
    aligned.resize(bytes.size() / sizeof(Record));
    std::memcpy(aligned.data(), bytes.data(), bytes.size());
    take(std::span<const Record>(aligned));
  });
}

}  // namespace talus::graph
