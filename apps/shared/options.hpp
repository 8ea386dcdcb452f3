#pragma once

/// Checks of options, and the options that several commands have. CLI11's own checks say the largest of all
/// doubles when they refuse.

#include <CLI/CLI.hpp>

#include <string>
#include <vector>

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

/// --threads; what is left as it is stands for `otherwise`.
inline void add_threads(CLI::App& app, int& threads, const std::string& otherwise = "one per core") {
  app.add_option("--threads", threads, "threads [" + otherwise + "]")->type_name("N")->check(thread_count());
}

/// --set, once for each "a.b=c".
inline void add_overrides(CLI::App& app, std::vector<std::string>& overrides) {
  app.add_option("--set", overrides, "override a key of the scene, may be repeated")
      ->type_name("a.b=c")
      ->allow_extra_args(false);
}

}  // namespace talus
