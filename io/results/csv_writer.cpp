#include "io/results/csv_writer.hpp"

#include <iterator>
#include <span>

#include "io/files/detail/csv_cell.hpp"

namespace talus::io {
namespace {

using detail::put;

/// One column: what it is (ColumnMeaning) and how a row's value is written. The tables below drive the
/// header, the rows and columns.json.
template <class Row>
struct Column {
  std::string_view name, unit, meaning;
  void (*append)(std::string&, const Row&);
};

constexpr std::string_view step_text = "time steps done, from 1";
constexpr std::string_view time_text = "time at the end of the step";

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
    {"step", "1", step_text, [](std::string& t, const auto& r) { put(t, r.step); }},
    {"time", "s", time_text, [](std::string& t, const auto& r) { put(t, r.time); }},
    {"time_step", "s", "length of the step", [](std::string& t, const auto& r) { put(t, r.time_step); }},
    {"candidates", "1", "pairs kept by the broad phase",
     [](std::string& t, const auto& r) { put(t, r.candidates); }},
    {"contacts", "1", "pairs within the alert distance",
     [](std::string& t, const auto& r) { put(t, r.contacts); }},
    {"active", "1", "contacts with a normal impulse",
     [](std::string& t, const auto& r) { put(t, r.active); }},
    {"iterations", "1", "sweeps", [](std::string& t, const auto& r) { put(t, r.iterations); }},
    {"error_rms", "1", "natural map of all contacts, rms, over the velocity scale of the step",
     [](std::string& t, const auto& r) { put(t, r.error_rms); }},
    {"error_max", "1", "that of the worst contact",
     [](std::string& t, const auto& r) { put(t, r.error_max); }},
    {"error_quantile", "1",
     "residual that a share solver.quantile of the contacts does not exceed; 0 unless asked for",
     [](std::string& t, const auto& r) { put(t, r.error_quantile); }},
    {"worst_contact_body", "1", "id of the first body of the worst contact of a step that missed, else -1",
     [](std::string& t, const auto& r) { put(t, r.worst.contact.body); }},
    {"worst_contact_with", "1", "id of the second, -(1 + k) at wall k; else -1",
     [](std::string& t, const auto& r) { put(t, r.worst.contact.with); }},
    {"worst_body", "1",
     "id of the body whose velocity its contacts would change most in a step that missed, else 0",
     [](std::string& t, const auto& r) { put(t, r.worst.body); }},
    {"worst_body_error", "1", "by how much, over the velocity scale; else 0",
     [](std::string& t, const auto& r) { put(t, r.worst.body_error); }},
    {"balance", "1",
     "estimated error of forces on walls, heavy bodies and cuts, or momentum defect, if larger",
     [](std::string& t, const auto& r) { put(t, r.balance); }},
    {"velocity_error", "1",
     "estimated error of velocities in clusters that no direct solve takes, over what these exchange, with "
     "friction over the largest impulse of a wall if that is less, and 1 where nothing is known",
     [](std::string& t, const auto& r) { put(t, r.velocity_error); }},
    {"jump", "1", "interface jump of velocities; 0 with one subdomain",
     [](std::string& t, const auto& r) { put(t, r.jump); }},
    {"penetration_mean", "1", "mean overlap over the smallest radius",
     [](std::string& t, const auto& r) { put(t, r.penetration_mean); }},
    {"penetration_max", "1", "largest overlap over the smallest radius",
     [](std::string& t, const auto& r) { put(t, r.penetration_max); }},
    {"overlap", "1",
     "largest overlap with which the step ends that the run has made, over the smaller radius of the pair: "
     "of all pairs, contacts or not",
     [](std::string& t, const auto& r) { put(t, r.overlap); }},
    {"overlap_body", "1", "id of the first body of that pair where it is beyond its tolerance, else -1",
     [](std::string& t, const auto& r) { put(t, r.overlapping ? r.overlapping->body : -1); }},
    {"overlap_with", "1", "id of the second, -(1 + k) at wall k; else -1",
     [](std::string& t, const auto& r) { put(t, r.overlapping ? r.overlapping->with : -1); }},
    {"kinetic_translation", "J", "kinetic energy of translation of the grains",
     [](std::string& t, const auto& r) { put(t, r.kinetic_translation); }},
    {"kinetic_rotation", "J", "kinetic energy of rotation of the grains",
     [](std::string& t, const auto& r) { put(t, r.kinetic_rotation); }},
    {"solid_fraction", "1", "volume of grains over that of the box; 0 where walls close none",
     [](std::string& t, const auto& r) { put(t, r.solid_fraction); }},
    {"equilibrium", "1", "distance from equilibrium; inf where grains without a load move, or none is left",
     [](std::string& t, const auto& r) { put(t, r.equilibrium); }},
    {"migrants", "1", "bodies new in a subdomain", [](std::string& t, const auto& r) { put(t, r.migrants); }},
    {"imbalance", "1", "largest over mean work of the subdomains",
     [](std::string& t, const auto& r) { put(t, r.imbalance); }},
    {"wall_s", "s", "elapsed time of the step; differs from run to run",
     [](std::string& t, const auto& r) { put(t, r.wall_s); }},
    {"converged", "1", "1: within all tolerances; 0: the step missed one",
     [](std::string& t, const auto& r) { put(t, r.converged); }},
};

constexpr Column<WallRow> walls_columns[] = {
    {"step", "1", step_text, [](std::string& t, const auto& r) { put(t, r.step.step); }},
    {"time", "s", time_text, [](std::string& t, const auto& r) { put(t, r.step.time); }},
    {"wall", "", "name of the wall or group", [](std::string& t, const auto& r) { put(t, r.wall.name); }},
    {"position", "m", "normal times point of a plane, else 0",
     [](std::string& t, const auto& r) { put(t, r.wall.position); }},
    {"velocity", "m/s", "velocity of a plane along its normal, else 0",
     [](std::string& t, const auto& r) { put(t, r.wall.velocity); }},
    {"force_x", "N", "force on the grains, mean over the step, x",
     [](std::string& t, const auto& r) { put(t, r.wall.force.x()); }},
    {"force_y", "N", "the same, y", [](std::string& t, const auto& r) { put(t, r.wall.force.y()); }},
    {"force_z", "N", "the same, z", [](std::string& t, const auto& r) { put(t, r.wall.force.z()); }},
    {"torque_x", "N m", "torque on the grains about the wall's own point, mean over the step, x",
     [](std::string& t, const auto& r) { put(t, r.wall.torque.x()); }},
    {"torque_y", "N m", "the same, y", [](std::string& t, const auto& r) { put(t, r.wall.torque.y()); }},
    {"torque_z", "N m", "the same, z", [](std::string& t, const auto& r) { put(t, r.wall.torque.z()); }},
    {"work", "J", "work done on the grains since the run began",
     [](std::string& t, const auto& r) { put(t, r.wall.work); }},
};

constexpr Column<BodyRow> bodies_columns[] = {
    {"step", "1", step_text, [](std::string& t, const auto& r) { put(t, r.step.step); }},
    {"time", "s", time_text, [](std::string& t, const auto& r) { put(t, r.step.time); }},
    {"body", "", "name of the body", [](std::string& t, const auto& r) { put(t, r.body.name); }},
    {"x", "m", "centre at the end of the step, x",
     [](std::string& t, const auto& r) { put(t, r.body.x.x()); }},
    {"y", "m", "the same, y", [](std::string& t, const auto& r) { put(t, r.body.x.y()); }},
    {"z", "m", "the same, z", [](std::string& t, const auto& r) { put(t, r.body.x.z()); }},
    {"vx", "m/s", "velocity of the centre, x", [](std::string& t, const auto& r) { put(t, r.body.u.x()); }},
    {"vy", "m/s", "the same, y", [](std::string& t, const auto& r) { put(t, r.body.u.y()); }},
    {"vz", "m/s", "the same, z", [](std::string& t, const auto& r) { put(t, r.body.u.z()); }},
    {"wx", "rad/s", "angular velocity, x", [](std::string& t, const auto& r) { put(t, r.body.omega.x()); }},
    {"wy", "rad/s", "the same, y", [](std::string& t, const auto& r) { put(t, r.body.omega.y()); }},
    {"wz", "rad/s", "the same, z", [](std::string& t, const auto& r) { put(t, r.body.omega.z()); }},
    {"force_x", "N", "force of its contacts on the body, mean over the step, x",
     [](std::string& t, const auto& r) { put(t, r.body.force.x()); }},
    {"force_y", "N", "the same, y", [](std::string& t, const auto& r) { put(t, r.body.force.y()); }},
    {"force_z", "N", "the same, z", [](std::string& t, const auto& r) { put(t, r.body.force.z()); }},
};

constexpr Column<InsertRow> inserted_columns[] = {
    {"step", "1", step_text, [](std::string& t, const auto& r) { put(t, r.step.step); }},
    {"time", "s", time_text, [](std::string& t, const auto& r) { put(t, r.step.time); }},
    {"insert", "", "name of the insertion", [](std::string& t, const auto& r) { put(t, r.insert.name); }},
    {"placed", "1", "grains that came since the beginning",
     [](std::string& t, const auto& r) { put(t, r.insert.placed); }},
    {"mass", "kg", "mass of these", [](std::string& t, const auto& r) { put(t, r.insert.mass); }},
    {"waiting", "1", "grains that are due and have found no room yet",
     [](std::string& t, const auto& r) { put(t, r.insert.waiting); }},
    {"no_room", "1", "steps in which a grain found none",
     [](std::string& t, const auto& r) { put(t, r.insert.no_room); }},
};

constexpr Column<RemoveRow> removed_columns[] = {
    {"step", "1", step_text, [](std::string& t, const auto& r) { put(t, r.step.step); }},
    {"time", "s", time_text, [](std::string& t, const auto& r) { put(t, r.step.time); }},
    {"remove", "", "name of the removal", [](std::string& t, const auto& r) { put(t, r.remove.name); }},
    {"material", "", "name of the material; empty where materials have none",
     [](std::string& t, const auto& r) { put(t, r.remove.material); }},
    {"count", "1", "grains that went since the beginning",
     [](std::string& t, const auto& r) { put(t, r.remove.count); }},
    {"mass", "kg", "mass of these", [](std::string& t, const auto& r) { put(t, r.remove.mass); }},
};

constexpr Column<TriaxialReport> triaxial_columns[] = {
    {"step", "1", step_text, [](std::string& t, const auto& r) { put(t, r.step); }},
    {"time", "s", time_text, [](std::string& t, const auto& r) { put(t, r.time); }},
    {"stage", "", "name of the stage", [](std::string& t, const auto& r) { put(t, r.stage); }},
    {"strain_x", "1", "logarithmic strain since the stage began, negative in compression, x",
     [](std::string& t, const auto& r) { put(t, r.strain[0]); }},
    {"strain_y", "1", "the same, y", [](std::string& t, const auto& r) { put(t, r.strain[1]); }},
    {"strain_z", "1", "the same, z", [](std::string& t, const auto& r) { put(t, r.strain[2]); }},
    {"strain_volume", "1", "volume strain since the stage began",
     [](std::string& t, const auto& r) { put(t, r.strain_volume); }},
    {"strain_shear", "1", "shear strain since the stage began",
     [](std::string& t, const auto& r) { put(t, r.strain_shear); }},
    {"solid_fraction", "1", "volume of grains over that of the box",
     [](std::string& t, const auto& r) { put(t, r.solid_fraction); }},
    {"stress_x", "Pa", "normal stress, positive in compression, x",
     [](std::string& t, const auto& r) { put(t, r.stress[0]); }},
    {"stress_y", "Pa", "the same, y", [](std::string& t, const auto& r) { put(t, r.stress[1]); }},
    {"stress_z", "Pa", "the same, z", [](std::string& t, const auto& r) { put(t, r.stress[2]); }},
    {"p", "Pa", "mean stress", [](std::string& t, const auto& r) { put(t, r.p); }},
    {"q", "Pa", "axial minus mean lateral stress", [](std::string& t, const auto& r) { put(t, r.q); }},
    {"q_over_p", "1", "their ratio", [](std::string& t, const auto& r) { put(t, r.q_over_p); }},
    {"coordination", "1", "active contacts per grain, without rattlers",
     [](std::string& t, const auto& r) { put(t, r.coordination); }},
    {"converged", "1", "1: the step is within all tolerances; 0: it missed one",
     [](std::string& t, const auto& r) { put(t, r.converged); }},
};

constexpr Column<CellReport> cell_columns[] = {
    {"step", "1", step_text, [](std::string& t, const auto& r) { put(t, r.step); }},
    {"time", "s", time_text, [](std::string& t, const auto& r) { put(t, r.time); }},
    {"stage", "", "name of the stage", [](std::string& t, const auto& r) { put(t, r.stage); }},
    {"edge_xx", "m", "edge of the cell along x, 0 along an axis of walls",
     [](std::string& t, const auto& r) { put(t, r.edges[0]); }},
    {"edge_yy", "m", "edge of the cell along y, 0 along an axis of walls",
     [](std::string& t, const auto& r) { put(t, r.edges[1]); }},
    {"edge_zz", "m", "edge of the cell along z, 0 along an axis of walls",
     [](std::string& t, const auto& r) { put(t, r.edges[2]); }},
    {"edge_xy", "m", "by how much the edge along y leans along x",
     [](std::string& t, const auto& r) { put(t, r.edges[3]); }},
    {"edge_xz", "m", "by how much that along z leans along x",
     [](std::string& t, const auto& r) { put(t, r.edges[4]); }},
    {"edge_yz", "m", "by how much that along z leans along y",
     [](std::string& t, const auto& r) { put(t, r.edges[5]); }},
    {"stress_xx", "Pa", "stress of the contacts, symmetric part, positive in compression, xx",
     [](std::string& t, const auto& r) { put(t, r.stress[0]); }},
    {"stress_yy", "Pa", "stress of the contacts, symmetric part, positive in compression, yy",
     [](std::string& t, const auto& r) { put(t, r.stress[1]); }},
    {"stress_zz", "Pa", "stress of the contacts, symmetric part, positive in compression, zz",
     [](std::string& t, const auto& r) { put(t, r.stress[2]); }},
    {"stress_xy", "Pa", "stress of the contacts, symmetric part, positive in compression, xy",
     [](std::string& t, const auto& r) { put(t, r.stress[3]); }},
    {"stress_xz", "Pa", "stress of the contacts, symmetric part, positive in compression, xz",
     [](std::string& t, const auto& r) { put(t, r.stress[4]); }},
    {"stress_yz", "Pa", "stress of the contacts, symmetric part, positive in compression, yz",
     [](std::string& t, const auto& r) { put(t, r.stress[5]); }},
    {"kinetic_xx", "Pa", "stress of the velocities against the flow and their mean, xx",
     [](std::string& t, const auto& r) { put(t, r.kinetic_stress[0]); }},
    {"kinetic_yy", "Pa", "stress of the velocities against the flow and their mean, yy",
     [](std::string& t, const auto& r) { put(t, r.kinetic_stress[1]); }},
    {"kinetic_zz", "Pa", "stress of the velocities against the flow and their mean, zz",
     [](std::string& t, const auto& r) { put(t, r.kinetic_stress[2]); }},
    {"kinetic_xy", "Pa", "stress of the velocities against the flow and their mean, xy",
     [](std::string& t, const auto& r) { put(t, r.kinetic_stress[3]); }},
    {"kinetic_xz", "Pa", "stress of the velocities against the flow and their mean, xz",
     [](std::string& t, const auto& r) { put(t, r.kinetic_stress[4]); }},
    {"kinetic_yz", "Pa", "stress of the velocities against the flow and their mean, yz",
     [](std::string& t, const auto& r) { put(t, r.kinetic_stress[5]); }},
    {"p", "Pa", "mean stress of the contacts", [](std::string& t, const auto& r) { put(t, r.p); }},
    {"q", "Pa", "root of 3/2 of the squared deviator of the stress of the contacts",
     [](std::string& t, const auto& r) { put(t, r.q); }},
    {"q_over_p", "1", "their ratio; 0 without stress, negative in tension",
     [](std::string& t, const auto& r) { put(t, r.q_over_p); }},
    {"solid_fraction", "1", "volume of grains over that of the cell",
     [](std::string& t, const auto& r) { put(t, r.solid_fraction); }},
    {"contacts_a_grain", "1", "twice the active contacts over all grains",
     [](std::string& t, const auto& r) { put(t, r.contacts_a_grain); }},
    {"coordination", "1", "active contacts per grain, without rattlers",
     [](std::string& t, const auto& r) { put(t, r.coordination); }},
    {"fabric_xx", "1", "mean of n n over the contacts with a force, n their normals, xx",
     [](std::string& t, const auto& r) { put(t, r.fabric[0]); }},
    {"fabric_yy", "1", "mean of n n over the contacts with a force, n their normals, yy",
     [](std::string& t, const auto& r) { put(t, r.fabric[1]); }},
    {"fabric_zz", "1", "mean of n n over the contacts with a force, n their normals, zz",
     [](std::string& t, const auto& r) { put(t, r.fabric[2]); }},
    {"fabric_xy", "1", "mean of n n over the contacts with a force, n their normals, xy",
     [](std::string& t, const auto& r) { put(t, r.fabric[3]); }},
    {"fabric_xz", "1", "mean of n n over the contacts with a force, n their normals, xz",
     [](std::string& t, const auto& r) { put(t, r.fabric[4]); }},
    {"fabric_yz", "1", "mean of n n over the contacts with a force, n their normals, yz",
     [](std::string& t, const auto& r) { put(t, r.fabric[5]); }},
    {"a_c", "1", "anisotropy of the directions of contacts, along the stress",
     [](std::string& t, const auto& r) { put(t, r.a_c); }},
    {"a_n", "1", "anisotropy of normal forces, along the stress; 0 where forces pull on the whole",
     [](std::string& t, const auto& r) { put(t, r.a_n); }},
    {"a_t", "1", "the same of tangential forces; to first order q/p = 0.4 (a_c + a_n + 1.5 a_t)",
     [](std::string& t, const auto& r) { put(t, r.a_t); }},
    {"fabric_q_over_p", "1", "q/p that the three anisotropies make, their products included",
     [](std::string& t, const auto& r) { put(t, r.fabric_q_over_p); }},
    {"inertial_number", "1", "I = rate d (density/p)^1/2; inf where nothing presses",
     [](std::string& t, const auto& r) { put(t, r.inertial_number); }},
    {"converged", "1", "1: the step is within all tolerances; 0: it missed one",
     [](std::string& t, const auto& r) { put(t, r.converged); }},
};

constexpr Column<ErrorRow> error_history_columns[] = {
    {"step", "1", step_text, [](std::string& t, const auto& r) { put(t, r.step); }},
    {"iterations", "1", "sweeps done at the check",
     [](std::string& t, const auto& r) { put(t, r.check.iterations); }},
    {"seconds", "s", "elapsed since the iterations of the step began; differs from run to run",
     [](std::string& t, const auto& r) { put(t, r.check.seconds); }},
    {"error_rms", "1", "natural map of all contacts, rms, over the velocity scale of the step",
     [](std::string& t, const auto& r) { put(t, r.check.error_rms); }},
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
std::vector<ColumnMeaning> meanings(std::span<const Column<Row>> columns) {
  std::vector<ColumnMeaning> all;
  for (const auto& column : columns) all.push_back({std::string(column.name), column.unit, column.meaning});
  return all;
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

std::vector<TableMeaning> table_meanings() {
  return {{"steps.csv", meanings<StepReport>(steps_columns)},
          {"walls.csv", meanings<WallRow>(walls_columns)},
          {"bodies.csv", meanings<BodyRow>(bodies_columns)},
          {"inserted.csv", meanings<InsertRow>(inserted_columns)},
          {"removed.csv", meanings<RemoveRow>(removed_columns)},
          {"triaxial.csv", meanings<TriaxialReport>(triaxial_columns)},
          {"cell.csv", meanings<CellReport>(cell_columns)},
          {"error_history.csv", meanings<ErrorRow>(error_history_columns)}};
}

}  // namespace talus::io
