#pragma once

/// Numbers of things, as types of their own: the number of a subdomain is no place in a list and no number of
/// a chunk, and mixing them does not compile.
///
///   using SubdomainId = Index<struct SubdomainTag>;
///   Per<SubdomainId, int> rank_of(4);
///   rank_of[SubdomainId(2)] = 1;  // neither rank_of[2] nor rank_of[ChunkId(2)] compiles

#include <compare>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <iterator>
#include <span>
#include <type_traits>
#include <vector>

namespace talus {

/// The place in an array that a plain number (of a body, contact or chunk) means. Not of a negative one.
template <std::signed_integral Number>
constexpr std::size_t at(Number k) {
  return static_cast<std::size_t>(k);
}

/// The number of a thing of one kind: 4 bytes, in order of the number. `Tag` is never defined.
template <class Tag>
class Index {
 public:
  constexpr Index() = default;  ///< of none
  /// Of a number that is known to be one of this kind.
  template <std::integral Number>
  constexpr explicit Index(Number number) : value_(static_cast<std::int32_t>(number)) {}

  constexpr std::int32_t value() const { return value_; }
  constexpr bool none() const { return value_ < 0; }
  /// Where its entry is in an array that has one per thing. Not of none.
  constexpr std::size_t at() const { return static_cast<std::size_t>(value_); }

  friend constexpr auto operator<=>(Index, Index) = default;

 private:
  std::int32_t value_ = -1;
};

/// The first `count` numbers of a kind, to go through one by one. (std::views would do the same, but clang 14
/// does not compile those of libstdc++ 12.)
template <class Kind>
class FirstNumbers {
 public:
  class Iterator {
   public:
    using iterator_category = std::input_iterator_tag;
    using value_type = Kind;
    using difference_type = std::ptrdiff_t;
    using pointer = const Kind*;
    using reference = Kind;
    constexpr Iterator() = default;
    constexpr explicit Iterator(std::int32_t at) : at_(at) {}
    constexpr Kind operator*() const { return Kind(at_); }
    constexpr Iterator& operator++() {
      ++at_;
      return *this;
    }
    constexpr Iterator operator++(int) { return Iterator(at_++); }
    friend constexpr bool operator==(Iterator, Iterator) = default;

   private:
    std::int32_t at_ = 0;
  };

  constexpr explicit FirstNumbers(std::size_t count) : count_(static_cast<std::int32_t>(count)) {}
  constexpr Iterator begin() const { return Iterator(0); }
  constexpr Iterator end() const { return Iterator(count_); }

 private:
  std::int32_t count_;
};

/// A vector with one entry per thing of a kind: it takes no number of another kind.
template <class Kind, class T>
class Per : public std::vector<T> {
 public:
  using std::vector<T>::vector;
  T& operator[](Kind k) { return std::vector<T>::operator[](k.at()); }
  const T& operator[](Kind k) const { return std::vector<T>::operator[](k.at()); }
  /// The numbers of its entries.
  FirstNumbers<Kind> indices() const { return FirstNumbers<Kind>(this->size()); }
};

/// The numbers themselves, for kernels that take plain ones.
template <class Tag>
std::span<const std::int32_t> numbers(std::span<const Index<Tag>> of) {
  static_assert(sizeof(Index<Tag>) == sizeof(std::int32_t) && std::is_standard_layout_v<Index<Tag>>);
  return {reinterpret_cast<const std::int32_t*>(of.data()), of.size()};
}

}  // namespace talus

template <class Tag>
struct std::hash<talus::Index<Tag>> {
  std::size_t operator()(talus::Index<Tag> k) const noexcept { return std::hash<std::int32_t>()(k.value()); }
};
