#include "io/results.hpp"

#include <fmt/format.h>

#include <span>
#include <stdexcept>

#include "io/detail/hdf5_write.hpp"
#include "io/error.hpp"
#include "io/version.hpp"

namespace talus::io {
namespace {

using detail::close_file;
using detail::create_group;
using detail::demand;
using detail::file_access;
using detail::Hdf5Object;
using detail::hold;
using detail::Place;
using detail::write_array;
using detail::write_attribute;
using detail::write_names;

constexpr std::int64_t format_version = 1;

static_assert(sizeof(Vec3) == 3 * sizeof(double), "a vector of Vec3 is written as an n x 3 array");

std::string frame_name(std::size_t index) {
  return fmt::format("{:06}", index);
}

void write_array(Place place, const char* name, const char* units, const std::vector<Vec3>& values) {
  detail::write_array(place, name, units, detail::element_types(static_cast<const double*>(nullptr)),
                      values.data(), values.size(), 3);
}

void write_bodies(Place place, const Frame& frame) {
  write_array(place, "id", "1", frame.id);
  write_array(place, "x", "m", frame.x);
  write_array(place, "radius", "m", frame.radius);
  write_array(place, "u", "m/s", frame.u);
  if (!frame.omega.empty()) write_array(place, "omega", "rad/s", frame.omega);
  if (!frame.orientation.empty()) write_array(place, "orientation", "1", frame.orientation);
}

void write_contacts(Place place, const Frame& frame) {
  write_array(place, "bodies", "1", frame.contact_bodies);
  write_array(place, "point", "m", frame.contact_point);
  write_array(place, "normal", "1", frame.contact_normal);
  write_array(place, "gap", "m", frame.contact_gap);
  write_array(place, "force", "N", frame.contact_force);
}

void write_walls(Place place, const Frame& frame) {
  std::vector<double> position, velocity;
  std::vector<Vec3> force;
  for (const WallReport& wall : frame.walls) {
    position.push_back(wall.position);
    velocity.push_back(wall.velocity);
    force.push_back(wall.force);
  }
  write_array(place, "position", "m", position);
  write_array(place, "velocity", "m/s", velocity);
  write_array(place, "force", "N", force);
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
  const std::size_t contacts = frame.contact_bodies.size();
  demand_same_length(frame.contact_point.size(), contacts, "contact_point");
  demand_same_length(frame.contact_normal.size(), contacts, "contact_normal");
  demand_same_length(frame.contact_gap.size(), contacts, "contact_gap");
  demand_same_length(frame.contact_force.size(), contacts, "contact_force");
}

ResultsWriter::ResultsWriter(const std::filesystem::path& path, const std::vector<std::string>& wall_names)
    : path_(path.string()), wall_names_(wall_names) {
  const detail::QuietHdf5 quiet;
  const Hdf5Object access = file_access(path_);
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

void ResultsWriter::append(const Frame& frame) {
  validate(frame);
  demand_same_length(frame.walls.size(), wall_names_.size(), "walls");
  for (std::size_t k = 0; k < wall_names_.size(); ++k) {
    if (frame.walls[k].name != wall_names_[k]) {
      throw std::invalid_argument(
          fmt::format("frame: wall {} is '{}', expected '{}'", k, frame.walls[k].name, wall_names_[k]));
    }
  }
  const detail::QuietHdf5 quiet;
  const Hdf5Object access = file_access(path_);
  Hdf5Object file =
      hold(H5Fopen(path_.c_str(), H5F_ACC_RDWR, access.id()), H5Fclose, path_, "opening the file");
  {
    // Nameless until it is complete: what stops half way leaves no half frame behind.
    const Hdf5Object group =
        hold(H5Gcreate_anon(file.id(), H5P_DEFAULT, H5P_DEFAULT), H5Gclose, path_, "creating a frame");
    const Place place{group.id(), path_};
    write_attribute(place, "step", frame.step);
    write_attribute(place, "time", frame.time);
    write_attribute(place, "stage", frame.stage);
    write_bodies({create_group(place, "bodies").id(), path_}, frame);
    write_contacts({create_group(place, "contacts").id(), path_}, frame);
    write_walls({create_group(place, "walls").id(), path_}, frame);
    // All of it on its way to the disk before its name is, or a kill in between could leave a name of
    // nothing.
    demand(H5Fflush(file.id(), H5F_SCOPE_LOCAL), path_, "writing to disk");
    const std::string name = "/frames/" + frame_name(frames_);
    demand(H5Olink(group.id(), file.id(), name.c_str(), H5P_DEFAULT, H5P_DEFAULT), path_,
           "naming frame " + name);
  }
  close_file(file, path_);
  ++frames_;
}

}  // namespace talus::io
