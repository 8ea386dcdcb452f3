#include "io/files/detail/hdf5_read.hpp"

#include <fmt/format.h>

#include "io/files/error.hpp"

namespace talus::io::detail {

Hdf5Object open_file(const std::string& path) {
  const Hdf5Object access = hold(H5Pcreate(H5P_FILE_ACCESS), H5Pclose, path, "preparing HDF5");
  demand(H5Pset_file_locking(access.id(), false, true), path, "preparing HDF5");
  return hold(H5Fopen(path.c_str(), H5F_ACC_RDONLY, access.id()), H5Fclose, path, "opening as HDF5");
}

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

std::vector<std::string> take_texts(std::vector<char*>& texts) {
  std::vector<std::string> values;
  for (char* text : texts) {
    values.emplace_back(text == nullptr ? "" : text);
    H5free_memory(text);
  }
  return values;
}

std::vector<std::string> read_names(Place place, const std::string& name) {
  const Hdf5Object dataset =
      hold(H5Dopen2(place.group, name.c_str(), H5P_DEFAULT), H5Dclose, place.file, "opening " + name);
  const Hdf5Object type = text_type(place.file);
  std::vector<char*> texts(row_count(dataset.id(), 1, place.file, name));
  if (!texts.empty()) {
    demand(H5Dread(dataset.id(), type.id(), H5S_ALL, H5S_ALL, H5P_DEFAULT, texts.data()), place.file,
           "reading " + name);
  }
  return take_texts(texts);
}

void read_attribute(Place place, const char* name, hid_t type, void* value) {
  const std::string action = fmt::format("reading attribute '{}'", name);
  const Hdf5Object attribute = hold(H5Aopen(place.group, name, H5P_DEFAULT), H5Aclose, place.file, action);
  demand(H5Aread(attribute.id(), type, value), place.file, action);
}

std::string read_text(Place place, const char* name) {
  if (H5Aexists(place.group, name) <= 0) return "";
  std::vector<char*> text(1);
  read_attribute(place, name, text_type(place.file).id(), text.data());
  return take_texts(text).front();
}

std::int64_t read_integer(Place place, const char* name) {
  std::int64_t value = 0;
  read_attribute(place, name, H5T_NATIVE_INT64, &value);
  return value;
}

std::vector<std::string> names_in(Place place, const std::string& group) {
  const Hdf5Object opened =
      hold(H5Gopen2(place.group, group.c_str(), H5P_DEFAULT), H5Gclose, place.file, "opening " + group);
  H5G_info_t info{};
  demand(H5Gget_info(opened.id(), &info), place.file, "counting what is in " + group);
  std::vector<std::string> names;
  for (hsize_t k = 0; k < info.nlinks; ++k) {
    char name[64] = {};
    demand(
        H5Lget_name_by_idx(opened.id(), ".", H5_INDEX_NAME, H5_ITER_INC, k, name, sizeof(name), H5P_DEFAULT),
        place.file, "reading the names in " + group);
    names.emplace_back(name);
  }
  return names;
}

}  // namespace talus::io::detail
