#include "io/results/progress.hpp"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>

#include "io/files/detail/with_unit.hpp"

namespace talus::io {
namespace {

constexpr std::chrono::milliseconds terminal_interval{200};
constexpr std::chrono::seconds file_interval{10};

/// 7, 1:07, 1:01:07; days are hours too, since clusters count so.
std::string duration_text(double seconds) {
  if (!(seconds < 1e9)) return "--";
  const auto total = static_cast<std::int64_t>(std::ceil(seconds));
  const std::int64_t hours = total / 3600, minutes = total / 60 % 60, rest = total % 60;
  if (hours > 0) return fmt::format("{}:{:02}:{:02}", hours, minutes, rest);
  if (minutes > 0) return fmt::format("{}:{:02}", minutes, rest);
  return fmt::format("{} s", rest);
}

/// Cut to `columns` characters of UTF-8: a byte 10xxxxxx goes on with the character before it.
std::string_view cut(std::string_view line, std::size_t columns) {
  std::size_t characters = 0;
  for (std::size_t k = 0; k < line.size(); ++k) {
    const bool begins = (static_cast<unsigned char>(line[k]) & 0xc0) != 0x80;
    if (begins && ++characters > columns) return line.substr(0, k);
  }
  return line;
}

}  // namespace

std::string progress_line(const StepReport& report, const std::string& stage, double fraction,
                          std::optional<double> eta) {
  return fmt::format("{}  {:.0f} %  step {}  t {}  {} contacts  {} it  err {:.1e}{}  ETA {}", stage,
                     std::floor(100 * std::clamp(fraction, 0.0, 1.0)), report.step,
                     detail::with_unit(report.time, "s"), report.contacts, report.iterations,
                     report.error_rms, report.converged ? "" : " MISSED", eta ? duration_text(*eta) : "--");
}

Progress::Progress(std::FILE* stream, bool terminal, std::size_t columns)
    : stream_(stream), terminal_(terminal), columns_(columns) {}

void Progress::update(const StepReport& report, const std::string& stage, double fraction,
                      Clock::time_point now) {
  const bool new_stage = !stage_begin_ || stage != stage_;
  if (new_stage) {
    stage_ = stage;
    stage_begin_ = now;
    stage_begin_fraction_ = fraction;
  }
  std::optional<double> eta;
  if (fraction > stage_begin_fraction_) {
    const double elapsed = std::chrono::duration<double>(now - *stage_begin_).count();
    eta = elapsed * (1 - fraction) / (fraction - stage_begin_fraction_);
  }
  const Clock::duration interval =
      terminal_ ? Clock::duration(terminal_interval) : Clock::duration(file_interval);
  const bool due = !last_shown_ || now - *last_shown_ >= interval;
  line_ = progress_line(report, stage, fraction, eta);
  shown_ = false;
  if (due) {
    show();
    last_shown_ = now;
  }
}

void Progress::finish() {
  if (!shown_) show();
  if (open_) {
    std::fputc('\n', stream_);
    std::fflush(stream_);
  }
  open_ = false;
}

void Progress::show() {
  if (terminal_) {
    // Back to the first column, write, clear what an older and longer line left.
    const std::string_view shown = cut(line_, columns_);
    std::fprintf(stream_, "\r%.*s\x1b[K", static_cast<int>(shown.size()), shown.data());
    open_ = true;
  } else {
    std::fprintf(stream_, "%s\n", line_.c_str());
  }
  std::fflush(stream_);
  shown_ = true;
}

Progress progress_on_stderr() {
  const bool terminal = ::isatty(STDERR_FILENO) == 1;
  winsize size{};
  const bool known = terminal && ::ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 1;
  return {stderr, terminal, known ? size.ws_col - std::size_t{1} : 79};
}

}  // namespace talus::io
