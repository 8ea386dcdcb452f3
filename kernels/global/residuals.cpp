#include "kernels/global/residuals.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>

#include "kernels/global/natural_map.hpp"

namespace talus {

namespace {

/// Classes of residuals, an eighth of an octave wide, from 2^lowest on. What is smaller is in the first.
constexpr int lowest = -40, highest = 24, per_octave = 8;
constexpr std::size_t classes = (highest - lowest) * per_octave;
/// Mantissas 2^(k/8 - 1) at which a class begins. std::log2 need not give the same bits on every machine.
constexpr std::array<double, per_octave> edges = {0.5,
                                                  0.54525386633262882,
                                                  0.59460355750136053,
                                                  0.64841977732550475,
                                                  0.70710678118654757,
                                                  0.77110541270397037,
                                                  0.84089641525371450,
                                                  0.91700404320467121};

std::size_t class_of(double residual) {
  if (!(residual >= std::ldexp(0.5, lowest + 1))) return 0;
  int exponent = 0;
  const double mantissa = std::frexp(residual, &exponent);
  const auto within = std::upper_bound(edges.begin(), edges.end(), mantissa) - edges.begin() - 1;
  const std::int64_t number = std::int64_t{per_octave} * (exponent - 1 - lowest) + within;
  return static_cast<std::size_t>(std::min<std::int64_t>(number, std::int64_t{classes} - 1));
}

/// The largest residual of a class; the last one has no end.
double end_of(std::size_t number) {
  if (number + 1 == classes) return std::numeric_limits<double>::infinity();
  const auto next = static_cast<int>(number) + 1;
  return std::ldexp(edges[static_cast<std::size_t>(next % per_octave)], next / per_octave + lowest + 1);
}

PartField field_of(const ProblemReaders& parts) {
  PartField field;
  for (const auto& part : parts) field.emplace_back(part->unknowns());
  return field;
}

}  // namespace

PartField velocities_of(const ProblemReaders& parts, const PartLink& link) {
  PartField V = field_of(parts);
  link.each(parts.size(), [&](std::size_t p) {
    parts[p]->each_contact([&](const ContactEquation& c, const Vec3& r) { add_force(c, r, V[p]); });
  });
  link.sum_copies(V);
  link.each(parts.size(), [&](std::size_t p) {
    for (std::size_t b = 0; b < V[p].size(); ++b) velocity_from_force(parts[p]->unknown(b), V[p][b]);
  });
  return V;
}

Residuals residuals_of(const ProblemReaders& parts, const PartLink& link) {
  PartField V = velocities_of(parts, link), change = field_of(parts);
  Residuals out;
  out.contact.resize(parts.size());
  out.body.resize(parts.size());
  enum { impulse2, velocity2, contacts, width };
  const std::vector<double> sums =
      total_of(link, parts.size(), width, [&](std::size_t p, std::span<double> row) {
        const ProblemReader& problem = *parts[p];
        out.contact[p].reserve(problem.contacts());
        problem.each_contact([&](const ContactEquation& c, const Vec3& r) {
          const Vec3 v = constrained_velocity(c, V[p]);
          const double m = effective_mass_by([&](std::size_t body) { return problem.mass(body); }, c);
          const NaturalMap map = natural_map_of(m, c, r, v);
          add_force(c, map.carried - r, change[p]);
          out.contact[p].push_back(map.residual(r));
          row[impulse2] += r.squaredNorm() / (map.m * map.m);
          if (c.normal.dot(r) > 0 || c.normal.dot(v) < 0) row[velocity2] += v.squaredNorm();
          row[contacts] += 1;
        });
      });
  V = {};
  link.sum_copies(change);
  if (sums[contacts] > 0) out.scale = std::sqrt(std::max(sums[impulse2], sums[velocity2]) / sums[contacts]);
  const double over = out.scale > 0 ? 1 / out.scale : 0;
  for (std::size_t p = 0; p < parts.size(); ++p) {
    for (double& residual : out.contact[p]) residual *= over;
    out.body[p].reserve(change[p].size());
    for (std::size_t b = 0; b < change[p].size(); ++b) {
      const BodyUnknown body = parts[p]->unknown(b);
      restrict_to_freedoms(body, change[p][b]);
      out.body[p].push_back(change[p][b].u.norm() / body.mass * over);
    }
  }
  return out;
}

double quantile_of(const Residuals& residuals, const PartLink& link, double part) {
  const std::vector<double> counts =
      total_of(link, residuals.contact.size(), classes, [&](std::size_t p, std::span<double> row) {
        for (const double residual : residuals.contact[p]) row[class_of(residual)] += 1;
      });
  const double all = std::accumulate(counts.begin(), counts.end(), 0.0);
  if (all == 0) return 0;
  double below = 0;
  for (std::size_t k = 0; k < counts.size(); ++k) {
    below += counts[k];
    if (below >= part * all) return end_of(k);
  }
  return std::numeric_limits<double>::infinity();
}

}  // namespace talus
