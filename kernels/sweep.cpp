#include "kernels/sweep.hpp"

#include <algorithm>
#include <cmath>
#include <concepts>
#include <limits>
#include <type_traits>

namespace talus {

namespace {

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
template <class N>
inline N dot(V3<N> a, V3<N> b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class N>
inline V3<N> cross(V3<N> a, V3<N> b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <class N>
inline V3<N> load(const N* p) {
  return {p[0], p[1], p[2]};
}
template <class N>
inline void add_to(N* p, V3<N> a) {
  p[0] += a.x;
  p[1] += a.y;
  p[2] += a.z;
}

/// `Arrays` are Contacts or SingleContacts.
template <class Arrays>
inline auto normal_of(const Arrays& c, std::size_t k) {
  return V3{c.nx[k], c.ny[k], c.nz[k]};
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
template <class N>
inline void add_velocity(WallPart<N>& wall, V3<N> dv) {
  add_to(wall.gained, dv);
}
inline void add_velocity(WallCopy& wall, V3<double> dv) {
  add_to(wall.velocity, dv);
}

/// Relative velocity of two grains at their contact.
template <bool Friction, class N>
inline V3<N> relative(const VelocityOf<N>& a, const VelocityOf<N>& b, V3<N> n) {
  const V3<N> du = load(a.u) - load(b.u);
  if constexpr (Friction) return du - cross(load(a.w) + load(b.w), n);
  return du;
}

/// `Wall` is a WallPart or a WallCopy.
template <bool Friction, class N, class Wall>
inline V3<N> relative(const VelocityOf<N>& a, const Wall& wall, V3<N> n) {
  const V3<N> du = load(a.u) - velocity_of(wall);
  if constexpr (Friction) return du - cross(load(a.w), n);
  return du;
}

/// Adds an impulse dr on the first body, -dr on the second.
template <bool Friction, class N>
inline void push(VelocityOf<N>& a, VelocityOf<N>& b, V3<N> n, V3<N> dr) {
  add_to(a.u, a.inv_mass * dr);
  add_to(b.u, -b.inv_mass * dr);
  if constexpr (Friction) {
    const V3<N> turn = cross(dr, n);
    add_to(a.w, a.spin_mobility * turn);
    add_to(b.w, b.spin_mobility * turn);
  }
}

template <bool Friction, class N, class Wall>
inline void push(VelocityOf<N>& a, Wall& wall, V3<N> n, V3<N> dr) {
  add_to(a.u, a.inv_mass * dr);
  add_velocity(wall, -wall.inv_mass * dot(n, dr) * n);  // a wall moves along its normal only
  if constexpr (Friction) add_to(a.w, a.spin_mobility * cross(dr, n));
}

/// max(0, value) without a jump, as nobody can predict which contacts are open; a NaN stays one.
template <class N>
inline N positive_part(N value) {
  return N(0.5) * (value + std::abs(value));
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

template <bool Friction>
inline void store_impulse(Contacts& c, std::size_t k, V3<double> r, V3<double> n) {
  if constexpr (Friction)
    store_vector(c, k, r);
  else
    c.rn[k] = dot(r, n);
}

/// A plain sweep begins where the last one ended.
struct Plain {
  double omega = 1;
  V3<double> begin(V3<double> s, std::size_t) const { return s; }
  double begin(double s, std::size_t) const { return s; }
  void end(V3<double>, V3<double>, std::size_t) const {}
  void end(double, double, std::size_t) const {}
};

struct WithMomentum {
  double beta, omega;
  SweepSteps& steps;
  template <class N>
  V3<N> begin(V3<N> s, std::size_t k) const {
    return s + static_cast<N>(beta) * V3<N>{steps.x[k], steps.y[k], steps.z[k]};
  }
  template <std::floating_point N>
  N begin(N s, std::size_t k) const {
    return s + static_cast<N>(beta) * static_cast<N>(steps.n[k]);
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
template <bool Friction, class Arrays, class N, class Start>
inline V3<N> solve_law(Arrays& c, std::size_t k, V3<N> n, V3<N> v, N w_nn, N w_tt, double mu,
                       const Start& start) {
  const N v_n = dot(v, n), omega = static_cast<N>(start.omega);
  if constexpr (Friction) {
    const V3<N> s{c.rx[k], c.ry[k], c.rz[k]}, r = start.begin(s, k);
    const N r_n = dot(r, n);
    const N r_n_new = positive_part(r_n - omega * (v_n + c.bias[k]) / w_nn);
    const N limit = static_cast<N>(mu) * r_n_new;
    const V3<N> t = (r - r_n * n) - (1 / w_tt) * (v - v_n * n);
    // In floats squares vanish early: a contact that carries nothing must not keep what is left of its t.
    const N t2 = std::is_same_v<N, float> ? dot(t, t) + std::numeric_limits<N>::min() : dot(t, t);
    const N scale = t2 > limit * limit ? limit / std::sqrt(t2) : N(1);
    const V3<N> r_new = r_n_new * n + scale * t;
    store_vector(c, k, r_new);
    start.end(s, r_new, k);
    return r_new - r;
  } else {
    const N s = c.rn[k], r_n = start.begin(s, k);
    const N r_n_new = positive_part(r_n - omega * (v_n + c.bias[k]) / w_nn);
    c.rn[k] = r_n_new;
    start.end(s, r_n_new, k);
    return (r_n_new - r_n) * n;
  }
}

/// Projection of z on the Coulomb cone about n.
inline V3<double> project_on_cone(V3<double> z, V3<double> n, double mu) {
  const double z_n = dot(z, n);
  const V3<double> t = z - z_n * n;
  const double length = std::sqrt(dot(t, t));
  if (mu * length <= -z_n) return {0, 0, 0};  // first: with mu = 0 = length the other one would hold, too
  if (length <= mu * z_n) return z;
  const double r_n = (z_n + mu * length) * (1 / (1 + mu * mu));
  return r_n * n + (mu * r_n / length) * t;
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
    add_to(wall.velocity, mean);
  }

 private:
  static constexpr std::size_t wall_lanes = 8;
  std::size_t begin_, lanes_;
  WallPart<N> parts_[wall_lanes];
};

/// 1/M of the body whose copy this is.
inline double whole(const Velocity& copy, Slot slot, Multiplicities multiplicity) {
  return multiplicity.empty() ? copy.inv_mass : copy.inv_mass / multiplicity[static_cast<std::size_t>(slot)];
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

template <bool Friction>
inline void add_error(ErrorSums& sums, const Contacts& c, std::size_t k, V3<double> n, V3<double> v,
                      double w_nn, double mu) {
  const double v_0 = dot(v, n), v_n = v_0 + c.bias[k];
  double e2, r_n;
  if constexpr (Friction) {
    const V3<double> r{c.rx[k], c.ry[k], c.rz[k]};
    const V3<double> v_t = v - v_0 * n;
    const V3<double> v_hat = v_t + (v_n + mu * std::sqrt(dot(v_t, v_t))) * n;
    const V3<double> p = w_nn * r, miss = p - project_on_cone(p - v_hat, n, mu);
    e2 = dot(miss, miss);
    r_n = dot(r, n);
    sums.impulse2 += dot(p, p);
    if (r_n > 0 || v_n < 0) sums.velocity2 += dot(v_t, v_t) + v_n * v_n;
  } else {
    r_n = c.rn[k];
    const double p = w_nn * r_n, miss = p - positive_part(p - v_n);
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
template <bool Friction, class Arrays, class N, class Start>
void sweep_grains_from(const Contacts& contacts, Arrays& arrays, ContactRange range,
                       std::span<VelocityOf<N>> velocity, double mu, const Start& start) {
  for (std::size_t k = range.begin; k < range.end; ++k) {
    prefetch_bodies(contacts, k, range.end, velocity);
    VelocityOf<N>& a = velocity[static_cast<std::size_t>(contacts.first[k])];
    VelocityOf<N>& b = velocity[static_cast<std::size_t>(contacts.second[k])];
    const V3<N> n = normal_of(arrays, k);
    const N w_nn = a.inv_mass + b.inv_mass;
    const N w_tt = w_nn + (a.spin_mobility + b.spin_mobility);
    push<Friction>(a, b, n,
                   solve_law<Friction>(arrays, k, n, relative<Friction>(a, b, n), w_nn, w_tt, mu, start));
  }
}

template <bool Friction, class Arrays, class N, class Start>
void sweep_wall_from(const Contacts& contacts, Arrays& arrays, ContactRange range,
                     std::span<VelocityOf<N>> velocity, double mu, WallCopy& wall, double unit,
                     const Start& start) {
  SplitWall<N> split(wall, range, unit);
  for (std::size_t k = range.begin; k < range.end; ++k) {
    VelocityOf<N>& a = velocity[static_cast<std::size_t>(contacts.first[k])];
    WallPart<N>& own = split.at(k);
    const V3<N> n = normal_of(arrays, k);
    push<Friction>(a, own, n,
                   solve_law<Friction>(arrays, k, n, relative<Friction>(a, own, n), a.inv_mass + own.inv_mass,
                                       a.inv_mass + a.spin_mobility, mu, start));
  }
  split.glue(wall);
}

}  // namespace

template <bool Friction>
void sweep_grains(Contacts& contacts, ContactRange range, std::span<Velocity> velocity, double mu) {
  sweep_grains_from<Friction>(contacts, contacts, range, velocity, mu, Plain{});
}

template <bool Friction>
void sweep_grains(Contacts& contacts, ContactRange range, std::span<Velocity> velocity, double mu,
                  const SweepMomentum& momentum) {
  sweep_grains_from<Friction>(contacts, contacts, range, velocity, mu,
                              WithMomentum{momentum.beta, momentum.omega, momentum.steps});
}

template <bool Friction>
void sweep_wall(Contacts& contacts, ContactRange range, std::span<Velocity> velocity, double mu,
                WallCopy& wall) {
  sweep_wall_from<Friction>(contacts, contacts, range, velocity, mu, wall, 1, Plain{});
}

template <bool Friction>
void sweep_wall(Contacts& contacts, ContactRange range, std::span<Velocity> velocity, double mu,
                WallCopy& wall, const SweepMomentum& momentum) {
  sweep_wall_from<Friction>(contacts, contacts, range, velocity, mu, wall, 1,
                            WithMomentum{momentum.beta, momentum.omega, momentum.steps});
}

template <bool Friction>
void sweep_grains(const Contacts& contacts, SingleContacts& single, ContactRange range,
                  std::span<SingleVelocity> velocity, double mu, const SweepMomentum& momentum) {
  sweep_grains_from<Friction>(contacts, single, range, velocity, mu,
                              WithMomentum{momentum.beta, momentum.omega, momentum.steps});
}

template <bool Friction>
void sweep_wall(const Contacts& contacts, SingleContacts& single, ContactRange range,
                std::span<SingleVelocity> velocity, double mu, WallCopy& wall,
                const SweepMomentum& momentum) {
  sweep_wall_from<Friction>(contacts, single, range, velocity, mu, wall, single.unit,
                            WithMomentum{momentum.beta, momentum.omega, momentum.steps});
}

template <bool Friction>
void accumulate_grains(const Contacts& contacts, ContactRange range, std::span<Velocity> velocity) {
  for (std::size_t k = range.begin; k < range.end; ++k) {
    prefetch_bodies(contacts, k, range.end, velocity);
    const V3<double> n = normal_of(contacts, k);
    push<Friction>(velocity[static_cast<std::size_t>(contacts.first[k])],
                   velocity[static_cast<std::size_t>(contacts.second[k])], n,
                   impulse_of<Friction>(contacts, k, n));
  }
}

template <bool Friction>
void accumulate_wall(const Contacts& contacts, ContactRange range, std::span<Velocity> velocity,
                     WallCopy& wall) {
  SplitWall<double> split(wall, range);
  for (std::size_t k = range.begin; k < range.end; ++k) {
    const V3<double> n = normal_of(contacts, k);
    push<Friction>(velocity[static_cast<std::size_t>(contacts.first[k])], split.at(k), n,
                   impulse_of<Friction>(contacts, k, n));
  }
  split.glue(wall);
}

template <bool Friction>
ErrorSums error_grains(const Contacts& contacts, ContactRange range, std::span<const Velocity> velocity,
                       double mu, Multiplicities multiplicity) {
  LaneSums sums;
  for (std::size_t k = range.begin; k < range.end; ++k) {
    const Velocity& a = velocity[static_cast<std::size_t>(contacts.first[k])];
    const Velocity& b = velocity[static_cast<std::size_t>(contacts.second[k])];
    const V3<double> n = normal_of(contacts, k);
    const double w_nn =
        whole(a, contacts.first[k], multiplicity) + whole(b, contacts.second[k], multiplicity);
    add_error<Friction>(sums.at(k - range.begin), contacts, k, n, relative<Friction>(a, b, n), w_nn, mu);
  }
  return sums.total();
}

template <bool Friction>
ErrorSums error_wall(const Contacts& contacts, ContactRange range, std::span<const Velocity> velocity,
                     double mu, const WallCopy& wall, double wall_inv_mass, Multiplicities multiplicity) {
  LaneSums sums;
  for (std::size_t k = range.begin; k < range.end; ++k) {
    const Velocity& a = velocity[static_cast<std::size_t>(contacts.first[k])];
    const V3<double> n = normal_of(contacts, k);
    ErrorSums& own = sums.at(k - range.begin);
    add_error<Friction>(own, contacts, k, n, relative<Friction>(a, wall, n),
                        whole(a, contacts.first[k], multiplicity) + wall_inv_mass, mu);
    add_to(own.wall_impulse, impulse_of<Friction>(contacts, k, n));
  }
  return sums.total();
}

void ErrorSums::add(const ErrorSums& other) {
  residual2 += other.residual2;
  residual_max2 = std::max(residual_max2, other.residual_max2);
  impulse2 += other.impulse2;
  velocity2 += other.velocity2;
  for (int c = 0; c < 3; ++c) wall_impulse[c] += other.wall_impulse[c];
  contacts += other.contacts;
  active += other.active;
}

void glue_copies(std::span<WallCopy> copies, std::span<const std::int32_t> which) {
  if (which.empty()) return;
  V3<double> sum{0, 0, 0};
  for (std::int32_t k : which) sum = sum + load(copies[static_cast<std::size_t>(k)].velocity);
  const V3<double> mean = (1 / static_cast<double>(which.size())) * sum;
  for (std::int32_t k : which) {
    double* velocity = copies[static_cast<std::size_t>(k)].velocity;
    velocity[0] = mean.x;
    velocity[1] = mean.y;
    velocity[2] = mean.z;
  }
}

template <bool Friction>
void copy_impulses(const Contacts& contacts, ContactRange range, std::vector<double>& out) {
  out.clear();
  for (std::size_t k = range.begin; k < range.end; ++k) {
    if constexpr (Friction) {
      out.insert(out.end(), {contacts.rx[k], contacts.ry[k], contacts.rz[k]});
    } else {
      out.push_back(contacts.rn[k]);
    }
  }
}

template <bool Friction>
void relax(Contacts& contacts, ContactRange range, std::span<const double> before,
           Multiplicities multiplicity, std::span<Velocity> velocity, WallCopy* wall) {
  for (std::size_t k = range.begin; k < range.end; ++k) {
    const auto i = static_cast<std::size_t>(contacts.first[k]);
    const auto j = static_cast<std::size_t>(std::max(contacts.second[k], 0));
    const auto m = wall ? multiplicity[i] : std::max(multiplicity[i], multiplicity[j]);
    if (m == 1) continue;
    const V3<double> n = normal_of(contacts, k);
    const V3<double> r = impulse_of<Friction>(contacts, k, n);
    const double* b = &before[(k - range.begin) * (Friction ? 3 : 1)];
    V3<double> r_before;
    if constexpr (Friction)
      r_before = load(b);
    else
      r_before = *b * n;
    const V3<double> r_new = r_before + (1.0 / m) * (r - r_before);
    if (wall)
      push<Friction>(velocity[i], *wall, n, r_new - r);
    else
      push<Friction>(velocity[i], velocity[j], n, r_new - r);
    store_impulse<Friction>(contacts, k, r_new, n);
  }
}

template void sweep_grains<true>(const Contacts&, SingleContacts&, ContactRange, std::span<SingleVelocity>,
                                 double, const SweepMomentum&);
template void sweep_wall<true>(const Contacts&, SingleContacts&, ContactRange, std::span<SingleVelocity>,
                               double, WallCopy&, const SweepMomentum&);
template void sweep_grains<false>(const Contacts&, SingleContacts&, ContactRange, std::span<SingleVelocity>,
                                  double, const SweepMomentum&);
template void sweep_wall<false>(const Contacts&, SingleContacts&, ContactRange, std::span<SingleVelocity>,
                                double, WallCopy&, const SweepMomentum&);
template void sweep_grains<true>(Contacts&, ContactRange, std::span<Velocity>, double);
template void sweep_grains<true>(Contacts&, ContactRange, std::span<Velocity>, double, const SweepMomentum&);
template void sweep_wall<true>(Contacts&, ContactRange, std::span<Velocity>, double, WallCopy&);
template void sweep_wall<true>(Contacts&, ContactRange, std::span<Velocity>, double, WallCopy&,
                               const SweepMomentum&);
template void sweep_grains<false>(Contacts&, ContactRange, std::span<Velocity>, double);
template void sweep_grains<false>(Contacts&, ContactRange, std::span<Velocity>, double, const SweepMomentum&);
template void sweep_wall<false>(Contacts&, ContactRange, std::span<Velocity>, double, WallCopy&);
template void sweep_wall<false>(Contacts&, ContactRange, std::span<Velocity>, double, WallCopy&,
                                const SweepMomentum&);
template void accumulate_grains<true>(const Contacts&, ContactRange, std::span<Velocity>);
template void accumulate_grains<false>(const Contacts&, ContactRange, std::span<Velocity>);
template void accumulate_wall<true>(const Contacts&, ContactRange, std::span<Velocity>, WallCopy&);
template void accumulate_wall<false>(const Contacts&, ContactRange, std::span<Velocity>, WallCopy&);
template ErrorSums error_grains<true>(const Contacts&, ContactRange, std::span<const Velocity>, double,
                                      Multiplicities);
template ErrorSums error_grains<false>(const Contacts&, ContactRange, std::span<const Velocity>, double,
                                       Multiplicities);
template ErrorSums error_wall<true>(const Contacts&, ContactRange, std::span<const Velocity>, double,
                                    const WallCopy&, double, Multiplicities);
template ErrorSums error_wall<false>(const Contacts&, ContactRange, std::span<const Velocity>, double,
                                     const WallCopy&, double, Multiplicities);
template void relax<true>(Contacts&, ContactRange, std::span<const double>, Multiplicities,
                          std::span<Velocity>, WallCopy*);
template void relax<false>(Contacts&, ContactRange, std::span<const double>, Multiplicities,
                           std::span<Velocity>, WallCopy*);
template void copy_impulses<true>(const Contacts&, ContactRange, std::vector<double>&);
template void copy_impulses<false>(const Contacts&, ContactRange, std::vector<double>&);

}  // namespace talus
