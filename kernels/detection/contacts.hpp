#pragma once

#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

#include "kernels/bodies/bodies.hpp"
#include "kernels/detection/chunks.hpp"
#include "kernels/detection/domain.hpp"
#include "kernels/shapes/walls.hpp"

namespace talus {

/// A body of a contact, or, as -1 - feature, what a grain touches of a wall: a slot, kept as the place where
/// the record of the body begins, counted in numbers (VelocityOf), since a sweep takes fewer instructions
/// from there to an address. It fits 32 bits because cut_chunks admits at most most_bodies_of_a_process
/// bodies; features have the places in between, where no record begins.
class ContactBody {
 public:
  ContactBody() = default;
  /// Implicit, as is the way back: it is a slot in another notation.
  ContactBody(Slot slot)
      : place_(slot >= 0 ? record_numbers * to_unsigned(slot) : place_of_feature(-1 - slot)) {}
  operator Slot() const {
    const std::uint32_t in_record = place_ % record_numbers, record = place_ / record_numbers;
    return in_record == 0 ? static_cast<Slot>(record)
                          : -1 - static_cast<Slot>(record * (record_numbers - 1) + in_record - 1);
  }

 private:
  static_assert(most_bodies_of_a_process * record_numbers <= std::size_t{1} << 32);
  static std::uint32_t to_unsigned(Slot slot) { return static_cast<std::uint32_t>(slot); }
  static std::uint32_t place_of_feature(Slot feature) {
    const std::uint32_t of = to_unsigned(feature);
    return of / (record_numbers - 1) * record_numbers + 1 + of % (record_numbers - 1);
  }

  std::uint32_t place_ = 0;
};
inline std::size_t at(ContactBody body) {
  return static_cast<std::size_t>(Slot{body});
}
/// For kernels that read plain numbers: the places of records.
inline const std::uint32_t* record_places(const ContactBody* bodies) {
  static_assert(std::is_standard_layout_v<ContactBody> && sizeof(ContactBody) == sizeof(std::uint32_t));
  return reinterpret_cast<const std::uint32_t*>(bodies);
}

/// At a contact of blocks the surface of each body moves with u + lever w, of VelocityOf. The second lever
/// means nothing at a wall.
struct Levers {
  Mat3 first = Mat3::Zero(), second = Mat3::Zero();
  Vec3 arm = Vec3::Zero();  ///< from the first body's centre to where the impulse acts [m]
};

/// Contacts of one step. Chunk c has a place for each of its candidates. Its contacts stand at
/// [chunks.begin[c], chunks.begin[c] + count[c]), in groups of at most 16, most of them full. No grain stands
/// twice in a group, so that a group can be swept at once. In chunks between grains the candidates that are
/// no contacts stand after them, so that the next step finds all candidates where they were
/// (kernels/detection/narrow_phase.hpp).
struct Contacts {
  std::vector<double> nx, ny, nz;  ///< normal, unit, from the second body (or the wall) to the first
  std::vector<double> bias;        ///< b [m/s]: Signorini holds for v_n + b
  std::vector<double> rx, ry, rz;  ///< impulse on the first body [N s], as the law sees it (law_impulse);
                                   ///< empty without friction
  std::vector<double> rn;          ///< normal impulse [N s], likewise; empty with friction
  std::vector<double> cohesion;    ///< c h [N s] (kernels/sweeps/cohesion.hpp); empty if no contact has any
  std::vector<double> mx, my, mz;  ///< moment of rolling resistance on the first body [N m s], and
  std::vector<double> arm;         ///< its bound over the normal impulse [m]; empty where nothing resists
  std::vector<Vec3> spin;  ///< at walls that turn, if any contact resists rolling: angular velocity of
                           ///< the wall's material [rad/s]; else empty
  std::vector<double> vx, vy, vz;  ///< at walls: velocity of the wall's material at the contact beyond that
                                   ///< of the wall [m/s]; empty where no wall turns or has a surface that
                                   ///< moves alone, and no cell flows
  bool drifts_between = false;     ///< between bodies, vx, vy and vz hold the velocity of the second's image
                                   ///< beyond that of the second
  std::vector<double> reach;   ///< distance of the centres over a length (kernels/bodies/cell_velocity.hpp);
                               ///< empty where no cell follows a stress
  std::vector<double> mu;      ///< friction of each contact; empty where no chunk mixes pairs of materials
  std::vector<Levers> levers;  ///< of contacts in chunks of blocks; empty where no body is a clump
  std::vector<std::uint16_t> balls;        ///< likewise: Candidates::balls
  std::vector<ContactBody> first, second;  ///< slots; second is -1 - feature at a wall: -1 at a plane
  std::vector<std::int32_t> candidate;
  std::vector<std::int32_t> count;   ///< per chunk
  std::vector<std::int32_t> passed;  ///< per chunk: pairs that went through one another on their way to x, or
                                     ///< overlapped by more than half the smaller radius: too long a step
  std::vector<std::uint8_t> group;   ///< from chunks.begin[c] on: sizes of the groups of chunk c, 1..16
};

/// The same contacts in the same places, for sweeps in single precision (single_precision.hpp).
struct SingleContacts {
  double unit = 1;                ///< [kg] of impulses and of bodies' mobilities, a power of two
  std::vector<float> nx, ny, nz;  ///< normal
  std::vector<float> bias;        ///< b [m/s]
  std::vector<float> rx, ry, rz;  ///< impulse on the first body over `unit` [m/s]; empty without friction
  std::vector<float> rn;          ///< normal impulse over `unit` [m/s]; empty with friction
  std::vector<float> mu;          ///< as in Contacts
  std::vector<float> vx, vy, vz;  ///< likewise
  std::vector<float> reach;       ///< likewise
};

/// Drift at contact k, at a wall or where drifts_between; 0 where contacts have none.
inline Vec3 drift_of(const Contacts& contacts, std::size_t k) {
  if (contacts.vx.empty()) return Vec3::Zero();
  return {contacts.vx[k], contacts.vy[k], contacts.vz[k]};
}
inline void set_drift(Contacts& contacts, std::size_t k, const Vec3& drift) {
  contacts.vx[k] = drift[0];
  contacts.vy[k] = drift[1];
  contacts.vz[k] = drift[2];
}

/// Makes room for the contacts of `chunks`, of which there are none yet. Candidates stand in their own order;
/// those between grains have their bodies already. `friction` decides which impulses exist.
void allocate(Contacts& contacts, const Candidates& candidates, const Chunks& chunks, bool friction);

/// Writes the impulses of a chunk back to its candidates; those that were no contact get 0.
void store_impulses(const Contacts& contacts, const Chunks& chunks, std::size_t chunk,
                    Candidates& candidates);

/// The inverse: gives the contacts of a chunk the impulses that store_impulses wrote.
void restore_impulses(const Candidates& candidates, const Chunks& chunks, std::size_t chunk,
                      Contacts& contacts);
/// Drops what the moments of a chunk, which the step before has left, have along normals that have turned
/// since: no law would undo it. Once a step, as doing it twice would change bits.
void turn_moments(const Chunks& chunks, std::size_t chunk, Contacts& contacts);

/// Converts the impulses to `kind` when a stage brings friction or drops it, so that forces outlive the
/// change: normal parts become vectors along the present normals, and vectors their normal parts. x [m] of
/// all grains.
void convert_impulses(Candidates& candidates, ImpulseKind kind, std::span<const Vec3> x,
                      std::span<const Wall> walls, const Domain& domain = {});

std::size_t memory_used(const Contacts& contacts);

}  // namespace talus
