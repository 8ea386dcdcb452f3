#include "apps/study_certificate/scene_bench.hpp"

#include <Random123/philox.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace talus::audit {

namespace {

constexpr double density = 2600;  ///< [kg/m^3]
constexpr double earth = 9.81;    ///< [m/s^2]

/// Gravity of a scene: mostly that of the earth; centrifuges; none.
double draw_gravity(Draws& draws) {
  if (draws.chance(0.1)) return 0;
  return draws.chance(0.6) ? earth : draws.between_decades(1, 1000);
}

}  // namespace

double Draws::unit() {
  using Generator = r123::Philox4x32;
  const Generator::key_type key = {
      {static_cast<std::uint32_t>(seed_), static_cast<std::uint32_t>(seed_ >> 32)}};
  const Generator::ctr_type counter = {
      {static_cast<std::uint32_t>(stream_), static_cast<std::uint32_t>(stream_ >> 32), drawn_++, 1}};
  const Generator::ctr_type word = Generator()(counter, key);
  return static_cast<double>((std::uint64_t{word[0]} << 32 | word[1]) >> 11) * 0x1p-53;
}

double Draws::between_decades(double low, double high) {
  return low * std::pow(high / low, unit());
}

int Draws::from_to(int low, int high) {
  return low + static_cast<int>(below(static_cast<std::size_t>(high - low + 1)));
}

Vec3 Draws::direction() {
  const double z = between(-1, 1), angle = between(0, 2 * std::numbers::pi), s = std::sqrt(1 - z * z);
  return {s * std::cos(angle), s * std::sin(angle), z};
}

SceneBench::SceneBench(std::uint64_t seed, std::uint64_t stream, const MakerSettings& settings)
    : draws(seed, stream),
      radius(draws.between_decades(1e-3, 1e-1)),
      gravity(draw_gravity(draws)),
      size(settings.size),
      steps(settings.steps),
      spread_(draws.chance(0.3) ? 1 : draws.between(0.5, 1)) {
  made.seed = seed;
  made.scene.density = made.grains.density = density;
  if (gravity == 0 || draws.chance(0.2))
    speed = draws.between_decades(1e-2, 10) * std::sqrt((gravity > 0 ? gravity : earth) * radius);
}

double SceneBench::weight() const {
  return density * 4 / 3 * std::numbers::pi * radius * radius * radius * (gravity > 0 ? gravity : earth);
}

double SceneBench::speed_of_fall() const {
  return std::sqrt((gravity > 0 ? gravity : earth) * radius);
}

double SceneBench::draw_radius() {
  return radius * (spread_ + (1 - spread_) * draws.unit());
}

void SceneBench::add(const Vec3& x, double r) {
  add_moving(x, r, speed > 0 ? Vec3(speed * draws.direction()) : Vec3::Zero());
}

void SceneBench::add_moving(const Vec3& x, double r, const Vec3& u) {
  Sample& grains = made.grains;
  grains.x.push_back(x);
  grains.radius.push_back(r);
  const Vec3 w = u.norm() > 0 ? Vec3(draws.unit() * u.norm() * draws.direction()) : Vec3(Vec3::Zero());
  grains.velocity.push_back({u[0], u[1], u[2], w[0], w[1], w[2]});
}

Wall& SceneBench::add_wall(const std::string& name, const Vec3& point, const Vec3& normal) {
  Wall wall;
  wall.name = name;
  wall.point = point;
  wall.normal = normal.normalized();
  return made.scene.setup.walls.emplace_back(std::move(wall));
}

void SceneBench::add_box(double base) {
  add_wall("z-", Vec3::Zero(), Vec3::UnitZ());
  add_wall("x-", Vec3::Zero(), Vec3::UnitX());
  add_wall("x+", {base, 0, 0}, -Vec3::UnitX());
  add_wall("y-", Vec3::Zero(), Vec3::UnitY());
  add_wall("y+", {0, base, 0}, -Vec3::UnitY());
}

double SceneBench::top() const {
  double highest = 0;
  for (std::size_t k = 0; k < count(); ++k)
    highest = std::max(highest, made.grains.x[k][2] + made.grains.radius[k]);
  return highest;
}

void SceneBench::add_lid(double load) {
  Wall& lid = add_wall("z+", {0, 0, top()}, -Vec3::UnitZ());
  const double kind = draws.unit();
  if (kind < 0.5)
    lid.load = {.drive = WallDrive::force,
                .force = load,
                .mass = weight() / (gravity > 0 ? gravity : earth) * draws.between_decades(1e-2, 1e4)};
  else if (kind < 0.8)
    lid.load = {.drive = WallDrive::velocity,
                .velocity = Vec3(0, 0, -speed_of_fall() * draws.between_decades(1e-4, 1))};
}

void SceneBench::drop(double x, double y, double r, double floor) {
  double z = floor + r;
  for (std::size_t k = 0; k < count(); ++k) {
    const Vec3& other = made.grains.x[k];
    const double reach = r + made.grains.radius[k];
    const double beside2 = (other[0] - x) * (other[0] - x) + (other[1] - y) * (other[1] - y);
    if (beside2 < reach * reach) z = std::max(z, other[2] + std::sqrt(reach * reach - beside2));
  }
  add({x, y, z}, r);
}

void SceneBench::add_cluster(int grains, const Vec3& centre) {
  const std::size_t first = count();
  add(centre, draw_radius());
  for (int tries = 0; static_cast<int>(count() - first) < grains && tries < 200 * grains; ++tries) {
    const std::size_t on = first + draws.below(count() - first);
    const double r = draw_radius();
    const Vec3 x = made.grains.x[on] + (made.grains.radius[on] + r) * draws.direction();
    bool free = true;
    for (std::size_t k = 0; k < count() && free; ++k)
      free = k == on || (x - made.grains.x[k]).norm() >= made.grains.radius[k] + r;
    if (free) add(x, r);
  }
}

}  // namespace talus::audit
