#include "kernels/global/body_problem.hpp"

#include <algorithm>
#include <utility>

#include "kernels/bodies/index.hpp"
#include "kernels/detection/materials.hpp"
#include "kernels/detection/measures.hpp"

namespace talus {

namespace {

/// Mass of a body over that of its copy at a slot.
double masses_of_slot(const BodyProblemSource& source, std::size_t slot) {
  return source.parts.empty() ? 1 : source.parts[slot];
}

double mass_of_slot(const BodyProblemSource& source, std::size_t slot) {
  return masses_of_slot(source, slot) / source.velocity[slot].inv_mass;
}

BodyUnknown unknown_of_slot(const BodyProblemSource& source, std::size_t slot) {
  const Velocity& v = source.velocity[slot];
  BodyUnknown body;
  body.mass = mass_of_slot(source, slot);
  if (v.spin_mobility > 0 && !source.free.w.empty())
    body.spin_mass = masses_of_slot(source, slot) / v.spin_mobility;
  body.x = source.x[slot];
  body.radius = source.radius[slot];
  body.free.u = Eigen::Map<const Vec3>(source.free.u[slot].data());
  if (body.spin_mass > 0) body.free.w = Eigen::Map<const Vec3>(source.free.w[slot].data());
  return body;
}

BodyUnknown unknown_of_wall(const WallMotion& wall) {
  BodyUnknown body;
  body.mass = 1 / wall.inv_mass;
  body.wall = true;
  body.axis = wall.normal;
  body.free.u = wall.normal.dot(wall.free_velocity) * wall.normal;
  return body;
}

BodyUnknown unknown_of_cell(const CellMotion& cell) {
  BodyUnknown body;
  body.mass = body.spin_mass = cell.mass;
  body.radius = cell.edge;
  body.axis = cell.stretches;
  body.shears = cell.shears;
  body.cell = true;
  return body;
}

/// Slots of `part`, or of the whole problem where that is null.
std::array<std::size_t, 2> slots_of(const BodyProblemSource& source, const BodyProblemPart* part) {
  return part ? std::array{part->begin, part->end} : std::array{std::size_t{0}, source.velocity.size()};
}

template <class Visit>
void each_chunk(const BodyProblemSource& source, const BodyProblemPart* part, const Visit& visit) {
  for (std::size_t c = 0; c < source.chunks.size(); ++c)
    if (!part || source.chunks.subdomain[c] == part->local) visit(c);
}

/// Calls visit(chunk, contact) in order.
template <class Visit>
void each_contact(const BodyProblemSource& source, const BodyProblemPart* part, const Visit& visit) {
  each_chunk(source, part, [&](std::size_t c) {
    const std::size_t begin = at(source.chunks.begin[c]);
    for (std::size_t k = begin; k < begin + at(source.contacts.count[c]); ++k) visit(c, k);
  });
}

ContactGraph graph_of(const BodyProblemSource& source, const BodyProblemPart* part) {
  ContactGraph graph;
  const auto [begin, end] = slots_of(source, part);
  graph.subdomain = part ? part->subdomain : 0;
  graph.mass.reserve(end - begin + source.walls.size());
  for (std::size_t slot = begin; slot < end; ++slot) {
    if (part) {
      graph.counts.push_back(part->counts[slot]);
      if (part->multiplicity[slot] > 1) graph.shared.push_back(static_cast<std::int32_t>(graph.mass.size()));
    }
    graph.mass.push_back(mass_of_slot(source, slot));
  }
  std::vector<std::int32_t> wall_unknown(source.walls.size(), -1);
  for (std::size_t w = 0; w < source.walls.size(); ++w) {
    if (source.walls[w].inv_mass == 0) continue;
    wall_unknown[w] = static_cast<std::int32_t>(graph.mass.size());
    if (part) {
      graph.counts.push_back(part->subdomain == 0 ? 1 : 0);
      graph.shared.push_back(wall_unknown[w]);
    }
    graph.mass.push_back(1 / source.walls[w].inv_mass);
  }
  if (source.cell.mass > 0) {
    if (part) {
      graph.counts.push_back(part->subdomain == 0 ? 1 : 0);
      graph.shared.push_back(static_cast<std::int32_t>(graph.mass.size()));
    }
    graph.mass.push_back(source.cell.mass);
  }
  const auto first_slot = static_cast<Slot>(begin);
  std::size_t count = 0;
  each_chunk(source, part, [&](std::size_t c) { count += at(source.contacts.count[c]); });
  graph.pairs.reserve(count);
  each_contact(source, part, [&](std::size_t c, std::size_t k) {
    const std::int32_t w = source.chunks.wall[c];
    graph.pairs.push_back({source.contacts.first[k] - first_slot,
                           w < 0 ? source.contacts.second[k] - first_slot : wall_unknown[at(w)]});
  });
  return graph;
}

/// Adds what the moment of contact k does to the bodies of the last contact of `problem`.
void add_moment(const Contacts& contacts, std::size_t k, BodyProblem& problem) {
  const ContactEquation& contact = problem.contacts.back();
  const Vec3 moment(contacts.mx[k], contacts.my[k], contacts.mz[k]);
  const auto turn = [&](std::int32_t body, double sign) {
    if (body < 0 || problem.bodies[at(body)].wall) return;
    problem.known[at(body)].w += sign / problem.bodies[at(body)].radius * moment;
  };
  turn(contact.first, 1);
  turn(contact.second, -1);
}

/// The speed at which the flow of a cell moves two touching bodies against one another [m/s]: that of the
/// image's drift, scaled from the distance of the image to theirs.
double drive_of_flow(const BodyProblem& problem, const ContactEquation& contact, const Vec3& drift) {
  if (drift == Vec3::Zero()) return 0;
  const BodyUnknown &a = problem.bodies[at(contact.first)], &b = problem.bodies[at(contact.second)];
  const double near = a.radius + b.radius, far = (a.x - b.x - near * contact.normal).norm();
  return far > 0 ? drift.norm() * near / far : 0;
}

BodyProblem gather(const BodyProblemSource& source, const BodyProblemPart* part) {
  ContactGraph graph = graph_of(source, part);
  BodyProblem problem;
  problem.subdomain = graph.subdomain;
  problem.counts = std::move(graph.counts);
  problem.shared = std::move(graph.shared);
  const auto [begin, end] = slots_of(source, part);
  problem.grains = end - begin;
  problem.bodies.reserve(graph.mass.size());
  for (std::size_t slot = begin; slot < end; ++slot) problem.bodies.push_back(unknown_of_slot(source, slot));
  for (const WallMotion& wall : source.walls)
    if (wall.inv_mass != 0) problem.bodies.push_back(unknown_of_wall(wall));
  if (source.cell.mass > 0) problem.bodies.push_back(unknown_of_cell(source.cell));

  const Contacts& contacts = source.contacts;
  problem.contacts.reserve(graph.pairs.size());
  problem.impulse.reserve(graph.pairs.size());
  each_contact(source, part, [&](std::size_t c, std::size_t k) {
    const std::int32_t w = source.chunks.wall[c];
    const std::array<std::int32_t, 2>& pair = graph.pairs[problem.contacts.size()];
    ContactEquation contact;
    contact.normal = contact_normal(contacts, k);
    contact.offset = contacts.bias[k] * contact.normal;
    contact.mu = friction_of(source.laws, source.chunks, c, contacts, k);
    contact.first = pair[0];
    contact.second = pair[1];
    if (w >= 0) {
      const Vec3 drive = source.walls[at(w)].free_velocity + drift_of(contacts, k);
      // Of a wall of finite mass only the normal velocity is an unknown.
      // A wall that stretches with a flow moves nothing against the grains, which flow too.
      if (contact.second < 0)
        contact.drive = contacts.drifts_between ? source.walls[at(w)].free_velocity.norm() : drive.norm();
      contact.offset -= contact.second < 0 ? drive : Vec3(drive - problem.bodies[at(contact.second)].free.u);
    }
    if (w < 0 && contacts.drifts_between) {
      const Vec3 drift = drift_of(contacts, k);
      contact.drive = drive_of_flow(problem, contact, drift);
      contact.offset -= drift;
    }
    if (source.cell.mass > 0) {
      contact.cell = static_cast<std::int32_t>(problem.bodies.size()) - 1;
      contact.reach = w < 0 ? contacts.reach[k] : 0;
    }
    contact.place = static_cast<std::int32_t>(k);
    contact.wall = w;
    if (source.chunks.kind[c] == ChunkKind::blocks) contact.levers = &contacts.levers[k];
    problem.contacts.push_back(contact);
    problem.impulse.push_back(law_impulse(contacts, k));
    if (!contacts.cohesion.empty() || !contacts.arm.empty()) problem.known.resize(problem.bodies.size());
    if (!contacts.arm.empty()) add_moment(contacts, k, problem);
    if (!contacts.cohesion.empty()) {
      add_force(problem.contacts.back(), -contacts.cohesion[k] * contact.normal, problem.known);
    }
  });
  return problem;
}

}  // namespace

ContactGraph graph_of(const BodyProblem& problem) {
  ContactGraph graph;
  for (const BodyUnknown& body : problem.bodies) graph.mass.push_back(body.mass);
  for (const ContactEquation& c : problem.contacts) graph.pairs.push_back({c.first, c.second});
  graph.subdomain = problem.subdomain;
  graph.counts = problem.counts;
  graph.shared = problem.shared;
  return graph;
}

ContactGraph gather_graph(const BodyProblemSource& source) {
  return graph_of(source, nullptr);
}

ContactGraph gather_graph(const BodyProblemSource& source, const BodyProblemPart& part) {
  return graph_of(source, &part);
}

BodyProblem gather_problem(const BodyProblemSource& source) {
  return gather(source, nullptr);
}

BodyProblem gather_problem(const BodyProblemSource& source, const BodyProblemPart& part) {
  return gather(source, &part);
}

void keep_contacts(BodyProblem& problem, std::span<const char> taken) {
  std::size_t kept = 0;
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
    if (taken[at(problem.contacts[k].first)] == 0) continue;
    problem.contacts[kept] = problem.contacts[k];
    problem.impulse[kept++] = problem.impulse[k];
  }
  problem.contacts.resize(kept);
  problem.impulse.resize(kept);
}

void scatter_impulses(const BodyProblem& problem, Contacts& contacts) {
  for (std::size_t k = 0; k < problem.contacts.size(); ++k)
    set_law_impulse(contacts, at(problem.contacts[k].place), problem.impulse[k]);
}

std::vector<Twist> velocities_of(const BodyProblem& problem, std::span<const Vec3> impulse) {
  std::vector<Twist> V(problem.bodies.size());
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) add_force(problem.contacts[k], impulse[k], V);
  for (std::size_t b = 0; b < V.size(); ++b) velocity_from_force(problem.bodies[b], V[b]);
  return V;
}

}  // namespace talus
