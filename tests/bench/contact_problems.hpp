#pragma once

/// Contact problems u = W r + q on which solvers are raced: steps of small scenes, and disturbed copies of
/// problems that are at hand. The same seed gives the same problems on any machine with the same libm.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "apps/commands/dump_fclib.hpp"
#include "apps/study_stability/stability_scenes.hpp"
#include "kernels/delassus/delassus.hpp"
#include "kernels/samples/sample.hpp"

namespace talus::bench {

struct NamedProblem {
  std::string name;
  DelassusProblem problem;
};

/// Random numbers that do not depend on the standard library's distributions.
class Draw {
 public:
  explicit Draw(std::uint64_t seed) : engine_(seed) {}
  double between(double low, double high) {
    return low + (high - low) * static_cast<double>(engine_() >> 11) * 0x1p-53;
  }
  /// Evenly in the logarithm; 0 < low.
  double log_between(double low, double high) { return std::exp(between(std::log(low), std::log(high))); }
  std::size_t below(std::size_t n) { return static_cast<std::size_t>(engine_() % n); }
  bool chance(double part) { return between(0, 1) < part; }

 private:
  std::mt19937_64 engine_;
};

// --- Scenes ----------------------------------------------------------------------------------------------

namespace scenes {

using stability::add_grain;
using stability::add_wall;
using stability::earth;
using stability::natural_dt;
using stability::Problem;
using stability::radius;
using stability::sphere_mass;

/// Grains as deposited between four walls, `heavy` of them (a part of all) `ratio` times as heavy.
inline Problem deposit_of(Draw& draw, double mu, double heavy, double ratio) {
  Problem made = stability::problem(natural_dt, {0, 0, -earth}, mu);
  const double spread = draw.between(1.05, 1.6), base = draw.between(4, 9) * 2 * radius;
  const auto count = static_cast<std::size_t>(draw.log_between(20, 260));
  add_wall(made, "floor", Vec3::Zero(), Vec3::UnitZ());
  for (int axis = 0; axis < 2; ++axis) {
    add_wall(made, axis == 0 ? "x-" : "y-", Vec3::Zero(), Vec3::Unit(axis));
    add_wall(made, axis == 0 ? "x+" : "y+", base * Vec3::Unit(axis), -Vec3::Unit(axis));
  }
  const std::vector<double> radii =
      draw_radii({.kind = SizeDistribution::Kind::uniform, .min = radius / spread, .max = radius * spread},
                 count, draw.below(1000));
  const std::vector<Vec3> centres = deposit(radii, base, base);
  for (std::size_t k = 0; k < count; ++k)
    add_grain(made, centres[k], radii[k], sphere_mass(radii[k]) * (draw.chance(heavy) ? ratio : 1));
  return made;
}

inline double top_of(const Problem& made) {
  double top = 0;
  for (std::size_t k = 0; k < made.bodies.size(); ++k)
    top = std::max(top, made.bodies.x[k][2] + made.bodies.radius[k]);
  return top;
}

/// A plate of `ratio` grain masses under its own weight.
inline void add_plate(Problem& made, double ratio) {
  Wall& plate = add_wall(made, "plate", {0, 0, top_of(made)}, -Vec3::UnitZ());
  plate.load = {.drive = WallDrive::force,
                .force = ratio * sphere_mass(radius) * earth,
                .mass = ratio * sphere_mass(radius)};
}

inline Problem deck(Draw& draw) {
  return deposit_of(draw, draw.between(0, 1), 0, 1);
}

inline Problem heavy_on_light(Draw& draw) {
  const double ratio = draw.log_between(10, 1e5);
  return deposit_of(draw, draw.between(0, 0.8), 0.1, ratio);
}

inline Problem loaded_deck(Draw& draw) {
  Problem made = deposit_of(draw, draw.between(0, 0.7), 0, 1);
  add_plate(made, draw.log_between(1, 1e6));
  return made;
}

/// Gravity turned, so that the grains slide along the floor.
inline Problem tilted_deck(Draw& draw) {
  Problem made = deposit_of(draw, draw.between(0.1, 0.8), 0, 1);
  const double angle = draw.between(0.1, 1.2);
  stability::stage(made).gravity = earth * Vec3(std::sin(angle), 0, -std::cos(angle));
  return made;
}

/// Grains that run into one another, perhaps elastically.
inline Problem struck_deck(Draw& draw) {
  Problem made = deposit_of(draw, draw.between(0, 0.8), 0.05, 100);
  stability::stage(made).laws.set_all(&PairLaw::restitution, draw.between(0, 1));
  for (Velocity& v : made.bodies.velocity)
    for (double& u : v.u) u = draw.between(-2, 2);
  return made;
}

/// n x n columns of `height` grains under a plate: hyperstatic, long chains.
inline Problem columns(Draw& draw) {
  Problem made = stability::problem(natural_dt, {0, 0, -earth}, draw.between(0, 0.7));
  add_wall(made, "floor", Vec3::Zero(), Vec3::UnitZ());
  const auto n = 1 + static_cast<int>(draw.below(5)), height = 5 + static_cast<int>(draw.below(25));
  const double pitch = radius * (draw.chance(0.5) ? 2 : 2.1);
  for (int z = 0; z < height; ++z)
    for (int y = 0; y < n; ++y)
      for (int x = 0; x < n; ++x)
        add_grain(made, {pitch * x, pitch * y, radius * (2 * z + 1)}, radius, sphere_mass(radius));
  if (draw.chance(0.7)) add_plate(made, draw.log_between(1, 1e5));
  return made;
}

/// A cube of touching grains that three walls press against three others.
inline Problem pressed_box(Draw& draw) {
  const auto n = 3 + static_cast<int>(draw.below(4));
  const double edge = 2 * radius * n;
  Problem made = stability::problem(natural_dt, {0, 0, -earth}, draw.between(0, 0.8));
  for (int z = 0; z < n; ++z)
    for (int y = 0; y < n; ++y)
      for (int x = 0; x < n; ++x)
        add_grain(made, radius * Vec3(2 * x + 1, 2 * y + 1, 2 * z + 1), radius, sphere_mass(radius));
  stability::add_box(made, Vec3::Constant(edge));
  for (std::size_t w = 1; w < made.setup.walls.size(); w += 2) {
    made.setup.walls[w].area = edge * edge;
    made.setup.walls[w].load = {.drive = WallDrive::pressure,
                                .pressure = draw.log_between(1, 1e6),
                                .mass = n * n * n * sphere_mass(radius)};
  }
  return made;
}

/// A bed in a wedge, two walls that meet below it.
inline Problem wedge(Draw& draw) {
  Problem made = stability::problem(natural_dt, {0, 0, -earth}, draw.between(0, 0.8));
  const double half = draw.log_between(0.02, 0.6), c = std::cos(half), s = std::sin(half);
  add_wall(made, "left", Vec3::Zero(), {c, 0, s});
  add_wall(made, "right", Vec3::Zero(), {-c, 0, s});
  const auto rows = 10 + draw.below(70);
  // Along the edge of the wedge grains touch one another; every second one is pushed up between two.
  for (std::size_t k = 0; k < rows; ++k)
    add_grain(made, {0, 2 * radius * static_cast<double>(k), radius / s}, radius, sphere_mass(radius));
  for (std::size_t k = 0; k + 1 < rows; ++k)
    add_grain(made, {0, radius * static_cast<double>(2 * k + 1), radius / s + 1.7320508 * radius}, radius,
              sphere_mass(radius) * draw.log_between(1, 1e3));
  return made;
}

/// A nearly straight chain between two walls, pushed from one side: small kinks amplify forces.
inline Problem chain(Draw& draw) {
  Problem made = stability::problem(natural_dt, {0, 0, -earth}, draw.between(0, 0.6));
  const auto count = 20 + draw.below(150), rows = 1 + draw.below(3);
  const double kink = draw.log_between(1e-3, 0.3);
  double length = 0;
  for (std::size_t row = 0; row < rows; ++row) {
    Vec3 x(0, 2.05 * radius * static_cast<double>(row), 0);
    for (std::size_t k = 0; k < count; ++k) {
      if (k > 0) x += 2 * radius * Vec3(1, 0, (k % 2 == 0 ? 1 : -1) * kink).normalized();
      add_grain(made, x, radius, sphere_mass(radius));
    }
    length = x[0];
  }
  add_wall(made, "floor", {0, 0, -2 * radius * kink - radius}, Vec3::UnitZ());
  add_wall(made, "left", {-radius, 0, 0}, Vec3::UnitX());
  Wall& right = add_wall(made, "right", {length + radius, 0, 0}, -Vec3::UnitX());
  const double mass = sphere_mass(radius) * draw.log_between(1, 1e4);
  right.load = {.drive = WallDrive::force, .force = mass * earth, .mass = mass};
  return made;
}

/// Grains along their line of thrust between two abutments, doubled sideways, with some lying on them.
inline Problem arch(Draw& draw) {
  Problem made = stability::problem(natural_dt, {0, 0, -earth}, draw.between(0, 0.8));
  const auto count = 9 + static_cast<int>(draw.below(60));
  const double half = 0.5 * count, horizontal = half * draw.log_between(0.5, 20);
  const auto thrust = [&](int k) { return Vec3(horizontal, 0, half - k).normalized(); };
  const auto rings = 1 + static_cast<int>(draw.below(3));
  Vec3 last = Vec3::Zero();
  for (int ring = 0; ring < rings; ++ring) {
    Vec3 x(0, 2 * radius * ring, 0);
    for (int k = 0; k < count; ++k) {
      if (k > 0) x += 2 * radius * thrust(k);
      add_grain(made, x, radius, sphere_mass(radius));
      if (draw.chance(0.2))
        add_grain(made, x + Vec3(0, 0, 2 * radius), radius, sphere_mass(radius) * draw.log_between(1, 100));
    }
    last = x;
  }
  add_wall(made, "left", -radius * thrust(0), thrust(0));
  add_wall(made, "right", last + radius * thrust(count), -thrust(count));
  return made;
}

struct Family {
  const char* name;
  Problem (*build)(Draw&);
};
inline constexpr Family families[] = {{"deck", deck},           {"heavy", heavy_on_light},
                                      {"loaded", loaded_deck},  {"tilted", tilted_deck},
                                      {"struck", struck_deck},  {"columns", columns},
                                      {"pressed", pressed_box}, {"wedge", wedge},
                                      {"chain", chain},         {"arch", arch}};

}  // namespace scenes

/// The contact problem of one of the first steps of scene `index`, whose family is index modulo their number.
inline NamedProblem step_of_scene(std::uint64_t seed, std::size_t index) {
  const scenes::Family& family = scenes::families[index % std::size(scenes::families)];
  Draw draw(1'000'003 * seed + index);
  scenes::Problem scene = family.build(draw);
  scene.setup.decomposition.subdomains = 1;
  scene.setup.solver.max_iterations = 300;
  // By sweeps alone: `auto` would hand over what its own solvers have solved already.
  scene.setup.solver.method = SolverMethod::momentum;
  graph::Executor executor({.threads = 1});
  Simulation simulation(scene.setup, scene.bodies, executor);
  for (std::size_t step = 0, last = draw.below(4); step <= last; ++step) simulation.step();
  return {fmt::format("{}-{}", family.name, index), matrix_of_step(simulation).problem};
}

// --- Disturbances ----------------------------------------------------------------------------------------

namespace disturb {

/// For a given problem's W: its block at (row, column) by value, the diagonal among them.
struct Blocks {
  std::vector<std::vector<std::pair<std::size_t, Mat3>>> row;  ///< ascending columns

  explicit Blocks(const DelassusProblem& p) : row(p.contacts()) {
    for (std::size_t a = 0; a < p.contacts(); ++a) {
      row[a].emplace_back(a, p.diagonal[a].W);
      for (auto k = static_cast<std::size_t>(p.row_begin[a]);
           k < static_cast<std::size_t>(p.row_begin[a + 1]); ++k)
        row[a].emplace_back(static_cast<std::size_t>(p.column[k]), p.block[k]);
    }
  }
};

inline DelassusProblem assembled(const Blocks& blocks, const std::vector<Vec3>& q,
                                 const std::vector<double>& mu) {
  std::vector<MatrixEntry> entries;
  std::vector<double> values;
  for (std::size_t a = 0; a < blocks.row.size(); ++a) {
    for (const auto& [b, block] : blocks.row[a])
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
          entries.push_back(
              {static_cast<std::int64_t>(3 * a) + i, static_cast<std::int64_t>(3 * b) + j, block(i, j)});
    values.insert(values.end(), q[a].data(), q[a].data() + 3);
  }
  return assemble_delassus(entries, values, mu);
}

inline std::vector<double> friction_of(const DelassusProblem& p) {
  std::vector<double> mu;
  for (const LocalBlock& own : p.diagonal) mu.push_back(own.mu);
  return mu;
}

/// S W S and S q with one factor a contact: other units of each contact's impulse.
inline DelassusProblem scaled(const DelassusProblem& p, Draw& draw) {
  Blocks blocks(p);
  std::vector<double> factor;
  const double most = draw.log_between(1.1, 5);
  for (std::size_t c = 0; c < p.contacts(); ++c) factor.push_back(draw.log_between(1 / most, most));
  std::vector<Vec3> q(p.q);
  for (std::size_t a = 0; a < p.contacts(); ++a) {
    for (auto& [b, block] : blocks.row[a]) block *= factor[a] * factor[b];
    q[a] *= factor[a];
  }
  return assembled(blocks, q, friction_of(p));
}

/// W + A A' with A of a few columns, each on some two dozen contacts: bodies that more of them share.
inline DelassusProblem coupled(const DelassusProblem& p, Draw& draw) {
  Blocks blocks(p);
  double mean = 0;
  for (const LocalBlock& own : p.diagonal) mean += own.W.trace() / (3 * static_cast<double>(p.contacts()));
  const double size = std::sqrt(mean * draw.log_between(0.03, 3));
  for (std::size_t k = 0, columns = 1 + draw.below(8); k < columns; ++k) {
    std::vector<std::pair<std::size_t, Vec3>> part;
    const std::size_t first = draw.below(p.contacts());
    for (std::size_t c = 0; c < std::min<std::size_t>(24, p.contacts()); ++c)
      part.emplace_back((first + c) % p.contacts(),
                        size * Vec3(draw.between(-1, 1), draw.between(-1, 1), draw.between(-1, 1)));
    for (const auto& [a, left] : part)
      for (const auto& [b, right] : part) blocks.row[a].emplace_back(b, left * right.transpose());
  }
  return assembled(blocks, p.q, friction_of(p));  // entries at one place are added
}

/// q + W d with random impulses d: what has a solution keeps one, of another load.
inline DelassusProblem pushed(const DelassusProblem& p, Draw& draw) {
  DelassusProblem made = p;
  std::vector<double> r(3 * p.contacts()), u(r.size());
  double q2 = 0, d2 = 0;
  for (double& value : r) value = draw.between(-1, 1);
  relative_velocity(p, r, u);
  for (std::size_t c = 0; c < p.contacts(); ++c) {
    q2 += p.q[c].squaredNorm();
    for (int k = 0; k < 3; ++k) {
      u[3 * c + static_cast<std::size_t>(k)] -= p.q[c][k];
      d2 += u[3 * c + static_cast<std::size_t>(k)] * u[3 * c + static_cast<std::size_t>(k)];
    }
  }
  if (!(d2 > 0)) return made;
  const double size = draw.log_between(0.01, 1) * std::sqrt(q2 / d2);
  for (std::size_t c = 0; c < p.contacts(); ++c)
    made.q[c] += size * Vec3(u[3 * c], u[3 * c + 1], u[3 * c + 2]);
  return made;
}

/// All coefficients of friction times one factor, or each drawn anew from 0 to 1.2.
inline DelassusProblem rubbed(const DelassusProblem& p, Draw& draw) {
  DelassusProblem made = p;
  const bool each = draw.chance(0.5);
  const double factor = draw.between(0.5, 2), low = draw.between(0, 0.6), high = draw.between(low, 1.2);
  for (LocalBlock& own : made.diagonal)
    own = local_block(own.W, each ? draw.between(low, high) : factor * own.mu);
  return made;
}

/// A tenth of the contacts twice: W becomes singular, or more so.
inline DelassusProblem doubled(const DelassusProblem& p, Draw& draw) {
  std::vector<std::size_t> original(p.contacts());
  std::iota(original.begin(), original.end(), std::size_t{0});
  for (std::size_t k = 0, copies = 1 + p.contacts() / 10; k < copies; ++k)
    original.push_back(draw.below(p.contacts()));
  std::vector<std::vector<std::size_t>> places(p.contacts());
  for (std::size_t a = 0; a < original.size(); ++a) places[original[a]].push_back(a);
  const Blocks given(p);
  Blocks blocks(p);
  blocks.row.resize(original.size());
  std::vector<Vec3> q;
  std::vector<double> mu;
  for (std::size_t a = 0; a < original.size(); ++a) {
    blocks.row[a].clear();
    for (const auto& [b, block] : given.row[original[a]])
      for (const std::size_t place : places[b]) blocks.row[a].emplace_back(place, block);
    q.push_back(p.q[original[a]]);
    mu.push_back(p.diagonal[original[a]].mu);
  }
  return assembled(blocks, q, mu);
}

}  // namespace disturb

/// A copy of `from` with one to three disturbances.
inline NamedProblem disturbed(const NamedProblem& from, std::uint64_t seed) {
  struct Kind {
    const char* name;
    DelassusProblem (*apply)(const DelassusProblem&, Draw&);
  };
  constexpr Kind kinds[] = {{"scaled", disturb::scaled},
                            {"coupled", disturb::coupled},
                            {"pushed", disturb::pushed},
                            {"rubbed", disturb::rubbed},
                            {"doubled", disturb::doubled}};
  Draw draw(seed);
  NamedProblem made = from;
  if (from.problem.dimension == 2) return made;  // its second tangents must not be excited
  for (std::size_t k = 0, count = 1 + draw.below(3); k < count; ++k) {
    const Kind& kind = kinds[draw.below(std::size(kinds))];
    made.problem = kind.apply(made.problem, draw);
    made.name += fmt::format("-{}", kind.name);
  }
  return made;
}

/// `count` problems: the given ones, then steps of scenes and disturbed copies of all in turn.
inline std::vector<NamedProblem> race_problems(std::vector<NamedProblem> given, std::size_t count,
                                               std::uint64_t seed) {
  std::vector<NamedProblem> problems = std::move(given);
  const std::size_t large_enough = 5;  // contacts: below it there is nothing to disturb
  for (std::size_t k = 0; problems.size() < count; ++k) {
    problems.push_back(step_of_scene(seed, k));
    Draw draw(7'000'003 * seed + k);
    for (int copy = 0; copy < 2; ++copy) {
      const NamedProblem& from = problems[draw.below(problems.size())];
      if (from.problem.contacts() >= large_enough && from.problem.dimension == 3)
        problems.push_back(disturbed(from, 13 * seed + 2 * k + static_cast<std::uint64_t>(copy)));
    }
  }
  problems.resize(std::min(problems.size(), std::max(count, given.size())));
  return problems;
}

}  // namespace talus::bench
