#pragma once

/// The kernels of kernels/sweeps/sweep.hpp for the processor at hand.
///
///     const SweepKernels kernels(best_instruction_set());
///     kernels.sweep_grains<true>(contacts, range, velocity, mu);

#include "kernels/simd/instruction_set.hpp"
#include "kernels/sweeps/sweep.hpp"

namespace talus {

struct CellCopy;
struct LaneKernels;
struct SingleState;

/// Friction of the contacts of a chunk: one coefficient, or of each contact its own (Contacts::mu).
struct ChunkFriction {
  double mu = 0;  ///< Coulomb's coefficient >= 0; unused where `own`
  bool own = false;
  ChunkFriction(double coefficient) : mu(coefficient) {}
  static ChunkFriction of_each_contact() {
    ChunkFriction friction(0);
    friction.own = true;
    return friction;
  }
};

/// The kernels of one instruction set. Which one it is changes no bit of what they compute. A range is that
/// of a whole chunk, and `contacts.group` holds its groups (narrow_chunk); `Friction` false: only r_n exists
/// and only u is read and written.
class SweepKernels {
 public:
  /// Throws std::invalid_argument when this processor does not run `set`.
  explicit SweepKernels(InstructionSet set);

  /// What was chosen, never `automatic`.
  InstructionSet set() const { return set_; }

  /// One pass of nonlinear Gauss-Seidel over grain-grain contacts (docs/theory.md; Jean 1999, closed form for
  /// spheres: kernels/law/contact_law.hpp):
  ///   r_n <- max(0, r_n - (v_n + b)/W_nn), W_nn = 1/m_i + 1/m_j,
  ///   r_t <- P_{|.| <= mu r_n}(r_t - v_t/W_tt), W_tt = W_nn + R_i^2/I_i + R_j^2/I_j,  V += M^-1 H dr.
  /// Per contact: reads 2 body records (128 bytes) and 56 bytes of contact, writes 128 + 24; about 108 flop,
  /// 2 divisions and a square root. Momentum reads and writes 12 bytes more.
  template <bool Friction>
  void sweep_grains(Contacts& contacts, ContactRange range, std::span<Velocity> velocity,
                    ChunkFriction friction) const;
  template <bool Friction>
  void sweep_grains(Contacts& contacts, ContactRange range, std::span<Velocity> velocity,
                    ChunkFriction friction, const SweepMomentum& momentum) const;

  /// The same between grains and a wall: W_nn = 1/m_i + 1/m_copy, W_tt = 1/m_i + R_i^2/I_i. A copy of finite
  /// mass is split once more, contact k of the range against part k mod 8, and glued at the end: 8 contacts
  /// that do not wait for one another.
  template <bool Friction>
  void sweep_wall(Contacts& contacts, ContactRange range, std::span<Velocity> velocity,
                  ChunkFriction friction, WallCopy& wall) const;
  template <bool Friction>
  void sweep_wall(Contacts& contacts, ContactRange range, std::span<Velocity> velocity,
                  ChunkFriction friction, WallCopy& wall, const SweepMomentum& momentum) const;

  /// sweep_grains in a cell that follows a stress (cell_copy.hpp): W_nn and W_tt gain (|b|/d)^2/m of the
  /// copy, a bound where not all components are free. The copy is split into 16 once more, contact k of a
  /// group against part k.
  template <bool Friction>
  void sweep_cell(Contacts& contacts, ContactRange range, std::span<Velocity> velocity,
                  ChunkFriction friction, CellCopy& cell) const;
  template <bool Friction>
  void sweep_cell(Contacts& contacts, ContactRange range, std::span<Velocity> velocity,
                  ChunkFriction friction, CellCopy& cell, const SweepMomentum& momentum) const;

  /// Sweeps with momentum in single precision, on what the functions narrow_... have made of contacts and
  /// bodies (single_precision.hpp); from `contacts` they read groups and bodies. The steps are in the units
  /// of `single`.
  template <bool Friction>
  void sweep_grains(const Contacts& contacts, SingleState& single, ContactRange range, ChunkFriction friction,
                    const SweepMomentum& momentum) const;
  template <bool Friction>
  void sweep_wall(const Contacts& contacts, SingleState& single, ContactRange range, ChunkFriction friction,
                  WallCopy& wall, const SweepMomentum& momentum) const;
  template <bool Friction>
  void sweep_cell(const Contacts& contacts, SingleState& single, ContactRange range, ChunkFriction friction,
                  CellCopy& cell, const SweepMomentum& momentum) const;

  /// V += M^-1 H r for the contacts of a chunk. After bodies were reset to their free velocities this makes V
  /// afresh from r.
  template <bool Friction>
  void accumulate_grains(const Contacts& contacts, ContactRange range, std::span<Velocity> velocity) const;
  template <bool Friction>
  void accumulate_wall(const Contacts& contacts, ContactRange range, std::span<Velocity> velocity,
                       WallCopy& wall) const;

  /// Natural map of the De Saxce form, e = |r - P_Kmu(r - rho v^)| / rho with v^ = v + (b + mu |v_t|) n and
  /// rho = 1/W_nn [m/s] (docs/theory.md). W_nn at a wall counts its whole mass: `wall` has the velocity of
  /// the chunk's copy, and 1/M.
  template <bool Friction>
  ErrorSums error_grains(const Contacts& contacts, ContactRange range, std::span<const Velocity> velocity,
                         ChunkFriction friction, Multiplicities parts = {}) const;
  template <bool Friction>
  ErrorSums error_wall(const Contacts& contacts, ContactRange range, std::span<const Velocity> velocity,
                       ChunkFriction friction, const WallCopy& wall, Multiplicities parts = {}) const;
  /// `cell` has the velocity of the chunk's copy, and 1/M.
  template <bool Friction>
  ErrorSums error_cell(const Contacts& contacts, ContactRange range, std::span<const Velocity> velocity,
                       ChunkFriction friction, const CellCopy& cell, Multiplicities parts = {}) const;

  /// Momentum of bodies: s becomes s + beta (s - last), and `last` becomes s. For the whole records at
  /// `slots`; masses, equal in both, keep their bits.
  void advance(std::span<const Slot> slots, std::span<Velocity> velocity, std::span<Velocity> last,
               double beta) const;
  void advance(std::span<const Slot> slots, std::span<SingleVelocity> velocity,
               std::span<SingleVelocity> last, double beta) const;

 private:
  template <bool Friction>
  const LaneKernels& lanes(ChunkFriction friction) const {
    return *lanes_[Friction ? (friction.own ? 2 : 1) : 0];
  }

  InstructionSet set_;
  const LaneKernels* lanes_[3];  ///< without friction, with one coefficient, with one per contact
};

}  // namespace talus
