#include "io/results/detail/frame_arrays.hpp"

#include <fcntl.h>
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <exception>
#include <map>
#include <optional>
#include <string>

#include "io/files/detail/all_or_none.hpp"
#include "io/files/detail/descriptor.hpp"
#include "runtime/step/cell_flow.hpp"

namespace talus::io::detail {

namespace {

static_assert(sizeof(Vec3) == 3 * sizeof(double), "a vector of Vec3 is written as an n x 3 array");
static_assert(std::endian::native == std::endian::little, "rows are written as they stand in memory");

/// Rows of a chunk: the largest, of 24 bytes a row, fit the cache of HDF5 (1 MB), so that none is compressed
/// twice.
constexpr std::size_t chunk_rows = 16384;

/// The rows of this rank among those of all.
struct Rows {
  std::size_t begin = 0, all = 0;
};

template <class T>
struct Columns {
  static constexpr std::size_t count = sizeof(T) / 8;
  static constexpr bool real = !std::is_same_v<T, std::int64_t>;
};
template <>
struct Columns<std::array<std::int64_t, 2>> {
  static constexpr std::size_t count = 2;
  static constexpr bool real = false;
};

/// Lists arrays of a group.
struct Lister {
  std::vector<FrameArray>& arrays;
  const char* group;
  bool single;
  Rows rows;

  template <class T>
  void operator()(const char* name, const char* units, const std::vector<T>& values) const {
    arrays.push_back({group, name, units, Columns<T>::real, single && Columns<T>::real, Columns<T>::count,
                      std::as_bytes(std::span(values)), rows.begin, rows.all});
  }
};

ElementTypes types_of(const FrameArray& array) {
  if (!array.real) return element_types(static_cast<const std::int64_t*>(nullptr));
  const ElementTypes wide = element_types(static_cast<const double*>(nullptr));
  return array.narrow ? ElementTypes{element_types(static_cast<const float*>(nullptr)).file, wide.memory}
                      : wide;
}

std::string action_of(const FrameArray& array) {
  return fmt::format("writing '{}'", array.name);
}

Hdf5Object create_array(Place place, const FrameArray& array, int compression) {
  const std::string action = action_of(array);
  const int dimensions = array.columns == 1 ? 1 : 2;
  const hsize_t extent[2] = {array.all, array.columns};
  const Hdf5Object space = hold(H5Screate_simple(dimensions, extent, nullptr), H5Sclose, place.file, action);
  const Hdf5Object creation = hold(H5Pcreate(H5P_DATASET_CREATE), H5Pclose, place.file, action);
  // Every number is written: no need to fill the file with zeros first.
  demand(H5Pset_fill_time(creation.id(), H5D_FILL_TIME_NEVER), place.file, action);
  if (compression > 0 && array.all > 0) {
    const hsize_t chunk[2] = {std::min(array.all, chunk_rows), array.columns};
    demand(H5Pset_chunk(creation.id(), dimensions, chunk), place.file, action);
    demand(H5Pset_shuffle(creation.id()), place.file, action);
    demand(H5Pset_deflate(creation.id(), static_cast<unsigned>(compression)), place.file, action);
  } else {
    demand(H5Pset_alloc_time(creation.id(), H5D_ALLOC_TIME_EARLY), place.file, action);
  }
  Hdf5Object dataset = hold(H5Dcreate2(place.group, array.name, types_of(array).file, space.id(), H5P_DEFAULT,
                                       creation.id(), H5P_DEFAULT),
                            H5Dclose, place.file, action);
  write_attribute({dataset.id(), place.file}, "units", std::string(array.units));
  return dataset;
}

/// Writes whole rows of a dataset from `begin` on.
void write_rows(hid_t dataset, const std::string& file, const FrameArray& array,
                std::span<const std::byte> values, std::size_t begin) {
  if (values.empty()) return;
  const std::string action = action_of(array);
  const hsize_t start[2] = {begin, 0}, count[2] = {values.size() / (8 * array.columns), array.columns};
  const Hdf5Object there = hold(H5Dget_space(dataset), H5Sclose, file, action);
  const Hdf5Object here =
      hold(H5Screate_simple(array.columns == 1 ? 1 : 2, count, nullptr), H5Sclose, file, action);
  demand(H5Sselect_hyperslab(there.id(), H5S_SELECT_SET, start, nullptr, count, nullptr), file, action);
  demand(H5Dwrite(dataset, types_of(array).memory, here.id(), there.id(), H5P_DEFAULT, values.data()), file,
         action);
}

/// Doubles as floats.
std::vector<float> narrowed(std::span<const std::byte> values) {
  std::vector<float> narrow(values.size() / sizeof(double));
  for (std::size_t k = 0; k < narrow.size(); ++k) {
    double wide = 0;
    std::memcpy(&wide, values.data() + k * sizeof(double), sizeof(double));
    narrow[k] = static_cast<float>(wide);
  }
  return narrow;
}

std::string_view text_of_bytes(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// One array: rank 0 writes what it has, then what the others send, whole rows at a time: a piece may end
/// within one. It takes all that is sent also when it cannot write.
void gather_array(std::optional<Hdf5Object>& dataset, const std::string& file, const FrameArray& array,
                  const graph::Communicator& ranks, std::exception_ptr& failure) {
  std::size_t begin = 0;
  std::vector<std::byte> rest;
  ranks.records_to_first(array.values, [&](std::span<const std::byte> piece) {
    if (failure) return;
    try {
      rest.insert(rest.end(), piece.begin(), piece.end());
      const std::size_t row = 8 * array.columns, whole = rest.size() / row;
      write_rows(dataset->id(), file, array, std::span<const std::byte>(rest).first(whole * row), begin);
      begin += whole;
      rest.erase(rest.begin(), rest.begin() + static_cast<std::ptrdiff_t>(whole * row));
    } catch (...) {
      failure = std::current_exception();
    }
  });
}

}  // namespace

WallColumns::WallColumns(const std::vector<WallReport>& walls) {
  for (const WallReport& wall : walls) {
    position.push_back(wall.position);
    velocity.push_back(wall.velocity);
    force.push_back(wall.force);
    normal.push_back(wall.normal);
    present.push_back(wall.absent ? 0 : 1);
  }
  if (std::ranges::none_of(walls, [](const WallReport& wall) { return wall.pose.moved; })) return;
  for (const WallReport& wall : walls) {
    const Mat3& turn = wall.pose.turn;
    rotation.push_back({turn(0, 0), turn(0, 1), turn(0, 2), turn(1, 0), turn(1, 1), turn(1, 2), turn(2, 0),
                        turn(2, 1), turn(2, 2)});
    translation.push_back(wall.pose.shift);
  }
}

CellColumns::CellColumns(const Domain& domain) {
  if (!domain.repeats) return;
  const Mat3 h = edges_of(domain), change = matrix_of(domain.rates);
  origin.assign(domain.low.begin(), domain.low.end());
  for (const Eigen::Index k : {0, 1, 2}) {
    edges.push_back(h.col(k));
    rates.push_back(change.col(k));
  }
}

std::vector<FrameArray> frame_arrays(const Frame& part, const WallColumns& walls, const CellColumns& cell,
                                     const FrameFormat& format, const graph::Communicator& ranks) {
  // Rows of each rank, and whether they have the optional arrays: a rank may have no body.
  constexpr std::size_t counts = 6;
  const std::int64_t own[counts] = {static_cast<std::int64_t>(part.id.size()),
                                    static_cast<std::int64_t>(part.contact_bodies.size()),
                                    !part.omega.empty(),
                                    !part.orientation.empty(),
                                    !part.material.empty(),
                                    !part.contact_moment.empty()};
  const std::vector<std::int64_t> rows = ranks.gather_records(std::span<const std::int64_t>(own));
  const auto rows_of = [&](std::size_t column) {
    Rows result;
    for (std::size_t r = 0; counts * r < rows.size(); ++r) {
      if (r == static_cast<std::size_t>(ranks.rank())) result.begin = result.all;
      result.all += static_cast<std::size_t>(rows[counts * r + column]);
    }
    return result;
  };
  const bool single = format.precision == FrameFormat::Precision::single;
  std::vector<FrameArray> arrays;
  const Lister bodies{arrays, "bodies", single, rows_of(0)};
  bodies("id", "1", part.id);
  bodies("x", "m", part.x);
  bodies("radius", "m", part.radius);
  if (format.velocities) bodies("u", "m/s", part.u);
  if (format.velocities && rows_of(2).all > 0) bodies("omega", "rad/s", part.omega);
  if (rows_of(3).all > 0) bodies("orientation", "1", part.orientation);
  if (rows_of(4).all > 0) bodies("material", "1", part.material);
  const Lister contacts{arrays, "contacts", single, rows_of(1)};
  contacts("bodies", "1", part.contact_bodies);
  if (format.contact_geometry) {
    contacts("point", "m", part.contact_point);
    contacts("normal", "1", part.contact_normal);
    contacts("gap", "m", part.contact_gap);
  }
  contacts("force", "N", part.contact_force);
  if (rows_of(5).all > 0) contacts("moment", "N m", part.contact_moment);
  const Lister of_walls{arrays, "walls", false, {0, part.walls.size()}};
  of_walls("position", "m", walls.position);
  of_walls("velocity", "m/s", walls.velocity);
  of_walls("force", "N", walls.force);
  of_walls("normal", "1", walls.normal);
  of_walls("present", "1", walls.present);
  if (!walls.rotation.empty()) {
    of_walls("rotation", "1", walls.rotation);
    of_walls("translation", "m", walls.translation);
  }
  const Lister of_cell{arrays, "cell", false, {0, cell.edges.size()}};
  if (!cell.edges.empty()) {
    of_cell("origin", "m", cell.origin);
    of_cell("edges", "m", cell.edges);
    of_cell("rates", "m/s", cell.rates);
  }
  if (ranks.rank() != 0)
    for (FrameArray& array : arrays)
      if (array.group == of_walls.group || array.group == of_cell.group) array.values = {};
  return arrays;
}

std::vector<std::int64_t> lay_out(Place frame, const std::vector<FrameArray>& arrays, int compression) {
  std::map<std::string_view, Hdf5Object> groups;
  std::vector<std::int64_t> begin;
  for (const FrameArray& array : arrays) {
    if (!groups.contains(array.group)) groups.emplace(array.group, create_group(frame, array.group));
    const Place place{groups.at(array.group).id(), frame.file};
    const Hdf5Object dataset = create_array(place, array, compression);
    const bool placed = array.all > 0 && compression == 0;
    begin.push_back(placed ? static_cast<std::int64_t>(H5Dget_offset(dataset.id())) : -1);
  }
  return begin;
}

void write_in_place(const std::string& path, const std::vector<FrameArray>& arrays,
                    const std::vector<std::int64_t>& begin) {
  Descriptor file(path, O_WRONLY);
  for (std::size_t k = 0; k < arrays.size(); ++k) {
    const FrameArray& array = arrays[k];
    if (array.values.empty()) continue;
    const std::size_t row = array.columns * (array.narrow ? 4 : 8);
    const std::int64_t place = begin[k] + static_cast<std::int64_t>(array.begin * row);
    const std::vector<float> narrow = array.narrow ? narrowed(array.values) : std::vector<float>();
    file.write_at(place, text_of_bytes(array.narrow ? std::as_bytes(std::span(narrow)) : array.values));
  }
  file.close();
}

void write_gathered(Place frame, const std::vector<FrameArray>& arrays, const graph::Communicator& ranks) {
  std::exception_ptr failure;
  for (const FrameArray& array : arrays) {
    std::optional<Hdf5Object> dataset;
    if (ranks.rank() == 0 && !failure) {
      try {
        const std::string name = fmt::format("{}/{}", array.group, array.name);
        dataset.emplace(
            hold(H5Dopen2(frame.group, name.c_str(), H5P_DEFAULT), H5Dclose, frame.file, "opening " + name));
      } catch (...) {
        failure = std::current_exception();
      }
    }
    gather_array(dataset, frame.file, array, ranks, failure);
  }
  all_or_none(ranks, frame.file, true, [&] {
    if (failure) std::rethrow_exception(failure);
  });
}

}  // namespace talus::io::detail
