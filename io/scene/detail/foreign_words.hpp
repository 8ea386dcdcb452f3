#pragma once

#include <string>

namespace talus::io::detail {

/// "; here it is ..." for a word that other programs of grains have for something, "" for others. Words of
/// scenes and of command lines, the latter without their dashes; capitals and lines between parts of a word
/// do not count.
std::string foreign_hint(const std::string& word);

}  // namespace talus::io::detail
