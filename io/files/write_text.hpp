#pragma once

#include <functional>
#include <string_view>

namespace talus::io {

/// Where text goes as it is made, in order.
using WriteText = std::function<void(std::string_view)>;

}  // namespace talus::io
