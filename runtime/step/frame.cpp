#include "runtime/step/frame.hpp"

#include <algorithm>
#include <numeric>

#include "kernels/bodies/permute.hpp"
#include "kernels/bodies/release.hpp"
#include "kernels/detection/touch.hpp"
#include "kernels/shapes/clump_motion.hpp"
#include "runtime/step/state.hpp"

namespace talus {

namespace {

/// A body as it is sent.
struct BodyRow {
  std::int64_t id;
  double x[3], radius, u[3], omega[3];
  double orientation[4];
  std::int64_t material;
};
struct ContactRow {
  std::int64_t bodies[2];
  double point[3], normal[3], gap, force[3], moment[3];
};

void copy3(const Vec3& from, double* to) {
  std::copy_n(from.data(), 3, to);
}
Vec3 vector_of(const double* from) {
  return {from[0], from[1], from[2]};
}

/// Rows that one rank sends to all others at a time: bounds the memory of the buffers.
constexpr std::size_t piece = 8192;

BodyRow body_row(const StepState& state, std::size_t s) {
  const Bodies& bodies = state.bodies;
  Vec3 x = bodies.x[s];
  Velocity velocity = bodies.velocity[s];
  if (state.domain.repeats) wrap_body(state.domain, x, velocity);
  BodyRow row{};
  row.id = static_cast<std::int64_t>(bodies.id[s]);
  copy3(x, row.x);
  row.radius = bodies.radius[s];
  std::copy_n(velocity.u, 3, row.u);
  for (std::size_t k = 0; k < 3; ++k) row.omega[k] = bodies.velocity[s].w[k] / bodies.radius[s];
  if (const ClumpView clumps = clumps_of(state); clumps.is_clump(s))
    copy3(turning_of(clumps, s, bodies.radius[s]) * vector_of(bodies.velocity[s].w), row.omega);
  if (!bodies.orientation.empty()) std::copy_n(bodies.orientation[s].data(), 4, row.orientation);
  if (!bodies.material.empty()) row.material = bodies.material[s];
  return row;
}

/// A contact with a force: where it stands, and its chunk.
struct Acting {
  std::int32_t contact, chunk;
};

/// Those that carry, and those that part and are pulled by cohesion alone.
std::vector<Acting> acting_contacts(const StepState& state) {
  std::vector<Acting> acting;
  for (std::size_t c = 0; c < state.chunks.size(); ++c) {
    const std::int32_t begin = state.chunks.begin[c];
    for (std::int32_t k = begin; k < begin + state.contacts.count[c]; ++k) {
      const auto at = static_cast<std::size_t>(k);
      if (is_active(state.contacts, at) || contact_impulse(state.contacts, at) != Vec3::Zero())
        acting.push_back({k, static_cast<std::int32_t>(c)});
    }
  }
  return acting;
}

ContactRow contact_row(const StepState& state, const Acting& acting, double impulse_time) {
  const Bodies& bodies = state.bodies;
  const auto k = static_cast<std::size_t>(acting.contact);
  const Vec3 normal = contact_normal(state.contacts, k), impulse = contact_impulse(state.contacts, k);
  const auto i = static_cast<std::size_t>(state.contacts.first[k]);
  const Slot second = state.contacts.second[k];
  const auto j = static_cast<std::size_t>(std::max(second, 0));
  const std::int32_t wall = state.chunks.wall[static_cast<std::size_t>(acting.chunk)];
  const Touch touch = touch_of(poses_of(state), state.contacts, k,
                               wall < 0 ? nullptr : &state.walls[static_cast<std::size_t>(wall)]);
  ContactRow row{};
  row.bodies[0] = static_cast<std::int64_t>(bodies.id[i]);
  row.bodies[1] =
      second >= 0 ? static_cast<std::int64_t>(bodies.id[j]) : -1 - static_cast<std::int64_t>(wall);
  copy3(normal, row.normal);
  copy3(state.domain.wrap(touch.ball.centre - (touch.ball.radius + 0.5 * touch.gap) * normal), row.point);
  row.gap = touch.gap;
  copy3(impulse / impulse_time, row.force);
  if (!state.contacts.arm.empty()) copy3(contact_moment(state.contacts, k) / impulse_time, row.moment);
  return row;
}

/// First ids of the ranks after the first, so that all get about as many: quantiles of a sample of the ids.
std::vector<std::int64_t> splitters(std::vector<std::int64_t> ids, const graph::Communicator& ranks) {
  const auto n = static_cast<std::size_t>(ranks.ranks());
  if (n == 1) return {};
  std::sort(ids.begin(), ids.end());
  const std::size_t wanted = std::min<std::size_t>(ids.size(), 256);
  std::vector<std::int64_t> sample;
  for (std::size_t k = 0; k < wanted; ++k) sample.push_back(ids[k * ids.size() / wanted]);
  sample = ranks.gather_records(std::span<const std::int64_t>(sample));
  std::sort(sample.begin(), sample.end());
  std::vector<std::int64_t> first;
  for (std::size_t r = 1; r < n; ++r)
    first.push_back(sample.empty() ? 0 : sample[std::min(r * sample.size() / n, sample.size() - 1)]);
  return first;
}

/// Room for `rows` entries of each: growing would copy them, and leave room for as many more.
template <class... Columns>
void reserve(std::size_t rows, Columns&... columns) {
  (columns.reserve(rows), ...);
}

/// Where the rows go that ranks deal out.
struct Dealing {
  std::span<const std::int64_t> first;  ///< first ids of the ranks after the first
  const graph::Communicator& ranks;

  std::size_t rank_of(std::int64_t id) const {
    return static_cast<std::size_t>(std::upper_bound(first.begin(), first.end(), id) - first.begin());
  }
};

/// How many of all rows come here: id_of(k) for k < count of each rank. Collective.
template <class IdOf>
std::size_t rows_here(std::size_t count, const Dealing& dealing, const IdOf& id_of) {
  if (dealing.ranks.ranks() == 1) return count;
  std::vector<std::int64_t> rows(static_cast<std::size_t>(dealing.ranks.ranks()), 0);
  for (std::size_t k = 0; k < count; ++k) ++rows[dealing.rank_of(id_of(k))];
  dealing.ranks.sum(rows);
  return static_cast<std::size_t>(rows[static_cast<std::size_t>(dealing.ranks.rank())]);
}

/// Sends row(k), k < count, to the rank of id_of(k), and calls add(row) for those that come here.
template <class Row, class IdOf, class Add>
void deal_rows(std::size_t count, const Dealing& dealing, const Row& row, const IdOf& id_of, const Add& add) {
  const graph::Communicator& ranks = dealing.ranks;
  if (ranks.ranks() == 1) {
    for (std::size_t k = 0; k < count; ++k) add(row(k));
    return;
  }
  double most[1] = {static_cast<double>(count)};
  ranks.max(most);
  for (std::size_t begin = 0; begin < static_cast<std::size_t>(most[0]); begin += piece) {
    std::vector<std::vector<decltype(row(0))>> to(static_cast<std::size_t>(ranks.ranks()));
    for (std::size_t k = begin; k < std::min(begin + piece, count); ++k)
      to[dealing.rank_of(id_of(k))].push_back(row(k));
    for (const auto& part : ranks.exchange_records(std::move(to)))
      for (const auto& come : part) add(come);
  }
}

/// The order of 0 .. keys - 1 by ascending key.
template <class Key>
std::vector<Slot> ascending(std::span<const Key> keys) {
  std::vector<Slot> order(keys.size());
  std::iota(order.begin(), order.end(), 0);
  // Contacts of one grain with one wall have equal keys, and come from one rank in one order.
  std::stable_sort(order.begin(), order.end(), [&](Slot a, Slot b) {
    return keys[static_cast<std::size_t>(a)] < keys[static_cast<std::size_t>(b)];
  });
  return order;
}

}  // namespace

void fill_frame(const StepState& state, const graph::Communicator& ranks, bool rotation, bool contacts,
                double impulse_time, Frame& frame) {
  frame.domain = state.domain;
  std::vector<std::size_t> counted;
  std::vector<std::int64_t> ids;
  for (std::size_t s = 0; s < state.bodies.size(); ++s) {
    if (!state.decomposition.counts.empty() && !state.decomposition.counts[s]) continue;
    counted.push_back(s);
    ids.push_back(static_cast<std::int64_t>(state.bodies.id[s]));
  }
  const std::vector<std::int64_t> first = splitters(std::move(ids), ranks);
  const Dealing dealing{first, ranks};
  const auto id_of_body = [&](std::size_t k) {
    return static_cast<std::int64_t>(state.bodies.id[counted[k]]);
  };
  const bool orientation = state.decomposition.orientation;
  const std::size_t bodies = rows_here(counted.size(), dealing, id_of_body);
  reserve(bodies, frame.id, frame.x, frame.radius, frame.u);
  if (rotation) frame.omega.reserve(bodies);
  if (orientation) frame.orientation.reserve(bodies);
  if (state.decomposition.materials) frame.material.reserve(bodies);
  deal_rows(
      counted.size(), dealing, [&](std::size_t k) { return body_row(state, counted[k]); }, id_of_body,
      [&](const BodyRow& row) {
        frame.id.push_back(row.id);
        frame.x.push_back(vector_of(row.x));
        frame.radius.push_back(row.radius);
        frame.u.push_back(vector_of(row.u));
        if (rotation) frame.omega.push_back(vector_of(row.omega));
        if (orientation)
          frame.orientation.push_back(
              {row.orientation[0], row.orientation[1], row.orientation[2], row.orientation[3]});
        if (state.decomposition.materials) frame.material.push_back(row.material);
      });
  release(counted);
  const std::vector<Slot> by_id = ascending(std::span<const std::int64_t>(frame.id));
  permute_in_place(frame.id, by_id);
  permute_in_place(frame.x, by_id);
  permute_in_place(frame.radius, by_id);
  permute_in_place(frame.u, by_id);
  permute_in_place(frame.omega, by_id);
  permute_in_place(frame.orientation, by_id);
  permute_in_place(frame.material, by_id);
  if (!contacts) return;
  std::vector<Acting> acting = acting_contacts(state);
  const auto id_of_first = [&](std::size_t k) {
    const auto contact = static_cast<std::size_t>(acting[k].contact);
    return static_cast<std::int64_t>(
        state.bodies.id[static_cast<std::size_t>(state.contacts.first[contact])]);
  };
  const std::size_t rows = rows_here(acting.size(), dealing, id_of_first);
  reserve(rows, frame.contact_bodies, frame.contact_normal, frame.contact_point, frame.contact_gap,
          frame.contact_force);
  // Of the law, as a rank without contacts gets those of others.
  const bool rolling = state.candidates.impulse.kind() == ImpulseKind::rolling;
  if (rolling) frame.contact_moment.reserve(rows);
  deal_rows(
      acting.size(), dealing, [&](std::size_t k) { return contact_row(state, acting[k], impulse_time); },
      id_of_first,
      [&](const ContactRow& row) {
        frame.contact_bodies.push_back({row.bodies[0], row.bodies[1]});
        frame.contact_normal.push_back(vector_of(row.normal));
        frame.contact_point.push_back(vector_of(row.point));
        frame.contact_gap.push_back(row.gap);
        frame.contact_force.push_back(vector_of(row.force));
        if (rolling) frame.contact_moment.push_back(vector_of(row.moment));
      });
  release(acting);
  const std::vector<Slot> by_ids =
      ascending(std::span<const std::array<std::int64_t, 2>>(frame.contact_bodies));
  permute_in_place(frame.contact_bodies, by_ids);
  permute_in_place(frame.contact_normal, by_ids);
  permute_in_place(frame.contact_point, by_ids);
  permute_in_place(frame.contact_gap, by_ids);
  permute_in_place(frame.contact_force, by_ids);
  permute_in_place(frame.contact_moment, by_ids);
}

}  // namespace talus
