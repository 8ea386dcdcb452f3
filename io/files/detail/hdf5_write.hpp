#pragma once

/// Attributes, arrays and groups of files that are written while a run goes on. All throw FileError.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "io/files/detail/hdf5.hpp"

namespace talus::io::detail {

/// File access for a file that is opened and closed again and again: not locked, and its directory reaches
/// the disk when it is closed and not before, so that a kill in between finds it as it was.
Hdf5Object file_access(const std::string& file);

/// The same for a file whose directory has checksums (formats of HDF5 1.8): HDF5 refuses one that is damaged,
/// and without them follows what it finds there out of its own memory.
Hdf5Object checked_file_access(const std::string& file);

/// The group and the file that every write or read needs.
struct Place {
  hid_t group;
  const std::string& file;
};

void write_attribute(Place place, const char* name, std::int64_t value);
void write_attribute(Place place, const char* name, double value);
void write_attribute(Place place, const char* name, const std::string& value);

/// Types of the elements in the file and in memory.
struct ElementTypes {
  hid_t file;
  hid_t memory;
};
inline ElementTypes element_types(const double*) {
  return {H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE};
}
inline ElementTypes element_types(const float*) {
  return {H5T_IEEE_F32LE, H5T_NATIVE_FLOAT};
}
inline ElementTypes element_types(const std::int64_t*) {
  return {H5T_STD_I64LE, H5T_NATIVE_INT64};
}
inline ElementTypes element_types(const std::int32_t*) {
  return {H5T_STD_I32LE, H5T_NATIVE_INT32};
}
inline ElementTypes element_types(const std::uint32_t*) {
  return {H5T_STD_U32LE, H5T_NATIVE_UINT32};
}
inline ElementTypes element_types(const std::uint16_t*) {
  return {H5T_STD_U16LE, H5T_NATIVE_UINT16};
}
inline ElementTypes element_types(const std::uint8_t*) {
  return {H5T_STD_U8LE, H5T_NATIVE_UINT8};
}

/// rows x columns numbers of one type, row after row.
struct NumberTable {
  ElementTypes types;
  const void* values;
  std::size_t rows, columns;
};

/// Writes a dataset with the attribute `units`; one column makes a one-dimensional dataset.
void write_array(Place place, const char* name, const char* units, const NumberTable& table);
template <class T>
void write_array(Place place, const char* name, const char* units, const std::vector<T>& values) {
  write_array(place, name, units, NumberTable{element_types(values.data()), values.data(), values.size(), 1});
}
template <class T, std::size_t N>
void write_array(Place place, const char* name, const char* units,
                 const std::vector<std::array<T, N>>& values) {
  write_array(place, name, units,
              NumberTable{element_types(static_cast<const T*>(nullptr)), values.data(), values.size(), N});
}

/// Texts, with the attribute `units` = "1".
void write_names(Place place, const char* name, const std::vector<std::string>& values);
Hdf5Object create_group(Place place, const std::string& name);

/// Closing is when a full disk shows.
void close_file(Hdf5Object& file, const std::string& path);

}  // namespace talus::io::detail
