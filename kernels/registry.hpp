#pragma once

/// The ways there are of doing one thing, as tables: what can be chosen, how scenes, help and pages call it,
/// and how it is made. A table stands beside what it lists; scene keys, --help and docs/scenes.md read it.
///
///   constexpr Entry<Coupling> couplings[] = {{Coupling::nscdd, "nscdd", "copies share the mass"}, ...};
///   inline constexpr Registry<Coupling> coupling_registry("coupling", couplings);
///   coupling_registry.named("nscdd").kind;   coupling_registry.of(Coupling::nscdd).name;

#include <algorithm>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace talus {

/// One way of doing a thing. `Maker`: a function pointer that makes it; left out where a switch suffices.
template <class Kind, class Maker = std::monostate>
struct Entry {
  Kind kind;
  std::string_view name;      ///< unique among its registry: as scene files and options spell it
  std::string_view sentence;  ///< what it does; begins in lower case and has no full stop
  Maker make = {};
};

/// Base of kinds that only their names tell from one another, so that one more needs no line but that of its
/// registry. A kind names as constants those that code asks for:
///
///   class Dish : public NamedKind<Dish> {
///     using NamedKind::NamedKind;
///     static const Dish soup;
///   };
///   inline constexpr Dish Dish::soup("soup");
template <class Kind>
class NamedKind {
 public:
  /// `name` is that of a line of the registry, and lives as long as the program.
  constexpr explicit NamedKind(std::string_view name) : name_(name) {}
  constexpr std::string_view name() const { return name_; }
  friend constexpr bool operator==(const Kind& a, const Kind& b) { return a.name() == b.name(); }

 private:
  std::string_view name_;
};

/// A way that only its name tells from the others; `Kind` is made from the name.
template <class Kind = std::string_view, class Maker>
constexpr Entry<Kind, Maker> named(std::string_view name, std::string_view sentence, Maker make) {
  return {Kind(name), name, sentence, make};
}

/// A view of entries that outlive it, in the order in which they are listed to users.
template <class Kind, class Maker = std::monostate>
class Registry {
 public:
  using Item = Entry<Kind, Maker>;

  /// `what`: the word for one of them in messages.
  constexpr Registry(std::string_view what, std::span<const Item> entries) : what_(what), entries_(entries) {}

  constexpr auto begin() const { return entries_.begin(); }
  constexpr auto end() const { return entries_.end(); }
  constexpr std::size_t size() const { return entries_.size(); }

  /// Throws std::logic_error for a kind that nobody has registered.
  const Item& of(Kind kind) const {
    const auto found = std::find_if(begin(), end(), [&](const Item& item) { return item.kind == kind; });
    if (found == end()) throw std::logic_error("a " + std::string(what_) + " is missing in its registry");
    return *found;
  }

  /// Throws std::invalid_argument that lists the names there are.
  const Item& named(std::string_view name) const {
    const auto found = std::find_if(begin(), end(), [&](const Item& item) { return item.name == name; });
    if (found != end()) return *found;
    std::string known;
    for (const Item& item : entries_) known.append(known.empty() ? "" : ", ").append(item.name);
    throw std::invalid_argument(std::string(what_) + " '" + std::string(name) + "' is not known; there are " +
                                known);
  }

  std::vector<std::string> names() const {
    std::vector<std::string> names;
    for (const Item& item : entries_) names.emplace_back(item.name);
    return names;
  }

  /// "`name`: sentence; `name`: sentence.", for the reference of scene files.
  std::string meaning() const {
    std::string text;
    for (const Item& item : entries_)
      text.append(text.empty() ? "`" : "; `").append(item.name).append("`: ").append(item.sentence);
    return text + ".";
  }

 private:
  std::string_view what_;
  std::span<const Item> entries_;
};

}  // namespace talus
