#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "kernels/bodies/types.hpp"

namespace talus {

/// What impulses of a stage consist of, per candidate. The value is the length of a row of KeptImpulses.
enum class ImpulseKind : std::uint8_t {
  normal = 1,  ///< along the normal [N s]: no friction
  force = 3,   ///< on the first body [N s]
  rolling = 6  ///< the same, and the moment of rolling resistance on the first body [N m s]
};

/// Impulses of candidates, a row of one kind for each. They outlive the step as the next one's warm start. No
/// other code depends on the length of a row.
class KeptImpulses {
 public:
  KeptImpulses() = default;
  explicit KeptImpulses(ImpulseKind kind) : kind_(kind) {}

  ImpulseKind kind() const { return kind_; }
  std::size_t size() const { return values_.size() / length(); }  ///< rows
  std::span<double> row(std::size_t k) { return values(k, k + 1); }
  std::span<const double> row(std::size_t k) const {
    return std::span(values_).subspan(k * length(), length());
  }
  /// Numbers of rows [begin, end), one row after the other.
  std::span<double> values(std::size_t begin, std::size_t end) {
    return std::span(values_).subspan(begin * length(), (end - begin) * length());
  }
  std::span<double> values() { return values_; }
  std::span<const double> values() const { return values_; }

  /// Impulse of a row [N s] at a contact with this normal; moments left out.
  Vec3 force(std::size_t k, const Vec3& normal) const {
    const std::span<const double> r = row(k);
    return kind_ == ImpulseKind::normal ? Vec3(r[0] * normal) : Vec3(r[0], r[1], r[2]);
  }

  /// Moment of rolling resistance of a row on the first body [N m s]; 0 in rows of other kinds.
  Vec3 moment(std::size_t k) const {
    const std::span<const double> r = row(k);
    return kind_ == ImpulseKind::rolling ? Vec3(r[3], r[4], r[5]) : Vec3(Vec3::Zero());
  }

  void reserve(std::size_t rows) { values_.reserve(rows * length()); }
  void assign_zeros(std::size_t rows) { values_.assign(rows * length(), 0.0); }
  /// `of` is a row of this kind, or a longer one, of which the rest is not read.
  void push_back(std::span<const double> of);
  void set(std::size_t k, std::span<const double> of);
  /// Appends all rows of `others`, which are of this kind.
  void append(const KeptImpulses& others);
  /// Makes the other body the first: negates the row. A normal part alone is the same for either order, and
  /// stays.
  void swap_bodies(std::size_t k);
  std::size_t bytes() const { return values_.capacity() * sizeof(double); }

 private:
  std::size_t length() const { return static_cast<std::size_t>(kind_); }

  ImpulseKind kind_ = ImpulseKind::force;
  std::vector<double> values_;
};

}  // namespace talus
