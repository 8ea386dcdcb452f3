#include "kernels/clusters/cluster_work.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "kernels/bodies/index.hpp"
#include "kernels/bodies/larger.hpp"
#include "kernels/global/natural_map.hpp"
#include "kernels/global/residuals.hpp"

namespace talus {

namespace {

/// Columns of a cluster: sums, the last ones the impulse at each wall; and at the end of the row the
/// fastest drive.
struct WorkColumn {
  enum : std::size_t { work, energy, mass, walls };
};

/// Adds what the bodies of a part have exchanged.
void add_bodies(const ProblemReader& part, std::span<const Twist> V, std::span<const std::int32_t> group,
                std::size_t width, std::span<double> row) {
  for (std::size_t b = 0; b < part.unknowns(); ++b) {
    if (group[b] < 0 || !part.counted(b)) continue;
    const BodyUnknown body = part.unknown(b);
    if (body.kind == BodyKind::wall) continue;  // by its impulse
    const std::span<double> own = row.subspan(at(group[b]) * width, width);
    own[WorkColumn::energy] += 0.5 * body.mass * (V[b].u - body.free.u).squaredNorm();
    own[WorkColumn::mass] += body.mass;
  }
}

void add_contacts(const ProblemReader& part, std::span<const Twist> V, std::span<const std::int32_t> group,
                  std::size_t width, std::span<double> row) {
  part.each_contact([&](const ContactEquation& c, const Vec3& r) {
    const std::int32_t g = group[at(c.first)];
    if (g < 0) return;
    const std::span<double> own = row.subspan(at(g) * width, width);
    const Vec3 v = constrained_velocity(c, V);
    const double m = effective_mass_by([&](std::size_t body) { return part.mass(body); }, c);
    own[WorkColumn::work] += std::max(0.0, c.normal.dot(r)) * natural_map_of(m, c, r, v).residual(r);
    own.back() = std::max(own.back(), std::abs(c.drive));
    if (c.wall < 0) return;
    for (int k = 0; k < 3; ++k) own[WorkColumn::walls + 3 * at(c.wall) + static_cast<std::size_t>(k)] += r[k];
  });
}

double relative_work(std::span<const double> own, const ExchangeFloors& floors) {
  if (!(own[WorkColumn::work] > 0)) return own[WorkColumn::work];
  double of_walls = 0, pressed = 0;
  for (std::size_t w = 0; w < floors.wall_inv_masses.size(); ++w) {
    const double* r = own.data() + WorkColumn::walls + 3 * w;
    const double impulse2 = r[0] * r[0] + r[1] * r[1] + r[2] * r[2];
    of_walls += 0.5 * impulse2 * std::min(floors.wall_inv_masses[w], 1 / own[WorkColumn::mass]);
    pressed = std::max(pressed, std::sqrt(impulse2));
  }
  const double speed =
      std::max({own.back(), floors.speed, floors.interest * pressed / own[WorkColumn::mass]});
  return own[WorkColumn::work] /
         std::max(own[WorkColumn::energy] + of_walls, 0.5 * own[WorkColumn::mass] * speed * speed);
}

}  // namespace

double largest_work(const ProblemReaders& parts, const BodyGroups& groups, const PartLink& link,
                    const ExchangeFloors& floors) {
  const PartField V = velocities_of(parts, link);
  const RowColumns columns{.sums = WorkColumn::walls + 3 * floors.wall_inv_masses.size(), .largest = 1};
  const std::size_t width = columns.width();
  const std::vector<double> all =
      reduced_of(link, parts.size(), columns, groups.size(), [&](std::size_t p, std::span<double> row) {
        add_bodies(*parts[p], V[p], groups.of_body[p], width, row);
        add_contacts(*parts[p], V[p], groups.of_body[p], width, row);
      });
  double largest = 0;
  for (std::size_t g = 0; g < groups.size(); ++g)
    largest = larger(largest, relative_work(std::span(all).subspan(g * width, width), floors));
  return largest;
}

}  // namespace talus
