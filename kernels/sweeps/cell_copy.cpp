#include "kernels/sweeps/cell_copy.hpp"

#include "kernels/bodies/index.hpp"
#include "kernels/detection/measures.hpp"

namespace talus {

CellVelocity impulse_on_cell(const Contacts& contacts, ContactRange range) {
  CellVelocity sum{};
  for (std::size_t k = range.begin; k < range.end; ++k) {
    add_impulse(contact_impulse(contacts, k), contacts.reach[k] * contact_normal(contacts, k), sum);
  }
  return sum;
}

CellVelocity impulse_through_cell(const Contacts& contacts, ContactRange range,
                                  std::span<const double> radius, double length) {
  CellVelocity sum{};
  for (std::size_t k = range.begin; k < range.end; ++k) {
    const double reach = (radius[at(contacts.first[k])] + radius[at(contacts.second[k])]) / length;
    add_impulse(contact_impulse(contacts, k), reach * contact_normal(contacts, k), sum);
  }
  return sum;
}

}  // namespace talus
