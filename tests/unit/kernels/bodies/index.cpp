#include "kernels/bodies/index.hpp"

#include <gtest/gtest.h>

#include <type_traits>
#include <unordered_set>

#include "runtime/step/state.hpp"

namespace talus {
namespace {

template <class Array, class Key>
concept Takes = requires(Array array, Key key) {
  array[key];
};
template <class A, class B>
concept Comparable = requires(A a, B b) {
  a == b;
};

// What must not compile: numbers of two kinds, or of none, in each other's place.
using PerSubdomain = Per<SubdomainId, int>;
static_assert(Takes<PerSubdomain, SubdomainId>);
static_assert(!Takes<PerSubdomain, SubdomainPlace>);
static_assert(!Takes<PerSubdomain, ChunkId>);
static_assert(!Takes<PerSubdomain, MessagePlace>);
static_assert(!Takes<PerSubdomain, int> && !Takes<PerSubdomain, std::size_t>);
static_assert(!Takes<std::vector<int>, SubdomainId> && !Takes<std::span<int>, ChunkId>);

static_assert(!std::is_convertible_v<int, SubdomainId> && !std::is_convertible_v<SubdomainId, int>);
static_assert(!std::is_convertible_v<SubdomainId, SubdomainPlace>);
static_assert(!std::is_constructible_v<SubdomainId, SubdomainPlace>);
static_assert(!std::is_assignable_v<ChunkId&, SubdomainPlace> && !std::is_assignable_v<ChunkId&, int>);
static_assert(Comparable<SubdomainId, SubdomainId>);
static_assert(!Comparable<SubdomainId, SubdomainPlace> && !Comparable<SubdomainId, int>);

// What asks for one kind of number cannot be asked with another.
static_assert(std::is_invocable_v<decltype(&Decomposition::subdomain_colour_of), Decomposition, SubdomainId>);
static_assert(
    !std::is_invocable_v<decltype(&Decomposition::subdomain_colour_of), Decomposition, SubdomainPlace>);
static_assert(!std::is_invocable_v<decltype(&Decomposition::slots_of), Decomposition, SubdomainId>);
static_assert(!std::is_invocable_v<decltype(&Decomposition::slots_of), Decomposition, std::size_t>);

// It costs no more than the number.
static_assert(sizeof(ChunkId) == 4 && std::is_trivially_copyable_v<ChunkId>);

TEST(Index, OfNothingIsNone) {
  EXPECT_TRUE(SubdomainId().none());
  EXPECT_FALSE(SubdomainId(0).none());
  EXPECT_LT(SubdomainId(), SubdomainId(0));
}

TEST(Index, NumbersTheEntriesOfAList) {
  Per<ChunkId, int> list(3, 0);
  for (const ChunkId c : list.indices()) list[c] = 10 * c.value();
  EXPECT_EQ(list, (std::vector<int>{0, 10, 20}));
  const std::vector<ChunkId> some{ChunkId(2), ChunkId(0)};
  const auto plain = numbers(std::span<const ChunkId>(some));
  EXPECT_EQ(std::vector<std::int32_t>(plain.begin(), plain.end()), (std::vector<std::int32_t>{2, 0}));
  EXPECT_EQ(std::unordered_set<ChunkId>(some.begin(), some.end()).count(ChunkId(2)), 1U);
}

}  // namespace
}  // namespace talus
