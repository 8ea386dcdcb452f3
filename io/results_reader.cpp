#include <fmt/format.h>

#include <stdexcept>

#include "io/detail/hdf5.hpp"
#include "io/error.hpp"
#include "io/results.hpp"

namespace talus::io {
namespace {

using detail::demand;
using detail::Hdf5Object;
using detail::hold;

Hdf5Object open_results(const std::string& path) {
  const Hdf5Object access = hold(H5Pcreate(H5P_FILE_ACCESS), H5Pclose, path, "preparing HDF5");
  demand(H5Pset_file_locking(access.id(), false, true), path, "preparing HDF5");
  Hdf5Object file =
      hold(H5Fopen(path.c_str(), H5F_ACC_RDONLY, access.id()), H5Fclose, path, "opening as HDF5");
  if (H5Lexists(file.id(), "frames", H5P_DEFAULT) <= 0) {
    throw FileError(path, "has no group /frames; it is not a results.h5 of talus");
  }
  return file;
}

std::size_t count_frames(hid_t file, const std::string& path) {
  H5G_info_t info{};
  demand(H5Gget_info_by_name(file, "frames", &info, H5P_DEFAULT), path, "counting the frames");
  return info.nlinks;
}

/// Length of the first dimension, after a check of the others: `columns` numbers a row.
std::size_t row_count(hid_t dataset, std::size_t columns, const std::string& path, const std::string& name) {
  const Hdf5Object space = hold(H5Dget_space(dataset), H5Sclose, path, "reading the shape of " + name);
  hsize_t extent[2] = {0, 1};
  const int dimensions = H5Sget_simple_extent_ndims(space.id());
  if (dimensions != (columns == 1 ? 1 : 2)) {
    throw FileError(path,
                    fmt::format("{} has {} dimensions, expected {}", name, dimensions, columns == 1 ? 1 : 2));
  }
  demand(H5Sget_simple_extent_dims(space.id(), extent, nullptr), path, "reading the shape of " + name);
  if (extent[1] != columns) {
    throw FileError(path, fmt::format("{} has {} numbers a row, expected {}", name, extent[1], columns));
  }
  return extent[0];
}

template <class T>
constexpr std::size_t numbers_in = sizeof(T) / 8;

/// Entries of `name` below the frame `prefix`, each made of doubles or 64-bit integers.
template <class T>
std::vector<T> read_array(hid_t file, const std::string& path, const std::string& name, hid_t type) {
  const Hdf5Object dataset =
      hold(H5Dopen2(file, name.c_str(), H5P_DEFAULT), H5Dclose, path, "opening " + name);
  std::vector<T> values(row_count(dataset.id(), numbers_in<T>, path, name));
  if (!values.empty()) {
    demand(H5Dread(dataset.id(), type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), path,
           "reading " + name);
  }
  return values;
}

template <class T>
std::vector<T> read_doubles(hid_t file, const std::string& path, const std::string& name) {
  return read_array<T>(file, path, name, H5T_NATIVE_DOUBLE);
}

template <class T>
std::vector<T> read_integers(hid_t file, const std::string& path, const std::string& name) {
  return read_array<T>(file, path, name, H5T_NATIVE_INT64);
}

/// The texts of a dataset or attribute of variable-length strings, copied out of HDF5's memory.
std::vector<std::string> take_texts(std::vector<char*>& texts) {
  std::vector<std::string> values;
  for (char* text : texts) {
    values.emplace_back(text == nullptr ? "" : text);
    H5free_memory(text);
  }
  return values;
}

std::vector<std::string> read_names(hid_t file, const std::string& path, const std::string& name) {
  const Hdf5Object dataset =
      hold(H5Dopen2(file, name.c_str(), H5P_DEFAULT), H5Dclose, path, "opening " + name);
  const Hdf5Object type = detail::text_type(path);
  std::vector<char*> texts(row_count(dataset.id(), 1, path, name));
  if (!texts.empty()) {
    demand(H5Dread(dataset.id(), type.id(), H5S_ALL, H5S_ALL, H5P_DEFAULT, texts.data()), path,
           "reading " + name);
  }
  return take_texts(texts);
}

void read_attribute(hid_t group, const std::string& path, const char* name, hid_t type, void* value) {
  const std::string action = fmt::format("reading attribute '{}'", name);
  const Hdf5Object attribute = hold(H5Aopen(group, name, H5P_DEFAULT), H5Aclose, path, action);
  demand(H5Aread(attribute.id(), type, value), path, action);
}

}  // namespace

std::size_t frame_count(const std::filesystem::path& path) {
  const detail::QuietHdf5 quiet;
  const Hdf5Object file = open_results(path.string());
  return count_frames(file.id(), path.string());
}

Frame read_frame(const std::filesystem::path& path, std::size_t index) {
  const detail::QuietHdf5 quiet;
  const std::string name = path.string();
  const Hdf5Object file = open_results(name);
  const std::size_t count = count_frames(file.id(), name);
  if (index >= count) throw FileError(name, fmt::format("has no frame {}; it holds {}", index, count));

  const std::string prefix = fmt::format("/frames/{:06}", index);
  const Hdf5Object group =
      hold(H5Gopen2(file.id(), prefix.c_str(), H5P_DEFAULT), H5Gclose, name, "opening " + prefix);
  Frame frame;
  read_attribute(group.id(), name, "step", H5T_NATIVE_INT64, &frame.step);
  read_attribute(group.id(), name, "time", H5T_NATIVE_DOUBLE, &frame.time);
  std::vector<char*> stage(1);
  read_attribute(group.id(), name, "stage", detail::text_type(name).id(), stage.data());
  frame.stage = take_texts(stage).front();

  const hid_t h = group.id();
  frame.id = read_integers<std::int64_t>(h, name, "bodies/id");
  frame.x = read_doubles<Vec3>(h, name, "bodies/x");
  frame.radius = read_doubles<double>(h, name, "bodies/radius");
  frame.u = read_doubles<Vec3>(h, name, "bodies/u");
  if (H5Lexists(h, "bodies/omega", H5P_DEFAULT) > 0)
    frame.omega = read_doubles<Vec3>(h, name, "bodies/omega");
  if (H5Lexists(h, "bodies/orientation", H5P_DEFAULT) > 0) {
    frame.orientation = read_doubles<std::array<double, 4>>(h, name, "bodies/orientation");
  }
  frame.contact_bodies = read_integers<std::array<std::int64_t, 2>>(h, name, "contacts/bodies");
  frame.contact_point = read_doubles<Vec3>(h, name, "contacts/point");
  frame.contact_normal = read_doubles<Vec3>(h, name, "contacts/normal");
  frame.contact_gap = read_doubles<double>(h, name, "contacts/gap");
  frame.contact_force = read_doubles<Vec3>(h, name, "contacts/force");

  const auto names = read_names(file.id(), name, "/walls/name");
  const auto position = read_doubles<double>(h, name, "walls/position");
  const auto velocity = read_doubles<double>(h, name, "walls/velocity");
  const auto force = read_doubles<Vec3>(h, name, "walls/force");
  if (position.size() != names.size() || velocity.size() != names.size() || force.size() != names.size()) {
    throw FileError(name, prefix + "/walls does not fit the number of names in /walls/name");
  }
  for (std::size_t k = 0; k < names.size(); ++k) {
    frame.walls.push_back({names[k], position[k], velocity[k], force[k]});
  }
  try {
    validate(frame);
  } catch (const std::invalid_argument& error) {
    throw FileError(name, prefix + " is damaged: " + error.what());
  }
  return frame;
}

}  // namespace talus::io
