/// What probes have seen: a chart for each quantity, a curve for each probe that has it.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "apps/report/sections.hpp"

namespace talus {

namespace {

using Columns = std::map<std::string, std::vector<double>>;  // of one probe

struct Quantity {
  const char *title, *label;
  std::function<double(const Columns&, std::size_t row)> value;
  const char* caption = "";
};

std::vector<Quantity> quantities() {
  const auto column = [](const char* name) {
    return [name](const Columns& of, std::size_t k) { return of.at(name)[k]; };
  };
  return {
      {"Flow through surfaces", "mass rate [kg/s]", column("mass_rate"), "Mean since the row before."},
      {"What went through surfaces", "mass [kg]", column("passed_mass"),
       "Along the normal less against it, since the run began."},
      {"Grains in regions", "grains", column("count")},
      {"Solid fraction", "solid fraction", column("solid_fraction")},
      {"Speed", "speed [m/s]",
       [](const Columns& of, std::size_t k) {
         return std::hypot(of.at("vx")[k], of.at("vy")[k], of.at("vz")[k]);
       },
       "Of the centre of mass of the grains in a region."},
      {"Granular temperature", "temperature [m²/s²]", column("temperature")},
      {"Pressure of the contacts", "pressure [Pa]",
       [](const Columns& of, std::size_t k) {
         return (of.at("stress_xx")[k] + of.at("stress_yy")[k] + of.at("stress_zz")[k]) / 3;
       }},
      {"Coordination", "contacts per grain", column("coordination")},
  };
}

}  // namespace

HtmlSections probe_section(const RunFolder& run) {
  const ByName rows = by_name(
      io::read_columns(run.directory / "probes.csv",
                       {"time", "count", "solid_fraction", "vx", "vy", "vz", "temperature", "coordination",
                        "stress_xx", "stress_yy", "stress_zz", "passed_mass", "mass_rate"},
                       "probe"));
  if (rows.names.empty()) return {};
  io::HtmlSection section{"Probes", ""};
  if (rows.names.size() > most_curves)
    section.text =
        fmt::format("The first {} of {} probes; probes.csv has all.", most_curves, rows.names.size());
  for (const Quantity& quantity : quantities()) {
    io::Chart chart = small_chart(quantity.title, time_label, quantity.label);
    // A probe has the same colour in every chart.
    for (std::size_t p = 0; p < std::min(rows.names.size(), most_curves); ++p) {
      const Columns& of = rows.values.at(rows.names[p]);
      std::vector<double> values(of.at("time").size());
      for (std::size_t k = 0; k < values.size(); ++k) values[k] = quantity.value(of, k);
      if (any_value(values))
        chart.series.push_back({rows.names[p], thinned(of.at("time"), values, Thinned::evenly), p});
    }
    add_figure(section, chart, quantity.caption);
  }
  if (section.figures.empty()) section.text = "No grain came to a probe.";
  return {section};
}

}  // namespace talus
