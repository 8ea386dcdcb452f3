#include "runtime/step/frame.hpp"

#include <algorithm>

#include "runtime/step/state.hpp"

namespace talus {

namespace {

/// As they travel to rank 0.
struct BodyRow {
  std::int64_t id;
  double x[3], radius, u[3], omega[3];
  double orientation[4];
};
struct ContactRow {
  std::int64_t bodies[2];
  double point[3], normal[3], gap, force[3];
};

void copy3(const Vec3& from, double* to) {
  std::copy_n(from.data(), 3, to);
}
Vec3 vector_of(const double* from) {
  return {from[0], from[1], from[2]};
}

std::vector<BodyRow> body_rows(const StepState& state) {
  const Bodies& bodies = state.bodies;
  std::vector<BodyRow> rows;
  for (std::size_t s = 0; s < bodies.size(); ++s) {
    if (!state.decomposition.counts.empty() && !state.decomposition.counts[s]) continue;
    BodyRow& row = rows.emplace_back();
    row.id = static_cast<std::int64_t>(bodies.id[s]);
    copy3(bodies.x[s], row.x);
    row.radius = bodies.radius[s];
    std::copy_n(bodies.velocity[s].u, 3, row.u);
    for (std::size_t k = 0; k < 3; ++k) row.omega[k] = bodies.velocity[s].w[k] / bodies.radius[s];
    if (!bodies.orientation.empty()) std::copy_n(bodies.orientation[s].data(), 4, row.orientation);
  }
  return rows;
}

std::vector<ContactRow> contact_rows(const StepState& state, double time_step) {
  const Bodies& bodies = state.bodies;
  std::vector<ContactRow> rows;
  for (std::size_t c = 0; c < state.chunks.size(); ++c) {
    const auto begin = static_cast<std::size_t>(state.chunks.begin[c]);
    for (std::size_t k = begin; k < begin + static_cast<std::size_t>(state.contacts.count[c]); ++k) {
      const Vec3 normal = contact_normal(state.contacts, k), impulse = contact_impulse(state.contacts, k);
      if (impulse.dot(normal) <= 0) continue;
      const auto i = static_cast<std::size_t>(state.contacts.first[k]);
      const Slot second = state.contacts.second[k];
      const auto j = static_cast<std::size_t>(std::max(second, 0));
      const auto wall = static_cast<std::size_t>(std::max(state.chunks.wall[c], 0));
      const double gap =
          second >= 0
              ? (bodies.x[i] - bodies.x[j]).norm() - bodies.radius[i] - bodies.radius[j]
              : state.walls[wall].normal.dot(bodies.x[i] - state.walls[wall].point) - bodies.radius[i];
      ContactRow& row = rows.emplace_back();
      row.bodies[0] = static_cast<std::int64_t>(bodies.id[i]);
      row.bodies[1] =
          second >= 0 ? static_cast<std::int64_t>(bodies.id[j]) : -1 - static_cast<std::int64_t>(wall);
      copy3(normal, row.normal);
      copy3(bodies.x[i] - (bodies.radius[i] + 0.5 * gap) * normal, row.point);
      row.gap = gap;
      copy3(impulse / time_step, row.force);
    }
  }
  return rows;
}

template <class Row>
std::vector<Row> on_rank_0(std::vector<Row> rows, const graph::Communicator& ranks) {
  if (ranks.ranks() == 1) return rows;
  std::vector<std::vector<Row>> to(static_cast<std::size_t>(ranks.ranks()));
  to[0] = std::move(rows);
  std::vector<Row> all;
  for (const auto& part : ranks.exchange_records(std::move(to)))
    all.insert(all.end(), part.begin(), part.end());
  return all;
}

}  // namespace

void gather_frame(const StepState& state, const graph::Communicator& ranks, bool rotation, bool contacts,
                  double time_step, Frame& frame) {
  std::vector<BodyRow> bodies = on_rank_0(body_rows(state), ranks);
  std::sort(bodies.begin(), bodies.end(), [](const BodyRow& a, const BodyRow& b) { return a.id < b.id; });
  for (const BodyRow& row : bodies) {
    frame.id.push_back(row.id);
    frame.x.push_back(vector_of(row.x));
    frame.radius.push_back(row.radius);
    frame.u.push_back(vector_of(row.u));
    if (rotation) frame.omega.push_back(vector_of(row.omega));
    if (state.decomposition.orientation)
      frame.orientation.push_back(
          {row.orientation[0], row.orientation[1], row.orientation[2], row.orientation[3]});
  }
  if (!contacts) return;
  std::vector<ContactRow> rows = on_rank_0(contact_rows(state, time_step), ranks);
  std::sort(rows.begin(), rows.end(), [](const ContactRow& a, const ContactRow& b) {
    return a.bodies[0] != b.bodies[0] ? a.bodies[0] < b.bodies[0] : a.bodies[1] < b.bodies[1];
  });
  for (const ContactRow& row : rows) {
    frame.contact_bodies.push_back({row.bodies[0], row.bodies[1]});
    frame.contact_normal.push_back(vector_of(row.normal));
    frame.contact_point.push_back(vector_of(row.point));
    frame.contact_gap.push_back(row.gap);
    frame.contact_force.push_back(vector_of(row.force));
  }
}

}  // namespace talus
