#include "runtime/step/force_fabric.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "kernels/detection/measures.hpp"
#include "runtime/step/cell_flow.hpp"

namespace talus {

namespace {

/// Sums of matrices over the contacts that carry, subdomain by subdomain.
struct Sums {
  double subdomain = 0, contacts = 0;
  double first[9] = {}, second[9] = {};
};

/// Calls visit(sums of its subdomain, n, r) for each such contact here. Returns the sums of all ranks, in
/// order of subdomain.
template <class Visit>
Sums sum_over_contacts(const StepState& state, const graph::Communicator& ranks, const Visit& visit) {
  std::vector<Sums> rows(state.decomposition.here.size());
  for (const SubdomainPlace e : state.decomposition.here.indices())
    rows[e.at()].subdomain = state.decomposition.here[e].value();
  const Contacts& c = state.contacts;
  for (std::size_t chunk = 0; chunk < state.chunks.size(); ++chunk) {
    if (state.chunks.wall[chunk] >= 0) continue;
    Sums& sums = rows[static_cast<std::size_t>(state.chunks.subdomain[chunk])];
    const auto begin = static_cast<std::size_t>(state.chunks.begin[chunk]);
    for (std::size_t k = begin; k < begin + static_cast<std::size_t>(c.count[chunk]); ++k) {
      const Vec3 n = contact_normal(c, k), r = contact_impulse(c, k);
      if (r == Vec3::Zero()) continue;
      sums.contacts += 1;
      visit(sums, n, r);
    }
  }
  rows = ranks.gather_records(std::span<const Sums>(rows));
  std::ranges::sort(rows, {}, &Sums::subdomain);
  Sums all;
  for (const Sums& row : rows) {
    all.contacts += row.contacts;
    for (std::size_t k = 0; k < 9; ++k) {
      all.first[k] += row.first[k];
      all.second[k] += row.second[k];
    }
  }
  return all;
}

}  // namespace

ForceFabric force_fabric(const StepState& state, const graph::Communicator& ranks) {
  using Matrix = Eigen::Map<Mat3>;
  ForceFabric out;
  Sums directions = sum_over_contacts(
      state, ranks, [](Sums& sums, const Vec3& n, const Vec3&) { Matrix(sums.first) += n * n.transpose(); });
  out.contacts = directions.contacts;
  if (out.contacts == 0) return out;
  out.fabric = Matrix(directions.first) / out.contacts;
  out.of_contacts = 7.5 * deviator(out.fabric);
  Sums forces = sum_over_contacts(state, ranks, [&](Sums& sums, const Vec3& n, const Vec3& r) {
    // Dividing by the density gives each direction the same weight, however many contacts point there.
    const double r_n = r.dot(n), density = 1 + n.dot(out.of_contacts * n);
    if (!(density > 0)) return;
    Matrix(sums.first) += r_n / density * n * n.transpose();
    Matrix(sums.second) += (r - r_n * n) / density * n.transpose();
  });
  const double mean = Matrix(forces.first).trace();
  if (!(mean > 0)) return out;
  out.of_normal_forces = 7.5 / mean * deviator(Matrix(forces.first));
  out.of_tangential_forces = 5 / mean * deviator(Matrix(forces.second));
  return out;
}

double along_stress(const Mat3& anisotropy, const Mat3& stress_deviator) {
  const double size = stress_deviator.norm();
  return size > 0 ? std::sqrt(1.5) * anisotropy.cwiseProduct(stress_deviator).sum() / size : 0;
}

double stress_ratio_of(const ForceFabric& of, const Mat3& stress_deviator) {
  const Mat3 &c = of.of_contacts, &n = of.of_normal_forces, &t = of.of_tangential_forces;
  const Mat3 first = 2.0 / 15 * (c + n + 1.5 * t),
             second = 1.0 / 105 * deviator(4 * (c * n + n * c) + 3 * (c * t + t * c));
  const double mean = 1 + 2.0 / 15 * c.cwiseProduct(n).sum();
  return mean > 0 ? 3 * along_stress(first + second, stress_deviator) / mean : 0;
}

}  // namespace talus
