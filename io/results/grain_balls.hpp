#pragma once

/// Grains of a frame as the spheres that a picture or another program shows.

#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "kernels/shapes/clump.hpp"
#include "runtime/graph/communicator.hpp"
#include "runtime/step/frame.hpp"

namespace talus::io {

/// What the grains of a run are: those of its samples have one shape, inserted ones are spheres.
struct GrainShapes {
  std::optional<Clump> clump = {};                                       ///< none: all are spheres
  std::int64_t spheres_from = std::numeric_limits<std::int64_t>::max();  ///< ids from here on are spheres
};

/// Of a setup with these clumps. Where it `inserts` spheres among them, their ids follow those of the first
/// frame of `results`, if that is of the beginning and so has the grains of the samples alone; if it is later
/// or cannot be read, all are drawn as the spheres that hold them. Else no file is read.
GrainShapes grain_shapes(std::span<const Clump> clumps, bool inserts, const std::filesystem::path& results);

/// The same on all ranks, of which rank 0 reads the file. Collective.
GrainShapes grain_shapes(std::span<const Clump> clumps, bool inserts, const std::filesystem::path& results,
                         const graph::Communicator& ranks);

/// A sphere of a picture: a grain, or a ball of it.
struct SeenBall {
  Vec3 centre = Vec3::Zero();  ///< [m]
  double radius = 0;           ///< [m]
  std::size_t grain = 0;       ///< its place in the frame
};

/// The balls of grain `grain` behind those that are there; of a frame without orientations the sphere that
/// holds it.
void add_balls(const Frame& frame, const GrainShapes& shapes, std::size_t grain,
               std::vector<SeenBall>& balls);
/// Those of all grains, in the order of the frame.
std::vector<SeenBall> seen_balls(const Frame& frame, const GrainShapes& shapes);

/// The same state with a body for each ball, for programs that know spheres only: id, angular velocity,
/// orientation and material are those of its grain, the velocity is that of its own centre. Without contacts.
Frame frame_of_balls(const Frame& frame, const GrainShapes& shapes);

}  // namespace talus::io
