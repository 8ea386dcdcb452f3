#pragma once

/// What the table of keys (scene_keys.hpp) is written in: a key of a scene file, bound to a member of the
/// struct it fills.

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

#include "kernels/bodies/bodies.hpp"
#include "kernels/registry.hpp"

namespace talus::io::detail {

/// A value as a scene file holds it; monostate: nothing there.
using Value = std::variant<std::monostate, bool, std::int64_t, double, std::string, std::vector<std::int64_t>,
                           std::vector<double>>;

/// Numbers that a key takes, entry by entry for lists. Finite, whatever the range.
struct Range {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool without_low = false;  ///< low itself is not allowed
  bool holds(double value) const { return value <= high && (without_low ? value > low : value >= low); }
};
inline constexpr Range any{};
inline constexpr Range positive{.low = 0, .without_low = true};
inline constexpr Range sound_mass{.low = least_mass, .high = most_mass};
inline constexpr Range sound_density{.low = 1e-30,
                                     .high = 1e30};  ///< a grain of any radius has a mass of its own limits
inline constexpr Range not_negative{.low = 0};
inline constexpr Range at_least_one{.low = 1};
inline constexpr Range countable{.low = 1, .high = 2147483647};  ///< what fits a Slot or an int
inline constexpr Range zero_to_one{.low = 0, .high = 1};

template <class T>
bool all_zero(const T& value) {
  if constexpr (std::is_arithmetic_v<T>)
    return value == T{};
  else if constexpr (requires { value.front() == 0; } && !std::is_same_v<T, std::string>)
    return std::all_of(value.begin(), value.end(), [](auto v) { return v == 0; });
  else
    return false;
}

/// What is said of a key, whatever it is bound to.
struct KeyText {
  std::string name;
  std::string unit = {};  ///< "" for pure numbers and the rest
  Range range = {};
  std::string meaning = {};  ///< one sentence for the reference
  Value kind = {};           ///< holds the alternative (and the length of a list) that the file must hold
  std::vector<std::string> choices = {};  ///< the texts allowed; empty: any
  bool required = false;                  ///< where it applies
  std::string default_text = {};  ///< for the reference, where the default is not what a new Part holds
  std::optional<double> automatic = {};  ///< the number that "auto" stands for
  std::string when = {};                 ///< where it applies, e.g. "kind = lattice"; "": everywhere
};

/// One key of a table that fills a `Part`.
template <class Part>
struct Key : KeyText {
  /// `when` as a test, of a Part with all its keys read; empty: everywhere.
  std::function<bool(const Part&)> applies = {};
  std::function<void(Part&, const Value&)> set = {};
  std::function<Value(const Part&)> get = {};

  Key&& need() && {
    required = true;
    return std::move(*this);
  }
  Key&& or_else(std::string text) && {
    default_text = std::move(text);
    return std::move(*this);
  }
  Key&& or_auto(double stands_for, std::string text) && {
    automatic = stands_for;
    default_text = "auto: " + std::move(text);
    return std::move(*this);
  }
  /// A member that holds only zeros counts as not given.
  Key&& blank_when_zero() && {
    get = [held = std::move(get)](const Part& part) {
      const Value value = held(part);
      const bool zero = std::visit([](const auto& v) { return all_zero(v); }, value);
      return zero ? Value{} : value;
    };
    return std::move(*this);
  }
  Key&& only(std::string text, std::function<bool(const Part&)> test) && {
    when = std::move(text);
    applies = std::move(test);
    return std::move(*this);
  }
};

/// A table of the scene, or the elements of an array of tables.
template <class Part>
struct Section {
  std::string header;   ///< as TOML writes it: "[solver]", "[[stage]]"; "" for the keys at the top
  std::string meaning;  ///< for the reference
  std::vector<Key<Part>> keys;
};

/// Conversion between a member of type T and a Value.
template <class T>
struct Held {
  static Value out(const T& member) {
    if constexpr (std::is_same_v<T, bool> || std::is_same_v<T, double> || std::is_same_v<T, std::string>)
      return member;
    else
      return static_cast<std::int64_t>(member);
  }
  static void in(T& member, const Value& value) {
    if constexpr (std::is_integral_v<T> && !std::is_same_v<T, bool>)
      member = static_cast<T>(std::get<std::int64_t>(value));
    else
      member = std::get<T>(value);
  }
};
template <>
struct Held<Vec3> {
  static Value out(const Vec3& member) { return std::vector<double>(member.begin(), member.end()); }
  static void in(Vec3& member, const Value& value) {
    const auto& list = std::get<std::vector<double>>(value);
    member = Vec3(list[0], list[1], list[2]);
  }
};
template <class T, std::size_t n>
struct Held<std::array<T, n>> {
  static Value out(const std::array<T, n>& member) { return std::vector<T>(member.begin(), member.end()); }
  static void in(std::array<T, n>& member, const Value& value) {
    const auto& list = std::get<std::vector<T>>(value);
    std::copy(list.begin(), list.end(), member.begin());
  }
};
template <class T>
struct Held<std::optional<T>> {
  static Value out(const std::optional<T>& member) { return member ? Held<T>::out(*member) : Value{}; }
  static void in(std::optional<T>& member, const Value& value) { Held<T>::in(member.emplace(), value); }
};
/// A list of any length: none in a Value.
template <>
struct Held<std::vector<double>> {
  static Value out(const std::vector<double>& member) { return member.empty() ? Value{} : Value{member}; }
  static void in(std::vector<double>& member, const Value& value) {
    member = std::get<std::vector<double>>(value);
  }
};
/// A value of the kind that members of type T are written as: the alternative, and the length of a list.
template <class T>
Value example_of() {
  if constexpr (std::is_same_v<T, Vec3>)
    return std::vector<double>(3);  // Vec3{} is not initialised
  else if constexpr (std::is_same_v<T, std::vector<double>>)
    return T{};
  else
    return Held<T>::out({});
}
template <class T>
struct Bare {
  using type = T;
};
template <class T>
struct Bare<std::optional<T>> {
  using type = T;
};

/// A key bound to what `access` (a member pointer, or a function from the part to a reference) gives.
template <class Part, class Access>
Key<Part> key(const char* name, const char* unit, Range range, const char* meaning, Access access) {
  using Member = std::remove_cvref_t<std::invoke_result_t<Access, Part&>>;
  Key<Part> result{{name, unit, range, meaning}};
  result.kind = example_of<typename Bare<Member>::type>();
  result.set = [access](Part& part, const Value& value) {
    Held<Member>::in(std::invoke(access, part), value);
  };
  result.get = [access](const Part& part) { return Held<Member>::out(std::invoke(access, part)); };
  return result;
}

/// A key of type T that is not simply a member: `set` takes a Part& and the value, `get` a Part and gives a
/// Value.
template <class T, class Part, class Set, class Get>
Key<Part> bound(const char* name, const char* unit, Range range, const char* meaning, Set set, Get get) {
  Key<Part> result{{name, unit, range, meaning}};
  result.kind = example_of<T>();
  result.set = [set](Part& part, const Value& value) {
    T held{};
    Held<T>::in(held, value);
    set(part, held);
  };
  result.get = get;
  return result;
}

/// A key whose texts name the values 0, 1, 2... of an enum or int.
template <class Part, class Access>
Key<Part> choice(const char* name, std::vector<std::string> names, const char* meaning, Access access) {
  using Member = std::remove_cvref_t<std::invoke_result_t<Access, Part&>>;
  Key<Part> result{{name, "", any, meaning}};
  result.kind = std::string();
  result.choices = names;
  result.set = [access, names](Part& part, const Value& value) {
    const auto found = std::find(names.begin(), names.end(), std::get<std::string>(value));
    std::invoke(access, part) = static_cast<Member>(found - names.begin());
  };
  result.get = [access, names](const Part& part) -> Value {
    return names[static_cast<std::size_t>(std::invoke(access, part))];
  };
  return result;
}

/// A key whose texts, and what is said of them, are those of a registry.
template <class Part, class Kind, class Maker, class Access>
Key<Part> choice(const char* name, const Registry<Kind, Maker>& registry, Access access) {
  Key<Part> result{{name, "", any, registry.meaning()}};
  result.kind = std::string();
  result.choices = registry.names();
  result.set = [access, &registry](Part& part, const Value& value) {
    std::invoke(access, part) = registry.named(std::get<std::string>(value)).kind;
  };
  result.get = [access, &registry](const Part& part) -> Value {
    return std::string(registry.of(std::invoke(access, part)).name);
  };
  return result;
}

/// The keys of a member, as keys of the struct that holds it.
template <class Part, class Whole>
std::vector<Key<Whole>> within(const std::vector<Key<Part>>& keys, Part Whole::*member) {
  std::vector<Key<Whole>> lifted;
  for (const Key<Part>& k : keys) {
    Key<Whole> copy{static_cast<const KeyText&>(k)};
    if (k.applies) copy.applies = [member, k](const Whole& whole) { return k.applies(whole.*member); };
    copy.set = [member, k](Whole& whole, const Value& value) { k.set(whole.*member, value); };
    copy.get = [member, k](const Whole& whole) { return k.get(whole.*member); };
    lifted.push_back(std::move(copy));
  }
  return lifted;
}

}  // namespace talus::io::detail
