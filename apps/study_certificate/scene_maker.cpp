#include "apps/study_certificate/scene_maker.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "apps/study_certificate/scene_bench.hpp"
#include "io/files/output_directory.hpp"
#include "io/files/stl.hpp"
#include "io/scene/bodies_file.hpp"

namespace talus::audit {

namespace {

constexpr std::array families = {
    SceneFamily{"deposition", "grains at rest in a box, as they were deposited", make_deposition},
    SceneFamily{"press", "deposited grains between pushed walls, light and heavy", make_press},
    SceneFamily{"flight", "clusters in flight that run into one another", make_flight},
    SceneFamily{"lattice", "equal grains on a lattice between walls: more contacts than unknowns",
                make_lattice},
    SceneFamily{"funnel", "grains in a funnel of inclined walls", make_funnel},
    SceneFamily{"column", "a column on a floor", make_column},
    SceneFamily{"among", "a column among single grains", make_among},
    SceneFamily{"chain", "a nearly straight chain between walls", make_chain},
    SceneFamily{"wedge", "grains in a V of half angle 1e-3 to 0.5", make_wedge},
    SceneFamily{"arch", "an arch, and loose grains", make_arch},
    SceneFamily{"rows", "rows of touching grains that run into one another", make_rows},
    SceneFamily{"heavy", "heavy bodies on light ones", make_heavy},
    SceneFamily{"cell", "grains in a periodic cell that follows a stress or a flow", make_cell},
    SceneFamily{"drum", "grains in a drum that turns or shakes", make_drum},
    SceneFamily{"hopper", "grains in a cone under a tube, which may turn or shake", make_hopper},
    SceneFamily{"paddle", "a plate, disc, rod or cone that moves among grains in a box", make_paddle},
    SceneFamily{"mesh", "grains in a prism of triangles that moves, around a block of them", make_mesh_drum},
    SceneFamily{"shaken", "grains in a box whose walls tilt, shake or run as belts", make_shaken},
    SceneFamily{"sticky", "grains that hold one another and their walls", make_sticky},
    SceneFamily{"apart", "two grains that collide far above others, and much faster", make_apart},
    SceneFamily{"touching", "a column, and two grains that collide beside its top and touch it",
                make_touching},
    SceneFamily{"clumps", "clumps of balls that lie on one another, or meet in flight", make_clumps},
    SceneFamily{"rolling", "beams and heaps of grains that resist rolling", make_rolling},
    SceneFamily{"boulder", "a boulder of up to 1000 radii that grains lean on or roll against", make_boulder},
    SceneFamily{"landing", "grains that land in a narrow V, where friction jams them", make_landing}};

double draw_time_step(SceneBench& bench) {
  Draws& draws = bench.draws;
  double fastest = bench.wall_speed;
  for (const auto& v : bench.made.grains.velocity) fastest = std::max(fastest, Vec3(v[0], v[1], v[2]).norm());
  const double fall = bench.gravity > 0 ? std::sqrt(bench.radius / bench.gravity) : INFINITY;
  const double flight = fastest > 0 ? bench.radius / fastest : INFINITY;
  const double natural = std::min({fall, 3 * flight, std::sqrt(bench.radius)});
  return natural * draws.between_decades(1e-3, 0.1);
}

/// What moves the cell of a scene, in a stage.
void take_flow(const Stage& flow, Stage& stage) {
  stage.strain_rates = flow.strain_rates;
  stage.shear_rates = flow.shear_rates;
  stage.stress = flow.stress;
}

/// Loads of the second half of the steps.
void change_loads(SceneBench& bench, Stage& stage) {
  if (!bench.cell_stages.empty()) return take_flow(bench.cell_stages.back(), stage);
  Draws& draws = bench.draws;
  const Setup& setup = bench.made.scene.setup;
  const auto pushed =
      std::ranges::find_if(setup.walls, [](const Wall& wall) { return wall.load.drive == WallDrive::force; });
  const double kind = draws.unit();
  if (pushed != setup.walls.end() && kind < 0.4) {
    WallLoad load = pushed->load;
    load.force *= draws.chance(0.5) ? 2 : 0.5;
    stage.loads.push_back({pushed->name, load});
  } else if (kind < 0.7) {
    stage.gravity *= 2;
  } else {
    const double angle = draws.between(0.02, 0.6), g = stage.gravity.norm();
    stage.gravity = {g * std::sin(angle), 0, -g * std::cos(angle)};
  }
}

}  // namespace

void finish_scene(SceneBench& bench, const MakerSettings& settings) {
  Draws& draws = bench.draws;
  io::Scene& scene = bench.made.scene;
  Stage stage;
  stage.name = "first";
  const bool in_cell = !bench.cell_stages.empty();
  stage.time_step = in_cell ? bench.cell_stages.front().time_step : draw_time_step(bench);
  stage.gravity = bench.gravity > 0 ? Vec3(0, 0, -bench.gravity) : Vec3(Vec3::Zero());
  if (in_cell) take_flow(bench.cell_stages.front(), stage);
  const bool smooth = draws.chance(0.5) && bench.rolling == 0 && !bench.jams;
  const double friction = smooth ? 0 : draws.between(0.1, 0.8);
  const double at_walls = draws.chance(0.7) || bench.jams ? friction : 0;
  const double drawn = draws.chance(0.6) ? 0 : draws.chance(0.2) ? 1 : draws.unit();
  const double restitution = bench.jams ? 0 : drawn;
  stage.laws = laws_of_one_material(friction, at_walls, restitution);
  if (bench.cohesion > 0) stage.laws.set_all(cohesion_attraction, bench.cohesion);
  if (bench.rolling > 0) stage.laws.set_all(&PairLaw::rolling_resistance, bench.rolling);
  scene.common = stage;
  const bool changes = draws.chance(0.5) && settings.steps > 1;
  const int first = changes ? settings.steps / 2 : settings.steps;
  stage.end.steps = first;
  scene.setup.stages.push_back(stage);
  if (changes) {
    stage.name = "second";
    stage.end.steps = settings.steps - first;
    change_loads(bench, stage);
    scene.setup.stages.push_back(stage);
  }
  SolverSettings& solver = scene.setup.solver;
  solver.overlap_correction = draws.chance(0.6) ? 0 : draws.between(0, 0.5);
  solver.warm_start = draws.chance(0.8);
  solver.tolerance = solver.balance_tolerance = settings.tolerance;
  scene.setup.decomposition.subdomains = settings.subdomains;
  scene.setup.decomposition.coupling = settings.coupling;
  if (in_cell) {  // where it follows a stress there is no other
    scene.setup.decomposition.coupling = Coupling::nscdd;
    solver.overlap_correction = 0;
    // A stress presses together by and by what one long step has driven in, so that every step behind it
    // would miss, and what is judged here are velocities and forces.
    solver.overlap_tolerance = 0.5;
  }
  scene.setup.seed = bench.made.seed;
  scene.samples.resize(1);
  scene.samples.front().kind = io::SampleSpec::Kind::bodies;
  scene.samples.front().shape = bench.shape;
  scene.output.every_steps = 1;
  scene.output.sinks = {};
}

std::span<const SceneFamily> scene_families() {
  return families;
}

MadeScene make_scene(std::string_view family, std::uint64_t seed, const MakerSettings& settings) {
  const auto found = std::ranges::find(families, family, &SceneFamily::name);
  if (found == families.end())
    throw std::invalid_argument(fmt::format("no family of scenes is called '{}'", family));
  SceneBench bench(seed, static_cast<std::uint64_t>(found - families.begin()), settings);
  bench.made.family = family;
  found->make(bench);
  finish_scene(bench, settings);
  io::Scene& scene = bench.made.scene;
  scene.name = bench.made.name();
  scene.description = fmt::format("{} (talus study certificate, seed {})", found->sentence, seed);
  scene.samples.front().file = scene.name + ".csv";
  return std::move(bench.made);
}

void keep_scene(const MadeScene& made, const std::filesystem::path& directory) {
  io::write_bodies(directory / made.scene.samples.front().file, made.grains);
  for (const Wall& wall : made.scene.setup.walls) {
    if (wall.shape.name != "mesh") continue;
    std::vector<Triangle> triangles;
    wall.surface()->show(triangles);
    io::write_whole(directory / wall.shape.values.file, io::stl_text(triangles));
  }
  io::write_whole(directory / (made.scene.name + ".toml"), io::resolved_scene(made.scene));
}

}  // namespace talus::audit
