#include "apps/shared/patience.hpp"

#include <gtest/gtest.h>

#include <string>

namespace talus {
namespace {

std::string told(std::chrono::nanoseconds first, std::chrono::nanoseconds between, int times) {
  std::FILE* file = std::tmpfile();
  Patience patience(file, first, between);
  for (int k = 0; k < times; ++k) patience.tell([&] { return fmt::format("{} of {}", k, times); });
  std::rewind(file);
  std::string text;
  for (int c = std::fgetc(file); c != EOF; c = std::fgetc(file)) text += static_cast<char>(c);
  std::fclose(file);
  return text;
}

TEST(Patience, SaysNothingOfShortWork) {
  EXPECT_EQ(told(std::chrono::hours(1), std::chrono::hours(0), 1000), "");
}

TEST(Patience, SaysALineWheneverOneIsDue) {
  EXPECT_EQ(told(std::chrono::hours(0), std::chrono::hours(0), 2), "talus: 0 of 2\ntalus: 1 of 2\n");
  EXPECT_EQ(told(std::chrono::hours(0), std::chrono::hours(1), 9), "talus: 0 of 9\n");
}

}  // namespace
}  // namespace talus
