#pragma once

/// Communication interface of the program: collective calls for what happens once a step or more rarely, and
/// channels for what travels in every iteration. Who implements it:
///
///   OneRank             one_rank.hpp           a rank alone: nothing is sent, MPI is not called
///   make_communicator   mpi_communicator.hpp   the ranks of mpirun
///   PretendRanks        pretend_ranks.hpp      for tests: threads of one process in the place of ranks
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

/// Throws std::invalid_argument where ranks have several threads and MPI lets only one of them call it: with
/// `level`, as Communicator::thread_level gives it, below "serialized". Tasks that call it run on any thread.
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
  /// True when the message has left, or has come; true as well when none was started. A receiver on a
  /// simulated machine (clock.hpp) is done only when it has waited.
  virtual bool done() = 0;
  /// Until done; ranks that share a core give way to one another. Returns what it took [s].
  virtual double wait();
};

/// Messages of one round of a gather, which may have another length each time.
class Round {
 public:
  Round() = default;
  virtual ~Round() = default;
  Round(const Round&) = delete;
  Round& operator=(const Round&) = delete;
  /// Sends `out` to rank `to`, and takes what rank `from` sends into `in`; both must stay until end().
  virtual void begin(int to, std::span<const double> out, int from, std::span<double> in) = 0;
  /// Returns when both are done.
  virtual void end() = 0;
};

/// A barrier that this rank has come to.
class Meeting {
 public:
  Meeting() = default;
  virtual ~Meeting() = default;
  Meeting(const Meeting&) = delete;
  Meeting& operator=(const Meeting&) = delete;
  /// True when all ranks have come.
  virtual bool complete() = 0;
};

class PendingGather;

/// What a rank knows of itself and the others.
struct RankProperties {
  int rank = 0, ranks = 1;
  int ranks_on_node = 1;              ///< on this machine
  std::string thread_level = "none";  ///< MPI grants "none", "single", "funneled", "serialized", "multiple"
  bool any_thread = true;             ///< may use channels; else thread 0 only
  int largest_tag = 32767;            ///< of a channel; MPI promises no more, Open MPI has 2^31 - 1
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
  /// From now on collective calls record spans in `trace`, which must outlive them; null ends that. Messages
  /// of channels are recorded by their users. A rank alone records its calls, too, though they do nothing
  /// (but not start_gather): a replay on more ranks needs their number. An exchange or a gather counts as two
  /// calls, the first of which sends the lengths. While this records, only threads of the recorder's team may
  /// make calls.
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
  /// The same, begun now and read later: its first message travels while other work goes on, the other
  /// log2(ranks) are waited for. `lengths`: how many numbers each rank brings.
  std::unique_ptr<PendingGather> start_gather(std::vector<double> part,
                                              std::span<const std::size_t> lengths) const;
  /// The parts of all ranks in order of rank go to rank 0, whose `take` gets them in pieces of at most
  /// `piece` > 0 bytes, of one rank each; the others' is not called.
  virtual void to_first(std::span<const std::byte> part, std::size_t piece,
                        const std::function<void(std::span<const std::byte>)>& take) const = 0;

  /// Lets messages under way advance; cheap, from any thread that may use channels.
  virtual void progress() const {}
  /// True when all ranks have called it; false after `seconds` if some have not come, since they are dead or
  /// wait for one that has failed. Nothing but abort() is left then.
  bool meet(double seconds) const;
  /// Ends all ranks with exit code `code`: what is left when one of several ranks has failed and the others
  /// wait for it.
  [[noreturn]] virtual void abort(int code) const = 0;

  /// Sends to[r] to rank r and returns what each rank sent here. Nothing is copied on the way, and what is
  /// for this rank is moved.
  template <class Record>
  std::vector<std::vector<Record>> exchange_records(std::vector<std::vector<Record>> to) const;
  template <class Record>
  std::vector<Record> gather_records(std::span<const Record> part) const;
  /// Pieces of about 256 kB.
  template <class Record, class Take>
  void records_to_first(std::span<const Record> part, const Take& take) const;

  // Messages of single ranks. Tags from first_tag on are for the channels of who calls.
  static constexpr int gather_tag = 1, first_tag = 2;
  /// Opens the sending and the receiving end; both ranks must name the same tag and length. `buffer` must
  /// outlive the channel.
  virtual std::unique_ptr<Channel> open_send(int to, int tag, std::span<double> buffer) const = 0;
  virtual std::unique_ptr<Channel> open_receive(int from, int tag, std::span<double> buffer) const = 0;
  virtual std::unique_ptr<Round> open_round() const = 0;
  /// Collective, though it does not wait.
  virtual std::unique_ptr<Meeting> start_meeting() const = 0;

 protected:
  explicit Communicator(RankProperties properties) : properties_(std::move(properties)) {}

 private:
  RankProperties properties_;
  mutable trace::Recorder* trace_ = nullptr;  ///< watches; changes nothing of what is sent
};

/// See Communicator::start_gather. Must be waited for before it is destroyed, on every rank.
class PendingGather {
 public:
  PendingGather(const Communicator& ranks, std::vector<double> part, std::span<const std::size_t> lengths);
  /// The parts of all ranks in order of rank.
  const std::vector<double>& wait();

 private:
  std::size_t back(std::size_t from, std::size_t places) const { return (from + ranks_ - places) % ranks_; }
  /// In the message of a round.
  std::size_t parts() const { return std::min(have_, ranks_ - have_); }
  std::size_t length(std::size_t of) const { return begin_[of + 1] - begin_[of]; }
  void begin_round();
  void end_round();

  std::size_t rank_, ranks_;
  std::size_t have_ = 1;            ///< parts: this rank's and those of the ranks before it, around the ring
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
