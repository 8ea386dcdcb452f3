#include "kernels/law/pair_table.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <set>
#include <string>

#include "kernels/law/attraction.hpp"

namespace talus::pair_table_test {
namespace {

TEST(PairTable, EveryPairHasAPlaceOfItsOwnWhicheverComesFirst) {
  constexpr Material materials = 7;
  std::set<std::size_t> places;
  for (Material a = 0; a < materials; ++a)
    for (Material b = a; b < materials; ++b) {
      EXPECT_EQ(PairTable::number(a, b), PairTable::number(b, a));
      EXPECT_TRUE(places.insert(PairTable::number(a, b)).second) << a << " and " << b;
    }
  EXPECT_EQ(places.size(), PairTable(materials).laws().size());
  EXPECT_EQ(*places.rbegin() + 1, places.size()) << "no place is left empty";
}

TEST(PairTable, MoreMaterialsDoNotMoveThePairsThatThereAre) {
  const PairTable few(3);
  EXPECT_TRUE(few.knows(2));
  EXPECT_FALSE(few.knows(3));
  for (Material a = 0; a < 3; ++a) EXPECT_GE(PairTable::number(a, 3), few.laws().size());
}

TEST(PairTable, OfOneMaterialTellsGrainsFromWalls) {
  const PairTable table = laws_of_one_material(0.5, 0.2, 0.7);
  EXPECT_EQ(table.between(material_of_grains, material_of_grains), (PairLaw{0.5, 0.7}));
  EXPECT_EQ(table.between(material_of_walls, material_of_grains), (PairLaw{0.2, 0.7}));
  EXPECT_EQ(table.largest(&PairLaw::friction), 0.5);
  EXPECT_EQ(laws_of_one_material(0.1, 0.2, 0).largest(&PairLaw::friction), 0.2) << "not the first of them";
}

TEST(PairTable, TheReferencePageSaysHowFarCohesionReaches) {
  const std::string said = cohesion_attraction.sentence;
  EXPECT_NE(said.find(fmt::format("a gap of {:g} of the smaller radius", CohesionRule{}.reach)),
            std::string::npos)
      << said;
}

}  // namespace
}  // namespace talus::pair_table_test
