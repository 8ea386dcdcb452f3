#pragma once

/// What commands print: results to stdout, messages to stderr. Neither throws.

#include <fmt/format.h>

#include <cstdio>
#include <string>
#include <utility>

namespace talus {

/// A text of the results. What stdout does not take shows at the end of main, as an error.
template <class... Args>
void print_out(fmt::format_string<Args...> format, Args&&... args) {
  const std::string text = fmt::format(format, std::forward<Args>(args)...);
  std::fwrite(text.data(), 1, text.size(), stdout);
}

/// A message. A terminal that is gone or a full log ends no command: what cannot be said is dropped.
/// fmt::print would throw, also within the handler of another error.
template <class... Args>
void print_error(fmt::format_string<Args...> format, Args&&... args) {
  const std::string text = fmt::format(format, std::forward<Args>(args)...);
  std::fwrite(text.data(), 1, text.size(), stderr);
}

}  // namespace talus
