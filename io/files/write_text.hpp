#pragma once

#include <functional>
#include <string_view>

namespace talus::io {

/// Receives text in pieces, in order, as it is made.
using WriteText = std::function<void(std::string_view)>;

}  // namespace talus::io
