#pragma once

/// What errors of the velocities of bodies that push one another are compared with.

#include <algorithm>
#include <cmath>

namespace talus {

/// By Cauchy and Schwarz: the most momentum [N s] of so much mass [kg] with m |u|^2 of so much [J].
inline double most_momentum(double mass, double energy) {
  return std::sqrt(mass * energy);
}

/// What bodies do in a step, and what is done to them.
struct MomentumSums {
  double mass = 0;       ///< of all of them [kg]
  double incoming = 0;   ///< twice their kinetic energy without contacts [J]
  double exchanged = 0;  ///< momentum that their contacts give [N s]
  double fastest = 0;    ///< largest velocity that a gap or restitution asks for [m/s]
  double drive = 0;      ///< fastest that a wall or flow drives a contact that carries [m/s]
  double at_rest = 0;  ///< what counts at least where nothing is driven: a part of the impulses at walls, as
                       ///< grains pressed at rest gain nothing [N s]
};

/// Momentum [N s], at least `rounding` of what comes in. Contacts change no more than what comes in and what
/// drives, gaps and restitution ask for.
inline double momentum_scale(const MomentumSums& of, double rounding) {
  const double incoming = most_momentum(of.mass, of.incoming), sound = incoming + of.mass * of.fastest;
  return std::max(
      {std::min(of.exchanged, sound), of.drive > 0 ? of.mass * of.drive : of.at_rest, rounding * incoming});
}

}  // namespace talus
