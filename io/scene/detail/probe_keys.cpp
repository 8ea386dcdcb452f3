#include "io/scene/detail/probe_keys.hpp"

namespace talus::io::detail {

Section<ProbeRule> probe_keys() {
  using P = ProbeRule;
  return {
      "[[probe]]",
      "A part of space that is looked at; probes.csv has a row for each probe and time. `[probe.region]` "
      "is a box or cylinder, whose contents are told; all beyond a plane, likewise, but for what needs "
      "a volume; or a disc or a plane: the grains whose centre goes through it, less those that go "
      "back. In a periodic cell all images of grains count; a plane across an axis that repeats is "
      "at right angles to it and counts once a cell, all beyond a plane is bounded along an axis of walls, "
      "and no surface counts in a cell whose "
      "edges move.",
      {key<P>("name", "", any, "Name, unique among the probes.", &P::name).or_else("probe-1, probe-2, ..."),
       key<P>("every", "s", positive, "Time between rows.", &P::every),
       key<P>("every_steps", "", countable, "Steps between rows; with `every` at the first of both.",
              &P::every_steps)
           .or_else("`output.tables_every`, without `every`")}};
}

Section<FieldRule> field_keys() {
  using F = FieldRule;
  return {
      "[[field]]",
      "Density, solid fraction, velocity, temperature and stress on a grid, by coarse graining, with "
      "every frame: fields/field_NAME_*.vti. In a periodic cell with all images.",
      {key<F>("name", "", any, "Name, unique among the fields.", &F::name).or_else("field-1, field-2, ..."),
       key<F>("low", "m", any, "Lower corner of the grid.", &F::low).need(),
       key<F>("high", "m", any, "Upper corner of the grid.", &F::high).need(),
       key<F>("cells", "", countable, "Cells along x, y and z.", &F::cells).need(),
       key<F>("width", "m", positive,
              "Width over which a grain is spread, at least the longest edge of a cell: the root of the "
              "mean square distance. Fields of a continuum show from about two diameters on.",
              &F::width)
           .need()}};
}

}  // namespace talus::io::detail
