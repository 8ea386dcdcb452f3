#include "io/scene/detail/cell_keys.hpp"

#include <array>

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
              "Edges of the cell along x, y, z, each at least twice the sum of the largest diameter and the "
              "distance at which candidates are looked for (`alert` and `skin`); 0: no repetition along that "
              "axis.",
              &C::lengths)
           .need(),
       key<C>("origin", "m", any, "Lower corner of the cell, at most 1e9 of its edges away.", &C::origin)
           .blank_when_zero()
           .or_else("`[0.0, 0.0, 0.0]`"),
       key<C>(
           "shears", "m", any,
           "Of a sheared cell: by how much the upper face along y is displaced along x, that along z along "
           "x, and that along z along y; each at most twice the longer of its two edges.",
           &C::shears)
           .blank_when_zero()
           .or_else("`[0.0, 0.0, 0.0]`"),
       key<C>("inertia", "", positive,
              "Mass of a cell that follows a stress, over that of all grains: a larger one follows more "
              "slowly.",
              &C::inertia)}};
}

Section<StressLoad> stress_keys() {
  static constexpr std::array<const char*, 6> names = {"xx", "yy", "zz", "xy", "xz", "yz"};
  static constexpr std::array<const char*, 6> swings = {"amplitude_xx", "amplitude_yy", "amplitude_zz",
                                                        "amplitude_xy", "amplitude_xz", "amplitude_yz"};
  std::vector<Key<StressLoad>> keys;
  for (std::size_t k = 0; k < names.size(); ++k)
    keys.push_back(key<StressLoad>(
        names[k], "Pa", any,
        k < 3 ? "Component that the cell follows, positive where it pushes grains together; one that is not "
                "given is driven at its rate."
              : "Component that the cell follows, likewise: of the sign that contacts resist a shear with, "
                "so that "
                "a positive one shears towards negative rates.",
        [k](auto& load) -> auto& { return load.to[k]; }));
  keys.push_back(key<StressLoad>(
      "ramp_time", "s", not_negative,
      "Time in which they come, evenly, from what the stage before aimed at when it ended, in "
      "the first stage from the stress that the contacts of a state bear, or from 0 where there is neither.",
      &StressLoad::ramp_time));
  for (std::size_t k = 0; k < swings.size(); ++k)
    keys.push_back(key<StressLoad>(
                       swings[k], "Pa", any, "Swings about it, as a sine of the stage's time.",
                       [k](auto& load) -> auto& { return load.amplitude[k]; })
                       .blank_when_zero());
  keys.push_back(key<StressLoad>("period", "s", not_negative, "Of those swings.", &StressLoad::period)
                     .blank_when_zero());
  return {"[stage.stress]",
          "Of a periodic cell of spheres: components of the stress that its edges follow, each within the "
          "contact "
          "problem of the step, so that the stress of a step is that of its own solution "
          "([theory.md](theory.md), \"Cells under stress\"). Walls at both ends bound the axes that do not "
          "repeat.",
          std::move(keys)};
}

}  // namespace talus::io::detail
