/// The family of clumps: heaps, towers and clusters in flight, of bodies of several balls.

#include <algorithm>
#include <cmath>
#include <vector>

#include "apps/study_certificate/scene_bench.hpp"
#include "kernels/shapes/body_shapes.hpp"
#include "kernels/shapes/clump.hpp"

namespace talus::audit {

namespace {

/// Clumps at their places, which come along straight lines until a ball of theirs touches one.
class Heap {
 public:
  explicit Heap(SceneBench& bench) : bench_(bench) {
    std::vector<const BodyShapeEntry*> shapes;
    for (const BodyShapeEntry& entry : body_shapes())
      if (entry.make) shapes.push_back(&entry);
    const BodyShapeEntry& entry = *shapes[bench.draws.below(shapes.size())];
    clump_ = entry.make();
    bench.shape = entry.kind;
    bench.made.scene.setup.clumps.push_back(clump_);
    bench.made.grains.shape = mass_of(1, clump_);
    bench.made.grains.seed = bench.made.seed;
  }

  /// Along `way` (unit) from `from`; with `floor` to z = 0 at most. Nothing comes where there is nothing on
  /// the way.
  void add(const Vec3& from, const Vec3& way, bool floor) {
    const double R = bench_.draw_radius();
    const std::vector<Ball> own = next(R);
    double path = INFINITY;
    for (const Ball& ball : own) path = std::min(path, way_of(ball, from, way, floor));
    if (std::isfinite(path)) place(own, from + path * way, R);
  }

  void place_first(const Vec3& at) {
    const double R = bench_.draw_radius();
    place(next(R), at, R);
  }

  double top() const {
    double highest = 0;
    for (const Ball& ball : balls_) highest = std::max(highest, ball.centre[2] + ball.radius);
    return highest;
  }

 private:
  /// Balls of the next clump, from its centre of mass: turned as the sample will turn it.
  std::vector<Ball> next(double R) const {
    const Mat3 axes =
        rotation_of(draw_orientation(bench_.made.seed, static_cast<std::uint64_t>(bench_.count())));
    std::vector<Ball> balls;
    for (const Ball& ball : clump_.balls) balls.push_back({R * (axes * ball.centre), R * ball.radius});
    return balls;
  }

  /// How far a ball gets.
  double way_of(const Ball& ball, const Vec3& from, const Vec3& way, bool floor) const {
    const Vec3 start = from + ball.centre;
    double path = floor ? start[2] - ball.radius : INFINITY;
    for (const Ball& other : balls_) {
      const Vec3 apart = start - other.centre;
      const double reach = ball.radius + other.radius, along = -apart.dot(way),
                   beside2 = apart.squaredNorm() - along * along;
      if (along > 0 && beside2 < reach * reach)
        path = std::min(path, along - std::sqrt(reach * reach - beside2));
    }
    return path;
  }

  void place(const std::vector<Ball>& own, const Vec3& at, double R) {
    bench_.add(at, R);
    auto& velocity = bench_.made.grains.velocity.back();
    std::fill(velocity.begin() + 3, velocity.end(), 0.0);  // clumps begin without rotation
    for (const Ball& ball : own) balls_.push_back({at + ball.centre, ball.radius});
  }

  SceneBench& bench_;
  Clump clump_;
  std::vector<Ball> balls_;
};

}  // namespace

void make_clumps(SceneBench& bench) {
  Draws& draws = bench.draws;
  Heap heap(bench);
  const double R = bench.radius;
  if (bench.gravity == 0) {
    heap.place_first(Vec3::Zero());
    for (int k = bench.draw_count(1, 30); k > 0; --k) {
      const Vec3 from = 100 * R * draws.direction();
      heap.add(from, (R * draws.direction() - from).normalized(), false);
    }
    return;
  }
  const int clumps = bench.draw_count(1, 30);
  const double base = R * draws.between(2.2, 8);
  for (int k = 0; k < clumps; ++k)
    heap.add({draws.between(R, base - R), draws.between(R, base - R), 1e3 * R}, -Vec3::UnitZ(), true);
  bench.add_box(base);
  if (!draws.chance(0.3)) return;
  bench.add_lid(bench.weight() * draws.between_decades(1, 1e3));
  bench.made.scene.setup.walls.back().point = {0, 0, heap.top()};
}

}  // namespace talus::audit
