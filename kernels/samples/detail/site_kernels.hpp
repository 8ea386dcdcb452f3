#pragma once

/// Interface of the kernels of the deposition: plain pointers, and no functions. The translation unit of an
/// instruction set must include no function that the linker could keep, in that version, for all processors.

#include <cstddef>

namespace talus {

/// Arrays of obstacles end with so many that block nothing, so that vectors may be read behind the last one.
inline constexpr std::size_t obstacle_padding = 8;

/// Obstacles around the youngest grain, seen from it and nearest first: `Obstacle`, an array a component.
/// Those of the padding have e0 = infinity and zeros.
struct ObstacleView {
  const double *dx, *dy, *dz;  ///< [m], or minus the inward normal of a wall
  const double *e0, *e1;
  const double* round;   ///< 1 for a grain, 0 for a wall
  const double* radius;  ///< [m], infinite for a wall
  std::size_t count;     ///< without the padding
  std::size_t floor;     ///< which one is the floor; `count` when none is
};

struct SiteRule {
  double base_radius;        ///< of the youngest grain [m]
  double smallest, largest;  ///< radii that may rest on the site [m]
  double stable_slack;       ///< of keep_stable
  double clear_slack;        ///< of keep_clear [m^2]
};

/// Whether the youngest grain, obstacle `one` and a later obstacle k may carry a grain: possible[k] = 0 where
/// none can touch all three, or none would stay by keep_real, keep_stable or keep_clear, shown by bounds.
/// Pairs with the floor are always possible. `possible` has places for all obstacles and the padding; those
/// up to `one` are not written.
using SieveSites = void (*)(const ObstacleView&, std::size_t one, const SiteRule&, unsigned char* possible);

/// Constants: a function that returns them might itself use instructions that the processor does not have.
extern const SieveSites site_kernels_portable;
extern const SieveSites site_kernels_avx2;  ///< on wider sets too: twice as many lanes gain nothing

}  // namespace talus
