#include "io/vtk.hpp"

#include <fmt/format.h>

#include <bit>
#include <cstring>
#include <iterator>
#include <span>
#include <stdexcept>
#include <string_view>

#include "io/detail/body_index.hpp"

namespace talus::io {
namespace {

static_assert(std::endian::native == std::endian::little, "the files say that they are little endian");

void append_base64(std::string& text, std::string_view bytes) {
  static constexpr char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  text.reserve(text.size() + (bytes.size() + 2) / 3 * 4);
  for (std::size_t k = 0; k < bytes.size(); k += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - k);
    std::uint32_t group = 0;
    for (std::size_t j = 0; j < 3; ++j) {
      group = group << 8 | (j < count ? static_cast<unsigned char>(bytes[k + j]) : 0u);
    }
    for (std::size_t j = 0; j < 4; ++j) {
      text += j <= count ? digits[group >> (18 - 6 * j) & 63] : '=';
    }
  }
}

/// An array inline, in base64: its length in bytes as a 64-bit integer, then its numbers.
template <class T>
void append_array(std::string& text, std::string_view type, std::string_view name, int components,
                  std::span<const T> values) {
  const std::uint64_t length = values.size_bytes();
  std::string bytes(sizeof(length) + length, '\0');
  std::memcpy(bytes.data(), &length, sizeof(length));
  if (length > 0) std::memcpy(bytes.data() + sizeof(length), values.data(), length);
  fmt::format_to(std::back_inserter(text),
                 R"(<DataArray type="{}" Name="{}" NumberOfComponents="{}" format="binary">)", type, name,
                 components);
  append_base64(text, bytes);
  text += "</DataArray>\n";
}

void append_floats(std::string& text, std::string_view name, int components, std::span<const float> values) {
  append_array<float>(text, "Float32", name, components, values);
}

void append_integers(std::string& text, std::string_view name, std::span<const std::int64_t> values) {
  append_array<std::int64_t>(text, "Int64", name, 1, values);
}

std::vector<float> floats(const std::vector<Vec3>& values) {
  std::vector<float> result;
  result.reserve(3 * values.size());
  for (const Vec3& v : values) {
    for (int k = 0; k < 3; ++k) result.push_back(static_cast<float>(v[k]));
  }
  return result;
}

std::vector<float> floats(const std::vector<double>& values) {
  std::vector<float> result;
  result.reserve(values.size());
  for (const double v : values) result.push_back(static_cast<float>(v));
  return result;
}

std::vector<float> floats(const std::vector<std::array<double, 4>>& values) {
  std::vector<float> result;
  result.reserve(4 * values.size());
  for (const auto& v : values) {
    for (const double x : v) result.push_back(static_cast<float>(x));
  }
  return result;
}

std::string begin_vtp(const Frame& frame, std::size_t points, std::size_t vertices, std::size_t lines) {
  return fmt::format(
      R"(<?xml version="1.0"?>
<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian" header_type="UInt64">
<PolyData>
<FieldData><DataArray type="Float64" Name="TimeValue" NumberOfTuples="1" format="ascii">{}</DataArray></FieldData>
<Piece NumberOfPoints="{}" NumberOfVerts="{}" NumberOfLines="{}" NumberOfStrips="0" NumberOfPolys="0">
)",
      frame.time, points, vertices, lines);
}

constexpr std::string_view end_vtp = "</Piece>\n</PolyData>\n</VTKFile>\n";

/// Cells of `corners` points each, which use points 0, 1, 2, ... in turn.
void append_cells(std::string& text, std::string_view kind, std::size_t cells, std::size_t corners) {
  std::vector<std::int64_t> connectivity(cells * corners), offsets(cells);
  for (std::size_t k = 0; k < connectivity.size(); ++k) connectivity[k] = static_cast<std::int64_t>(k);
  for (std::size_t k = 0; k < cells; ++k) offsets[k] = static_cast<std::int64_t>((k + 1) * corners);
  fmt::format_to(std::back_inserter(text), "<{}>\n", kind);
  append_integers(text, "connectivity", connectivity);
  append_integers(text, "offsets", offsets);
  fmt::format_to(std::back_inserter(text), "</{}>\n", kind);
}

void append_points(std::string& text, std::span<const float> points) {
  text += "<Points>\n";
  append_floats(text, "Points", 3, points);
  text += "</Points>\n";
}

}  // namespace

std::string grains_vtp(const Frame& frame, std::span<const GrainField> fields) {
  for (const GrainField& field : fields) {
    if (field.values.size() != frame.id.size()) {
      throw std::invalid_argument(fmt::format("frame: field '{}' has {} values for {} bodies", field.name,
                                              field.values.size(), frame.id.size()));
    }
  }
  std::string text = begin_vtp(frame, frame.id.size(), frame.id.size(), 0);
  text += "<PointData Scalars=\"radius\" Vectors=\"velocity\">\n";
  append_integers(text, "id", frame.id);
  append_floats(text, "radius", 1, floats(frame.radius));
  append_floats(text, "velocity", 3, floats(frame.u));
  if (!frame.omega.empty()) append_floats(text, "omega", 3, floats(frame.omega));
  if (!frame.orientation.empty()) append_floats(text, "orientation", 4, floats(frame.orientation));
  for (const GrainField& field : fields) append_array(text, "Int32", field.name, 1, field.values);
  text += "</PointData>\n";
  append_points(text, floats(frame.x));
  append_cells(text, "Verts", frame.id.size(), 1);
  text += end_vtp;
  return text;
}

std::string forces_vtp(const Frame& frame) {
  const std::size_t contacts = frame.contact_bodies.size();
  const detail::BodyIndex index(frame.id);
  std::vector<Vec3> ends;
  std::vector<double> normal_force;
  std::vector<std::int64_t> wall;
  ends.reserve(2 * contacts);
  normal_force.reserve(2 * contacts);
  wall.reserve(contacts);
  for (std::size_t k = 0; k < contacts; ++k) {
    const auto [first, second] = frame.contact_bodies[k];
    ends.push_back(frame.x[index.at(first)]);
    ends.push_back(second < 0 ? frame.contact_point[k] : frame.x[index.at(second)]);
    normal_force.insert(normal_force.end(), 2, frame.contact_force[k].dot(frame.contact_normal[k]));
    wall.push_back(second < 0 ? static_cast<std::int64_t>(detail::wall_index(second)) : -1);
  }
  std::string text = begin_vtp(frame, ends.size(), 0, contacts);
  text += "<PointData Scalars=\"normal_force\">\n";
  append_floats(text, "normal_force", 1, floats(normal_force));
  text += "</PointData>\n<CellData>\n";
  append_floats(text, "force", 3, floats(frame.contact_force));
  append_floats(text, "gap", 1, floats(frame.contact_gap));
  append_integers(text, "wall", wall);
  text += "</CellData>\n";
  append_points(text, floats(ends));
  append_cells(text, "Lines", contacts, 2);
  text += end_vtp;
  return text;
}

std::string collection_pvd(const std::vector<FieldFile>& files) {
  std::string text =
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\" "
      "byte_order=\"LittleEndian\">\n<Collection>\n";
  for (const FieldFile& file : files) {
    fmt::format_to(std::back_inserter(text), "<DataSet timestep=\"{}\" part=\"{}\" file=\"{}\"/>\n",
                   file.time, file.part, file.path);
  }
  return text + "</Collection>\n</VTKFile>\n";
}

}  // namespace talus::io
