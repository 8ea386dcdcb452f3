#include "io/results.hpp"

#include <fmt/format.h>

#include <span>
#include <stdexcept>

#include "io/detail/hdf5.hpp"
#include "io/error.hpp"
#include "io/version.hpp"

namespace talus::io {
namespace {

using detail::demand;
using detail::Hdf5Object;
using detail::hold;

constexpr std::int64_t format_version = 1;

static_assert(sizeof(Vec3) == 3 * sizeof(double), "a vector of Vec3 is written as an n x 3 array");

std::string frame_name(std::size_t index) {
  return fmt::format("{:06}", index);
}

Hdf5Object file_access(const std::string& file) {
  Hdf5Object access = hold(H5Pcreate(H5P_FILE_ACCESS), H5Pclose, file, "preparing HDF5");
  demand(H5Pset_file_locking(access.id(), false, true), file, "preparing HDF5");
  // Metadata leave the cache when the file is closed and not before, so that a kill while the arrays of a
  // frame are being written finds the directory of the file as it was.
  H5AC_cache_config_t cache{};
  cache.version = H5AC__CURR_CACHE_CONFIG_VERSION;
  demand(H5Pget_mdc_config(access.id(), &cache), file, "preparing HDF5");
  cache.evictions_enabled = false;
  cache.incr_mode = H5C_incr__off;
  cache.flash_incr_mode = H5C_flash_incr__off;
  cache.decr_mode = H5C_decr__off;
  demand(H5Pset_mdc_config(access.id(), &cache), file, "preparing HDF5");
  return access;
}

/// The group and the file that every write or read needs.
struct Place {
  hid_t group;
  const std::string& file;
};

void write_attribute(Place place, const char* name, hid_t file_type, hid_t memory_type, const void* value) {
  const std::string action = fmt::format("writing attribute '{}'", name);
  const Hdf5Object space = hold(H5Screate(H5S_SCALAR), H5Sclose, place.file, action);
  const Hdf5Object attribute =
      hold(H5Acreate2(place.group, name, file_type, space.id(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose,
           place.file, action);
  demand(H5Awrite(attribute.id(), memory_type, value), place.file, action);
}

void write_attribute(Place place, const char* name, std::int64_t value) {
  write_attribute(place, name, H5T_STD_I64LE, H5T_NATIVE_INT64, &value);
}

void write_attribute(Place place, const char* name, double value) {
  write_attribute(place, name, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, &value);
}

void write_attribute(Place place, const char* name, const std::string& value) {
  const Hdf5Object type = detail::text_type(place.file);
  const char* text = value.c_str();
  write_attribute(place, name, type.id(), type.id(), &text);
}

struct ElementTypes {
  hid_t file;
  hid_t memory;
};
ElementTypes element_types(const double*) {
  return {H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE};
}
ElementTypes element_types(const std::int64_t*) {
  return {H5T_STD_I64LE, H5T_NATIVE_INT64};
}

/// Writes rows x columns numbers; one column makes a one-dimensional dataset.
template <class T>
void write_array(Place place, const char* name, const char* units, const T* values, std::size_t rows,
                 std::size_t columns) {
  const std::string action = fmt::format("writing '{}'", name);
  const hsize_t extent[2] = {rows, columns};
  const Hdf5Object space =
      hold(H5Screate_simple(columns == 1 ? 1 : 2, extent, nullptr), H5Sclose, place.file, action);
  const ElementTypes types = element_types(values);
  const Hdf5Object dataset =
      hold(H5Dcreate2(place.group, name, types.file, space.id(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT),
           H5Dclose, place.file, action);
  if (rows > 0) {
    demand(H5Dwrite(dataset.id(), types.memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, values), place.file, action);
  }
  write_attribute({dataset.id(), place.file}, "units", std::string(units));
}

void write_array(Place place, const char* name, const char* units, const std::vector<Vec3>& values) {
  write_array(place, name, units, values.empty() ? static_cast<const double*>(nullptr) : values[0].data(),
              values.size(), 3);
}

template <class T>
void write_array(Place place, const char* name, const char* units, const std::vector<T>& values) {
  write_array(place, name, units, values.data(), values.size(), 1);
}

template <class T, std::size_t N>
void write_array(Place place, const char* name, const char* units,
                 const std::vector<std::array<T, N>>& values) {
  write_array(place, name, units, values.empty() ? static_cast<const T*>(nullptr) : values[0].data(),
              values.size(), N);
}

Hdf5Object create_group(Place place, const std::string& name) {
  return hold(H5Gcreate2(place.group, name.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Gclose,
              place.file, fmt::format("creating group '{}'", name));
}

void write_bodies(Place place, const Frame& frame) {
  write_array(place, "id", "1", frame.id);
  write_array(place, "x", "m", frame.x);
  write_array(place, "radius", "m", frame.radius);
  write_array(place, "u", "m/s", frame.u);
  if (!frame.omega.empty()) write_array(place, "omega", "rad/s", frame.omega);
  if (!frame.orientation.empty()) write_array(place, "orientation", "1", frame.orientation);
}

void write_contacts(Place place, const Frame& frame) {
  write_array(place, "bodies", "1", frame.contact_bodies);
  write_array(place, "point", "m", frame.contact_point);
  write_array(place, "normal", "1", frame.contact_normal);
  write_array(place, "gap", "m", frame.contact_gap);
  write_array(place, "force", "N", frame.contact_force);
}

void write_walls(Place place, const Frame& frame) {
  std::vector<double> position, velocity;
  std::vector<Vec3> force;
  for (const WallReport& wall : frame.walls) {
    position.push_back(wall.position);
    velocity.push_back(wall.velocity);
    force.push_back(wall.force);
  }
  write_array(place, "position", "m", position);
  write_array(place, "velocity", "m/s", velocity);
  write_array(place, "force", "N", force);
}

void write_names(Place place, const char* name, const std::vector<std::string>& values) {
  const std::string action = fmt::format("writing '{}'", name);
  const Hdf5Object type = detail::text_type(place.file);
  const hsize_t extent = values.size();
  const Hdf5Object space = hold(H5Screate_simple(1, &extent, nullptr), H5Sclose, place.file, action);
  const Hdf5Object dataset =
      hold(H5Dcreate2(place.group, name, type.id(), space.id(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT),
           H5Dclose, place.file, action);
  std::vector<const char*> texts;
  for (const std::string& value : values) texts.push_back(value.c_str());
  if (!texts.empty()) {
    demand(H5Dwrite(dataset.id(), type.id(), H5S_ALL, H5S_ALL, H5P_DEFAULT, texts.data()), place.file,
           action);
  }
}

/// Closing is when a full disk shows.
void close_file(Hdf5Object& file, const std::string& path) {
  demand(H5Fclose(file.release()), path, "writing to disk");
}

void demand_same_length(std::size_t length, std::size_t expected, const char* name) {
  if (length != expected) {
    throw std::invalid_argument(fmt::format("frame: {} has {} entries, expected {}", name, length, expected));
  }
}

}  // namespace

void validate(const Frame& frame) {
  const std::size_t bodies = frame.id.size();
  demand_same_length(frame.x.size(), bodies, "x");
  demand_same_length(frame.radius.size(), bodies, "radius");
  demand_same_length(frame.u.size(), bodies, "u");
  if (!frame.omega.empty()) demand_same_length(frame.omega.size(), bodies, "omega");
  if (!frame.orientation.empty()) demand_same_length(frame.orientation.size(), bodies, "orientation");
  const std::size_t contacts = frame.contact_bodies.size();
  demand_same_length(frame.contact_point.size(), contacts, "contact_point");
  demand_same_length(frame.contact_normal.size(), contacts, "contact_normal");
  demand_same_length(frame.contact_gap.size(), contacts, "contact_gap");
  demand_same_length(frame.contact_force.size(), contacts, "contact_force");
}

ResultsWriter::ResultsWriter(const std::filesystem::path& path, const std::vector<std::string>& wall_names)
    : path_(path.string()), wall_names_(wall_names) {
  const detail::QuietHdf5 quiet;
  const Hdf5Object access = file_access(path_);
  Hdf5Object file = hold(H5Fcreate(path_.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access.id()), H5Fclose, path_,
                         "creating the file");
  {
    const Place root{file.id(), path_};
    write_attribute(root, "format", std::string("talus-results"));
    write_attribute(root, "format_version", format_version);
    write_attribute(root, "talus_version", version());
    create_group(root, "frames");
    const Hdf5Object walls = create_group(root, "walls");
    write_names({walls.id(), path_}, "name", wall_names_);
  }
  close_file(file, path_);
}

void ResultsWriter::append(const Frame& frame) {
  validate(frame);
  demand_same_length(frame.walls.size(), wall_names_.size(), "walls");
  for (std::size_t k = 0; k < wall_names_.size(); ++k) {
    if (frame.walls[k].name != wall_names_[k]) {
      throw std::invalid_argument(
          fmt::format("frame: wall {} is '{}', expected '{}'", k, frame.walls[k].name, wall_names_[k]));
    }
  }
  const detail::QuietHdf5 quiet;
  const Hdf5Object access = file_access(path_);
  Hdf5Object file =
      hold(H5Fopen(path_.c_str(), H5F_ACC_RDWR, access.id()), H5Fclose, path_, "opening the file");
  {
    // Nameless until it is complete: what stops half way leaves no half frame behind.
    const Hdf5Object group =
        hold(H5Gcreate_anon(file.id(), H5P_DEFAULT, H5P_DEFAULT), H5Gclose, path_, "creating a frame");
    const Place place{group.id(), path_};
    write_attribute(place, "step", frame.step);
    write_attribute(place, "time", frame.time);
    write_attribute(place, "stage", frame.stage);
    write_bodies({create_group(place, "bodies").id(), path_}, frame);
    write_contacts({create_group(place, "contacts").id(), path_}, frame);
    write_walls({create_group(place, "walls").id(), path_}, frame);
    // All of it on its way to the disk before its name is, or a kill in between could leave a name of
    // nothing.
    demand(H5Fflush(file.id(), H5F_SCOPE_LOCAL), path_, "writing to disk");
    const std::string name = "/frames/" + frame_name(frames_);
    demand(H5Olink(group.id(), file.id(), name.c_str(), H5P_DEFAULT, H5P_DEFAULT), path_,
           "naming frame " + name);
  }
  close_file(file, path_);
  ++frames_;
}

}  // namespace talus::io
