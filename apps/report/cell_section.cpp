/// A periodic cell: its stresses and what is in it.

#include <fmt/format.h>

#include <algorithm>

#include "apps/report/sections.hpp"

namespace talus {

namespace {

/// What the last stage is drawn over.
struct StageAxis {
  std::size_t begin = 0;  ///< its first row
  std::vector<double> values;
  std::string label;
};

/// Shear strain of a stage that shears at given rates; else time.
StageAxis axis_of_last_stage(const RunFolder& run, const io::TableColumns& table) {
  StageAxis axis;
  const std::string& stage = table.texts.back();
  const std::vector<double>& time = table["time"];
  while (table.texts[axis.begin] != stage) ++axis.begin;
  double rate = 0;
  if (run.scene)
    for (const Stage& each : run.scene->setup.stages)
      if (each.name == stage) rate = each.shear_rates.norm();
  const double from = axis.begin > 0 ? time[axis.begin - 1] : 0;
  for (std::size_t k = axis.begin; k < time.size(); ++k)
    axis.values.push_back(rate > 0 ? rate * (time[k] - from) : time[k]);
  axis.label = rate > 0 ? fmt::format("shear strain of stage '{}'", stage) : time_label;
  return axis;
}

}  // namespace

HtmlSections cell_section(const RunFolder& run) {
  const io::TableColumns table = io::read_columns(
      run.directory / "cell.csv",
      {"time", "stress_xx", "stress_yy", "stress_zz", "stress_xy", "stress_xz", "stress_yz", "p", "q_over_p",
       "solid_fraction", "contacts_a_grain", "coordination", "inertial_number"},
      "stage");
  if (table.rows() == 0) return {};
  const StageAxis axis = axis_of_last_stage(run, table);
  const auto of_stage = [&](const char* name) { return std::span(table[name]).subspan(axis.begin); };
  io::HtmlSection section{
      "Periodic cell",
      "Stresses are those of the contacts, positive in compression; q is the root of 3/2 s : "
      "s, s their deviator."};
  io::Chart ratio = small_chart("Stress ratio", axis.label, "q/p"),
            shear = small_chart("Shear stresses", axis.label, "stress [Pa]"),
            normal = small_chart("Normal stresses of the whole run", time_label, "stress [Pa]"),
            fraction = small_chart("Solid fraction", time_label, "solid fraction"),
            coordination = small_chart("Coordination", time_label, "contacts per grain"),
            inertia = small_chart("Inertial number", time_label, "inertial number", true);
  add_curve(ratio, "", axis.values, of_stage("q_over_p"));
  for (const char* name : {"stress_xy", "stress_xz", "stress_yz"})
    add_curve(shear, name + 7, axis.values, of_stage(name));
  for (const char* name : {"stress_xx", "stress_yy", "stress_zz"})
    add_curve(normal, name + 7, table["time"], table[name]);
  add_curve(fraction, "volume of grains over that of the cell", table["time"], table["solid_fraction"]);
  add_curve(coordination, "of all grains", table["time"], table["contacts_a_grain"]);
  add_curve(coordination, "without rattlers", table["time"], table["coordination"]);
  if (any_value(table["inertial_number"])) add_curve(inertia, "", table["time"], table["inertial_number"]);
  for (const io::Chart* chart : {&ratio, &shear, &normal, &fraction, &coordination, &inertia})
    add_figure(section, *chart);
  return {section};
}

}  // namespace talus
