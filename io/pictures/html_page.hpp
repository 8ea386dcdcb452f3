#pragma once

/// A page that needs nothing but itself: text, pictures inside, tables.

#include <string>
#include <vector>

namespace talus::io {

struct HtmlTable {
  std::vector<std::string> columns;
  std::vector<std::vector<std::string>> rows;  ///< a cell per column
};

struct HtmlSection {
  std::string title;
  std::string text;      ///< one paragraph
  std::string svg = {};  ///< a whole SVG document, "" for none
  HtmlTable table = {};
};

/// All texts are escaped but the pictures, which are put in as they are.
std::string html_page(const std::string& title, const std::string& introduction,
                      const std::vector<HtmlSection>& sections);

}  // namespace talus::io
