#include "io/pictures/picture_gantt.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <unordered_map>

#include "io/files/detail/with_unit.hpp"
#include "io/pictures/detail/svg.hpp"
#include "runtime/trace/analysis.hpp"

namespace talus::io {
namespace {

using detail::Svg;
using trace::Record;
namespace style = detail::style;

constexpr double width = 1400, left = 110, right = width - 20, top = 74;
constexpr std::size_t most_rows = 64;
/// By phase: partitioning, detection, sweeps, exchange, update, waiting, outside.
constexpr std::array<std::string_view, trace::phase_count> colours{"#8e6bb8", "#5b9bd5", "#5aa469", "#d9822b",
                                                                   "#a39a3c", "#eef1f4", "#c3cbd3"};
constexpr std::string_view wait_colour = "#c0392b";

struct Bar {
  double begin, end;  ///< [px]
  std::string_view colour;
  std::size_t tasks;
};

class Gantt {
 public:
  Gantt(const trace::Timeline& timeline, const TraceWindow& window)
      : timeline_(timeline), trace_(timeline.trace()), window_(window) {
    begin_ = std::numeric_limits<double>::infinity();
    end_ = -begin_;
    for (const trace::Track& track : trace_.tracks)
      for (const Record& record : track.records) {
        if (!window.shows(record)) continue;
        begin_ = std::min(begin_, static_cast<double>(record.begin));
        end_ = std::max(end_, record.end());
      }
    if (!(end_ > begin_))
      throw trace::TraceError("the trace holds nothing of the step or iteration that was asked for");
    rows_ = std::min(most_rows, trace_.tracks.size());
    height_ = std::clamp(800.0 / static_cast<double>(rows_), 10.0, 36.0);
  }

  std::string draw() {
    Svg svg(width, top + static_cast<double>(rows_) * height_ + 46);
    for (std::size_t k = 0; k < rows_; ++k) draw_row(svg, k);
    draw_messages(svg);
    if (window_.step) draw_path(svg);
    draw_axis(svg);
    draw_head(svg);
    return svg.finish();
  }

 private:
  double x(double time) const { return left + (time - begin_) / (end_ - begin_) * (right - left); }
  double y(std::size_t row) const { return top + static_cast<double>(row) * height_; }

  /// Bars that cannot be told apart become one per cell of half a pixel, in the colour that fills most of it.
  static std::vector<Bar> merge(const std::vector<Bar>& bars) {
    constexpr double cell = 0.5;
    std::vector<Bar> out;
    std::map<std::string_view, double> filled;
    double at = -1;
    std::size_t inside = 0;
    const auto flush = [&] {
      if (inside == 0) return;
      const auto most = std::max_element(filled.begin(), filled.end(),
                                         [](const auto& a, const auto& b) { return a.second < b.second; });
      if (!out.empty() && out.back().tasks > 1 && out.back().colour == most->first && out.back().end >= at) {
        out.back().end = at + cell;
        out.back().tasks += inside;
      } else {
        out.push_back({at, at + cell, most->first, inside});
      }
      filled.clear();
      inside = 0;
    };
    for (const Bar& bar : bars) {
      if (bar.end - bar.begin >= cell) {
        flush();
        out.push_back(bar);
        continue;
      }
      if (const double place = cell * std::floor(bar.begin / cell); place != at || inside == 0) {
        flush();
        at = place;
      }
      filled[bar.colour] += bar.end - bar.begin;
      ++inside;
    }
    flush();
    return out;
  }

  void draw_row(Svg& svg, std::size_t row) {
    const trace::Track& track = trace_.tracks[row];
    std::vector<Bar> team, tasks, waits;
    for (const Record& record : track.records) {
      if (!window_.shows(record)) continue;
      const trace::KindInfo& info = trace_.info(record.kind());
      const Bar bar{x(static_cast<double>(record.begin)), x(record.end()),
                    info.blocked ? wait_colour : colours[static_cast<std::size_t>(info.phase)], 1};
      if (record.kind() == trace::kind_send) continue;
      (record.kind() == trace::kind_team ? team : info.blocked ? waits : tasks).push_back(bar);
    }
    svg.text(left - 8, y(row) + 0.5 * height_ + 4,
             trace_.ranks > 1 ? fmt::format("rank {} . {}", track.rank, track.thread)
                              : fmt::format("thread {}", track.thread),
             {.size = 11, .colour = style::soft_ink, .anchor = "end"});
    for (const auto* bars : {&team, &tasks, &waits})
      for (const Bar& bar : merge(*bars)) {
        if (bar.tasks > 1) merged_ += bar.tasks;
        const double thin = bars == &waits ? 0.35 : 0;
        svg.rectangle(bar.begin, y(row) + 1 + thin * height_, std::max(0.15, bar.end - bar.begin),
                      (1 - 2 * thin) * height_ - 4, bar.colour);
      }
  }

  /// From where a message was sent to where it was waited for; of a single step also to where it was found
  /// waiting.
  void draw_messages(Svg& svg) {
    struct End {
      std::size_t row;
      double time;
    };
    const auto each = [&](trace::Kind kind, auto&& use) {
      for (std::size_t k = 0; k < rows_; ++k)
        for (const Record& record : trace_.tracks[k].records)
          if (window_.shows(record) && record.kind() == kind) use(k, record);
    };
    std::unordered_map<const Record*, End> sent;
    each(trace::kind_send, [&](std::size_t k, const Record& record) { sent[&record] = {k, record.end()}; });
    const auto arrow = [&](const End& from, const End& to, std::string_view colour) {
      constexpr std::size_t most_arrows = 400;
      if (++arrows_ > most_arrows) {
        ++hidden_arrows_;
        return;
      }
      const double y2 = y(to.row) + 0.5 * height_;
      svg.line(x(from.time), y(from.row) + 0.5 * height_, x(to.time), y2, {.colour = colour, .width = 0.6});
      svg.circle(x(to.time), y2, 1.6, colour);
    };
    const auto sends = trace::sends_of(trace_);
    each(trace::kind_receive, [&](std::size_t k, const Record& record) {
      const auto send = sends.find(&record);
      const auto from = send == sends.end() ? sent.end() : sent.find(send->second);
      if (from == sent.end()) return;
      arrow(from->second, {k, record.end()}, style::ink);
      sent.erase(from);
    });
    if (!window_.step) return;
    const trace::StepIndex index = timeline_.index(*window_.step);
    const auto subdomain_colours = later_colours(index);
    const graph::Tree tree = trace::tree_of(index);
    each(trace::kind_send, [&](std::size_t, const Record& record) {
      const auto from = sent.find(&record);
      if (from == sent.end()) return;
      const trace::Place taken =
          taker(index, tree, subdomain_colours, static_cast<std::size_t>(record.epoch), record.node);
      if (!taken.exists() || taken.track >= rows_) return;
      const auto found = static_cast<double>(timeline_.record(taken).begin);
      if (found >= from->second.time) arrow(from->second, {taken.track, found}, style::soft_ink);
    });
  }

  /// Of the groups that have one other than the first.
  static std::map<std::uint32_t, std::uint32_t> later_colours(const trace::StepIndex& index) {
    std::map<std::uint32_t, std::uint32_t> subdomain_colours;
    for (const trace::StepIndex::Rank& rank : index.ranks)
      for (std::size_t n = 0; rank.plan && n < rank.nodes; ++n)
        if (rank.plan->role[n] == static_cast<std::uint8_t>(trace::Role::take))
          subdomain_colours[rank.plan->group[n]] = rank.plan->place[n];
    return subdomain_colours;
  }

  /// The glue, take or root that takes a message. What goes up the tree of ranks is taken by the first
  /// root node of the parent of who sends it, what goes down by the last of the rank it is named after.
  static trace::Place taker(const trace::StepIndex& index, const graph::Tree& tree,
                            const std::map<std::uint32_t, std::uint32_t>& subdomain_colours,
                            std::size_t epoch, std::uint32_t name) {
    const auto subdomain_colour_of = [&](std::uint32_t group) {
      const auto later = subdomain_colours.find(group);
      return later == subdomain_colours.end() ? 0 : later->second;
    };
    const std::uint32_t from = name >> 16, to = name & 0xffffU;
    const bool up = to == trace::root_group, by_root = up || from == trace::root_group;
    for (std::size_t r = 0; r < index.ranks.size(); ++r) {
      const trace::Plan* const plan = index.ranks[r].plan;
      if (!plan || std::ranges::find(plan->group, up ? from : to) == plan->group.end()) continue;
      if (up && tree.parent[r] < 0) continue;
      const trace::StepIndex::Rank& rank = index.ranks[up ? static_cast<std::size_t>(tree.parent[r]) : r];
      if (!rank.plan || epoch >= rank.epochs) continue;
      const trace::Role role = by_root                                               ? trace::Role::root
                               : subdomain_colour_of(from) < subdomain_colour_of(to) ? trace::Role::take
                                                                                     : trace::Role::glue;
      trace::Place place;
      for (std::size_t n = 0; n < rank.nodes && !(up && place.exists()); ++n)
        if (rank.plan->role[n] == static_cast<std::uint8_t>(role) && (by_root || rank.plan->group[n] == to))
          place = rank.at(epoch, n);
      return place;
    }
    return {};
  }

  void draw_path(Svg& svg) const {
    const trace::StepIndex index = timeline_.index(*window_.step);
    std::vector<std::array<double, 2>> points;
    for (const trace::PathHop& hop : trace::critical_path(timeline_, index)) {
      if (hop.place.track >= rows_ || !window_.shows(timeline_.record(hop.place))) continue;
      const double under = y(hop.place.track) + height_ - 1.5;
      // Steps too small to see would only make the line thick.
      for (const double at : {x(hop.until), x(hop.from)})
        if (points.empty() || points.back()[0] - at > 0.5) points.push_back({at, under});
    }
    if (!points.empty()) svg.polyline(points, {.colour = style::blue, .width = 1.8});
  }

  void draw_axis(Svg& svg) const {
    const double span = 1e-9 * (end_ - begin_), under = y(rows_) + 2;
    for (double tick : detail::nice_ticks(0, span, 8)) {
      if (tick > span) continue;
      const double at = left + tick / span * (right - left);
      svg.line(at, top - 4, at, under, {.colour = style::grid, .width = 0.7});
      svg.text(at, under + 14, detail::with_unit(tick, "s"),
               {.size = 11, .colour = style::soft_ink, .anchor = "middle"});
    }
  }

  void draw_head(Svg& svg) const {
    std::string title = trace_.predicted ? "predicted" : "recorded";
    title += fmt::format(", {} ranks x {} threads", trace_.ranks, trace_.threads);
    if (window_.step) title += fmt::format(", step {}", *window_.step);
    if (window_.epoch) title += fmt::format(", iteration {}", *window_.epoch);
    svg.text(left, 22, title, {.size = 15, .bold = true});
    double at = left;
    for (std::size_t p = 0; p < trace::phase_count; ++p) {
      svg.rectangle(at, 34, 11, 11, colours[p]);
      svg.text(at + 15, 44, trace::name_of(static_cast<trace::Phase>(p)), {.size = 11});
      at += 165;
    }
    svg.rectangle(at, 34, 11, 11, wait_colour);
    svg.text(at + 15, 44, "messages", {.size = 11});
    std::string note = "blue line: critical path";
    if (merged_ > 0)
      note += fmt::format("; {} tasks too narrow to see are drawn merged with their neighbours", merged_);
    if (rows_ < trace_.tracks.size())
      note += fmt::format("; {} of {} threads are shown", rows_, trace_.tracks.size());
    if (hidden_arrows_ > 0) note += fmt::format("; {} arrows of messages are left out", hidden_arrows_);
    svg.text(left, 62, note, {.size = 11, .colour = style::soft_ink});
  }

  const trace::Timeline& timeline_;
  const trace::Trace& trace_;
  const TraceWindow& window_;
  double begin_, end_, height_;  ///< [ns], [ns], [px]
  std::size_t rows_, merged_ = 0, arrows_ = 0, hidden_arrows_ = 0;
};

}  // namespace

std::string draw_gantt(const trace::Timeline& timeline, const TraceWindow& window) {
  return Gantt(timeline, window).draw();
}

}  // namespace talus::io
