#pragma once

#include <string>

#include "kernels/shapes/prescribed_motion.hpp"

namespace talus::io {

/// The table of a motion: a line of names, `t[,x,y,z|,vx,vy,vz][,angle]`, and then two lines or more; units
/// are s, m, m/s and rad. Times ascend from 0; positions and angles count from the first row. Empty lines and
/// those that begin with # are left out. Throws SceneError with file, line and column.
MotionTable read_motion(const std::string& path);

}  // namespace talus::io
