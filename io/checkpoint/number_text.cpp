#include "io/checkpoint/number_text.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cstdlib>
#include <utility>

#include "io/files/error.hpp"

namespace talus::io {

void NumberWriter::put(double value) const {
  text_ += fmt::format(" {:a}", value);
}
void NumberWriter::put(std::int64_t value) const {
  text_ += fmt::format(" {}", value);
}
void NumberWriter::put(const std::string& value) const {
  text_ += ' ' + value;
}

NumberReader::NumberReader(std::string_view text, std::string file) : file_(std::move(file)) {
  while (!text.empty()) {
    std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(text.size(), line.size() + 1));
    const std::size_t equals = line.find(" =");
    if (equals == std::string_view::npos) continue;
    std::vector<std::string>& words = words_[std::string(line.substr(0, equals))];
    line.remove_prefix(equals + 2);
    while (!line.empty()) {
      const std::size_t begin = std::min(line.find_first_not_of(' '), line.size());
      const std::size_t end = std::min(line.find(' ', begin), line.size());
      if (end > begin) words.emplace_back(line.substr(begin, end - begin));
      line.remove_prefix(end);
    }
  }
}

const std::vector<std::string>& NumberReader::words_of(const char* name) const {
  const auto found = words_.find(name);
  if (found == words_.end()) fail(name);
  return found->second;
}

const std::string& NumberReader::word_at(const char* name, const std::vector<std::string>& words,
                                         std::size_t k) const {
  if (k >= words.size()) fail(name);
  return words[k];
}

void NumberReader::take(const char* name, const std::string& word, double& value) const {
  char* end = nullptr;
  value = std::strtod(word.c_str(), &end);
  if (end != word.c_str() + word.size()) fail(name);
}

void NumberReader::take(const char* name, const std::string& word, std::int64_t& value) const {
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc{} || end != word.data() + word.size()) fail(name);
}

void NumberReader::fail(const char* name) const {
  throw FileError(file_, fmt::format("'{}' is missing or no number; the file is damaged, or of another "
                                     "version of Talus",
                                     name));
}

}  // namespace talus::io
