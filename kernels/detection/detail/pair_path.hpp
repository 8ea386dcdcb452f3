#pragma once

/// Where two spheres meet on the ways that they go in a step, of one pair or of several at once: V is a
/// double or a vector of doubles. Internal linkage, as everything in kernels/simd/lanes.hpp.

#include "kernels/simd/lanes.hpp"

namespace talus {

/// The law of a step is linear about one normal (docs/theory.md, "Gap term and restitution").
struct PathThresholds {
  /// A normal that turns by less on the way, > 0, is as good as one that does not: it tells a speed by less
  /// than this part of it.
  double flat = 1e-3;
};

namespace {

/// Whether spheres that are farther apart than cohesion holds them, `held` [m], and would use up their gap,
/// as they change by `way` [m] what lies between their centres, see one another turn on it. `n`: to the
/// first, `far`: between the centres [m], now.
template <class V>
[[gnu::always_inline]] inline decltype(V{} < V{})
    turns_on_path(const Space<V>& n, V gap, V held, const Space<V>& way, V far) {
  constexpr double flat = PathThresholds{}.flat;
  const V along = dot(n, way);
  return (gap > held) & (gap < -along) & (dot(way, way) - along * along > flat * flat * far * far);
}

/// The gap by which the step is to judge such a pair, `gap` unless the spheres pass one another on a straight
/// way: with what leads along the normal it then gives the gap where they are nearest, so that they do not
/// collide. `d`: from the second centre to the first; `touching`: both radii [m]. The normal stays: impulses
/// along another line than that of the centres would turn the pair.
template <class V>
[[gnu::always_inline]] inline V gap_on_path(const Space<V>& n, V gap, const Space<V>& d, const Space<V>& way,
                                            V touching) {
  const V nearest = -dot(d, way) / dot(way, way), part = nearest < 1 ? nearest : V{} + 1.0;
  const Space<V> met = d + part * way;
  const V least = root(dot(met, met));
  return least > touching ? least - touching - dot(n, way) : gap;
}

}  // namespace
}  // namespace talus
