#pragma once

/// Frames as the text of a LAMMPS dump, which OVITO, VMD, Pizza.py and LAMMPS' own read_dump take.

#include <cstddef>
#include <string>

#include "runtime/step/frame.hpp"

namespace talus::io {

/// One frame, to be appended to those before it: `ITEM: UNITS` (si), TIME [s], TIMESTEP, NUMBER OF ATOMS, BOX
/// BOUNDS (of the grains, not periodic) and ATOMS with id, type, radius [m], x y z [m], vx vy vz [m/s], and
/// omegax omegay omegaz [rad/s] and quatw quati quatj quatk where the frame has them. LAMMPS counts from 1:
/// id and type are id + 1 and material + 1 of results.h5. Numbers read back to the same bits.
/// A frame of balls (grain_balls.hpp), of which a grain has up to `balls` > 1 behind one another, has id =
/// balls times that of the grain + 1, + 2, ... and a column mol, the grain's id + 1.
/// A frame without grains has the columns of `like`, one of the same file that has some, and a box of 1 m.
std::string lammps_dump(const Frame& frame, std::size_t balls, const Frame& like);
inline std::string lammps_dump(const Frame& frame, std::size_t balls = 1) {
  return lammps_dump(frame, balls, frame);
}

}  // namespace talus::io
