#include "runtime/graph/pretend_ranks.hpp"

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <exception>
#include <limits>
#include <map>
#include <mutex>
#include <optional>
#include <thread>
#include <tuple>

#include "runtime/graph/detail/pieces.hpp"
#include "runtime/trace/recorder.hpp"

namespace talus::graph {

namespace {

using Bytes = std::vector<std::byte>;

/// Tags of messages of collective calls, and of meetings. Channels have tags from 0 on.
constexpr int collective_tag = -1, meeting_tag = -2;

/// Messages that were sent and not yet taken.
class Mail {
 public:
  void put(int from, int to, int tag, std::span<const std::byte> message) {
    const std::lock_guard lock(mutex_);
    waiting_[{from, to, tag}].emplace_back(message.begin(), message.end());
    arrived_.notify_all();
  }
  /// Throws std::runtime_error when there is none and a rank has failed.
  std::optional<Bytes> look(int from, int to, int tag) {
    const std::lock_guard lock(mutex_);
    return next({from, to, tag});
  }
  Bytes take(int from, int to, int tag) {
    std::unique_lock lock(mutex_);
    for (;;) {
      if (std::optional<Bytes> message = next({from, to, tag})) return std::move(*message);
      arrived_.wait(lock);
    }
  }
  /// Returns whether no rank had failed before.
  bool fail() {
    const std::lock_guard lock(mutex_);
    arrived_.notify_all();
    return !std::exchange(failed_, true);
  }

 private:
  using Key = std::tuple<int, int, int>;
  std::optional<Bytes> next(const Key& key) {
    std::deque<Bytes>& queue = waiting_[key];
    if (queue.empty()) {
      if (failed_) throw std::runtime_error("another rank has failed");
      return {};
    }
    Bytes message = std::move(queue.front());
    queue.pop_front();
    return message;
  }

  std::mutex mutex_;
  std::condition_variable arrived_;
  std::map<Key, std::deque<Bytes>> waiting_;
  bool failed_ = false;
};

/// Throws std::logic_error where two ranks mean messages of different lengths.
void copy_whole(const Bytes& message, std::span<std::byte> to) {
  if (message.size() != to.size())
    throw std::logic_error("a message of " + std::to_string(message.size()) + " bytes was taken for one of " +
                           std::to_string(to.size()));
  std::copy(message.begin(), message.end(), to.begin());
}

class Sender final : public Channel {
 public:
  Sender(Mail& mail, int own, int to, int tag, std::span<const double> buffer)
      : mail_(mail), own_(own), to_(to), tag_(tag), buffer_(buffer) {}
  void start() override { mail_.put(own_, to_, tag_, std::as_bytes(buffer_)); }
  bool done() override { return true; }

 private:
  Mail& mail_;
  int own_, to_, tag_;
  std::span<const double> buffer_;
};

class Receiver final : public Channel {
 public:
  Receiver(Mail& mail, int own, int from, int tag, std::span<double> buffer)
      : mail_(mail), own_(own), from_(from), tag_(tag), buffer_(buffer) {}
  void start() override { open_ = true; }
  bool done() override {
    if (!open_) return true;
    const std::optional<Bytes> message = mail_.look(from_, own_, tag_);
    if (!message) return false;
    copy_whole(*message, std::as_writable_bytes(buffer_));
    open_ = false;
    return true;
  }

 private:
  Mail& mail_;
  int own_, from_, tag_;
  std::span<double> buffer_;
  bool open_ = false;
};

class PretendRound final : public Round {
 public:
  PretendRound(Mail& mail, int own) : mail_(mail), own_(own) {}
  void begin(int to, std::span<const double> out, int from, std::span<double> in) override {
    mail_.put(own_, to, Communicator::gather_tag, std::as_bytes(out));
    from_ = from;
    in_ = in;
  }
  void end() override {
    copy_whole(mail_.take(from_, own_, Communicator::gather_tag), std::as_writable_bytes(in_));
  }

 private:
  Mail& mail_;
  int own_, from_ = 0;
  std::span<double> in_;
};

class PretendMeeting final : public Meeting {
 public:
  PretendMeeting(Mail& mail, int own, int ranks) : mail_(mail), own_(own), ranks_(ranks) {
    for (int to = 0; to < ranks; ++to) mail.put(own, to, meeting_tag, {});
  }
  bool complete() override {
    while (met_ < ranks_ && mail_.look(met_, own_, meeting_tag)) ++met_;
    return met_ == ranks_;
  }

 private:
  Mail& mail_;
  int own_, ranks_;
  int met_ = 0;  ///< all ranks below this number have entered
};

class PretendCommunicator final : public Communicator {
 public:
  PretendCommunicator(Mail& mail, int rank, int ranks)
      : Communicator({.rank = rank,
                      .ranks = ranks,
                      .ranks_on_node = ranks,
                      .thread_level = "multiple",
                      .largest_tag = std::numeric_limits<int>::max()}),
        mail_(mail) {}

  void exchange(std::span<const std::span<const std::byte>> to,
                const std::function<std::byte*(std::size_t, std::size_t)>& room) const override {
    if (to.size() != static_cast<std::size_t>(ranks()))
      throw std::invalid_argument("Communicator::exchange wants one part per rank");
    trace::Span sizes(trace(), trace::kind_collective);
    for (int r = 0; r < ranks(); ++r)
      if (r != rank()) send(r, to[static_cast<std::size_t>(r)]);
    sizes.end();
    const trace::Span parts(trace(), trace::kind_collective);
    for (int r = 0; r < ranks(); ++r) {
      if (r == rank()) continue;
      const Bytes message = take(r);
      if (message.empty()) continue;
      std::memcpy(room(static_cast<std::size_t>(r), message.size()), message.data(), message.size());
    }
  }
  void sum(std::span<std::int64_t> values) const override {
    // Modulo 2^64, as MPI adds: digests are sums.
    reduce(values, [](std::int64_t a, std::int64_t b) {
      return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) + static_cast<std::uint64_t>(b));
    });
  }
  void max(std::span<double> values) const override {
    reduce(values, [](double a, double b) { return std::max(a, b); });
  }
  Bytes gather(std::span<const std::byte> part) const override {
    trace::Span sizes(trace(), trace::kind_collective);
    for (int r = 0; r < ranks(); ++r) send(r, part);
    sizes.end();
    const trace::Span parts(trace(), trace::kind_collective);
    Bytes all;
    for (int r = 0; r < ranks(); ++r) {
      const Bytes message = take(r);
      all.insert(all.end(), message.begin(), message.end());
    }
    return all;
  }
  void to_first(std::span<const std::byte> part, std::size_t piece,
                const std::function<void(std::span<const std::byte>)>& take_piece) const override {
    send(0, part);
    if (rank() != 0) return;
    for (int r = 0; r < ranks(); ++r) {
      const Bytes message = take(r);
      detail::each_piece(message, piece, take_piece);
    }
  }
  [[noreturn]] void abort(int code) const override {
    throw std::runtime_error("rank " + std::to_string(rank()) + " ends all with code " +
                             std::to_string(code));
  }
  std::unique_ptr<Channel> open_send(int to, int tag, std::span<double> buffer) const override {
    return std::make_unique<Sender>(mail_, rank(), to, tag, buffer);
  }
  std::unique_ptr<Channel> open_receive(int from, int tag, std::span<double> buffer) const override {
    return std::make_unique<Receiver>(mail_, rank(), from, tag, buffer);
  }
  std::unique_ptr<Round> open_round() const override { return std::make_unique<PretendRound>(mail_, rank()); }
  std::unique_ptr<Meeting> start_meeting() const override {
    return std::make_unique<PretendMeeting>(mail_, rank(), ranks());
  }

 private:
  void send(int to, std::span<const std::byte> part) const { mail_.put(rank(), to, collective_tag, part); }
  Bytes take(int from) const { return mail_.take(from, rank(), collective_tag); }
  template <class Value, class Combine>
  void reduce(std::span<Value> values, const Combine& combine) const {
    if (values.empty()) return;
    const trace::Span span(trace(), trace::kind_collective, static_cast<std::uint32_t>(values.size_bytes()));
    for (int r = 0; r < ranks(); ++r) send(r, std::as_bytes(values));
    std::vector<Value> other(values.size());
    for (int r = 0; r < ranks(); ++r) {
      const Bytes message = take(r);
      if (r == rank()) continue;
      copy_whole(message, std::as_writable_bytes(std::span(other)));
      for (std::size_t k = 0; k < values.size(); ++k) values[k] = combine(values[k], other[k]);
    }
  }

  Mail& mail_;
};

}  // namespace

void on_pretend_ranks(int count, const std::function<void(const Communicator&)>& work) {
  Mail mail;
  std::exception_ptr error;
  std::vector<std::thread> threads;
  for (int rank = 0; rank < count; ++rank)
    threads.emplace_back([&, rank] {
      try {
        work(PretendCommunicator(mail, rank, count));
      } catch (...) {
        // What others throw from now on says only that this rank has failed.
        if (mail.fail()) error = std::current_exception();
      }
    });
  for (std::thread& thread : threads) thread.join();
  if (error) std::rethrow_exception(error);
}

}  // namespace talus::graph
