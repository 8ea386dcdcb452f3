#include "io/results/vtkhdf.hpp"

#include <fmt/format.h>

#include <array>
#include <cstdint>
#include <map>
#include <numeric>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "io/files/detail/hdf5_write.hpp"
#include "io/files/error.hpp"

namespace talus::io {

namespace detail {

/// Rows by which HDF5 lays out arrays that grow.
constexpr hsize_t growth_rows = 16384;

/// A dataset that rows are appended to.
class GrowingArray {
 public:
  GrowingArray(Place place, const char* name, const char* units, ElementTypes types, std::size_t columns)
      : path_(place.file),
        name_(name),
        types_(types),
        columns_(columns),
        dataset_(make(place, name, types, columns)) {
    write_attribute({dataset_.id(), path_}, "units", std::string(units));
  }

  void append(const void* values, std::size_t rows) {
    if (rows == 0) return;
    const std::string action = fmt::format("writing '{}'", name_);
    const hsize_t start[2] = {rows_, 0}, count[2] = {rows, columns_}, extent[2] = {rows_ + rows, columns_};
    demand(H5Dset_extent(dataset_.id(), extent), path_, action);
    const Hdf5Object there = hold(H5Dget_space(dataset_.id()), H5Sclose, path_, action);
    const Hdf5Object here = hold(H5Screate_simple(rank(columns_), count, nullptr), H5Sclose, path_, action);
    demand(H5Sselect_hyperslab(there.id(), H5S_SELECT_SET, start, nullptr, count, nullptr), path_, action);
    demand(H5Dwrite(dataset_.id(), types_.memory, here.id(), there.id(), H5P_DEFAULT, values), path_, action);
    rows_ += rows;
  }

 private:
  static int rank(std::size_t columns) { return columns == 1 ? 1 : 2; }
  static Hdf5Object make(Place place, const char* name, ElementTypes types, std::size_t columns) {
    const std::string action = fmt::format("writing '{}'", name);
    const hsize_t none[2] = {0, columns}, all[2] = {H5S_UNLIMITED, columns},
                  chunk[2] = {growth_rows, columns};
    const Hdf5Object space = hold(H5Screate_simple(rank(columns), none, all), H5Sclose, place.file, action);
    const Hdf5Object creation = hold(H5Pcreate(H5P_DATASET_CREATE), H5Pclose, place.file, action);
    demand(H5Pset_chunk(creation.id(), rank(columns), chunk), place.file, action);
    return hold(
        H5Dcreate2(place.group, name, types.file, space.id(), H5P_DEFAULT, creation.id(), H5P_DEFAULT),
        H5Dclose, place.file, action);
  }

  const std::string& path_;
  std::string name_;
  ElementTypes types_;
  std::size_t columns_, rows_ = 0;
  Hdf5Object dataset_;
};

}  // namespace detail

namespace {

using detail::create_group;
using detail::demand;
using detail::element_types;
using detail::GrowingArray;
using detail::Hdf5Object;
using detail::hold;
using detail::Place;

static_assert(sizeof(Vec3) == 3 * sizeof(double), "a vector of Vec3 is written as an n x 3 array");

constexpr std::array<const char*, 4> topologies{"Vertices", "Lines", "Polygons", "Strips"};

/// VTK asks for texts in ASCII and for arrays as attributes, which no other file of ours has.
void write_type(Place place) {
  constexpr char text[] = "PolyData";
  constexpr std::int64_t version[2] = {2, 0};
  constexpr hsize_t two = 2;
  const std::string action = "writing attributes of /VTKHDF";
  const Hdf5Object type = hold(H5Tcopy(H5T_C_S1), H5Tclose, place.file, action);
  demand(H5Tset_size(type.id(), sizeof text - 1), place.file, action);
  demand(H5Tset_strpad(type.id(), H5T_STR_NULLPAD), place.file, action);
  const Hdf5Object scalar = hold(H5Screate(H5S_SCALAR), H5Sclose, place.file, action);
  const Hdf5Object pair = hold(H5Screate_simple(1, &two, nullptr), H5Sclose, place.file, action);
  const Hdf5Object kind =
      hold(H5Acreate2(place.group, "Type", type.id(), scalar.id(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose,
           place.file, action);
  demand(H5Awrite(kind.id(), type.id(), text), place.file, action);
  const Hdf5Object number =
      hold(H5Acreate2(place.group, "Version", H5T_STD_I64LE, pair.id(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose,
           place.file, action);
  demand(H5Awrite(number.id(), H5T_NATIVE_INT64, version), place.file, action);
}

}  // namespace

struct VtkHdfWriter::File {
  explicit File(const std::filesystem::path& name)
      : path(name.string()),
        file(hold(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT), H5Fclose, path,
                  "creating the file")),
        root(create_group({file.id(), path}, "VTKHDF")),
        data(create_group({root.id(), path}, "PointData")),
        vertices(create_group({root.id(), path}, "Vertices")),
        points({root.id(), path}, "Points", "m", element_types(static_cast<const double*>(nullptr)), 3),
        offsets({vertices.id(), path}, "Offsets", "1",
                element_types(static_cast<const std::int64_t*>(nullptr)), 1),
        connectivity({vertices.id(), path}, "Connectivity", "1",
                     element_types(static_cast<const std::int64_t*>(nullptr)), 1) {
    write_type({root.id(), path});
  }

  /// Values of a point array, which is made with the first frame that has grains. (One without any does not
  /// tell whether they turn.)
  template <class T>
  void add(const char* name, const char* units, const std::vector<T>& values, std::size_t rows) {
    using Number = std::conditional_t<std::is_same_v<T, std::int64_t>, std::int64_t, double>;
    if (grains == 0 && !values.empty())
      arrays.try_emplace(name, Place{data.id(), path}, name, units,
                         element_types(static_cast<const Number*>(nullptr)), sizeof(T) / 8);
    const auto array = arrays.find(name);
    if (array == arrays.end()) return;
    if (values.size() != rows) throw FileError(path, fmt::format("a later frame has no '{}'", name));
    array->second.append(values.data(), rows);
  }

  std::string path;
  Hdf5Object file, root, data, vertices;
  GrowingArray points, offsets, connectivity;
  std::map<std::string, GrowingArray> arrays;
  std::int64_t grains = 0;           ///< of all frames
  std::vector<std::int64_t> counts;  ///< grains of each frame
  std::vector<double> times;         ///< [s]
};

VtkHdfWriter::VtkHdfWriter(const std::filesystem::path& path) {
  const detail::QuietHdf5 quiet;
  file_ = std::make_unique<File>(path);
}

VtkHdfWriter::~VtkHdfWriter() {
  const detail::QuietHdf5 quiet;
  file_.reset();
}

void VtkHdfWriter::append(const Frame& frame) {
  const detail::QuietHdf5 quiet;
  File& f = *file_;
  const std::size_t n = frame.id.size();
  f.points.append(frame.x.data(), n);
  std::vector<std::int64_t> numbers(n + 1);
  std::iota(numbers.begin(), numbers.end(), std::int64_t{0});
  f.offsets.append(numbers.data(), n + 1);
  f.connectivity.append(numbers.data(), n);
  f.add("id", "1", frame.id, n);
  f.add("radius", "m", frame.radius, n);
  f.add("velocity", "m/s", frame.u, n);
  f.add("omega", "rad/s", frame.omega, n);
  f.add("orientation", "1", frame.orientation, n);
  f.add("material", "1", frame.material, n);
  f.counts.push_back(static_cast<std::int64_t>(n));
  f.grains += f.counts.back();
  f.times.push_back(frame.time);
}

void VtkHdfWriter::close() {
  const detail::QuietHdf5 quiet;
  File& f = *file_;
  const std::size_t steps = f.counts.size();
  const std::vector<std::int64_t> zeros(steps, 0), ones(steps, 1);
  std::vector<std::int64_t> before(steps), part(steps);
  std::exclusive_scan(f.counts.begin(), f.counts.end(), before.begin(), std::int64_t{0});
  std::iota(part.begin(), part.end(), std::int64_t{0});
  std::vector<std::array<std::int64_t, 4>> of_cells(steps);
  for (std::size_t s = 0; s < steps; ++s) of_cells[s] = {before[s], 0, 0, 0};

  const Place root{f.root.id(), f.path};
  detail::write_array(root, "NumberOfPoints", "1", f.counts);
  for (const char* topology : topologies) {
    const bool grains = topology == topologies[0];
    std::optional<Hdf5Object> made;
    if (!grains) made.emplace(create_group(root, topology));
    const Place group{grains ? f.vertices.id() : made->id(), f.path};
    detail::write_array(group, "NumberOfCells", "1", grains ? f.counts : zeros);
    detail::write_array(group, "NumberOfConnectivityIds", "1", grains ? f.counts : zeros);
    if (grains) continue;
    detail::write_array(group, "Offsets", "1", zeros);
    detail::write_array(group, "Connectivity", "1", std::vector<std::int64_t>());
  }
  {
    const Hdf5Object group = create_group(root, "Steps");
    const Place table{group.id(), f.path};
    detail::write_attribute(table, "NSteps", static_cast<std::int64_t>(steps));
    detail::write_array(table, "Values", "s", f.times);
    detail::write_array(table, "PartOffsets", "1", part);
    detail::write_array(table, "NumberOfParts", "1", ones);
    detail::write_array(table, "PointOffsets", "1", before);
    detail::write_array(table, "CellOffsets", "1", of_cells);
    detail::write_array(table, "ConnectivityIdOffsets", "1", of_cells);
    {
      const Hdf5Object data = create_group(table, "PointDataOffsets");
      for (const auto& [name, array] : f.arrays)
        detail::write_array({data.id(), f.path}, name.c_str(), "1", before);
    }
  }
  // While all of it is open, or what a full disk refuses would be known to destructors only.
  demand(H5Fflush(f.file.id(), H5F_SCOPE_GLOBAL), f.path, "writing to disk");
  const std::string path = f.path;
  Hdf5Object file = std::move(f.file);
  file_.reset();
  detail::close_file(file, path);
}

}  // namespace talus::io
