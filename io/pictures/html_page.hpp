#pragma once

/// A page that needs nothing but itself: text, pictures inside, tables. Readable on a phone, in print, and in
/// light and dark.

#include <string>
#include <vector>

namespace talus::io {

struct HtmlTable {
  std::vector<std::string> columns;            ///< empty: no header; the first cell of a row is its name
  std::vector<std::vector<std::string>> rows;  ///< a cell per column
};

/// A picture with a sentence below it. Two stand beside one another where there is room.
struct HtmlFigure {
  std::string svg;             ///< a whole SVG document
  std::string caption;         ///< "" for none
  bool keeps_colours = false;  ///< in dark, too, it stays on white: colours mean something
  std::string live = {};       ///< markup below the picture, put in as it is; "" for none
};

struct HtmlSection {
  std::string title;
  std::string text;      ///< one paragraph
  std::string svg = {};  ///< a whole SVG document, "" for none
  HtmlTable table = {};
  std::vector<HtmlFigure> figures = {};
  std::string code = {};    ///< lines to copy, "" for none
  std::string folded = {};  ///< long text, unfolded on demand under the title `fold`
  std::string fold = {};
};

/// A sentence that stands out at the top.
struct HtmlNotice {
  enum class Kind { good, warning, bad };
  Kind kind = Kind::good;
  std::string text;  ///< "" for none
};

/// All texts are escaped but the pictures, which are put in as they are.
std::string html_page(const std::string& title, const std::string& introduction,
                      const std::vector<HtmlSection>& sections, const HtmlNotice& notice = {});

}  // namespace talus::io
