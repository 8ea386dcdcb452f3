#include "io/scene/detail/grain_keys.hpp"

#include <cmath>
#include <utility>

#include "io/scene/detail/sample_keys.hpp"

namespace talus::io::detail {

namespace {

std::vector<Key<RuleTimes>> rule_time_keys() {
  using T = RuleTimes;
  return {
      bound<std::string, T>(
          "stage", "", any,
          "Name of the only stage in which this happens; `from` and `until` then count from its beginning.",
          [](T& times, const std::string& stage) { times.stage = stage; },
          [](const T& times) { return times.stage.empty() ? Value{} : Value{times.stage}; })
          .or_else("all stages"),
      key<T>("from", "s", not_negative, "When it begins.", &T::from),
      bound<double, T>(
          "until", "s", positive, "When it ends.", [](T& times, double until) { times.until = until; },
          [](const T& times) { return std::isfinite(times.until) ? Value{times.until} : Value{}; })
          .or_else("the end of the run"),
      key<T>("interval", "s", not_negative,
             "Time between two occasions; 0: every step. Candidates are found anew whenever grains come or "
             "go: a longer interval saves time where they do in every step. What falls due behind the last "
             "occasion before `until` does not come.",
             &T::interval)};
}

template <class Rule>
void add_times(std::vector<Key<Rule>>& keys) {
  for (auto& times : within(rule_time_keys(), &Rule::times)) keys.push_back(std::move(times));
}

template <class Rule>
Key<Rule> name_key(const char* meaning) {
  return key<Rule>("name", "", any, meaning, &Rule::name);
}

/// Written and read beside the table of keys, as it names a material of the scene.
template <class Rule>
Key<Rule> material_key(const char* meaning) {
  return bound<std::string, Rule>(
      "material", "", any, meaning, [](Rule&, const std::string&) {}, [](const Rule&) { return Value{}; });
}

}  // namespace

Section<InsertRule> insert_keys() {
  using R = InsertRule;
  std::vector<Key<R>> keys = {
      name_key<R>("Name, unique among the insertions.").or_else("insert-1, insert-2, ..."),
      material_key<R>("Name of the grains' material.").or_else("the first")};
  for (auto& drawn : within(radius_keys(), &R::radii)) keys.push_back(std::move(drawn));
  keys.push_back(key<R>("count", "", countable, "No more grains than these in all.", &R::count));
  keys.push_back(key<R>("mass", "kg", sound_mass, "No more mass than this in all.", &R::mass));
  keys.push_back(
      key<R>("rate", "1/s", positive, "Grains a second; without a rate all come at once.", &R::rate));
  keys.push_back(key<R>("mass_rate", "kg/s", positive, "Mass a second, instead of `rate`.", &R::mass_rate));
  keys.push_back(key<R>("velocity", "m/s", any, "Velocity with which grains come.", &R::velocity));
  keys.push_back(key<R>("angular_velocity", "rad/s", any, "Angular velocity with which grains come.",
                        &R::angular_velocity));
  keys.push_back(key<R>("track", "", any,
                        "true: write the paths of its grains, of which there are few, to bodies.csv.",
                        &R::track));
  keys.push_back(key<R>("attempts", "", countable,
                        "Places that are tried for a grain in a step. One that finds no room waits, and is "
                        "tried again in the next step.",
                        &R::attempts));
  add_times(keys);
  return {
      "[[insert]]",
      "Spheres that come while the run goes on, each at a random place of `[insert.region]` where it "
      "overlaps "
      "nothing. `count`, `mass`, `rate` or `mass_rate` is needed: at once until so many are there, or at a "
      "rate until then, or without end. inserted.csv has what came, and how many wait for room.",
      std::move(keys)};
}

Section<RemoveRule> remove_keys() {
  using R = RemoveRule;
  std::vector<Key<R>> keys = {
      name_key<R>("Name, unique among the removals.").or_else("remove-1, remove-2, ..."),
      material_key<R>("Name of the only material of which grains go.").or_else("all"),
      key<R>("at", "s", not_negative, "Times at which it happens, ascending, instead of all the time.",
             &R::at)
          .or_else("always")};
  add_times(keys);
  return {
      "[[remove]]",
      "Grains that go: those whose centre is in `[remove.region]`. removed.csv counts them and their mass, "
      "for each material. The first of several rules takes a grain. Not in a periodic cell, where no "
      "grain can come either.",
      std::move(keys)};
}

}  // namespace talus::io::detail
