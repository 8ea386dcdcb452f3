/// The curves of the experiment: stresses, walls, grains that come and go, bodies, energy.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "apps/report/sections.hpp"

namespace talus {

namespace {

constexpr const char* time_label = "time [s]";
constexpr std::size_t most_curves = 8;  // hues that are told apart

void add(io::Chart& chart, const std::string& name, std::span<const double> x, std::span<const double> y) {
  const std::size_t k = chart.series.size();
  if (k < most_curves) chart.series.push_back({name, thinned(x, y, Thinned::evenly), k});
}
void add_figure(io::HtmlSection& section, const io::Chart& chart, std::string caption = {}) {
  if (!chart.series.empty()) section.figures.push_back({io::draw_chart(chart), std::move(caption)});
}

std::vector<double> scaled(std::span<const double> values, double factor) {
  std::vector<double> result(values.begin(), values.end());
  for (double& value : result) value *= factor;
  return result;
}

/// Rows of the stage in which the sample was sheared: the last one.
struct Shear {
  std::string stage;
  std::size_t begin = 0;
  int axis = 2;
};

Shear last_stage(const io::TableColumns& table) {
  Shear shear{table.texts.back()};
  while (shear.begin < table.texts.size() && table.texts[shear.begin] != shear.stage) ++shear.begin;
  double most = -1;
  const char* names[] = {"strain_x", "strain_y", "strain_z"};
  for (int axis = 0; axis < 3; ++axis)
    if (const double reached = std::abs(table[names[axis]].back()); reached > most)
      most = reached, shear.axis = axis;
  return shear;
}

HtmlSections triaxial(const RunFolder& run) {
  const io::TableColumns table =
      io::read_columns(run.directory / "triaxial.csv",
                       {"time", "strain_x", "strain_y", "strain_z", "strain_volume", "stress_x", "stress_y",
                        "stress_z", "q_over_p", "solid_fraction", "coordination"},
                       "stage");
  if (table.rows() == 0) return {};
  const Shear shear = last_stage(table);
  const char axis = "xyz"[shear.axis];
  const auto of_stage = [&](const std::string& name) { return std::span(table[name]).subspan(shear.begin); };
  const std::vector<double> strain = scaled(of_stage(std::string("strain_") + axis), -100);
  const std::string strain_label = fmt::format("strain along {}, compression [%]", axis);
  io::HtmlSection section{"Stress and strain",
                          fmt::format("Strains are those of the stage '{}'; stresses are positive in "
                                      "compression.",
                                      shear.stage)};
  io::Chart ratio = small_chart("Stress ratio", strain_label, "q/p");
  add(ratio, "", strain, of_stage("q_over_p"));
  io::Chart volume = small_chart("Volume strain", strain_label, "volume strain [%]");
  add(volume, "positive: the sample dilates", strain, scaled(of_stage("strain_volume"), 100));
  io::Chart stress = small_chart("Stresses of the whole run", time_label, "stress [kPa]");
  for (const char* name : {"stress_x", "stress_y", "stress_z"})
    add(stress, std::string("along ") + name[7], table["time"], scaled(table[name], 1e-3));
  io::Chart fraction = small_chart("Solid fraction", time_label, "solid fraction");
  add(fraction, "volume of grains over that of the box", table["time"], table["solid_fraction"]);
  io::Chart coordination = small_chart("Coordination", time_label, "contacts per grain");
  add(coordination, "without rattlers", table["time"], table["coordination"]);
  for (const io::Chart* chart : {&ratio, &volume, &stress, &fraction, &coordination})
    add_figure(section, *chart);
  return {section};
}

/// Values of a table by the name that its rows carry, in the order in which names appear.
struct ByName {
  std::vector<std::string> names;
  std::map<std::string, std::map<std::string, std::vector<double>>> values;  ///< by name, then column
};

ByName by_name(const io::TableColumns& table) {
  ByName result;
  for (std::size_t k = 0; k < table.texts.size(); ++k) {
    auto& columns = result.values[table.texts[k]];
    if (columns.empty()) result.names.push_back(table.texts[k]);
    for (const auto& [name, numbers] : table.numbers) columns[name].push_back(numbers[k]);
  }
  return result;
}

HtmlSections walls(const RunFolder& run) {
  const ByName rows = by_name(
      io::read_columns(run.directory / "walls.csv",
                       {"time", "force_x", "force_y", "force_z", "work", "position", "velocity"}, "wall"));
  if (rows.names.empty()) return {};
  io::HtmlSection section{"Walls", ""};
  io::Chart forces = small_chart("Forces of the walls on the grains", time_label, "force [N]");
  io::Chart work = small_chart("Work of the walls on the grains", time_label, "work [J]");
  io::Chart paths = small_chart("Displacement of moving planes", time_label, "displacement [m]");
  for (const std::string& name : rows.names) {
    const auto& of = rows.values.at(name);
    std::vector<double> size(of.at("time").size()), path = of.at("position");
    for (std::size_t k = 0; k < size.size(); ++k)
      size[k] = std::hypot(of.at("force_x")[k], of.at("force_y")[k], of.at("force_z")[k]);
    add(forces, name, of.at("time"), size);
    const auto some = [](const std::vector<double>& values) {
      return std::any_of(values.begin(), values.end(), [](double value) { return value != 0; });
    };
    if (of.contains("work") && some(of.at("work"))) add(work, name, of.at("time"), of.at("work"));
    const double first = path.front();
    for (double& value : path) value -= first;
    if (some(path)) add(paths, name, of.at("time"), path);
  }
  if (rows.names.size() > most_curves)
    section.text =
        fmt::format("The first {} of {} walls; walls.csv has all.", most_curves, rows.names.size());
  add_figure(section, forces, "Magnitudes, mean over each step.");
  add_figure(section, work);
  add_figure(section, paths, "Along their normals, which point into the grains.");
  return {section};
}

HtmlSections grains_that_come_and_go(const RunFolder& run) {
  io::Chart mass = small_chart("Mass that came and went", time_label, "mass [kg]");
  for (const auto& [file, text, verb] :
       {std::array{"inserted.csv", "insert", "came by"}, std::array{"removed.csv", "remove", "went by"}}) {
    const ByName rows = by_name(io::read_columns(run.directory / file, {"time", "mass"}, text));
    for (const std::string& name : rows.names)
      add(mass, fmt::format("{} '{}'", verb, name), rows.values.at(name).at("time"),
          rows.values.at(name).at("mass"));
  }
  io::HtmlSection section{"Grains that came and went", ""};
  add_figure(section, mass);
  return section.figures.empty() ? HtmlSections{} : HtmlSections{section};
}

HtmlSections bodies(const RunFolder& run) {
  const ByName rows =
      by_name(io::read_columns(run.directory / "bodies.csv",
                               {"time", "z", "vx", "vy", "vz", "force_x", "force_y", "force_z"}, "body"));
  io::Chart height = small_chart("Height", time_label, "z [m]"),
            speed = small_chart("Speed", time_label, "speed [m/s]"),
            force = small_chart("Force of its contacts", time_label, "force [N]");
  for (const std::string& name : rows.names) {
    const auto& of = rows.values.at(name);
    std::vector<double> v(of.at("time").size()), f(v.size());
    for (std::size_t k = 0; k < v.size(); ++k) {
      v[k] = std::hypot(of.at("vx")[k], of.at("vy")[k], of.at("vz")[k]);
      f[k] = std::hypot(of.at("force_x")[k], of.at("force_y")[k], of.at("force_z")[k]);
    }
    add(height, name, of.at("time"), of.at("z"));
    add(speed, name, of.at("time"), v);
    add(force, name, of.at("time"), f);
  }
  io::HtmlSection section{"Named bodies", ""};
  for (const io::Chart* chart : {&height, &speed, &force}) add_figure(section, *chart);
  return section.figures.empty() ? HtmlSections{} : HtmlSections{section};
}

HtmlSections energy(const RunFolder& run) {
  if (run.steps.rows() == 0) return {};
  io::HtmlSection section{"Grains", ""};
  io::Chart kinetic = small_chart("Kinetic energy of the grains", time_label, "energy [J]", true);
  add(kinetic, "translation", run.steps["time"], run.steps["kinetic_translation"]);
  add(kinetic, "rotation", run.steps["time"], run.steps["kinetic_rotation"]);
  io::Chart contacts = small_chart("Contacts", time_label, "contacts");
  add(contacts, "within the alert distance", run.steps["time"], run.steps["contacts"]);
  add(contacts, "that carry a force", run.steps["time"], run.steps["active"]);
  add_figure(section, kinetic);
  add_figure(section, contacts);
  return {section};
}

}  // namespace

HtmlSections experiment_sections(const RunFolder& run) {
  HtmlSections all;
  for (const auto part : {triaxial, grains_that_come_and_go, bodies, walls, energy})
    for (io::HtmlSection& section : part(run)) all.push_back(std::move(section));
  return all;
}

}  // namespace talus
