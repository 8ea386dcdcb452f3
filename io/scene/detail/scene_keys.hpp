#pragma once

#include "io/scene/detail/loading_keys.hpp"
#include "io/scene/detail/motion_keys.hpp"
#include "io/scene/detail/scene_key.hpp"
#include "io/scene/scene.hpp"

namespace talus::io::detail {

/// The table of keys: the one place where a key is named, bound, limited and explained.
struct SceneKeys {
  Section<Scene> top, material;
  Section<MaterialSpec> named_material;
  Section<PairSpec> pair;
  Section<CellSpec> cell;
  Section<SampleSpec> sample;
  Section<Region> region;
  Section<InsertRule> insert;
  Section<RemoveRule> remove;
  Section<ProbeRule> probe;
  Section<FieldRule> field;
  Section<Wall> wall;
  Section<MotionPart> wall_motion;
  Section<WallGroup> group;
  Section<MotionPart> group_motion;
  Section<Stage> stage;
  Section<StressLoad> stage_stress;
  Section<StageEnd> stage_end;
  Section<StageLoad> stage_load;
  Section<PairSpec> stage_pair;
  Section<DetectionSettings> detection;
  Section<SolverSettings> solver;
  Section<DecompositionSettings> decomposition;
  Section<OutputSpec> output;
  Section<CheckpointSpec> checkpoint;
};

/// Calls f(section) for every section, in the order of the reference.
template <class Keys, class F>
void for_each_section(Keys&& keys, F&& f) {
  f(keys.top), f(keys.material), f(keys.named_material), f(keys.pair), f(keys.cell), f(keys.sample);
  f(keys.region), f(keys.insert), f(keys.remove), f(keys.probe), f(keys.field), f(keys.wall);
  f(keys.wall_motion), f(keys.group), f(keys.group_motion);
  f(keys.stage), f(keys.stage_stress), f(keys.stage_end), f(keys.stage_load), f(keys.stage_pair);
  f(keys.detection), f(keys.solver), f(keys.decomposition), f(keys.output), f(keys.checkpoint);
}

/// Top, output and checkpoint from scene_keys.cpp, the cell from cell_keys.cpp, samples and regions from
/// sample_keys.cpp, insertions and removals from grain_keys.cpp, probes and fields from probe_keys.cpp,
/// materials from material_keys.cpp, walls and stages from loading_keys.cpp, detection, solver and
/// decomposition from solver_keys.cpp.
const SceneKeys& scene_keys();

}  // namespace talus::io::detail
