#include <fmt/format.h>

#include <chrono>
#include <stdexcept>
#include <thread>

#include "io/files/detail/hdf5_read.hpp"
#include "io/files/detail/rehearsal.hpp"
#include "io/files/error.hpp"
#include "io/results/detail/patient_read.hpp"
#include "io/results/results.hpp"
#include "runtime/step/cell_flow.hpp"

namespace talus::io {
namespace {

using detail::demand;
using detail::Hdf5Object;
using detail::hold;
using detail::read_array;
using detail::read_attribute;
using detail::read_names;

Hdf5Object open_results(const std::string& path) {
  Hdf5Object file = detail::open_file(path);
  if (H5Lexists(file.id(), "frames", H5P_DEFAULT) <= 0) {
    throw FileError(path, "has no group /frames; it is not a results.h5 of talus");
  }
  return file;
}

std::size_t count_frames(hid_t file, const std::string& path) {
  H5G_info_t info{};
  demand(H5Gget_info_by_name(file, "frames", &info, H5P_DEFAULT), path, "counting the frames");
  return info.nlinks;
}

template <class T>
constexpr std::size_t numbers_in = sizeof(T) / 8;

template <class T>
std::vector<T> read_doubles(hid_t file, const std::string& path, const std::string& name) {
  return read_array<T>({file, path}, name, H5T_NATIVE_DOUBLE, numbers_in<T>);
}

template <class T>
std::vector<T> read_integers(hid_t file, const std::string& path, const std::string& name) {
  return read_array<T>({file, path}, name, H5T_NATIVE_INT64, numbers_in<T>);
}

/// Throws FileError where an array is not there because the scene said so, by `key` = false.
void demand(const detail::Place& frame, const char* array, const char* key) {
  if (H5Lexists(frame.group, array, H5P_DEFAULT) > 0) return;
  throw FileError(frame.file, fmt::format("has no {}: run the scene with {} = true", array, key));
}

void read_contacts(detail::Place group, Frame& frame) {
  const auto& [h, name] = group;
  demand(group, "contacts", "output.contacts");
  demand(group, "contacts/point", "output.contact_geometry");
  frame.contact_bodies = read_integers<std::array<std::int64_t, 2>>(h, name, "contacts/bodies");
  frame.contact_point = read_doubles<Vec3>(h, name, "contacts/point");
  frame.contact_normal = read_doubles<Vec3>(h, name, "contacts/normal");
  frame.contact_gap = read_doubles<double>(h, name, "contacts/gap");
  frame.contact_force = read_doubles<Vec3>(h, name, "contacts/force");
  if (H5Lexists(h, "contacts/moment", H5P_DEFAULT) > 0)
    frame.contact_moment = read_doubles<Vec3>(h, name, "contacts/moment");
}

/// Where walls are and how they stand; files of earlier versions do not tell.
void read_places(detail::Place frame, std::vector<WallReport>& walls) {
  const auto has = [&](const char* array) { return H5Lexists(frame.group, array, H5P_DEFAULT) > 0; };
  const auto fits = [&](std::size_t rows) {
    if (rows != walls.size())
      throw FileError(frame.file, "walls/normal and its like do not fit the number of names in /walls/name");
  };
  if (!has("walls/normal")) return;
  const auto normal = read_doubles<Vec3>(frame.group, frame.file, "walls/normal");
  const auto present = read_integers<std::int64_t>(frame.group, frame.file, "walls/present");
  fits(normal.size()), fits(present.size());
  for (std::size_t k = 0; k < walls.size(); ++k) {
    walls[k].normal = normal[k];
    walls[k].absent = present[k] == 0;
  }
  if (!has("walls/rotation")) return;
  using Rows = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  const auto rotation = read_doubles<std::array<double, 9>>(frame.group, frame.file, "walls/rotation");
  const auto translation = read_doubles<Vec3>(frame.group, frame.file, "walls/translation");
  fits(rotation.size()), fits(translation.size());
  for (std::size_t k = 0; k < walls.size(); ++k) {
    Pose& pose = walls[k].pose;
    pose.turn = Eigen::Map<const Rows>(rotation[k].data());
    pose.shift = translation[k];
    pose.moved = !pose.turn.isIdentity(0) || !pose.shift.isZero(0);
  }
}

/// The periodic cell, of which there may be none. Throws std::invalid_argument for edges that are no cell.
Domain read_cell(detail::Place frame) {
  if (H5Lexists(frame.group, "cell", H5P_DEFAULT) <= 0) return {};
  const auto origin = read_doubles<double>(frame.group, frame.file, "cell/origin");
  const auto edges = read_doubles<Vec3>(frame.group, frame.file, "cell/edges");
  const auto rates = read_doubles<Vec3>(frame.group, frame.file, "cell/rates");
  if (origin.size() != 3 || edges.size() != 3 || rates.size() != 3)
    throw FileError(frame.file, "cell/origin, cell/edges and cell/rates must have three rows each");
  Domain domain = periodic_domain({edges[0][0], edges[1][1], edges[2][2]}, Vec3(origin.data()),
                                  {edges[1][0], edges[2][0], edges[2][1]});
  domain.rates = {rates[0][0], rates[1][1], rates[2][2], rates[1][0], rates[2][0], rates[2][1]};
  domain.flows = matrix_of(domain.rates) != Mat3::Zero();
  return domain;
}

constexpr const char* instead_of_results =
    "give a checkpoint of the run in its place, or run the scene anew (where a run is writing a frame it may "
    "look so for a moment: try again)";

/// How long a reader waits for the writer of a frame, in all and between two looks.
struct Patience {
  std::chrono::milliseconds in_all{1000}, between{50};
};

/// What `read` returns of a file that a run may write to meanwhile. Throws FileError.
template <class Read>
auto read_while_written(const std::string& path, const Read& read) {
  const detail::QuietHdf5 quiet;
  const auto until = std::chrono::steady_clock::now() + Patience{}.in_all;
  const auto wait = [&] {
    if (std::chrono::steady_clock::now() > until) return false;
    std::this_thread::sleep_for(Patience{}.between);
    return true;
  };
  return detail::read_patiently(
      path, [&] { return detail::rehearsed(path, instead_of_results, read); }, wait);
}

}  // namespace

std::size_t frame_count(const std::filesystem::path& path) {
  const std::string name = path.string();
  return read_while_written(name, [&name] {
    const Hdf5Object file = open_results(name);
    return count_frames(file.id(), name);
  });
}

bool holds_clumps(const std::filesystem::path& path) {
  const std::string name = path.string();
  return read_while_written(name, [&name] {
    const Hdf5Object file = open_results(name);
    return H5Aexists(file.id(), "clumps") > 0;
  });
}

std::vector<std::string> material_names(const std::filesystem::path& path) {
  const std::string name = path.string();
  return read_while_written(name, [&name]() -> std::vector<std::string> {
    const Hdf5Object file = open_results(name);
    if (H5Lexists(file.id(), "materials", H5P_DEFAULT) <= 0) return {};
    return read_names({file.id(), name}, "/materials/name");
  });
}

std::size_t demand_frames(const std::filesystem::path& path) {
  const std::size_t frames = frame_count(path);
  if (frames > 0) return frames;
  throw FileError(
      path.string(),
      "holds no frame: one is written at the times of [output] and, with stage_frames = true, at the "
      "end of each stage");
}

namespace {

Frame load_frame(const std::string& name, std::size_t index, FrameParts parts) {
  const Hdf5Object file = open_results(name);
  const std::size_t count = count_frames(file.id(), name);
  if (index >= count) throw FileError(name, fmt::format("has no frame {}; it holds {}", index, count));

  const std::string prefix = fmt::format("/frames/{:06}", index);
  const Hdf5Object group =
      hold(H5Gopen2(file.id(), prefix.c_str(), H5P_DEFAULT), H5Gclose, name, "opening " + prefix);
  Frame frame;
  read_attribute({group.id(), name}, "step", H5T_NATIVE_INT64, &frame.step);
  read_attribute({group.id(), name}, "time", H5T_NATIVE_DOUBLE, &frame.time);
  frame.stage = detail::read_text({group.id(), name}, "stage");
  // Files of earlier versions do not tell.
  frame.with_contacts =
      H5Aexists(group.id(), "contacts") <= 0 || detail::read_integer({group.id(), name}, "contacts") != 0;

  const hid_t h = group.id();
  frame.id = read_integers<std::int64_t>(h, name, "bodies/id");
  frame.x = read_doubles<Vec3>(h, name, "bodies/x");
  frame.radius = read_doubles<double>(h, name, "bodies/radius");
  if (parts == FrameParts::all || parts == FrameParts::without_contacts)
    demand({h, name}, "bodies/u", "output.velocities");
  if (parts != FrameParts::places && H5Lexists(h, "bodies/u", H5P_DEFAULT) > 0)
    frame.u = read_doubles<Vec3>(h, name, "bodies/u");
  if (H5Lexists(h, "bodies/omega", H5P_DEFAULT) > 0)
    frame.omega = read_doubles<Vec3>(h, name, "bodies/omega");
  if (H5Lexists(h, "bodies/orientation", H5P_DEFAULT) > 0) {
    frame.orientation = read_doubles<std::array<double, 4>>(h, name, "bodies/orientation");
  }
  if (H5Lexists(h, "bodies/material", H5P_DEFAULT) > 0)
    frame.material = read_integers<std::int64_t>(h, name, "bodies/material");
  if (parts == FrameParts::all || parts == FrameParts::forces) read_contacts({h, name}, frame);

  const auto names = read_names({file.id(), name}, "/walls/name");
  const auto position = read_doubles<double>(h, name, "walls/position");
  const auto velocity = read_doubles<double>(h, name, "walls/velocity");
  const auto force = read_doubles<Vec3>(h, name, "walls/force");
  if (position.size() != names.size() || velocity.size() != names.size() || force.size() != names.size()) {
    throw FileError(name, prefix + "/walls does not fit the number of names in /walls/name");
  }
  for (std::size_t k = 0; k < names.size(); ++k) {
    frame.walls.push_back({names[k], position[k], velocity[k], force[k]});
  }
  read_places({h, name}, frame.walls);
  try {
    frame.domain = read_cell({h, name});
    validate(frame, parts);
  } catch (const std::invalid_argument& error) {
    throw FileError(name, prefix + " is damaged: " + error.what());
  }
  return frame;
}

}  // namespace

Frame read_frame(const std::filesystem::path& path, std::size_t index, FrameParts parts) {
  const std::string name = path.string();
  return read_while_written(name, [&] { return load_frame(name, index, parts); });
}

}  // namespace talus::io
