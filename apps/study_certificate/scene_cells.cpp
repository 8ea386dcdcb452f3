/// The family of periodic cells: dense packings that are pressed, sheared and strained.

#include <algorithm>
#include <cmath>
#include <numbers>

#include "apps/study_certificate/scene_bench.hpp"
#include "apps/study_certificate/step_cell.hpp"

namespace talus::audit {

namespace {

/// Of the radii, over the largest: equal ones in a third of the cells, 1:8 at most, now and then 1:25.
double draw_smallest(Draws& draws) {
  if (draws.chance(0.3)) return 1;
  return draws.chance(0.1) ? 1.0 / 25 : 1 / draws.between_decades(1, 8);
}

/// Grains until the cell is so wide at the solid fraction that no grain meets two images of another.
std::vector<double> draw_radii_of_cell(SceneBench& bench, double solid, double& edge) {
  const int grains = bench.draw_count(8, 120);
  const double smallest = draw_smallest(bench.draws);
  // Of check_cell, with the distances that detection takes where the scene gives none; the edges differ and
  // lean, and shrink by ten per cent.
  const double least = 1.35 * (4 + 0.6 * smallest) * bench.radius;
  std::vector<double> radii;
  double volume = 0;
  while (static_cast<int>(radii.size()) < grains || std::cbrt(volume / solid) < least) {
    radii.push_back(bench.radius * bench.draws.between(smallest, 1));
    volume += 4.0 / 3 * std::numbers::pi * std::pow(radii.back(), 3);
  }
  edge = std::cbrt(volume / solid);
  return radii;
}

/// Rounds of push_apart at most, and the part of an overlap that each takes away: several act on a grain.
constexpr int push_rounds = 400;
constexpr double push_share = 0.4;

/// Pushes overlapping pairs apart along their nearest images, the lighter one farther.
void push_apart(const StepCell& cell, const std::vector<double>& radii, std::vector<Vec3>& x) {
  std::vector<Vec3> way(x.size());
  for (int round = 0; round < push_rounds; ++round) {
    std::ranges::fill(way, Vec3::Zero());
    bool any = false;
    for (std::size_t i = 0; i < x.size(); ++i)
      for (std::size_t j = 0; j < i; ++j) {
        const Vec3 between = x[i] - x[j], d = between - cell.edges * cell.edges_between(between);
        const double distance = d.norm(), overlap = radii[i] + radii[j] - distance;
        if (overlap <= 0 || distance == 0) continue;
        any = true;
        const double a = std::pow(radii[i], 3), b = std::pow(radii[j], 3);
        way[i] += push_share * overlap * b / (a + b) / distance * d;
        way[j] -= push_share * overlap * a / (a + b) / distance * d;
      }
    if (!any) return;
    for (std::size_t k = 0; k < x.size(); ++k) x[k] += way[k];
  }
}

/// The cell, and in it a dense packing. Returns the mean diameter [m].
double pack_cell(SceneBench& bench, double solid) {
  Draws& draws = bench.draws;
  double edge = 0;
  const std::vector<double> radii = draw_radii_of_cell(bench, solid, edge);
  const double wide = draws.between(0.95, 1.05), high = draws.between(0.95, 1.05);
  io::CellSpec& spec = bench.made.scene.cell;
  spec.lengths = edge * Vec3(wide, high, 1 / (wide * high));
  if (draws.chance(0.4)) {
    const Vec3 lean(draws.between(-0.5, 0.5), draws.between(-0.5, 0.5), draws.between(-0.5, 0.5));
    spec.shears = lean.cwiseProduct(Vec3(spec.lengths[0], spec.lengths[0], spec.lengths[1]));
  }
  if (draws.chance(0.2)) spec.origin = edge * Vec3(draws.unit(), draws.unit(), draws.unit());
  spec.inertia = draws.chance(0.7) ? 1 : draws.between_decades(0.1, 10);
  Setup& setup = bench.made.scene.setup;
  setup.cell_inertia = spec.inertia;
  setup.domain = periodic_domain(spec.lengths, spec.origin, spec.shears);
  StepCell cell;
  cell.repeats = true;
  cell.repeats_along = {true, true, true};
  cell.edges = spec.lengths.asDiagonal();
  cell.edges(0, 1) = spec.shears[0];
  cell.edges(0, 2) = spec.shears[1];
  cell.edges(1, 2) = spec.shears[2];
  std::vector<Vec3> x;
  for (std::size_t k = 0; k < radii.size(); ++k)
    x.push_back(spec.origin + cell.edges * Vec3(draws.unit(), draws.unit(), draws.unit()));
  push_apart(cell, radii, x);
  double diameters = 0;
  for (std::size_t k = 0; k < radii.size(); ++k) {
    bench.add(setup.domain.wrap(x[k]), radii[k]);
    diameters += 2 * radii[k];
  }
  return diameters / static_cast<double>(radii.size());
}

/// A stress of about p [Pa]; `leaning`: with a deviator, shears among it.
void draw_stress(Draws& draws, double p, bool leaning, StressLoad& stress) {
  for (std::size_t k = 0; k < 3; ++k) stress.to[k] = leaning ? p * draws.between(0.6, 1.4) : p;
  if (leaning || draws.chance(0.5))
    for (std::size_t k = 3; k < 6; ++k) stress.to[k] = leaning ? p * draws.between(-0.25, 0.25) : 0;
}

/// Of an edge in a step: pressed together faster the grains of a cell, which is some three of the largest
/// wide, would touch their own images before the twenty steps of a scene are over.
constexpr double most_pressed = 0.01;

/// One component strained or sheared at `rate` [1/s].
void draw_rate(Draws& draws, double rate, Stage& stage) {
  const auto axis = static_cast<Eigen::Index>(draws.below(3));
  const bool shears = draws.chance(0.5);
  const double least = shears ? -rate : std::max(-rate, -most_pressed / stage.time_step);
  (shears ? stage.shear_rates : stage.strain_rates)[axis] = draws.chance(0.5) ? rate : least;
  stage.stress.to[static_cast<std::size_t>(axis) + (shears ? 3 : 0)].reset();
}

enum class CellLoad { pressed, deviatoric, driven, prescribed };

}  // namespace

void make_cell(SceneBench& bench) {
  Draws& draws = bench.draws;
  bench.gravity = 0;
  const double kind = draws.unit();
  const CellLoad load = kind < 0.3    ? CellLoad::pressed
                        : kind < 0.55 ? CellLoad::deviatoric
                        : kind < 0.85 ? CellLoad::driven
                                      : CellLoad::prescribed;
  // Denser than that a packing without friction may be jammed, and then no prescribed flow has an answer.
  const double solid = draws.between(0.5, load == CellLoad::prescribed ? 0.58 : 0.64);
  const double p = draws.between_decades(1e2, 1e6), sound = std::sqrt(p / bench.made.grains.density);
  bench.speed = draws.chance(0.7) ? 0 : sound * draws.between_decades(1e-3, 0.3);
  const double natural = pack_cell(bench, solid) / sound;
  Stage stage;
  // A loose cell closes first, and a light one faster; a step that strains it by a fifth ends the run.
  const double light = std::min(1.0, std::sqrt(bench.made.scene.cell.inertia));
  stage.time_step = natural * light * draws.between_decades(0.02, solid < 0.58 ? 0.1 : 0.5);
  if (load != CellLoad::prescribed)
    draw_stress(draws, p, load == CellLoad::deviatoric || draws.chance(0.3), stage.stress);
  // A step strains the cell by a twentieth at most.
  const double fastest = std::min(0.3 / natural, 0.05 / stage.time_step);
  if (load == CellLoad::driven || load == CellLoad::prescribed)
    draw_rate(draws, fastest * draws.between_decades(1e-3, 1), stage);
  bench.cell_stages.push_back(stage);
  const double factor = draws.chance(0.5) ? 2 : 0.5;
  for (auto& component : stage.stress.to)
    if (component) *component *= factor;
  if (load == CellLoad::deviatoric) draw_stress(draws, p, true, stage.stress);
  if (draws.chance(0.5)) {
    stage.strain_rates = (-stage.strain_rates).cwiseMax(-most_pressed / stage.time_step);
    stage.shear_rates *= -1;
  }
  bench.cell_stages.push_back(stage);
}

}  // namespace talus::audit
