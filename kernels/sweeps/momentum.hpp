#pragma once

#include <array>
#include <span>
#include <vector>

#include "kernels/bodies/bodies.hpp"
#include "kernels/detection/contacts.hpp"
#include "kernels/sweeps/cell_copy.hpp"
#include "kernels/sweeps/sweep_kernels.hpp"

namespace talus {

/// From where the next sweep begins. With s = sweep(y), the impulses after a sweep that began from y:
///   momentum   y+ = s + beta (s - s_before)                            (Nesterov 1983; one acceleration)
///   conjugate  y+ = s + beta p, p = y - y_before of the sweep before   (NNCG, Silcowitz-Hansen et al. 2010)
/// Velocities depend linearly on impulses, and gluing is linear too, so that the same rule keeps V and r
/// consistent, copy by copy, without a product.
enum class Carry { momentum, conjugate };

/// What the rule remembers, in the layout of Contacts and Bodies. Vectors are empty where a scene has no such
/// quantity, or the rule has never been needed.
struct AccelerationHistory {
  struct Impulses {
    std::vector<double> x, y, z;  ///< with friction [N s]
    std::vector<double> n;        ///< without [N s]
  };
  SweepSteps steps;              ///< momentum: s - s_before, read and made within the sweep
  Impulses last;                 ///< conjugate: y
  Impulses step;                 ///< conjugate: p
  std::vector<Velocity> last_v;  ///< per slot; whole records, so that eight numbers are carried at once
  std::vector<Velocity> step_v;
  std::vector<std::array<double, 3>> last_wall_v;  ///< per chunk: of its wall copy [m/s]
  std::vector<std::array<double, 3>> step_wall_v;
  std::vector<CellVelocity> last_cell_v;  ///< per chunk, in a cell that follows a stress: of its copy [m/s]
  std::vector<CellVelocity> step_cell_v;
};

/// Sizes of the history.
struct AccelerationRoom {
  std::size_t bodies;  ///< 0 where they are accelerated in single precision
  std::size_t chunks;
  std::size_t cell_copies;  ///< as many as chunks, or none
};

/// Makes room for the contacts, bodies and copies; new entries mean nothing yet. What only the other rule
/// remembers stays: a sweep under that rule may still be in flight.
void allocate(AccelerationHistory& acceleration, Carry carry, const Contacts& contacts,
              const AccelerationRoom& room);

/// Begins momentum of the impulses of a range: there is no step yet.
void begin_steps(ContactRange range, SweepSteps& steps);

/// Applies the conjugate rule to the impulses of a range; beta = 0 begins a new acceleration.
void carry_impulses(double beta, ContactRange range, Contacts& contacts, AccelerationHistory& acceleration);

/// Applies the rule to the velocities of the slots; numbers that do not change, as masses, keep their bits.
void carry_velocities(const SweepKernels& kernels, Carry carry, double beta, std::span<const Slot> slots,
                      std::span<Velocity> velocity, AccelerationHistory& acceleration);
/// Momentum in single precision; with beta = 0 `last` is not read.
void carry_velocities(const SweepKernels& kernels, double beta, std::span<const Slot> slots,
                      std::span<SingleVelocity> velocity, std::span<SingleVelocity> last);

/// Applies the rule to the wall copy of a chunk.
void carry_wall(Carry carry, double beta, std::size_t chunk, WallCopy& copy,
                AccelerationHistory& acceleration);

/// The same to the chunk's copy of a cell.
void carry_cell(Carry carry, double beta, std::size_t chunk, CellCopy& copy,
                AccelerationHistory& acceleration);

/// Making velocities afresh from the impulses removes their rounding drift. The velocities that the
/// acceleration remembers still contain it; the rule would take the difference for motion and amplify it by
/// beta/(1 - beta), at every refresh. So the remembered velocities are shifted by the same difference: call
/// `loosen` before the velocities are reset and `fasten` once they are made. Both act on the slots; `last` is
/// that of the acceleration, in the precision of the velocities.
template <class Number>
void loosen(std::span<const Slot> slots, const std::vector<VelocityOf<Number>>& velocity,
            std::vector<VelocityOf<Number>>& last);
template <class Number>
void fasten(std::span<const Slot> slots, const std::vector<VelocityOf<Number>>& velocity,
            std::vector<VelocityOf<Number>>& last);
/// The same with the wall copy of a chunk.
void loosen(std::size_t chunk, const WallCopy& copy, AccelerationHistory& acceleration);
void fasten(std::size_t chunk, const WallCopy& copy, AccelerationHistory& acceleration);
/// The same with the chunk's copy of a cell.
void loosen(std::size_t chunk, const CellCopy& copy, AccelerationHistory& acceleration);
void fasten(std::size_t chunk, const CellCopy& copy, AccelerationHistory& acceleration);

/// Sum of W_nn |s - y|^2 over a range [J]: the squared norm of the sweep's change, in the metric of the
/// sweep. With `Carry::conjugate` only. `wall_inv_mass`: of the chunk's wall copy; read at walls. A cell that
/// follows a stress is left out: its share of W_nn is small.
double change_squared(ContactRange range, const Contacts& contacts, std::span<const Velocity> velocity,
                      double wall_inv_mass, const AccelerationHistory& acceleration);

std::size_t memory_used(const AccelerationHistory& acceleration);

}  // namespace talus
