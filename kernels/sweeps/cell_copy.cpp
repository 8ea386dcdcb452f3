#include "kernels/sweeps/cell_copy.hpp"

#include "kernels/detection/measures.hpp"

namespace talus {

CellVelocity impulse_on_cell(const Contacts& contacts, ContactRange range) {
  CellVelocity sum{};
  for (std::size_t k = range.begin; k < range.end; ++k) {
    add_impulse(contact_impulse(contacts, k), contacts.reach[k] * contact_normal(contacts, k), sum);
  }
  return sum;
}

}  // namespace talus
