#include "kernels/body_problem.hpp"

#include <algorithm>

#include "kernels/measures.hpp"

namespace talus {

namespace {

std::size_t at(std::int32_t k) {
  return static_cast<std::size_t>(k);
}

BodyUnknown unknown_of_slot(const BodyProblemSource& source, std::size_t slot) {
  const Velocity& v = source.velocity[slot];
  const double m = source.multiplicity.empty() ? 1 : source.multiplicity[slot];
  BodyUnknown body;
  body.mass = m / v.inv_mass;
  body.spin_mass = v.spin_mobility > 0 && !source.free.w.empty() ? m / v.spin_mobility : 0;
  body.x = source.x[slot];
  body.radius = source.radius[slot];
  body.free.u = Eigen::Map<const Vec3>(source.free.u[slot].data());
  if (body.spin_mass > 0) body.free.w = Eigen::Map<const Vec3>(source.free.w[slot].data());
  return body;
}

/// `part` null: all of it.
BodyProblem gather(const BodyProblemSource& source, const BodyProblemPart* part) {
  BodyProblem problem;
  const std::size_t begin_slot = part ? part->begin : 0;
  const std::size_t end_slot = part ? part->end : source.velocity.size();
  problem.grains = end_slot - begin_slot;
  problem.subdomain = part ? part->subdomain : 0;
  problem.bodies.reserve(problem.grains + source.walls.size());
  for (std::size_t slot = begin_slot; slot < end_slot; ++slot) {
    if (part) {
      problem.counts.push_back(part->counts[slot]);
      if (part->multiplicity[slot] > 1)
        problem.shared.push_back(static_cast<std::int32_t>(problem.bodies.size()));
    }
    problem.bodies.push_back(unknown_of_slot(source, slot));
  }
  const auto unknown = [&](Slot slot) { return slot - static_cast<Slot>(begin_slot); };
  std::vector<std::int32_t> wall_unknown(source.walls.size(), -1);
  for (std::size_t w = 0; w < source.walls.size(); ++w) {
    const WallMotion& wall = source.walls[w];
    if (wall.inv_mass == 0) continue;
    wall_unknown[w] = static_cast<std::int32_t>(problem.bodies.size());
    BodyUnknown body;
    body.mass = 1 / wall.inv_mass;
    body.wall = true;
    body.axis = wall.normal;
    body.free.u = wall.normal.dot(wall.free_velocity) * wall.normal;
    if (part) {
      problem.counts.push_back(part->subdomain == 0 ? 1 : 0);
      problem.shared.push_back(wall_unknown[w]);
    }
    problem.bodies.push_back(body);
  }

  const Contacts& contacts = source.contacts;
  const auto here = [&](std::size_t c) { return !part || source.chunks.subdomain[c] == part->local; };
  std::size_t count = 0;
  for (std::size_t c = 0; c < source.chunks.size(); ++c)
    if (here(c)) count += at(contacts.count[c]);
  problem.contacts.reserve(count);
  problem.impulse.reserve(count);
  for (std::size_t c = 0; c < source.chunks.size(); ++c) {
    if (!here(c)) continue;
    const std::int32_t w = source.chunks.wall[c];
    const std::size_t begin = at(source.chunks.begin[c]);
    for (std::size_t k = begin; k < begin + at(contacts.count[c]); ++k) {
      ContactEquation contact;
      contact.normal = contact_normal(contacts, k);
      contact.offset = contacts.bias[k] * contact.normal;
      contact.mu = contacts.rn.empty() ? (w < 0 ? source.mu_grains : source.mu_walls) : 0;
      contact.first = unknown(contacts.first[k]);
      if (w < 0) {
        contact.second = unknown(contacts.second[k]);
      } else {
        contact.second = wall_unknown[at(w)];
        const Vec3& drive = source.walls[at(w)].free_velocity;
        // Of a wall of finite mass only the normal velocity is an unknown.
        contact.offset -=
            contact.second < 0 ? drive : Vec3(drive - problem.bodies[at(contact.second)].free.u);
      }
      contact.place = static_cast<std::int32_t>(k);
      problem.contacts.push_back(contact);
      problem.impulse.push_back(contact_impulse(contacts, k));
    }
  }
  return problem;
}

}  // namespace

BodyProblem gather_problem(const BodyProblemSource& source) {
  return gather(source, nullptr);
}

BodyProblem gather_problem(const BodyProblemSource& source, const BodyProblemPart& part) {
  return gather(source, &part);
}

void scatter_impulses(const BodyProblem& problem, Contacts& contacts) {
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
    const std::size_t place = at(problem.contacts[k].place);
    const Vec3& r = problem.impulse[k];
    if (contacts.rn.empty()) {
      contacts.rx[place] = r[0];
      contacts.ry[place] = r[1];
      contacts.rz[place] = r[2];
    } else {
      contacts.rn[place] = r.dot(problem.contacts[k].normal);
    }
  }
}

std::vector<Twist> velocities_of(const BodyProblem& problem, std::span<const Vec3> impulse) {
  std::vector<Twist> V(problem.bodies.size());
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) add_force(problem.contacts[k], impulse[k], V);
  for (std::size_t b = 0; b < V.size(); ++b) velocity_from_force(problem.bodies[b], V[b]);
  return V;
}

Vec3 project_on_cone(const ContactEquation& c, const Vec3& z) {
  const double z_n = c.normal.dot(z);
  if (c.mu == 0) return std::max(0.0, z_n) * c.normal;
  const Vec3 t = z - z_n * c.normal;
  const double length = t.norm();
  if (c.mu * length <= -z_n) return Vec3::Zero();
  if (length <= c.mu * z_n) return z;
  const double r_n = (z_n + c.mu * length) / (1 + c.mu * c.mu);
  return r_n * c.normal + (c.mu * r_n / length) * t;
}

}  // namespace talus
