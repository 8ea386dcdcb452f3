#pragma once

/// Frames as the text of a LAMMPS dump, which OVITO, VMD, Pizza.py and LAMMPS' own read_dump take.

#include <string>

#include "runtime/step/frame.hpp"

namespace talus::io {

/// One frame, to be appended to those before it: `ITEM: UNITS` (si), TIME [s], TIMESTEP, NUMBER OF ATOMS, BOX
/// BOUNDS (of the grains, not periodic) and ATOMS with id, type, radius [m], x y z [m], vx vy vz [m/s], and
/// omegax omegay omegaz [rad/s] and quatw quati quatj quatk where the frame has them. LAMMPS counts from 1:
/// id and type are id + 1 and material + 1 of results.h5. Numbers read back to the same bits.
std::string lammps_dump(const Frame& frame);

}  // namespace talus::io
