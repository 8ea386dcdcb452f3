#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace talus::io::detail {

/// Finds the place of a body in a frame by its id.
class BodyIndex {
 public:
  explicit BodyIndex(std::span<const std::int64_t> id);
  /// Throws std::invalid_argument naming the id when there is no such body.
  std::size_t at(std::int64_t id) const;

 private:
  std::vector<std::pair<std::int64_t, std::size_t>> places_;  ///< (id, place), sorted
};

/// Index of the wall that a negative entry of Frame::contact_bodies stands for: -(1 + wall index).
constexpr std::size_t wall_index(std::int64_t body) {
  return static_cast<std::size_t>(-(body + 1));
}

}  // namespace talus::io::detail
