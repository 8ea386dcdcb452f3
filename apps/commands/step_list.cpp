#include "apps/commands/step_list.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <sstream>
#include <stdexcept>

namespace talus {

namespace {

std::int64_t step_of(const std::string& text, const std::string& part) {
  std::int64_t step = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), step);
  if (error != std::errc() || end != text.data() + text.size() || step < 1)
    throw std::invalid_argument(
        fmt::format("'{}' names no steps; write a step from 1, or first:last, several with commas", part));
  return step;
}

}  // namespace

StepList::StepList(const std::string& text) {
  std::istringstream parts(text);
  for (std::string part; std::getline(parts, part, ',');) {
    const std::size_t colon = part.find(':');
    const std::int64_t first = step_of(part.substr(0, colon), part);
    const std::int64_t last = colon == std::string::npos ? first : step_of(part.substr(colon + 1), part);
    if (last < first) throw std::invalid_argument(fmt::format("steps '{}' run backwards", part));
    ranges_.emplace_back(first, last);
  }
  if (ranges_.empty()) throw std::invalid_argument("no steps are named");
}

bool StepList::contains(std::int64_t step) const {
  return std::ranges::any_of(ranges_,
                             [&](const auto& range) { return range.first <= step && step <= range.second; });
}

std::int64_t StepList::last() const {
  std::int64_t step = 0;
  for (const auto& range : ranges_) step = std::max(step, range.second);
  return step;
}

}  // namespace talus
