#pragma once

/// The kernels of kernels/sweeps/sweep.hpp, contact after contact. Which sums of a product are rounded once
/// is a parameter: the portable kernels round after every operation, those on vectors where `Fused` does, so
/// that this text is also what they are held against (tests/unit/kernels/sweeps/sweep_kernels.cpp).

#include <algorithm>
#include <cmath>
#include <concepts>
#include <limits>
#include <type_traits>

#include "kernels/sweeps/sweep.hpp"

namespace talus::scalar {

/// How a b + c is rounded, and the larger of 0 and a number found; a NaN stays one.
struct Separate {
  template <class N>
  static N multiply_add(N a, N b, N c) {
    return a * b + c;
  }
  /// Without a jump: nobody can predict which contacts are open.
  template <class N>
  static N positive_part(N value) {
    return N(0.5) * (value + std::abs(value));
  }
};
struct Fused {
  template <class N>
  static N multiply_add(N a, N b, N c) {
    return std::fma(a, b, c);
  }
  /// As vectors do it, down to the sign of 0.
  template <class N>
  static N positive_part(N value) {
    return N(0) > value ? N(0) : value;
  }
};

template <class N>
struct V3 {
  N x, y, z;
};
template <class N>
inline V3<N> operator+(V3<N> a, V3<N> b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class N>
inline V3<N> operator-(V3<N> a, V3<N> b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class N>
inline V3<N> operator*(N s, V3<N> a) {
  return {s * a.x, s * a.y, s * a.z};
}
/// s a + b.
template <class R, class N>
inline V3<N> add_scaled(N s, V3<N> a, V3<N> b) {
  return {R::multiply_add(s, a.x, b.x), R::multiply_add(s, a.y, b.y), R::multiply_add(s, a.z, b.z)};
}
template <class R, class N>
inline N dot(V3<N> a, V3<N> b) {
  return R::multiply_add(a.z, b.z, R::multiply_add(a.y, b.y, a.x * b.x));
}
template <class R, class N>
inline V3<N> cross(V3<N> a, V3<N> b) {
  return {R::multiply_add(a.y, b.z, -(a.z * b.y)), R::multiply_add(a.z, b.x, -(a.x * b.z)),
          R::multiply_add(a.x, b.y, -(a.y * b.x))};
}
/// v - w x n.
template <class R, class N>
inline V3<N> less_cross(V3<N> v, V3<N> w, V3<N> n) {
  return {R::multiply_add(w.z, n.y, R::multiply_add(-w.y, n.z, v.x)),
          R::multiply_add(w.x, n.z, R::multiply_add(-w.z, n.x, v.y)),
          R::multiply_add(w.y, n.x, R::multiply_add(-w.x, n.y, v.z))};
}
template <class N>
inline V3<N> load(const N* p) {
  return {p[0], p[1], p[2]};
}
template <class N>
inline void store(N* p, V3<N> a) {
  p[0] = a.x;
  p[1] = a.y;
  p[2] = a.z;
}
/// p += s a.
template <class R, class N>
inline void add_to(N* p, N s, V3<N> a) {
  store(p, add_scaled<R>(s, a, load(p)));
}

/// `Arrays` are Contacts or SingleContacts.
template <class Arrays>
inline auto normal_of(const Arrays& c, std::size_t k) {
  return V3<std::remove_cvref_t<decltype(c.nx[k])>>{c.nx[k], c.ny[k], c.nz[k]};
}

template <bool Friction>
inline V3<double> impulse_of(const Contacts& c, std::size_t k, V3<double> n) {
  if constexpr (Friction)
    return {c.rx[k], c.ry[k], c.rz[k]};
  else
    return c.rn[k] * n;
}

/// What a body meets at a wall: its velocity when the sweep began, what it has gained since [m/s], and its
/// mobility along the normal. Apart, so that the little that a heavy wall gains is not lost in rounding.
template <class N>
struct WallPart {
  N velocity[3];
  N gained[3];
  N inv_mass;
};

template <class N>
inline V3<N> velocity_of(const WallPart<N>& wall) {
  return load(wall.velocity) + load(wall.gained);
}
inline V3<double> velocity_of(const WallCopy& wall) {
  return load(wall.velocity);
}
template <class R, class N>
inline void add_velocity(WallPart<N>& wall, N s, V3<N> a) {
  add_to<R>(wall.gained, s, a);
}
template <class R>
inline void add_velocity(WallCopy& wall, double s, V3<double> a) {
  add_to<R>(wall.velocity, s, a);
}

/// Relative velocity of two grains at their contact.
template <class R, bool Friction, class N>
inline V3<N> relative(const VelocityOf<N>& a, const VelocityOf<N>& b, V3<N> n) {
  const V3<N> du = load(a.u) - load(b.u);
  if constexpr (Friction) return less_cross<R>(du, load(a.w) + load(b.w), n);
  return du;
}

/// `Wall` is a WallPart or a WallCopy.
template <class R, bool Friction, class N, class Wall>
inline V3<N> relative(const VelocityOf<N>& a, const Wall& wall, V3<N> n) {
  const V3<N> du = load(a.u) - velocity_of(wall);
  if constexpr (Friction) return less_cross<R>(du, load(a.w), n);
  return du;
}

/// Adds an impulse dr on the first body, -dr on the second.
template <class R, bool Friction, class N>
inline void push(VelocityOf<N>& a, VelocityOf<N>& b, V3<N> n, V3<N> dr) {
  add_to<R>(a.u, a.inv_mass, dr);
  add_to<R>(b.u, -b.inv_mass, dr);
  if constexpr (Friction) {
    const V3<N> turn = cross<R>(dr, n);
    add_to<R>(a.w, a.spin_mobility, turn);
    add_to<R>(b.w, b.spin_mobility, turn);
  }
}

template <class R, bool Friction, class N, class Wall>
inline void push(VelocityOf<N>& a, Wall& wall, V3<N> n, V3<N> dr) {
  add_to<R>(a.u, a.inv_mass, dr);
  add_velocity<R>(wall, -wall.inv_mass * dot<R>(n, dr), n);  // a wall moves along its normal only
  if constexpr (Friction) add_to<R>(a.w, a.spin_mobility, cross<R>(dr, n));
}

/// 1/W_nn and 1/W_tt by one division: it is divisions that sweeps in double wait for. The product stays in
/// range: masses of grains do, and those that floats are used for are within 1000 of their unit.
template <class N>
struct Inverses {
  N nn, tt;
};
template <class N>
inline Inverses<N> invert(N w_nn, N w_tt) {
  const N inverse = 1 / (w_nn * w_tt);
  return {inverse * w_tt, inverse * w_nn};
}

/// Asks for the bodies of a contact two batches ahead: they are scattered, so that the processor does not see
/// them coming, and with 200,000 grains they stand beyond its second cache.
template <class Record>
inline void prefetch_bodies(const Contacts& c, std::size_t k, std::size_t end, std::span<Record> velocity) {
  const std::size_t ahead = std::min(k + 16, end - 1);
  __builtin_prefetch(&velocity[static_cast<std::size_t>(c.first[ahead])], 1);
  __builtin_prefetch(&velocity[static_cast<std::size_t>(c.second[ahead])], 1);
}

template <class Arrays, class N>
inline void store_vector(Arrays& c, std::size_t k, V3<N> r) {
  c.rx[k] = r.x;
  c.ry[k] = r.y;
  c.rz[k] = r.z;
}

/// A plain sweep begins where the last one ended.
struct Plain {
  double omega = 1;
  V3<double> begin(V3<double> s, std::size_t) const { return s; }
  double begin(double s, std::size_t) const { return s; }
  void end(V3<double>, V3<double>, std::size_t) const {}
  void end(double, double, std::size_t) const {}
};

template <class R>
struct WithMomentum {
  double beta, omega;
  SweepSteps& steps;
  template <class N>
  V3<N> begin(V3<N> s, std::size_t k) const {
    return add_scaled<R>(static_cast<N>(beta), V3<N>{steps.x[k], steps.y[k], steps.z[k]}, s);
  }
  template <std::floating_point N>
  N begin(N s, std::size_t k) const {
    return R::multiply_add(static_cast<N>(beta), static_cast<N>(steps.n[k]), s);
  }
  template <class N>
  void end(V3<N> s, V3<N> s_new, std::size_t k) const {
    const V3<N> step = s_new - s;
    steps.x[k] = static_cast<float>(step.x);
    steps.y[k] = static_cast<float>(step.y);
    steps.z[k] = static_cast<float>(step.z);
  }
  template <std::floating_point N>
  void end(N s, N s_new, std::size_t k) const {
    steps.n[k] = static_cast<float>(s_new - s);
  }
};

/// Closed form of Signorini-Coulomb with a diagonal W: stores the new impulse and returns what it adds to the
/// one that the velocities know.
template <class R, bool Friction, class Arrays, class N, class Start>
inline V3<N> solve_law(Arrays& c, std::size_t k, V3<N> n, V3<N> v, N w_nn, N w_tt, double mu,
                       const Start& start) {
  const N v_n = dot<R>(v, n), omega = static_cast<N>(start.omega);
  if constexpr (Friction) {
    const V3<N> s{c.rx[k], c.ry[k], c.rz[k]}, r = start.begin(s, k);
    const Inverses<N> inverse = invert(w_nn, w_tt);
    const N r_n = dot<R>(r, n);
    const N r_n_new = R::positive_part(R::multiply_add(-omega, (v_n + c.bias[k]) * inverse.nn, r_n));
    const N limit = static_cast<N>(mu) * r_n_new;
    // r - v/W_tt, less what of it is normal.
    const V3<N> t =
        add_scaled<R>(-R::multiply_add(-inverse.tt, v_n, r_n), n, add_scaled<R>(-inverse.tt, v, r));
    // In floats squares vanish early: a contact that carries nothing must not keep what is left of its t.
    const N t2 = std::is_same_v<N, float> ? dot<R>(t, t) + std::numeric_limits<N>::min() : dot<R>(t, t);
    const N scale = t2 > limit * limit ? limit / std::sqrt(t2) : N(1);
    const V3<N> r_new = add_scaled<R>(scale, t, r_n_new * n);
    store_vector(c, k, r_new);
    start.end(s, r_new, k);
    return r_new - r;
  } else {
    const N s = c.rn[k], r_n = start.begin(s, k);
    const N r_n_new = R::positive_part(R::multiply_add(-omega, (v_n + c.bias[k]) / w_nn, r_n));
    c.rn[k] = r_n_new;
    start.end(s, r_n_new, k);
    return (r_n_new - r_n) * n;
  }
}

/// Projection of z on the Coulomb cone about n.
template <class R>
inline V3<double> project_on_cone(V3<double> z, V3<double> n, double mu) {
  const double z_n = dot<R>(z, n);
  const V3<double> t = add_scaled<R>(-z_n, n, z);
  const double length = std::sqrt(dot<R>(t, t));
  if (mu * length <= -z_n) return {0, 0, 0};  // first: with mu = 0 = length the other one would hold, too
  if (length <= mu * z_n) return z;
  const double r_n = R::multiply_add(mu, length, z_n) * (1 / (1 + mu * mu));
  return add_scaled<R>(mu * r_n / length, t, r_n * n);
}

/// Up to 8 copies of a chunk's copy of a wall, one for each lane of a vector, as if the wall had that many
/// more chunks. A driven wall has nothing to split. `unit` [kg]: of mobilities.
template <class N>
class SplitWall {
 public:
  SplitWall(const WallCopy& wall, ContactRange range, double unit = 1)
      : begin_(range.begin), lanes_(std::min(range.end - range.begin, wall_lanes)) {
    const double inv_mass = wall.inv_mass * unit * static_cast<double>(lanes_);
    for (WallPart<N>& part : parts_) {
      for (int d = 0; d < 3; ++d) {
        part.velocity[d] = static_cast<N>(wall.velocity[d]);
        part.gained[d] = 0;
      }
      part.inv_mass = static_cast<N>(inv_mass);
    }
  }
  WallPart<N>& at(std::size_t k) { return parts_[(k - begin_) % wall_lanes]; }
  void glue(WallCopy& wall) const {
    if (wall.inv_mass == 0 || lanes_ == 0) return;
    V3<double> sum{0, 0, 0};
    for (std::size_t l = 0; l < lanes_; ++l) {
      const N* const own = parts_[l].gained;
      sum = sum + V3<double>{own[0], own[1], own[2]};
    }
    const V3<double> mean = (1 / static_cast<double>(lanes_)) * sum;
    store(wall.velocity, load(wall.velocity) + mean);
  }

 private:
  static constexpr std::size_t wall_lanes = 8;
  std::size_t begin_, lanes_;
  WallPart<N> parts_[wall_lanes];
};

/// 1/M of the body whose copy this is.
inline double whole(const Velocity& copy, Slot slot, Multiplicities parts) {
  return parts.empty() ? copy.inv_mass : copy.inv_mass / parts[static_cast<std::size_t>(slot)];
}

/// Sums in 8 lanes, contact k of a range in lane k mod 8, then over the lanes in order: as vectors do it.
class LaneSums {
 public:
  ErrorSums& at(std::size_t k) { return lane_[k % 8]; }
  ErrorSums total() const {
    ErrorSums sums;
    for (const ErrorSums& lane : lane_) sums.add(lane);
    return sums;
  }

 private:
  ErrorSums lane_[8];
};

template <class R, bool Friction>
inline void add_error(ErrorSums& sums, const Contacts& c, std::size_t k, V3<double> n, V3<double> v,
                      double w_nn, double mu) {
  const double v_0 = dot<R>(v, n), v_n = v_0 + c.bias[k];
  double e2, r_n;
  if constexpr (Friction) {
    const V3<double> r{c.rx[k], c.ry[k], c.rz[k]};
    const V3<double> v_t = add_scaled<R>(-v_0, n, v);
    const double v_t2 = dot<R>(v_t, v_t);
    const V3<double> v_hat = add_scaled<R>(R::multiply_add(mu, std::sqrt(v_t2), v_n), n, v_t);
    const V3<double> p = w_nn * r, miss = p - project_on_cone<R>(p - v_hat, n, mu);
    e2 = dot<R>(miss, miss);
    r_n = dot<R>(r, n);
    sums.impulse2 += dot<R>(p, p);
    if (r_n > 0 || v_n < 0) sums.velocity2 += R::multiply_add(v_n, v_n, v_t2);
  } else {
    r_n = c.rn[k];
    const double p = w_nn * r_n, miss = p - R::positive_part(p - v_n);
    e2 = miss * miss;
    sums.impulse2 += p * p;
    if (r_n > 0 || v_n < 0) sums.velocity2 += v_n * v_n;
  }
  sums.residual2 += e2;
  sums.residual_max2 = std::max(sums.residual_max2, e2);
  ++sums.contacts;
  if (r_n > 0) ++sums.active;
}

/// `contacts` lends the bodies, `arrays` has the rest: they are the same in double precision.
template <class R, bool Friction, class Arrays, class N, class Start>
void sweep_grains_from(const Contacts& contacts, Arrays& arrays, ContactRange range,
                       std::span<VelocityOf<N>> velocity, double mu, const Start& start) {
  for (std::size_t k = range.begin; k < range.end; ++k) {
    prefetch_bodies(contacts, k, range.end, velocity);
    VelocityOf<N>& a = velocity[static_cast<std::size_t>(contacts.first[k])];
    VelocityOf<N>& b = velocity[static_cast<std::size_t>(contacts.second[k])];
    const V3<N> n = normal_of(arrays, k);
    const N w_nn = a.inv_mass + b.inv_mass;
    const N w_tt = w_nn + (a.spin_mobility + b.spin_mobility);
    push<R, Friction>(
        a, b, n, solve_law<R, Friction>(arrays, k, n, relative<R, Friction>(a, b, n), w_nn, w_tt, mu, start));
  }
}

template <class R, bool Friction, class Arrays, class N, class Start>
void sweep_wall_from(const Contacts& contacts, Arrays& arrays, ContactRange range,
                     std::span<VelocityOf<N>> velocity, double mu, WallCopy& wall, double unit,
                     const Start& start) {
  SplitWall<N> split(wall, range, unit);
  for (std::size_t k = range.begin; k < range.end; ++k) {
    VelocityOf<N>& a = velocity[static_cast<std::size_t>(contacts.first[k])];
    WallPart<N>& own = split.at(k);
    const V3<N> n = normal_of(arrays, k);
    push<R, Friction>(
        a, own, n,
        solve_law<R, Friction>(arrays, k, n, relative<R, Friction>(a, own, n), a.inv_mass + own.inv_mass,
                               a.inv_mass + a.spin_mobility, mu, start));
  }
  split.glue(wall);
}

/// The kernels of kernels/sweeps/sweep.hpp under the names that they have there, rounded as R says.
template <class R>
struct Sweeps {
  template <bool Friction>
  static void sweep_grains(Contacts& contacts, ContactRange range, std::span<Velocity> velocity, double mu) {
    sweep_grains_from<R, Friction>(contacts, contacts, range, velocity, mu, Plain{});
  }
  template <bool Friction>
  static void sweep_grains(Contacts& contacts, ContactRange range, std::span<Velocity> velocity, double mu,
                           const SweepMomentum& momentum) {
    sweep_grains_from<R, Friction>(contacts, contacts, range, velocity, mu, start_of(momentum));
  }
  template <bool Friction>
  static void sweep_wall(Contacts& contacts, ContactRange range, std::span<Velocity> velocity, double mu,
                         WallCopy& wall) {
    sweep_wall_from<R, Friction>(contacts, contacts, range, velocity, mu, wall, 1, Plain{});
  }
  template <bool Friction>
  static void sweep_wall(Contacts& contacts, ContactRange range, std::span<Velocity> velocity, double mu,
                         WallCopy& wall, const SweepMomentum& momentum) {
    sweep_wall_from<R, Friction>(contacts, contacts, range, velocity, mu, wall, 1, start_of(momentum));
  }
  template <bool Friction>
  static void sweep_grains(const Contacts& contacts, SingleContacts& single, ContactRange range,
                           std::span<SingleVelocity> velocity, double mu, const SweepMomentum& momentum) {
    sweep_grains_from<R, Friction>(contacts, single, range, velocity, mu, start_of(momentum));
  }
  template <bool Friction>
  static void sweep_wall(const Contacts& contacts, SingleContacts& single, ContactRange range,
                         std::span<SingleVelocity> velocity, double mu, WallCopy& wall,
                         const SweepMomentum& momentum) {
    sweep_wall_from<R, Friction>(contacts, single, range, velocity, mu, wall, single.unit,
                                 start_of(momentum));
  }
  template <bool Friction>
  static void accumulate_grains(const Contacts& contacts, ContactRange range, std::span<Velocity> velocity) {
    for (std::size_t k = range.begin; k < range.end; ++k) {
      prefetch_bodies(contacts, k, range.end, velocity);
      const V3<double> n = normal_of(contacts, k);
      push<R, Friction>(velocity[static_cast<std::size_t>(contacts.first[k])],
                        velocity[static_cast<std::size_t>(contacts.second[k])], n,
                        impulse_of<Friction>(contacts, k, n));
    }
  }
  template <bool Friction>
  static void accumulate_wall(const Contacts& contacts, ContactRange range, std::span<Velocity> velocity,
                              WallCopy& wall) {
    SplitWall<double> split(wall, range);
    for (std::size_t k = range.begin; k < range.end; ++k) {
      const V3<double> n = normal_of(contacts, k);
      push<R, Friction>(velocity[static_cast<std::size_t>(contacts.first[k])], split.at(k), n,
                        impulse_of<Friction>(contacts, k, n));
    }
    split.glue(wall);
  }
  template <bool Friction>
  static ErrorSums error_grains(const Contacts& contacts, ContactRange range,
                                std::span<const Velocity> velocity, double mu, Multiplicities parts) {
    LaneSums sums;
    for (std::size_t k = range.begin; k < range.end; ++k) {
      const Velocity& a = velocity[static_cast<std::size_t>(contacts.first[k])];
      const Velocity& b = velocity[static_cast<std::size_t>(contacts.second[k])];
      const V3<double> n = normal_of(contacts, k);
      const double w_nn = whole(a, contacts.first[k], parts) + whole(b, contacts.second[k], parts);
      add_error<R, Friction>(sums.at(k - range.begin), contacts, k, n, relative<R, Friction>(a, b, n), w_nn,
                             mu);
    }
    return sums.total();
  }
  template <bool Friction>
  static ErrorSums error_wall(const Contacts& contacts, ContactRange range,
                              std::span<const Velocity> velocity, double mu, const WallCopy& wall,
                              double wall_inv_mass, Multiplicities parts) {
    LaneSums sums;
    for (std::size_t k = range.begin; k < range.end; ++k) {
      const Velocity& a = velocity[static_cast<std::size_t>(contacts.first[k])];
      const V3<double> n = normal_of(contacts, k);
      ErrorSums& own = sums.at(k - range.begin);
      add_error<R, Friction>(own, contacts, k, n, relative<R, Friction>(a, wall, n),
                             whole(a, contacts.first[k], parts) + wall_inv_mass, mu);
      store(own.wall_impulse, load(own.wall_impulse) + impulse_of<Friction>(contacts, k, n));
    }
    return sums.total();
  }

 private:
  static WithMomentum<R> start_of(const SweepMomentum& momentum) {
    return {momentum.beta, momentum.omega, momentum.steps};
  }
};

}  // namespace talus::scalar
