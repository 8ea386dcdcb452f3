/// Ranks alone, ranks that pretend, and messages that come late.

#include "runtime/graph/communicator.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <memory>
#include <stdexcept>
#include <thread>

#include "runtime/graph/clock.hpp"
#include "runtime/graph/delayed_messages.hpp"
#include "runtime/graph/one_rank.hpp"
#include "runtime/graph/pretend_ranks.hpp"

namespace talus::graph {
namespace {

TEST(ThreadLevel, RanksOfSeveralThreadsNeedAnMpiThatTheyMayAllCall) {
  for (const char* level : {"single", "funneled"}) {
    EXPECT_THROW(demand_thread_level(level, 2, 2), std::invalid_argument) << level;
    EXPECT_NO_THROW(demand_thread_level(level, 2, 1)) << level;
    EXPECT_NO_THROW(demand_thread_level(level, 1, 2)) << level << ": one rank sends nothing";
  }
  for (const char* level : {"serialized", "multiple"})
    EXPECT_NO_THROW(demand_thread_level(level, 2, 2)) << level;
}

TEST(OneRank, NeedsNoMpi) {
  const OneRank alone;
  EXPECT_EQ(alone.ranks(), 1);
  EXPECT_EQ(alone.thread_level(), "none");
  EXPECT_NO_THROW(demand_thread_level(alone.thread_level(), alone.ranks(), 8));
}

TEST(OneRank, GetsBackWhatItBringsAndCanSendNothing) {
  const OneRank alone;
  const std::vector<int> part = {3, 1, 4};
  EXPECT_EQ(alone.gather_records(std::span(part)), part);
  EXPECT_EQ(alone.exchange_records(std::vector<std::vector<int>>{part}).front(), part);
  EXPECT_EQ(alone.start_gather({2, 7}, std::array<std::size_t, 1>{2})->wait(), (std::vector<double>{2, 7}));
  std::array<double, 1> buffer{};
  EXPECT_THROW(alone.open_send(0, Communicator::first_tag, buffer), std::logic_error);
  EXPECT_THROW(OneRank({.ranks = 2}), std::invalid_argument);
}

/// Of rank `rank`, as many numbers as its number.
std::vector<double> part_of(int rank) {
  return std::vector<double>(static_cast<std::size_t>(rank), 10.0 * rank);
}

TEST(PretendRanks, ReduceAndGatherInOrderOfRank) {
  for (const int count : {1, 2, 3, 8})
    on_pretend_ranks(count, [count](const Communicator& ranks) {
      std::array<std::int64_t, 2> sums = {ranks.rank(), 1};
      std::array<double, 1> largest = {-1.0 * ranks.rank()};
      ranks.sum(sums);
      ranks.max(largest);
      EXPECT_EQ(sums, (std::array<std::int64_t, 2>{count * (count - 1) / 2, count}));
      EXPECT_EQ(largest[0], 0);
      std::vector<double> expected;
      std::vector<std::size_t> lengths;
      for (int rank = 0; rank < count; ++rank) {
        const std::vector<double> part = part_of(rank);
        expected.insert(expected.end(), part.begin(), part.end());
        lengths.push_back(part.size());
      }
      const std::vector<double> own = part_of(ranks.rank());
      EXPECT_EQ(ranks.gather_records(std::span(own)), expected);
      EXPECT_EQ(ranks.start_gather(own, lengths)->wait(), expected) << "by dissemination";
      std::vector<double> at_first;
      ranks.records_to_first(std::span(own), [&](std::span<const double> piece) {
        at_first.insert(at_first.end(), piece.begin(), piece.end());
      });
      EXPECT_EQ(at_first, ranks.rank() == 0 ? expected : std::vector<double>());
    });
}

TEST(PretendRanks, GiveEachRankWhatTheOthersHaveForIt) {
  on_pretend_ranks(3, [](const Communicator& ranks) {
    std::vector<std::vector<int>> to(3);
    for (int rank = 0; rank < 3; ++rank)
      to[static_cast<std::size_t>(rank)].assign(static_cast<std::size_t>(rank), 10 * ranks.rank() + rank);
    const auto from = ranks.exchange_records(std::move(to));
    for (int rank = 0; rank < 3; ++rank)
      EXPECT_EQ(from[static_cast<std::size_t>(rank)],
                std::vector<int>(static_cast<std::size_t>(ranks.rank()), 10 * rank + ranks.rank()));
  });
}

/// Each rank sends 100 messages around the ring; all must come, in order.
void send_around(const Communicator& ranks) {
  std::array<double, 2> out{}, in{};
  const int next = (ranks.rank() + 1) % ranks.ranks(),
            before = (ranks.rank() + ranks.ranks() - 1) % ranks.ranks();
  const auto receiver = ranks.open_receive(before, Communicator::first_tag, in),
             sender = ranks.open_send(next, Communicator::first_tag, out);
  for (int k = 0; k < 100; ++k) {
    sender->wait();
    out = {static_cast<double>(k), static_cast<double>(ranks.rank())};
    receiver->start();
    sender->start();
    receiver->wait();
    EXPECT_EQ(in, (std::array<double, 2>{static_cast<double>(k), static_cast<double>(before)}));
  }
  sender->wait();
}

TEST(PretendRanks, HandChannelMessagesOnInOrder) {
  on_pretend_ranks(4, send_around);
}

TEST(PretendRanks, MeetOnlyWhenAllHaveCome) {
  on_pretend_ranks(2, [](const Communicator& ranks) {
    std::array<double, 1> word{};
    if (ranks.rank() == 1) {  // has something to say before it comes
      const auto receiver = ranks.open_receive(0, Communicator::first_tag, word);
      receiver->start();
      receiver->wait();
    }
    const auto meeting = ranks.start_meeting();
    if (ranks.rank() == 0) {
      EXPECT_FALSE(meeting->complete());
      ranks.open_send(1, Communicator::first_tag, word)->start();
    }
    while (!meeting->complete()) std::this_thread::yield();
  });
}

TEST(PretendRanks, EndWithTheErrorOfTheOneThatFailed) {
  try {
    on_pretend_ranks(3, [](const Communicator& ranks) {
      if (ranks.rank() == 2) throw std::invalid_argument("rank 2 had enough");
      std::array<std::int64_t, 1> sum = {1};
      ranks.sum(sum);
      FAIL() << "a sum without rank 2";
    });
    FAIL() << "no error";
  } catch (const std::invalid_argument& error) {
    EXPECT_STREQ(error.what(), "rank 2 had enough");
  }
}

TEST(DelayedMessages, ComeAsTheyWereSentAndNotBeforeTheirTime) {
  constexpr double delay = 2e-3;
  on_pretend_ranks(2, [&](const Communicator& ranks) {
    const std::shared_ptr<const Communicator> borrowed(std::shared_ptr<void>(), &ranks);
    const DelayedMessages late(borrowed, delay);
    std::array<double, 1> sent{}, received{};
    const auto sender = late.open_send(1 - late.rank(), Communicator::first_tag, sent),
               receiver = late.open_receive(1 - late.rank(), Communicator::first_tag, received);
    EXPECT_TRUE(receiver->done()) << "none was started";
    for (int k = 0; k < 5; ++k) {
      sent[0] = seconds_now();
      receiver->start();
      sender->start();
      receiver->wait();
      EXPECT_GE(seconds_now() - received[0], delay) << "rank " << late.rank() << ", message " << k;
    }
  });
}

}  // namespace
}  // namespace talus::graph
