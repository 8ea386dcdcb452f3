#include "io/scene/detail/scene_keys.hpp"

#include <cctype>
#include <string>
#include <utility>
#include <vector>

#include "io/scene/detail/loading_keys.hpp"
#include "io/scene/detail/material_keys.hpp"
#include "io/scene/detail/solver_keys.hpp"

namespace talus::io::detail {

namespace {

Section<Scene> top_keys() {
  auto box = bound<bool, Scene>(
      "box", "", any,
      "true: six fixed walls around the sample, named x-, x+, y-, y+, z-, z+; a [[wall]] with one of these "
      "names changes that "
      "wall. The resolved scene lists them instead.",
      [](Scene& scene, bool wanted) {
        for (std::size_t side = 0; wanted && side < sides().size(); ++side)
          scene.setup.walls.push_back(wall_at_side(side));
      },
      [](const Scene&) -> Value { return false; });
  const auto chooses = [](const Scene& s) { return s.common.chooses_time_step; };
  return {
      "",
      "At the top of the file, before the first table.",
      {
          key<Scene>("name", "", any, "Short name: title of pictures, folder of the results.", &Scene::name)
              .or_else("name of the file"),
          key<Scene>("description", "", any, "What the scene is for.", &Scene::description),
          key<Scene>(
              "seed", "", not_negative, "Seed of everything random.",
              [](auto& s) -> auto& { return s.setup.seed; }),
          key<Scene>(
              "rotation", "", any, "false: grains slide and do not turn.",
              [](auto& s) -> auto& { return s.setup.rotation; }),
          key<Scene>(
              "orientation", "", any, "true: integrate and write the orientations of the grains.",
              [](auto& s) -> auto& { return s.setup.orientation; }),
          key<Scene>(
              "allow_unconverged", "", any,
              "true: steps that miss their tolerance are still marked, and the exit code is 0.",
              [](auto& s) -> auto& { return s.setup.allow_unconverged; }),
          time_step_key<Scene>(
              "Time step of the stages that give none.", [](auto& s) -> auto& { return s.common; })
              .blank_when_zero()
              .or_else("none: each stage gives its own"),
          key<Scene>(
              "time_step_max", "s", positive, "Longest time step in the stages that give none.",
              [](auto& s) -> auto& { return s.common.time_step_max; })
              .or_auto(0, "from gravity")
              .only("time_step = \"auto\"", chooses),
          key<Scene>(
              "time_step_min", "s", positive, "Shortest time step in the stages that give none.",
              [](auto& s) -> auto& { return s.common.time_step_min; })
              .or_auto(0, "the longest over 1024")
              .only("time_step = \"auto\"", chooses),
          key<Scene>(
              "gravity", "m/s²", any, "Gravity in the stages that give none.",
              [](auto& s) -> auto& { return s.common.gravity; }),
          std::move(box),
      }};
}

Section<SampleSpec> sample_keys() {
  using Kind = SampleSpec::Kind;
  using Radii = SizeDistribution::Kind;
  const auto made = [](const SampleSpec& s) { return !s.from_file(); };
  const auto lattice = [](const SampleSpec& s) { return s.kind == Kind::lattice; };
  const auto one_size = [](const SampleSpec& s) { return !s.from_file() && s.radii.kind == Radii::constant; };
  const auto sizes = [](const SampleSpec& s) { return !s.from_file() && s.radii.kind != Radii::constant; };
  const std::string not_bodies = "kind is deposition or lattice";
  auto material = bound<std::string, SampleSpec>(
      "material", "", any, "Name of the grains' material.",
      [](SampleSpec& sample, const std::string& name) { sample.material = name; },
      [](const SampleSpec& s) { return s.material.empty() ? Value{} : Value{s.material}; });
  return {
      "[sample]",
      "Where the grains come from. `deposition` lays each grain in the lowest place with three supports, on "
      "z = 0 "
      "between the sides of `base` (Voivret et al. 2007); `lattice` is simple cubic; `bodies` reads a CSV "
      "file with the "
      "columns `id,x,y,z,radius`, then perhaps `vx,vy,vz`, then perhaps `wx,wy,wz` (m, m/s, rad/s), then "
      "perhaps `material`; `state` begins where a run was: spheres with their velocities, forces where "
      "contacts are, and walls of the same names that have no place of their own.",
      {
          choice<SampleSpec>("kind", {"deposition", "lattice", "bodies", "state"},
                             "Way of making the sample.", &SampleSpec::kind)
              .need(),
          key<SampleSpec>("count", "", countable, "Number of grains. A lattice may give `cells` instead.",
                          &SampleSpec::count)
              .only(not_bodies, made)
              .blank_when_zero()
              .or_else("none"),
          key<SampleSpec>("base", "m", positive,
                          "The sample stands on [0, base[0]] × [0, base[1]]; goes with `count`.",
                          &SampleSpec::base)
              .only(not_bodies, made)
              .blank_when_zero()
              .or_else("none"),
          key<SampleSpec>("cells", "", countable, "Grains along x, y and z, instead of `count` and `base`.",
                          &SampleSpec::cells)
              .only("kind = lattice", lattice)
              .blank_when_zero()
              .or_else("none"),
          key<SampleSpec>("spacing", "", at_least_one, "Distance of the centres over the largest diameter.",
                          &SampleSpec::spacing)
              .only("kind = lattice", lattice),
          choice<SampleSpec>("shape", body_shapes(), &SampleSpec::shape).only(not_bodies, made),
          choice<SampleSpec>(
              "radius_distribution", {"constant", "uniform", "uniform_volume"},
              "`uniform`: every radius is as likely; `uniform_volume`: every class of radii holds "
              "the same volume of grains.",
              [](auto& s) -> auto& { return s.radii.kind; })
              .only(not_bodies, made),
          key<SampleSpec>(
              "radius", "m", positive,
              "Radius of all grains: of the smallest sphere about its centre of mass that holds one.",
              [](auto& s) -> auto& { return s.radii.max; })
              .only("radius_distribution = constant", one_size)
              .need(),
          key<SampleSpec>(
              "radius_min", "m", positive, "Smallest radius.", [](auto& s) -> auto& { return s.radii.min; })
              .only("other distributions", sizes)
              .need(),
          key<SampleSpec>(
              "radius_max", "m", positive, "Largest radius.", [](auto& s) -> auto& { return s.radii.max; })
              .only("other distributions", sizes)
              .need(),
          key<SampleSpec>("file", "", any,
                          "CSV file, or checkpoint or results.h5 of a run; a relative path begins at the "
                          "folder of the scene.",
                          &SampleSpec::file)
              .only("kind = bodies or state", [](const SampleSpec& s) { return s.from_file(); })
              .need(),
          key<SampleSpec>("frame", "", not_negative, "Frame of a results.h5, from 0.", &SampleSpec::frame)
              .only("kind = state", [](const SampleSpec& s) { return s.kind == Kind::state; })
              .or_else("the last"),
          std::move(material).or_else("the first, or those that a column of `file` names"),
      }};
}

/// The registry's words as the reference says them.
template <class Item>
std::string sentence_of(const Item& item) {
  std::string sentence(item.sentence);
  sentence.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(sentence.front())));
  return sentence + ".";
}

/// A key for every output sink that is not always written.
std::vector<Key<OutputSpec>> sink_keys() {
  std::vector<Key<OutputSpec>> keys;
  for (const auto& sink : sink_registry()) {
    if (sink.make->use == SinkUse::always) continue;
    const std::string name(sink.name);
    keys.push_back(bound<bool, OutputSpec>(
        name.c_str(), "", any, sentence_of(sink).c_str(),
        [name](OutputSpec& output, bool wanted) {
          if (wanted)
            output.sinks.insert(name);
          else
            output.sinks.erase(name);
        },
        [name](const OutputSpec& output) -> Value { return output.sinks.contains(name); }));
  }
  return keys;
}

std::vector<Key<FrameFormat>> format_keys() {
  return {choice<FrameFormat>("precision", {"double", "single"},
                              "Of the reals of grains and contacts in results.h5. A state that another run "
                              "begins from is best kept in double.",
                              &FrameFormat::precision),
          key<FrameFormat>("compression", "", Range{.low = 0, .high = 9},
                           "How hard results.h5 is compressed (HDF5's shuffle and deflate); 0: not at all.",
                           &FrameFormat::compression),
          key<FrameFormat>("velocities", "", any, "false: results.h5 has no u and no omega.",
                           &FrameFormat::velocities),
          key<FrameFormat>("contact_geometry", "", any,
                           "false: of contacts, results.h5 has bodies and force alone.",
                           &FrameFormat::contact_geometry)};
}

Section<OutputSpec> output_keys() {
  std::vector<Key<OutputSpec>> keys = {
      key<OutputSpec>("directory", "", any, "Where results go, unless the command line says otherwise.",
                      &OutputSpec::directory)
          .or_else("out/NAME"),
      key<OutputSpec>("every", "s", positive, "Time between frames.", &OutputSpec::every),
      key<OutputSpec>("every_steps", "", at_least_one, "Steps between frames.", &OutputSpec::every_steps),
      key<OutputSpec>("stage_frames", "", any,
                      "A frame at the beginning and at the end of each stage, and where the run is stopped.",
                      &OutputSpec::stage_frames),
      key<OutputSpec>("contacts", "", any, "Write the contacts and their forces with each frame.",
                      &OutputSpec::contacts),
      key<OutputSpec>("contacts_every", "", countable,
                      "Contacts in each of so many frames only, from the first on.",
                      &OutputSpec::contacts_every)
          .only("contacts", [](const OutputSpec& o) { return o.contacts; }),
      key<OutputSpec>("tables_every", "", countable,
                      "Steps from line to line of walls.csv and triaxial.csv; steps.csv has all of them.",
                      &OutputSpec::tables_every)};
  for (auto& format_key : within(format_keys(), &OutputSpec::format)) keys.push_back(std::move(format_key));
  for (auto& sink_key : sink_keys()) keys.push_back(std::move(sink_key));
  return {"[output]", "What is written, and when. Frames come at the first of `every` and `every_steps`.",
          std::move(keys)};
}

Section<CheckpointSpec> checkpoint_keys() {
  using C = CheckpointSpec;
  return {
      "[checkpoint]",
      "When the run is written down, for `talus run --resume` ([checkpoints.md](checkpoints.md)): at the "
      "first of `every_wall`, `every` and `every_steps`, and when it is stopped.",
      {key<C>("every_wall", "s", not_negative, "Elapsed time between checkpoints; 0: never for that.",
              &C::every_wall),
       key<C>("every", "s", positive, "Simulated time between checkpoints.", &C::every),
       key<C>("every_steps", "", at_least_one, "Steps between checkpoints.", &C::every_steps),
       key<C>("keep", "", countable, "How many of the last checkpoints are kept.", &C::keep),
       key<C>("archive_every", "", at_least_one,
              "Each of so many checkpoints is kept for good, under a name of its own.", &C::archive_every)}};
}

}  // namespace

const SceneKeys& scene_keys() {
  static const SceneKeys keys = {
      top_keys(),           material_keys(),    named_material_keys(), pair_keys(),         sample_keys(),
      wall_keys(),          wall_motion_keys(), group_keys(),          group_motion_keys(), stage_keys(),
      stage_end_keys(),     stage_load_keys(),  stage_pair_keys(),     detection_keys(),    solver_keys(),
      decomposition_keys(), output_keys(),      checkpoint_keys()};
  return keys;
}

}  // namespace talus::io::detail
