#pragma once

/// What the families of scenes are built with: grains, walls, and numbers drawn from the scene's seed.

#include <string>
#include <vector>

#include "apps/study_certificate/scene_maker.hpp"

namespace talus::audit {

/// A scene under construction. Families add grains and walls; what scenes have in common (laws, gravity, time
/// step, solver, stages) is drawn before and after them.
class SceneBench {
 public:
  SceneBench(std::uint64_t seed, std::uint64_t stream, const MakerSettings& settings);

  Draws draws;
  MadeScene made;
  double radius;                        ///< [m] of a usual grain
  double gravity;                       ///< [m/s^2] along -z; 0 for scenes in flight
  double speed = 0;                     ///< [m/s] that grains have at the beginning
  double wall_speed = 0;                ///< [m/s] of walls that move by themselves, the largest
  double cohesion = 0;                  ///< [N] of all pairs
  double rolling = 0;                   ///< rolling resistance of all pairs; then grains have friction
  bool jams = false;                    ///< grains and walls have friction, and no restitution
  BodyShape shape = BodyShape::sphere;  ///< of all grains
  int size;                             ///< MakerSettings::size
  int steps;
  /// Of a cell: flow, stress and time step of the first stage, and of the second one, behind a change of
  /// loads. None between walls.
  std::vector<Stage> cell_stages = {};

  int draw_count(int low, int high) { return size * draws.from_to(low, high); }  ///< of grains
  double weight() const;         ///< [N] of a usual grain; of one under 9.81 m/s^2 without gravity
  double speed_of_fall() const;  ///< [m/s] by a usual radius, as `weight`
  double draw_radius();          ///< [m] of a grain of the scene's distribution
  void add(const Vec3& x, double r);
  void add_moving(const Vec3& x, double r, const Vec3& u);
  std::size_t count() const { return made.grains.x.size(); }
  Wall& add_wall(const std::string& name, const Vec3& point, const Vec3& normal);
  /// Walls z-, x-, x+, y-, y+ around [0, base] x [0, base].
  void add_box(double base);
  /// A lid above the highest grain: fixed, driven or pushed, as drawn. `load` [N].
  void add_lid(double load);
  /// Top of the highest grain [m].
  double top() const;
  /// Grains touching one another, each new one at a random place of a random one, within a sphere.
  void add_cluster(int grains, const Vec3& centre);
  /// Lets a grain down along z at (x, y) until it touches a grain, or stands at `floor`.
  void drop(double x, double y, double r, double floor);

 private:
  double spread_;  ///< smallest over largest radius
};

/// The rest of the scene: laws, gravity, time step, stages, solver.
void finish_scene(SceneBench& bench, const MakerSettings& settings);

// The families.
void make_deposition(SceneBench& bench);
void make_press(SceneBench& bench);
void make_flight(SceneBench& bench);
void make_lattice(SceneBench& bench);
void make_funnel(SceneBench& bench);
void make_column(SceneBench& bench);
void make_among(SceneBench& bench);
void make_chain(SceneBench& bench);
void make_wedge(SceneBench& bench);
void make_arch(SceneBench& bench);
void make_rows(SceneBench& bench);
void make_heavy(SceneBench& bench);
void make_cell(SceneBench& bench);
void make_drum(SceneBench& bench);
void make_hopper(SceneBench& bench);
void make_paddle(SceneBench& bench);
void make_mesh_drum(SceneBench& bench);
void make_shaken(SceneBench& bench);
void make_sticky(SceneBench& bench);
void make_apart(SceneBench& bench);
void make_touching(SceneBench& bench);
void make_clumps(SceneBench& bench);
void make_rolling(SceneBench& bench);
void make_boulder(SceneBench& bench);
void make_landing(SceneBench& bench);

}  // namespace talus::audit
