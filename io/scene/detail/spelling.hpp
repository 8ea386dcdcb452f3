#pragma once

#include <string>
#include <vector>

namespace talus::io::detail {

/// Number of letters to insert, drop, replace or swap with a neighbour to make `a` into `b`.
std::size_t edit_distance(const std::string& a, const std::string& b);

/// The word among `known` that `word` was probably meant to be, or "" when none is near.
std::string nearest(const std::string& word, const std::vector<std::string>& known);

/// "a, b, c".
std::string listed(const std::vector<std::string>& words);

/// "; did you mean 'x'?" when a word is near, else "; known are: a, b, c", or "; there
/// are none".
std::string hint(const std::string& word, const std::vector<std::string>& known);

}  // namespace talus::io::detail
