#pragma once

#include <string>
#include <string_view>

namespace talus::io::detail {

/// A number with an SI prefix and its unit, three digits: "1.23 kPa"; zero and what is not finite as it
/// stands.
std::string with_unit(double value, std::string_view unit);

}  // namespace talus::io::detail
