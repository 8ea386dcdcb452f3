#include "apps/commands/convert.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <vector>

#include "apps/report/run_folder.hpp"
#include "apps/shared/exit_codes.hpp"
#include "apps/shared/patience.hpp"
#include "apps/shared/print.hpp"
#include "io/files/error.hpp"
#include "io/files/output_directory.hpp"
#include "io/results/grain_balls.hpp"
#include "io/results/lammps_dump.hpp"
#include "io/results/results.hpp"
#include "io/results/vtkhdf.hpp"

namespace talus {

namespace {

namespace fs = std::filesystem;

/// What the options mean. Throws std::exception where they mean nothing.
struct Conversion {
  fs::path results, out;
  std::size_t frames = 0;
  io::GrainShapes shapes = {};  ///< spheres, unless the scene beside the results says otherwise
};

/// As the scene beside the results tells them; says where it cannot.
void find_shapes(const fs::path& folder, Conversion& todo) {
  const fs::path file = folder / "scene.resolved.toml";
  if (!fs::exists(file)) return;
  const char* why = "cannot be read";
  if (const auto scene = resolved_scene(folder)) {
    todo.shapes = io::grain_shapes(scene->setup.clumps, !scene->setup.inserts.empty(), todo.results);
    if (scene->setup.clumps.empty() || todo.shapes.clump) return;
    why = "inserts spheres among the clumps, which frames that do not begin with the run cannot tell apart";
  }
  print_error("talus: warning: {} {}; clumps become the spheres that hold them\n", file.string(), why);
}

Conversion conversion_of(const ConvertOptions& options) {
  if (options.format != "lammps" && options.format != "vtkhdf")
    throw std::invalid_argument(fmt::format("there is no format '{}': lammps or vtkhdf", options.format));
  Conversion todo;
  todo.results = fs::is_directory(options.run) ? fs::path(options.run) / "results.h5" : fs::path(options.run);
  if (!fs::exists(todo.results))
    throw std::invalid_argument(fmt::format("{}: no results.h5 of a run there", fs::is_directory(options.run)
                                                                                    ? options.run
                                                                                    : todo.results.string()));
  const char* name = options.format == "lammps" ? "grains.lammpstrj" : "grains.vtkhdf";
  todo.out = options.out.empty() ? todo.results.parent_path() / name : fs::path(options.out);
  std::vector<fs::path> sources = sources_in(fs::absolute(todo.results).parent_path());
  sources.push_back(todo.results);  // whatever its name
  io::check_output_files(sources, {todo.out}, options.force);
  todo.frames = io::demand_frames(todo.results);
  find_shapes(fs::absolute(todo.results).parent_path(), todo);
  return todo;
}

/// What is to be converted cannot be read.
struct UnreadableInput : std::runtime_error {
  using std::runtime_error::runtime_error;
};

Frame read(const Conversion& todo, std::size_t k) try {
  return io::read_frame(todo.results, k, io::FrameParts::grains);
} catch (const io::FileError& error) {
  throw UnreadableInput(error.what());
}

/// Neither format has contacts, nor shapes but spheres.
Frame frame_of(const Conversion& todo, std::size_t k) {
  Frame frame = read(todo, k);
  return todo.shapes.clump ? io::frame_of_balls(frame, todo.shapes) : frame;
}

void tell(Patience& patience, std::size_t done, const Conversion& todo) {
  patience.tell([&] { return fmt::format("{} of {} frames written", done, todo.frames); });
}

void write_lammps(const Conversion& todo, const fs::path& draft) {
  std::ofstream file(draft, std::ios::binary);
  const std::size_t balls = todo.shapes.clump ? todo.shapes.clump->balls.size() : 1;
  // Readers take the columns of the first frame for those of all, and it may have no grains yet.
  std::size_t filled = 0;
  Frame like = frame_of(todo, filled);
  while (like.id.empty() && ++filled < todo.frames) like = frame_of(todo, filled);
  Patience patience;
  for (std::size_t k = 0; k < todo.frames; ++k) {
    tell(patience, k, todo);
    const Frame frame = frame_of(todo, k);
    file << io::lammps_dump(frame, balls, frame.id.empty() ? like : frame);
  }
  file.close();
  if (!file) throw io::FileError(draft.string(), "cannot be written: no room or no right to");
}

void write_vtkhdf(const Conversion& todo, const fs::path& draft) {
  io::VtkHdfWriter writer(draft);
  Patience patience;
  for (std::size_t k = 0; k < todo.frames; ++k) {
    tell(patience, k, todo);
    writer.append(frame_of(todo, k));
  }
  writer.close();
}

}  // namespace

int convert_command(const ConvertOptions& options) {
  Conversion todo;
  try {
    todo = conversion_of(options);
  } catch (const std::exception& error) {
    print_error("talus: error: {}\n", error.what());
    return exit_bad_input;
  }
  const auto write = options.format == "lammps" ? write_lammps : write_vtkhdf;
  try {
    io::write_by_draft(todo.out, [&](const fs::path& draft) { write(todo, draft); });
  } catch (const std::exception& error) {
    print_error("talus: error: {}\n", error.what());
    return dynamic_cast<const UnreadableInput*>(&error) ? exit_bad_input : exit_failure;
  }
  print_error("talus: {} written, {} frames\n", todo.out.string(), todo.frames);
  return exit_done;
}

}  // namespace talus
