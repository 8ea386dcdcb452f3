#pragma once

#include <map>
#include <string>

namespace talus::io {

/// Lines of a scene's file, from 1, by the words with which messages name what stands there: "cell.lengths",
/// "sample[0].count", "stage 'rest'", "stage 'rest': end.time", "wall 'lid'". 0 of what --set has
/// brought in.
using ScenePlaces = std::map<std::string, int>;

/// The line of `key`, or of the nearest table around it; else of what `message` is about: of the most words
/// known that it begins with, or of the first name in it. 0 where neither names anything.
int line_of(const ScenePlaces& places, const std::string& key, const std::string& message);

}  // namespace talus::io
