#include "io/results/csv_writer.hpp"

#include <fcntl.h>
#include <fmt/format.h>

#include <iterator>
#include <span>
#include <utility>

#include "io/files/detail/csv_cell.hpp"
#include "io/files/error.hpp"

namespace talus::io {
namespace {

using detail::put;

/// One column: its name and how a row's value is written. The tables below drive both the header and the
/// rows.
template <class Row>
struct Column {
  std::string_view name;
  void (*append)(std::string&, const Row&);
};

struct WallRow {
  const StepReport& step;
  const WallReport& wall;
};

struct BodyRow {
  const StepReport& step;
  const BodyReport& body;
};

struct InsertRow {
  const StepReport& step;
  const InsertReport& insert;
};

struct RemoveRow {
  const StepReport& step;
  const RemoveReport& remove;
};

struct ErrorRow {
  std::int64_t step;
  const ErrorCheck& check;
};

constexpr Column<StepReport> steps_columns[] = {
    {"step", [](std::string& t, const StepReport& r) { put(t, r.step); }},
    {"time", [](std::string& t, const StepReport& r) { put(t, r.time); }},
    {"time_step", [](std::string& t, const StepReport& r) { put(t, r.time_step); }},
    {"candidates", [](std::string& t, const StepReport& r) { put(t, r.candidates); }},
    {"contacts", [](std::string& t, const StepReport& r) { put(t, r.contacts); }},
    {"active", [](std::string& t, const StepReport& r) { put(t, r.active); }},
    {"iterations", [](std::string& t, const StepReport& r) { put(t, r.iterations); }},
    {"error_rms", [](std::string& t, const StepReport& r) { put(t, r.error_rms); }},
    {"error_max", [](std::string& t, const StepReport& r) { put(t, r.error_max); }},
    {"error_quantile", [](std::string& t, const StepReport& r) { put(t, r.error_quantile); }},
    {"worst_contact_body", [](std::string& t, const StepReport& r) { put(t, r.worst.contact.body); }},
    {"worst_contact_with", [](std::string& t, const StepReport& r) { put(t, r.worst.contact.with); }},
    {"worst_body", [](std::string& t, const StepReport& r) { put(t, r.worst.body); }},
    {"worst_body_error", [](std::string& t, const StepReport& r) { put(t, r.worst.body_error); }},
    {"balance", [](std::string& t, const StepReport& r) { put(t, r.balance); }},
    {"jump", [](std::string& t, const StepReport& r) { put(t, r.jump); }},
    {"penetration_mean", [](std::string& t, const StepReport& r) { put(t, r.penetration_mean); }},
    {"penetration_max", [](std::string& t, const StepReport& r) { put(t, r.penetration_max); }},
    {"overlap", [](std::string& t, const StepReport& r) { put(t, r.overlap); }},
    {"overlap_body",
     [](std::string& t, const StepReport& r) { put(t, r.overlapping ? r.overlapping->body : -1); }},
    {"overlap_with",
     [](std::string& t, const StepReport& r) { put(t, r.overlapping ? r.overlapping->with : -1); }},
    {"kinetic_translation", [](std::string& t, const StepReport& r) { put(t, r.kinetic_translation); }},
    {"kinetic_rotation", [](std::string& t, const StepReport& r) { put(t, r.kinetic_rotation); }},
    {"solid_fraction", [](std::string& t, const StepReport& r) { put(t, r.solid_fraction); }},
    {"equilibrium", [](std::string& t, const StepReport& r) { put(t, r.equilibrium); }},
    {"migrants", [](std::string& t, const StepReport& r) { put(t, r.migrants); }},
    {"imbalance", [](std::string& t, const StepReport& r) { put(t, r.imbalance); }},
    {"wall_s", [](std::string& t, const StepReport& r) { put(t, r.wall_s); }},
    {"converged", [](std::string& t, const StepReport& r) { put(t, r.converged); }},
};

constexpr Column<WallRow> walls_columns[] = {
    {"step", [](std::string& t, const WallRow& r) { put(t, r.step.step); }},
    {"time", [](std::string& t, const WallRow& r) { put(t, r.step.time); }},
    {"wall", [](std::string& t, const WallRow& r) { put(t, r.wall.name); }},
    {"position", [](std::string& t, const WallRow& r) { put(t, r.wall.position); }},
    {"velocity", [](std::string& t, const WallRow& r) { put(t, r.wall.velocity); }},
    {"force_x", [](std::string& t, const WallRow& r) { put(t, r.wall.force.x()); }},
    {"force_y", [](std::string& t, const WallRow& r) { put(t, r.wall.force.y()); }},
    {"force_z", [](std::string& t, const WallRow& r) { put(t, r.wall.force.z()); }},
    {"torque_x", [](std::string& t, const WallRow& r) { put(t, r.wall.torque.x()); }},
    {"torque_y", [](std::string& t, const WallRow& r) { put(t, r.wall.torque.y()); }},
    {"torque_z", [](std::string& t, const WallRow& r) { put(t, r.wall.torque.z()); }},
    {"work", [](std::string& t, const WallRow& r) { put(t, r.wall.work); }},
};

constexpr Column<BodyRow> bodies_columns[] = {
    {"step", [](std::string& t, const BodyRow& r) { put(t, r.step.step); }},
    {"time", [](std::string& t, const BodyRow& r) { put(t, r.step.time); }},
    {"body", [](std::string& t, const BodyRow& r) { put(t, r.body.name); }},
    {"x", [](std::string& t, const BodyRow& r) { put(t, r.body.x.x()); }},
    {"y", [](std::string& t, const BodyRow& r) { put(t, r.body.x.y()); }},
    {"z", [](std::string& t, const BodyRow& r) { put(t, r.body.x.z()); }},
    {"vx", [](std::string& t, const BodyRow& r) { put(t, r.body.u.x()); }},
    {"vy", [](std::string& t, const BodyRow& r) { put(t, r.body.u.y()); }},
    {"vz", [](std::string& t, const BodyRow& r) { put(t, r.body.u.z()); }},
    {"wx", [](std::string& t, const BodyRow& r) { put(t, r.body.omega.x()); }},
    {"wy", [](std::string& t, const BodyRow& r) { put(t, r.body.omega.y()); }},
    {"wz", [](std::string& t, const BodyRow& r) { put(t, r.body.omega.z()); }},
    {"force_x", [](std::string& t, const BodyRow& r) { put(t, r.body.force.x()); }},
    {"force_y", [](std::string& t, const BodyRow& r) { put(t, r.body.force.y()); }},
    {"force_z", [](std::string& t, const BodyRow& r) { put(t, r.body.force.z()); }},
};

constexpr Column<InsertRow> inserted_columns[] = {
    {"step", [](std::string& t, const InsertRow& r) { put(t, r.step.step); }},
    {"time", [](std::string& t, const InsertRow& r) { put(t, r.step.time); }},
    {"insert", [](std::string& t, const InsertRow& r) { put(t, r.insert.name); }},
    {"placed", [](std::string& t, const InsertRow& r) { put(t, r.insert.placed); }},
    {"mass", [](std::string& t, const InsertRow& r) { put(t, r.insert.mass); }},
    {"waiting", [](std::string& t, const InsertRow& r) { put(t, r.insert.waiting); }},
    {"no_room", [](std::string& t, const InsertRow& r) { put(t, r.insert.no_room); }},
};

constexpr Column<RemoveRow> removed_columns[] = {
    {"step", [](std::string& t, const RemoveRow& r) { put(t, r.step.step); }},
    {"time", [](std::string& t, const RemoveRow& r) { put(t, r.step.time); }},
    {"remove", [](std::string& t, const RemoveRow& r) { put(t, r.remove.name); }},
    {"material", [](std::string& t, const RemoveRow& r) { put(t, r.remove.material); }},
    {"count", [](std::string& t, const RemoveRow& r) { put(t, r.remove.count); }},
    {"mass", [](std::string& t, const RemoveRow& r) { put(t, r.remove.mass); }},
};

constexpr Column<TriaxialReport> triaxial_columns[] = {
    {"step", [](std::string& t, const TriaxialReport& r) { put(t, r.step); }},
    {"time", [](std::string& t, const TriaxialReport& r) { put(t, r.time); }},
    {"stage", [](std::string& t, const TriaxialReport& r) { put(t, r.stage); }},
    {"strain_x", [](std::string& t, const TriaxialReport& r) { put(t, r.strain[0]); }},
    {"strain_y", [](std::string& t, const TriaxialReport& r) { put(t, r.strain[1]); }},
    {"strain_z", [](std::string& t, const TriaxialReport& r) { put(t, r.strain[2]); }},
    {"strain_volume", [](std::string& t, const TriaxialReport& r) { put(t, r.strain_volume); }},
    {"strain_shear", [](std::string& t, const TriaxialReport& r) { put(t, r.strain_shear); }},
    {"solid_fraction", [](std::string& t, const TriaxialReport& r) { put(t, r.solid_fraction); }},
    {"stress_x", [](std::string& t, const TriaxialReport& r) { put(t, r.stress[0]); }},
    {"stress_y", [](std::string& t, const TriaxialReport& r) { put(t, r.stress[1]); }},
    {"stress_z", [](std::string& t, const TriaxialReport& r) { put(t, r.stress[2]); }},
    {"p", [](std::string& t, const TriaxialReport& r) { put(t, r.p); }},
    {"q", [](std::string& t, const TriaxialReport& r) { put(t, r.q); }},
    {"q_over_p", [](std::string& t, const TriaxialReport& r) { put(t, r.q_over_p); }},
    {"coordination", [](std::string& t, const TriaxialReport& r) { put(t, r.coordination); }},
    {"converged", [](std::string& t, const TriaxialReport& r) { put(t, r.converged); }},
};

constexpr Column<CellReport> cell_columns[] = {
    {"step", [](std::string& t, const CellReport& r) { put(t, r.step); }},
    {"time", [](std::string& t, const CellReport& r) { put(t, r.time); }},
    {"stage", [](std::string& t, const CellReport& r) { put(t, r.stage); }},
    {"edge_xx", [](std::string& t, const CellReport& r) { put(t, r.edges[0]); }},
    {"edge_yy", [](std::string& t, const CellReport& r) { put(t, r.edges[1]); }},
    {"edge_zz", [](std::string& t, const CellReport& r) { put(t, r.edges[2]); }},
    {"edge_xy", [](std::string& t, const CellReport& r) { put(t, r.edges[3]); }},
    {"edge_xz", [](std::string& t, const CellReport& r) { put(t, r.edges[4]); }},
    {"edge_yz", [](std::string& t, const CellReport& r) { put(t, r.edges[5]); }},
    {"stress_xx", [](std::string& t, const CellReport& r) { put(t, r.stress[0]); }},
    {"stress_yy", [](std::string& t, const CellReport& r) { put(t, r.stress[1]); }},
    {"stress_zz", [](std::string& t, const CellReport& r) { put(t, r.stress[2]); }},
    {"stress_xy", [](std::string& t, const CellReport& r) { put(t, r.stress[3]); }},
    {"stress_xz", [](std::string& t, const CellReport& r) { put(t, r.stress[4]); }},
    {"stress_yz", [](std::string& t, const CellReport& r) { put(t, r.stress[5]); }},
    {"kinetic_xx", [](std::string& t, const CellReport& r) { put(t, r.kinetic_stress[0]); }},
    {"kinetic_yy", [](std::string& t, const CellReport& r) { put(t, r.kinetic_stress[1]); }},
    {"kinetic_zz", [](std::string& t, const CellReport& r) { put(t, r.kinetic_stress[2]); }},
    {"kinetic_xy", [](std::string& t, const CellReport& r) { put(t, r.kinetic_stress[3]); }},
    {"kinetic_xz", [](std::string& t, const CellReport& r) { put(t, r.kinetic_stress[4]); }},
    {"kinetic_yz", [](std::string& t, const CellReport& r) { put(t, r.kinetic_stress[5]); }},
    {"p", [](std::string& t, const CellReport& r) { put(t, r.p); }},
    {"q", [](std::string& t, const CellReport& r) { put(t, r.q); }},
    {"q_over_p", [](std::string& t, const CellReport& r) { put(t, r.q_over_p); }},
    {"solid_fraction", [](std::string& t, const CellReport& r) { put(t, r.solid_fraction); }},
    {"contacts_a_grain", [](std::string& t, const CellReport& r) { put(t, r.contacts_a_grain); }},
    {"coordination", [](std::string& t, const CellReport& r) { put(t, r.coordination); }},
    {"inertial_number", [](std::string& t, const CellReport& r) { put(t, r.inertial_number); }},
    {"converged", [](std::string& t, const CellReport& r) { put(t, r.converged); }},
};

constexpr Column<ErrorRow> error_history_columns[] = {
    {"step", [](std::string& t, const ErrorRow& r) { put(t, r.step); }},
    {"iterations", [](std::string& t, const ErrorRow& r) { put(t, r.check.iterations); }},
    {"seconds", [](std::string& t, const ErrorRow& r) { put(t, r.check.seconds); }},
    {"error_rms", [](std::string& t, const ErrorRow& r) { put(t, r.check.error_rms); }},
};

template <class Row>
std::string header_line(std::span<const Column<Row>> columns) {
  std::string text;
  for (const auto& column : columns) {
    if (!text.empty()) text += ',';
    text += column.name;
  }
  return text + '\n';
}

template <class Row>
void append_line(std::string& text, std::span<const Column<Row>> columns, const Row& row) {
  for (const auto& column : columns) {
    column.append(text, row);
    text += ',';
  }
  text.back() = '\n';
}

}  // namespace

std::string steps_csv_header() {
  return header_line<StepReport>(steps_columns);
}
std::string walls_csv_header() {
  return header_line<WallRow>(walls_columns);
}
std::string bodies_csv_header() {
  return header_line<BodyRow>(bodies_columns);
}
std::string inserted_csv_header() {
  return header_line<InsertRow>(inserted_columns);
}
std::string removed_csv_header() {
  return header_line<RemoveRow>(removed_columns);
}
std::string triaxial_csv_header() {
  return header_line<TriaxialReport>(triaxial_columns);
}
std::string cell_csv_header() {
  return header_line<CellReport>(cell_columns);
}
std::string error_history_csv_header() {
  return header_line<ErrorRow>(error_history_columns);
}

void append_steps_row(std::string& text, const StepReport& report) {
  append_line<StepReport>(text, steps_columns, report);
}

void append_walls_row(std::string& text, const StepReport& report, const WallReport& wall) {
  append_line<WallRow>(text, walls_columns, WallRow{report, wall});
}

void append_bodies_row(std::string& text, const StepReport& report, const BodyReport& body) {
  append_line<BodyRow>(text, bodies_columns, BodyRow{report, body});
}

void append_inserted_row(std::string& text, const StepReport& report, const InsertReport& insert) {
  append_line<InsertRow>(text, inserted_columns, InsertRow{report, insert});
}

void append_removed_row(std::string& text, const StepReport& report, const RemoveReport& remove) {
  append_line<RemoveRow>(text, removed_columns, RemoveRow{report, remove});
}

void append_triaxial_row(std::string& text, const TriaxialReport& report) {
  append_line<TriaxialReport>(text, triaxial_columns, report);
}

void append_cell_row(std::string& text, const CellReport& report) {
  append_line<CellReport>(text, cell_columns, report);
}

void append_error_history_row(std::string& text, std::int64_t step, const ErrorCheck& check) {
  append_line<ErrorRow>(text, error_history_columns, ErrorRow{step, check});
}

CsvFile::CsvFile(const std::filesystem::path& path, std::string_view header)
    : file_(path, O_WRONLY | O_CREAT | O_TRUNC), pending_(header) {
  flush();
}

CsvFile::CsvFile(const std::filesystem::path& path, std::int64_t bytes)
    : file_(path, O_WRONLY | O_APPEND), bytes_(bytes) {
  file_.cut(bytes);
}

CsvFile::~CsvFile() {
  try {
    close();
  } catch (const FileError&) {
    // Nobody is left to be told; close() is the way to know.
  }
}

void CsvFile::flush() {
  if (pending_.empty()) return;
  // Emptied first: lines that failed are not tried again, lest half of them appear twice.
  const std::string lines = std::exchange(pending_, {});
  file_.write(lines);
  bytes_ += static_cast<std::int64_t>(lines.size());
}

std::int64_t CsvFile::sync() {
  flush();
  file_.sync();
  return bytes_;
}

void CsvFile::close() {
  flush();
  file_.close();
}

}  // namespace talus::io
