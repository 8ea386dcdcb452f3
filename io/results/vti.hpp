#pragma once

#include "io/files/write_text.hpp"
#include "runtime/step/field_grids.hpp"

namespace talus::io {

/// Text of a .vti file (VTK ImageData) with the fields of `field` at the time [s], in 64-bit floats: cell
/// data density [kg/m^3], solid_fraction, velocity [m/s], temperature [m^2/s^2], contact_stress and
/// kinetic_stress [Pa] as 9 components, row after row. `out` gets it in order.
void write_field_vti(const FieldGrid& field, double time, const WriteText& out);

}  // namespace talus::io
