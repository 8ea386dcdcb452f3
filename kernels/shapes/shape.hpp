#pragma once

/// What a wall may look like, and how a scene says it. One file of this folder holds one shape: its
/// parameters, and how a surface is made of them. Scene keys and their page are written from these entries.

#include <array>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "kernels/bodies/types.hpp"
#include "kernels/shapes/surface.hpp"

namespace talus {

/// A parameter of a shape, as a key of a scene.
struct ShapeParameter {
  enum class Kind {
    length,  ///< one number > 0
    extent,  ///< one number >= 0
    vector,  ///< three numbers
    truth,   ///< true or false; false when left out
    file,    ///< name of a file of triangles
  };
  const char* name;
  const char* unit;
  Kind kind;
  const char* meaning;  ///< one sentence
};

/// What a scene gives of a shape's parameters: numbers by name (a truth is 0 or 1), and what stands in its
/// file.
struct ShapeValues {
  std::map<std::string, std::vector<double>> number;
  std::string file;
  std::vector<Triangle> triangles;

  double scalar(const std::string& name) const { return number.at(name)[0]; }
  Vec3 vector(const std::string& name) const { return Eigen::Map<const Vec3>(number.at(name).data()); }
  /// False when it is left out.
  bool truth(const std::string& name) const { return number.contains(name) && number.at(name)[0] != 0; }
};

/// A shape of walls.
struct ShapeEntry {
  const char* name;      ///< as scenes spell it
  const char* sentence;  ///< begins in lower case and has no full stop
  std::span<const ShapeParameter> parameters;
  /// Throws std::invalid_argument, naming the parameter or triangle, when the values make no surface.
  std::shared_ptr<const Surface> (*make)(const ShapeValues& values);
};

/// All shapes but the plane, in the order in which users see them (kernels/shapes/table.cpp).
std::span<const ShapeEntry* const> wall_shapes();
/// nullptr for a name that is none of theirs: "plane" is one.
const ShapeEntry* wall_shape(const std::string& name);

/// The shape of one wall.
struct WallShape {
  std::string name = "plane";
  ShapeValues values;                      ///< without the triangles, once the surface is made
  std::shared_ptr<const Surface> surface;  ///< null: a plane, by point and normal of the wall
};

/// Makes the surface of a shape from its values, and lets go of the triangles. Throws as `make`.
void make_surface(WallShape& shape);

}  // namespace talus
