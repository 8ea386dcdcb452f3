#pragma once

/// Ranks as the rest of the program sees them: collective calls for what happens once a step or more rarely,
/// and channels for what travels every iteration. With one rank nothing is sent and MPI is not called.

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
#include <vector>

namespace talus::trace {
class Recorder;
}

namespace talus::graph {

/// Throws std::invalid_argument where ranks have several threads and MPI lets only one of them call it: with
/// `level`, as Communicator::thread_level gives it, below "serialized". Tasks that call it run on any thread.
void demand_thread_level(const std::string& level, int ranks, int threads);

/// Starts MPI for the life of the object when the process was started by mpirun or srun (or `always`), and
/// ends it. Create one, in main.
class MpiSession {
 public:
  MpiSession(int* argc, char*** argv, bool always = false);
  ~MpiSession();
  MpiSession(const MpiSession&) = delete;
  MpiSession& operator=(const MpiSession&) = delete;
  bool started() const { return started_; }

 private:
  bool started_ = false;
};

struct CommunicatorOptions {
  /// Every channel message is held back until this time after it was sent [s]: a slow network on one machine,
  /// for tests and benchmarks. Ranks must share a clock then, as those of one machine do. Simulated ranks
  /// have a network of their own.
  double delay = 0;
};

class Communicator {
 public:
  /// One rank.
  Communicator();
  /// All ranks of the session; one rank when MPI was not started.
  explicit Communicator(const MpiSession& session, CommunicatorOptions options = {});
  ~Communicator();
  Communicator(const Communicator&) = delete;
  Communicator& operator=(const Communicator&) = delete;

  int rank() const noexcept { return rank_; }
  int ranks() const noexcept { return ranks_; }
  /// What MPI grants: "none", "single", "funneled", "serialized" or "multiple".
  std::string thread_level() const;
  /// Any thread may use channels; else thread 0 only.
  bool any_thread() const noexcept { return any_thread_; }
  /// Of a channel; MPI promises 32,767, Open MPI has 2^31 - 1.
  int largest_tag() const noexcept { return largest_tag_; }
  /// Ranks on this machine.
  int ranks_on_node() const noexcept { return ranks_on_node_; }
  /// Collective calls leave spans in `trace` from now on; null: no more. It must outlive them. Those of
  /// channels are left by who uses them. Calls of one rank, which do nothing, leave theirs too (start_gather
  /// none): replay counts them for many. Exchanges and gathers are two calls, the first of lengths. Only
  /// threads of the recorder's team may make calls then.
  void record_to(trace::Recorder* trace) const { trace_ = trace; }
  trace::Recorder* trace() const { return trace_; }

  // Collective: every rank calls, in the same order.
  /// Sends to[r] to rank r. `room(r, bytes)` gives the place for what rank r sends here, and is not asked for
  /// this rank itself, whose own part is nobody's message. One part per rank, each below 2 GiB.
  void exchange(std::span<const std::span<const std::byte>> to,
                const std::function<std::byte*(std::size_t, std::size_t)>& room) const;
  void sum(std::span<std::int64_t> values) const;
  void max(std::span<double> values) const;
  /// The parts of all ranks in order of rank.
  std::vector<std::byte> gather(std::span<const std::byte> part) const;
  /// The same, begun now and read later: its first message travels while other work goes on, the other
  /// log2(ranks) are waited for. `lengths`: how many numbers each rank brings.
  class PendingGather;
  std::unique_ptr<PendingGather> start_gather(std::vector<double> part,
                                              std::span<const std::size_t> lengths) const;
  /// The parts of all ranks in order of rank go to rank 0, whose `take` gets them in pieces of at most
  /// `piece` > 0 bytes, of one rank each; the others' is not called.
  void to_first(std::span<const std::byte> part, std::size_t piece,
                const std::function<void(std::span<const std::byte>)>& take) const;

  /// Lets messages under way advance; cheap, from any thread that may use channels.
  void progress() const;
  /// Returns when all ranks have called it, or after `seconds` if some have not come, since they are dead or
  /// wait for one that has failed. Nothing but abort() is left then.
  void meet(double seconds) const;
  /// Ends all ranks with exit code `code`: what is left when one of several ranks has failed and the others
  /// wait for it.
  [[noreturn]] void abort(int code) const;

  /// Sends to[r] to rank r and returns what each rank sent here. Nothing is copied on the way, and what is
  /// for this rank is moved.
  template <class Record>
  std::vector<std::vector<Record>> exchange_records(std::vector<std::vector<Record>> to) const;
  template <class Record>
  std::vector<Record> gather_records(std::span<const Record> part) const;
  /// Pieces of about 256 kB.
  template <class Record, class Take>
  void records_to_first(std::span<const Record> part, const Take& take) const;

  // Channels. Of one rank: used by one thread at a time. Tags from first_tag on are theirs.
  static constexpr int gather_tag = 1, first_tag = 2;
  /// A message of fixed length that is sent again and again (MPI's persistent requests).
  class Channel;
  /// Opens the sending and the receiving end; both ranks must name the same tag and length. `buffer` must
  /// outlive the channel; with a delay the last entry is the time stamp, so make it `payload + 1` long.
  std::unique_ptr<Channel> open_send(int to, int tag, std::span<double> buffer) const;
  std::unique_ptr<Channel> open_receive(int from, int tag, std::span<double> buffer) const;

 private:
  /// In the trace, what a single rank would have called.
  void note_calls(int count, std::uint32_t bytes = 0) const;
  int rank_ = 0, ranks_ = 1, ranks_on_node_ = 1;
  bool any_thread_ = true;
  int largest_tag_ = 32767;
  mutable trace::Recorder* trace_ = nullptr;  ///< watches; changes nothing of what is sent
  CommunicatorOptions options_;
};

/// For programs of one rank: no MPI call is ever made through it.
const Communicator& one_rank();

/// See Communicator::open_send. A sender calls `start` when its buffer is full, and `done` until true before
/// it fills it again; a receiver calls `start` when its buffer may be overwritten, then `done` until true.
class Communicator::Channel {
 public:
  ~Channel();
  Channel(const Channel&) = delete;
  Channel& operator=(const Channel&) = delete;
  void start();
  /// True when the message has left, or has come; true as well when none was started. A simulated receiver
  /// (clock.hpp) is done only when it has waited.
  bool done();
  /// Until done; ranks that share a core give way to one another. Returns what it took [s].
  double wait();

 private:
  friend class Communicator;
  struct Request;
  explicit Channel(std::unique_ptr<Request> request);
  std::unique_ptr<Request> request_;
};

/// See Communicator::start_gather. Must be waited for before it is destroyed, on every rank.
class Communicator::PendingGather {
 public:
  ~PendingGather();
  PendingGather(const PendingGather&) = delete;
  PendingGather& operator=(const PendingGather&) = delete;
  /// The parts of all ranks in order of rank.
  const std::vector<double>& wait();

 private:
  friend class Communicator;
  struct Request;
  explicit PendingGather(std::unique_ptr<Request> request);
  std::unique_ptr<Request> request_;
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
  from[static_cast<std::size_t>(rank_)] = std::move(to[static_cast<std::size_t>(rank_)]);
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
