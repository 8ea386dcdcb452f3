#include "io/scene/detail/cell_keys.hpp"

namespace talus::io::detail {

Section<CellSpec> cell_keys() {
  using C = CellSpec;
  return {
      "[cell]",
      "Space that repeats itself along x, y, z or some of them: a grain that leaves the cell comes in on the "
      "other side, and grains touch across its faces. There are no walls along these axes; along others "
      "there "
      "may be planes ([theory.md](theory.md), \"Periodic cells\").",
      {key<C>("lengths", "m", not_negative,
              "Edges of the cell along x, y, z, each at least twice the largest diameter and the distance at "
              "which contacts are looked for; 0: no repetition along that axis.",
              &C::lengths)
           .need(),
       key<C>("origin", "m", any, "Lower corner of the cell.", &C::origin)
           .blank_when_zero()
           .or_else("`[0.0, 0.0, 0.0]`"),
       key<C>(
           "shears", "m", any,
           "Of a sheared cell: by how much the upper face along y is displaced along x, that along z along "
           "x, and that along z along y.",
           &C::shears)
           .blank_when_zero()
           .or_else("`[0.0, 0.0, 0.0]`")}};
}

}  // namespace talus::io::detail
