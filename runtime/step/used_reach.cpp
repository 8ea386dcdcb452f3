#include "runtime/step/used_reach.hpp"

#include <algorithm>
#include <array>
#include <span>

namespace talus {

namespace {

/// Where a body is and how it is shaped, as it is sent.
struct PlacedBody {
  std::int64_t id;
  double x[3];
  double radius;
  double orientation[4];
  std::int64_t shape;
};

/// What finding overlaps asks of bodies.
struct PlacedBodies {
  std::vector<BodyId> id;
  std::vector<Vec3> x;
  std::vector<double> radius;
  std::vector<std::array<double, 4>> orientation;  ///< like `shape`
  std::vector<ShapeNumber> shape;                  ///< empty where the scene has no clumps
};

PlacedBody placed(const Bodies& bodies, std::size_t s) {
  PlacedBody body{static_cast<std::int64_t>(bodies.id[s]), {}, bodies.radius[s], {1, 0, 0, 0}, 0};
  std::copy_n(bodies.x[s].data(), 3, body.x);
  if (bodies.shape.empty()) return body;
  std::ranges::copy(bodies.orientation[s], body.orientation);
  body.shape = bodies.shape[s];
  return body;
}

void add(const PlacedBody& body, bool clumps, PlacedBodies& to) {
  to.id.push_back(static_cast<BodyId>(body.id));
  to.x.emplace_back(body.x[0], body.x[1], body.x[2]);
  to.radius.push_back(body.radius);
  if (!clumps) return;
  to.orientation.push_back(std::to_array(body.orientation));
  to.shape.push_back(static_cast<ShapeNumber>(body.shape));
}

/// The bodies of all ranks that have used up their reach, each once, in order of their ids.
std::vector<PlacedBody> bodies_beyond_reach(const StepState& state, const graph::Communicator& ranks) {
  const UsedReach reach(state);
  std::vector<PlacedBody> beyond;
  for (std::size_t s = 0; s < state.bodies.size(); ++s)
    if (reach.used_up(s)) beyond.push_back(placed(state.bodies, s));
  beyond = ranks.gather_records(std::span<const PlacedBody>(beyond));
  std::ranges::sort(beyond, {}, &PlacedBody::id);
  // Not std::ranges::unique: clang 14 does not take libstdc++'s subrange.
  const auto same = [](const PlacedBody& a, const PlacedBody& b) { return a.id == b.id; };
  beyond.erase(std::unique(beyond.begin(), beyond.end(), same), beyond.end());
  return beyond;
}

/// Whether the sphere around a body meets that of any of `others`, itself among them.
bool meets(const StepState& state, std::size_t s, std::span<const PlacedBody> others) {
  return std::ranges::any_of(others, [&](const PlacedBody& other) {
    const double near = state.bodies.radius[s] + other.radius;
    return state.domain.separation(state.bodies.x[s], Eigen::Map<const Vec3>(other.x)).squaredNorm() <=
           near * near;
  });
}

/// The bodies of this rank that `beyond` may touch, or all, and those of `beyond` that others have.
PlacedBodies bodies_to_compare(const StepState& state, std::span<const PlacedBody> beyond, bool all) {
  const bool clumps = !state.clumps.empty();
  PlacedBodies bodies;
  for (std::size_t s = 0; s < state.bodies.size(); ++s)
    if (all || meets(state, s, beyond)) add(placed(state.bodies, s), clumps, bodies);
  std::vector<BodyId> here = bodies.id;
  std::ranges::sort(here);
  for (const PlacedBody& body : beyond)
    if (!std::ranges::binary_search(here, static_cast<BodyId>(body.id))) add(body, clumps, bodies);
  return bodies;
}

}  // namespace

UsedReach::UsedReach(const StepState& state) : state_(state) {
  if (state.domain.flows) flow_.emplace(state.domain, state.flow);
}

bool UsedReach::used_up(std::size_t slot) const {
  const Vec3 &now = state_.bodies.x[slot], &then = state_.x_then[slot];
  const double reach = state_.reach_then[slot],
               moved = flow_ ? flow_->moved(now, then, reach) : (now - then).norm();
  return !(state_.bodies.radius[slot] + moved <= reach);
}

bool any_beyond_reach(const StepState& state, SlotRange range) {
  const UsedReach reach(state);
  for (std::size_t s = range.begin; s < range.end; ++s)
    if (reach.used_up(s)) return true;
  return false;
}

std::vector<PairOverlap> overlaps_with_others(const StepState& state, bool walls_beyond,
                                              const graph::Communicator& ranks) {
  constexpr std::size_t few = 32;  // more of them than that are found faster by the grid of all bodies
  const std::vector<PlacedBody> beyond = bodies_beyond_reach(state, ranks);
  const PlacedBodies bodies = bodies_to_compare(state, beyond, walls_beyond || beyond.size() > few);
  const Poses poses{
      bodies.x, bodies.radius, state.walls, {bodies.shape, bodies.orientation, state.clumps}, state.domain};
  std::vector<PairOverlap> overlaps;
  find_all_overlaps(poses, bodies.id, [&](const FoundOverlap& found) {
    const auto id = [&](Slot slot) {
      return static_cast<std::int64_t>(bodies.id[static_cast<std::size_t>(slot)]);
    };
    overlaps.push_back({found.wall >= 0 ? BodyPair::at_wall(id(found.first), found.wall)
                                        : BodyPair::of_bodies(id(found.first), id(found.second)),
                        found.depth, found.smaller_radius});
  });
  return overlaps;
}

}  // namespace talus
