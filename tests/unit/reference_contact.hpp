#pragma once

/// One contact of spheres, written as plainly as its formulas: the truth that the law and the sweeps of every
/// instruction set are held against, bit by bit. A product that is added to something is rounded once, with
/// its sum (std::fma), where the kernels do so.

#include <algorithm>
#include <cmath>
#include <concepts>
#include <limits>

#include "kernels/sweeps/sweep.hpp"

namespace talus::test {

template <class N>
struct V3 {
  N x, y, z;
  explicit V3(const N* p) : V3(p[0], p[1], p[2]) {}
  V3(N a, N b, N c) : x(a), y(b), z(c) {}
  V3 operator+(const V3& o) const { return {x + o.x, y + o.y, z + o.z}; }
  V3 operator-(const V3& o) const { return {x - o.x, y - o.y, z - o.z}; }
  V3 operator*(N s) const { return {s * x, s * y, s * z}; }
  /// This and s a.
  V3 plus(N s, const V3& a) const { return {std::fma(s, a.x, x), std::fma(s, a.y, y), std::fma(s, a.z, z)}; }
  N dot(const V3& o) const { return std::fma(z, o.z, std::fma(y, o.y, x * o.x)); }
  V3 cross(const V3& o) const {
    return {std::fma(y, o.z, -(z * o.y)), std::fma(z, o.x, -(x * o.z)), std::fma(x, o.y, -(y * o.x))};
  }
  void store(N* p) const { p[0] = x, p[1] = y, p[2] = z; }
};

/// The larger of 0 and a number; a NaN stays one.
template <class N>
N positive(N value) {
  return N(0) > value ? N(0) : value;
}

/// Up to 8 copies of a wall inside a chunk: what each has gained stands apart from the wall's own velocity.
template <class N>
struct WallParts {
  V3<N> velocity;
  N inv_mass;
  std::size_t count;
  N gained[8][3]{};

  WallParts(const WallCopy& wall, ContactRange range, double unit)
      : velocity(N(wall.velocity[0]), N(wall.velocity[1]), N(wall.velocity[2])),
        inv_mass(N(wall.inv_mass * unit * double(std::min<std::size_t>(range.end - range.begin, 8)))),
        count(std::min<std::size_t>(range.end - range.begin, 8)) {}
  void glue(WallCopy& wall) const {
    for (int d = 0; d < 3 && wall.inv_mass != 0 && count > 0; ++d) {
      double sum = 0;
      for (std::size_t l = 0; l < count; ++l) sum += gained[l][d];
      wall.velocity[d] += 1 / double(count) * sum;
    }
  }
};

/// One contact: its grain a, and either a second one, b, or a part of a wall.
template <bool Friction, class N>
struct Contact {
  V3<N> n;
  VelocityOf<N>& a;
  VelocityOf<N>* b = nullptr;
  WallParts<N>* wall = nullptr;
  std::size_t part = 0;

  N w_nn() const { return a.inv_mass + (b ? b->inv_mass : wall->inv_mass); }
  N w_tt() const { return b ? w_nn() + (a.spin_mobility + b->spin_mobility) : a.inv_mass + a.spin_mobility; }
  V3<N> velocity() const {
    const V3<N> du = V3<N>(a.u) - (b ? V3<N>(b->u) : wall->velocity + V3<N>(wall->gained[part]));
    if (!Friction) return du;
    const V3<N> w = b ? V3<N>(a.w) + V3<N>(b->w) : V3<N>(a.w);
    return {std::fma(w.z, n.y, std::fma(-w.y, n.z, du.x)), std::fma(w.x, n.z, std::fma(-w.z, n.x, du.y)),
            std::fma(w.y, n.x, std::fma(-w.x, n.y, du.z))};
  }
  void push(const V3<N>& dr) const {
    V3<N>(a.u).plus(a.inv_mass, dr).store(a.u);
    if (b) V3<N>(b->u).plus(-b->inv_mass, dr).store(b->u);
    // A wall moves along its normal only.
    if (wall) V3<N>(wall->gained[part]).plus(-wall->inv_mass * n.dot(dr), n).store(wall->gained[part]);
    if (!Friction) return;
    V3<N>(a.w).plus(a.spin_mobility, dr.cross(n)).store(a.w);
    if (b) V3<N>(b->w).plus(b->spin_mobility, dr.cross(n)).store(b->w);
  }
};

/// Solves contact k of `arrays` (Contacts or SingleContacts) and pushes its bodies.
template <bool Friction, class Arrays, class N>
void solve(const Contact<Friction, N>& c, Arrays& arrays, std::size_t k, double mu, const SweepMomentum* m) {
  const V3<N> v = c.velocity();
  const N closing = v.dot(c.n) + arrays.bias[k], omega = m ? N(m->omega) : N(1), beta = m ? N(m->beta) : N(0);
  if constexpr (Friction) {
    const V3<N> s{arrays.rx[k], arrays.ry[k], arrays.rz[k]};
    const V3<N> r = m ? s.plus(beta, {N(m->steps.x[k]), N(m->steps.y[k]), N(m->steps.z[k])}) : s;
    const N inverse = 1 / (c.w_nn() * c.w_tt()), inv_nn = inverse * c.w_tt(), inv_tt = inverse * c.w_nn();
    const N r_n = r.dot(c.n), r_n_new = positive(std::fma(-omega, closing * inv_nn, r_n));
    const V3<N> t = r.plus(-inv_tt, v).plus(-std::fma(-inv_tt, v.dot(c.n), r_n), c.n);
    const N least = std::same_as<N, float> ? std::numeric_limits<N>::min() : N(0);
    const N t2 = t.dot(t) + least, limit = N(mu) * r_n_new;
    const V3<N> r_new = (c.n * r_n_new).plus(t2 > limit * limit ? limit / std::sqrt(t2) : N(1), t);
    arrays.rx[k] = r_new.x, arrays.ry[k] = r_new.y, arrays.rz[k] = r_new.z;
    const V3<N> step = r_new - s;
    if (m) m->steps.x[k] = float(step.x), m->steps.y[k] = float(step.y), m->steps.z[k] = float(step.z);
    c.push(r_new - r);
  } else {
    const N s = arrays.rn[k], r = m ? std::fma(beta, N(m->steps.n[k]), s) : s;
    arrays.rn[k] = positive(std::fma(-omega, closing / c.w_nn(), r));
    if (m) m->steps.n[k] = float(arrays.rn[k] - s);
    c.push(c.n * (arrays.rn[k] - r));
  }
}

template <bool Friction>
V3<double> impulse_of(const Contacts& c, std::size_t k) {
  if constexpr (Friction) return {c.rx[k], c.ry[k], c.rz[k]};
  return V3<double>{c.nx[k], c.ny[k], c.nz[k]} * c.rn[k];
}

inline V3<double> project_on_cone(const V3<double>& z, const V3<double>& n, double mu) {
  const double z_n = z.dot(n);
  const V3<double> t = z.plus(-z_n, n);
  const double length = std::sqrt(t.dot(t));
  if (mu * length <= -z_n) return {0, 0, 0};
  if (length <= mu * z_n) return z;
  const double r_n = std::fma(mu, length, z_n) * (1 / (1 + mu * mu));
  return (n * r_n).plus(mu * r_n / length, t);
}

template <bool Friction>
void add_error(ErrorSums& sums, const V3<double>& n, const V3<double>& r, const V3<double>& v, double bias,
               double w_nn, double mu) {
  const double v_0 = v.dot(n), v_n = v_0 + bias, r_n = r.dot(n);
  const V3<double> v_t = v.plus(-v_0, n), p = r * w_nn;
  const double v_t2 = v_t.dot(v_t);
  const V3<double> miss = p - project_on_cone(p - v_t.plus(std::fma(mu, std::sqrt(v_t2), v_n), n), n, mu);
  sums.residual2 += miss.dot(miss);
  sums.residual_max2 = std::max(sums.residual_max2, miss.dot(miss));
  sums.impulse2 += p.dot(p);
  if (r_n > 0 || v_n < 0) sums.velocity2 += std::fma(v_n, v_n, v_t2);
  sums.work += r_n * std::sqrt(miss.dot(miss));
  sums.active += r_n > 0;
}

/// Without friction.
inline void add_error(ErrorSums& sums, double r_n, double closing, double w_nn) {
  const double p = w_nn * r_n, miss = p - positive(p - closing);
  sums.residual2 += miss * miss;
  sums.residual_max2 = std::max(sums.residual_max2, miss * miss);
  sums.impulse2 += p * p;
  if (r_n > 0 || closing < 0) sums.velocity2 += closing * closing;
  sums.work += r_n * std::abs(miss);
  sums.active += r_n > 0;
}

}  // namespace talus::test
