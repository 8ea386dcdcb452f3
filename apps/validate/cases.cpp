#include "apps/validate/validation_case.hpp"

namespace talus::literature {

const Registry<std::string_view, CaseMaker>& cases() {
  static constexpr Case entries[] = {
      named("lattice", "a cubic lattice carries the stress of its cell exactly", lattice_case),
      named("free-cell", "an empty cell falls in as its mass says", free_cell_case),
      named("packing", "isotropic packing without friction", frictionless_packing_case),
      named("packing-sizes", "isotropic packing of two sizes, 1 : 1.4, without friction",
            packing_of_two_sizes_case),
      named("packing-0.3", "isotropic packing with friction 0.3", frictional_packing_case),
      named("shear-0", "slow shear without friction", frictionless_shear_case),
      named("critical-state", "slow shear with friction, from loose and from dense", critical_state_case),
      named("triaxial", "slow triaxial compression with friction 0.35, without walls", triaxial_case),
      named("rheology", "mu(I) and phi(I) with friction 0.4", rheology_case),
      named("forces", "distribution and anisotropies of forces at the critical state", forces_case),
      named("tolerance", "what a looser tolerance changes in slow shear", tolerance_case),
  };
  static constexpr Registry<std::string_view, CaseMaker> registry("case", entries);
  return registry;
}

}  // namespace talus::literature
