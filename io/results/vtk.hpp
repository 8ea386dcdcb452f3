#pragma once

/// Files for ParaView: grains and the force network as VTK PolyData, and the collections that give them their
/// time. Numbers are 32-bit floats, since they are for looking at; results.h5 has the exact ones.

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "io/files/write_text.hpp"
#include "kernels/shapes/surface.hpp"
#include "runtime/graph/communicator.hpp"
#include "runtime/step/frame.hpp"

namespace talus::io {

/// A whole number per body of a frame, e.g. its subdomain.
struct GrainField {
  std::string_view name;
  std::span<const std::int32_t> values;
};

/// Text of a .vtp file with one vertex per body; point data id, radius [m], velocity [m/s], and omega [rad/s]
/// and orientation (w, x, y, z) where the frame has them. The frame's time is in the field data `TimeValue`.
/// `fields` become point data too. Throws std::invalid_argument naming a field that has not one value per
/// body.
std::string grains_vtp(const Frame& frame, std::span<const GrainField> fields = {});

/// Text of a .vtp file with one line per contact with a force: between the centres of its grains, or from the
/// centre to the contact point at a wall. Lines do not share points, so that a Tube filter can take its
/// radius from the point data normal_force [N]; cell data force [N] on the first body, gap [m], wall (index
/// of the wall, -1 between grains). Throws std::invalid_argument when a contact names a body that the frame
/// does not hold.
std::string forces_vtp(const Frame& frame);

/// The same texts of frames of which each rank has a part (frame.hpp). Collective; `out` gets the text in
/// order on rank 0 and is not called on others. What one array needs is held at a time, by each rank for its
/// part.
void write_grains_vtp(const Frame& part, const graph::Communicator& ranks, const WriteText& out,
                      std::span<const GrainField> fields = {});
void write_forces_vtp(const Frame& part, const graph::Communicator& ranks, const WriteText& out);

/// Text of a .vtp file with the triangles of each wall (wall_triangles.hpp); cell data wall (index), material
/// (number), velocity along the normal of a plane [m/s] and force on the grains [N], of its whole wall each.
/// `materials` by wall.
std::string walls_vtp(const Frame& frame, std::span<const std::vector<Triangle>> triangles,
                      std::span<const std::int64_t> materials);

/// Text of a .vtp file with the lines of a periodic cell (cell_outline.hpp); cell data `edge` is that of
/// CellLine. `grains`: the box around them.
std::string cell_vtp(const Frame& frame, const Bounds& grains);

/// One file of a collection.
struct FieldFile {
  double time = 0;   ///< [s]
  int part = 0;      ///< files of the same time differ by their part
  std::string path;  ///< relative to the collection
};

/// Text of a .pvd file.
std::string collection_pvd(const std::vector<FieldFile>& files);

}  // namespace talus::io
