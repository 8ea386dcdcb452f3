#pragma once

#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <string_view>
#include <utility>

namespace talus {

/// What a run says: on stderr, and the same in its run.log. A terminal that is gone, or a full disk behind
/// either, ends no simulation: what cannot be said is dropped.
class Terminal {
 public:
  /// `quiet`: warnings and errors alone go to stderr; the log gets all.
  explicit Terminal(bool quiet = false) : quiet_(quiet) {}

  /// From now on lines go to this file as well: behind what it holds, or from its beginning.
  void keep_in(const std::filesystem::path& log, bool behind) {
    log_.reset(std::fopen(log.c_str(), behind ? "a" : "w"));
  }

  /// A line "talus: ...".
  template <class... Args>
  void say(fmt::format_string<Args...> format, Args&&... args) const {
    line(fmt::format(format, std::forward<Args>(args)...), quiet_);
  }
  /// The same, also where it is quiet.
  template <class... Args>
  void warn(fmt::format_string<Args...> format, Args&&... args) const {
    line(fmt::format(format, std::forward<Args>(args)...), false);
  }

  bool quiet() const { return quiet_; }
  std::FILE* log() const { return log_.get(); }  ///< null: none

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  void line(std::string_view text, bool quiet) const {
    for (std::FILE* file : {quiet ? nullptr : stderr, log_.get()}) {
      if (file == nullptr) continue;
      std::fprintf(file, "talus: %.*s\n", static_cast<int>(text.size()), text.data());
      std::fflush(file);
    }
  }

  bool quiet_;
  std::unique_ptr<std::FILE, Close> log_;
};

}  // namespace talus
