#include "runtime/step/passages.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "kernels/shapes/region_parts.hpp"

namespace talus {

namespace {

/// How often, less the ways back, a body or an image of it went through a disc or plane. In a cell whose
/// edges stand, and with a plane across an axis (fault_in_cell).
int passage_in(const Domain& domain, const Region& surface, const Vec3& from, const Vec3& to) {
  if (!domain.repeats) return passage(surface, from, to);
  const Vec3 way = domain.separation(to, from);
  int sum = 0;
  const auto add = [&](const Vec3& x) { sum += passage(surface, x - way, x); };
  if (surface.kind == Region::Kind::disc) {
    const Bounds box = bounds_of(surface);
    domain.each_image_in({box.low - way.cwiseAbs(), box.high + way.cwiseAbs()}, to,
                         [&](const Vec3&, const Vec3& x) { add(x); });
    return sum;
  }
  Eigen::Index axis = 0;
  surface.normal.cwiseAbs().maxCoeff(&axis);
  const double edge = domain.edges()[axis];
  if (edge == 0) return passage(surface, from, to);
  const double nearest = std::nearbyint((surface.point - to)[axis] / edge);
  for (const double k : {nearest - 1, nearest, nearest + 1}) add(to + k * edge * Vec3::Unit(axis));
  return sum;
}

}  // namespace

void Passages::begin_step(const StepState& state) {
  const Bodies& bodies = state.bodies;
  before_.clear();
  for (std::size_t s = 0; s < bodies.size(); ++s)
    if (counts(state.decomposition, s))
      before_.push_back(
          {static_cast<std::int64_t>(bodies.id[s]), {bodies.x[s][0], bodies.x[s][1], bodies.x[s][2]}});
}

/// Places before the step of the bodies that count here now, in order of their slots; other ranks are asked
/// for those of bodies that were there.
std::vector<Passages::Place> Passages::places_of(const StepState& state, const graph::Communicator& ranks) {
  std::ranges::sort(before_, {}, &Place::id);
  const auto find = [](const std::vector<Place>& places, std::int64_t id) {
    const auto found = std::ranges::lower_bound(places, id, {}, &Place::id);
    return found != places.end() && found->id == id ? &*found : nullptr;
  };
  std::vector<std::int64_t> missing;
  const Bodies& bodies = state.bodies;
  for (std::size_t s = 0; s < bodies.size(); ++s)
    if (const auto id = static_cast<std::int64_t>(bodies.id[s]);
        counts(state.decomposition, s) && find(before_, id) == nullptr)
      missing.push_back(id);
  std::vector<Place> come;
  if (ranks.ranks() > 1) {
    for (const std::int64_t id : ranks.gather_records(std::span<const std::int64_t>(missing)))
      if (const Place* place = find(before_, id)) come.push_back(*place);
    come = ranks.gather_records(std::span<const Place>(come));
    std::ranges::sort(come, {}, &Place::id);
  }
  std::vector<Place> places;
  for (std::size_t s = 0; s < bodies.size(); ++s) {
    if (!counts(state.decomposition, s)) continue;
    const auto id = static_cast<std::int64_t>(bodies.id[s]);
    const Place* here = find(before_, id);
    places.push_back(here != nullptr ? *here : *find(come, id));
  }
  return places;
}

std::vector<Passage> Passages::end_step(std::span<const ProbeRule> probes, const StepState& state, bool dealt,
                                        const graph::Communicator& ranks) {
  if (dealt) before_ = places_of(state, ranks);
  const Bodies& bodies = state.bodies;
  std::vector<Passage> passages;
  std::size_t place = 0;
  for (std::size_t s = 0; s < bodies.size(); ++s) {
    if (!counts(state.decomposition, s)) continue;
    const Vec3 before(before_[place++].x);
    for (std::size_t p = 0; p < probes.size(); ++p) {
      const int way =
          probes[p].region.is_surface() ? passage_in(state.domain, probes[p].region, before, bodies.x[s]) : 0;
      if (way == 0) continue;
      const double inverse = whole_velocity(state.decomposition, bodies, s).inv_mass;
      passages.push_back({static_cast<std::int64_t>(p), static_cast<std::int64_t>(bodies.id[s]),
                          bodies.material.empty() ? 0 : bodies.material[s], way,
                          inverse > 0 ? 1 / inverse : 0});
    }
  }
  passages = ranks.gather_records(std::span<const Passage>(passages));
  std::ranges::sort(passages, [](const Passage& a, const Passage& b) {
    return std::tie(a.probe, a.id) < std::tie(b.probe, b.id);
  });
  return passages;
}

}  // namespace talus
