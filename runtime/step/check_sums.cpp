#include "runtime/step/check_sums.hpp"

#include <algorithm>
#include <cstring>
#include <type_traits>

namespace talus {

namespace {

/// Head of a row as it is sent, all doubles; the vectors of impulses follow it.
struct CheckRow {
  double subdomain, residual2, residual_max2, impulse2, velocity2, contacts, active, jump2, jump_velocity2,
      work, exchanged, mass;
};
struct NumberRow {
  double subdomain, number;
};

template <class Row>
constexpr std::size_t width_of = sizeof(Row) / sizeof(double);

template <class Row>
void write_row(const Row& row, double* to) {
  static_assert(std::is_trivially_copyable_v<Row> && sizeof(Row) % sizeof(double) == 0);
  std::memcpy(to, &row, sizeof row);
}

template <class Row>
Row read_row(const double* from) {
  Row row;
  std::memcpy(&row, from, sizeof row);
  return row;
}

/// Of the bodies of a subdomain.
Exchanged exchanged_in(const StepState& state, SubdomainPlace place) {
  Exchanged sum;
  const Decomposition& all = state.decomposition;
  const auto [begin, end] = all.several() ? all.slots_of(place) : SlotRange{0, state.bodies.size()};
  for (std::size_t s = begin; s < end; ++s) {
    const Velocity& v = state.bodies.velocity[s];
    if (v.inv_mass == 0) continue;
    const double mass = 1 / v.inv_mass;
    double change2 = 0;
    for (std::size_t c = 0; c < 3; ++c)
      change2 += (v.u[c] - state.free.u[s][c]) * (v.u[c] - state.free.u[s][c]);
    sum.energy += 0.5 * mass * change2;
    sum.mass += mass;
  }
  return sum;
}

/// Where the row of each subdomain begins; a row's first number is its subdomain.
std::vector<const double*> by_subdomain(std::span<const double> rows, std::size_t width,
                                        std::int32_t subdomains) {
  std::vector<const double*> sorted(static_cast<std::size_t>(subdomains));
  for (std::size_t k = 0; k < rows.size(); k += width) sorted[static_cast<std::size_t>(rows[k])] = &rows[k];
  return sorted;
}

}  // namespace

std::size_t pushed_vectors(const StepState& state) {
  return state.walls.size() + (state.domain.repeats ? cell_freedoms / 3 : 0);
}

std::size_t check_row_width(std::size_t vectors) {
  return width_of<CheckRow> + 3 * vectors;
}

std::vector<double> check_rows(const StepState& state, const ChunkErrors& errors,
                               std::span<const JumpSums> jumps) {
  const auto& [sums, cell] = errors;
  const std::size_t width = check_row_width(pushed_vectors(state));
  const auto& here = state.decomposition.here;
  std::vector<double> rows(here.size() * width, 0.0);
  std::vector<ErrorSums> added(here.size());
  for (std::size_t c = 0; c < sums.size(); ++c) {
    const auto e = static_cast<std::size_t>(state.chunks.subdomain[c]);
    added[e].add(sums[c]);
    if (!cell.empty()) {
      double* const of_cell = &rows[(e + 1) * width - cell_freedoms];
      for (std::size_t k = 0; k < cell_freedoms; ++k) of_cell[k] += cell[c][k];
    }
    if (state.chunks.wall[c] < 0) continue;
    double* wall = &rows[e * width + width_of<CheckRow> + 3 * static_cast<std::size_t>(state.chunks.wall[c])];
    for (std::size_t k = 0; k < 3; ++k) wall[k] += sums[c].wall_impulse[k];
  }
  for (std::size_t e = 0; e < here.size(); ++e) {
    const JumpSums jump = jumps.empty() ? JumpSums{} : jumps[e];
    const ErrorSums& own = added[e];
    const Exchanged exchanged = exchanged_in(state, SubdomainPlace(e));
    write_row(CheckRow{.subdomain = static_cast<double>(here[SubdomainPlace(e)].value()),
                       .residual2 = own.residual2,
                       .residual_max2 = own.residual_max2,
                       .impulse2 = own.impulse2,
                       .velocity2 = own.velocity2,
                       .contacts = static_cast<double>(own.contacts),
                       .active = static_cast<double>(own.active),
                       .jump2 = jump.jump2,
                       .jump_velocity2 = jump.velocity2,
                       .work = own.work,
                       .exchanged = exchanged.energy,
                       .mass = exchanged.mass},
              &rows[e * width]);
  }
  return rows;
}

CheckSums add_check_rows(std::span<const double> rows, std::size_t vectors, std::int32_t subdomains) {
  CheckSums all;
  all.wall_impulse.assign(vectors, Vec3::Zero());
  std::int64_t fullest = 0;
  for (const double* from : by_subdomain(rows, check_row_width(vectors), subdomains)) {
    const auto row = read_row<CheckRow>(from);
    ErrorSums part;
    part.residual2 = row.residual2;
    part.residual_max2 = row.residual_max2;
    part.impulse2 = row.impulse2;
    part.velocity2 = row.velocity2;
    part.work = row.work;
    part.contacts = static_cast<std::int64_t>(row.contacts);
    part.active = static_cast<std::int64_t>(row.active);
    all.error.add(part);
    fullest = std::max(fullest, part.contacts);
    all.jump.jump2 += row.jump2;
    all.jump.velocity2 += row.jump_velocity2;
    all.exchanged.energy += row.exchanged;
    all.exchanged.mass += row.mass;
    for (std::size_t w = 0; w < vectors; ++w)
      all.wall_impulse[w] += Eigen::Map<const Vec3>(from + width_of<CheckRow> + 3 * w);
  }
  if (all.error.contacts > 0)
    all.imbalance = static_cast<double>(fullest) * subdomains / static_cast<double>(all.error.contacts) - 1;
  return all;
}

std::vector<double> number_rows(const StepState& state, std::span<const double> numbers) {
  constexpr std::size_t width = width_of<NumberRow>;
  const auto& here = state.decomposition.here;
  std::vector<double> added(here.size(), 0.0), rows(width * here.size());
  for (std::size_t c = 0; c < numbers.size(); ++c)
    added[static_cast<std::size_t>(state.chunks.subdomain[c])] += numbers[c];
  for (std::size_t e = 0; e < here.size(); ++e)
    write_row(NumberRow{static_cast<double>(here[SubdomainPlace(e)].value()), added[e]}, &rows[width * e]);
  return rows;
}

double add_number_rows(std::span<const double> rows, std::int32_t subdomains) {
  double sum = 0;
  for (const double* from : by_subdomain(rows, width_of<NumberRow>, subdomains))
    sum += read_row<NumberRow>(from).number;
  return sum;
}

}  // namespace talus
