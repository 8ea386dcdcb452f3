#pragma once

/// Attributes and arrays of files as they are read. All throw FileError, which says what is missing or of a
/// wrong shape.

#include <string>
#include <vector>

#include "io/files/detail/hdf5.hpp"
#include "io/files/detail/hdf5_write.hpp"

namespace talus::io::detail {

/// Opens a file for reading, without locking it.
Hdf5Object open_file(const std::string& path);

/// The same for a file that was written with `checked_file_access`. Throws FileError for another one, before
/// HDF5 looks at what is in it.
Hdf5Object open_checked_file(const std::string& path);

/// Whether the file holds as many elements of the dataset. One that is compressed is packed by deflate, at
/// most 1032 to 1. HDF5 itself does not compare: it reads behind the end of a dataset that stands in its
/// header.
bool is_stored(hid_t dataset, hsize_t elements, const std::string& path, const std::string& name);

/// Length of the first dimension, after a check of the others: `columns` numbers a row. Throws FileError also
/// where the rows are more than the file can hold, so that a damaged length does not become memory.
std::size_t row_count(hid_t dataset, std::size_t columns, const std::string& path, const std::string& name);

/// Entries of the dataset `name`, `columns` elements of `memory_type` each, as many as T holds.
template <class T>
std::vector<T> read_array(Place place, const std::string& name, hid_t memory_type, std::size_t columns) {
  const Hdf5Object dataset =
      hold(H5Dopen2(place.group, name.c_str(), H5P_DEFAULT), H5Dclose, place.file, "opening " + name);
  std::vector<T> values(row_count(dataset.id(), columns, place.file, name));
  if (!values.empty())
    demand(H5Dread(dataset.id(), memory_type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), place.file,
           "reading " + name);
  return values;
}
template <class T>
std::vector<T> read_array(Place place, const std::string& name) {
  return read_array<T>(place, name, element_types(static_cast<const T*>(nullptr)).memory, 1);
}

/// Texts of fixed length, as write_names writes them; others are refused.
std::vector<std::string> read_names(Place place, const std::string& name);
/// Of one value.
void read_attribute(Place place, const char* name, hid_t type, void* value);
/// The text of an attribute; "" when there is none of that name.
std::string read_text(Place place, const char* name);
std::int64_t read_integer(Place place, const char* name);

/// Names in a group, in their order.
std::vector<std::string> names_in(Place place, const std::string& group);

}  // namespace talus::io::detail
