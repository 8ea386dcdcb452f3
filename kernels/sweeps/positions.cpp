#include "kernels/sweeps/positions.hpp"

#include <algorithm>

#include "kernels/bodies/release.hpp"
#include "kernels/detection/touch.hpp"

namespace talus {

namespace {

void exchange_rooms(const Contacts& contacts, SingleState& single, SweepSteps& steps) {
  if (contacts.rx.empty()) return;
  single.contacts.rn.swap(single.contacts.rx);
  steps.n.swap(steps.x);
}

std::size_t index(std::int32_t k) {
  return static_cast<std::size_t>(k);
}

/// Displaces a body by the push of one contact along its normal.
void shift(float push, const float (&n)[3], SingleVelocity& body) {
  for (std::size_t c = 0; c < 3; ++c) body.u[c] += body.inv_mass * push * n[c];
}

float along(const float (&n)[3], const SingleVelocity& body) {
  return n[0] * body.u[0] + n[1] * body.u[1] + n[2] * body.u[2];
}

/// A wall copy as the body that its contacts see.
SingleVelocity as_body(const WallCopy& wall, double unit) {
  SingleVelocity body;
  for (std::size_t a = 0; a < 3; ++a) body.u[a] = static_cast<float>(wall.velocity[a]);
  body.inv_mass = static_cast<float>(wall.inv_mass * unit);
  return body;
}

void take_displacement(const SingleVelocity& body, WallCopy& wall) {
  for (std::size_t a = 0; a < 3; ++a) wall.velocity[a] = static_cast<double>(body.u[a]);
}

/// Work [unit of mass, m^2] of the pushes of a chunk on the displacements of their bodies, and on their
/// biases.
struct PushWork {
  double on_bodies = 0, on_biases = 0;
};

PushWork work_of(const Contacts& contacts, ContactRange range, const SingleState& single,
                 const SingleVelocity* wall) {
  const SingleContacts& c = single.contacts;
  PushWork work;
  for (std::size_t k = range.begin; k < range.end; ++k) {
    if (c.rn[k] == 0) continue;
    const SingleVelocity& second = wall ? *wall : single.velocity[index(contacts.second[k])];
    const float n[3] = {c.nx[k], c.ny[k], c.nz[k]};
    const double push = static_cast<double>(c.rn[k]);
    work.on_bodies +=
        push * static_cast<double>(along(n, single.velocity[index(contacts.first[k])]) - along(n, second));
    work.on_biases += push * static_cast<double>(c.bias[k]);
  }
  return work;
}

/// Multiplies the pushes of a chunk by `factor`, and moves their bodies by what that changes.
void multiply_pushes(const Contacts& contacts, ContactRange range, float factor, SingleState& single,
                     SingleVelocity* wall) {
  SingleContacts& c = single.contacts;
  for (std::size_t k = range.begin; k < range.end; ++k) {
    if (c.rn[k] == 0) continue;
    const float n[3] = {c.nx[k], c.ny[k], c.nz[k]}, change = (factor - 1) * c.rn[k];
    shift(change, n, single.velocity[index(contacts.first[k])]);
    shift(-change, n, wall ? *wall : single.velocity[index(contacts.second[k])]);
    c.rn[k] *= factor;
  }
}

}  // namespace

void begin_positions(const Contacts& contacts, std::span<const Velocity> velocity, SingleState& single,
                     SweepSteps& steps) {
  allocate(single, contacts, velocity.size());
  exchange_rooms(contacts, single, steps);
  resize_anew(single.contacts.rn, contacts.nx.size());
  resize_anew(steps.n, contacts.nx.size());
  for (std::size_t s = 0; s < velocity.size(); ++s) {
    single.velocity[s] = {};
    single.velocity[s].inv_mass = static_cast<float>(single.contacts.unit * velocity[s].inv_mass);
  }
}

void end_positions(const Contacts& contacts, SingleState& single, SweepSteps& steps) {
  exchange_rooms(contacts, single, steps);
}

void find_overlaps(const Contacts& contacts, const Chunks& chunks, std::size_t chunk, const Poses& poses,
                   double part, SingleState& single) {
  const std::size_t begin = index(chunks.begin[chunk]), end = begin + index(contacts.count[chunk]);
  const Wall* const wall = chunks.wall[chunk] < 0 ? nullptr : &poses.walls[index(chunks.wall[chunk])];
  const bool spheres = wall == nullptr && chunks.kind[chunk] != ChunkKind::blocks;
  narrow_geometry(contacts, {begin, end}, single.contacts);
  for (std::size_t k = begin; k < end; ++k) {
    const std::size_t i = index(contacts.first[k]);
    double gap;
    if (spheres) {
      const std::size_t j = index(contacts.second[k]);
      gap = poses.domain.separation(poses.x[i], poses.x[j]).norm() - poses.radius[i] - poses.radius[j];
    } else {
      gap = touch_of(poses, contacts, k, wall).gap;
    }
    single.contacts.bias[k] = static_cast<float>(gap < 0 ? part * gap : gap);
    // Displacements do not drift, neither of images nor of a wall that turns.
    if (!single.contacts.vx.empty())
      single.contacts.vx[k] = single.contacts.vy[k] = single.contacts.vz[k] = 0;
  }
}

void first_pushes(const Contacts& contacts, ContactRange range, std::span<const float> kept, double part,
                  SingleState& single, WallCopy* wall) {
  SingleContacts& c = single.contacts;
  const auto stays = static_cast<float>(1 - part);
  SingleVelocity at_wall = wall ? as_body(*wall, c.unit) : SingleVelocity{};
  for (std::size_t k = range.begin; k < range.end; ++k) {
    const float n[3] = {c.nx[k], c.ny[k], c.nz[k]};
    c.rn[k] = stays * kept[index(contacts.candidate[k])];
    if (c.rn[k] == 0) continue;
    shift(c.rn[k], n, single.velocity[index(contacts.first[k])]);
    shift(-c.rn[k], n, wall ? at_wall : single.velocity[index(contacts.second[k])]);
  }
  if (wall) take_displacement(at_wall, *wall);
}

void lower_pushes(const Contacts& contacts, ContactRange range, double excess, SingleState& single,
                  WallCopy* wall) {
  SingleVelocity at_wall = wall ? as_body(*wall, single.contacts.unit) : SingleVelocity{};
  SingleVelocity* const second = wall ? &at_wall : nullptr;
  const PushWork work = work_of(contacts, range, single, second);
  const double slope = work.on_bodies + work.on_biases;
  if (!(slope > excess * work.on_bodies && work.on_bodies > 0)) return;
  // A second look with half the pushes tells how much of the work they do on bodies that they move.
  multiply_pushes(contacts, range, 0.5F, single, second);
  const double own = 2 * work.on_bodies - 4 * work_of(contacts, range, single, second).on_bodies;
  // Bodies that cannot be moved have pushes that do nothing: those stay.
  const double part = own > 0 ? std::max(0.0, 1 - slope / own) : 1;
  multiply_pushes(contacts, range, static_cast<float>(2 * part), single, second);
  if (wall) take_displacement(at_wall, *wall);
}

void keep_pushes(const Contacts& contacts, const Chunks& chunks, std::size_t chunk, const SingleState& single,
                 std::span<float> kept) {
  const std::size_t begin = index(chunks.begin[chunk]);
  std::fill_n(kept.begin() + chunks.begin[chunk], index(chunks.begin[chunk + 1]) - begin, 0.0F);
  for (std::size_t k = begin; k < begin + index(contacts.count[chunk]); ++k)
    kept[index(contacts.candidate[k])] = single.contacts.rn[k];
}

void sweep_displacements(const Contacts& contacts, ContactRange range, SingleState& single, WallCopy* wall,
                         const SweepMomentum& momentum) {
  SingleContacts& c = single.contacts;
  const auto beta = static_cast<float>(momentum.beta), omega = static_cast<float>(momentum.omega);
  SingleVelocity at_wall = wall ? as_body(*wall, c.unit) : SingleVelocity{};
  for (std::size_t k = range.begin; k < range.end; ++k) {
    SingleVelocity& first = single.velocity[index(contacts.first[k])];
    SingleVelocity& second = wall ? at_wall : single.velocity[index(contacts.second[k])];
    const float n[3] = {c.nx[k], c.ny[k], c.nz[k]}, w = first.inv_mass + second.inv_mass;
    if (w == 0) continue;
    const float from = c.rn[k] + beta * momentum.steps.n[k];
    const float push = std::max(0.0F, from - omega * (along(n, first) - along(n, second) + c.bias[k]) / w);
    shift(push - from, n, first);
    shift(from - push, n, second);
    momentum.steps.n[k] = push - c.rn[k];
    c.rn[k] = push;
  }
  if (wall) take_displacement(at_wall, *wall);
}

void displace(SlotRange range, std::span<const SingleVelocity> displacement, std::span<Vec3> x) {
  for (std::size_t s = range.begin; s < range.end; ++s)
    for (std::size_t c = 0; c < 3; ++c)
      x[s][static_cast<Eigen::Index>(c)] += static_cast<double>(displacement[s].u[c]);
}

}  // namespace talus
