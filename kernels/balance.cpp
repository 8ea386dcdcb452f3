#include "kernels/balance.hpp"

namespace talus {

double gained_energy(std::span<const Slot> slots, const FreeVelocity& free,
                     std::span<const Velocity> velocity, Multiplicities multiplicity) {
  double sum = 0;
  for (const Slot slot : slots) {
    const auto s = static_cast<std::size_t>(slot);
    const Velocity& v = velocity[s];
    double u2 = 0, w2 = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const double u = v.u[k] - free.u[s][k];
      u2 += u * u;
    }
    if (!free.w.empty())
      for (std::size_t k = 0; k < 3; ++k) {
        const double w = v.w[k] - free.w[s][k];
        w2 += w * w;
      }
    const double energy = u2 / v.inv_mass + (v.spin_mobility > 0 ? w2 / v.spin_mobility : 0);
    sum += multiplicity.empty() ? energy : energy / multiplicity[s];
  }
  return sum;
}

}  // namespace talus
