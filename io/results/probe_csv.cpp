#include "io/results/probe_csv.hpp"

#include "io/files/detail/csv_cell.hpp"

namespace talus::io {

std::string probes_csv_header(std::span<const std::string> materials) {
  std::string text =
      "step,time,probe,count,mass,solid_fraction,vx,vy,vz,temperature,coordination,"
      "stress_xx,stress_xy,stress_xz,stress_yx,stress_yy,stress_yz,stress_zx,stress_zy,stress_zz,"
      "kinetic_xx,kinetic_xy,kinetic_xz,kinetic_yy,kinetic_yz,kinetic_zz,"
      "passed_count,passed_mass,count_rate,mass_rate";
  for (const std::string& name : materials)
    for (const char* column : {"count_", "mass_", "passed_count_", "passed_mass_"}) {
      text += ',';
      detail::put(text, column + name);
    }
  return text + '\n';
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
