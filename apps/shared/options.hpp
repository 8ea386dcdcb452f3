#pragma once

/// Checks of options. CLI11's own say the largest of all doubles when they refuse.

#include <CLI/CLI.hpp>

#include <string>

namespace talus {

inline CLI::Validator above_zero() {
  return {[](std::string& text) {
            double value = 0;
            return CLI::detail::lexical_cast(text, value) && value > 0 ? "" : "must be above 0, got " + text;
          },
          "POSITIVE"};
}

inline CLI::Validator not_negative() {
  return {[](std::string& text) {
            double value = 0;
            return CLI::detail::lexical_cast(text, value) && value >= 0 ? ""
                                                                        : "must be 0 or more, got " + text;
          },
          "NOT NEGATIVE"};
}

/// Beyond 4096 a typing error is likelier than a machine.
inline CLI::Validator thread_count() {
  return CLI::Range(1, 4096);
}

}  // namespace talus
