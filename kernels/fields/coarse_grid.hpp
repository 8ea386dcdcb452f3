#pragma once

/// Coarse graining (Goldhirsch 2010): mass, momentum and stress of grains as fields on a grid
/// (docs/theory.md, "Fields").

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "kernels/bodies/types.hpp"
#include "kernels/fields/lucy.hpp"

namespace talus {

/// Cells of one size; numbered with x first. Fields are those at the centres of the cells.
struct Grid {
  Vec3 low = Vec3::Zero();      ///< corner [m]
  Vec3 spacing = Vec3::Ones();  ///< edges of a cell [m]
  std::array<std::int64_t, 3> cells{};
  std::size_t size() const { return static_cast<std::size_t>(cells[0] * cells[1] * cells[2]); }
  double cell_volume() const { return spacing.prod(); }
};

/// Sums over grains and contacts at the centre of each cell, `width` numbers a cell in the order of Row.
struct GridSums {
  enum Row : std::size_t {
    density = 0,        ///< sum m phi [kg/m^3]
    volume = 1,         ///< sum V phi [1]
    momentum = 2,       ///< 3: sum m u phi [kg/(m^2 s)]
    momentum_flux = 5,  ///< 9: sum m u (x) u phi [Pa]
    contact = 14,       ///< 9: sum f (x) l x mean of phi along l [Pa]
    width = 23,
  };
  std::vector<double> numbers;
};

/// A grain to be spread.
struct SpreadGrain {
  Vec3 x = Vec3::Zero();  ///< [m]
  Vec3 u = Vec3::Zero();  ///< [m/s]
  double mass = 0;        ///< [kg]
  double volume = 0;      ///< [m^3]
};

/// A contact to be spread along its branch.
struct SpreadContact {
  Vec3 from = Vec3::Zero(), to = Vec3::Zero();  ///< ends of the branch [m]
  Mat3 moment = Mat3::Zero();                   ///< force (x) branch, positive in compression [N m]
};

/// Adds to `sums`, which has size() x width numbers. What a grain or contact adds is divided by the sum of
/// its weights over the centres of the grid continued without end: the sums over the cells of a grid that
/// holds all of it are then its own mass, momentum and moment to rounding, whatever the spacing. Where more
/// than 1e5 of these centres lie beyond the grid it is divided by the integral of the weights instead, so
/// that a branch of any length costs no more than 1e5 centres and the cells of the grid.
void add_grain(const Grid& grid, const Lucy& lucy, const SpreadGrain& grain, GridSums& sums);
void add_contact(const Grid& grid, const Lucy& lucy, const SpreadContact& contact, GridSums& sums);

/// The fields in one cell.
struct CellFields {
  double density = 0;  ///< [kg/m^3]
  double solid_fraction = 0;
  Vec3 velocity = Vec3::Zero();        ///< [m/s]; 0 where there is no mass
  double temperature = 0;              ///< [m^2/s^2]
  Mat3 contact_stress = Mat3::Zero();  ///< [Pa], positive in compression
  Mat3 kinetic_stress = Mat3::Zero();  ///< [Pa]
};
CellFields fields_of(const GridSums& sums, std::size_t cell);

}  // namespace talus
