#include "kernels/detection/detail/contact_groups.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "kernels/bodies/index.hpp"
#include "kernels/simd/contact_view.hpp"

namespace talus::detail {

namespace {

constexpr std::size_t groups_open = 64;
static_assert(longest_chunk <= groups_open * group_size);
constexpr std::size_t few = 16;  ///< repairs pay if at most one contact in so many has changed

/// Calls rule(array) for each array of places except impulses, which are read from the candidates afterwards.
template <class Rule>
void for_each_array(Contacts& contacts, Rule rule) {
  for (auto* values : {&contacts.nx, &contacts.ny, &contacts.nz, &contacts.bias}) rule(*values);
  rule(contacts.candidate);
  for (auto* values : {&contacts.first, &contacts.second}) rule(*values);
}

/// The groups of a chunk while they are repaired. Places count from the chunk's first.
class Repair {
 public:
  explicit Repair(const ChunkPlaces& places)
      : places_(places),
        begin_(at(places.chunks.begin[places.chunk])),
        count_(at(places.contacts.count[places.chunk])) {
    const std::uint8_t* size = places.contacts.group.data() + begin_;
    for (std::size_t k = 0; k < count_; k += *size++) group_begin_.push_back(k);
  }

  bool run() {
    std::vector<std::size_t> holes, came;
    for (std::size_t k = 0; k < places_.contact.size(); ++k)
      if ((places_.contact[k] != 0) != (k < count_)) (k < count_ ? holes : came).push_back(k);
    std::vector<std::size_t> left;
    for (const std::size_t hole : holes) {
      const auto fit = std::ranges::find_if(came, [&](std::size_t k) { return fits(k, group_of(hole)); });
      if (fit == came.end()) {
        left.push_back(hole);
      } else {
        swap(hole, *fit);
        came.erase(fit);
      }
    }
    // From the last one on, so that no other hole comes after the one that is closed.
    for (; !left.empty(); left.pop_back())
      if (!close(left.back())) return false;
    for (const std::size_t k : came)
      if (!append(k)) return false;
    write();
    return true;
  }

 private:
  std::size_t last() const { return group_begin_.size() - 1; }
  std::size_t end_of(std::size_t group) const { return group == last() ? count_ : group_begin_[group + 1]; }
  std::size_t group_of(std::size_t place) const {
    const auto behind = std::ranges::upper_bound(group_begin_, place);
    return static_cast<std::size_t>(behind - group_begin_.begin()) - 1;
  }
  /// Whether the pair at `place` shares no grain with the contacts of a group that it is not in.
  bool fits(std::size_t place, std::size_t group) const {
    const std::uint32_t *first = record_places(places_.contacts.first.data()) + begin_,
                        *second = record_places(places_.contacts.second.data()) + begin_;
    const std::uint32_t i = first[place], j = second[place];
    for (std::size_t k = group_begin_[group]; k < end_of(group); ++k)
      if (places_.contact[k] != 0 && (first[k] == i || first[k] == j || second[k] == i || second[k] == j))
        return false;
    return true;
  }
  void swap(std::size_t a, std::size_t b) {
    if (a == b) return;
    std::swap(places_.contact[a], places_.contact[b]);
    for_each_array(places_.contacts,
                   [&](auto& values) { std::swap(values[begin_ + a], values[begin_ + b]); });
  }
  bool close(std::size_t hole) {
    const std::size_t group = group_of(hole);
    std::size_t from = count_ - 1;
    if (group != last()) {
      while (!fits(from, group))
        if (from-- == group_begin_.back()) return false;
      swap(hole, from);
    } else {
      from = hole;
    }
    swap(from, --count_);
    if (count_ == group_begin_.back()) group_begin_.pop_back();
    return true;
  }
  bool append(std::size_t place) {
    const bool full = group_begin_.empty() || count_ - group_begin_.back() == group_size;
    if (!full && !fits(place, last())) return false;
    if (full) group_begin_.push_back(count_);
    swap(place, count_++);
    return true;
  }
  void write() {
    places_.contacts.count[places_.chunk] = static_cast<std::int32_t>(count_);
    for (std::size_t group = 0; group < group_begin_.size(); ++group)
      places_.contacts.group[begin_ + group] = static_cast<std::uint8_t>(end_of(group) - group_begin_[group]);
  }

  const ChunkPlaces& places_;
  std::size_t begin_;
  std::size_t count_;                     ///< contacts that stand in groups
  std::vector<std::size_t> group_begin_;  ///< first place of each group
};

}  // namespace

void deal_groups(const ChunkPlaces& places) {
  const Chunks& chunks = places.chunks;
  Contacts& contacts = places.contacts;
  const std::size_t begin = at(chunks.begin[places.chunk]), count = places.contact.size();
  const std::size_t bodies = at(chunks.body_begin[places.chunk + 1] - chunks.body_begin[places.chunk]);
  std::vector<std::uint16_t> place(count);  // of the candidates
  for (std::size_t k = 0; k < count; ++k)
    place[at(contacts.candidate[begin + k]) - begin] = static_cast<std::uint16_t>(k);
  // One bit per group and grain. Contacts that fit none of the open groups (those of a large grain among
  // small ones) come next, each in a group of its own, then the pairs that are no contacts.
  std::vector<std::uint64_t> in_group(bodies, 0);
  std::array<std::array<std::uint16_t, group_size>, groups_open> group;
  std::array<std::size_t, groups_open> filled{};
  std::uint64_t open = ~std::uint64_t{0};
  std::vector<std::uint16_t> from, late, others;
  from.reserve(count);
  others.reserve(count);
  for (std::size_t k = begin; k < begin + count; ++k) {
    const std::size_t candidate = chunks.order[k];
    const std::uint16_t p = place[candidate];
    if (places.contact[p] == 0) {
      others.push_back(p);
      continue;
    }
    std::uint64_t& mask_i = in_group[chunks.local[2 * (begin + candidate)]];
    std::uint64_t& mask_j = in_group[chunks.local[2 * (begin + candidate) + 1]];
    const std::uint64_t room = open & ~(mask_i | mask_j);
    if (room == 0) {
      late.push_back(p);
      continue;
    }
    const auto g = static_cast<std::size_t>(std::countr_zero(room));
    const std::uint64_t bit = std::uint64_t{1} << g;
    mask_i |= bit;
    mask_j |= bit;
    group[g][filled[g]++] = p;
    if (filled[g] == group_size) open &= ~bit;
  }
  std::uint8_t* sizes = contacts.group.data() + begin;
  for (std::size_t g = 0; g < groups_open && filled[g] > 0; ++g) {
    from.insert(from.end(), group[g].begin(), group[g].begin() + static_cast<std::ptrdiff_t>(filled[g]));
    *sizes++ = static_cast<std::uint8_t>(filled[g]);
  }
  from.insert(from.end(), late.begin(), late.end());
  std::fill_n(sizes, late.size(), std::uint8_t{1});
  from.insert(from.end(), others.begin(), others.end());
  contacts.count[places.chunk] = static_cast<std::int32_t>(count - others.size());
  std::tuple<std::vector<double>, std::vector<std::int32_t>, std::vector<ContactBody>> rooms;
  for_each_array(contacts, [&](auto& values) {
    auto& before = std::get<std::remove_reference_t<decltype(values)>>(rooms);
    const auto start = values.begin() + static_cast<std::ptrdiff_t>(begin);
    before.assign(start, start + static_cast<std::ptrdiff_t>(count));
    for (std::size_t k = 0; k < count; ++k) values[begin + k] = before[from[k]];
  });
}

bool repair_groups(const ChunkPlaces& places) {
  const std::size_t count = at(places.contacts.count[places.chunk]);
  const auto were = places.contact.first(count), others = places.contact.subspan(count);
  const auto changed = static_cast<std::size_t>(std::ranges::count(were, 0) +
                                                std::ranges::count_if(others, [](auto c) { return c != 0; }));
  if (changed == 0) return true;
  return few * changed <= count && Repair(places).run();
}

}  // namespace talus::detail
