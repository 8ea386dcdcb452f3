#include "io/files/detail/hdf5_read.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <string_view>
#include <system_error>

#include "io/files/error.hpp"

namespace talus::io::detail {

Hdf5Object open_file(const std::string& path) {
  if (std::filesystem::is_directory(path)) throw FileError(path, "is a folder; give a file in it");
  const Hdf5Object access = hold(H5Pcreate(H5P_FILE_ACCESS), H5Pclose, path, "preparing HDF5");
  demand(H5Pset_file_locking(access.id(), false, true), path, "preparing HDF5");
  return hold(H5Fopen(path.c_str(), H5F_ACC_RDONLY, access.id()), H5Fclose, path, "opening as HDF5");
}

Hdf5Object open_checked_file(const std::string& path) {
  constexpr std::string_view signature = "\x89HDF\r\n\x1a\n";
  constexpr char checked = 2;  // the first version of HDF5's head that has a checksum
  std::error_code unknown;
  std::ifstream file;
  if (std::filesystem::is_regular_file(path, unknown)) file.open(path, std::ios::binary);
  if (!file.is_open()) return open_file(path);  // which says why not
  std::array<char, signature.size() + 1> head{};
  file.read(head.data(), head.size());
  if (std::string_view(head.data(), signature.size()) != signature)
    throw FileError(path, "is no HDF5 file, or its beginning is damaged");
  if (head.back() < checked)
    throw FileError(path,
                    "has no checksums of its directory, as checkpoints and traces of this Talus have: it is "
                    "another file (results.h5 is none of these), or of an earlier version, or damaged");
  return open_file(path);
}

bool is_stored(hid_t dataset, hsize_t elements, const std::string& path, const std::string& name) {
  const std::string action = "reading the shape of " + name;
  const Hdf5Object type = hold(H5Dget_type(dataset), H5Tclose, path, action);
  const Hdf5Object creation = hold(H5Dget_create_plist(dataset), H5Pclose, path, action);
  const double packed = H5Pget_nfilters(creation.id()) > 0 ? 1032 : 1;
  const auto stored = static_cast<double>(H5Dget_storage_size(dataset));
  const auto each = static_cast<double>(std::max<std::size_t>(H5Tget_size(type.id()), 1));  // 0: damaged, too
  const double claimed = static_cast<double>(elements) * each;
  return stored <= static_cast<double>(std::filesystem::file_size(path)) && claimed <= packed * stored;
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
  if (!is_stored(dataset, extent[0] * columns, path, name))
    throw FileError(
        path, fmt::format("{} says that it has {} entries, more than the file holds: it is damaged", name,
                          extent[0] * columns));
  return extent[0];
}

namespace {

/// The type that texts of the file's type `stored` are read as. Throws FileError for those of variable
/// length.
Hdf5Object readable_text_type(hid_t stored, const std::string& path, const std::string& name) {
  const bool fixed = H5Tget_class(stored) == H5T_STRING && H5Tis_variable_str(stored) == 0;
  if (!fixed)
    throw FileError(path, name + " holds no texts of fixed length: the file is damaged or older than Talus " +
                              "writes; make it again");
  return text_type(path, H5Tget_size(stored));
}

/// Of a text that zeros fill up.
std::string trimmed(const char* text, std::size_t bytes) {
  return {text, std::find(text, text + bytes, '\0')};
}

}  // namespace

std::vector<std::string> read_names(Place place, const std::string& name) {
  const Hdf5Object dataset =
      hold(H5Dopen2(place.group, name.c_str(), H5P_DEFAULT), H5Dclose, place.file, "opening " + name);
  const Hdf5Object stored = hold(H5Dget_type(dataset.id()), H5Tclose, place.file, "reading " + name);
  const Hdf5Object type = readable_text_type(stored.id(), place.file, name);
  const std::size_t bytes = H5Tget_size(type.id());
  std::vector<std::string> names(row_count(dataset.id(), 1, place.file, name));
  std::string texts(names.size() * bytes, '\0');
  if (!names.empty())
    demand(H5Dread(dataset.id(), type.id(), H5S_ALL, H5S_ALL, H5P_DEFAULT, texts.data()), place.file,
           "reading " + name);
  for (std::size_t k = 0; k < names.size(); ++k) names[k] = trimmed(texts.data() + k * bytes, bytes);
  return names;
}

namespace {

Hdf5Object open_attribute(Place place, const char* name) {
  const std::string action = fmt::format("reading attribute '{}'", name);
  Hdf5Object attribute = hold(H5Aopen(place.group, name, H5P_DEFAULT), H5Aclose, place.file, action);
  const Hdf5Object space = hold(H5Aget_space(attribute.id()), H5Sclose, place.file, action);
  if (H5Sget_simple_extent_npoints(space.id()) != 1)
    throw FileError(place.file, fmt::format("attribute '{}' is not one value", name));
  return attribute;
}

}  // namespace

void read_attribute(Place place, const char* name, hid_t type, void* value) {
  const Hdf5Object attribute = open_attribute(place, name);
  demand(H5Aread(attribute.id(), type, value), place.file, fmt::format("reading attribute '{}'", name));
}

std::string read_text(Place place, const char* name) {
  if (H5Aexists(place.group, name) <= 0) return "";
  const Hdf5Object attribute = open_attribute(place, name);
  const std::string action = fmt::format("reading attribute '{}'", name);
  const Hdf5Object stored = hold(H5Aget_type(attribute.id()), H5Tclose, place.file, action);
  const Hdf5Object type = readable_text_type(stored.id(), place.file, fmt::format("attribute '{}'", name));
  // Attributes stand in the header of their object, whose blocks are no longer than this.
  constexpr std::size_t longest = 1 << 16;
  const std::size_t bytes = H5Tget_size(type.id());
  if (bytes > longest) throw FileError(place.file, fmt::format("attribute '{}' has {} bytes", name, bytes));
  std::string text(bytes, '\0');
  demand(H5Aread(attribute.id(), type.id(), text.data()), place.file, action);
  return trimmed(text.data(), bytes);
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
