#include "io/results/results.hpp"

#include <fcntl.h>
#include <fmt/format.h>

#include <optional>
#include <span>
#include <stdexcept>

#include "io/files/detail/all_or_none.hpp"
#include "io/files/detail/descriptor.hpp"
#include "io/files/detail/hdf5_read.hpp"
#include "io/files/detail/hdf5_write.hpp"
#include "io/files/detail/rehearsal.hpp"
#include "io/files/error.hpp"
#include "io/results/detail/directory_undo.hpp"
#include "io/results/detail/frame_arrays.hpp"
#include "io/results/version.hpp"
#include "runtime/graph/one_rank.hpp"

namespace talus::io {
namespace {

using detail::all_or_none;
using detail::close_file;
using detail::create_group;
using detail::demand;
using detail::file_access;
using detail::FrameArray;
using detail::Hdf5Object;
using detail::hold;
using detail::Place;
using detail::write_attribute;
using detail::write_names;

constexpr std::int64_t format_version = 1;

std::string frame_name(std::size_t index) {
  return fmt::format("{:06}", index);
}

void demand_same_length(std::size_t length, std::size_t expected, const char* name) {
  if (length != expected) {
    throw std::invalid_argument(fmt::format("frame: {} has {} entries, expected {}", name, length, expected));
  }
}

}  // namespace

void validate(const Frame& frame, FrameParts parts) {
  const std::size_t bodies = frame.id.size();
  demand_same_length(frame.x.size(), bodies, "x");
  demand_same_length(frame.radius.size(), bodies, "radius");
  if ((parts != FrameParts::grains && parts != FrameParts::forces) || !frame.u.empty())
    demand_same_length(frame.u.size(), parts == FrameParts::places ? 0 : bodies, "u");
  if (!frame.omega.empty()) demand_same_length(frame.omega.size(), bodies, "omega");
  if (!frame.orientation.empty()) demand_same_length(frame.orientation.size(), bodies, "orientation");
  if (!frame.material.empty()) demand_same_length(frame.material.size(), bodies, "material");
  const std::size_t contacts = frame.contact_bodies.size();
  demand_same_length(frame.contact_point.size(), contacts, "contact_point");
  demand_same_length(frame.contact_normal.size(), contacts, "contact_normal");
  demand_same_length(frame.contact_gap.size(), contacts, "contact_gap");
  demand_same_length(frame.contact_force.size(), contacts, "contact_force");
  if (!frame.contact_moment.empty())
    demand_same_length(frame.contact_moment.size(), contacts, "contact_moment");
}

namespace {

/// Throws FileError where the disk has no room for a frame: HDF5 hears of none, whose files cannot be closed
/// when it meets a full disk.
void demand_room(const std::string& path, const std::vector<FrameArray>& arrays, std::size_t frames) {
  // What HDF5 writes around arrays, and the directory of frames when it grows: generous.
  std::size_t bytes = (1 << 16) + 64 * frames;
  for (const FrameArray& array : arrays) bytes += array.stored_bytes();
  detail::Descriptor file(path, O_WRONLY);
  file.demand_room(static_cast<std::int64_t>(std::filesystem::file_size(path)),
                   static_cast<std::int64_t>(bytes));
  file.close();
}

/// results.h5 while a frame comes into it.
class OpenFrame {
 public:
  explicit OpenFrame(const std::string& path)
      : path_(path),
        access_(file_access(path)),
        file_(hold(H5Fopen(path.c_str(), H5F_ACC_RDWR, access_.id()), H5Fclose, path, "opening the file")),
        group_(
            hold(H5Gcreate_anon(file_.id(), H5P_DEFAULT, H5P_DEFAULT), H5Gclose, path, "creating a frame")) {}

  /// Nameless until it is complete: what stops half way leaves no half frame behind.
  Place place() const { return {group_->id(), path_}; }
  void name_and_close(const std::string& name) {
    // All of it on its way to the disk before its name is, or a kill in between could leave a name of
    // nothing.
    demand(H5Fflush(file_.id(), H5F_SCOPE_LOCAL), path_, "writing to disk");
    demand(H5Olink(group_->id(), file_.id(), name.c_str(), H5P_DEFAULT, H5P_DEFAULT), path_,
           "naming frame " + name);
    group_.reset();
    close_file(file_, path_);
  }

 private:
  const std::string& path_;
  Hdf5Object access_, file_;
  std::optional<Hdf5Object> group_;
};

/// Names of the frames, of which there have to be so many.
std::vector<std::string> frames_of(const Place& root, std::size_t kept) {
  std::vector<std::string> names = detail::names_in(root, "frames");
  if (names.size() < kept)
    throw FileError(root.file, fmt::format("has {} frames, of {} that the checkpoint knows; begin anew in "
                                           "another directory",
                                           names.size(), kept));
  return names;
}

/// Removes the frames behind the first `kept`. Their room in the file is taken by those that follow, or
/// given back, as far as they were its last.
void cut_opened(const std::string& path, std::size_t kept) {
  const Hdf5Object access = file_access(path);
  Hdf5Object file =
      hold(H5Fopen(path.c_str(), H5F_ACC_RDWR, access.id()), H5Fclose, path, "opening the file");
  {
    const Place root{file.id(), path};
    std::vector<std::string> names = frames_of(root, kept);
    for (; names.size() > kept; names.pop_back())
      demand(H5Ldelete(file.id(), ("/frames/" + names.back()).c_str(), H5P_DEFAULT), path,
             "removing frame " + names.back());
  }
  close_file(file, path);
}

constexpr const char* instead_of_frames =
    "begin anew in another directory, from the last checkpoint with [sample] kind = \"state\"";

void cut_frames(const std::string& path, std::size_t kept) {
  const detail::QuietHdf5 quiet;
  detail::bring_back_directory(path);
  detail::keep_directory(path);
  const auto cut = [&] { cut_opened(path, kept); };
  if (!detail::done_in_a_child(path, instead_of_frames, cut)) cut();
  detail::drop_directory(path);
}

/// Reads which arrays the file has, those of frames to be cut off, too, as cutting walks through them. Throws
/// FileError where HDF5 cannot read that; the arrays are not read.
void look_through(const std::string& path, std::size_t kept) {
  const Hdf5Object access = file_access(path);
  const Hdf5Object file =
      hold(H5Fopen(path.c_str(), H5F_ACC_RDONLY, access.id()), H5Fclose, path, "opening the file");
  const Place root{file.id(), path};
  detail::names_in(root, "walls");
  const std::vector<std::string> names = frames_of(root, kept);
  for (const std::string& name : names)
    for (const std::string& group : detail::names_in(root, "frames/" + name))
      detail::names_in(root, "frames/" + name + "/" + group);
}

}  // namespace

void demand_kept_frames(const std::filesystem::path& path, std::size_t kept) {
  const std::string name = path.string();
  const detail::QuietHdf5 quiet;
  detail::bring_back_directory(name);
  const auto look = [&] { look_through(name, kept); };
  if (!detail::done_in_a_child(name, instead_of_frames, look)) look();
}

ResultsWriter::ResultsWriter(const std::filesystem::path& path, const ResultsNames& names)
    : ResultsWriter(path, names, graph::one_rank()) {}

ResultsWriter::ResultsWriter(const std::filesystem::path& path, const ResultsNames& names,
                             const graph::Communicator& ranks, FrameFormat format,
                             std::optional<std::size_t> kept)
    : path_(path.string()),
      wall_names_(names.walls),
      ranks_(ranks),
      format_(format),
      frames_(kept.value_or(0)) {
  if (ranks.rank() == 0 && kept) {
    cut_frames(path_, *kept);
  } else if (ranks.rank() == 0) {
    const detail::QuietHdf5 quiet;
    const Hdf5Object access = file_access(path_);
    Hdf5Object file = hold(H5Fcreate(path_.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access.id()), H5Fclose, path_,
                           "creating the file");
    {
      const Place root{file.id(), path_};
      write_attribute(root, "format", std::string("talus-results"));
      write_attribute(root, "format_version", format_version);
      write_attribute(root, "talus_version", version());
      if (names.clumps) write_attribute(root, "clumps", std::string("yes"));
      create_group(root, "frames");
      const Hdf5Object walls = create_group(root, "walls");
      write_names({walls.id(), path_}, "name", wall_names_);
      if (!names.materials.empty()) {
        detail::write_array({walls.id(), path_}, "material", "1", names.wall_materials);
        write_names({create_group(root, "materials").id(), path_}, "name", names.materials);
      }
    }
    close_file(file, path_);
  }
}

void ResultsWriter::append(const Frame& part) {
  validate(part);
  demand_same_length(part.walls.size(), wall_names_.size(), "walls");
  for (std::size_t k = 0; k < wall_names_.size(); ++k) {
    if (part.walls[k].name != wall_names_[k]) {
      throw std::invalid_argument(
          fmt::format("frame: wall {} is '{}', expected '{}'", k, part.walls[k].name, wall_names_[k]));
    }
  }
  const detail::WallColumns walls(part.walls);
  const detail::CellColumns cell(part.domain);
  const std::vector<FrameArray> arrays = detail::frame_arrays(part, walls, cell, format_, ranks_);
  if (ranks_.rank() == 0) detail::keep_directory(path_);
  append_here(part, arrays);
  if (ranks_.rank() == 0) detail::drop_directory(path_);
  ++frames_;
}

void ResultsWriter::append_here(const Frame& part, const std::vector<FrameArray>& arrays) {
  const bool first = ranks_.rank() == 0;
  const detail::QuietHdf5 quiet;
  std::optional<OpenFrame> open;  // rank 0's
  std::vector<std::int64_t> begin;
  all_or_none(ranks_, path_, first, [&] {
    if (format_.compression == 0) demand_room(path_, arrays, frames_);
    open.emplace(path_);
    const Place frame = open->place();
    write_attribute(frame, "step", part.step);
    write_attribute(frame, "time", part.time);
    write_attribute(frame, "stage", part.stage);
    write_attribute(frame, "contacts", std::int64_t{part.with_contacts});
    begin = detail::lay_out(frame, arrays, format_.compression);
  });
  begin = ranks_.gather_records(std::span<const std::int64_t>(begin));
  if (format_.compression > 0)
    detail::write_gathered(first ? open->place() : Place{H5I_INVALID_HID, path_}, arrays, ranks_);
  else
    all_or_none(ranks_, path_, true, [&] { detail::write_in_place(path_, arrays, begin); });
  all_or_none(ranks_, path_, first, [&] { open->name_and_close("/frames/" + frame_name(frames_)); });
}

}  // namespace talus::io
