#include "runtime/step/detail/copies.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <stdexcept>

#include "kernels/bodies/index.hpp"
#include "kernels/bodies/release.hpp"

namespace talus::detail {

namespace {

/// Divisor of the mass of a body for its copy in this subdomain: the number of copies that are swept between
/// two exchanges of it. With subdomain colours those are the copies of one colour; hubs, which are glued once
/// a sweep, are divided by the number of all their copies.
std::int32_t parts_of(const Decomposition& decomposition, Coupling coupling,
                      std::span<const SubdomainId> incidences, SubdomainId subdomain, std::int32_t hubs) {
  const auto m = static_cast<std::int32_t>(incidences.size());
  if (coupling == Coupling::schwarz) return 1;
  if (coupling == Coupling::nscdd || m >= hubs) return m;
  return static_cast<std::int32_t>(std::ranges::count_if(incidences, [&](SubdomainId other) {
    return decomposition.subdomain_colour_of(other) == decomposition.subdomain_colour_of(subdomain);
  }));
}

}  // namespace

std::int32_t hubs_from(const DecompositionSettings& settings) {
  if (settings.exchange == ExchangeScheme::ccs) return 2;
  return settings.coupling == Coupling::alternating ? 33 : 9;
}

void list_copies(Decomposition& decomposition, Coupling coupling, const BodySubdomains& incidences,
                 std::span<const BodyId> id, std::int32_t hubs) {
  decomposition.slot_begin.assign(1, 0);
  decomposition.multiplicity.clear();
  decomposition.parts.clear();
  decomposition.taken.clear();
  decomposition.counts.clear();
  for (const SubdomainInterface& interface : decomposition.interfaces) {
    for (std::size_t k = 0; k < interface.bodies.size(); ++k) {
      const std::size_t b = at(interface.bodies[k]);
      const std::int32_t m = interface.multiplicity[k];
      if (m > std::numeric_limits<std::uint16_t>::max())
        throw std::runtime_error(fmt::format("body {} stands in {} subdomains; use fewer subdomains",
                                             static_cast<std::int64_t>(id[b]), m));
      decomposition.multiplicity.push_back(static_cast<std::uint16_t>(m));
      decomposition.counts.push_back(incidences.of(b).front() == interface.subdomain ? 1 : 0);
      const std::int32_t parts =
          parts_of(decomposition, coupling, incidences.of(b), interface.subdomain, hubs);
      decomposition.parts.push_back(static_cast<std::uint16_t>(parts));
      if (decomposition.subdomain_colour.empty()) continue;
      const bool taken = m < hubs && std::ranges::any_of(incidences.of(b), [&](SubdomainId other) {
                           return decomposition.subdomain_colour_of(other) <
                                  decomposition.subdomain_colour_of(interface.subdomain);
                         });
      decomposition.taken.push_back(taken ? 1 : 0);
    }
    decomposition.slot_begin.push_back(decomposition.multiplicity.size());
  }
}

Bodies make_copies(Decomposition& decomposition, Bodies& around) {
  Bodies copies;
  const auto copy = [&](auto& from, auto& to) {
    to.reserve(decomposition.slot_begin.back());
    for (const SubdomainInterface& interface : decomposition.interfaces)
      for (Slot body : interface.bodies) to.push_back(from[at(body)]);
    release(from);
  };
  copy(around.id, copies.id);
  copy(around.x, copies.x);
  copy(around.radius, copies.radius);
  copy(around.velocity, copies.velocity);
  if (decomposition.orientation) copy(around.orientation, copies.orientation);
  if (decomposition.materials) copy(around.material, copies.material);
  if (decomposition.shapes) copy(around.shape, copies.shape);
  decomposition.whole.clear();
  decomposition.whole.reserve(copies.size());
  for (std::size_t s = 0; s < copies.size(); ++s) {
    Velocity& v = copies.velocity[s];
    decomposition.whole.push_back({v.inv_mass, v.spin_mobility});
    v.inv_mass *= decomposition.parts[s];
    v.spin_mobility *= decomposition.parts[s];
  }
  return copies;
}

std::int64_t arrivals(const Decomposition& decomposition, const Surroundings& around,
                      std::span<const std::size_t> slot_begin) {
  std::int64_t count = 0;
  std::vector<SubdomainPlace> stood_in(around.by_id.size());
  for (const SubdomainPlace e : decomposition.interfaces.indices()) {
    for (std::size_t s = slot_begin[e.at()]; s < slot_begin[e.at() + 1]; ++s)
      if (around.of_slot[s] >= 0) stood_in[at(around.of_slot[s])] = e;
    const std::vector<Slot>& now = decomposition.interfaces[e].bodies;
    count += std::count_if(now.begin(), now.end(), [&](Slot body) { return stood_in[at(body)] != e; });
  }
  return count;
}

}  // namespace talus::detail
