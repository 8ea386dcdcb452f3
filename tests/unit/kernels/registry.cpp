#include "kernels/registry.hpp"

#include <gtest/gtest.h>

namespace talus {
namespace {

enum class Fruit { apple, pear, quince };
using Press = int (*)();
constexpr Entry<Fruit, Press> fruits[] = {{Fruit::pear, "pear", "is soft", [] { return 2; }},
                                          {Fruit::apple, "apple", "keeps", [] { return 1; }}};
constexpr Registry<Fruit, Press> registry("fruit", fruits);

TEST(Registry, FindsAnEntryByKindAndByNameWhateverTheOrder) {
  EXPECT_EQ(registry.of(Fruit::apple).name, "apple");
  EXPECT_EQ(registry.named("pear").kind, Fruit::pear);
  EXPECT_EQ(registry.named("apple").make(), 1);
}

TEST(Registry, ListsNamesAndSentencesInTheOrderOfTheTable) {
  EXPECT_EQ(registry.names(), (std::vector<std::string>{"pear", "apple"}));
  EXPECT_EQ(registry.meaning(), "`pear`: is soft; `apple`: keeps.");
}

TEST(Registry, AnUnknownNameIsAnsweredWithTheOnesThereAre) {
  try {
    registry.named("plum");
    FAIL() << "it was taken";
  } catch (const std::invalid_argument& error) {
    EXPECT_STREQ(error.what(), "fruit 'plum' is not known; there are pear, apple");
  }
}

TEST(Registry, AKindThatNobodyRegisteredIsOurMistake) {
  EXPECT_THROW(registry.of(Fruit::quince), std::logic_error);
}

}  // namespace
}  // namespace talus
