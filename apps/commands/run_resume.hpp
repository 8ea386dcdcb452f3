#pragma once

/// From where a run with --resume goes on.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/commands/run_checkpoints.hpp"
#include "apps/shared/terminal.hpp"
#include "io/scene/scene.hpp"
#include "io/scene/scene_change.hpp"
#include "runtime/graph/communicator.hpp"

namespace talus {

/// A checkpoint that is whole, with the parts of this rank.
struct ResumePoint {
  std::filesystem::path path;
  io::CheckpointFile file;
  RunMemory memory;
  std::vector<io::SceneChange> changes;  ///< of the scene since it was written
};

/// Collective. The last checkpoint in `directory` whose parts are whole on all ranks; none where there is no
/// checkpoint. Those that are damaged are named by rank 0. Throws std::invalid_argument, on all ranks, when
/// all that there are are damaged, or ranks are more than subdomains.
std::optional<ResumePoint> find_resume_point(const std::filesystem::path& directory, const io::Scene& scene,
                                             const graph::Communicator& ranks, const Terminal& terminal);

/// Compares the scene, as load_scene gave it, with that of the checkpoint, and fills point.changes. Throws
/// std::invalid_argument naming what differs and may not, an input file that has changed included.
void compare_scenes(const io::Scene& scene, const std::string& resolved, ResumePoint& point);

/// Throws std::invalid_argument naming a file that the run would go on in and that is not the one which it
/// wrote until the checkpoint, or cannot be written. Files that are not asked for any more are left alone.
/// `mends`: results.h5, which is mended first where a kill has left its directory in pieces, is looked
/// through.
void demand_files_of_run(const std::filesystem::path& directory, const io::OutputSpec& output,
                         const io::OutputMark& mark, bool mends);

/// Why nobody can read the frames of a run that is done, "" where they can be read or it writes none.
std::string fault_of_results(const std::filesystem::path& directory, const io::OutputSpec& output);

/// Of a directory without a checkpoint: throws std::invalid_argument unless the results in it, if there are
/// any, are those of this scene, whose walls have been placed. Of a run that is done nothing may differ, of
/// another one what a checkpoint would let change.
void demand_results_of_scene(const std::filesystem::path& directory, const io::Scene& scene, bool done);

/// Whether the ends that the last run in a directory went for are those of this scene; true where nobody can
/// read there which they were.
bool has_ends_of(const std::filesystem::path& directory, const io::Scene& scene);

/// Completes the scene with what the checkpoint knows: how many subdomains, and where the walls stood at
/// first.
void take_over(const ResumePoint& point, io::Scene& scene);

/// What run.json in a directory says.
struct EarlierRun {
  bool complete = false;  ///< the last stage of the scene has ended
  bool done = false;      ///< it has ended by itself, if only where --steps asked for it
  int exit_code = 0;
  std::vector<std::string> warnings;  ///< of the scene
};
EarlierRun earlier_run(const std::filesystem::path& directory);

}  // namespace talus
