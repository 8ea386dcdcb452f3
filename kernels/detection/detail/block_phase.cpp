#include "kernels/detection/detail/block_phase.hpp"

#include <Eigen/Geometry>
#include <vector>

#include "kernels/bodies/index.hpp"
#include "kernels/detection/detail/pair_path.hpp"
#include "kernels/detection/detail/passing.hpp"
#include "kernels/detection/detail/path_touch.hpp"
#include "kernels/detection/materials.hpp"
#include "kernels/detection/touch.hpp"
#include "kernels/shapes/clump_motion.hpp"
#include "kernels/simd/contact_view.hpp"

namespace talus::detail {

namespace {

/// B of a body whose surface at `arm` from its centre of mass moves with u + omega x arm = u + B w.
Mat3 lever_of(const NarrowPhase& in, Slot slot, const Vec3& arm) {
  Mat3 lever;
  const Mat3 turning = turning_of(in.clumps, at(slot), in.radius[at(slot)]);
  for (Eigen::Index c = 0; c < 3; ++c) lever.col(c) = turning.col(c).cross(arm);
  return lever;
}

Vec3 velocity_at(const NarrowPhase& in, Slot slot, const Mat3& lever) {
  const Velocity& v = in.velocity[at(slot)];
  return Eigen::Map<const Vec3>(v.u) + lever * Eigen::Map<const Vec3>(v.w);
}

/// A candidate before its law is evaluated.
struct Meeting {
  Touch touch;  ///< at a surface as touch_on_path has it
  Levers levers;
  Vec3 v = Vec3::Zero();     ///< of the first body's surface from the other's, as the step begins [m/s]
  Vec3 fall = Vec3::Zero();  ///< change of v in the step without contacts [m/s]
  Slot first = 0, second = 0;
  BallNumbers balls = 0;
  bool passed = false;
  SurfacePoint seen = {};  ///< at a surface: from the middle of the step
  double reach = 0;        ///< there: how far features can be that the ball may touch in it [m]
};

/// The gap of two bodies by the straight ways of the centres of their balls (pair_path.hpp) [m], which have
/// the velocity of the contact along the normal. `between`: from the second body to the first [m]; `images`:
/// velocity of that [m/s]; `held`: how far cohesion reaches [m].
double gap_on_path(const NarrowPhase& in, const Vec3& between, const Vec3& images, double held,
                   const Meeting& meeting) {
  const Touch& touch = meeting.touch;
  if (!(touch.gap > held && touch.gap < -in.time_step * touch.normal.dot(meeting.v))) return touch.gap;
  const Vec3 arm = touch.ball.centre - in.x[at(meeting.first)], other = arm - touch.separation + between;
  const Vec3 way =
      in.time_step * (velocity_at(in, meeting.first, lever_of(in, meeting.first, arm)) -
                      velocity_at(in, meeting.second, lever_of(in, meeting.second, other)) - images);
  const auto space = [](const Vec3& v) { return Space<double>{v[0], v[1], v[2]}; };
  const double far = touch.separation.norm();
  if (!turns_on_path(space(touch.normal), touch.gap, held, space(way), far)) return touch.gap;
  return talus::gap_on_path(space(touch.normal), touch.gap, space(touch.separation), space(way),
                            far - touch.gap);
}

Meeting meet(const NarrowPhase& in, const Poses& poses, const GrainPair& pair, BallNumbers balls,
             double reach) {
  Meeting meeting{
      touch_bodies(poses, pair.first, pair.second, balls), {}, {}, {}, pair.first, pair.second, balls};
  Touch& touch = meeting.touch;
  const Vec3 between = in.domain.separation(in.x[at(pair.first)], in.x[at(pair.second)]),
             images = in.domain.image_velocity(in.x[at(pair.first)], in.x[at(pair.second)]);
  // Both arms lead to the same point, so that angular momentum is kept across a gap, too.
  const Vec3 arm = touch.point - in.x[at(pair.first)];
  meeting.levers = {lever_of(in, pair.first, arm), lever_of(in, pair.second, arm + between), arm};
  meeting.v = velocity_at(in, pair.first, meeting.levers.first) -
              velocity_at(in, pair.second, meeting.levers.second) - images;
  meeting.passed = passed(touch.separation, in.time_step * meeting.v, touch.separation.norm() - touch.gap,
                          touch.smaller_radius, deep_of_blocks);
  touch.gap = gap_on_path(in, between, images, reach * touch.smaller_radius, meeting);
  return meeting;
}

Meeting meet(const NarrowPhase& in, const Poses& poses, const WallPair& pair, double reach) {
  const Wall& wall = in.walls[at(pair.wall)];
  Meeting meeting{touch_wall(poses, wall, pair.body, pair.feature), {}, {}, {}, pair.body, -1 - pair.feature};
  Touch& touch = meeting.touch;
  meeting.fall = in.time_step * in.gravity - wall.gain;
  if (wall.surface() != nullptr) {
    const Ball& ball = touch.ball;
    const Vec3 u = velocity_at(in, pair.body, lever_of(in, pair.body, ball.centre - in.x[at(pair.body)]));
    // Behind a thin surface, and in a solid, the point where the ball is near it now tells nothing.
    meeting.passed =
        passed_surface(wall, ball.centre, in.time_step * (u - wall.came_at(ball.centre)), ball.radius);
    const auto balls = static_cast<std::int32_t>(in.clumps.balls(at(pair.body)));
    meeting.seen = {pair.feature / balls, touch.gap + ball.radius, touch.normal};
    const Vec3 way = in.time_step * (u - wall.velocity_at(ball.centre)),
               loaded = way + in.time_step * meeting.fall;
    meeting.reach = ball.radius + in.alert + loaded.norm();
    const SurfacePoint met =
        touch_on_path(wall, ball.centre, ball.radius, {way, loaded, reach * ball.radius}, meeting.seen);
    if (met.distance != meeting.seen.distance || met.normal != meeting.seen.normal) {
      touch.normal = met.normal;
      touch.gap = met.distance - ball.radius;
      touch.point = ball.centre - ball.radius * met.normal;
    }
  }
  meeting.levers.arm = touch.point - in.x[at(pair.body)];
  meeting.levers.first = lever_of(in, pair.body, meeting.levers.arm);
  const Vec3 u = velocity_at(in, pair.body, meeting.levers.first);
  meeting.v = u - wall.velocity_at(touch.point);
  if (wall.surface() != nullptr) return meeting;
  // The wall counts as the surface of a body as large as the ball.
  const double way = in.time_step * touch.normal.dot(u - wall.came_at(touch.point));
  meeting.passed = std::min(0.0, touch.gap - way) - touch.gap > 0.5 * touch.smaller_radius;
  return meeting;
}

/// Whether a surface has, for this ball and in this step, the feature of the candidate: near an edge another
/// feature may count instead (kernels/shapes/surface.hpp).
bool has_feature(const NarrowPhase& in, const WallPair& pair, const Meeting& meeting) {
  const Wall& wall = in.walls[at(pair.wall)];
  if (wall.surface() == nullptr) return true;
  std::vector<SurfacePoint> points;
  collide(wall, meeting.touch.ball.centre, meeting.reach, points);
  return std::ranges::find(points, meeting.seen.feature, &SurfacePoint::feature) != points.end();
}

/// at_seam, of a ball.
bool touches_another(const NarrowPhase& in, const WallPair& pair, const Meeting& meeting) {
  if (in.walls[at(pair.wall)].surface() == nullptr) return false;
  const Ball& ball = meeting.touch.ball;
  return at_seam(in.walls, at(pair.wall), ball.centre, ball.radius, meeting.seen);
}

/// Of the wall's material; all contacts of a clump go where its centre goes, so that what turns with the wall
/// in several points need not change its shape.
Vec3 drift_of(const NarrowPhase& in, const Wall& wall, const Meeting& meeting) {
  const Touch& touch = meeting.touch;
  const Eigen::Map<const Vec3> u(in.velocity[at(meeting.first)].u);
  return wall.drift_at(touch.point, touch.normal, wall.half_way(touch.point, touch.normal, u, in.time_step));
}

void write(const Meeting& meeting, double bias, std::size_t candidate, std::size_t place,
           Contacts& contacts) {
  contacts.nx[place] = meeting.touch.normal[0];
  contacts.ny[place] = meeting.touch.normal[1];
  contacts.nz[place] = meeting.touch.normal[2];
  contacts.bias[place] = bias;
  contacts.levers[place] = meeting.levers;
  contacts.balls[place] = meeting.balls;
  contacts.first[place] = meeting.first;
  contacts.second[place] = meeting.second;
  contacts.candidate[place] = static_cast<std::int32_t>(candidate);
}

}  // namespace

void close_groups(const Chunks& chunks, std::size_t chunk, std::size_t end, Contacts& contacts) {
  const std::size_t begin = at(chunks.begin[chunk]);
  contacts.count[chunk] = static_cast<std::int32_t>(end - begin);
  std::uint8_t* size = contacts.group.data() + begin;
  for (std::size_t k = begin; k < end; k += group_size)
    *size++ = static_cast<std::uint8_t>(std::min(group_size, end - k));
}

void narrow_blocks(const NarrowPhase& in, const GapRule& rule, const Candidates& candidates,
                   const Chunks& chunks, std::size_t chunk, Contacts& contacts) {
  const std::size_t grains = candidates.grain_pairs.size(), begin = at(chunks.begin[chunk]);
  const Poses poses{in.x, in.radius, in.walls, in.clumps, in.domain};
  const MaterialView materials{in.material, in.walls};
  std::int32_t through = 0;
  std::size_t place = begin;
  for (std::size_t k = begin; k < at(chunks.begin[chunk + 1]); ++k) {
    const bool wall = k >= grains;
    const PairLaw& law = law_at(in.laws, candidates, materials, k);
    const Meeting meeting =
        wall ? meet(in, poses, candidates.wall_pairs[k - grains], law.reach())
             : meet(in, poses, candidates.grain_pairs[k], candidates.balls[k], law.reach());
    through += meeting.passed ? 1 : 0;
    if (wall && !has_feature(in, candidates.wall_pairs[k - grains], meeting)) continue;
    const double v_n = meeting.touch.normal.dot(meeting.v);
    const GapResult<double> found =
        solve_gap(rule, meeting.touch.gap, v_n, v_n + meeting.touch.normal.dot(meeting.fall), law.restitution,
                  law.reach() * meeting.touch.smaller_radius);
    if (found.absent || (wall && touches_another(in, candidates.wall_pairs[k - grains], meeting))) continue;
    if (wall && !contacts.vx.empty())
      set_drift(contacts, place, drift_of(in, in.walls[at(chunks.wall[chunk])], meeting));
    if (!wall && in.domain.flows)
      set_drift(contacts, place, in.domain.image_drift(in.x[at(meeting.first)], in.x[at(meeting.second)]));
    write(meeting, found.bias, k, place++, contacts);
  }
  contacts.passed[chunk] = through;
  close_groups(chunks, chunk, place, contacts);
}

}  // namespace talus::detail
