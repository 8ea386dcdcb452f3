#pragma once

/// Files of triangles for tests.

#include <fmt/format.h>

#include <string>
#include <vector>

#include "kernels/shapes/shape.hpp"

namespace talus::test {

inline std::string stl_text(const std::vector<Triangle>& triangles) {
  std::string text = "solid funnel\n";
  for (const Triangle& triangle : triangles) {
    text += "facet normal 0 0 0\nouter loop\n";
    for (const Vec3& p : triangle) text += fmt::format("vertex {} {} {}\n", p[0], p[1], p[2]);
    text += "endloop\nendfacet\n";
  }
  return text + "endsolid\n";
}

}  // namespace talus::test
