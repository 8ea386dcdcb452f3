#include "kernels/shapes/detail/triangle_mesh.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>

namespace talus::detail {

namespace {

std::string name_of(std::size_t triangle) {
  return "triangle " + std::to_string(triangle + 1);
}

std::array<double, 3> key_of(const Vec3& p) {
  return {p[0], p[1], p[2]};
}

/// Each edge must stand once in each direction: then the surface is closed, and all its triangles face one
/// way.
void demand_closed(const std::vector<Triangle>& triangles) {
  std::map<std::array<double, 3>, std::size_t> number;
  std::map<std::pair<std::size_t, std::size_t>, std::size_t> edges;  // corners -> the triangle that has it
  const auto corner = [&](const Vec3& p) {
    return number.try_emplace(key_of(p), number.size()).first->second;
  };
  for (std::size_t t = 0; t < triangles.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::pair edge{corner(triangles[t][k]), corner(triangles[t][(k + 1) % 3])};
      const auto [other, fresh] = edges.try_emplace(edge, t);
      if (!fresh)
        throw std::invalid_argument(
            name_of(t) + " is inverted against " + name_of(other->second) +
            ", with which it shares an edge; all triangles must face out of the solid");
    }
  for (const auto& [edge, t] : edges)
    if (!edges.contains({edge.second, edge.first}))
      throw std::invalid_argument("the surface is open at an edge of " + name_of(t) +
                                  "; every edge must belong to two triangles");
}

double six_volumes(const std::vector<Triangle>& triangles) {
  double sum = 0;
  const Vec3 from = triangles[0][0];  // near, so that little is lost in rounding
  for (const auto& [a, b, c] : triangles) sum += (a - from).dot((b - from).cross(c - from));
  return sum;
}

/// Whether the ray from p towards +axis goes through a triangle. A ray through an edge or a corner goes
/// through an odd number of the triangles there if it goes through the surface, else an even number: what
/// counts of an edge is computed from its lower end, hence alike for both of its triangles.
bool pierces(const Vec3& p, Eigen::Index axis, const Triangle& triangle) {
  const Eigen::Index u = (axis + 1) % 3, v = (axis + 2) % 3;
  bool within = false;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3 *low = &triangle[k], *high = &triangle[(k + 1) % 3];
    if ((*low)[v] > (*high)[v]) std::swap(low, high);
    if (((*low)[v] > p[v]) == ((*high)[v] > p[v])) continue;
    const double part = (p[v] - (*low)[v]) / ((*high)[v] - (*low)[v]);
    if (p[u] < (*low)[u] + part * ((*high)[u] - (*low)[u])) within = !within;
  }
  if (!within) return false;
  const auto& [a, b, c] = triangle;
  const Vec3 normal = (b - a).cross(c - a);
  return ((a - p).dot(normal) > 0) == (normal[axis] > 0);
}

class Mesh final : public Surface {
 public:
  Mesh(std::vector<Triangle> triangles, bool inside) : triangles_(std::move(triangles)), inside_(inside) {
    box_ = {triangles_[0][0], triangles_[0][0]};
    for (const Triangle& triangle : triangles_) {
      for (const Vec3& p : triangle) box_ = {box_.low.cwiseMin(p), box_.high.cwiseMax(p)};
      const Vec3 normal = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]).normalized();
      normal_.push_back(inside ? Vec3(-normal) : normal);
    }
    make_grid();
  }

  Bounds bounds() const override { return box_; }
  void show(std::vector<Triangle>& triangles) const override {
    triangles.insert(triangles.end(), triangles_.begin(), triangles_.end());
  }

  SurfacePoint at(const Vec3& centre, std::int32_t feature) const override {
    const auto t = static_cast<std::size_t>(feature);
    const Vec3 d = centre - nearest_point(triangles_[t], centre);
    const double distance = d.norm();
    const bool behind = d.dot(normal_[t]) < 0 && distance * (1 - 1e-9) <= -d.dot(normal_[t]);
    if (behind || distance == 0) return {feature, behind ? -distance : 0, normal_[t]};
    return {feature, distance, d / distance};
  }

  void near(const Vec3& centre, double reach, std::vector<std::int32_t>& features) const override {
    for (const std::int32_t t : around(centre, reach))
      if ((centre - nearest_point(triangles_[static_cast<std::size_t>(t)], centre)).norm() < reach)
        features.push_back(t);
  }

  void collide(const Vec3& centre, double reach, std::vector<SurfacePoint>& points) const override {
    std::vector<Meeting> meetings;
    for (const std::int32_t t : around(centre, reach)) {
      const Vec3 point = nearest_point(triangles_[static_cast<std::size_t>(t)], centre);
      const double distance = (centre - point).norm();
      if (distance < reach) meetings.push_back({t, distance, point, before(centre - point, t)});
    }
    for (const Meeting& one : meetings) {
      bool touches = one.in_front;
      for (const Meeting& other : meetings) {
        if (other.triangle == one.triangle || !belongs_to(one, other)) continue;
        if (together(one, other)) {
          if (other.triangle < one.triangle) {
            touches = false;
            break;
          }
          touches |= other.in_front;  // an edge or a corner is touched from before any of its triangles
        } else if (other.distance < one.distance) {
          touches = false;
          break;
        }
      }
      if (!touches) continue;
      const Vec3 d = centre - one.point;
      points.push_back(
          {one.triangle, one.distance,
           one.distance > 0 ? Vec3(d / one.distance) : normal_[static_cast<std::size_t>(one.triangle)]});
    }
  }

  double depth(const Vec3& centre) const override {
    if (encloses(centre) == inside_) return 0;
    double nearest = std::numeric_limits<double>::infinity();
    for (const Triangle& triangle : triangles_)
      nearest = std::min(nearest, (centre - nearest_point(triangle, centre)).norm());
    return nearest;
  }

 private:
  /// The nearest point of a triangle.
  struct Meeting {
    std::int32_t triangle;
    double distance;
    Vec3 point;
    bool in_front;
  };

  /// Whether the surface is around a point. Rounding may mislead a ray along a triangle that it grazes, so
  /// the rays along three axes vote.
  bool encloses(const Vec3& p) const {
    if (!(p.array() >= box_.low.array()).all() || !(p.array() <= box_.high.array()).all()) return false;
    int votes = 0;
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      Vec3 end = p;
      end[axis] = box_.high[axis];
      const std::vector<std::int32_t> met = within(p, end);
      const auto pierced = std::ranges::count_if(
          met, [&](std::int32_t t) { return pierces(p, axis, triangles_[static_cast<std::size_t>(t)]); });
      votes += pierced % 2 != 0 ? 1 : 0;
    }
    return votes >= 2;
  }

  bool before(const Vec3& d, std::int32_t triangle) const {
    return d.dot(normal_[static_cast<std::size_t>(triangle)]) >= 0;
  }
  /// What counts as one place: more than files in single precision round by, and much less than a grain.
  static double slack(const Meeting& meeting) { return 1e-6 * meeting.distance; }
  static bool together(const Meeting& one, const Meeting& other) {
    return (one.point - other.point).norm() <= slack(one);
  }
  bool belongs_to(const Meeting& one, const Meeting& other) const {
    const Vec3 nearest = nearest_point(triangles_[static_cast<std::size_t>(other.triangle)], one.point);
    return (one.point - nearest).norm() <= slack(one);
  }

  /// Cell of a coordinate along an axis; the outermost ones for what lies outside, or is no number.
  std::size_t cell_at(double x, Eigen::Index axis) const {
    const double at = (x - box_.low[axis]) / size_[axis];
    const double last = static_cast<double>(cells_[static_cast<std::size_t>(axis)] - 1);
    return static_cast<std::size_t>(std::min(last, std::max(0.0, at)));
  }
  /// Calls visit(cell) for the cells that a box meets.
  template <class Visit>
  void for_cells(const Vec3& low, const Vec3& high, Visit visit) const {
    std::array<std::size_t, 3> from{}, to{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto a = static_cast<Eigen::Index>(axis);
      from[axis] = cell_at(low[a], a);
      to[axis] = cell_at(high[a], a);
    }
    for (std::size_t x = from[0]; x <= to[0]; ++x)
      for (std::size_t y = from[1]; y <= to[1]; ++y)
        for (std::size_t z = from[2]; z <= to[2]; ++z) visit((x * cells_[1] + y) * cells_[2] + z);
  }

  void make_grid() {
    const Vec3 extent = (box_.high - box_.low).cwiseMax(1e-9 * (box_.high - box_.low).maxCoeff());
    // Cubes, about one per triangle, and none thinner than the mesh.
    const double edge = std::cbrt(extent.prod() / static_cast<double>(triangles_.size()));
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      const double count = std::clamp(std::floor(extent[axis] / edge), 1.0, 128.0);
      cells_[static_cast<std::size_t>(axis)] = static_cast<std::size_t>(count);
      size_[axis] = extent[axis] / count;
    }
    begin_.assign(cells_[0] * cells_[1] * cells_[2] + 1, 0);
    const auto for_cells_of = [&](const Triangle& triangle, auto visit) {
      for_cells(triangle[0].cwiseMin(triangle[1]).cwiseMin(triangle[2]),
                triangle[0].cwiseMax(triangle[1]).cwiseMax(triangle[2]), visit);
    };
    for (const Triangle& triangle : triangles_)
      for_cells_of(triangle, [&](std::size_t cell) { ++begin_[cell + 1]; });
    for (std::size_t cell = 1; cell < begin_.size(); ++cell) begin_[cell] += begin_[cell - 1];
    in_cell_.resize(begin_.back());
    std::vector<std::size_t> next(begin_.begin(), begin_.end() - 1);
    for (std::size_t t = 0; t < triangles_.size(); ++t)
      for_cells_of(triangles_[t],
                   [&](std::size_t cell) { in_cell_[next[cell]++] = static_cast<std::int32_t>(t); });
  }

  /// The triangles in cells within reach, ascending, each once.
  std::vector<std::int32_t> around(const Vec3& centre, double reach) const {
    if (!box_.near(centre, reach)) return {};
    const Vec3 half = Vec3::Constant(reach);
    return within(centre - half, centre + half);
  }
  /// The triangles in the cells that a box meets, ascending, each once.
  std::vector<std::int32_t> within(const Vec3& low, const Vec3& high) const {
    std::vector<std::int32_t> found;
    for_cells(low, high, [&](std::size_t cell) {
      found.insert(found.end(), in_cell_.begin() + static_cast<std::ptrdiff_t>(begin_[cell]),
                   in_cell_.begin() + static_cast<std::ptrdiff_t>(begin_[cell + 1]));
    });
    std::sort(found.begin(), found.end());
    found.erase(std::unique(found.begin(), found.end()), found.end());
    return found;
  }

  std::vector<Triangle> triangles_;
  std::vector<Vec3> normal_;  ///< per triangle, unit, to the grains
  bool inside_;               ///< the grains are
  Bounds box_;
  std::array<std::size_t, 3> cells_{};  ///< along x, y and z
  Vec3 size_;                           ///< of a cell [m]
  std::vector<std::size_t> begin_;      ///< cells + 1 offsets into `in_cell_`
  std::vector<std::int32_t> in_cell_;   ///< triangles, by cell
};

}  // namespace

Vec3 nearest_point(const Triangle& triangle, const Vec3& p) {
  const auto& [a, b, c] = triangle;
  const Vec3 ab = b - a, ac = c - a, ap = p - a;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return a;
  const Vec3 bp = p - b;
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return b;
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return a + d1 / (d1 - d3) * ab;
  const Vec3 cp = p - c;
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return c;
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return a + d2 / (d2 - d6) * ac;
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) return b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b);
  // In the face: along the normal, which a division by small areas would tilt.
  const Vec3 normal = ab.cross(ac);
  return p - ap.dot(normal) / normal.squaredNorm() * normal;
}

std::shared_ptr<const Surface> make_mesh(std::vector<Triangle> triangles, bool inside) {
  if (triangles.empty()) throw std::invalid_argument("there are no triangles");
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    const auto& [a, b, c] = triangles[t];
    if (!a.allFinite() || !b.allFinite() || !c.allFinite())
      throw std::invalid_argument(name_of(t) + " has a corner that is not finite");
    const double area2 = (b - a).cross(c - a).norm();
    if (!(area2 > 1e-12 * std::max({(b - a).squaredNorm(), (c - a).squaredNorm(), (c - b).squaredNorm()})))
      throw std::invalid_argument(name_of(t) + " is degenerate: it has no area");
  }
  demand_closed(triangles);
  if (!(six_volumes(triangles) > 0))
    throw std::invalid_argument(
        "the surface is inverted: " + name_of(0) + " and all others face into the solid; " +
        (inside
             ? "corners go counterclockwise as seen from outside, with inside = true, too: turn each triangle"
             : "where the grains are inside, say inside = true, else turn each triangle"));
  return std::make_shared<Mesh>(std::move(triangles), inside);
}

}  // namespace talus::detail
