#include "io/results/vtk.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <limits>
#include <numeric>
#include <optional>
#include <span>
#include <stdexcept>
#include <string_view>

#include "io/results/cell_outline.hpp"
#include "io/results/detail/base64.hpp"
#include "io/results/detail/body_index.hpp"
#include "runtime/graph/one_rank.hpp"

namespace talus::io {
namespace {

using detail::Base64;

/// A .vtp file of which each rank has a part of every array; its text comes out on rank 0.
class VtpText {
 public:
  VtpText(const graph::Communicator& ranks, const WriteText& out) : ranks_(ranks), out_(out) {}

  void text(std::string_view text) const {
    if (ranks_.rank() == 0) out_(text);
  }

  /// An array inline, in base64: its length in bytes as a 64-bit integer, then its numbers.
  template <class T>
  void array(std::string_view type, std::string_view name, int components, const std::vector<T>& part) const {
    std::int64_t length[1] = {static_cast<std::int64_t>(part.size() * sizeof(T))};
    ranks_.sum(length);
    text(fmt::format(fmt::runtime(array_begin), type, name, components));
    Base64 base64(out_);
    if (ranks_.rank() == 0) base64.add(std::as_bytes(std::span(length)));
    ranks_.records_to_first(std::span<const T>(part),
                            [&](std::span<const T> numbers) { base64.add(std::as_bytes(numbers)); });
    if (ranks_.rank() == 0) base64.finish();
    text(array_end);
  }
  /// Numbers that append(k, numbers) makes, `each` of entry k. One rank makes some and writes them before it
  /// makes more: of contacts an array takes up to 70 bytes a grain.
  template <class Append>
  void made(std::string_view name, int components, std::size_t entries, std::size_t each,
            const Append& append) const {
    constexpr std::size_t piece = std::size_t{1} << 16;
    std::vector<float> numbers;
    if (ranks_.ranks() > 1) {
      numbers.reserve(entries * each);
      for (std::size_t k = 0; k < entries; ++k) append(k, numbers);
      return floats(name, components, numbers);
    }
    const std::uint64_t length[1] = {entries * each * sizeof(float)};
    text(fmt::format(fmt::runtime(array_begin), "Float32", name, components));
    Base64 base64(out_);
    base64.add(std::as_bytes(std::span(length)));
    for (std::size_t k = 0; k < entries; ++k) {
      append(k, numbers);
      if (numbers.size() < piece && k + 1 < entries) continue;
      base64.add(std::as_bytes(std::span(numbers)));
      numbers.clear();
    }
    base64.finish();
    text(array_end);
  }
  void floats(std::string_view name, int components, const std::vector<float>& part) const {
    array("Float32", name, components, part);
  }
  void integers(std::string_view name, const std::vector<std::int64_t>& part) const {
    array("Int64", name, 1, part);
  }

  /// Entries before those of this rank, and of all ranks.
  struct Share {
    std::size_t begin, all;
  };
  Share share(std::size_t part) const {
    const std::uint64_t own[1] = {part};
    const std::vector<std::uint64_t> parts = ranks_.gather_records(std::span<const std::uint64_t>(own));
    Share share{0, 0};
    for (std::size_t r = 0; r < parts.size(); ++r) {
      if (r == static_cast<std::size_t>(ranks_.rank())) share.begin = share.all;
      share.all += parts[r];
    }
    return share;
  }
  bool any(bool here) const {
    double flag[1] = {here ? 1.0 : 0.0};
    ranks_.max(flag);
    return flag[0] > 0;
  }

  void begin(double time, std::size_t points, std::size_t vertices, std::size_t lines,
             std::size_t polygons = 0) const {
    text(fmt::format(
        R"(<?xml version="1.0"?>
<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian" header_type="UInt64">
<PolyData>
<FieldData><DataArray type="Float64" Name="TimeValue" NumberOfTuples="1" format="ascii">{}</DataArray></FieldData>
<Piece NumberOfPoints="{}" NumberOfVerts="{}" NumberOfLines="{}" NumberOfStrips="0" NumberOfPolys="{}">
)",
        time, points, vertices, lines, polygons));
  }
  void end() const { text("</Piece>\n</PolyData>\n</VTKFile>\n"); }

  /// Cells of `corners` points each, which use points 0, 1, 2, ... in turn.
  void cells(std::string_view kind, std::size_t part, Share share, std::size_t corners) const {
    std::vector<std::int64_t> numbers(part * corners);
    std::iota(numbers.begin(), numbers.end(), static_cast<std::int64_t>(share.begin * corners));
    text(fmt::format("<{}>\n", kind));
    integers("connectivity", numbers);
    numbers.resize(part);
    for (std::size_t k = 0; k < part; ++k)
      numbers[k] = static_cast<std::int64_t>((share.begin + k + 1) * corners);
    integers("offsets", numbers);
    text(fmt::format("</{}>\n", kind));
  }
  void points(const std::vector<float>& part) const {
    text("<Points>\n");
    floats("Points", 3, part);
    text("</Points>\n");
  }

 private:
  static constexpr fmt::string_view array_begin =
      R"(<DataArray type="{}" Name="{}" NumberOfComponents="{}" format="binary">)";
  static constexpr std::string_view array_end = "</DataArray>\n";

  const graph::Communicator& ranks_;
  const WriteText& out_;
};

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

/// Centres of bodies by id: those of this rank's part of the frame, and those that its contacts name beside
/// them, asked of the ranks that have them.
class Centres {
 public:
  Centres(const Frame& part, const graph::Communicator& ranks) : index_(part.id), x_(part.x) {
    if (ranks.ranks() == 1) return;
    std::vector<std::int64_t> wanted;
    for (const auto& [first, second] : part.contact_bodies)
      if (second >= 0 && !std::binary_search(part.id.begin(), part.id.end(), second))
        wanted.push_back(second);
    std::sort(wanted.begin(), wanted.end());
    wanted.erase(std::unique(wanted.begin(), wanted.end()), wanted.end());
    // The parts follow one another: an id belongs to the last part that does not begin behind it.
    constexpr std::int64_t none = std::numeric_limits<std::int64_t>::max();
    const std::int64_t own[1] = {part.id.empty() ? none : part.id.front()};
    const std::vector<std::int64_t> first = ranks.gather_records(std::span<const std::int64_t>(own));
    std::vector<std::vector<std::int64_t>> ask(first.size());
    for (const std::int64_t id : wanted) {
      std::size_t rank = 0;
      for (std::size_t r = 0; r < first.size(); ++r)
        if (first[r] <= id) rank = r;
      ask[rank].push_back(id);
    }
    std::vector<std::vector<Found>> answer(first.size());
    const auto asked = ranks.exchange_records(std::move(ask));
    for (std::size_t r = 0; r < asked.size(); ++r)
      for (const std::int64_t id : asked[r]) {
        const Vec3& x = x_[index_.at(id)];
        answer[r].push_back({id, {x[0], x[1], x[2]}});
      }
    for (const auto& rows : ranks.exchange_records(std::move(answer)))
      others_.insert(others_.end(), rows.begin(), rows.end());
    std::sort(others_.begin(), others_.end(), [](const Found& a, const Found& b) { return a.id < b.id; });
  }

  Vec3 of(std::int64_t id) const {
    const auto found = std::lower_bound(others_.begin(), others_.end(), id,
                                        [](const Found& a, std::int64_t wanted) { return a.id < wanted; });
    if (found != others_.end() && found->id == id) return {found->x[0], found->x[1], found->x[2]};
    return x_[index_.at(id)];
  }

 private:
  struct Found {
    std::int64_t id;
    double x[3];
  };
  detail::BodyIndex index_;
  const std::vector<Vec3>& x_;
  std::vector<Found> others_;
};

}  // namespace

void write_grains_vtp(const Frame& part, const graph::Communicator& ranks, const WriteText& out,
                      std::span<const GrainField> fields) {
  for (const GrainField& field : fields) {
    if (field.values.size() != part.id.size()) {
      throw std::invalid_argument(fmt::format("frame: field '{}' has {} values for {} bodies", field.name,
                                              field.values.size(), part.id.size()));
    }
  }
  const VtpText file(ranks, out);
  const VtpText::Share share = file.share(part.id.size());
  file.begin(part.time, share.all, share.all, 0);
  file.text("<PointData Scalars=\"radius\" Vectors=\"velocity\">\n");
  file.integers("id", part.id);
  file.floats("radius", 1, floats(part.radius));
  file.floats("velocity", 3, floats(part.u));
  if (file.any(!part.omega.empty())) file.floats("omega", 3, floats(part.omega));
  if (file.any(!part.orientation.empty())) file.floats("orientation", 4, floats(part.orientation));
  if (file.any(!part.material.empty())) file.integers("material", part.material);
  for (const GrainField& field : fields)
    file.array("Int32", field.name, 1, std::vector<std::int32_t>(field.values.begin(), field.values.end()));
  file.text("</PointData>\n");
  file.points(floats(part.x));
  file.cells("Verts", part.id.size(), share, 1);
  file.end();
}

void write_forces_vtp(const Frame& part, const graph::Communicator& ranks, const WriteText& out) {
  const std::size_t contacts = part.contact_bodies.size();
  const Centres centres(part, ranks);
  const VtpText file(ranks, out);
  const VtpText::Share share = file.share(contacts);
  file.begin(part.time, 2 * share.all, 0, share.all);
  file.text("<PointData Scalars=\"normal_force\">\n");
  file.made("normal_force", 1, contacts, 2, [&](std::size_t k, std::vector<float>& to) {
    to.insert(to.end(), 2, static_cast<float>(part.contact_force[k].dot(part.contact_normal[k])));
  });
  file.text("</PointData>\n<CellData>\n");
  file.made("force", 3, contacts, 3, [&](std::size_t k, std::vector<float>& to) {
    for (const double x : part.contact_force[k]) to.push_back(static_cast<float>(x));
  });
  file.floats("gap", 1, floats(part.contact_gap));
  {
    std::vector<std::int64_t> wall;
    wall.reserve(contacts);
    for (const auto& [first, second] : part.contact_bodies)
      wall.push_back(second < 0 ? static_cast<std::int64_t>(detail::wall_index(second)) : -1);
    file.integers("wall", wall);
  }
  file.text("</CellData>\n");
  file.text("<Points>\n");
  file.made("Points", 3, contacts, 6, [&](std::size_t k, std::vector<float>& to) {
    const auto [first, second] = part.contact_bodies[k];
    const Vec3 begin = centres.of(first);
    // Across a face of a periodic cell the line goes on outside.
    for (const Vec3& end :
         {begin, part.domain.image_near(begin, second < 0 ? part.contact_point[k] : centres.of(second))})
      for (int axis = 0; axis < 3; ++axis) to.push_back(static_cast<float>(end[axis]));
  });
  file.text("</Points>\n");
  file.cells("Lines", contacts, share, 2);
  file.end();
}

std::string grains_vtp(const Frame& frame, std::span<const GrainField> fields) {
  std::string text;
  write_grains_vtp(
      frame, graph::one_rank(), [&](std::string_view more) { text += more; }, fields);
  return text;
}

std::string forces_vtp(const Frame& frame) {
  std::string text;
  write_forces_vtp(frame, graph::one_rank(), [&](std::string_view more) { text += more; });
  return text;
}

std::string walls_vtp(const Frame& frame, std::span<const std::vector<Triangle>> triangles,
                      std::span<const std::int64_t> materials) {
  std::vector<std::int64_t> wall, material;
  std::vector<Vec3> corners, force;
  std::vector<double> velocity;
  for (std::size_t w = 0; w < triangles.size(); ++w)
    for (const Triangle& triangle : triangles[w]) {
      wall.push_back(static_cast<std::int64_t>(w));
      material.push_back(w < materials.size() ? materials[w] : 0);
      velocity.push_back(frame.walls[w].velocity);
      force.push_back(frame.walls[w].force);
      corners.insert(corners.end(), triangle.begin(), triangle.end());
    }
  std::string text;
  const WriteText out = [&](std::string_view more) { text += more; };
  const VtpText file(graph::one_rank(), out);
  file.begin(frame.time, corners.size(), 0, 0, wall.size());
  file.text("<CellData Scalars=\"wall\">\n");
  file.integers("wall", wall);
  file.integers("material", material);
  file.floats("velocity", 1, floats(velocity));
  file.floats("force", 3, floats(force));
  file.text("</CellData>\n");
  file.points(floats(corners));
  file.cells("Polys", wall.size(), {0, wall.size()}, 3);
  file.end();
  return text;
}

std::string cell_vtp(const Frame& frame, const Bounds& grains) {
  std::vector<CellLine> lines;
  if (const std::optional<CellBox> cell = cell_box(frame.domain, grains)) lines = cell_lines(*cell);
  std::vector<std::int64_t> edge;
  std::vector<Vec3> ends;
  for (const CellLine& line : lines) {
    edge.push_back(line.edge);
    ends.insert(ends.end(), line.ends.begin(), line.ends.end());
  }
  std::string text;
  const WriteText out = [&](std::string_view more) { text += more; };
  const VtpText file(graph::one_rank(), out);
  file.begin(frame.time, ends.size(), 0, lines.size());
  file.text("<CellData Scalars=\"edge\">\n");
  file.integers("edge", edge);
  file.text("</CellData>\n");
  file.points(floats(ends));
  file.cells("Lines", lines.size(), {0, lines.size()}, 2);
  file.end();
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
