#include "io/scene/detail/spelling.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <utility>

namespace talus::io::detail {

std::size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> before_last(b.size() + 1), last(b.size() + 1), row(b.size() + 1);
  std::iota(last.begin(), last.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (a[i - 1] == b[j - 1] ? 0u : 1u)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        row[j] = std::min(row[j], before_last[j - 2] + 1);
    }
    before_last.swap(last);
    last.swap(row);
  }
  return last[b.size()];
}

std::string nearest(const std::string& word, const std::vector<std::string>& known) {
  const std::size_t limit = word.size() <= 3 ? 1 : std::max<std::size_t>(2, word.size() / 3);
  std::string best;
  // Of words as near, one of the same letters is meant: "xz" by "zx", not "xx".
  std::pair<std::size_t, bool> least{limit + 1, false};
  for (const std::string& candidate : known)
    if (const std::pair<std::size_t, bool> distance{edit_distance(word, candidate),
                                                    !std::ranges::is_permutation(word, candidate)};
        distance < least) {
      least = distance;
      best = candidate;
    }
  return best;
}

std::string listed(const std::vector<std::string>& words) {
  return fmt::format("{}", fmt::join(words, ", "));
}

std::string hint(const std::string& word, const std::vector<std::string>& known) {
  if (known.empty()) return "; there are none";
  const std::string meant = nearest(word, known);
  return meant.empty() ? "; known are: " + listed(known) : fmt::format("; did you mean '{}'?", meant);
}

}  // namespace talus::io::detail
