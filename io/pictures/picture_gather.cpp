#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <span>
#include <type_traits>

#include "io/pictures/detail/slab.hpp"
#include "io/pictures/picture.hpp"
#include "io/results/wall_triangles.hpp"
#include "runtime/step/exact_sum.hpp"

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

/// Rows k of the bodies of `part` for which keep(k).
template <class Keep>
Frame bodies_of(const Frame& part, const Keep& keep) {
  Frame kept;
  for (std::size_t k = 0; k < part.id.size(); ++k) {
    if (!keep(k)) continue;
    kept.id.push_back(part.id[k]);
    kept.x.push_back(part.x[k]);
    kept.radius.push_back(part.radius[k]);
    kept.u.push_back(part.u[k]);
    if (!part.material.empty()) kept.material.push_back(part.material[k]);
    if (!part.orientation.empty()) kept.orientation.push_back(part.orientation[k]);
  }
  return kept;
}

/// Rows k of its contacts for which keep(k), behind those that `kept` has.
template <class Keep>
void add_contacts(const Frame& part, const Keep& keep, Frame& kept) {
  for (std::size_t k = 0; k < part.contact_bodies.size(); ++k) {
    if (!keep(k)) continue;
    kept.contact_bodies.push_back(part.contact_bodies[k]);
    kept.contact_point.push_back(part.contact_point[k]);
    kept.contact_normal.push_back(part.contact_normal[k]);
    kept.contact_gap.push_back(part.contact_gap[k]);
    kept.contact_force.push_back(part.contact_force[k]);
  }
}

/// Whether a body is among `ids`, ascending.
bool is_among(std::span<const std::int64_t> ids, std::int64_t id) {
  return std::ranges::binary_search(ids, id);
}

}  // namespace

SampleExtent sample_extent(const Frame& part, const graph::Communicator& ranks) {
  enum { lowest, highest, radius, count };  // the lowest as its negative
  constexpr double nowhere = -std::numeric_limits<double>::infinity();
  std::array<double, count> most{nowhere, nowhere, 0};
  for (std::size_t k = 0; k < part.id.size(); ++k) {
    most[lowest] = std::max(most[lowest], -part.x[k].y());
    most[highest] = std::max(most[highest], part.x[k].y());
    most[radius] = std::max(most[radius], part.radius[k]);
  }
  ranks.max(most);
  ExactSum sum(most[radius]);
  for (const double r : part.radius) sum.add(r);
  std::int64_t grains[1] = {static_cast<std::int64_t>(part.id.size())};
  ranks.sum(grains);
  const double all = sum.over(ranks);
  if (grains[0] == 0) return {.box = grain_bounds(part, ranks)};
  return {grains[0], all / static_cast<double>(grains[0]), -most[lowest], most[highest],
          grain_bounds(part, ranks)};
}

SlabFrame gather_slab(const Frame& part, const graph::Communicator& ranks, double thickness) {
  SlabFrame slab;
  slab.sample = sample_extent(part, ranks);
  Frame& all = slab.frame;
  all.step = part.step;
  all.time = part.time;
  all.stage = part.stage;
  all.domain = part.domain;
  all.walls = part.walls;
  all.with_contacts = part.with_contacts;
  const detail::Slab plane = detail::empty_slab(slab.sample, thickness);
  Frame own = bodies_of(part, [&](std::size_t k) { return plane.holds(part.x[k]); });
  // The first body of a contact stands on the same rank, the second may not.
  add_contacts(
      part, [&](std::size_t k) { return is_among(own.id, part.contact_bodies[k][0]); }, own);
  append_parts(own.id, ranks, all.id);
  append_parts(own.x, ranks, all.x);
  append_parts(own.radius, ranks, all.radius);
  append_parts(own.u, ranks, all.u);
  append_parts(own.material, ranks, all.material);
  append_parts(own.orientation, ranks, all.orientation);
  Frame come;
  append_parts(own.contact_bodies, ranks, come.contact_bodies);
  append_parts(own.contact_point, ranks, come.contact_point);
  append_parts(own.contact_normal, ranks, come.contact_normal);
  append_parts(own.contact_gap, ranks, come.contact_gap);
  append_parts(own.contact_force, ranks, come.contact_force);
  const auto inside = [&](std::size_t k) {
    const std::int64_t second = come.contact_bodies[k][1];
    return second < 0 || is_among(all.id, second);
  };
  add_contacts(come, inside, all);
  return slab;
}

}  // namespace talus::io
