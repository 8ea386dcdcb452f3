#pragma once

/// Which pairs are contacts of an audited step, and with which bias: the audit's own words for what
/// docs/theory.md says under "Gap term and restitution".

#include "kernels/bodies/types.hpp"

namespace talus::audit {

/// A normal that has turned by less at the end of a way is the same.
constexpr double turned_normal = 1e-3;

/// Numbers that decide which pairs are contacts: the time step h [s], the alert distance and that from which
/// an impact turns a pair [m], and the speed up to which it has no restitution [m/s]. E: 0 with Newton's law,
/// else the largest restitution.
struct GapNumbers {
  double h, alert, turning, slow, E;
};

/// Whether bodies carry in the run, where their gap may be rounding and does not tell; `gap_tells` elsewhere.
enum class InRun { gap_tells, carry, do_not };

/// A pair on its way through the step.
struct Approach {
  double gap;     ///< in the middle of the step [m]
  double v_n;     ///< before the step [m/s]
  double v_free;  ///< at its end without contacts [m/s]
  InRun in_run;
};

/// Whether the pair is a contact; then its bias [m/s]. `reach` [m] of cohesion.
bool meets(const GapNumbers& numbers, const Approach& pair, double restitution, double reach, double& bias);

/// Two spheres that pass one another, from the middle of a step to that of the next.
struct Passing {
  Vec3 way;         ///< of the first against the other, with the velocities before the step [m]
  double held;      ///< up to this gap cohesion holds, and the way counts for nothing [m]
  double rounding;  ///< where they pass as near as this it does not tell whether they meet [m]
  bool carries;     ///< whether they do in the run
};

/// Of two spheres that would use up their gap and turn about one another, the gap that leads along `normal`
/// to where they are nearest on their way; else `gap` [m]. `d`: between their centres, along the normal [m].
double gap_on_the_way(const Vec3& normal, double gap, const Vec3& d, const Passing& passing);

}  // namespace talus::audit
