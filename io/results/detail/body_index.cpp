#include "io/results/detail/body_index.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

namespace talus::io::detail {

BodyIndex::BodyIndex(std::span<const std::int64_t> id) {
  places_.reserve(id.size());
  for (std::size_t k = 0; k < id.size(); ++k) places_.emplace_back(id[k], k);
  std::ranges::sort(places_);
}

std::size_t BodyIndex::at(std::int64_t id) const {
  const auto found = std::ranges::lower_bound(places_, id, {}, &std::pair<std::int64_t, std::size_t>::first);
  if (found == places_.end() || found->first != id) {
    throw std::invalid_argument(
        fmt::format("frame: a contact names body {}, which is not among its bodies", id));
  }
  return found->second;
}

}  // namespace talus::io::detail
