#include "io/results/column_dictionary.hpp"

#include <nlohmann/json.hpp>

namespace talus::io {
namespace {

constexpr std::string_view step_text = "time steps done, from 1";
constexpr std::string_view time_text = "time at the end of the step";

constexpr ColumnMeaning steps_meaning[] = {
    {"step", "1", step_text},
    {"time", "s", time_text},
    {"time_step", "s", "length of the step"},
    {"candidates", "1", "pairs kept by the broad phase"},
    {"contacts", "1", "pairs within the alert distance"},
    {"active", "1", "contacts with a normal impulse"},
    {"iterations", "1", "sweeps"},
    {"error_rms", "1", "natural map of all contacts, rms, over the velocity scale of the step"},
    {"error_max", "1", "that of the worst contact"},
    {"error_quantile", "1",
     "residual that a share solver.quantile of the contacts does not exceed; 0 unless asked for"},
    {"worst_contact_body", "1", "id of the first body of the worst contact of a step that missed, else -1"},
    {"worst_contact_with", "1", "id of the second, -(1 + k) at wall k; else -1"},
    {"worst_body", "1",
     "id of the body whose velocity its contacts would change most in a step that missed, else 0"},
    {"worst_body_error", "1", "by how much, over the velocity scale; else 0"},
    {"balance", "1",
     "estimated error of forces on walls, heavy bodies and cuts, or momentum defect, if larger"},
    {"jump", "1", "interface jump of velocities; 0 with one subdomain"},
    {"penetration_mean", "1", "mean overlap over the smallest radius"},
    {"penetration_max", "1", "largest overlap over the smallest radius"},
    {"overlap", "1", "largest overlap that the run has made, over the smaller radius of the pair"},
    {"overlap_body", "1", "id of the first body of that pair where it is beyond its tolerance, else -1"},
    {"overlap_with", "1", "id of the second, -(1 + k) at wall k; else -1"},
    {"kinetic_translation", "J", "kinetic energy of translation of the grains"},
    {"kinetic_rotation", "J", "kinetic energy of rotation of the grains"},
    {"solid_fraction", "1", "volume of grains over that of the box; 0 where walls close none"},
    {"equilibrium", "1", "distance from equilibrium; inf without a load"},
    {"migrants", "1", "bodies new in a subdomain"},
    {"imbalance", "1", "largest over mean work of the subdomains"},
    {"wall_s", "s", "elapsed time of the step; differs from run to run"},
    {"converged", "1", "1: within all tolerances; 0: the step missed one"},
};

constexpr ColumnMeaning walls_meaning[] = {
    {"step", "1", step_text},
    {"time", "s", time_text},
    {"wall", "", "name of the wall or group"},
    {"position", "m", "normal times point of a plane, else 0"},
    {"velocity", "m/s", "velocity of a plane along its normal, else 0"},
    {"force_x", "N", "force on the grains, mean over the step, x"},
    {"force_y", "N", "the same, y"},
    {"force_z", "N", "the same, z"},
    {"torque_x", "N m", "torque on the grains about the wall's own point, mean over the step, x"},
    {"torque_y", "N m", "the same, y"},
    {"torque_z", "N m", "the same, z"},
    {"work", "J", "work done on the grains since the run began"},
};

constexpr ColumnMeaning bodies_meaning[] = {
    {"step", "1", step_text},
    {"time", "s", time_text},
    {"body", "", "name of the body"},
    {"x", "m", "centre at the end of the step, x"},
    {"y", "m", "the same, y"},
    {"z", "m", "the same, z"},
    {"vx", "m/s", "velocity of the centre, x"},
    {"vy", "m/s", "the same, y"},
    {"vz", "m/s", "the same, z"},
    {"wx", "rad/s", "angular velocity, x"},
    {"wy", "rad/s", "the same, y"},
    {"wz", "rad/s", "the same, z"},
    {"force_x", "N", "force of its contacts on the body, mean over the step, x"},
    {"force_y", "N", "the same, y"},
    {"force_z", "N", "the same, z"},
};

constexpr ColumnMeaning inserted_meaning[] = {
    {"step", "1", step_text},
    {"time", "s", time_text},
    {"insert", "", "name of the insertion"},
    {"placed", "1", "grains that came since the beginning"},
    {"mass", "kg", "mass of these"},
    {"waiting", "1", "grains that are due and have found no room yet"},
    {"no_room", "1", "steps in which a grain found none"},
};

constexpr ColumnMeaning removed_meaning[] = {
    {"step", "1", step_text},
    {"time", "s", time_text},
    {"remove", "", "name of the removal"},
    {"material", "", "name of the material; empty where materials have none"},
    {"count", "1", "grains that went since the beginning"},
    {"mass", "kg", "mass of these"},
};

constexpr ColumnMeaning triaxial_meaning[] = {
    {"step", "1", step_text},
    {"time", "s", time_text},
    {"stage", "", "name of the stage"},
    {"strain_x", "1", "logarithmic strain since the stage began, negative in compression, x"},
    {"strain_y", "1", "the same, y"},
    {"strain_z", "1", "the same, z"},
    {"strain_volume", "1", "volume strain since the stage began"},
    {"strain_shear", "1", "shear strain since the stage began"},
    {"solid_fraction", "1", "volume of grains over that of the box"},
    {"stress_x", "Pa", "normal stress, positive in compression, x"},
    {"stress_y", "Pa", "the same, y"},
    {"stress_z", "Pa", "the same, z"},
    {"p", "Pa", "mean stress"},
    {"q", "Pa", "axial minus mean lateral stress"},
    {"q_over_p", "1", "their ratio"},
    {"coordination", "1", "active contacts per grain, without rattlers"},
    {"converged", "1", "1: the step is within all tolerances; 0: it missed one"},
};

constexpr ColumnMeaning errors_meaning[] = {
    {"step", "1", step_text},
    {"iterations", "1", "sweeps done at the check"},
    {"seconds", "s", "elapsed since the iterations of the step began; differs from run to run"},
    {"error_rms", "1", "natural map of all contacts, rms, over the velocity scale of the step"},
};

constexpr TableMeaning dictionary[] = {
    {"steps.csv", steps_meaning},          {"walls.csv", walls_meaning},
    {"bodies.csv", bodies_meaning},        {"inserted.csv", inserted_meaning},
    {"removed.csv", removed_meaning},      {"triaxial.csv", triaxial_meaning},
    {"error_history.csv", errors_meaning},
};

}  // namespace

std::span<const TableMeaning> column_dictionary() {
  return dictionary;
}

std::string columns_json() {
  nlohmann::ordered_json tables;
  for (const TableMeaning& table : dictionary)
    for (const ColumnMeaning& column : table.columns)
      tables[std::string(table.file)].push_back(
          {{"name", column.name}, {"unit", column.unit}, {"meaning", column.meaning}});
  return tables.dump(2) + '\n';
}

}  // namespace talus::io
