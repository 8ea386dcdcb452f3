#include "io/trace/trace_export.hpp"

#include <gtest/gtest.h>

#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "tests/unit/runtime/trace/small_trace.hpp"

namespace talus::trace {
namespace {

TEST(Export, PerfettoHasTwoEventsARecord) {
  const Trace trace = test::two_subdomains(2);
  const std::string bytes = io::to_perfetto(trace, {});
  // Walk the packets: field 1, length-delimited.
  std::size_t events = 0, at = 0;
  const auto number = [&] {
    std::uint64_t value = 0;
    for (int shift = 0;; shift += 7) {
      const auto byte = static_cast<unsigned char>(bytes.at(at++));
      value |= std::uint64_t{byte & 0x7fU} << shift;
      if ((byte & 0x80U) == 0) return value;
    }
  };
  while (at < bytes.size()) {
    ASSERT_EQ(number(), 1u << 3 | 2u);
    const std::size_t end = number() + at;
    while (at < end) {
      const std::uint64_t tag = number();
      if ((tag & 7) == 2) {
        if (tag >> 3 == 11) ++events;
        const std::size_t length = number();
        at += length;
      } else {
        ASSERT_EQ(tag & 7, 0u);
        number();
      }
    }
    ASSERT_EQ(at, end);
  }
  EXPECT_EQ(events, 2 * trace.record_count());
}

TEST(Export, PajeOpensAndClosesEachTask) {
  const Trace trace = test::two_subdomains(1);
  const std::string text = io::to_paje(trace, {});
  std::size_t opened = 0, closed = 0;
  for (std::size_t at = text.find("\n5 "); at != std::string::npos; at = text.find("\n5 ", at + 1)) ++opened;
  for (std::size_t at = text.find("\n6 "); at != std::string::npos; at = text.find("\n6 ", at + 1)) ++closed;
  EXPECT_EQ(opened, trace.record_count());
  EXPECT_EQ(closed, trace.record_count());
}

TEST(Export, PajeLinksTheMessagesThatWereWaitedFor) {
  Trace trace = test::two_subdomains(2);
  const std::uint32_t there = message_name(0, 1), back = message_name(1, 0);
  trace.tracks[0].records.push_back({110, 0, there, 0, pack(1, kind_send)});
  trace.tracks[1].records.push_back({110, 0, back, 0, pack(1, kind_send)});
  trace.tracks[1].records.push_back({160, 10, there, 0, pack(1, kind_receive)});
  // Once more, as copies are added up within a check.
  trace.tracks[0].records.push_back({171, 0, there, 0, pack(1, kind_send)});
  trace.tracks[1].records.push_back({172, 5, there, 0, pack(1, kind_receive)});
  sort_tracks(trace);
  std::istringstream text(io::to_paje(trace, {}));
  std::vector<std::string> begun, ended;
  for (std::string line; std::getline(text, line);) {
    const std::string key = line.substr(line.rfind(' ') + 1);
    if (line.starts_with("7 ")) begun.push_back(key);
    if (line.starts_with("8 ")) ended.push_back(key);
  }
  EXPECT_EQ(begun.size(), 2u) << "nobody waited for the other";
  EXPECT_EQ(std::set(begun.begin(), begun.end()).size(), 2u) << "a key names one link";
  EXPECT_EQ(begun, ended);
}

}  // namespace
}  // namespace talus::trace
