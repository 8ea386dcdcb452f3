#include "kernels/fields/coarse_grid.hpp"

#include <algorithm>
#include <cmath>
#include <span>

namespace talus {

namespace {

/// Centres that are visited beyond a grid to sum the weights of one grain or contact. A grain whose cutoff is
/// a dozen cells has fewer. Where a grain flew through a plane wall its contact has a branch as long as its
/// way, and the box around that holds any number of centres.
constexpr double most_beyond = 1e5;

/// Centres of the cells of a grid that lie in a box; the grid is continued without end.
struct CentreRange {
  Vec3 from, to;  ///< whole numbers, both ends included; of any size, hence no integers

  CentreRange(const Grid& grid, const Vec3& low, const Vec3& high) {
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      from[axis] = std::ceil((low[axis] - grid.low[axis]) / grid.spacing[axis] - 0.5);
      to[axis] = std::floor((high[axis] - grid.low[axis]) / grid.spacing[axis] - 0.5);
    }
  }
  /// False for ends that are no numbers.
  bool meets(const Vec3& last) const {
    return (from.array() <= last.array()).all() && (to.array() >= 0).all();
  }
  /// 0 where an end comes before its beginning, as in a box that lies between two centres.
  double count() const { return ((to - from).array() + 1).cwiseMax(0.0).prod(); }
  void cut(const Vec3& last) {
    from = from.cwiseMax(0.0);
    to = to.cwiseMin(last);
  }
};

/// Calls add(weight, numbers of the cell) for the cells of the grid whose centre lies in the box, with the
/// weights weight_at(centre), or nothing where these are 0 everywhere.
template <class WeightAt, class Add>
void spread(const Grid& grid, const Vec3& low, const Vec3& high, GridSums& sums, const WeightAt& weight_at,
            const Add& add) {
  const Vec3 last(static_cast<double>(grid.cells[0] - 1), static_cast<double>(grid.cells[1] - 1),
                  static_cast<double>(grid.cells[2] - 1));
  CentreRange range(grid, low, high);
  if (!range.meets(last)) return;
  CentreRange held = range;
  held.cut(last);
  // Too many to visit: so many weights add up to what their integral says, 1, wherever the centres lie.
  const bool summed = range.count() - held.count() <= most_beyond;
  if (!summed) range = held;

  struct Weight {
    std::size_t cell;
    double weight;
  };
  std::vector<Weight> weights;
  double sum = 0;
  const auto from = range.from.cast<std::int64_t>().eval(), to = range.to.cast<std::int64_t>().eval();
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
  const double unit = summed ? 1 / (sum * grid.cell_volume()) : 1;
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
