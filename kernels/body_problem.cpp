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

}  // namespace

BodyProblem gather_problem(const BodyProblemSource& source) {
  BodyProblem problem;
  const auto unknown = [&](std::size_t slot) {
    return source.unknown.empty() ? static_cast<Slot>(slot) : source.unknown[slot];
  };
  problem.bodies.reserve(source.velocity.size() + source.walls.size());
  for (std::size_t slot = 0; slot < source.velocity.size(); ++slot)
    if (at(unknown(slot)) == problem.bodies.size()) problem.bodies.push_back(unknown_of_slot(source, slot));
  problem.grains = problem.bodies.size();
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
    problem.bodies.push_back(body);
  }

  const Contacts& contacts = source.contacts;
  std::size_t count = 0;
  for (std::int32_t n : contacts.count) count += at(n);
  problem.contacts.reserve(count);
  problem.impulse.reserve(count);
  for (std::size_t c = 0; c < source.chunks.size(); ++c) {
    const std::int32_t w = source.chunks.wall[c];
    const std::size_t begin = at(source.chunks.begin[c]);
    for (std::size_t k = begin; k < begin + at(contacts.count[c]); ++k) {
      ContactEquation contact;
      contact.normal = contact_normal(contacts, k);
      contact.offset = contacts.bias[k] * contact.normal;
      contact.mu = contacts.rn.empty() ? (w < 0 ? source.mu_grains : source.mu_walls) : 0;
      contact.first = unknown(at(contacts.first[k]));
      if (w < 0) {
        contact.second = unknown(at(contacts.second[k]));
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
  for (std::size_t b = 0; b < V.size(); ++b) {
    const BodyUnknown& body = problem.bodies[b];
    restrict_to_freedoms(body, V[b]);
    V[b].u = body.free.u + V[b].u / body.mass;
    V[b].w = body.spin_mass > 0 ? Vec3(body.free.w + V[b].w / body.spin_mass) : Vec3::Zero();
  }
  return V;
}

double effective_mass(const BodyProblem& problem, const ContactEquation& c) {
  const double w_nn =
      1 / problem.bodies[at(c.first)].mass + (c.second >= 0 ? 1 / problem.bodies[at(c.second)].mass : 0);
  return 1 / w_nn;
}

Vec3 project_on_cone(const Vec3& z, const Vec3& n, double mu) {
  const double z_n = n.dot(z);
  if (mu == 0) return std::max(0.0, z_n) * n;
  const Vec3 t = z - z_n * n;
  const double length = t.norm();
  if (mu * length <= -z_n) return Vec3::Zero();
  if (length <= mu * z_n) return z;
  const double r_n = (z_n + mu * length) / (1 + mu * mu);
  return r_n * n + (mu * r_n / length) * t;
}

double kinetic2(const BodyProblem& problem, std::span<const Twist> x) {
  double sum = 0;
  for (std::size_t b = 0; b < x.size(); ++b)
    sum += problem.bodies[b].mass * x[b].u.squaredNorm() + problem.bodies[b].spin_mass * x[b].w.squaredNorm();
  return sum;
}

std::vector<std::int32_t> heavy_unknowns(const BodyProblem& problem, double ratio) {
  std::vector<double> around(problem.bodies.size(), 0);
  std::vector<int> neighbours(problem.bodies.size(), 0);
  for (const ContactEquation& c : problem.contacts) {
    if (c.second < 0) continue;
    around[at(c.first)] += problem.bodies[at(c.second)].mass;
    around[at(c.second)] += problem.bodies[at(c.first)].mass;
    ++neighbours[at(c.first)];
    ++neighbours[at(c.second)];
  }
  std::vector<std::int32_t> heavy;
  for (std::size_t b = 0; b < problem.bodies.size(); ++b)
    if (neighbours[b] > 0 &&
        (problem.bodies[b].wall || problem.bodies[b].mass * neighbours[b] > ratio * around[b]))
      heavy.push_back(static_cast<std::int32_t>(b));
  return heavy;
}

}  // namespace talus
