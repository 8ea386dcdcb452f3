#pragma once

/// The kernels of kernels/sweeps/sweep.hpp for the processor at hand.
///
///     const SweepKernels kernels(best_instruction_set());
///     kernels.sweep_grains<true>(contacts, range, velocity, mu);

#include <optional>
#include <string_view>

#include "kernels/sweeps/sweep.hpp"

namespace talus {

struct LaneKernels;

/// From the weakest to the strongest. Those on vectors give the same bits, as every lane does what the scalar
/// kernel does; but they fuse products into sums, which the portable one does not
/// (docs/decisions/0008-lanes.md).
enum class InstructionSet {
  automatic,  ///< the strongest that runs here, and in a simulation on all ranks (`settled`)
  portable,   ///< the scalar kernels
  avx2,       ///< 4 contacts at a time (AVX2, FMA)
  avx512,     ///< 8 contacts at a time (F, DQ, VL)
};

std::string_view name_of(InstructionSet set);
/// "auto", "portable", "avx2" or "avx512"; nothing for other names.
std::optional<InstructionSet> instruction_set_of(std::string_view name);

/// The strongest that the processor and the operating system run.
InstructionSet best_instruction_set();

/// A choice of kernels. Each does what its namesake in kernels/sweeps/sweep.hpp does, but for rounding; a
/// range is that of a whole chunk, and `contacts.group` holds its groups (narrow_chunk).
class SweepKernels {
 public:
  /// Throws std::invalid_argument when this processor does not run `set`.
  explicit SweepKernels(InstructionSet set);

  /// What was chosen, never `automatic`.
  InstructionSet set() const { return set_; }
  /// For the narrow phase; null: the scalar one.
  const LaneKernels* lanes() const { return lanes_[1]; }

  template <bool Friction>
  void sweep_grains(Contacts& contacts, ContactRange range, std::span<Velocity> velocity, double mu) const;
  template <bool Friction>
  void sweep_grains(Contacts& contacts, ContactRange range, std::span<Velocity> velocity, double mu,
                    const SweepMomentum& momentum) const;
  template <bool Friction>
  void sweep_wall(Contacts& contacts, ContactRange range, std::span<Velocity> velocity, double mu,
                  WallCopy& wall) const;
  template <bool Friction>
  void sweep_wall(Contacts& contacts, ContactRange range, std::span<Velocity> velocity, double mu,
                  WallCopy& wall, const SweepMomentum& momentum) const;
  template <bool Friction>
  void sweep_grains(const Contacts& contacts, SingleContacts& single, ContactRange range,
                    std::span<SingleVelocity> velocity, double mu, const SweepMomentum& momentum) const;
  template <bool Friction>
  void sweep_wall(const Contacts& contacts, SingleContacts& single, ContactRange range,
                  std::span<SingleVelocity> velocity, double mu, WallCopy& wall,
                  const SweepMomentum& momentum) const;
  template <bool Friction>
  void accumulate_grains(const Contacts& contacts, ContactRange range, std::span<Velocity> velocity) const;
  template <bool Friction>
  void accumulate_wall(const Contacts& contacts, ContactRange range, std::span<Velocity> velocity,
                       WallCopy& wall) const;
  template <bool Friction>
  ErrorSums error_grains(const Contacts& contacts, ContactRange range, std::span<const Velocity> velocity,
                         double mu, Multiplicities parts = {}) const;
  template <bool Friction>
  ErrorSums error_wall(const Contacts& contacts, ContactRange range, std::span<const Velocity> velocity,
                       double mu, const WallCopy& wall, double wall_inv_mass,
                       Multiplicities parts = {}) const;

  /// Momentum of bodies: s goes on to s + beta (s - last), and `last` becomes s. Of whole records at `slots`,
  /// whose masses, equal in both, stay to the bit.
  void advance(std::span<const Slot> slots, std::span<Velocity> velocity, std::span<Velocity> last,
               double beta) const;
  void advance(std::span<const Slot> slots, std::span<SingleVelocity> velocity,
               std::span<SingleVelocity> last, double beta) const;

 private:
  InstructionSet set_;
  const LaneKernels* lanes_[2];  ///< without and with friction; null: the scalar kernels
};

}  // namespace talus
