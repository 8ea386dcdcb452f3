#include "io/results/results.hpp"

#include <fmt/format.h>

#include <exception>
#include <optional>
#include <span>
#include <stdexcept>

#include "io/files/detail/hdf5_read.hpp"
#include "io/files/detail/hdf5_write.hpp"
#include "io/files/error.hpp"
#include "io/results/detail/directory_undo.hpp"
#include "io/results/version.hpp"
#include "runtime/graph/one_rank.hpp"

namespace talus::io {
namespace {

using detail::close_file;
using detail::create_group;
using detail::demand;
using detail::element_types;
using detail::file_access;
using detail::Hdf5Object;
using detail::hold;
using detail::Place;
using detail::write_attribute;
using detail::write_names;

constexpr std::int64_t format_version = 1;

static_assert(sizeof(Vec3) == 3 * sizeof(double), "a vector of Vec3 is written as an n x 3 array");

std::string frame_name(std::size_t index) {
  return fmt::format("{:06}", index);
}

/// The rows of this rank among those of all.
struct Rows {
  std::size_t begin, all;
};

/// How the rows of the ranks come into one file.
struct Sharing {
  const graph::Communicator& ranks;
  SharedWriting way;

  bool several() const { return ranks.ranks() > 1; }
  bool together() const { return several() && way == SharedWriting::parallel; }
  /// This rank has the file open.
  bool writes() const { return together() || ranks.rank() == 0; }
};

/// Runs `work` on this rank; when it fails on any of those that write together, all throw: none waits for
/// another in HDF5's collective calls.
template <class Work>
void in_step(const Sharing& sharing, const std::string& file, const Work& work) {
  if (!sharing.together()) {
    work();
    return;
  }
  std::exception_ptr failure;
  try {
    work();
  } catch (...) {
    failure = std::current_exception();
  }
  double failed[1] = {failure ? 1.0 : 0.0};
  sharing.ranks.max(failed);
  if (failure) std::rethrow_exception(failure);
  if (failed[0] > 0) throw FileError(file, "another rank could not write its part");
}

/// A dataset of `rows` x columns numbers; one column makes a one-dimensional dataset.
Hdf5Object create_array(Place place, const char* name, const char* units, hid_t type, std::size_t rows,
                        std::size_t columns) {
  const std::string action = fmt::format("writing '{}'", name);
  const hsize_t extent[2] = {rows, columns};
  const Hdf5Object space =
      hold(H5Screate_simple(columns == 1 ? 1 : 2, extent, nullptr), H5Sclose, place.file, action);
  const Hdf5Object creation = hold(H5Pcreate(H5P_DATASET_CREATE), H5Pclose, place.file, action);
  // Every number is written: no need to fill the file with zeros first.
  demand(H5Pset_fill_time(creation.id(), H5D_FILL_TIME_NEVER), place.file, action);
  Hdf5Object dataset =
      hold(H5Dcreate2(place.group, name, type, space.id(), H5P_DEFAULT, creation.id(), H5P_DEFAULT), H5Dclose,
           place.file, action);
  write_attribute({dataset.id(), place.file}, "units", std::string(units));
  return dataset;
}

/// Writes rows of a dataset from `begin` on: whole ones, of so many `columns`, one after the other.
template <class T>
void write_rows(hid_t dataset, Place place, const char* name, std::span<const T> values, std::size_t begin,
                std::size_t columns) {
  if (values.empty()) return;
  const std::string action = fmt::format("writing '{}'", name);
  const int dimensions = columns == 1 ? 1 : 2;
  const hsize_t start[2] = {begin, 0}, count[2] = {values.size() / columns, columns};
  const Hdf5Object there = hold(H5Dget_space(dataset), H5Sclose, place.file, action);
  const Hdf5Object here = hold(H5Screate_simple(dimensions, count, nullptr), H5Sclose, place.file, action);
  demand(H5Sselect_hyperslab(there.id(), H5S_SELECT_SET, start, nullptr, count, nullptr), place.file, action);
  demand(H5Dwrite(dataset, element_types(values.data()).memory, here.id(), there.id(), H5P_DEFAULT,
                  values.data()),
         place.file, action);
}

/// Writes the arrays of one group. Each rank writes one run of rows, so that nothing is won by collecting
/// them in few ranks first: transfers are independent.
class ArrayWriter {
 public:
  ArrayWriter(const Sharing& sharing, Place place, Rows rows)
      : sharing_(sharing), place_(place), rows_(rows) {}

  template <class T>
  void operator()(const char* name, const char* units, const T* values, std::size_t rows,
                  std::size_t columns) const {
    std::optional<Hdf5Object> dataset;
    if (sharing_.writes())
      dataset.emplace(create_array(place_, name, units, element_types(values).file, rows_.all, columns));
    if (!sharing_.several() || sharing_.together()) {
      in_step(sharing_, place_.file, [&] {
        write_rows(dataset->id(), place_, name, std::span(values, rows * columns), rows_.begin, columns);
      });
      return;
    }
    std::size_t begin = 0;  // a piece may end within a row: the rest waits
    std::vector<T> rest;
    sharing_.ranks.records_to_first(std::span(values, rows * columns), [&](std::span<const T> numbers) {
      rest.insert(rest.end(), numbers.begin(), numbers.end());
      const std::size_t whole = rest.size() / columns;
      write_rows(dataset->id(), place_, name, std::span<const T>(rest.data(), whole * columns), begin,
                 columns);
      begin += whole;
      rest.erase(rest.begin(), rest.begin() + static_cast<std::ptrdiff_t>(whole * columns));
    });
  }
  void operator()(const char* name, const char* units, const std::vector<Vec3>& values) const {
    (*this)(name, units, reinterpret_cast<const double*>(values.data()), values.size(), 3);
  }
  template <class T>
  void operator()(const char* name, const char* units, const std::vector<T>& values) const {
    (*this)(name, units, values.data(), values.size(), 1);
  }
  template <class T, std::size_t N>
  void operator()(const char* name, const char* units, const std::vector<std::array<T, N>>& values) const {
    (*this)(name, units, reinterpret_cast<const T*>(values.data()), values.size(), N);
  }

 private:
  const Sharing& sharing_;
  Place place_;
  Rows rows_;
};

/// Arrays that a frame may have, on any rank.
struct OptionalArrays {
  bool omega, orientation, material;
};

void write_bodies(const ArrayWriter& write, const Frame& part, const OptionalArrays& has) {
  write("id", "1", part.id);
  write("x", "m", part.x);
  write("radius", "m", part.radius);
  write("u", "m/s", part.u);
  if (has.omega) write("omega", "rad/s", part.omega);
  if (has.orientation) write("orientation", "1", part.orientation);
  if (has.material) write("material", "1", part.material);
}

void write_contacts(const ArrayWriter& write, const Frame& part) {
  write("bodies", "1", part.contact_bodies);
  write("point", "m", part.contact_point);
  write("normal", "1", part.contact_normal);
  write("gap", "m", part.contact_gap);
  write("force", "N", part.contact_force);
}

/// Every rank knows all walls; the first writes them.
void write_walls(const Sharing& sharing, Place place, const Frame& frame) {
  std::vector<double> position, velocity;
  std::vector<Vec3> force;
  if (sharing.ranks.rank() == 0)
    for (const WallReport& wall : frame.walls) {
      position.push_back(wall.position);
      velocity.push_back(wall.velocity);
      force.push_back(wall.force);
    }
  const ArrayWriter write(sharing, place, {0, frame.walls.size()});
  write("position", "m", position);
  write("velocity", "m/s", velocity);
  write("force", "N", force);
}

void demand_same_length(std::size_t length, std::size_t expected, const char* name) {
  if (length != expected) {
    throw std::invalid_argument(fmt::format("frame: {} has {} entries, expected {}", name, length, expected));
  }
}

}  // namespace

void validate(const Frame& frame) {
  const std::size_t bodies = frame.id.size();
  demand_same_length(frame.x.size(), bodies, "x");
  demand_same_length(frame.radius.size(), bodies, "radius");
  demand_same_length(frame.u.size(), bodies, "u");
  if (!frame.omega.empty()) demand_same_length(frame.omega.size(), bodies, "omega");
  if (!frame.orientation.empty()) demand_same_length(frame.orientation.size(), bodies, "orientation");
  if (!frame.material.empty()) demand_same_length(frame.material.size(), bodies, "material");
  const std::size_t contacts = frame.contact_bodies.size();
  demand_same_length(frame.contact_point.size(), contacts, "contact_point");
  demand_same_length(frame.contact_normal.size(), contacts, "contact_normal");
  demand_same_length(frame.contact_gap.size(), contacts, "contact_gap");
  demand_same_length(frame.contact_force.size(), contacts, "contact_force");
}

namespace {

/// Removes the frames behind the first `kept`. Their room in the file is taken by those that follow, or
/// given back, as far as they were its last.
void cut_frames(const std::string& path, std::size_t kept) {
  const detail::QuietHdf5 quiet;
  detail::bring_back_directory(path);
  detail::keep_directory(path);
  const Hdf5Object access = file_access(path, false);
  Hdf5Object file =
      hold(H5Fopen(path.c_str(), H5F_ACC_RDWR, access.id()), H5Fclose, path, "opening the file");
  {
    const Place root{file.id(), path};
    std::vector<std::string> names = detail::names_in(root, "frames");
    if (names.size() < kept)
      throw FileError(path, fmt::format("has {} frames, of {} that the checkpoint knows; begin anew in "
                                        "another directory",
                                        names.size(), kept));
    for (; names.size() > kept; names.pop_back())
      demand(H5Ldelete(file.id(), ("/frames/" + names.back()).c_str(), H5P_DEFAULT), path,
             "removing frame " + names.back());
  }
  close_file(file, path);
  detail::drop_directory(path);
}

}  // namespace

SharedWriting shared_writing() {
#ifdef H5_HAVE_PARALLEL
  return SharedWriting::parallel;
#else
  return SharedWriting::gathered;
#endif
}

ResultsWriter::ResultsWriter(const std::filesystem::path& path, const std::vector<std::string>& wall_names)
    : ResultsWriter(path, wall_names, graph::one_rank()) {}

ResultsWriter::ResultsWriter(const std::filesystem::path& path, const std::vector<std::string>& wall_names,
                             const graph::Communicator& ranks, SharedWriting way,
                             std::optional<std::size_t> kept)
    : path_(path.string()), wall_names_(wall_names), ranks_(ranks), way_(way), frames_(kept.value_or(0)) {
  if (ranks.rank() == 0 && kept) {
    cut_frames(path_, *kept);
  } else if (ranks.rank() == 0) {
    const detail::QuietHdf5 quiet;
    const Hdf5Object access = file_access(path_, false);
    Hdf5Object file = hold(H5Fcreate(path_.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access.id()), H5Fclose, path_,
                           "creating the file");
    {
      const Place root{file.id(), path_};
      write_attribute(root, "format", std::string("talus-results"));
      write_attribute(root, "format_version", format_version);
      write_attribute(root, "talus_version", version());
      create_group(root, "frames");
      const Hdf5Object walls = create_group(root, "walls");
      write_names({walls.id(), path_}, "name", wall_names_);
    }
    close_file(file, path_);
  }
  double there[1] = {1};  // the others open it when it is
  ranks.max(there);
}

/// Numbers that a rank tells of its part of a frame.
constexpr std::size_t row_counts = 5;

void ResultsWriter::append(const Frame& part) {
  validate(part);
  demand_same_length(part.walls.size(), wall_names_.size(), "walls");
  for (std::size_t k = 0; k < wall_names_.size(); ++k) {
    if (part.walls[k].name != wall_names_[k]) {
      throw std::invalid_argument(
          fmt::format("frame: wall {} is '{}', expected '{}'", k, part.walls[k].name, wall_names_[k]));
    }
  }
  // Rows of each rank, and whether they have the optional arrays: a rank may have no body.
  const std::int64_t own[row_counts] = {
      static_cast<std::int64_t>(part.id.size()), static_cast<std::int64_t>(part.contact_bodies.size()),
      !part.omega.empty(), !part.orientation.empty(), !part.material.empty()};
  if (ranks_.rank() == 0) detail::keep_directory(path_);
  const std::vector<std::int64_t> rows = ranks_.gather_records(std::span<const std::int64_t>(own));
  append_here(part, rows);
  if (ranks_.rank() == 0) detail::drop_directory(path_);
  ++frames_;
}

void ResultsWriter::append_here(const Frame& part, std::span<const std::int64_t> rows) {
  const Sharing sharing{ranks_, way_};
  const auto rows_of = [&](std::size_t column) {
    Rows result{0, 0};
    for (std::size_t r = 0; row_counts * r < rows.size(); ++r) {
      if (r == static_cast<std::size_t>(ranks_.rank())) result.begin = result.all;
      result.all += static_cast<std::size_t>(rows[row_counts * r + column]);
    }
    return result;
  };
  const auto write_frame = [&](const auto& group) {
    const OptionalArrays has{rows_of(2).all > 0, rows_of(3).all > 0, rows_of(4).all > 0};
    write_bodies(ArrayWriter(sharing, group("bodies"), rows_of(0)), part, has);
    write_contacts(ArrayWriter(sharing, group("contacts"), rows_of(1)), part);
    write_walls(sharing, group("walls"), part);
  };
  if (!sharing.writes()) {
    write_frame([&](const char*) { return Place{H5I_INVALID_HID, path_}; });
    return;
  }
  const detail::QuietHdf5 quiet;
  const Hdf5Object access = file_access(path_, sharing.together());
  std::optional<Hdf5Object> opened;
  in_step(sharing, path_, [&] {
    opened.emplace(
        hold(H5Fopen(path_.c_str(), H5F_ACC_RDWR, access.id()), H5Fclose, path_, "opening the file"));
  });
  Hdf5Object& file = *opened;
  {
    // Nameless until it is complete: what stops half way leaves no half frame behind.
    const Hdf5Object group =
        hold(H5Gcreate_anon(file.id(), H5P_DEFAULT, H5P_DEFAULT), H5Gclose, path_, "creating a frame");
    const Place place{group.id(), path_};
    write_attribute(place, "step", part.step);
    write_attribute(place, "time", part.time);
    write_attribute(place, "stage", part.stage);
    std::vector<Hdf5Object> groups;
    write_frame([&](const char* name) {
      groups.push_back(create_group(place, name));
      return Place{groups.back().id(), path_};
    });
    groups.clear();
    // All of it on its way to the disk before its name is, or a kill in between could leave a name of
    // nothing.
    in_step(sharing, path_, [&] { demand(H5Fflush(file.id(), H5F_SCOPE_LOCAL), path_, "writing to disk"); });
    const std::string name = "/frames/" + frame_name(frames_);
    demand(H5Olink(group.id(), file.id(), name.c_str(), H5P_DEFAULT, H5P_DEFAULT), path_,
           "naming frame " + name);
  }
  in_step(sharing, path_, [&] { close_file(file, path_); });
}

}  // namespace talus::io
