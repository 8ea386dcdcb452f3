#include "kernels/detection/domain.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

namespace talus {

Vec3 Domain::edges_between(const Vec3& a, const Vec3& b) const {
  const Vec3 d = a - b;
  const double c = nearest_integer(cell.per_zz * d[2]);
  const double y = d[1] - cell.yz * c, beside = nearest_integer(cell.per_yy * y);
  const double x = d[0] - cell.xz * c - cell.xy * beside;
  return {nearest_integer(cell.per_xx * x), beside, c};
}

double Domain::mean_edge() const {
  double product = 1;
  int axes = 0;
  for (const double edge : {cell.xx, cell.yy, cell.zz})
    if (edge > 0) product *= edge, ++axes;
  return axes > 0 ? std::pow(product, 1.0 / axes) : 0;
}

Vec3 Domain::flow_drift(const Vec3& x) const {
  const double c = cell.per_zz * (x[2] - low[2]), b = cell.per_yy * (x[1] - low[1] - cell.yz * c),
               a = cell.per_xx * (x[0] - low[0] - cell.xz * c - cell.xy * b);
  return times(drift_rates, {a, b, c});
}

Vec3 Domain::midpoint(const Vec3& a, const Vec3& b) const {
  Vec3 middle = 0.5 * (a + b);
  if (!repeats) return middle;
  // Halfway to another image of b is half its shift farther. Shifts of (a, b) and (b, a) are opposite: adding
  // half an edge for an odd number, whatever its sign, is the same point but for whole edges.
  const auto odd = [](double k) { return std::fmod(k, 2.0) != 0 ? 0.5 : 0.0; };
  const Vec3 k = edges_between(a, b);
  middle += odd(k[2]) * Vec3(cell.xz, cell.yz, cell.zz) + odd(k[1]) * Vec3(cell.xy, cell.yy, 0) +
            odd(k[0]) * Vec3(cell.xx, 0, 0);
  return wrap(middle);
}

Vec3 Domain::edges_beyond(const Vec3& x) const {
  const double c = std::floor(cell.per_zz * (x[2] - low[2]));
  const double b = std::floor(cell.per_yy * (x[1] - low[1] - cell.yz * c));
  return {std::floor(cell.per_xx * (x[0] - low[0] - cell.xz * c - cell.xy * b)), b, c};
}

Vec3 Domain::wrap(const Vec3& x) const {
  if (!repeats) return x;
  const Vec3 k = edges_beyond(x);
  if (k == Vec3::Zero()) return x;
  return x - k[2] * Vec3(cell.xz, cell.yz, cell.zz) - k[1] * Vec3(cell.xy, cell.yy, 0) -
         k[0] * Vec3(cell.xx, 0, 0);
}

Vec3 Domain::lengths(const std::vector<Wall>& walls) const {
  return repeats ? Vec3((edges().array() > 0).select(edges(), box_lengths(walls))) : box_lengths(walls);
}

double Domain::volume(const std::vector<Wall>& walls) const {
  const bool planes = std::ranges::all_of(walls, [](const Wall& wall) { return wall.surface() == nullptr; });
  return planes ? lengths(walls).prod() : 0;
}

Domain periodic_domain(const Vec3& lengths, const Vec3& low, const Vec3& shears) {
  const auto refuse = [](const char* what) { throw std::invalid_argument(std::string("cell: ") + what); };
  if (!lengths.allFinite() || lengths.minCoeff() < 0) refuse("lengths must be finite and >= 0 [m]");
  if (lengths.maxCoeff() == 0) refuse("one of the lengths must be > 0 [m]");
  if (!low.allFinite() || !shears.allFinite()) refuse("origin and shears must be finite [m]");
  const auto inverse = [](double length) { return length > 0 ? 1 / length : 0; };
  const bool x = lengths[0] > 0, y = lengths[1] > 0, z = lengths[2] > 0;
  if ((shears[0] != 0 && !(x && y)) || (shears[1] != 0 && !(x && z)) || (shears[2] != 0 && !(y && z)))
    refuse("a shear needs two axes that repeat");
  Domain domain;
  domain.cell = {lengths[0], lengths[1],          lengths[2],          shears[0],          shears[1],
                 shears[2],  inverse(lengths[0]), inverse(lengths[1]), inverse(lengths[2])};
  domain.low = (lengths.array() > 0).select(low, Vec3::Zero());
  domain.repeats = true;
  return domain;
}

}  // namespace talus
