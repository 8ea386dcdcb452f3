/// What was simulated: in sentences, and as a table.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "apps/report/sections.hpp"
#include "io/files/detail/with_unit.hpp"

namespace talus {

namespace {

std::string joined(const std::vector<std::string>& words, const char* last) {
  std::string text;
  for (std::size_t k = 0; k < words.size(); ++k)
    text += (k == 0 ? "" : k + 1 == words.size() ? std::string(last) : ", ") + words[k];
  return text;
}

std::string counted(std::size_t count, const char* what) {
  return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
}

/// "radius 8 to 12 mm", from their distribution.
std::string radii_of(const SizeDistribution& radii) {
  const double low = smallest_radius(radii), high = largest_radius(radii);
  return low == high
             ? "radius " + io::detail::with_unit(low, "m")
             : "radius " + io::detail::with_unit(low, "m") + " to " + io::detail::with_unit(high, "m");
}

std::string sample_words(const io::SampleSpec& sample) {
  using Kind = io::SampleSpec::Kind;
  const std::string grains =
      sample.grains() > 0 ? counted(static_cast<std::size_t>(sample.grains()), "grain") : "grains";
  switch (sample.kind) {
    case Kind::deposition:
      return fmt::format("{} of {}, deposited one by one, each in the lowest place", grains,
                         radii_of(sample.radii));
    case Kind::lattice:
      return fmt::format("{} of {} on a lattice", grains, radii_of(sample.radii));
    case Kind::random:
      return fmt::format("{} of {} at random places", grains, radii_of(sample.radii));
    case Kind::bodies:
      return "grains from a file";
    case Kind::state:
      return "the state of an earlier run";
    case Kind::body:
      return fmt::format("a sphere '{}' of {}", sample.name, radii_of(sample.radii));
  }
  return grains;
}

std::string drive_words(const WallLoad& load) {
  switch (load.drive) {
    case WallDrive::fixed:
      return "is fixed";
    case WallDrive::velocity:
      return "moves at " + io::detail::with_unit(load.velocity.norm(), "m/s");
    case WallDrive::pressure:
      return "is pressed with " + io::detail::with_unit(load.pressure, "Pa");
    case WallDrive::force:
      return "is pushed with " + io::detail::with_unit(load.force, "N");
  }
  return "";
}

std::string load_words(const WallLoad& load) {
  std::string text = drive_words(load);
  if (load.pushed() && !load.velocity.isZero(0))
    text += ", and moves along its face at " + io::detail::with_unit(load.velocity.norm(), "m/s");
  return text;
}

std::string motion_words(const MotionPart& part) {
  using Kind = MotionPart::Kind;
  std::string text = part.surface_only ? "its surface " : "";
  switch (part.kind) {
    case Kind::velocity:
      text += "moves at " + io::detail::with_unit(part.velocity.norm(), "m/s");
      break;
    case Kind::rotation:
      text += fmt::format("turns at {:g} rad/s about ({:g}, {:g}, {:g})", part.rate, part.axis[0],
                          part.axis[1], part.axis[2]);
      break;
    case Kind::oscillation:
      text += fmt::format("swings by {} at {:g} 1/s along ({:g}, {:g}, {:g})",
                          io::detail::with_unit(part.amplitude, "m"), part.frequency, part.direction[0],
                          part.direction[1], part.direction[2]);
      break;
    case Kind::table:
      text += "moves by the table " + part.file;
      break;
  }
  if (!part.from_stage.empty()) text += ", from stage '" + part.from_stage + "' on";
  if (!part.until_stage.empty()) text += ", until stage '" + part.until_stage + "'";
  return text;
}

std::string wall_words(const Wall& wall) {
  std::vector<std::string> motions;
  for (const MotionPart& part : wall.motion) motions.push_back(motion_words(part));
  std::string text =
      wall.shape.name + ", " + (motions.empty() ? load_words(wall.load) : joined(motions, " and "));
  if (!wall.from_stage.empty()) text += ", from stage '" + wall.from_stage + "' on";
  if (!wall.until_stage.empty()) text += ", until stage '" + wall.until_stage + "'";
  return text;
}

std::string end_words(const StageEnd& end) {
  std::vector<std::string> ends;
  if (end.steps) ends.push_back(counted(static_cast<std::size_t>(*end.steps), "step"));
  if (end.time) ends.push_back(io::detail::with_unit(*end.time, "s"));
  if (end.strain)
    ends.push_back(fmt::format("a strain of {:g} along {}", *end.strain, "xyz"[end.strain_axis]));
  if (end.shear_strain) ends.push_back(fmt::format("a shear of {:g}", *end.shear_strain));
  if (end.equilibrium) ends.push_back(fmt::format("equilibrium within {:g}", *end.equilibrium));
  if (end.stress_ratio) ends.push_back(fmt::format("a stress ratio of {:g}", *end.stress_ratio));
  if (end.inertial_below) ends.push_back(fmt::format("an inertial number below {:g}", *end.inertial_below));
  if (end.inertial_above) ends.push_back(fmt::format("an inertial number above {:g}", *end.inertial_above));
  if (end.steady) ends.push_back(fmt::format("a drift within {:g}", *end.steady));
  return "until " + joined(ends, " or ");
}

/// "friction 0.35", "friction 0.35, at walls 0.1"; of several materials "friction 0.2 to 0.35". "" where it
/// is 0.
std::string law_words(const char* name, const PairTable& laws, LawNumber number,
                      const std::string& unit = "") {
  constexpr std::size_t one_material = 3;  // pairs: grains, walls, both
  const double most = laws.largest(number);
  if (most == 0) return "";
  if (laws.laws().size() == one_material) {
    const double grains = number.in(laws.between(material_of_grains, material_of_grains));
    const double walls = number.in(laws.between(material_of_grains, material_of_walls));
    return fmt::format("; {} {:g}{}{}", name, grains, unit,
                       walls == grains ? "" : fmt::format(", at walls {:g}{}", walls, unit));
  }
  double least = most;
  for (const PairLaw& law : laws.laws()) least = std::min(least, number.in(law));
  return least == most ? fmt::format("; {} {:g}{}", name, most, unit)
                       : fmt::format("; {} {:g} to {:g}{}", name, least, most, unit);
}

/// " xx 1 kPa, zz 2 kPa".
std::string stress_words(const StressLoad& load) {
  constexpr std::array<const char*, 6> names = {"xx", "yy", "zz", "xy", "xz", "yz"};
  std::string text;
  for (std::size_t k = 0; k < names.size(); ++k)
    if (load.to[k])
      text += fmt::format("{} {} {}", text.empty() ? "" : ",", names[k],
                          io::detail::with_unit(*load.to[k], "Pa"));
  return text;
}

std::string stage_words(const Stage& stage) {
  std::string text = end_words(stage.end) + "; ";
  text += stage.chooses_time_step ? "time steps are chosen"
                                  : "time step " + io::detail::with_unit(stage.time_step, "s");
  if (stage.laws.largest(&PairLaw::friction) == 0) text += "; no friction";
  text += law_words("friction", stage.laws, &PairLaw::friction);
  text += law_words("restitution", stage.laws, &PairLaw::restitution);
  for (const Attraction* attraction : attractions)
    text += law_words(attraction->name, stage.laws, *attraction, fmt::format(" {}", attraction->unit));
  text += law_words("rolling resistance", stage.laws, &PairLaw::rolling_resistance);
  if (!stage.strain_rates.isZero(0) || !stage.shear_rates.isZero(0))
    text += fmt::format("; the cell flows, strain rates {:g}, {:g}, {:g}, shear rates {:g}, {:g}, {:g} 1/s",
                        stage.strain_rates[0], stage.strain_rates[1], stage.strain_rates[2],
                        stage.shear_rates[0], stage.shear_rates[1], stage.shear_rates[2]);
  if (stage.stress.any()) text += "; the cell follows the stress" + stress_words(stage.stress);
  if (stage.gravity.norm() > 0) text += fmt::format("; gravity {:g} m/s²", stage.gravity.norm());
  for (const auto& [wall, load] : stage.loads) text += "; wall '" + wall + "' " + load_words(load);
  return text;
}

/// ", in stage 'drain', from 1 s until 2 s, every 10 ms".
std::string times_words(const RuleTimes& times) {
  std::string text;
  if (!times.stage.empty()) text += ", in stage '" + times.stage + "'";
  if (times.from > 0) text += ", from " + io::detail::with_unit(times.from, "s");
  if (std::isfinite(times.until)) text += ", until " + io::detail::with_unit(times.until, "s");
  if (times.interval > 0) text += ", every " + io::detail::with_unit(times.interval, "s");
  return text;
}

std::string insert_words(const InsertRule& insert) {
  std::string text = "spheres of " + radii_of(insert.radii);
  if (insert.rate) text += fmt::format(", {:g} a second", *insert.rate);
  if (insert.mass_rate) text += fmt::format(", {:g} kg a second", *insert.mass_rate);
  if (insert.count) text += fmt::format(", {} in all", *insert.count);
  if (insert.mass) text += fmt::format(", {:g} kg in all", *insert.mass);
  return text + times_words(insert.times);
}

std::string remove_words(const RemoveRule& remove, const io::Scene& scene) {
  std::string text = "grains ";
  if (remove.material) text += "of '" + scene.materials.at(*remove.material).name + "' ";
  text += remove.region.kind == Region::Kind::beyond ? "beyond a plane"
          : remove.region.is_round()                 ? "in a cylinder"
                                                     : "in a box";
  for (std::size_t k = 0; k < remove.at.size(); ++k)
    text += (k == 0 ? ", at " : ", ") + io::detail::with_unit(remove.at[k], "s");
  return text + times_words(remove.times);
}

/// ", in a periodic cell of 1 m x 1 m, between 2 walls".
std::string space_words(const Setup& setup) {
  std::string text;
  const Vec3 edges = setup.domain.edges();
  for (const Eigen::Index k : {0, 1, 2})
    if (edges[k] > 0)
      text += (text.empty() ? ", in a periodic cell of " : " × ") + io::detail::with_unit(edges[k], "m");
  if (!setup.walls.empty() || text.empty())
    text += fmt::format(", between {}", counted(setup.walls.size(), "wall"));
  return text;
}

std::string overview(const io::Scene& scene) {
  std::vector<std::string> what;
  for (const io::SampleSpec& sample : scene.samples) what.push_back(sample_words(sample));
  if (!scene.setup.inserts.empty()) what.push_back("grains that are inserted while it runs");
  std::string text = joined(what, " and ");
  if (!text.empty()) text[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(text[0])));
  std::vector<std::string> stages;
  for (const Stage& stage : scene.setup.stages) stages.push_back("'" + stage.name + "'");
  return text + space_words(scene.setup) +
         fmt::format(", in {}: {}.", counted(stages.size(), "stage"), joined(stages, ", then "));
}

}  // namespace

HtmlSections scene_section(const RunFolder& run) {
  io::HtmlSection section{"What was simulated", ""};
  auto& rows = section.table.rows;
  if (!run.scene) {
    section.text = "The scene reads files that are no longer there; it stands at the end of this page.";
  } else {
    const io::Scene& scene = *run.scene;
    section.text = overview(scene);
    for (const io::SampleSpec& sample : scene.samples) rows.push_back({"sample", sample_words(sample)});
    for (const InsertRule& insert : scene.setup.inserts)
      rows.push_back({"insert '" + insert.name + "'", insert_words(insert)});
    for (const RemoveRule& remove : scene.setup.removes)
      rows.push_back({"remove '" + remove.name + "'", remove_words(remove, scene)});
    if (scene.density > 0) rows.push_back({"density", fmt::format("{:g} kg/m³", scene.density)});
    for (const io::MaterialSpec& material : scene.materials)
      rows.push_back({"material '" + material.name + "'", fmt::format("{:g} kg/m³", material.density)});
    for (const Wall& wall : scene.setup.walls) rows.push_back({"wall '" + wall.name + "'", wall_words(wall)});
    for (const Stage& stage : scene.setup.stages)
      rows.push_back({"stage '" + stage.name + "'", stage_words(stage)});
    rows.push_back({"solver", fmt::format("{}, tolerance {:g}, at most {} sweeps a step",
                                          scene.setup.solver.method.name(), scene.setup.solver.tolerance,
                                          scene.setup.solver.max_iterations)});
  }
  if (const auto bodies = run.summary.find("bodies_at_end");
      bodies != run.summary.end() && bodies->is_number_unsigned())
    rows.push_back({"grains at the end", fmt::format("{}", bodies->get<std::size_t>())});
  for (const std::string& warning : sentences_of(run, "warnings")) rows.push_back({"warning", warning});
  return {section};
}

}  // namespace talus
