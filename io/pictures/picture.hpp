#pragma once

/// Pictures of a run as SVG text, for those who want to see at once whether it makes sense.

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "io/results/grain_balls.hpp"
#include "io/results/grain_load.hpp"
#include "kernels/shapes/walls.hpp"
#include "runtime/graph/communicator.hpp"
#include "runtime/step/frame.hpp"

namespace talus::io {

struct TriaxialPicture {
  std::string stage;  ///< rows of other stages are left out; "" takes all rows
  int axis = 2;       ///< axial direction: 0, 1, 2 = x, y, z
};

/// Stress and strain of a box or cell: two diagrams over a common axis, the axial strain in per cent,
/// positive in compression: q/p, and the volume strain (29) in per cent, positive where the sample dilates.
/// Steps that missed their tolerance are marked, and are no peak. Rows with a value that is not finite are
/// left out; without any row the picture says so.
std::string draw_triaxial(std::span<const TriaxialReport> reports, const TriaxialPicture& options);

/// All grains of a sample, of which pictures show a slab.
struct SampleExtent {
  std::int64_t grains = 0;
  double mean_radius = 0;         ///< [m]
  double y_low = 0, y_high = -1;  ///< of the centres [m]
  Bounds box;                     ///< around the spheres [m]
};
/// Of a frame of which each rank has a part; the same for any ranks. Collective.
SampleExtent sample_extent(const Frame& part, const graph::Communicator& ranks);

struct ForcePicture {
  double thickness = 0;                     ///< [m] of the slab; 0: four mean radii
  GrainLoad load = {};                      ///< forces far below it are drawn thin
  std::optional<SampleExtent> sample = {};  ///< that the frame has the slab of; none: it has all grains
  GrainShapes shapes = {};                  ///< of the run; clumps are drawn as their balls
};

/// Grains whose centre lies in a slab about the middle of the sample, normal to y, seen along y, and the
/// forces between them: a line between the centres (or to the contact point at a wall), as wide and as dark
/// as its normal force is large. `walls` are those of frame.walls, in the same order;
/// they are drawn where they cut the middle of the slab. Throws std::invalid_argument when a contact names a
/// body or wall that is not there.
std::string draw_forces(const Frame& frame, std::span<const Wall> walls, const ForcePicture& options);

/// What the pictures need of a sample.
struct SlabFrame {
  Frame frame;          ///< the grains of the slab, and the contacts between them and with walls
  SampleExtent sample;  ///< on all ranks
};
/// Collective: the slab of a frame of which each rank has a part, on rank 0. No rows on others; they travel
/// in bounded pieces. `thickness` as in the pictures.
SlabFrame gather_slab(const Frame& part, const graph::Communicator& ranks, double thickness = 0);

struct GrainPicture {
  double thickness = 0;                     ///< [m] of the slab; 0: four mean radii
  std::span<const Wall> walls = {};         ///< those of the frame, drawn as those of ForcePicture
  std::optional<SampleExtent> sample = {};  ///< as in ForcePicture
  GrainShapes shapes = {};                  ///< likewise
};

/// Grains of such a slab coloured by their speed, from 0 to the one that nineteen of twenty of them do not
/// exceed, each with a line along its velocity, as long as its diameter at that speed.
std::string draw_velocities(const Frame& frame, const GrainPicture& options);

/// The same grains coloured by material; `names` by number, for the legend.
std::string draw_materials(const Frame& frame, std::span<const std::string> names,
                           const GrainPicture& options);

struct PartitionPicture {
  std::string title;
  std::int32_t subdomains = 1;
  double thickness = 0;  ///< [m] of the slab; 0: four mean radii
};

/// The grains of such a slab twice: coloured by `subdomain`, and in greys by `multiplicity` as in Figure 6 of
/// Visseq, Alart and Dureisseix (2013), white for inner grains (m = 1). Both have one entry per body of the
/// frame. Throws std::invalid_argument when they have not.
std::string draw_partition(const Frame& frame, std::span<const std::int32_t> subdomain,
                           std::span<const std::int32_t> multiplicity, const PartitionPicture& options);

}  // namespace talus::io
