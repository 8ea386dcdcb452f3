#pragma once

/// Numbers by name as text, a line each: "time = 0x1.8p+1". Reals are hexadecimal, so that they read back to
/// the same bits, infinity among them. Both classes are visitors for structs that hand out their members
/// (each_member in runtime/step/checkpoint.hpp).

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "kernels/bodies/types.hpp"

namespace talus::io {

class NumberWriter {
 public:
  /// Integers, bool, double, Vec3, a text without line ends, and vectors of integers, doubles or texts
  /// without spaces.
  template <class T>
  void operator()(const char* name, const T& value) const {
    text_ += name;
    text_ += " =";
    put(value);
    text_ += '\n';
  }
  const std::string& text() const { return text_; }

 private:
  void put(double value) const;
  void put(std::int64_t value) const;
  void put(const std::string& value) const;
  void put(const Vec3& value) const {
    for (const double x : value) put(x);
  }
  template <class T>
  requires std::is_integral_v<T>
  void put(T value) const { put(static_cast<std::int64_t>(value)); }
  template <class T>
  void put(const std::vector<T>& values) const {
    for (const T& value : values) put(value);
  }

  mutable std::string text_;  ///< visitors are passed as const
};

class NumberReader {
 public:
  /// `file` is named in errors: FileError for a name that is missing and a value that is no number.
  NumberReader(std::string_view text, std::string file);

  bool has(const char* name) const { return words_.count(name) > 0; }

  template <class T>
  void operator()(const char* name, T& value) const {
    const std::vector<std::string>& words = words_of(name);
    if constexpr (requires { value.push_back({}); } && !std::is_same_v<T, std::string>) {
      value.clear();
      for (const std::string& word : words) take(name, word, value.emplace_back());
    } else if constexpr (std::is_same_v<T, Vec3>) {
      for (Eigen::Index k = 0; k < 3; ++k)
        take(name, word_at(name, words, static_cast<std::size_t>(k)), value[k]);
    } else if constexpr (std::is_same_v<T, std::string>) {
      value.clear();
      for (const std::string& word : words) value += (value.empty() ? "" : " ") + word;
    } else {
      take(name, word_at(name, words, 0), value);
    }
  }

 private:
  const std::vector<std::string>& words_of(const char* name) const;
  const std::string& word_at(const char* name, const std::vector<std::string>& words, std::size_t k) const;
  void take(const char* name, const std::string& word, double& value) const;
  void take(const char* name, const std::string& word, std::int64_t& value) const;
  void take(const char*, const std::string& word, std::string& value) const { value = word; }
  template <class T>
  requires std::is_integral_v<T>
  void take(const char* name, const std::string& word, T& value) const {
    std::int64_t read = 0;
    take(name, word, read);
    value = static_cast<T>(read);
  }
  [[noreturn]] void fail(const char* name) const;

  std::string file_;
  std::map<std::string, std::vector<std::string>, std::less<>> words_;
};

}  // namespace talus::io
