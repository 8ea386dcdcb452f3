#include "io/scene/bodies_file.hpp"

#include <algorithm>
#include <array>
#include <fstream>
#include <string_view>
#include <unordered_map>

#include "io/files/detail/csv_cell.hpp"
#include "io/files/detail/utf8_mark.hpp"
#include "io/files/output_directory.hpp"
#include "io/scene/detail/csv_fields.hpp"

namespace talus::io {

namespace {

using detail::CsvPlace, detail::number_in, detail::split, detail::trimmed;

constexpr std::array<std::string_view, 11> columns = {"id", "x",  "y",  "z",  "radius", "vx",
                                                      "vy", "vz", "wx", "wy", "wz"};

/// Ids of grains that come later, and of the balls of clumps in other formats, are larger.
constexpr std::int64_t largest_id = 1'000'000'000'000'000;

/// Fields of a line, at most one more than there can be: enough to see that there are too many.
using Fields = std::array<std::string_view, columns.size() + 2>;

/// Columns that the header announces.
struct Header {
  std::size_t numbers = 0;
  bool material = false;  ///< as the last one
  std::size_t count() const { return numbers + (material ? 1 : 0); }
};

Header read_header(std::string_view line, const CsvPlace& place) {
  Fields fields;
  std::size_t count = split(line, fields);
  const bool material = count > 0 && count <= columns.size() + 1 && fields[count - 1] == "material";
  if (material) --count;
  bool known = count == 5 || count == 8 || count == 11;
  for (std::size_t k = 0; known && k < count; ++k) known = fields[k] == columns[k];
  if (!known)
    place.fail(
        "", fmt::format("the first line must be id,x,y,z,radius[,vx,vy,vz[,wx,wy,wz]][,material], got '{}'",
                        line));
  return {count, material};
}

Material material_named(std::string_view name, std::span<const MaterialSpec> materials,
                        const CsvPlace& place) {
  const auto found = std::ranges::find(materials, name, &MaterialSpec::name);
  if (found == materials.end())
    place.fail("material", fmt::format("no [[material]] of the scene is named '{}'", name));
  return static_cast<Material>(found - materials.begin());
}

}  // namespace

Sample read_bodies(const std::string& path, double density, bool rotates,
                   std::span<const MaterialSpec> materials) {
  std::ifstream in(path);
  if (!in) throw SceneError(path, 0, "", "cannot open the file of bodies");
  Sample sample;
  sample.density = density;
  sample.rotates = rotates;
  std::unordered_map<std::int64_t, int> line_of_id;
  Fields fields;
  Header header;
  CsvPlace place{path, 0};
  for (std::string text; std::getline(in, text);) {
    ++place.line;
    if (place.line == 1) text.erase(0, detail::utf8_mark_of(text));
    const std::string_view line = trimmed(text);
    if (line.empty() || line.front() == '#') continue;
    if (header.numbers == 0) {
      header = read_header(line, place);
      continue;
    }
    const std::size_t count = header.numbers;
    if (const std::size_t found = split(line, fields); found != header.count())
      place.fail("",
                 fmt::format("{} fields expected as in the header, got {}{}", header.count(),
                             found > header.count() ? "more than " : "", std::min(found, header.count())));
    const auto id = number_in<std::int64_t>(fields[0], columns[0], place);
    if (id < 0 || id > largest_id) place.fail("id", fmt::format("must be 0 to {}, got {}", largest_id, id));
    if (const auto [first, inserted] = line_of_id.emplace(id, place.line); !inserted)
      place.fail("id", fmt::format("{} stands already on line {}", id, first->second));
    std::array<double, columns.size()> value{};
    for (std::size_t k = 1; k < count; ++k) value[k] = number_in<double>(fields[k], columns[k], place);
    const double radius = value[4];
    if (radius <= 0) place.fail("radius", fmt::format("must be > 0 m, got {}", radius));
    sample.id.push_back(BodyId{id});
    sample.x.emplace_back(value[1], value[2], value[3]);
    sample.radius.push_back(radius);
    if (header.material) sample.material.push_back(material_named(fields[count], materials, place));
    if (count > 5)  // columns that the header lacks are 0
      sample.velocity.push_back(
          {value[5], value[6], value[7], radius * value[8], radius * value[9], radius * value[10]});
  }
  if (sample.size() == 0)
    throw SceneError(path, place.line, "",
                     "no bodies in the file; below a header, id,x,y,z,radius, each has a line");
  return sample;
}

void write_bodies(const std::filesystem::path& path, const Sample& sample) {
  write_whole(path, [&](const WriteText& out) {
    const std::size_t count = sample.velocity.empty() ? 5 : columns.size();
    std::string text;
    for (std::size_t k = 0; k < count; ++k) text += fmt::format("{}{}", k > 0 ? "," : "", columns[k]);
    text += '\n';
    for (std::size_t k = 0; k < sample.size(); ++k) {
      detail::put(text, static_cast<std::int64_t>(sample.id_of(k)));
      const auto add = [&](double value) {
        text += ',';
        detail::put(text, value);
      };
      for (Eigen::Index axis = 0; axis < 3; ++axis) add(sample.x[k][axis]);
      add(sample.radius[k]);
      if (count > 5)
        for (std::size_t i = 0; i < 6; ++i)
          add(i < 3 ? sample.velocity[k][i] : sample.velocity[k][i] / sample.radius[k]);
      text += '\n';
      if (text.size() > (1U << 16)) {
        out(text);
        text.clear();
      }
    }
    out(text);
  });
}

}  // namespace talus::io
