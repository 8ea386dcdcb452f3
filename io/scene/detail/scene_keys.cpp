#include "io/scene/detail/scene_keys.hpp"

#include <cctype>
#include <string>
#include <utility>
#include <vector>

#include "io/scene/detail/cell_keys.hpp"
#include "io/scene/detail/grain_keys.hpp"
#include "io/scene/detail/loading_keys.hpp"
#include "io/scene/detail/material_keys.hpp"
#include "io/scene/detail/probe_keys.hpp"
#include "io/scene/detail/sample_keys.hpp"
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
      key<OutputSpec>(
          "tables_every", "", countable,
          "Steps from line to line of walls.csv, triaxial.csv and cell.csv, and of probes.csv where a probe "
          "says no more; steps.csv has all of them.",
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
      top_keys(),       material_keys(), named_material_keys(), pair_keys(),       cell_keys(),
      sample_keys(),    region_keys(),   insert_keys(),         remove_keys(),     probe_keys(),
      field_keys(),     wall_keys(),     wall_motion_keys(),    group_keys(),      group_motion_keys(),
      stage_keys(),     stress_keys(),   stage_end_keys(),      stage_load_keys(), stage_pair_keys(),
      detection_keys(), solver_keys(),   decomposition_keys(),  output_keys(),     checkpoint_keys()};
  return keys;
}

}  // namespace talus::io::detail
