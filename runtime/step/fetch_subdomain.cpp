#include "runtime/step/fetch_subdomain.hpp"

#include <algorithm>
#include <span>
#include <utility>

#include "kernels/sweeps/fetch_lines.hpp"

namespace talus {

void fetch_subdomain(const StepState& state, const AccelerationHistory& acceleration, SubdomainPlace own) {
  const auto fetch = [](std::size_t begin, std::size_t end, const auto&... columns) {
    // A column that this scene has not got is empty.
    (fetch_lines(std::span(std::as_const(columns))
                     .subspan(std::min(begin, columns.size()), columns.size() < end ? 0 : end - begin)),
     ...);
  };
  const Contacts& contacts = state.contacts;
  const SingleContacts& single = state.single.contacts;
  const Decomposition& all = state.decomposition;
  const std::size_t first = all.several() ? all.slots_of(own).begin : 0,
                    last = all.several() ? all.slots_of(own).end : state.bodies.size();
  // Data of single-precision sweeps are fetched last, so that they are nearest in the cache.
  fetch(first, last, state.free.u, state.free.w, state.bodies.velocity, acceleration.last_v,
        acceleration.step_v);
  for (const bool in_single : {false, true})
    for (std::size_t c = 0; c < state.chunks.size(); ++c) {
      if (static_cast<std::size_t>(state.chunks.subdomain[c]) != own.at()) continue;
      const auto begin = static_cast<std::size_t>(state.chunks.begin[c]);
      const std::size_t end = begin + static_cast<std::size_t>(contacts.count[c]);
      if (in_single)
        fetch(begin, end, single.nx, single.ny, single.nz, single.bias, single.rx, single.ry, single.rz,
              single.rn, single.mu, single.vx, single.vy, single.vz, single.reach, acceleration.steps.x,
              acceleration.steps.y, acceleration.steps.z, acceleration.steps.n, contacts.first,
              contacts.second, contacts.group);
      else
        fetch(begin, end, contacts.nx, contacts.ny, contacts.nz, contacts.bias, contacts.rx, contacts.ry,
              contacts.rz, contacts.rn, contacts.mu, contacts.vx, contacts.vy, contacts.vz, contacts.reach);
    }
  fetch(first, last, state.single.velocity, state.single.last_v);
}

}  // namespace talus
