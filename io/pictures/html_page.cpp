#include "io/pictures/html_page.hpp"

#include <fmt/format.h>

#include <string_view>

#include "io/pictures/detail/chart_style.hpp"
#include "io/pictures/detail/svg.hpp"

namespace talus::io {
namespace {

using detail::escaped;
namespace style = detail::style;

constexpr const char* head = R"(<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<link rel="icon" href="data:,">
<style>
:root { color-scheme: light dark; --paper: #ffffff; --ink: #1f2933; --soft: #5b6673; --grid: #e4e8ec; --card: #f4f6f8;
        --link: #1d5fa8; --good: #1d6b3f; --warning: #8a5300; --bad: #a32020; }
body { font: 16px/1.55 Helvetica, Arial, "Liberation Sans", sans-serif; color: var(--ink); background: var(--paper);
       max-width: 1000px; margin: 0 auto; padding: 1.5em 1em 4em; }
h1 { font-size: 1.7em; line-height: 1.2; margin: 0.6em 0 0.3em; overflow-wrap: anywhere; }
h2 { font-size: 1.2em; margin: 2.2em 0 0.4em; padding-top: 0.8em; border-top: 1px solid var(--grid); }
p { max-width: 44em; margin: 0.5em 0; }
svg { max-width: 100%; height: auto; display: block; }
figure { margin: 0; break-inside: avoid; }
figcaption { font-size: 14px; color: var(--soft); margin: 0.3em 0 0; max-width: 44em; }
.figures { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 26em), 1fr)); gap: 1.6em 1.2em;
           margin: 1em 0; align-items: start; }
.figures svg { width: 100%; }
.picture { max-width: 42em; } .figures .chart { max-width: 33em; }
.kept { background: #ffffff; border-radius: 6px; }
.live canvas { width: 100%; display: block; touch-action: pan-y; cursor: grab; }
.live p { color: #1f2933; font-size: 14px; margin: 0; padding: 0.3em 0.8em 0.6em; } .live select { font: inherit; }
.live .bar { display: inline-block; width: 9em; height: 0.8em; margin: 0 0.6em; vertical-align: middle; }
.table { overflow-x: auto; }
table { border-collapse: collapse; font-size: 14px; margin: 1em 0; font-variant-numeric: tabular-nums; }
th, td { padding: 3px 14px 3px 0; border-bottom: 1px solid var(--grid); text-align: right; vertical-align: top; }
th:first-child, td:first-child, .named td { text-align: left; }
.named td:first-child { color: var(--soft); white-space: nowrap; }
.named td { overflow-wrap: anywhere; }
pre { font: 13px/1.45 "DejaVu Sans Mono", Menlo, Consolas, monospace; background: var(--card); padding: 0.8em 1em;
      border-radius: 6px; overflow-x: auto; }
summary { cursor: pointer; color: var(--link); }
.notice { padding: 0.7em 1em; border-left: 5px solid; background: var(--card); border-radius: 4px; max-width: none; }
.good { border-color: var(--good); } .warning { border-color: var(--warning); } .bad { border-color: var(--bad); }
@media print { body { max-width: none; padding: 0; font-size: 11pt; } pre { white-space: pre-wrap; }
               h2, h2 + p { break-after: avoid; } tr { break-inside: avoid; } h2 { margin-top: 1.2em; }
               .figures { grid-template-columns: 1fr 1fr; } .picture { max-width: 11cm; grid-column: 1 / -1; }
               .live select { border: 0; appearance: none; background: none; } .table { overflow: visible; } }
)";

/// Colours of the page in dark; those of charts follow, which name them as attributes.
constexpr const char* dark_page = R"(@media screen and (prefers-color-scheme: dark) {
:root { --paper: #14181d; --ink: #e6eaee; --soft: #a3adb8; --grid: #313943; --card: #1e242b; --link: #7fb2ea;
        --good: #58c088; --warning: #e0a84a; --bad: #f08080; }
)";

struct Recoloured {
  std::string_view light, dark;
};
constexpr Recoloured recoloured[] = {
    {"#ffffff", "var(--paper)"},  {style::ink, "var(--ink)"},   {style::soft_ink, "var(--soft)"},
    {style::grid, "var(--grid)"}, {detail::hues[0], "#6ea8e6"}, {detail::hues[1], "#f08a5a"},
    {detail::hues[2], "#5cc08a"}, {detail::hues[3], "#b78fd8"}, {detail::hues[4], "#d9b13b"},
    {detail::hues[5], "#5cc3d6"}, {detail::hues[6], "#e77fae"}, {detail::hues[7], "#a9b4bf"},
};

std::string dark_style() {
  std::string text = dark_page;
  for (const auto& [light, dark] : recoloured)
    for (const char* what : {"fill", "stroke"})
      text += fmt::format(".chart [{0}=\"{1}\"] {{ {0}: {2}; }}\n", what, light, dark);
  return text + "}\n</style>\n";
}

/// A picture inside a page has no XML declaration; its name is for those who do not see it.
std::string inline_picture(const std::string& svg, const std::string& name) {
  const std::size_t begin = svg.find("<svg");
  if (begin == std::string::npos) return {};
  return fmt::format("<svg role=\"img\" aria-label=\"{}\"{}", escaped(name), svg.substr(begin + 4));
}

std::string table_text(const HtmlTable& table) {
  std::string out = table.columns.empty() ? "<div class=\"table\"><table class=\"named\">\n"
                                          : "<div class=\"table\"><table>\n<tr>";
  for (const std::string& column : table.columns) out += "<th>" + escaped(column) + "</th>";
  if (!table.columns.empty()) out += "</tr>\n";
  for (const auto& row : table.rows) {
    out += "<tr>";
    for (const std::string& cell : row) out += "<td>" + escaped(cell) + "</td>";
    out += "</tr>\n";
  }
  return out + "</table></div>\n";
}

std::string figures_text(const std::vector<HtmlFigure>& figures, const std::string& title) {
  if (figures.empty()) return {};
  std::string out = "<div class=\"figures\">\n";
  for (const HtmlFigure& figure : figures) {
    out += fmt::format("<figure class=\"{}\">\n", figure.keeps_colours ? "picture" : "chart");
    if (figure.keeps_colours) out += "<div class=\"kept\">";
    out += inline_picture(figure.svg, figure.caption.empty() ? title : figure.caption);
    out += figure.live;
    if (figure.keeps_colours) out += "</div>";
    if (!figure.caption.empty()) out += "<figcaption>" + escaped(figure.caption) + "</figcaption>\n";
    out += "</figure>\n";
  }
  return out + "</div>\n";
}

std::string section_text(const HtmlSection& section) {
  std::string out = "<h2>" + escaped(section.title) + "</h2>\n";
  if (!section.text.empty()) out += "<p>" + escaped(section.text) + "</p>\n";
  if (!section.svg.empty())
    out += "<div class=\"chart\">" + inline_picture(section.svg, section.title) + "</div>\n";
  out += figures_text(section.figures, section.title);
  if (!section.table.rows.empty() || !section.table.columns.empty()) out += table_text(section.table);
  // Wide lines are reached with the keyboard, too.
  if (!section.code.empty()) out += "<pre tabindex=\"0\">" + escaped(section.code) + "</pre>\n";
  if (!section.folded.empty())
    out += "<details><summary>" + escaped(section.fold) + "</summary><pre tabindex=\"0\">" +
           escaped(section.folded) + "</pre></details>\n";
  return out;
}

}  // namespace

std::string html_page(const std::string& title, const std::string& introduction,
                      const std::vector<HtmlSection>& sections, const HtmlNotice& notice) {
  static constexpr const char* kinds[] = {"good", "warning", "bad"};
  std::string out = head + dark_style();
  out += "<title>" + escaped(title) + "</title>\n</head>\n<body>\n<main>\n<h1>" + escaped(title) +
         "</h1>\n<p>" + escaped(introduction) + "</p>\n";
  if (!notice.text.empty())
    out += fmt::format("<p class=\"notice {}\">{}</p>\n", kinds[static_cast<std::size_t>(notice.kind)],
                       escaped(notice.text));
  for (const HtmlSection& section : sections) out += section_text(section);
  return out + "</main>\n</body>\n</html>\n";
}

}  // namespace talus::io
