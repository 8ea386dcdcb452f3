/// The curves of the experiment: stresses, walls, grains that come and go, bodies, energy.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "apps/report/sections.hpp"

namespace talus {

namespace {

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
  if (table.rows() == 0 || std::filesystem::exists(run.directory / "cell.csv")) return {};
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
  add_curve(ratio, "", strain, of_stage("q_over_p"));
  io::Chart volume = small_chart("Volume strain", strain_label, "volume strain [%]");
  add_curve(volume, "positive: the sample dilates", strain, scaled(of_stage("strain_volume"), 100));
  io::Chart stress = small_chart("Stresses of the whole run", time_label, "stress [kPa]");
  for (const char* name : {"stress_x", "stress_y", "stress_z"})
    add_curve(stress, std::string("along ") + name[7], table["time"], scaled(table[name], 1e-3));
  io::Chart fraction = small_chart("Solid fraction", time_label, "solid fraction");
  add_curve(fraction, "volume of grains over that of the box", table["time"], table["solid_fraction"]);
  io::Chart coordination = small_chart("Coordination", time_label, "contacts per grain");
  add_curve(coordination, "without rattlers", table["time"], table["coordination"]);
  for (const io::Chart* chart : {&ratio, &volume, &stress, &fraction, &coordination})
    add_figure(section, *chart);
  return {section};
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
    add_curve(forces, name, of.at("time"), size);
    if (of.contains("work") && any_value(of.at("work"))) add_curve(work, name, of.at("time"), of.at("work"));
    const double first = path.front();
    for (double& value : path) value -= first;
    if (any_value(path)) add_curve(paths, name, of.at("time"), path);
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
      add_curve(mass, fmt::format("{} '{}'", verb, name), rows.values.at(name).at("time"),
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
    add_curve(height, name, of.at("time"), of.at("z"));
    add_curve(speed, name, of.at("time"), v);
    add_curve(force, name, of.at("time"), f);
  }
  io::HtmlSection section{"Named bodies", ""};
  for (const io::Chart* chart : {&height, &speed, &force}) add_figure(section, *chart);
  return section.figures.empty() ? HtmlSections{} : HtmlSections{section};
}

HtmlSections energy(const RunFolder& run) {
  if (run.steps.rows() == 0) return {};
  io::HtmlSection section{"Grains", ""};
  io::Chart kinetic = small_chart("Kinetic energy of the grains", time_label, "energy [J]", true);
  add_curve(kinetic, "translation", run.steps["time"], run.steps["kinetic_translation"]);
  add_curve(kinetic, "rotation", run.steps["time"], run.steps["kinetic_rotation"]);
  io::Chart contacts = small_chart("Contacts", time_label, "contacts");
  add_curve(contacts, "within the alert distance", run.steps["time"], run.steps["contacts"]);
  add_curve(contacts, "that carry a force", run.steps["time"], run.steps["active"]);
  add_figure(section, kinetic);
  add_figure(section, contacts);
  return {section};
}

}  // namespace

HtmlSections experiment_sections(const RunFolder& run) {
  HtmlSections all;
  for (const auto part :
       {triaxial, cell_section, probe_section, grains_that_come_and_go, bodies, walls, energy})
    for (io::HtmlSection& section : part(run)) all.push_back(std::move(section));
  return all;
}

}  // namespace talus
