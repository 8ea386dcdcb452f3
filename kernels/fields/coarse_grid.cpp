#include "kernels/fields/coarse_grid.hpp"

#include <algorithm>
#include <cmath>
#include <span>

namespace talus {

namespace {

/// Calls add(weight, numbers of the cell) for the cells of the grid whose centre lies in the box, with the
/// weights weight_at(centre), or nothing where these are 0 everywhere.
template <class WeightAt, class Add>
void spread(const Grid& grid, const Vec3& low, const Vec3& high, GridSums& sums, const WeightAt& weight_at,
            const Add& add) {
  std::array<std::int64_t, 3> from{}, to{};
  for (std::size_t k = 0; k < 3; ++k) {
    const auto axis = static_cast<Eigen::Index>(k);
    from[k] = static_cast<std::int64_t>(std::ceil((low[axis] - grid.low[axis]) / grid.spacing[axis] - 0.5));
    to[k] = static_cast<std::int64_t>(std::floor((high[axis] - grid.low[axis]) / grid.spacing[axis] - 0.5));
    if (from[k] >= grid.cells[k] || to[k] < 0) return;
  }
  struct Weight {
    std::size_t cell;
    double weight;
  };
  std::vector<Weight> weights;
  double sum = 0;
  for (std::int64_t z = from[2]; z <= to[2]; ++z)
    for (std::int64_t y = from[1]; y <= to[1]; ++y)
      for (std::int64_t x = from[0]; x <= to[0]; ++x) {
        const Vec3 place(static_cast<double>(x) + 0.5, static_cast<double>(y) + 0.5,
                         static_cast<double>(z) + 0.5);
        const double weight = weight_at(grid.low + grid.spacing.cwiseProduct(place));
        if (weight == 0) continue;
        sum += weight;
        const bool in =
            x >= 0 && y >= 0 && z >= 0 && x < grid.cells[0] && y < grid.cells[1] && z < grid.cells[2];
        if (in)
          weights.push_back({static_cast<std::size_t>((z * grid.cells[1] + y) * grid.cells[0] + x), weight});
      }
  if (sum == 0) return;
  const double unit = 1 / (sum * grid.cell_volume());
  for (const auto& [cell, weight] : weights) add(weight * unit, &sums.numbers[cell * GridSums::width]);
}

}  // namespace

void add_grain(const Grid& grid, const Lucy& lucy, const SpreadGrain& grain, GridSums& sums) {
  const auto& [x, u, mass, volume] = grain;
  const Vec3 reach = Vec3::Constant(lucy.cutoff());
  spread(
      grid, x - reach, x + reach, sums,
      [&lucy, &centre = x](const Vec3& place) { return lucy.at(place - centre); },
      [&, m = mass, v = volume, &velocity = u](double weight, double* cell) {
        cell[GridSums::density] += weight * m;
        cell[GridSums::volume] += weight * v;
        for (Eigen::Index i = 0; i < 3; ++i) {
          cell[GridSums::momentum + static_cast<std::size_t>(i)] += weight * m * velocity[i];
          for (Eigen::Index j = 0; j < 3; ++j)
            cell[GridSums::momentum_flux + static_cast<std::size_t>(3 * i + j)] +=
                weight * m * velocity[i] * velocity[j];
        }
      });
}

void add_contact(const Grid& grid, const Lucy& lucy, const SpreadContact& contact, GridSums& sums) {
  const auto& [from, to, moment] = contact;
  const Vec3 reach = Vec3::Constant(lucy.cutoff());
  spread(
      grid, from.cwiseMin(to) - reach, from.cwiseMax(to) + reach, sums,
      [&, &a = from, &b = to](const Vec3& place) { return lucy.along(a - place, b - place); },
      [&m = moment](double weight, double* cell) {
        for (Eigen::Index i = 0; i < 3; ++i)
          for (Eigen::Index j = 0; j < 3; ++j)
            cell[GridSums::contact + static_cast<std::size_t>(3 * i + j)] += weight * m(i, j);
      });
}

CellFields fields_of(const GridSums& sums, std::size_t cell) {
  using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  const double* const of = &sums.numbers[cell * GridSums::width];
  CellFields fields;
  fields.density = of[GridSums::density];
  fields.solid_fraction = of[GridSums::volume];
  fields.contact_stress = Eigen::Map<const RowMajor>(of + GridSums::contact);
  if (!(fields.density > 0)) return fields;
  fields.velocity = Eigen::Map<const Vec3>(of + GridSums::momentum) / fields.density;
  fields.kinetic_stress = Eigen::Map<const RowMajor>(of + GridSums::momentum_flux) -
                          fields.density * fields.velocity * fields.velocity.transpose();
  fields.temperature = std::max(0.0, fields.kinetic_stress.trace()) / (3 * fields.density);
  return fields;
}

}  // namespace talus
