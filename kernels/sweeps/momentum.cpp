#include "kernels/sweeps/momentum.hpp"

#include <algorithm>
#include <bit>

#include "kernels/bodies/release.hpp"

namespace talus {

namespace {

/// Carries one number on. With beta = 0 the history is not read: it may mean nothing yet.
inline void carry_one(Carry carry, double beta, double& value, double& last, double* step) {
  if (carry == Carry::momentum) {
    const double s = value;
    if (beta != 0) value = s + beta * (s - last);
    last = s;
    return;
  }
  if (beta != 0) {
    value += beta * *step;
    *step = value - last;
  } else {
    *step = 0;
  }
  last = value;
}

template <std::size_t N>
void carry_numbers(Carry carry, double beta, double* values, std::array<double, N>& last, double* step,
                   std::size_t count) {
  for (std::size_t k = 0; k < count; ++k)
    carry_one(carry, beta, values[k], last[k], step ? step + k : nullptr);
}

using Record = std::array<double, record_numbers>;

/// Masses, equal in both, come back to the bit: m - m = 0, 0 + m = m.
template <int Sign, class Number>
void add_records(std::span<const Slot> slots, const std::vector<VelocityOf<Number>>& from,
                 std::vector<VelocityOf<Number>>& to) {
  using Numbers = std::array<Number, record_numbers>;
  for (const Slot slot : slots) {
    const auto s = static_cast<std::size_t>(slot);
    auto sum = std::bit_cast<Numbers>(to[s]);
    const auto add = std::bit_cast<Numbers>(from[s]);
    for (std::size_t k = 0; k < record_numbers; ++k) sum[k] += Sign * add[k];
    to[s] = std::bit_cast<VelocityOf<Number>>(sum);
  }
}

template <class Impulses>
std::size_t bytes(const Impulses& impulses) {
  return sizeof(impulses.x[0]) *
         (impulses.x.capacity() + impulses.y.capacity() + impulses.z.capacity() + impulses.n.capacity());
}

}  // namespace

void allocate(AccelerationHistory& acceleration, Carry carry, const Contacts& contacts,
              const AccelerationRoom& room) {
  const auto& [bodies, chunks, cell_copies] = room;
  const auto like = [&](auto& impulses) {
    resize_anew(impulses.x, contacts.rx.size());
    resize_anew(impulses.y, contacts.ry.size());
    resize_anew(impulses.z, contacts.rz.size());
    resize_anew(impulses.n, contacts.rn.size());
  };
  if (bodies > 0) resize_anew(acceleration.last_v, bodies);  // else a sweep in flight may still read it
  acceleration.last_wall_v.resize(chunks);
  acceleration.last_cell_v.resize(cell_copies);
  if (carry == Carry::momentum) return like(acceleration.steps);
  like(acceleration.last);
  like(acceleration.step);
  resize_anew(acceleration.step_v, bodies);
  acceleration.step_wall_v.resize(chunks);
  acceleration.step_cell_v.resize(cell_copies);
}

void begin_steps(ContactRange range, SweepSteps& steps) {
  const std::size_t count = range.end - range.begin;
  for (std::vector<float>* part : {&steps.x, &steps.y, &steps.z, &steps.n})
    if (!part->empty()) std::fill_n(part->begin() + static_cast<std::ptrdiff_t>(range.begin), count, 0.0F);
}

void carry_impulses(double beta, ContactRange range, Contacts& contacts, AccelerationHistory& acceleration) {
  const auto carry = [&](std::vector<double>& values, std::vector<double>& last, std::vector<double>& step) {
    for (std::size_t k = range.begin; k < range.end; ++k)
      carry_one(Carry::conjugate, beta, values[k], last[k], &step[k]);
  };
  if (contacts.rx.empty()) return carry(contacts.rn, acceleration.last.n, acceleration.step.n);
  carry(contacts.rx, acceleration.last.x, acceleration.step.x);
  carry(contacts.ry, acceleration.last.y, acceleration.step.y);
  carry(contacts.rz, acceleration.last.z, acceleration.step.z);
}

void carry_velocities(const SweepKernels& kernels, Carry carry, double beta, std::span<const Slot> slots,
                      std::span<Velocity> velocity, AccelerationHistory& acceleration) {
  if (carry == Carry::momentum && beta != 0)
    return kernels.advance(slots, velocity, acceleration.last_v, beta);
  for (const Slot slot : slots) {
    const auto s = static_cast<std::size_t>(slot);
    if (carry == Carry::conjugate) {
      auto now = std::bit_cast<Record>(velocity[s]);
      const auto last = std::bit_cast<Record>(acceleration.last_v[s]);
      auto step = beta == 0 ? Record{} : std::bit_cast<Record>(acceleration.step_v[s]);
      for (std::size_t k = 0; k < record_numbers && beta != 0; ++k) {
        now[k] += beta * step[k];
        step[k] = now[k] - last[k];
      }
      velocity[s] = std::bit_cast<Velocity>(now);
      acceleration.step_v[s] = std::bit_cast<Velocity>(step);
    }
    acceleration.last_v[s] = velocity[s];
  }
}

void carry_velocities(const SweepKernels& kernels, double beta, std::span<const Slot> slots,
                      std::span<SingleVelocity> velocity, std::span<SingleVelocity> last) {
  if (beta != 0) return kernels.advance(slots, velocity, last, beta);
  for (const Slot slot : slots) {
    const auto s = static_cast<std::size_t>(slot);
    last[s] = velocity[s];
  }
}

void carry_wall(Carry carry, double beta, std::size_t chunk, WallCopy& copy,
                AccelerationHistory& acceleration) {
  carry_numbers(carry, beta, copy.velocity, acceleration.last_wall_v[chunk],
                acceleration.step_wall_v.empty() ? nullptr : acceleration.step_wall_v[chunk].data(), 3);
}

void carry_cell(Carry carry, double beta, std::size_t chunk, CellCopy& copy,
                AccelerationHistory& acceleration) {
  carry_numbers(carry, beta, copy.velocity.data(), acceleration.last_cell_v[chunk],
                acceleration.step_cell_v.empty() ? nullptr : acceleration.step_cell_v[chunk].data(),
                cell_freedoms);
}

template <class Number>
void loosen(std::span<const Slot> slots, const std::vector<VelocityOf<Number>>& velocity,
            std::vector<VelocityOf<Number>>& last) {
  add_records<-1>(slots, velocity, last);
}
template <class Number>
void fasten(std::span<const Slot> slots, const std::vector<VelocityOf<Number>>& velocity,
            std::vector<VelocityOf<Number>>& last) {
  add_records<1>(slots, velocity, last);
}
template void loosen(std::span<const Slot>, const std::vector<Velocity>&, std::vector<Velocity>&);
template void loosen(std::span<const Slot>, const std::vector<SingleVelocity>&, std::vector<SingleVelocity>&);
template void fasten(std::span<const Slot>, const std::vector<Velocity>&, std::vector<Velocity>&);
template void fasten(std::span<const Slot>, const std::vector<SingleVelocity>&, std::vector<SingleVelocity>&);
void loosen(std::size_t chunk, const WallCopy& copy, AccelerationHistory& acceleration) {
  for (std::size_t k = 0; k < 3; ++k) acceleration.last_wall_v[chunk][k] -= copy.velocity[k];
}
void fasten(std::size_t chunk, const WallCopy& copy, AccelerationHistory& acceleration) {
  for (std::size_t k = 0; k < 3; ++k) acceleration.last_wall_v[chunk][k] += copy.velocity[k];
}

void loosen(std::size_t chunk, const CellCopy& copy, AccelerationHistory& acceleration) {
  for (std::size_t k = 0; k < cell_freedoms; ++k) acceleration.last_cell_v[chunk][k] -= copy.velocity[k];
}
void fasten(std::size_t chunk, const CellCopy& copy, AccelerationHistory& acceleration) {
  for (std::size_t k = 0; k < cell_freedoms; ++k) acceleration.last_cell_v[chunk][k] += copy.velocity[k];
}

double change_squared(ContactRange range, const Contacts& contacts, std::span<const Velocity> velocity,
                      double wall_inv_mass, const AccelerationHistory& acceleration) {
  const bool friction = !contacts.rx.empty();
  double sum = 0;
  for (std::size_t k = range.begin; k < range.end; ++k) {
    const Slot second = contacts.second[k];
    const double w_nn = velocity[static_cast<std::size_t>(contacts.first[k])].inv_mass +
                        (second < 0 ? wall_inv_mass : velocity[static_cast<std::size_t>(second)].inv_mass);
    double change2 = 0;
    if (friction) {
      const double x = contacts.rx[k] - acceleration.last.x[k], y = contacts.ry[k] - acceleration.last.y[k],
                   z = contacts.rz[k] - acceleration.last.z[k];
      change2 = x * x + y * y + z * z;
    } else {
      const double n = contacts.rn[k] - acceleration.last.n[k];
      change2 = n * n;
    }
    sum += w_nn * change2;
  }
  return sum;
}

std::size_t memory_used(const AccelerationHistory& acceleration) {
  return bytes(acceleration.steps) + bytes(acceleration.last) + bytes(acceleration.step) +
         sizeof(Velocity) * (acceleration.last_v.capacity() + acceleration.step_v.capacity()) +
         sizeof(std::array<double, 3>) *
             (acceleration.last_wall_v.capacity() + acceleration.step_wall_v.capacity()) +
         sizeof(CellVelocity) * (acceleration.last_cell_v.capacity() + acceleration.step_cell_v.capacity());
}

}  // namespace talus
