#include "io/fclib/detail/fclib_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "io/files/detail/hdf5_read.hpp"
#include "io/files/error.hpp"
#include "io/files/output_directory.hpp"

namespace talus::io::detail {
namespace {

/// A dataset of numbers as a flat array; `type_class` is H5T_INTEGER or H5T_FLOAT.
template <class T>
std::vector<T> read_values(hid_t file, const std::string& path, const std::string& name,
                           H5T_class_t type_class, hid_t memory_type) {
  if (!exists(file, name)) damaged(path, name + " is missing");
  const std::string action = "reading " + name;
  const Hdf5Object dataset = hold(H5Dopen2(file, name.c_str(), H5P_DEFAULT), H5Dclose, path, action);
  const Hdf5Object type = hold(H5Dget_type(dataset.id()), H5Tclose, path, action);
  if (H5Tget_class(type.id()) != type_class)
    damaged(path, fmt::format("{} does not hold {}", name,
                              type_class == H5T_INTEGER ? "integers" : "real numbers"));
  const Hdf5Object space = hold(H5Dget_space(dataset.id()), H5Sclose, path, action);
  const hssize_t size = H5Sget_simple_extent_npoints(space.id());
  demand(size, path, action);
  if (!is_stored(dataset.id(), static_cast<hsize_t>(size), path, name))  // or it would become memory
    damaged(path, fmt::format("{} claims {} values, more than the file holds", name, size));
  std::vector<T> values(static_cast<std::size_t>(size));
  if (size > 0)
    demand(H5Dread(dataset.id(), memory_type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), path, action);
  return values;
}

template <class T>
void write_numbers(hid_t place, const std::string& path, const char* name, std::span<const T> values,
                   hid_t file_type, hid_t memory_type) {
  const std::string action = fmt::format("writing {}", name);
  const hsize_t size = values.size();
  const Hdf5Object space = hold(H5Screate_simple(1, &size, nullptr), H5Sclose, path, action);
  const Hdf5Object dataset =
      hold(H5Dcreate2(place, name, file_type, space.id(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Dclose,
           path, action);
  if (size > 0)
    demand(H5Dwrite(dataset.id(), memory_type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), path, action);
}

}  // namespace

[[noreturn]] void damaged(const std::string& path, const std::string& problem) {
  throw FileError(path, problem + "; the file is damaged or was not written by FCLIB: write it again");
}

Hdf5Object open_file(const std::string& path, unsigned mode) {
  const Hdf5Object access = hold(H5Pcreate(H5P_FILE_ACCESS), H5Pclose, path, "preparing HDF5");
  demand(H5Pset_file_locking(access.id(), false, true), path, "preparing HDF5");
  return hold(H5Fopen(path.c_str(), mode, access.id()), H5Fclose, path, "opening as HDF5");
}

// H5Lexists fails when an inner part of the path is missing, so each part is asked for.
bool exists(hid_t file, const std::string& name) {
  for (std::size_t end = name.find('/', 1);; end = name.find('/', end + 1)) {
    if (H5Lexists(file, name.substr(0, end).c_str(), H5P_DEFAULT) <= 0) return false;
    if (end == std::string::npos) return true;
  }
}

std::vector<std::int64_t> read_integers(hid_t file, const std::string& path, const std::string& name) {
  return read_values<std::int64_t>(file, path, name, H5T_INTEGER, H5T_NATIVE_INT64);
}

std::int64_t read_integer(hid_t file, const std::string& path, const std::string& name) {
  const auto values = read_integers(file, path, name);
  if (values.size() != 1) damaged(path, fmt::format("{} holds {} values instead of 1", name, values.size()));
  return values[0];
}

std::vector<double> read_reals(hid_t file, const std::string& path, const std::string& name) {
  auto values = read_values<double>(file, path, name, H5T_FLOAT, H5T_NATIVE_DOUBLE);
  for (std::size_t k = 0; k < values.size(); ++k)
    if (!std::isfinite(values[k])) damaged(path, fmt::format("{}[{}] is {}", name, k, values[k]));
  return values;
}

void demand_size(const std::string& path, const std::string& name, std::size_t size, std::size_t expected,
                 const char* reason) {
  if (size != expected)
    damaged(path, fmt::format("{} has {} values instead of {} ({})", name, size, expected, reason));
}

SparseMatrix read_matrix(hid_t file, const std::string& path, const std::string& group) {
  const std::string name = group + "/";
  const std::int64_t rows = read_integer(file, path, name + "m");
  const std::int64_t columns = read_integer(file, path, name + "n");
  if (rows < 0 || columns < 0 || std::max(rows, columns) > std::numeric_limits<std::int32_t>::max())
    damaged(path, fmt::format("{} is {} x {}", group, rows, columns));
  const std::int64_t nz = read_integer(file, path, name + "nz");
  const auto p = read_integers(file, path, name + "p");
  const auto i = read_integers(file, path, name + "i");
  const auto x = read_reals(file, path, name + "x");
  const auto demand_index = [&](const char* array, std::size_t k, std::int64_t value, std::int64_t end) {
    if (value < 0 || value >= end)
      damaged(path, fmt::format("{}{}[{}] is {}, outside the {} x {} matrix", name, array, k, value, rows,
                                columns));
  };

  std::vector<MatrixEntry> entries;
  if (nz >= 0) {
    const auto count = static_cast<std::size_t>(nz);
    for (const auto& [array, size] : {std::pair("p", p.size()), {"i", i.size()}, {"x", x.size()}})
      if (size < count)
        damaged(path, fmt::format("{}{} has {} values, fewer than nz = {}", name, array, size, nz));
    entries.reserve(count);
    for (std::size_t k = 0; k < count; ++k) {
      demand_index("i", k, i[k], rows);
      demand_index("p", k, p[k], columns);
      entries.push_back({i[k], p[k], x[k]});
    }
    return {rows, columns, std::move(entries)};
  }

  if (nz != -1 && nz != -2)
    damaged(path, fmt::format("{}nz is {}, but only -2 (compressed rows), -1 (compressed columns) and "
                              "numbers of triplets are known",
                              name, nz));
  demand_size(path, name + "p", p.size(), static_cast<std::size_t>(nz == -2 ? rows : columns) + 1,
              "one more than rows or columns");
  if (p[0] != 0) damaged(path, fmt::format("{}p[0] is {} instead of 0", name, p[0]));
  for (std::size_t line = 0; line + 1 < p.size(); ++line)
    if (p[line + 1] < p[line])
      damaged(path,
              fmt::format("{}p[{}] is {}, less than the {} before it", name, line + 1, p[line + 1], p[line]));
  const auto stored = static_cast<std::int64_t>(std::min(i.size(), x.size()));
  if (p.back() > stored)
    damaged(path,
            fmt::format("{0}p ends with {1}, but {0}i and {0}x hold {2} values", name, p.back(), stored));
  entries.reserve(static_cast<std::size_t>(p.back()));
  for (std::size_t line = 0; line + 1 < p.size(); ++line) {
    for (auto k = static_cast<std::size_t>(p[line]); k < static_cast<std::size_t>(p[line + 1]); ++k) {
      demand_index("i", k, i[k], nz == -2 ? columns : rows);
      const auto outer = static_cast<std::int64_t>(line);
      entries.push_back(nz == -2 ? MatrixEntry{outer, i[k], x[k]} : MatrixEntry{i[k], outer, x[k]});
    }
  }
  return {rows, columns, std::move(entries)};
}

void write_values(hid_t place, const std::string& path, const char* name, std::span<const double> values) {
  write_numbers(place, path, name, values, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE);
}

void write_values(hid_t place, const std::string& path, const char* name, std::span<const int> values) {
  write_numbers(place, path, name, values, H5T_STD_I32LE, H5T_NATIVE_INT);
}

void write_text(hid_t place, const std::string& path, const char* name, const std::string& text) {
  // Of fixed length and null-terminated, in a scalar dataspace: what fclib's H5LTread_dataset_string expects.
  const std::string action = fmt::format("writing {}", name);
  const Hdf5Object type = hold(H5Tcopy(H5T_C_S1), H5Tclose, path, action);
  demand(H5Tset_size(type.id(), text.size() + 1), path, action);
  const Hdf5Object space = hold(H5Screate(H5S_SCALAR), H5Sclose, path, action);
  const Hdf5Object dataset =
      hold(H5Dcreate2(place, name, type.id(), space.id(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Dclose,
           path, action);
  demand(H5Dwrite(dataset.id(), type.id(), H5S_ALL, H5S_ALL, H5P_DEFAULT, text.c_str()), path, action);
}

void write_matrix(hid_t place, const std::string& path, const DelassusProblem& problem) {
  const auto size = static_cast<std::size_t>(problem.dimension);
  std::vector<int> begin{0}, column;
  std::vector<double> value;
  const std::size_t entries = size * size * (problem.contacts() + problem.column.size());
  if (entries > static_cast<std::size_t>(std::numeric_limits<int>::max()))
    throw FileError(path, fmt::format("cannot hold a W of {} entries: FCLIB counts them in 32 bits; dump a "
                                      "smaller sample, or one without pushed walls",
                                      entries));
  column.reserve(entries);
  value.reserve(entries);
  for (std::size_t a = 0; a < problem.contacts(); ++a) {
    for (std::size_t i = 0; i < size; ++i) {
      const auto row = [&](std::size_t b, const Mat3& block) {
        for (std::size_t j = 0; j < size; ++j) {
          column.push_back(static_cast<int>(size * b + j));
          value.push_back(block(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)));
        }
      };
      bool own = false;
      for (auto k = static_cast<std::size_t>(problem.row_begin[a]);
           k < static_cast<std::size_t>(problem.row_begin[a + 1]); ++k) {
        const auto b = static_cast<std::size_t>(problem.column[k]);
        if (!own && b > a) {
          row(a, problem.diagonal[a].W);
          own = true;
        }
        row(b, problem.block[k]);
      }
      if (!own) row(a, problem.diagonal[a].W);
      begin.push_back(static_cast<int>(column.size()));
    }
  }
  const auto integer = [&](const char* name, std::size_t number) {
    write_values(place, path, name, std::vector<int>{static_cast<int>(number)});
  };
  integer("m", size * problem.contacts());
  integer("n", size * problem.contacts());
  write_values(place, path, "nz", std::vector<int>{-2});
  integer("nzmax", column.size());
  write_values(place, path, "p", begin);
  write_values(place, path, "i", column);
  write_values(place, path, "x", value);
}

}  // namespace talus::io::detail
