#include "kernels/sweeps/single_precision.hpp"

#include <algorithm>
#include <cmath>

#include "kernels/bodies/release.hpp"

namespace talus {

double unit_of_mass(double inv_mass) {
  return std::exp2(-std::ilogb(inv_mass));
}

void allocate(SingleState& single, const Contacts& contacts, std::size_t bodies) {
  SingleContacts& c = single.contacts;
  for (std::vector<float>* part : {&c.nx, &c.ny, &c.nz, &c.bias}) resize_anew(*part, contacts.nx.size());
  for (std::vector<float>* part : {&c.rx, &c.ry, &c.rz}) resize_anew(*part, contacts.rx.size());
  resize_anew(c.rn, contacts.rn.size());
  resize_anew(c.mu, contacts.mu.size());
  for (std::vector<float>* part : {&c.vx, &c.vy, &c.vz}) resize_anew(*part, contacts.vx.size());
  resize_anew(c.reach, contacts.reach.size());
  resize_anew(single.velocity, bodies);
  resize_anew(single.last_v, bodies);
}

namespace {

void round_numbers(const std::vector<double>& from, ContactRange range, double factor,
                   std::vector<float>& to) {
  if (from.empty()) return;
  for (std::size_t k = range.begin; k < range.end; ++k) to[k] = static_cast<float>(factor * from[k]);
}

}  // namespace

void narrow_geometry(const Contacts& contacts, ContactRange range, SingleContacts& single) {
  round_numbers(contacts.nx, range, 1, single.nx);
  round_numbers(contacts.ny, range, 1, single.ny);
  round_numbers(contacts.nz, range, 1, single.nz);
  round_numbers(contacts.bias, range, 1, single.bias);
  round_numbers(contacts.mu, range, 1, single.mu);
  round_numbers(contacts.vx, range, 1, single.vx);
  round_numbers(contacts.vy, range, 1, single.vy);
  round_numbers(contacts.vz, range, 1, single.vz);
  round_numbers(contacts.reach, range, 1, single.reach);
}

void narrow_impulses(const Contacts& contacts, ContactRange range, SingleContacts& single) {
  round_numbers(contacts.rx, range, 1 / single.unit, single.rx);
  round_numbers(contacts.ry, range, 1 / single.unit, single.ry);
  round_numbers(contacts.rz, range, 1 / single.unit, single.rz);
  round_numbers(contacts.rn, range, 1 / single.unit, single.rn);
}

void narrow_bodies(std::span<const Slot> slots, std::span<const Velocity> velocity, SingleState& single) {
  const double unit = single.contacts.unit;
  for (const Slot slot : slots) {
    const auto s = static_cast<std::size_t>(slot);
    const Velocity& from = velocity[s];
    SingleVelocity& to = single.velocity[s];
    for (std::size_t k = 0; k < 3; ++k) {
      to.u[k] = static_cast<float>(from.u[k]);
      to.w[k] = static_cast<float>(from.w[k]);
    }
    to.inv_mass = static_cast<float>(unit * from.inv_mass);
    to.spin_mobility = static_cast<float>(unit * from.spin_mobility);
  }
}

void widen_impulses(const SingleContacts& single, ContactRange range, Contacts& contacts) {
  const auto copy = [&](const std::vector<float>& from, std::vector<double>& to) {
    if (from.empty()) return;
    for (std::size_t k = range.begin; k < range.end; ++k) to[k] = single.unit * static_cast<double>(from[k]);
  };
  copy(single.rx, contacts.rx);
  copy(single.ry, contacts.ry);
  copy(single.rz, contacts.rz);
  copy(single.rn, contacts.rn);
}

void widen_bodies(std::span<const Slot> slots, std::span<const SingleVelocity> single,
                  std::span<Velocity> velocity) {
  for (const Slot slot : slots) {
    const auto s = static_cast<std::size_t>(slot);
    std::copy_n(single[s].u, 3, velocity[s].u);
    std::copy_n(single[s].w, 3, velocity[s].w);
  }
}

void widen_steps(double unit, ContactRange range, SweepSteps& steps) {
  for (std::vector<float>* part : {&steps.x, &steps.y, &steps.z, &steps.n}) {
    if (part->empty()) continue;
    for (std::size_t k = range.begin; k < range.end; ++k)
      (*part)[k] = static_cast<float>(unit * static_cast<double>((*part)[k]));
  }
}

std::size_t memory_used(const SingleState& single) {
  const SingleContacts& c = single.contacts;
  std::size_t numbers = 0;
  for (const std::vector<float>* part :
       {&c.nx, &c.ny, &c.nz, &c.bias, &c.rx, &c.ry, &c.rz, &c.rn, &c.mu, &c.vx, &c.vy, &c.vz, &c.reach})
    numbers += part->capacity();
  return numbers * sizeof(float) +
         sizeof(SingleVelocity) * (single.velocity.capacity() + single.last_v.capacity());
}

}  // namespace talus
