#include "runtime/step/field_grids.hpp"

#include <fmt/format.h>

#include "kernels/detection/touch.hpp"
#include "runtime/step/state.hpp"

namespace talus {

namespace {

Grid grid_of(const FieldRule& rule) {
  Grid grid{rule.low, rule.high - rule.low, rule.cells};
  for (std::size_t k = 0; k < 3; ++k)
    grid.spacing[static_cast<Eigen::Index>(k)] /= static_cast<double>(rule.cells[k]);
  return grid;
}

/// All that is no further from the grid than `reach` [m] along every axis.
Bounds around(const Grid& grid, const Vec3& reach) {
  const auto& [x, y, z] = grid.cells;
  const Vec3 cells(static_cast<double>(x), static_cast<double>(y), static_cast<double>(z));
  return {grid.low - reach, grid.low + grid.spacing.cwiseProduct(cells) + reach};
}

void spread_bodies(const StepState& state, SlotRange range, const Grid& grid, const Lucy& lucy,
                   GridSums& sums) {
  const Domain& domain = state.domain;
  const Bounds near = around(grid, Vec3::Constant(lucy.cutoff()));
  const Bodies& bodies = state.bodies;
  const ClumpView clumps = clumps_of(state);
  for (std::size_t s = range.begin; s < range.end; ++s) {
    if (!counts(state.decomposition, s)) continue;
    const Velocity v = whole_velocity(state.decomposition, bodies, s);
    const double radius = bodies.radius[s];
    const double volume =
        clumps.is_clump(s) ? clumps.of(s).volume * radius * radius * radius : sphere_mass(radius, 1);
    const double mass = v.inv_mass > 0 ? 1 / v.inv_mass : 0;
    domain.each_image_in(near, bodies.x[s], [&](const Vec3& edges, const Vec3& x) {
      add_grain(grid, lucy, {x, Vec3(v.u) + Domain::times(domain.rates, edges), mass, volume}, sums);
    });
  }
}

void spread_contacts(const StepState& state, SubdomainPlace e, double impulse_time, const Grid& grid,
                     const Lucy& lucy, GridSums& sums) {
  const Poses poses = poses_of(state);
  for (std::size_t c = 0; c < state.chunks.size(); ++c) {
    if (static_cast<std::size_t>(state.chunks.subdomain[c]) != e.at()) continue;
    const std::int32_t w = state.chunks.wall[c];
    const Wall* const wall = w < 0 ? nullptr : &state.walls[static_cast<std::size_t>(w)];
    const auto begin = static_cast<std::size_t>(state.chunks.begin[c]);
    for (std::size_t k = begin; k < begin + static_cast<std::size_t>(state.contacts.count[c]); ++k) {
      const Vec3 impulse = contact_impulse(state.contacts, k);
      if (impulse == Vec3::Zero()) continue;
      const Vec3& first = poses.x[static_cast<std::size_t>(state.contacts.first[k])];
      const Vec3 branch = branch_of(poses, state.contacts, k, wall);
      const Bounds near = around(grid, branch.cwiseAbs() + Vec3::Constant(lucy.cutoff()));
      const Mat3 moment = impulse / impulse_time * branch.transpose();
      state.domain.each_image_in(near, first, [&](const Vec3&, const Vec3& from) {
        add_contact(grid, lucy, {from, from - branch, moment}, sums);
      });
    }
  }
}

}  // namespace

std::string fault_of(const FieldRule& rule) {
  constexpr double most_cells = 1 << 26;
  double cells = 1;
  for (std::size_t k = 0; k < 3; ++k) {
    if (rule.cells[k] < 1) return "`cells` must be at least 1";
    cells *= static_cast<double>(rule.cells[k]);
  }
  if (!((rule.high - rule.low).minCoeff() > 0)) return "every number of `high` must exceed that of `low`";
  if (cells > most_cells)
    return fmt::format("makes {:.3g} cells, more than {:.0f}; give fewer `cells`", cells, most_cells);
  const double edge = grid_of(rule).spacing.maxCoeff();
  if (!(rule.width >= edge))
    return fmt::format(
        "a `width` of {} m is less than the edge of a cell, {} m; give more `cells` or a larger "
        "`width`",
        rule.width, edge);
  return "";
}

std::vector<FieldGrid> coarse_fields(std::span<const FieldRule> rules, const StepState& state,
                                     double impulse_time, const graph::Communicator& ranks) {
  const Decomposition& all = state.decomposition;
  std::vector<FieldGrid> fields;
  for (const FieldRule& rule : rules) {
    FieldGrid& field = fields.emplace_back();
    field.name = rule.name;
    field.grid = grid_of(rule);
    const Lucy lucy(rule.width);
    const std::size_t numbers = field.grid.size() * GridSums::width;
    if (ranks.rank() == 0) field.sums.numbers.assign(numbers, 0.0);
    for (const SubdomainId e : all.rank_of.indices()) {
      GridSums part;
      if (all.rank_of[e] == ranks.rank()) {
        const SubdomainPlace here = all.place_of(e);
        part.numbers.assign(numbers, 0.0);
        spread_bodies(state, all.several() ? all.slots_of(here) : SlotRange{0, state.bodies.size()},
                      field.grid, lucy, part);
        spread_contacts(state, here, impulse_time, field.grid, lucy, part);
      }
      std::size_t at = 0;
      ranks.records_to_first(std::span<const double>(part.numbers), [&](std::span<const double> piece) {
        for (const double number : piece) field.sums.numbers[at++] += number;
      });
    }
  }
  return fields;
}

}  // namespace talus
