#include "runtime/step/passages.hpp"

#include <algorithm>
#include <tuple>
#include <utility>

#include "kernels/shapes/region_parts.hpp"

namespace talus {

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
      const int way = probes[p].region.is_surface() ? passage(probes[p].region, before, bodies.x[s]) : 0;
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
