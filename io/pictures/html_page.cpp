#include "io/pictures/html_page.hpp"

#include "io/pictures/detail/svg.hpp"

namespace talus::io {
namespace {

using detail::escaped;

constexpr const char* head = R"(<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<style>
body { font: 16px/1.5 Helvetica, Arial, "Liberation Sans", sans-serif; color: #1f2933; max-width: 960px;
       margin: 2em auto; padding: 0 1em; }
svg { max-width: 100%; height: auto; }
table { border-collapse: collapse; font-size: 14px; margin: 1em 0; }
th, td { padding: 2px 10px; border-bottom: 1px solid #e4e8ec; text-align: right; }
th:first-child, td:first-child { text-align: left; }
</style>
)";

/// A picture inside a page has no XML declaration.
std::string inline_picture(const std::string& svg) {
  const std::size_t begin = svg.find("<svg");
  return begin == std::string::npos ? std::string() : svg.substr(begin);
}

std::string table_text(const HtmlTable& table) {
  std::string out = "<table>\n<tr>";
  for (const std::string& column : table.columns) out += "<th>" + escaped(column) + "</th>";
  out += "</tr>\n";
  for (const auto& row : table.rows) {
    out += "<tr>";
    for (const std::string& cell : row) out += "<td>" + escaped(cell) + "</td>";
    out += "</tr>\n";
  }
  return out + "</table>\n";
}

}  // namespace

std::string html_page(const std::string& title, const std::string& introduction,
                      const std::vector<HtmlSection>& sections) {
  std::string out = head;
  out += "<title>" + escaped(title) + "</title>\n</head>\n<body>\n<h1>" + escaped(title) + "</h1>\n<p>" +
         escaped(introduction) + "</p>\n";
  for (const HtmlSection& section : sections) {
    out += "<h2>" + escaped(section.title) + "</h2>\n<p>" + escaped(section.text) + "</p>\n";
    out += inline_picture(section.svg);
    if (!section.table.columns.empty()) out += table_text(section.table);
  }
  return out + "</body>\n</html>\n";
}

}  // namespace talus::io
