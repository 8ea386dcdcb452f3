#pragma once

/// What bodies may look like, by name: scene keys and their page are written from this table. One file of
/// this folder holds one shape.

#include "kernels/registry.hpp"
#include "kernels/shapes/clump.hpp"

namespace talus {

/// A shape of bodies, known by its name in the registry. The constant is the one that code asks for.
class BodyShape : public NamedKind<BodyShape> {
 public:
  using NamedKind::NamedKind;
  static const BodyShape sphere;
};
inline constexpr BodyShape BodyShape::sphere("sphere");

/// Makes the clump; null for the sphere, which is none.
using ClumpMaker = Clump (*)();
using BodyShapeEntry = Entry<BodyShape, ClumpMaker>;

/// sample.shape in scenes.
const Registry<BodyShape, ClumpMaker>& body_shapes();

}  // namespace talus
