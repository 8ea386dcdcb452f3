#include "kernels/sweeps/rolling.hpp"

#include <algorithm>
#include <limits>

#include "kernels/bodies/index.hpp"
#include "kernels/detection/materials.hpp"
#include "kernels/detection/measures.hpp"
#include "kernels/law/attraction.hpp"
#include "kernels/law/rolling_law.hpp"

namespace talus {

namespace {

/// Rotation of a body. A sphere of radius 1 that nothing turns stands in for a wall, whose own rotation is
/// stored with its contacts.
struct Turning {
  double radius = 1;          ///< [m]
  double mobility = 0;        ///< 1/I [1/(kg m^2)]
  Vec3 omega = Vec3::Zero();  ///< [rad/s]
};
Turning turning_of(std::span<const double> radius, std::span<const Velocity> velocity, Slot slot) {
  if (slot < 0) return {};
  const Velocity& v = velocity[at(slot)];
  const double r = radius[at(slot)];
  return {r, v.spin_mobility / (r * r), Eigen::Map<const Vec3>(v.w) / r};
}

/// Contact k between `a` and `b`.
Rolling rolling_of(const Contacts& contacts, std::size_t k, const Turning& a, const Turning& b) {
  const Vec3 n = contact_normal(contacts, k);
  Vec3 rate = a.omega - b.omega;
  if (!contacts.spin.empty() && contacts.second[k] < 0) rate -= contacts.spin[k];
  return {rate - rate.dot(n) * n, a.mobility + b.mobility,
          contacts.arm[k] * std::max(0.0, law_impulse(contacts, k).dot(n))};
}

/// Turns a body by the impulse of a moment [N m s].
void turn(const Vec3& moment, std::span<const double> radius, std::span<Velocity> velocity, Slot slot) {
  if (slot < 0) return;
  Velocity& v = velocity[at(slot)];
  Eigen::Map<Vec3> w(v.w);
  w += v.spin_mobility / radius[at(slot)] * moment;
}

}  // namespace

void find_arms(const NarrowPhase& in, const Candidates& candidates, const Chunks& chunks, std::size_t chunk,
               Contacts& contacts) {
  if (contacts.arm.empty()) return;
  const MaterialView materials{in.material, in.walls};
  const std::size_t begin = at(chunks.begin[chunk]), end = begin + at(contacts.count[chunk]);
  for (std::size_t k = begin; k < end; ++k) {
    const PairLaw& law = law_at(in.laws, candidates, materials, at(contacts.candidate[k]));
    const double mu = law.friction > 0 ? law.rolling_resistance : 0;  // smooth contacts do not roll
    const TouchingRadii radii{in.radius[at(contacts.first[k])], contacts.second[k] < 0
                                                                    ? std::numeric_limits<double>::infinity()
                                                                    : in.radius[at(contacts.second[k])]};
    contacts.arm[k] = mu * radii.reduced();
  }
  if (contacts.spin.empty() || chunks.wall[chunk] < 0) return;
  const Wall& wall = in.walls[at(chunks.wall[chunk])];
  std::fill_n(contacts.spin.begin() + static_cast<std::ptrdiff_t>(begin), end - begin,
              Vec3(wall.omega + wall.belt.omega));
}

void sweep_moments(Contacts& contacts, ContactRange range, std::span<const double> radius,
                   std::span<Velocity> velocity) {
  if (contacts.arm.empty()) return;
  for (std::size_t k = range.begin; k < range.end; ++k) {
    const Slot first = contacts.first[k], second = contacts.second[k];
    const Rolling contact =
        rolling_of(contacts, k, turning_of(radius, velocity, first), turning_of(radius, velocity, second));
    if (contact.mobility == 0) continue;
    const Vec3 before = contact_moment(contacts, k), after = solve_rolling(before, contact),
               change = after - before;
    turn(change, radius, velocity, first);
    turn(-change, radius, velocity, second);
    contacts.mx[k] = after[0];
    contacts.my[k] = after[1];
    contacts.mz[k] = after[2];
  }
}

void add_moments(const Contacts& contacts, ContactRange range, std::span<const double> radius,
                 std::span<Velocity> velocity) {
  if (contacts.arm.empty()) return;
  for (std::size_t k = range.begin; k < range.end; ++k) {
    const Vec3 moment = contact_moment(contacts, k);
    turn(moment, radius, velocity, contacts.first[k]);
    turn(-moment, radius, velocity, contacts.second[k]);
  }
}

void add_error_of_moments(const Contacts& contacts, ContactRange range, std::span<const double> radius,
                          std::span<const Velocity> velocity, Multiplicities parts, ErrorSums& sums) {
  if (contacts.arm.empty()) return;
  const auto whole = [&](Slot slot) {
    Turning body = turning_of(radius, velocity, slot);
    if (slot >= 0 && !parts.empty()) body.mobility /= parts[at(slot)];
    return body;
  };
  for (std::size_t k = range.begin; k < range.end; ++k) {
    const Turning a = whole(contacts.first[k]), b = whole(contacts.second[k]);
    const Rolling contact = rolling_of(contacts, k, a, b);
    if (contact.mobility == 0) continue;
    const Vec3 moment = contact_moment(contacts, k);
    const double lever = contacts.second[k] < 0 ? a.radius : std::min(a.radius, b.radius);
    const double error = lever * error_of_rolling(moment, contact);
    sums.residual2 += error * error;
    sums.residual_max2 = std::max(sums.residual_max2, error * error);
    const double carried = lever * contact.mobility * moment.norm();
    sums.impulse2 += carried * carried;
    sums.work += moment.norm() * std::abs(error) / lever;
  }
}

}  // namespace talus
