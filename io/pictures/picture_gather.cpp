#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <type_traits>

#include "io/pictures/detail/slab.hpp"
#include "io/pictures/picture.hpp"

namespace talus::io {
namespace {

/// Appends the parts of all ranks to `all`, which is wanted on rank 0.
template <class T>
void append_parts(const std::vector<T>& part, const graph::Communicator& ranks, std::vector<T>& all) {
  static_assert(std::is_standard_layout_v<T> && sizeof(T) % 8 == 0, "rows of 8-byte numbers");
  constexpr std::size_t numbers = sizeof(T) / 8;
  using Row = std::array<std::int64_t, numbers>;
  const std::span<const Row> rows(reinterpret_cast<const Row*>(part.data()), part.size());
  ranks.records_to_first(rows, [&](std::span<const Row> piece) {
    const std::size_t before = all.size();
    all.resize(before + piece.size());
    std::memcpy(static_cast<void*>(all.data() + before), piece.data(), piece.size_bytes());
  });
}

/// Contacts k of `part` for which keep(k).
template <class Keep>
Frame contacts_of(const Frame& part, const Keep& keep) {
  Frame kept;
  for (std::size_t k = 0; k < part.contact_bodies.size(); ++k) {
    if (!keep(k)) continue;
    kept.contact_bodies.push_back(part.contact_bodies[k]);
    kept.contact_point.push_back(part.contact_point[k]);
    kept.contact_normal.push_back(part.contact_normal[k]);
    kept.contact_gap.push_back(part.contact_gap[k]);
    kept.contact_force.push_back(part.contact_force[k]);
  }
  return kept;
}

}  // namespace

Frame gather_for_picture(const Frame& part, const graph::Communicator& ranks, const ForcePicture& options) {
  Frame all;
  all.step = part.step;
  all.time = part.time;
  all.stage = part.stage;
  all.domain = part.domain;
  all.walls = part.walls;
  all.with_contacts = part.with_contacts;
  append_parts(part.id, ranks, all.id);
  append_parts(part.x, ranks, all.x);
  append_parts(part.radius, ranks, all.radius);
  append_parts(part.u, ranks, all.u);
  append_parts(part.material, ranks, all.material);
  const detail::Slab slab = detail::cut_slab(all, options.thickness);
  double largest[1] = {0};
  for (double r : part.radius) largest[0] = std::max(largest[0], r);
  ranks.max(largest);
  const double own[2] = {slab.middle, slab.half};
  const std::vector<double> shared = ranks.gather_records(std::span<const double>(own));  // rank 0's first
  // The point of a contact lies between its centres, up to their overlap.
  const Frame near = contacts_of(part, [&](std::size_t k) {
    return std::abs(part.contact_point[k].y() - shared[0]) <= shared[1] + largest[0];
  });
  append_parts(near.contact_bodies, ranks, all.contact_bodies);
  append_parts(near.contact_point, ranks, all.contact_point);
  append_parts(near.contact_normal, ranks, all.contact_normal);
  append_parts(near.contact_gap, ranks, all.contact_gap);
  append_parts(near.contact_force, ranks, all.contact_force);
  return all;
}

}  // namespace talus::io
