#include "io/fclib.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <system_error>
#include <vector>

#include "io/detail/hdf5.hpp"
#include "io/error.hpp"

namespace talus::io {
namespace {

using detail::demand;
using detail::Hdf5Object;
using detail::hold;

const std::string group = "/fclib_local";

[[noreturn]] void damaged(const std::string& path, const std::string& problem) {
  throw FileError(path, problem + "; the file is damaged or was not written by FCLIB: write it again");
}

/// Access without file locks: problems often stand on read-only or network file systems.
Hdf5Object open_file(const std::string& path, unsigned mode) {
  const Hdf5Object access = hold(H5Pcreate(H5P_FILE_ACCESS), H5Pclose, path, "preparing HDF5");
  demand(H5Pset_file_locking(access.id(), false, true), path, "preparing HDF5");
  return hold(H5Fopen(path.c_str(), mode, access.id()), H5Fclose, path, "opening as HDF5");
}

/// Whether every part of a path such as /a/b/c is there. (H5Lexists fails when an inner part is missing.)
bool exists(hid_t file, const std::string& name) {
  for (std::size_t end = name.find('/', 1);; end = name.find('/', end + 1)) {
    if (H5Lexists(file, name.substr(0, end).c_str(), H5P_DEFAULT) <= 0) return false;
    if (end == std::string::npos) return true;
  }
}

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
  // A damaged extent must not become memory: no dataset is larger than the file, nor packed tighter than
  // deflate can (1032 to 1).
  const double stored = static_cast<double>(H5Dget_storage_size(dataset.id()));
  const double claimed = static_cast<double>(size) * static_cast<double>(H5Tget_size(type.id()));
  if (stored > static_cast<double>(std::filesystem::file_size(path)) || claimed > 1032 * stored)
    damaged(path, fmt::format("{} claims {} values, more than the file holds", name, size));
  std::vector<T> values(static_cast<std::size_t>(size));
  if (size > 0)
    demand(H5Dread(dataset.id(), memory_type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), path, action);
  return values;
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

/// The matrix group W as scalar entries. `nz` tells the storage: -1 compressed columns, -2 compressed rows,
/// >= 0 triplets of which, as in CSparse and against the comment in fclib.h, i holds the rows and p the
/// columns. nzmax is room, not a number of entries.
std::vector<MatrixEntry> read_matrix(hid_t file, const std::string& path, std::int64_t rows) {
  const std::string name = group + "/W/";
  const std::int64_t nz = read_integer(file, path, name + "nz");
  const auto p = read_integers(file, path, name + "p");
  const auto i = read_integers(file, path, name + "i");
  const auto x = read_reals(file, path, name + "x");
  const auto demand_index = [&](const char* array, std::size_t k, std::int64_t value) {
    if (value < 0 || value >= rows)
      damaged(path,
              fmt::format("{}{}[{}] is {}, outside the {} x {} matrix", name, array, k, value, rows, rows));
  };

  std::vector<MatrixEntry> entries;
  if (nz >= 0) {
    const auto count = static_cast<std::size_t>(nz);
    for (const auto& [array, size] : {std::pair("p", p.size()), {"i", i.size()}, {"x", x.size()}})
      if (size < count)
        damaged(path, fmt::format("{}{} has {} values, fewer than nz = {}", name, array, size, nz));
    entries.reserve(count);
    for (std::size_t k = 0; k < count; ++k) {
      demand_index("i", k, i[k]);
      demand_index("p", k, p[k]);
      entries.push_back({i[k], p[k], x[k]});
    }
    return entries;
  }

  if (nz != -1 && nz != -2)
    damaged(path, fmt::format("{}nz is {}, but only -2 (compressed rows), -1 (compressed columns) and "
                              "numbers of triplets are known",
                              name, nz));
  demand_size(path, name + "p", p.size(), static_cast<std::size_t>(rows) + 1,
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
      demand_index("i", k, i[k]);
      const auto outer = static_cast<std::int64_t>(line);
      entries.push_back(nz == -2 ? MatrixEntry{outer, i[k], x[k]} : MatrixEntry{i[k], outer, x[k]});
    }
  }
  return entries;
}

/// What a file without /fclib_local may be instead.
[[noreturn]] void refuse_foreign(hid_t file, const std::string& path) {
  if (exists(file, "/fclib_global"))
    throw FileError(path,
                    "holds a global problem (M, H); condense it first: W = H' M^-1 H, q = w + H' M^-1 f");
  for (const char* rolling : {"/fclib_global_rolling", "/fclib_local_rolling"})
    if (exists(file, rolling))
      throw FileError(path, "holds a problem with rolling friction; only Coulomb friction is solved");
  throw FileError(
      path, "has no group /fclib_local: it is not an FCLIB problem; give a file that FCLIB has written");
}

void refuse_unsolved_kinds(hid_t file, const std::string& path) {
  const std::int64_t dimension = read_integer(file, path, group + "/spacedim");
  if (dimension == 2) throw FileError(path, "holds a problem of 2 dimensions; only those of 3 are solved");
  if (dimension != 3) damaged(path, fmt::format("{}/spacedim is {} instead of 3", group, dimension));
  for (const char* mixed : {"/V", "/R", "/vectors/s"})
    if (exists(file, group + mixed))
      throw FileError(
          path, fmt::format("holds {}{}, the mixed part with equality constraints; eliminate them first",
                            group, mixed));
}

void write_values(hid_t place, const std::string& path, const char* name, std::span<const double> values) {
  const std::string action = fmt::format("writing /solution/{}", name);
  const hsize_t size = values.size();
  const Hdf5Object space = hold(H5Screate_simple(1, &size, nullptr), H5Sclose, path, action);
  const Hdf5Object dataset =
      hold(H5Dcreate2(place, name, H5T_IEEE_F64LE, space.id(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT),
           H5Dclose, path, action);
  demand(H5Dwrite(dataset.id(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), path,
         action);
}

/// A file that is deleted unless it has been moved to its place.
class Draft {
 public:
  explicit Draft(std::filesystem::path path) : path_(std::move(path)) {}
  Draft(const Draft&) = delete;
  Draft& operator=(const Draft&) = delete;
  ~Draft() {
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
  }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace

DelassusProblem read_fclib(const std::filesystem::path& path) {
  const std::string name = path.string();
  std::error_code error;
  if (!std::filesystem::exists(path, error)) throw FileError(name, "does not exist; check the path");
  if (!std::filesystem::is_regular_file(path, error))
    throw FileError(name, "is not a file; give an FCLIB problem (.hdf5)");

  const detail::QuietHdf5 quiet;
  const Hdf5Object file = open_file(name, H5F_ACC_RDONLY);
  if (!exists(file.id(), group)) refuse_foreign(file.id(), name);
  refuse_unsolved_kinds(file.id(), name);

  const std::int64_t rows = read_integer(file.id(), name, group + "/W/m");
  const std::int64_t columns = read_integer(file.id(), name, group + "/W/n");
  if (rows != columns || rows % 3 != 0 || rows < 0 || rows / 3 > std::numeric_limits<std::int32_t>::max())
    damaged(name,
            fmt::format("{}/W is {} x {}; it must be square with 3 rows a contact", group, rows, columns));

  const auto q = read_reals(file.id(), name, group + "/vectors/q");
  const auto mu = read_reals(file.id(), name, group + "/vectors/mu");
  const auto contacts = static_cast<std::size_t>(rows / 3);
  demand_size(name, group + "/vectors/q", q.size(), 3 * contacts, "one for each row of W");
  demand_size(name, group + "/vectors/mu", mu.size(), contacts, "one for each contact");
  for (std::size_t c = 0; c < contacts; ++c)
    if (mu[c] < 0) damaged(name, fmt::format("{}/vectors/mu[{}] is {}, below 0", group, c, mu[c]));
  return assemble_delassus(read_matrix(file.id(), name, rows), q, mu);
}

void check_fclib_output(const std::filesystem::path& input, const std::filesystem::path& out) {
  std::error_code error;
  if (std::filesystem::equivalent(input, out, error))
    throw FileError(out.string(), "is the problem itself and would be overwritten; give --out another name");
  if (std::filesystem::is_directory(out, error))
    throw FileError(out.string(), "is a folder; give --out the name of a file");
  const auto folder = std::filesystem::absolute(out).parent_path();
  if (!std::filesystem::is_directory(folder, error))
    throw FileError(out.string(),
                    fmt::format("cannot be written, there is no folder {}; make it first", folder.string()));
}

void write_fclib_solution(const std::filesystem::path& input, const std::filesystem::path& out,
                          std::span<const double> r, std::span<const double> u) {
  check_fclib_output(input, out);
  // The process id keeps two runs with the same --out from writing into each other's draft.
  const Draft draft(std::filesystem::path(out).concat(fmt::format(".{}.part", ::getpid())));
  const std::string name = draft.path().string();
  try {
    std::filesystem::copy_file(input, draft.path(), std::filesystem::copy_options::overwrite_existing);
    // Problems are often read-only, and a copy keeps that.
    std::filesystem::permissions(draft.path(), std::filesystem::perms::owner_write,
                                 std::filesystem::perm_options::add);
    const detail::QuietHdf5 quiet;
    Hdf5Object file = open_file(name, H5F_ACC_RDWR);
    if (exists(file.id(), "/solution"))
      demand(H5Ldelete(file.id(), "/solution", H5P_DEFAULT), name, "removing the old /solution");
    {
      const Hdf5Object solution =
          hold(H5Gcreate2(file.id(), "/solution", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Gclose, name,
               "making /solution");
      write_values(solution.id(), name, "r", r);
      write_values(solution.id(), name, "u", u);
    }
    demand(H5Fclose(file.release()), name, "completing the file");
    std::filesystem::rename(draft.path(), out);
  } catch (const std::filesystem::filesystem_error& failure) {
    throw FileError(out.string(), fmt::format("cannot be written: {}; check the folder's rights and room",
                                              failure.code().message()));
  }
}

}  // namespace talus::io
