#include "io/files/detail/rehearsal.hpp"

#include <gtest/gtest.h>

#include <csignal>
#include <fstream>
#include <memory>
#include <new>
#include <stdexcept>
#include <string>
#include <vector>

#include "io/files/error.hpp"
#include "tests/unit/io/results/output_helpers.hpp"

namespace talus::rehearsal_test {
namespace {

namespace fs = std::filesystem;
using io::FileError;
using io::detail::done_in_a_child;
using io::detail::rehearsed;

class Rehearsal : public testing::Test {
 protected:
  Rehearsal() { std::ofstream(path_) << "some bytes"; }
  std::string refusal_of(const std::function<void()>& work) const {
    try {
      done_in_a_child(path_, "write it again", work);
    } catch (const FileError& error) {
      return error.what();
    }
    return "none";
  }

  test::ScratchDirectory scratch_;
  const std::string path_ = (scratch_ / "file.h5").string();
  const std::string too_late_ =
      path_ +
      ": is damaged, or this machine is too busy to read it: HDF5 took more time than such a file needs. Try "
      "again; write it again";
  const std::string damaged_ = path_ + ": is damaged: HDF5 would crash or run wild in it; write it again";
};

TEST_F(Rehearsal, OfWhatCrashesIsAnErrorWithTheRemedy) {
  EXPECT_EQ(refusal_of([] { std::raise(SIGSEGV); }), damaged_);
  EXPECT_EQ(refusal_of([] { throw std::bad_alloc(); }), damaged_);
}

TEST_F(Rehearsal, OfWhatHasNoEndIsAnErrorWithinSeconds) {
  EXPECT_EQ(refusal_of([] {
              for (volatile bool on = true; on;) {
              }
            }),
            too_late_);
}

/// The file may be whole where the system ended its reader.
TEST_F(Rehearsal, ThatSomebodyKillsIsToBeTriedAgain) {
  EXPECT_EQ(refusal_of([] { std::raise(SIGKILL); }), too_late_);
}

TEST_F(Rehearsal, DoesNotTakeOurOwnFaultsForThoseOfTheFile) {
  EXPECT_THROW(done_in_a_child(path_, "", [] { throw std::out_of_range("at(7)"); }), std::logic_error);
}

TEST_F(Rehearsal, OfWhatTakesFarMoreMemoryThanTheFileHasIsAnError) {
#if defined(__SANITIZE_ADDRESS__)  // by g++
#define TALUS_OWN_LIMITS
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)  // by clang
#define TALUS_OWN_LIMITS
#endif
#endif
#ifdef TALUS_OWN_LIMITS
  GTEST_SKIP() << "a sanitizer has its own limits";
#endif
  EXPECT_EQ(refusal_of([] {
              std::vector<std::unique_ptr<char[]>> all;
              for (int k = 0; k < 300; ++k) all.push_back(std::make_unique_for_overwrite<char[]>(1 << 24));
            }),
            damaged_);
}

TEST_F(Rehearsal, TellsTheErrorOfTheReaderInItsWords) {
  EXPECT_EQ(refusal_of([this] { throw FileError(path_, "has no frames"); }), path_ + ": has no frames");
  const std::string longer_than_a_pipe(100'000, 'x');
  EXPECT_EQ(refusal_of([&] { throw FileError(path_, longer_than_a_pipe); }),
            path_ + ": " + longer_than_a_pipe);
}

TEST_F(Rehearsal, LeavesWhatTheChildWroteAndNothingElseOfIt) {
  int here = 0;
  EXPECT_TRUE(done_in_a_child(path_, "", [&] {
    here = 1;
    std::ofstream(path_) << "other";
  }));
  EXPECT_EQ(here, 0);
  std::string text;
  std::ifstream(path_) >> text;
  EXPECT_EQ(text, "other");
}

TEST_F(Rehearsal, IsFollowedByTheReading) {
  EXPECT_EQ(rehearsed(path_, "", [] { return 7; }), 7);
}

/// A parent may ignore its children, and this is inherited: the system then keeps no status of them.
TEST_F(Rehearsal, NeedsNoStatusOfTheChild) {
  const auto before = std::signal(SIGCHLD, SIG_IGN);
  EXPECT_TRUE(done_in_a_child(path_, "", [] {}));
  EXPECT_EQ(refusal_of([] { std::raise(SIGKILL); }), damaged_);
  std::signal(SIGCHLD, before);
}

TEST_F(Rehearsal, IsLeftOutByAProcessThatMayDie) {
  io::detail::this_process_may_die = true;
  EXPECT_FALSE(done_in_a_child(path_, "", [] { throw std::logic_error("called"); }));
  io::detail::this_process_may_die = false;
}

}  // namespace
}  // namespace talus::rehearsal_test
