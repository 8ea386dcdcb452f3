#include "io/files/detail/hdf5_write.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "io/files/error.hpp"

namespace talus::io::detail {

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

Hdf5Object checked_file_access(const std::string& file) {
  Hdf5Object access = file_access(file);
  demand(H5Pset_libver_bounds(access.id(), H5F_LIBVER_V18, H5F_LIBVER_V18), file, "preparing HDF5");
  return access;
}

namespace {

void write_attribute(Place place, const char* name, hid_t file_type, hid_t memory_type, const void* value) {
  const std::string action = fmt::format("writing attribute '{}'", name);
  const Hdf5Object space = hold(H5Screate(H5S_SCALAR), H5Sclose, place.file, action);
  const Hdf5Object attribute =
      hold(H5Acreate2(place.group, name, file_type, space.id(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose,
           place.file, action);
  demand(H5Awrite(attribute.id(), memory_type, value), place.file, action);
}

}  // namespace

void write_attribute(Place place, const char* name, std::int64_t value) {
  write_attribute(place, name, H5T_STD_I64LE, H5T_NATIVE_INT64, &value);
}

void write_attribute(Place place, const char* name, double value) {
  write_attribute(place, name, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, &value);
}

void write_attribute(Place place, const char* name, const std::string& value) {
  const Hdf5Object type = text_type(place.file, value.size());
  write_attribute(place, name, type.id(), type.id(), value.c_str());
}

void write_array(Place place, const char* name, const char* units, const NumberTable& table) {
  const std::string action = fmt::format("writing '{}'", name);
  const hsize_t extent[2] = {table.rows, table.columns};
  const Hdf5Object space =
      hold(H5Screate_simple(table.columns == 1 ? 1 : 2, extent, nullptr), H5Sclose, place.file, action);
  const Hdf5Object dataset =
      hold(H5Dcreate2(place.group, name, table.types.file, space.id(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT),
           H5Dclose, place.file, action);
  if (table.rows > 0)
    demand(H5Dwrite(dataset.id(), table.types.memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, table.values),
           place.file, action);
  write_attribute({dataset.id(), place.file}, "units", std::string(units));
}

Hdf5Object create_group(Place place, const std::string& name) {
  return hold(H5Gcreate2(place.group, name.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Gclose,
              place.file, fmt::format("creating group '{}'", name));
}

void write_names(Place place, const char* name, const std::vector<std::string>& values) {
  const std::string action = fmt::format("writing '{}'", name);
  std::size_t longest = 1;
  for (const std::string& value : values) longest = std::max(longest, value.size());
  const Hdf5Object type = text_type(place.file, longest);
  const hsize_t extent = values.size();
  const Hdf5Object space = hold(H5Screate_simple(1, &extent, nullptr), H5Sclose, place.file, action);
  const Hdf5Object dataset =
      hold(H5Dcreate2(place.group, name, type.id(), space.id(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT),
           H5Dclose, place.file, action);
  std::string texts;
  for (const std::string& value : values) texts.append(value).append(longest - value.size(), '\0');
  if (!texts.empty()) {
    demand(H5Dwrite(dataset.id(), type.id(), H5S_ALL, H5S_ALL, H5P_DEFAULT, texts.data()), place.file,
           action);
  }
  write_attribute({dataset.id(), place.file}, "units", std::string("1"));
}

void close_file(Hdf5Object& file, const std::string& path) {
  demand(H5Fclose(file.release()), path, "writing to disk");
}

}  // namespace talus::io::detail
