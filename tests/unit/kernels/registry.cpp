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

class Dish : public NamedKind<Dish> {
 public:
  using NamedKind::NamedKind;
  static const Dish soup;
};
constexpr Dish Dish::soup("soup");

TEST(Registry, KindsMadeOfTheirNamesAreEqualByName) {
  static constexpr Entry<Dish, Press> dishes[] = {named<Dish, Press>("soup", "is hot", nullptr),
                                                  named<Dish, Press>("stew", "is thick", nullptr)};
  const Registry<Dish, Press> menu("dish", dishes);
  EXPECT_EQ(menu.of(Dish::soup).sentence, "is hot");
  EXPECT_EQ(menu.named("stew").kind, Dish("stew"));
  EXPECT_FALSE(menu.named("stew").kind == Dish::soup);
}

TEST(Registry, AKindThatNobodyRegisteredIsOurMistake) {
  EXPECT_THROW(registry.of(Fruit::quince), std::logic_error);
}

}  // namespace
}  // namespace talus
