/// What fuzzing began with and what it found, given to the readers again: each reads or refuses it in time.

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <vector>

#include "tests/fuzz/targets.hpp"

namespace talus::fuzz {
namespace {

namespace fs = std::filesystem;

constexpr double limit = 5;  ///< [s] for one input

std::vector<std::uint8_t> bytes_in(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::vector<fs::path> corpus_of(const Target& target) {
  std::vector<fs::path> files;
  for (const auto& entry :
       fs::directory_iterator(fs::path(TALUS_SOURCE_DIR) / "tests/fuzz/corpus" / target.name))
    files.push_back(entry.path());
  std::ranges::sort(files);
  return files;
}

void read_in_time(const Target& target, Bytes bytes, const std::string& what) {
  const auto began = std::chrono::steady_clock::now();
  EXPECT_NO_THROW(target.read(bytes)) << what;
  EXPECT_LT(std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count(), limit) << what;
}

class Corpus : public testing::TestWithParam<Target> {};

/// Else all that a fuzzer changes of it would be refused at the door, and nothing behind it looked at.
TEST_P(Corpus, HoldsAFileThatIsRead) {
  for (const fs::path& file : corpus_of(GetParam()))
    if (GetParam().read(bytes_in(file))) return;
  FAIL() << "all of " << GetParam().name << " are refused";
}

TEST_P(Corpus, IsReadOrRefusedInTime) {
  const std::vector<fs::path> files = corpus_of(GetParam());
  ASSERT_FALSE(files.empty());
  for (const fs::path& file : files) read_in_time(GetParam(), bytes_in(file), file.string());
}

int trials() {
  const char* given = std::getenv("TALUS_TRIALS");
  return given == nullptr ? 40 : std::stoi(given);
}

/// A poor man's fuzzer where there is no libFuzzer: the same changes every time.
TEST_P(Corpus, IsReadOrRefusedInTimeWithChangedBytesAndCutShort) {
  std::mt19937 random(7);
  const auto any = [&random](std::size_t n) { return random() % n; };
  for (const fs::path& path : corpus_of(GetParam())) {
    const std::vector<std::uint8_t> whole = bytes_in(path);
    if (whole.empty()) continue;
    for (int trial = 0; trial < trials(); ++trial) {
      std::vector<std::uint8_t> changed = whole;
      for (std::size_t changes = 1 + any(4); changes > 0; --changes)
        changed[any(changed.size())] = static_cast<std::uint8_t>(any(256));
      if (any(4) == 0) changed.resize(any(changed.size()));
      read_in_time(GetParam(), changed, path.string() + " changed, trial " + std::to_string(trial));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Of, Corpus, testing::ValuesIn(targets),
                         [](const auto& target) { return std::string(target.param.name); });

}  // namespace
}  // namespace talus::fuzz
