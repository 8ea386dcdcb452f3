#pragma once

/// The pieces of FCLIB's HDF5 layout: numbers and sparse matrices, checked as they are read.

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "io/files/detail/hdf5.hpp"
#include "kernels/delassus/delassus.hpp"

namespace talus::io::detail {

/// Throws FileError: the file's content makes no sense.
[[noreturn]] void damaged(const std::string& path, const std::string& problem);

/// Opens with H5F_ACC_RDONLY or H5F_ACC_RDWR and without file locks: problems often stand on read-only or
/// network file systems.
Hdf5Object open_file(const std::string& path, unsigned mode);

/// Whether every part of a path such as /a/b/c is there.
bool exists(hid_t file, const std::string& name);

/// Datasets as flat arrays; they throw FileError that names the dataset, index and value.
std::vector<std::int64_t> read_integers(hid_t file, const std::string& path, const std::string& name);
std::int64_t read_integer(hid_t file, const std::string& path, const std::string& name);
std::vector<double> read_reals(hid_t file, const std::string& path, const std::string& name);

void demand_size(const std::string& path, const std::string& name, std::size_t size, std::size_t expected,
                 const char* reason);

struct SparseMatrix {
  std::int64_t rows = 0, columns = 0;
  std::vector<MatrixEntry> entries;
};

/// The matrix group `name` ("/fclib_local/W"), in any of its storages: `nz` is -1 for compressed columns, -2
/// for compressed rows and a number of triplets otherwise, of which, as in CSparse and against the comment in
/// fclib.h, i holds the rows and p the columns. nzmax is room, not a number of entries.
SparseMatrix read_matrix(hid_t file, const std::string& path, const std::string& name);

/// One dataset in the group `place`.
void write_values(hid_t place, const std::string& path, const char* name, std::span<const double> values);
void write_values(hid_t place, const std::string& path, const char* name, std::span<const int> values);
void write_text(hid_t place, const std::string& path, const char* name, const std::string& text);

/// W as compressed rows with complete blocks, as Siconos writes it.
void write_matrix(hid_t place, const std::string& path, const DelassusProblem& problem);

}  // namespace talus::io::detail
