#include "io/scene/detail/sample_keys.hpp"

#include <initializer_list>
#include <utility>

namespace talus::io::detail {

namespace {

using SampleKind = SampleSpec::Kind;
using RadiusKind = SizeDistribution::Kind;

auto is_kind(std::initializer_list<SampleKind> kinds) {
  return [kinds = std::vector<SampleKind>(kinds)](const SampleSpec& s) {
    return std::find(kinds.begin(), kinds.end(), s.kind) != kinds.end();
  };
}

auto is_drawn(std::initializer_list<RadiusKind> kinds) {
  return [kinds = std::vector<RadiusKind>(kinds)](const SizeDistribution& s) {
    return std::find(kinds.begin(), kinds.end(), s.kind) != kinds.end();
  };
}

/// What a sample is made of when it is neither read nor a single body.
std::vector<Key<SampleSpec>> making_keys() {
  using S = SampleSpec;
  const auto made = is_kind({SampleKind::deposition, SampleKind::lattice});
  const auto counted = is_kind({SampleKind::deposition, SampleKind::lattice, SampleKind::random});
  const auto lattice = is_kind({SampleKind::lattice});
  const std::string kinds = "kind is deposition or lattice",
                    counted_kinds = "kind is deposition, lattice or random";
  return {
      key<S>("count", "", countable,
             "Number of grains. A lattice may give `cells` instead, or fill its `region`.", &S::count)
          .only(counted_kinds, counted)
          .blank_when_zero()
          .or_else("none"),
      key<S>("base", "m", positive,
             "The sample stands on [0, base[0]] × [0, base[1]], counted from `origin`; goes with `count`.",
             &S::base)
          .only(kinds, made)
          .blank_when_zero()
          .or_else("none"),
      key<S>("origin", "m", any, "Lower corner of the sample, which stands on it.", &S::origin)
          .only(kinds, made)
          .blank_when_zero()
          .or_else("`[0.0, 0.0, 0.0]`"),
      key<S>("cells", "", countable, "Grains along x, y and z, instead of `count` and `base`.", &S::cells)
          .only("kind = lattice", lattice)
          .blank_when_zero()
          .or_else("none"),
      key<S>("spacing", "", at_least_one, "Distance of the centres over the largest diameter.", &S::spacing)
          .only("kind = lattice", lattice),
      key<S>("noise", "", zero_to_one,
             "Each grain is displaced at random, at most by this part of half the gap between two sites.",
             &S::noise)
          .only("kind = lattice", lattice),
      choice<S>("shape", body_shapes(), &S::shape)
          .only("kind is deposition, lattice, random or bodies",
                is_kind(
                    {SampleKind::deposition, SampleKind::lattice, SampleKind::random, SampleKind::bodies}))};
}

}  // namespace

std::vector<Key<SizeDistribution>> radius_keys() {
  using D = SizeDistribution;
  const auto bell = is_drawn({RadiusKind::normal, RadiusKind::lognormal});
  return {
      choice<D>(
          "radius_distribution",
          {"constant", "uniform", "uniform_volume", "normal", "lognormal", "sieve", "fractions"},
          "`uniform`: every radius is as likely; `uniform_volume`: every class of radii holds the same "
          "volume of grains; `normal` and `lognormal`: by number, cut at `radius_min` and `radius_max`; "
          "`sieve`: from a grading curve; `fractions`: a few radii.",
          &D::kind),
      key<D>("radius", "m", positive,
             "Radius of all grains: of the smallest sphere about its centre of mass that holds one.", &D::max)
          .only("radius_distribution = constant", is_drawn({RadiusKind::constant}))
          .need(),
      key<D>("radius_min", "m", positive, "Smallest radius.", &D::min)
          .only("uniform, uniform_volume, normal, lognormal",
                is_drawn({RadiusKind::uniform, RadiusKind::uniform_volume, RadiusKind::normal,
                          RadiusKind::lognormal}))
          .need(),
      key<D>("radius_max", "m", positive, "Largest radius.", &D::max)
          .only("uniform, uniform_volume, normal, lognormal",
                is_drawn({RadiusKind::uniform, RadiusKind::uniform_volume, RadiusKind::normal,
                          RadiusKind::lognormal}))
          .need(),
      key<D>("radius_mean", "m", positive, "Mean of the radii before they are cut; lognormal: their median.",
             &D::mean)
          .only("normal, lognormal", bell)
          .need(),
      key<D>("radius_deviation", "", positive,
             "Standard deviation of the radii [m] before they are cut; lognormal: that of their natural "
             "logarithm [1].",
             &D::deviation)
          .only("normal, lognormal", bell)
          .need(),
      key<D>("sieve_size", "m", positive, "Openings of the sieves, ascending: diameters.", &D::sizes)
          .only("radius_distribution = sieve", is_drawn({RadiusKind::sieve}))
          .need(),
      key<D>(
          "sieve_passing", "%", not_negative,
          "Part of the mass that passes each sieve, from 0 to 100. Between two sieves every class of radii "
          "holds the same mass.",
          &D::parts)
          .only("radius_distribution = sieve", is_drawn({RadiusKind::sieve}))
          .need(),
      key<D>("fraction_radius", "m", positive, "Radii that there are.", &D::sizes)
          .only("radius_distribution = fractions", is_drawn({RadiusKind::fractions}))
          .need(),
      key<D>("fraction_mass", "", positive, "Mass of the grains of each of these radii, in any unit.",
             &D::parts)
          .only("radius_distribution = fractions", is_drawn({RadiusKind::fractions}))
          .need(),
  };
}

Section<Region> region_keys() {
  const auto is = [](std::initializer_list<Region::Kind> kinds) {
    return [kinds = std::vector<Region::Kind>(kinds)](const Region& r) {
      return std::find(kinds.begin(), kinds.end(), r.kind) != kinds.end();
    };
  };
  using R = Region;
  using K = Region::Kind;
  return {"[sample.region]",
          "A part of space: the one that a lattice fills or random grains stand in (box), and likewise "
          "`[insert.region]`, where grains are put (box, cylinder, disc), `[remove.region]`, where they are "
          "taken away (box, cylinder, beyond), and `[probe.region]`, where they are looked at.",
          {choice<R>("shape", {"box", "cylinder", "disc", "beyond", "plane"},
                     "`box`: between two corners; `cylinder`: solid; `disc`: round, flat, centres lie on it; "
                     "`beyond`: all that lies behind a plane; `plane`: the plane.",
                     &R::kind)
               .need(),
           key<R>("low", "m", any, "Lower corner.", &R::low).only("shape = box", is({K::box})).need(),
           key<R>("high", "m", any, "Upper corner.", &R::high).only("shape = box", is({K::box})).need(),
           key<R>("start", "m", any, "Centre of the first end.", &R::start)
               .only("shape = cylinder", is({K::cylinder}))
               .need(),
           key<R>("end", "m", any, "Centre of the other end.", &R::end)
               .only("shape = cylinder", is({K::cylinder}))
               .need(),
           key<R>("centre", "m", any, "Centre.", &R::centre).only("shape = disc", is({K::disc})).need(),
           key<R>("axis", "", any, "Direction at right angles to the disc, of any length.", &R::axis)
               .only("shape = disc", is({K::disc})),
           key<R>("radius", "m", positive, "Radius.", &R::radius)
               .only("shape = cylinder or disc", is({K::cylinder, K::disc}))
               .need(),
           key<R>("point", "m", any, "A point of the plane.", &R::point)
               .only("shape = beyond or plane", is({K::beyond, K::plane}))
               .need(),
           key<R>("normal", "", any, "Direction out of the plane, of any length, to what lies beyond it.",
                  &R::normal)
               .only("shape = beyond or plane", is({K::beyond, K::plane}))
               .need()}};
}

Section<SampleSpec> sample_keys() {
  using S = SampleSpec;
  const auto made = [](const S& s) { return !s.from_file(); };
  const auto distributed = is_kind({SampleKind::deposition, SampleKind::lattice, SampleKind::random});
  auto material = bound<std::string, S>(
      "material", "", any, "Name of the grains' material.",
      [](S& sample, const std::string& name) { sample.material = name; },
      [](const S& s) { return s.material.empty() ? Value{} : Value{s.material}; });
  std::vector<Key<S>> keys = {
      choice<S>("kind", {"deposition", "lattice", "bodies", "state", "body", "random"},
                "Way of making the sample.", &S::kind)
          .need(),
      bound<std::string, S>(
          "name", "", any,
          "Name, unique among the samples. That of a body is needed: its path is written to bodies.csv.",
          [](S& sample, const std::string& name) { sample.name = name; },
          [](const S& s) { return s.name.empty() ? Value{} : Value{s.name}; })
          .or_else("none")};
  for (auto& making : making_keys()) keys.push_back(std::move(making));
  for (auto& drawn : within(radius_keys(), &S::radii)) {
    const auto applies = drawn.applies;
    const bool single = drawn.name == "radius";
    drawn.applies = [applies, single, made, distributed](const S& s) {
      return (single ? made(s) : distributed(s)) && (!applies || applies(s));
    };
    if (drawn.when.empty()) drawn.when = "kind is deposition, lattice or random";
    keys.push_back(std::move(drawn));
  }
  keys.push_back(key<S>("position", "m", any, "Centre of the body.", &S::position)
                     .only("kind = body", is_kind({SampleKind::body}))
                     .need());
  keys.push_back(key<S>("velocity", "m/s", any, "Velocity of all grains at the beginning.", &S::velocity)
                     .only("kind is not bodies or state", made)
                     .blank_when_zero()
                     .or_else("`[0.0, 0.0, 0.0]`"));
  keys.push_back(key<S>("angular_velocity", "rad/s", any,
                        "Angular velocity of all grains at the beginning. Clumps begin without.",
                        &S::angular_velocity)
                     .only("kind is not bodies or state", made)
                     .blank_when_zero()
                     .or_else("`[0.0, 0.0, 0.0]`"));
  keys.push_back(
      key<S>("file", "", any,
             "CSV file, or checkpoint or results.h5 of a run; a relative path begins at the folder "
             "of the scene.",
             &S::file)
          .only("kind = bodies or state", [](const S& s) { return s.from_file(); })
          .need());
  keys.push_back(key<S>("frame", "", not_negative, "Frame of a results.h5, from 0.", &S::frame)
                     .only("kind = state", is_kind({SampleKind::state}))
                     .or_else("the last"));
  keys.push_back(std::move(material).or_else("the first, or those that a column of `file` names"));
  return {
      "[sample]",
      "Where the grains come from; `[[sample]]`, as often as there are samples, where they come from "
      "several. `deposition` lays each grain in the lowest place with three supports, on the floor "
      "between the sides of `base` (Voivret et al. 2007); `lattice` is simple cubic; `bodies` reads a CSV "
      "file with the columns `id,x,y,z,radius`, then perhaps `vx,vy,vz`, then perhaps `wx,wy,wz` (m, m/s, "
      "rad/s), then perhaps `material`; with a `shape` they are clumps of these radii, which are turned at "
      "random and begin without rotation; `state` begins where a run was: spheres with their velocities, "
      "forces where contacts are, and walls of the same names that have no place of their own; `body` is "
      "one sphere; `random` puts `count` grains at random places of a box or of the periodic cell, each "
      "where it overlaps none, nor a grain of a sample before; samples behind it must leave it room. The "
      "largest come first, up to a solid fraction of about 0.35. A scene with an `[[insert]]` may do without "
      "any.",
      std::move(keys)};
}

}  // namespace talus::io::detail
