#include "kernels/detection/skin_escape.hpp"

#include <algorithm>
#include <cmath>

#include "kernels/law/gap_law.hpp"

namespace talus {

namespace {

double need_of(const Bodies& bodies, std::size_t s, const Margins& margins) {
  const double* u = bodies.velocity[s].u;
  return bodies.radius[s] +
         contact_margin(std::sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2]), margins.time_step, margins.alert);
}

constexpr double rounding = 1e-12;

/// The escaped grains that may be near the bodies of a block.
struct NearEscapes {
  std::span<const Escape* const> all;
  double widest;  ///< largest Escape::need among them [m]
};

/// Appends the contacts of body s with the escaped grains to `needed`. True when s is one of these grains.
bool compare(const NearEscapes& escapes, const Bodies& bodies, std::size_t s, const Margins& margins,
             std::vector<Encounter>& needed) {
  bool left = false;
  using Map = Eigen::Map<const Vec3>;
  const Vec3& x = bodies.x[s];
  const double most = std::max(margins.reach_then[s], escapes.widest);
  for (const Escape* escape : escapes.all) {
    const Vec3 d = margins.domain.separation(x, Vec3(Map(escape->x)));
    const double d2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2], near = escape->need + most;
    if (d2 >= near * near) continue;
    const auto id = static_cast<std::int64_t>(bodies.id[s]);
    if (id == escape->id) {
      left = true;
      continue;
    }
    const double distance = std::sqrt(d2), gap = distance - escape->radius - bodies.radius[s];
    const Vec3 v = Map(bodies.velocity[s].u) - Map(escape->u);
    const double v_n = distance > 0 ? d.dot(v) / distance : 0;
    // Rounds otherwise than the narrow phase, and therefore finds a little more than that.
    if (!stays_apart(gap - rounding * distance, v_n, margins.time_step, margins.alert))
      needed.push_back({std::min(id, escape->id), std::max(id, escape->id)});
  }
  return left;
}

/// Appends the features of wall w, which is no plane, that a grain may touch.
void compare_at_surface(const Escape& escape, std::int64_t w, const Wall& wall, const Margins& margins,
                        std::vector<Encounter>& needed) {
  const Vec3 x = Eigen::Map<const Vec3>(escape.x);
  const Vec3 v = Eigen::Map<const Vec3>(escape.u) - wall.velocity_at(x) + margins.time_step * margins.gravity;
  std::vector<SurfacePoint> points;
  collide(wall, x, escape.radius + margins.alert + margins.time_step * v.norm(), points);
  for (const SurfacePoint& point : points)
    if (!stays_apart(point.distance - escape.radius - rounding * std::abs(point.distance),
                     point.normal.dot(v), margins.time_step, margins.alert))
      needed.push_back({-1 - w, escape.id, point.feature});
}

}  // namespace

void find_skin_escapes(SlotRange range, const Bodies& bodies, const Margins& margins,
                       std::vector<Escape>& skin_escapes) {
  for (std::size_t s = range.begin; s < range.end; ++s) {
    const Vec3& x = bodies.x[s];
    const double need = need_of(bodies, s, margins);
    // Its way, as no position is wrapped between two broad phases.
    if (need + (x - margins.x_then[s]).norm() <= margins.reach_then[s]) continue;
    const double* u = bodies.velocity[s].u;
    skin_escapes.push_back({static_cast<std::int64_t>(bodies.id[s]),
                            bodies.radius[s],
                            need,
                            {x[0], x[1], x[2]},
                            {u[0], u[1], u[2]}});
  }
}

void compare_skin_escapes(std::span<const Escape> skin_escapes, const Bodies& bodies,
                          const Candidates& candidates, const Margins& margins,
                          std::vector<Encounter>& needed, std::vector<Encounter>& known) {
  using Map = Eigen::Map<const Vec3>;
  const double h = margins.time_step;
  double widest = 0;
  for (const Escape& escape : skin_escapes) widest = std::max(widest, escape.need);
  std::vector<char> left(bodies.size(), 0);
  std::vector<const Escape*> near;
  constexpr std::size_t block = 64;  // in Morton order, side by side: most escapes are far from all of them
  for (std::size_t begin = 0; begin < bodies.size(); begin += block) {
    const std::size_t end = std::min(begin + block, bodies.size());
    const auto x = std::span(bodies.x).subspan(begin, end - begin);
    Vec3 low = x[0], high = x[0];
    for (const Vec3& p : x) {
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
    // A grain that has not left its margin needs less than its reach at the last broad phase.
    const auto reach = margins.reach_then.subspan(begin, end - begin);
    const double most = std::max(widest, *std::max_element(reach.begin(), reach.end()));
    near.clear();
    for (const Escape& escape : skin_escapes) {
      const Map at(escape.x);
      const double d2 = (at - at.cwiseMin(high).cwiseMax(low)).squaredNorm(), reached = escape.need + most;
      // In a periodic cell any image of the grain may be near.
      if (margins.domain.repeats || !(d2 * (1 - rounding) >= reached * reached)) near.push_back(&escape);
    }
    for (std::size_t s = begin; s < end; ++s)
      if (compare({near, widest}, bodies, s, margins, needed)) left[s] = 1;
  }
  for (const Escape& escape : skin_escapes)
    for (std::size_t w = 0; w < margins.walls.size(); ++w) {
      const Wall& wall = margins.walls[w];
      if (wall.absent) continue;
      if (wall.surface() != nullptr) {
        compare_at_surface(escape, static_cast<std::int64_t>(w), wall, margins, needed);
        continue;
      }
      const double distance = wall.normal.dot(margins.domain.separation(Vec3(Map(escape.x)), wall.point));
      const double v_n = wall.normal.dot(Map(escape.u) - wall.velocity_at(Vec3(Map(escape.x))) - wall.gain +
                                         h * margins.gravity);
      if (!stays_apart(distance - escape.radius - rounding * std::abs(distance), v_n, h, margins.alert))
        needed.push_back({-1 - static_cast<std::int64_t>(w), escape.id});
    }
  const auto id = [&](Slot s) { return static_cast<std::int64_t>(bodies.id[static_cast<std::size_t>(s)]); };
  for (const GrainPair& pair : candidates.grain_pairs)
    if (left[static_cast<std::size_t>(pair.first)] != 0 || left[static_cast<std::size_t>(pair.second)] != 0)
      known.push_back({std::min(id(pair.first), id(pair.second)), std::max(id(pair.first), id(pair.second))});
  for (const WallPair& pair : candidates.wall_pairs)
    if (left[static_cast<std::size_t>(pair.body)] != 0)
      known.push_back({-1 - std::int64_t{pair.wall}, id(pair.body), pair.feature});
}

bool all_known(std::vector<Encounter> needed, std::vector<Encounter> known) {
  std::sort(needed.begin(), needed.end());
  needed.erase(std::unique(needed.begin(), needed.end()), needed.end());
  std::sort(known.begin(), known.end());
  known.erase(std::unique(known.begin(), known.end()), known.end());
  return std::includes(known.begin(), known.end(), needed.begin(), needed.end());
}

}  // namespace talus
