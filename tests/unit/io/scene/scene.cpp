#include "io/scene/scene.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

#include "io/scene/bodies_file.hpp"
#include "io/scene/detail/spelling.hpp"
#include "tests/unit/io/scene/scene_text.hpp"

namespace talus::io::scene_test {
namespace {

// --- What is read
// ------------------------------------------------------------------------------------------------------------

TEST(Scene, BoxMakesSixWallsThatWallTablesChange) {
  const Scene scene = parse_scene(scene_with(), file);
  ASSERT_EQ(scene.setup.walls.size(), 6u);
  EXPECT_EQ(scene.setup.walls[0].name, "x-");
  EXPECT_EQ(scene.setup.walls[0].normal, Vec3(1, 0, 0));
  const Wall& lid = scene.setup.walls[5];
  EXPECT_EQ(lid.name, "z+");
  EXPECT_EQ(lid.normal, Vec3(0, 0, -1));
  EXPECT_EQ(lid.load.drive, WallDrive::pressure);
  EXPECT_EQ(lid.load.pressure, 1e4);
  EXPECT_TRUE(std::isnan(lid.point[2]));
  EXPECT_EQ(scene.output.directory, "out/small");
  EXPECT_EQ(scene.samples.front().radii.max, 0.01);
  EXPECT_EQ(scene.setup.stages[0].end.steps, 5);
}

TEST(Scene, StagesInheritStepGravityAndLawFromTheScene) {
  std::string text = scene_with("#material", "friction = 0.35\nwall_friction = 0.1\nrestitution = 0.5");
  text = replaced(text, "#top", "gravity = [0, 0, -9.81]\ntime_step = 2e-3");
  text += "[[stage]]\nfriction = 0\ngravity = [0, 0, 0]\nend = { time = 1 }\n";
  const Scene scene = parse_scene(text, file);
  const Stage& first = scene.setup.stages[0];
  const Stage& second = scene.setup.stages[1];
  EXPECT_EQ(first.time_step, 1e-3);
  EXPECT_EQ(first.laws.between(material_of_grains, material_of_grains).friction, 0.35);
  EXPECT_EQ(first.laws.between(material_of_grains, material_of_walls).friction, 0.1);
  EXPECT_EQ(first.laws.between(material_of_grains, material_of_grains).restitution, 0.5);
  EXPECT_EQ(first.gravity, Vec3(0, 0, -9.81));
  EXPECT_EQ(second.name, "stage-2");
  EXPECT_EQ(second.time_step, 2e-3);
  EXPECT_EQ(second.laws.between(material_of_grains, material_of_grains).friction, 0);
  EXPECT_EQ(second.laws.between(material_of_grains, material_of_walls).friction, 0.1);
  EXPECT_EQ(second.gravity, Vec3::Zero());
}

TEST(Scene, StageLoadsAreReadInOrder) {
  const Scene scene =
      parse_scene(scene_with("#tail",
                             "[[stage.load]]\nwall = \"z+\"\ndrive = \"velocity\"\nvelocity = [0, 0, -1]\n"
                             "[[stage.load]]\nwall = \"x+\"\ndrive = \"force\"\nforce = 3\nmass = 2"),
                  file);
  const auto& loads = scene.setup.stages[0].loads;
  ASSERT_EQ(loads.size(), 2u);
  EXPECT_EQ(loads[0].wall, "z+");
  EXPECT_EQ(loads[0].load.velocity, Vec3(0, 0, -1));
  EXPECT_EQ(loads[1].load.force, 3);
  EXPECT_EQ(loads[1].load.mass, 2);
}

TEST(Scene, ObliqueWallsAreGivenByNormalAndPoint) {
  const Scene scene = parse_scene(
      scene_with("#wall", "[[wall]]\nname = \"slope\"\nnormal = [3, 0, 4]\npoint = [1, 2, 3]"), file);
  const Wall& slope = scene.setup.walls.back();
  EXPECT_NEAR((slope.normal - Vec3(0.6, 0, 0.8)).norm(), 0, 1e-15);
  EXPECT_EQ(slope.point, Vec3(1, 2, 3));
}

TEST(Scene, AWallAlongAnAxisIsTheSameByNormalAndBySide) {
  const std::string by_side = replaced(scene_with(), "box = true", "");
  const std::string by_normal = replaced(
      by_side, "name = \"z+\"", "name = \"lid\"\nnormal = [0, 0, -0.3]\npoint = [7, 8, 2]\narea = 1");
  const Wall wall = parse_scene(by_normal, file).setup.walls[0];
  EXPECT_EQ(wall.normal, Vec3(0, 0, -1));
  EXPECT_EQ(wall.point, Vec3(0, 0, 2));
}

// --- Overrides
// ---------------------------------------------------------------------------------------------------------------

TEST(Overrides, ReachKeysElementsAndListEntries) {
  const Scene scene = parse_scene(scene_with("#top", "gravity = [0, 0, -9.81]"), file,
                                  {"solver.tolerance=1e-5", "stage.0.time_step=1e-4", "stage[0].friction=0.2",
                                   "stage.press.end={time=2}", "wall.z+.pressure=2e4", "gravity[2]=-1.62",
                                   "name=moon", "wall.x+.drive=velocity", "wall.x+.velocity=[-1, 0, 0]"});
  EXPECT_EQ(scene.setup.solver.tolerance, 1e-5);
  EXPECT_EQ(scene.setup.stages[0].time_step, 1e-4);
  EXPECT_EQ(scene.setup.stages[0].laws.between(material_of_grains, material_of_grains).friction, 0.2);
  EXPECT_FALSE(scene.setup.stages[0].end.steps);
  EXPECT_EQ(scene.setup.stages[0].end.time, 2);
  EXPECT_EQ(scene.setup.walls[5].load.pressure, 2e4);
  EXPECT_EQ(scene.setup.walls[1].load.velocity, Vec3(-1, 0, 0));
  EXPECT_EQ(scene.setup.stages[0].gravity, Vec3(0, 0, -1.62));
  EXPECT_EQ(scene.name, "moon");
}

TEST(Overrides, NameAStageWithoutANameAsTheRunDoes) {
  const std::string text = replaced(scene_with("#stage", "[[stage]]\ntime_step = 1e-3\nend = { steps = 1 }"),
                                    "name = \"press\"", "");
  const Scene scene = parse_scene(text, file, {"stage.stage-2.friction=0.5"});
  EXPECT_EQ(scene.setup.stages[1].name, "stage-2");
  EXPECT_EQ(scene.setup.stages[1].laws.between(material_of_grains, material_of_grains).friction, 0.5);
  EXPECT_EQ(scene.setup.stages[0].laws.between(material_of_grains, material_of_grains).friction, 0);
  EXPECT_NE(std::string(error_of(text, {"stage.shear.friction=1"}).what()).find("0 'stage-1', 1 'stage-2'"),
            std::string::npos);
  const std::string wall = replaced(scene_with(), "name = \"z+\"", "side = \"z+\"");
  EXPECT_NE(std::string(error_of(wall, {"wall.stage-1.pressure=1"}).what()).find("no element 'stage-1'"),
            std::string::npos)
      << "walls have no such names";
}

TEST(Decomposition, OfBoxesAloneHasThemAllAndNothingElse) {
  const auto read = [](const std::string& keys) {
    return parse_scene(scene_with("#tail", "[decomposition]\nboxes = [2, 3, 1]\n" + keys), file);
  };
  const Scene alone = read("");
  EXPECT_EQ(alone.setup.decomposition.subdomains, 6);
  EXPECT_EQ(alone.setup.decomposition.partitioner, PartitionKind::boxes);
  EXPECT_EQ(resolved_scene(parse_scene(resolved_scene(alone), file)), resolved_scene(alone));
  EXPECT_EQ(read("partitioner = \"fitted\"").setup.decomposition.partitioner, PartitionKind::fitted);
  EXPECT_EQ(read("subdomains = 6").setup.decomposition.subdomains, 6);
}

TEST(Scenes, WithoutANameHaveThatOfTheFileAsOneMayBeWritten) {
  EXPECT_EQ(parse_scene(replaced(scene_with(), "name = \"small\"", ""), "a b/tri axial.v2.toml", {}).name,
            "tri_axial_v2");
}

// --- Walls and masses that wait for the grains
// ----------------------------------------------------------------------------------

Sample two_grains() {
  Sample sample;
  sample.x = {Vec3(0.02, 0.02, 0.01), Vec3(0.05, 0.07, 0.03)};
  sample.radius = {0.01, 0.02};
  sample.density = 2600;
  return sample;
}

TEST(PlaceWalls, SidesStandAtTheBaseAndTheLidOnTheHighestGrain) {
  Scene scene =
      parse_scene(scene_with("#stage", "[[stage.load]]\nwall = \"x+\"\ndrive = \"force\"\nforce = 1"), file);
  const Sample grains = two_grains();
  place_walls(scene, grains);
  const auto& walls = scene.setup.walls;
  EXPECT_EQ(walls[0].point, Vec3(0, 0, 0));
  EXPECT_EQ(walls[1].point, Vec3(0.1, 0, 0));
  EXPECT_EQ(walls[3].point, Vec3(0, 0.1, 0));
  EXPECT_EQ(walls[4].point, Vec3(0, 0, 0));
  EXPECT_EQ(walls[5].point, Vec3(0, 0, 0.05));
  const double tenth = 0.1 * (mass(grains, 0) + mass(grains, 1));
  EXPECT_DOUBLE_EQ(walls[5].load.mass, tenth);
  EXPECT_DOUBLE_EQ(scene.setup.stages[0].loads[0].load.mass, tenth);
  EXPECT_EQ(walls[0].load.mass, 0);
}

TEST(PlaceWalls, GivenPositionsAndMassesStay) {
  Scene scene = parse_scene(scene_with("#wall", "position = 0.3\nmass = 7"), file);
  place_walls(scene, two_grains());
  EXPECT_EQ(scene.setup.walls[5].point[2], 0.3);
  EXPECT_EQ(scene.setup.walls[5].load.mass, 7);
}

TEST(PlaceWalls, RefusesGrainsBehindAWallAndNoGrains) {
  Scene scene = parse_scene(scene_with("#wall", "position = 0.02"), file);
  EXPECT_THROW(place_walls(scene, two_grains()), SceneError);
  EXPECT_THROW(place_walls(scene, Sample{}), SceneError);
}

// --- Resolved scene, reference, shipped scenes
// -----------------------------------------------------------------------------------

const char* const shipped[] = {"demo",          "pile-16k",   "compaction-16k", "triaxial-16k",
                               "triaxial-200k", "column-100", "replica-iso12k"};

std::string shipped_path(const std::string& name) {
  return TALUS_SOURCE_DIR "/apps/scenes/" + name + ".toml";
}

TEST(ResolvedScene, ReadsBackToTheSameScene) {
  for (const std::string name : shipped) {
    const Scene scene = load_scene(shipped_path(name));
    const std::string text = resolved_scene(scene);
    const Scene again = parse_scene(text, "elsewhere/scene.resolved.toml");
    EXPECT_EQ(resolved_scene(again), text);
    EXPECT_EQ(again.name, name);
    ASSERT_EQ(again.setup.walls.size(), scene.setup.walls.size());
    for (std::size_t k = 0; k < scene.setup.walls.size(); ++k) {
      EXPECT_EQ(again.setup.walls[k].name, scene.setup.walls[k].name);
      EXPECT_EQ(again.setup.walls[k].normal, scene.setup.walls[k].normal);
      EXPECT_EQ(again.setup.walls[k].velocity, scene.setup.walls[k].velocity);
      EXPECT_EQ(again.setup.walls[k].load.pressure, scene.setup.walls[k].load.pressure);
    }
    ASSERT_EQ(again.setup.stages.size(), scene.setup.stages.size());
    EXPECT_EQ(again.setup.stages.back().time_step, scene.setup.stages.back().time_step);
    EXPECT_EQ(again.setup.stages.back().laws.between(material_of_grains, material_of_grains).friction,
              scene.setup.stages.back().laws.between(material_of_grains, material_of_grains).friction);
    EXPECT_EQ(again.samples.front().count, scene.samples.front().count);
    EXPECT_EQ(again.samples.front().file, scene.samples.front().file);
  }
}

TEST(ResolvedScene, SpellsOutDefaultsAndKeepsPlacesBitForBit) {
  Scene scene = parse_scene(
      scene_with("#wall", "[[wall]]\nname = \"slope\"\nnormal = [1, 2, 3]\npoint = [-1, -0.1, 0]"), file);
  scene.description = "quotes \" and\nlines \\ and '''";
  place_walls(scene, two_grains());
  scene.setup.walls[5].point[2] = 0.1 + 0.2;
  const std::string text = resolved_scene(scene);
  EXPECT_NE(text.find("balance_tolerance = 0.05"), std::string::npos) << text;
  EXPECT_NE(text.find("alert = \"auto\"  # m"), std::string::npos) << text;
  const Scene again = parse_scene(text, file);
  EXPECT_EQ(again.description, scene.description);
  EXPECT_EQ(again.setup.walls[5].point[2], 0.1 + 0.2);
  EXPECT_EQ(again.setup.walls[5].load.mass, scene.setup.walls[5].load.mass);
  EXPECT_EQ(again.setup.walls[6].normal, scene.setup.walls[6].normal);
  EXPECT_EQ(resolved_scene(again), text);
}

TEST(ShippedScenes, ReplicaIsTheStateOfTheArchive) {
  Scene scene = load_scene(shipped_path("replica-iso12k"));
  const Sample sample = read_bodies(scene.samples.front().file, scene.density);
  Bodies bodies;
  append(sample, bodies);
  ASSERT_EQ(bodies.size(), 12000u);
  EXPECT_DOUBLE_EQ(bodies.velocity[0].u[0], -4.462695e-03);
  EXPECT_DOUBLE_EQ(bodies.velocity[0].w[2], 1.445077413e-02 * 5.163119e-01);
  place_walls(scene, sample);
  EXPECT_EQ(scene.setup.walls[1].velocity, Vec3(-0.0002423821, 0, 0));
  EXPECT_EQ(scene.setup.detection.alert, 2.00005e-4);
  EXPECT_EQ(scene.setup.detection.skin, 0);
}

TEST(SceneReference, DocsAreUpToDate) {
  std::ifstream in(TALUS_SOURCE_DIR "/docs/scenes.md");
  std::ostringstream text;
  text << in.rdbuf();
  EXPECT_EQ(text.str(), scene_reference()) << "write it again: talus scene-reference > docs/scenes.md";
}

TEST(SceneReference, ExampleIsAScene) {
  const std::string text = scene_reference();
  const std::size_t begin = text.find("```toml\n") + 8;
  EXPECT_NO_THROW(parse_scene(text.substr(begin, text.find("```", begin) - begin), file));
}

TEST(Spelling, CountsInsertionsReplacementsAndSwaps) {
  EXPECT_EQ(detail::edit_distance("friction", "friction"), 0u);
  EXPECT_EQ(detail::edit_distance("frction", "friction"), 1u);
  EXPECT_EQ(detail::edit_distance("firction", "friction"), 1u);
  EXPECT_EQ(detail::edit_distance("", "abc"), 3u);
  EXPECT_EQ(detail::nearest("zzzz", {"friction", "density"}), "");
}

}  // namespace
}  // namespace talus::io::scene_test
