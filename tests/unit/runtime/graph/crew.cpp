#include "runtime/graph/crew.hpp"

#include <gtest/gtest.h>

#include <stdexcept>
#include <thread>
#include <vector>

namespace talus::graph {
namespace {

/// Threads that help as often as they can until they are told to leave.
class Helpers {
 public:
  Helpers(Crew& crew, int count) {
    for (int k = 0; k < count; ++k)
      threads_.emplace_back([&] {
        while (!leave_.load(std::memory_order_relaxed)) crew.help();
      });
  }
  ~Helpers() {
    leave_.store(true, std::memory_order_relaxed);
    for (std::thread& thread : threads_) thread.join();
  }

 private:
  std::atomic<bool> leave_{false};
  std::vector<std::thread> threads_;
};

TEST(Crew, DoesEveryPieceOnceWhoeverHelps) {
  for (const int helpers : {0, 1, 3}) {
    Crew crew;
    Helpers others(crew, helpers);
    // Numbers are plain: what a round wrote, the next one may read.
    std::vector<int> done(37, 0);
    for (int round = 1; round <= 2000; ++round) {
      const auto count = static_cast<std::size_t>(round % 38);
      std::vector<int> before(done.begin(), done.end());
      crew.share(count, [&](std::size_t k) { ++done[k]; });
      for (std::size_t k = 0; k < done.size(); ++k)
        ASSERT_EQ(done[k], before[k] + (k < count ? 1 : 0)) << helpers << " helpers, round " << round;
    }
  }
}

TEST(Crew, HandsOnWhatAPieceThrowsAndGoesOn) {
  Crew crew;
  Helpers others(crew, 2);
  for (int round = 0; round < 100; ++round) {
    std::atomic<int> done{0};
    EXPECT_THROW(crew.share(20,
                            [&](std::size_t k) {
                              ++done;
                              if (k % 7 == 3) throw std::runtime_error("piece");
                            }),
                 std::runtime_error);
    EXPECT_EQ(done, 20) << "the others are done all the same";
    crew.share(3, [&](std::size_t) { ++done; });
    EXPECT_EQ(done, 23);
  }
}

}  // namespace
}  // namespace talus::graph
