#include "io/results/probe_csv.hpp"

#include <initializer_list>

#include "io/files/detail/csv_cell.hpp"

namespace talus::io {

TableMeaning probes_meaning(std::span<const std::string> materials) {
  TableMeaning table{"probes.csv",
                     {{"step", "1", "time steps done, from 1"},
                      {"time", "s", "time at the end of the step"},
                      {"probe", "", "name of the probe"},
                      {"count", "1", "grains whose centres lie in the region"},
                      {"mass", "kg", "mass of these"},
                      {"solid_fraction", "1", "volume of parts of grains in the region over its volume"},
                      {"vx", "m/s", "velocity of the centre of mass of the grains in the region, x"},
                      {"vy", "m/s", "the same, y"},
                      {"vz", "m/s", "the same, z"},
                      {"temperature", "m^2/s^2", "a third of the mean square of velocities about that"},
                      {"coordination", "1", "ends of active contacts per grain"}}};
  const char* const axes[] = {"x", "y", "z"};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      table.columns.push_back({std::string("stress_") + axes[i] + axes[j], "Pa",
                               "stress of the contacts, force first, positive in compression"});
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = i; j < 3; ++j)
      table.columns.push_back({std::string("kinetic_") + axes[i] + axes[j], "Pa",
                               "stress of the velocities about that of the centre of mass"});
  for (const ColumnMeaning& passed : std::initializer_list<ColumnMeaning>{
           {"passed_count", "1", "grains that went through the surface along its normal, less those against"},
           {"passed_mass", "kg", "mass of these"},
           {"count_rate", "1/s", "passed_count since the last report, over its time"},
           {"mass_rate", "kg/s", "passed_mass likewise"}})
    table.columns.push_back(passed);
  for (const std::string& name : materials)
    for (const ColumnMeaning& of :
         std::initializer_list<ColumnMeaning>{{"count_" + name, "1", "count of this material"},
                                              {"mass_" + name, "kg", "mass of this material"},
                                              {"passed_count_" + name, "1", "passed_count of this material"},
                                              {"passed_mass_" + name, "kg", "passed_mass of this material"}})
      table.columns.push_back(of);
  return table;
}

std::string probes_csv_header(std::span<const std::string> materials) {
  std::string text;
  for (const ColumnMeaning& column : probes_meaning(materials).columns) {
    detail::put(text, column.name);
    text += ',';
  }
  text.back() = '\n';
  return text;
}

void append_probes_row(std::string& text, const StepReport& step, const ProbeReport& report,
                       std::span<const std::string> materials) {
  const auto cells = [&](const auto&... values) { ((detail::put(text, values), text += ','), ...); };
  cells(step.step, step.time, report.name, report.count, report.mass, report.solid_fraction,
        report.velocity.x(), report.velocity.y(), report.velocity.z(), report.temperature,
        report.coordination);
  for (Eigen::Index i = 0; i < 3; ++i)
    for (Eigen::Index j = 0; j < 3; ++j) cells(report.contact_stress(i, j));
  for (Eigen::Index i = 0; i < 3; ++i)
    for (Eigen::Index j = i; j < 3; ++j) cells(report.kinetic_stress(i, j));
  cells(report.passed_count, report.passed_mass, report.count_rate, report.mass_rate);
  for (std::size_t m = 0; m < materials.size(); ++m) {
    const ProbeReport::OfMaterial& of = report.materials[m];
    cells(of.count, of.mass, of.passed_count, of.passed_mass);
  }
  text.back() = '\n';
}

}  // namespace talus::io
