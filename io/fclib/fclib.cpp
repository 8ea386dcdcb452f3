#include "io/fclib/fclib.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include "io/fclib/detail/fclib_file.hpp"
#include "io/files/detail/hdf5_read.hpp"
#include "io/files/detail/rehearsal.hpp"
#include "io/files/error.hpp"
#include "io/files/output_directory.hpp"

namespace talus::io {
namespace {

using detail::damaged;
using detail::demand;
using detail::demand_size;
using detail::exists;
using detail::hold;
using detail::read_integer;
using detail::read_reals;

/// What a file without a problem that is solved may be instead.
[[noreturn]] void refuse_foreign(hid_t file, const std::string& path) {
  for (const char* rolling : {"/fclib_global_rolling", "/fclib_local_rolling"})
    if (exists(file, rolling))
      throw FileError(path, "holds a problem with rolling friction; only Coulomb friction is solved");
  throw FileError(path,
                  "has no group /fclib_local or /fclib_global: it is not an FCLIB problem; give a file that "
                  "FCLIB has written");
}

int read_dimension(hid_t file, const std::string& path, const std::string& group) {
  const std::int64_t dimension = read_integer(file, path, group + "/spacedim");
  if (dimension != 2 && dimension != 3)
    damaged(path, fmt::format("{}/spacedim is {} instead of 2 or 3", group, dimension));
  return static_cast<int>(dimension);
}

std::vector<double> read_friction(hid_t file, const std::string& path, const std::string& group,
                                  std::size_t contacts) {
  auto mu = read_reals(file, path, group + "/vectors/mu");
  demand_size(path, group + "/vectors/mu", mu.size(), contacts, "one for each contact");
  for (std::size_t c = 0; c < contacts; ++c)
    if (mu[c] < 0) damaged(path, fmt::format("{}/vectors/mu[{}] is {}, below 0", group, c, mu[c]));
  return mu;
}

constexpr const char* instead_of_problem = "let the program that wrote it write it again";

/// A local problem as its file has it.
struct LocalArrays {
  int dimension = 3;
  detail::SparseMatrix W;
  std::vector<double> q, mu;
};

LocalArrays read_local(hid_t file, const std::string& path) {
  const std::string group = "/fclib_local";
  const int dimension = read_dimension(file, path, group);
  for (const char* mixed : {"/V", "/R", "/vectors/s"})
    if (exists(file, group + mixed))
      throw FileError(
          path, fmt::format("holds {}{}, the mixed part with equality constraints; eliminate them first",
                            group, mixed));
  detail::SparseMatrix W = detail::read_matrix(file, path, group + "/W");
  if (W.rows != W.columns || W.rows % dimension != 0)
    damaged(path, fmt::format("{}/W is {} x {}; it must be square with {} rows a contact", group, W.rows,
                              W.columns, dimension));
  auto q = read_reals(file, path, group + "/vectors/q");
  demand_size(path, group + "/vectors/q", q.size(), static_cast<std::size_t>(W.rows),
              "one for each row of W");
  auto mu = read_friction(file, path, group, static_cast<std::size_t>(W.rows / dimension));
  return {dimension, std::move(W), std::move(q), std::move(mu)};
}

GlobalProblem read_global(hid_t file, const std::string& path) {
  const std::string group = "/fclib_global";
  GlobalProblem p;
  p.dimension = read_dimension(file, path, group);
  detail::SparseMatrix M = detail::read_matrix(file, path, group + "/M");
  detail::SparseMatrix H = detail::read_matrix(file, path, group + "/H");
  if (M.rows != M.columns)
    damaged(path, fmt::format("{}/M is {} x {}, not square", group, M.rows, M.columns));
  if (H.rows != M.rows || H.columns % p.dimension != 0)
    damaged(path, fmt::format("{}/H is {} x {}; it must have the {} rows of M and {} columns a contact",
                              group, H.rows, H.columns, M.rows, p.dimension));
  p.f = read_reals(file, path, group + "/vectors/f");
  p.w = read_reals(file, path, group + "/vectors/w");
  demand_size(path, group + "/vectors/f", p.f.size(), static_cast<std::size_t>(M.rows),
              "one for each row of M");
  demand_size(path, group + "/vectors/w", p.w.size(), static_cast<std::size_t>(H.columns),
              "one for each column of H");
  p.mu = read_friction(file, path, group, static_cast<std::size_t>(H.columns / p.dimension));
  if (exists(file, group + "/G")) {
    detail::SparseMatrix G = detail::read_matrix(file, path, group + "/G");
    if (G.rows != M.rows)
      damaged(path, fmt::format("{}/G has {} rows instead of the {} of M", group, G.rows, M.rows));
    p.b = read_reals(file, path, group + "/vectors/b");
    demand_size(path, group + "/vectors/b", p.b.size(), static_cast<std::size_t>(G.columns),
                "one for each column of G");
    p.G = std::move(G.entries);
  }
  p.M = std::move(M.entries);
  p.H = std::move(H.entries);
  return p;
}

/// What is in a file: one of the two.
struct ProblemArrays {
  std::optional<LocalArrays> local;
  std::optional<GlobalProblem> global;
};

ProblemArrays read_arrays(const std::string& path) {
  const detail::Hdf5Object file = detail::open_file(path, H5F_ACC_RDONLY);
  if (exists(file.id(), "/fclib_local")) return {read_local(file.id(), path), std::nullopt};
  if (exists(file.id(), "/fclib_global")) return {std::nullopt, read_global(file.id(), path)};
  refuse_foreign(file.id(), path);
}

/// Results and traces, which stand beside the problems that a run has dumped. A file that cannot be read is
/// none of them: the function that reads the file next says what is wrong with it.
bool belongs_to_a_run(const std::filesystem::path& path) {
  const detail::QuietHdf5 quiet;
  const std::string name = path.string();
  try {
    return detail::rehearsed(name, instead_of_problem, [&name] {
      const detail::Hdf5Object file = detail::open_file(name, H5F_ACC_RDONLY);
      return detail::read_text({file.id(), name}, "format").starts_with("talus-");
    });
  } catch (const FileError&) {
    return false;
  }
}

/// Makes the group `name` and lets `fill` write into it.
template <class Fill>
void write_group(hid_t place, const std::string& path, const char* name, Fill&& fill) {
  const detail::Hdf5Object group = hold(H5Gcreate2(place, name, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT),
                                        H5Gclose, path, fmt::format("making the group {}", name));
  fill(group.id());
}

void write_solution(hid_t file, const std::string& path, const FclibSolution& solution) {
  write_group(file, path, "solution", [&](hid_t group) {
    if (!solution.v.empty()) detail::write_values(group, path, "v", solution.v);
    detail::write_values(group, path, "u", solution.u);
    detail::write_values(group, path, "r", solution.r);
    if (!solution.l.empty()) detail::write_values(group, path, "l", solution.l);
  });
}

}  // namespace

FclibProblem read_fclib_problem(const std::filesystem::path& path) {
  const std::string name = path.string();
  std::error_code error;
  if (!std::filesystem::exists(path, error)) throw FileError(name, "does not exist; check the path");
  if (!std::filesystem::is_regular_file(path, error))
    throw FileError(name, "is not a file; give an FCLIB problem (.hdf5)");

  const detail::QuietHdf5 quiet;
  ProblemArrays arrays = detail::rehearsed(name, instead_of_problem, [&name] { return read_arrays(name); });
  FclibProblem problem;
  if (arrays.local) {
    const auto& [dimension, W, q, mu] = *arrays.local;
    problem.contact = dimension == 2 ? embed_plane(W.entries, q, mu) : assemble_delassus(W.entries, q, mu);
  } else {
    problem.global = std::move(arrays.global);
    try {
      problem.contact = condense(*problem.global);
    } catch (const std::invalid_argument& failure) {
      damaged(name, failure.what());
    }
  }
  return problem;
}

std::vector<FclibFile> fclib_files(const std::filesystem::path& path) {
  if (!std::filesystem::is_directory(path)) return {{path, path.stem().string()}};
  std::vector<FclibFile> files;
  constexpr auto options = std::filesystem::directory_options::skip_permission_denied;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(path, options)) {
    const auto extension = entry.path().extension();
    if (entry.is_regular_file() && (extension == ".hdf5" || extension == ".h5") &&
        !belongs_to_a_run(entry.path()))
      files.push_back({entry.path(), entry.path().lexically_relative(path).string()});
  }
  if (files.empty())
    throw FileError(path.string(),
                    "holds no FCLIB problem (.hdf5, .h5), nor do the folders in it; give a problem or a "
                    "folder of problems");
  std::ranges::sort(files, {}, &FclibFile::path);
  std::map<std::filesystem::path, int> stems, names;
  for (const FclibFile& file : files) ++stems[file.path.stem()], ++names[file.path.filename()];
  for (FclibFile& file : files) {
    if (stems[file.path.stem()] == 1)
      file.name = file.path.stem().string();
    else if (names[file.path.filename()] == 1)
      file.name = file.path.filename().string();
  }
  return files;
}

DelassusProblem read_fclib(const std::filesystem::path& path) {
  return std::move(read_fclib_problem(path).contact);
}

FclibSolution fclib_solution(const FclibProblem& problem, std::span<const double> r) {
  std::vector<double> u(r.size());
  relative_velocity(problem.contact, r, u);
  FclibSolution solution;
  const bool plane = problem.contact.dimension == 2;
  solution.r = plane ? plane_components(r) : std::vector<double>(r.begin(), r.end());
  solution.u = plane ? plane_components(u) : std::move(u);
  if (problem.global) {
    GlobalVelocity velocity = global_velocity(*problem.global, solution.r);
    solution.v = std::move(velocity.v);
    solution.l = std::move(velocity.l);
  }
  return solution;
}

void write_fclib_solution(const std::filesystem::path& input, const std::filesystem::path& out,
                          const FclibSolution& solution) {
  check_output_files({input}, {out}, true);
  write_by_draft(out, [&](const std::filesystem::path& draft) {
    const detail::QuietHdf5 quiet;
    std::filesystem::copy_file(input, draft, std::filesystem::copy_options::overwrite_existing);
    // Problems are often read-only, and a copy keeps that.
    std::filesystem::permissions(draft, std::filesystem::perms::owner_write,
                                 std::filesystem::perm_options::add);
    const std::string name = draft.string();
    // Writing touches parts of the file that reading the problem did not.
    const auto write = [&] {
      detail::Hdf5Object file = detail::open_file(name, H5F_ACC_RDWR);
      if (exists(file.id(), "/solution"))
        demand(H5Ldelete(file.id(), "/solution", H5P_DEFAULT), name, "removing the old /solution");
      write_solution(file.id(), name, solution);
      demand(H5Fclose(file.release()), name, "completing the file");
    };
    if (!detail::done_in_a_child(name, instead_of_problem, write)) write();
  });
}

void write_fclib(const DelassusProblem& problem, const FclibSolution& solution, const FclibInfo& info,
                 const std::filesystem::path& out) {
  check_output_files({}, {out}, true);
  const auto size = static_cast<std::size_t>(problem.dimension);
  std::vector<double> q, mu;
  for (std::size_t c = 0; c < problem.contacts(); ++c) {
    q.insert(q.end(), problem.q[c].data(), problem.q[c].data() + size);
    mu.push_back(problem.diagonal[c].mu);
  }
  write_by_draft(out, [&](const std::filesystem::path& draft) {
    const detail::QuietHdf5 quiet;
    const std::string name = draft.string();
    detail::Hdf5Object file = hold(H5Fcreate(name.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT), H5Fclose,
                                   name, "making an HDF5 file");
    write_group(file.id(), name, "fclib_local", [&](hid_t local) {
      detail::write_values(local, name, "spacedim", std::vector<int>{problem.dimension});
      write_group(local, name, "W", [&](hid_t W) { detail::write_matrix(W, name, problem); });
      write_group(local, name, "vectors", [&](hid_t vectors) {
        detail::write_values(vectors, name, "q", q);
        detail::write_values(vectors, name, "mu", mu);
      });
      write_group(local, name, "info", [&](hid_t group) {
        detail::write_text(group, name, "title", info.title);
        detail::write_text(group, name, "description", info.description);
        detail::write_text(group, name, "math_info", info.math_info);
      });
    });
    if (!solution.r.empty()) write_solution(file.id(), name, solution);
    demand(H5Fclose(file.release()), name, "completing the file");
  });
}

}  // namespace talus::io
