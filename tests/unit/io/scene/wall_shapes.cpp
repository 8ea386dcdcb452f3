/// Walls that are no planes, as scenes say them.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <utility>

#include "io/files/stl.hpp"
#include "io/scene/scene.hpp"
#include "kernels/samples/sample.hpp"
#include "tests/unit/io/scene/scene_text.hpp"
#include "tests/unit/mesh_makers.hpp"

namespace talus::io {
namespace {

std::string scene_with_wall(const std::string& wall, const std::string& stage = "") {
  return scene_test::scene_with_wall(wall, "[[stage]]\ntime_step = 1e-3\nend = { steps = 1 }\n" + stage);
}

const std::string tube =
    "shape = \"cylinder\"\nstart = [0, 0, -1]\nend = [0, 0, 1]\nradius = 0.5\ninside = true";
const std::string cone =
    "shape = \"cone\"\nstart = [0, 0, -1]\nend = [0, 0, 1]\nstart_radius = 0\nend_radius = 0.5\ninside = "
    "true";
const std::string disc = "shape = \"disc\"\ncentre = [0, 0, -1]\naxis = [0, 0, 1]\nradius = 0.5";
const std::string rectangle =
    "shape = \"rectangle\"\ncorner = [0, 0, -1]\nedge_a = [1, 0, 0]\nedge_b = [0, 2, 0]";

std::string error_of(const std::string& text) {
  try {
    parse_scene(text, "test.toml", {});
  } catch (const SceneError& error) {
    return error.what();
  }
  return "";
}

void expect_refused(const std::string& text, const std::string& said) {
  const std::string error = error_of(text);
  EXPECT_NE(error.find(said), std::string::npos) << error << "\n" << text;
}

TEST(WallShapes, OfASceneAreMadeAndWrittenBack) {
  for (const std::string& wall : {tube, cone, disc, rectangle}) {
    const Scene scene = parse_scene(scene_with_wall(wall), "test.toml", {});
    ASSERT_EQ(scene.setup.walls.size(), 1u);
    const Wall& read = scene.setup.walls[0];
    ASSERT_NE(read.surface(), nullptr) << wall;
    const Scene again = parse_scene(resolved_scene(scene), "test.toml", {});
    ASSERT_NE(again.setup.walls[0].surface(), nullptr) << wall;
    for (const Vec3& x : {Vec3(0.1, 0.2, 0.3), Vec3(-2, 0, 1)}) {
      EXPECT_EQ(again.setup.walls[0].surface()->at(x, 0).distance, read.surface()->at(x, 0).distance) << wall;
    }
  }
}

TEST(WallShapes, PlanesHaveNone) {
  const Scene scene = parse_scene(scene_with_wall("shape = \"plane\"\nside = \"z-\""), "test.toml", {});
  EXPECT_EQ(scene.setup.walls[0].surface(), nullptr);
  EXPECT_EQ(scene.setup.walls[0].normal, Vec3::UnitZ());
}

TEST(WallShapes, KeysOfAnotherShapeAreRefused) {
  expect_refused(scene_with_wall(disc + "\nend_radius = 1"), "has a meaning only with: shape = cone");
  expect_refused(scene_with_wall(disc + "\nnormal = [0, 0, 1]"), "has a meaning only with: shape = plane");
  expect_refused(scene_with_wall("side = \"z-\"\nradius = 1"), "shape = disc or cylinder");
  expect_refused(scene_with_wall("shape = \"disc\"\naxis = [0, 0, 1]\nradius = 1"), "wall[0].centre");
  expect_refused(scene_with_wall("shape = \"blob\""), "'blob' is not one of the choices");
}

TEST(WallShapes, ValuesThatMakeNoSurfaceAreRefusedByName) {
  expect_refused(scene_with_wall("shape = \"disc\"\ncentre = [0, 0, 0]\naxis = [0, 0, 0]\nradius = 1"),
                 "wall 'w': axis must not be zero");
}

TEST(WallShapes, OnlyPlanesAreDrivenOrPushed) {
  const std::string said = "only planes can be driven or pushed; a wall with shape = \"disc\" is moved by";
  expect_refused(scene_with_wall(disc + "\ndrive = \"velocity\"\nvelocity = [0, 0, 1]"), said);
  expect_refused(scene_with_wall(disc, "[[stage.load]]\nwall = \"w\"\ndrive = \"force\"\nforce = 1\n"), said);
}

TEST(WallShapes, AGrainInsideASolidIsRefused) {
  Scene scene =
      parse_scene(scene_with_wall("shape = \"cylinder\"\nstart = [0, 0, -1]\nend = [0, 0, 1]\nradius = 0.5"),
                  "test.toml", {});
  Sample sample;
  sample.density = 2600;
  sample.radius = {0.01};
  sample.x = {Vec3(0.1, 0, 0)};
  EXPECT_THROW(place_walls(scene, sample), SceneError);
  sample.x = {Vec3(0.6, 0, 0)};
  EXPECT_NO_THROW(place_walls(scene, sample));
}

TEST(WallShapes, AGrainDeepInTheSolidOfAMeshIsRefusedAndOneOnTheRightSideIsNot) {
  const std::string path = (std::filesystem::temp_directory_path() / "talus_wall_shapes_box.stl").string();
  std::ofstream(path) << io::stl_text(test::box_mesh({0, 0, 0}, {1, 1, 1}, 2));
  const std::string mesh = "shape = \"mesh\"\nfile = \"" + path + "\"\n";
  Sample sample;
  sample.density = 2600;
  sample.radius = {0.01};
  const auto refusal = [&](const std::string& inside, const Vec3& x) -> std::string {
    Scene scene = parse_scene(scene_with_wall(mesh + "inside = " + inside), "test.toml", {});
    sample.x = {x};
    try {
      place_walls(scene, sample);
    } catch (const SceneError& error) {
      return error.what();
    }
    return "";
  };
  const Vec3 in(0.5, 0.25, 0.4), out(0.5, 0.25, 1.4);
  EXPECT_EQ(refusal("true", in), "");
  EXPECT_EQ(refusal("false", out), "");
  for (const auto& [inside, x] : {std::pair{"false", in}, std::pair{"true", out}}) {
    const std::string said = refusal(inside, x);
    EXPECT_NE(said.find("test.toml"), std::string::npos) << said;
    EXPECT_NE(said.find("the centre of grain 0 lies"), std::string::npos) << said;
    EXPECT_NE(said.find("behind wall 'w'"), std::string::npos) << said;
    EXPECT_NE(said.find("`inside`"), std::string::npos) << said;
  }
  std::filesystem::remove(path);
}

TEST(WallShapes, AMeshIsReadFromItsFileAndRefusedByItsName) {
  const std::string path = (std::filesystem::temp_directory_path() / "talus_wall_shapes.stl").string();
  std::ofstream(path) << "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
                         "endloop\nendfacet\nendsolid\n";
  expect_refused(scene_with_wall("shape = \"mesh\"\nfile = \"" + path + "\""),
                 path + ": the surface is open at an edge of triangle 1");
  std::filesystem::remove(path);
  expect_refused(scene_with_wall("shape = \"mesh\"\nfile = \"" + path + "\""), path + ": cannot be opened");
}

}  // namespace
}  // namespace talus::io
