/// Walls that move, groups of them, and walls of some stages only, as scenes say them.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "io/scene/motion_file.hpp"
#include "io/scene/scene.hpp"
#include "tests/unit/io/scene/scene_text.hpp"

namespace talus::io::wall_motions_test {
namespace {

const std::string disc = "shape = \"disc\"\ncentre = [0, 0, -1]\naxis = [0, 0, 1]\nradius = 0.5\n";
const std::string turning = "kind = \"rotation\"\naxis = [0, 0, 2]\npoint = [1, 0, 0]\nrate = 3.5\n";

std::string scene_of(const std::string& wall, const std::string& more = "") {
  return scene_test::scene_with_wall(wall + more, R"([[stage]]
name = "first"
time_step = 1e-3
end = { time = 0.5 }
[[stage]]
name = "second"
time_step = 1e-3
end = { steps = 500 }
)");
}

class WallMotions : public ::testing::Test {
 protected:
  WallMotions() {
    folder_ = std::filesystem::temp_directory_path() /
              ("talus_motions_" + std::to_string(::testing::UnitTest::GetInstance()->random_seed()) + "_" +
               ::testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::create_directories(folder_);
  }
  ~WallMotions() override { std::filesystem::remove_all(folder_); }

  void table(const std::string& text) const { std::ofstream(folder_ / "way.csv") << text; }
  Scene parse(const std::string& text) const {
    return parse_scene(text, (folder_ / "scene.toml").string(), {});
  }
  void expect_refused(const std::string& text, const std::string& key, const std::string& said) const {
    try {
      parse(text);
      ADD_FAILURE() << "not refused: " << key;
    } catch (const SceneError& error) {
      EXPECT_EQ(error.key(), key) << error.what();
      EXPECT_NE(std::string(error.what()).find(said), std::string::npos) << error.what();
      EXPECT_GT(error.line(), 0) << error.what();
    }
  }
  std::filesystem::path folder_;
};

TEST_F(WallMotions, OfEveryKindAreReadAndWrittenBack) {
  table("t,x,y,z,angle\n0,1,1,1,0.5\n# a comment\n\n2,1,1,3,1.5\n");
  const std::string motions =
      "[[wall.motion]]\n" + turning +
      "from_stage = \"second\"\n"
      "[[wall.motion]]\nkind = \"velocity\"\nvelocity = [1, 2, 3]\nsurface_only = true\n"
      "[[wall.motion]]\nkind = \"oscillation\"\ndirection = [0, 0, 1]\namplitude = 0.1\n"
      "frequency = 5\nphase = 0.3\nuntil_stage = \"second\"\n"
      "[[wall.motion]]\nkind = \"table\"\nfile = \"way.csv\"\naxis = [1, 0, 0]\n"
      "point = [0, 0, 0]\n";
  const Scene scene = parse(scene_of(disc, motions));
  const Scene again = parse(resolved_scene(scene));
  for (const Scene* one : {&scene, &again}) {
    const std::vector<MotionPart>& parts = one->setup.walls[0].motion;
    ASSERT_EQ(parts.size(), 4u);
    EXPECT_EQ(parts[0].kind, MotionPart::Kind::rotation);
    EXPECT_EQ(parts[0].axis, Vec3::UnitZ()) << "of unit length";
    EXPECT_EQ(parts[0].rate, 3.5);
    EXPECT_EQ(parts[0].from_stage, "second");
    EXPECT_TRUE(parts[1].surface_only);
    EXPECT_EQ(parts[2].until_stage, "second");
    ASSERT_NE(parts[3].table, nullptr);
    EXPECT_EQ(parts[3].table->shift[1], Vec3(0, 0, 2)) << "since the first row";
    EXPECT_EQ(parts[3].table->angle[1], 1);
  }
  EXPECT_EQ(resolved_scene(again), resolved_scene(scene));
}

TEST_F(WallMotions, OfAGroupAreThoseOfItsWalls) {
  const std::string group =
      "group = \"drum\"\n[[group]]\nname = \"drum\"\ntorque_point = [1, 2, 3]\n"
      "[[group.motion]]\n" +
      turning;
  const Scene scene = parse(scene_of(disc, group));
  ASSERT_EQ(scene.setup.walls[0].motion.size(), 1u);
  EXPECT_EQ(scene.setup.walls[0].motion[0].rate, 3.5);
  EXPECT_EQ(scene.setup.groups[0].torque_point, Vec3(1, 2, 3));
  EXPECT_EQ(resolved_scene(parse(resolved_scene(scene))), resolved_scene(scene));
  expect_refused(scene_of(disc, "group = \"drm\"\n[[group]]\nname = \"drum\"\n"), "wall[0].group",
                 "no [[group]] is named 'drm'; did you mean 'drum'?");
  expect_refused(scene_of(disc, "[[group]]\nname = \"drum\"\n"), "group[0]", "no wall is of group 'drum'");
  expect_refused(scene_of(disc, "[[group]]\nname = \"w\"\n"), "wall[0].name",
                 "[[group]] is named 'w' already");
  expect_refused(scene_of(disc, group + "[[wall]]\nname = \"v\"\ngroup = \"drum\"\n" + disc +
                                    "[[wall.motion]]\n" + turning),
                 "wall[1].motion", "group 'drum' has a motion");
}

TEST_F(WallMotions, ThatMakeNoSenseAreRefused) {
  const std::string motion = "[[wall.motion]]\n";
  expect_refused(scene_of(disc, motion + "kind = \"rotation\"\npoint = [0, 0, 0]\nrate = 1\n"),
                 "wall[0].motion[0].axis", "missing");
  expect_refused(
      scene_of(disc, motion + "kind = \"rotation\"\naxis = [0, 0, 0]\npoint = [0, 0, 0]\nrate = 1\n"),
      "wall[0].motion[0].axis", "must not be zero");
  expect_refused(scene_of(disc, motion + turning + "amplitude = 1\n"), "wall[0].motion[0].amplitude",
                 "has a meaning only with: kind = oscillation");
  expect_refused(scene_of(disc, motion + turning + "from_stage = \"frst\"\n"), "wall[0].motion[0].from_stage",
                 "no stage is named 'frst'; did you mean 'first'?");
  expect_refused(scene_of(disc, motion + turning + "from_stage = \"second\"\nuntil_stage = \"first\"\n"),
                 "wall[0].motion[0].until_stage", "must come after from_stage");
  expect_refused(scene_of("side = \"z-\"\ndrive = \"force\"\nforce = 1\n", motion + turning), "wall[0].drive",
                 "that alone moves it");
  expect_refused(scene_of(disc, motion + "kind = \"oscillation\"\ndirection = [1, 0, 0]\namplitude = 1e-3\n"
                                         "frequency = 300\n"),
                 "wall[0].motion[0].frequency", "less than 8 steps of 0.001 s in stage 'first'");
  // A whole turn in each step is seen as none.
  const std::string whirl =
      motion + "kind = \"rotation\"\naxis = [0, 0, 1]\npoint = [0, 0, 0]\nrate = 6283.185307\n";
  expect_refused(scene_of(disc, whirl), "wall[0].motion[0].rate", "a turn of 0.001 s has less than 8 steps");
  EXPECT_NO_THROW(parse_scene(scene_of(disc, whirl + "surface_only = true\n"), "motion.toml"));
  expect_refused(scene_of("side = \"z-\"\n", motion + turning) +
                     "[[stage.load]]\nwall = \"w\"\ndrive = \"velocity\"\nvelocity = [0, 0, 1]\n",
                 "stage[1].load[0].wall", "has a motion, and that alone moves it");
}

TEST_F(WallMotions, TablesThatAreWrongAreRefusedByTheirLine) {
  const std::string motion = "[[wall.motion]]\nkind = \"table\"\nfile = \"way.csv\"\n";
  const auto refused = [&](const std::string& text, const std::string& said) {
    table(text);
    try {
      parse(scene_of(disc, motion));
      ADD_FAILURE() << text;
    } catch (const SceneError& error) {
      EXPECT_NE(std::string(error.what()).find(said), std::string::npos) << error.what();
    }
  };
  refused("time,x,y,z\n0,0,0,0\n1,0,0,0\n", "way.csv:1: the first line must be t[,x,y,z");
  refused("t\n0\n1\n", "way.csv:1: the first line must be t[,x,y,z");
  refused("t,x,y,z\n0,0,0,0\n", "two rows or more");
  refused("t,x,y,z\n0.5,0,0,0\n1,0,0,0\n", "way.csv:2: t: must begin at 0 s");
  refused("t,x,y,z\n0,0,0,0\n1,0,0,0\n1,0,0,0\n", "way.csv:4: t: must ascend, got 1 s after 1 s");
  refused("t,vx,vy,vz\n0,0,0,0\n1,0,0,1e16\n", "way.csv:3: vz: must be within 1e+15, got 1e16");
  refused("t,x,y,z\n0,0,0\n", "way.csv:2: 4 fields expected");
  refused("t,x,y,z\n0,0,zero,0\n", "way.csv:2: y: 'zero' is not a number");
  refused("t,angle\n0,0\n1,1\n", "wall[0].motion[0].axis: missing");
  refused("t,x,y,z\n0,0,0,0\n0.7,0,0,0\n", "the table ends at 0.7 s, and the stages of this motion last 1 s");
}

TEST_F(WallMotions, TakeWholeStepsToTheEndOfAStageAndSoMoreOfATable) {
  table("t,x,y,z\n0,0,0,0\n1,0,0,0\n");
  std::string text = scene_of(disc, "[[wall.motion]]\nkind = \"table\"\nfile = \"way.csv\"\n");
  EXPECT_EQ(parse(text).setup.walls.size(), 1u);
  const std::size_t step = text.find("time_step = ");
  text.replace(step, text.find('\n', step) - step, "time_step = 1.1e-3");  // 0.5 s are 455 steps, 0.5005 s
  expect_refused(text, "wall[0].motion[0].file", "the stages of this motion last 1.0005");
}

TEST_F(WallMotions, OfStagesThatMayEndSoonerAreNotHeldAgainstATable) {
  table("t,x,y,z\n0,0,0,0\n0.7,0,0,0\n");
  std::string text = scene_of(disc, "[[wall.motion]]\nkind = \"table\"\nfile = \"way.csv\"\n");
  text.insert(text.find("time = 0.5"), "equilibrium = 1e-3, ");
  text.insert(text.find("[[stage]]"), "[solver]\ntolerance = 1e-3\n");
  text.insert(text.find("[material]"), "gravity = [0, 0, -9.81]\n");
  EXPECT_EQ(parse(text).setup.walls.size(), 1u);
}

TEST_F(WallMotions, PushedWallsMayHaveAWeightAndShear) {
  const std::string lid = "side = \"z+\"\ndrive = \"force\"\nforce = 0\nmass = 2\nweight = true\n";
  const Scene scene = parse(scene_of(lid + "tangential_velocity = [0.1, 0, 0]\n"));
  const WallLoad& load = scene.setup.walls[0].load;
  EXPECT_TRUE(load.weight);
  EXPECT_EQ(load.velocity, Vec3(0.1, 0, 0));
  EXPECT_EQ(resolved_scene(parse(resolved_scene(scene))), resolved_scene(scene));
  expect_refused(scene_of("side = \"z+\"\nweight = true\n"), "wall[0].weight",
                 "has a meaning only with: drive = pressure or force");
  talus::Setup setup = scene.setup;
  setup.walls[0].point = Vec3::UnitZ();
  setup.walls[0].load.velocity = {0.1, 0, 0.1};
  EXPECT_THROW(validate(setup), std::invalid_argument);
}

TEST_F(WallMotions, WallsOfOtherStagesMayStandWhereGrainsAre) {
  const std::string plane = "side = \"z-\"\nposition = 1\n";
  Sample sample;
  sample.density = 2600;
  sample.x.emplace_back(0, 0, 0);
  sample.radius.push_back(0.01);
  Scene now = parse(scene_of(plane)), later = parse(scene_of(plane + "from_stage = \"second\"\n"));
  EXPECT_THROW(place_walls(now, sample), SceneError);
  EXPECT_NO_THROW(place_walls(later, sample));
  EXPECT_EQ(resolved_scene(parse(resolved_scene(later))), resolved_scene(later));
  expect_refused(scene_of(plane + "until_stage = \"third\"\n"), "wall[0].until_stage",
                 "no stage is named 'third'");
}

TEST_F(WallMotions, APressureNeedsAFaceInEveryStage) {
  const auto scene = [](const std::string& lid, const std::string& side) {
    const std::string first = "[[stage]]\nname = \"first\"\ntime_step = 1e-3\nend = { steps = 1 }\n";
    std::string text = scene_test::scene_with("#tail", "[[wall]]\nname = \"x+\"\n" + side);
    text = scene_test::replaced(text, "#wall\n", lid);
    return scene_test::replaced(text, "[[stage]]\n", first + "[[stage]]\n");
  };
  const std::string late = "from_stage = \"press\"\n", early = "until_stage = \"press\"\n";
  expect_refused(scene("", late), "stage[0]", "wall 'z+': no two pairs of opposite walls");
  expect_refused(scene("", early), "stage[1]", "wall 'z+': no two pairs of opposite walls");
  EXPECT_NO_THROW(parse(scene(late, late))) << "it has no face before it is there, and needs none";
}

TEST_F(WallMotions, ALoadOfAWallThatIsGoneIsRefused) {
  const auto scene = [](const std::string& stages_of_wall, const std::string& load) {
    return scene_of("side = \"z-\"\nposition = 1\n" + stages_of_wall) +
           "\n[[stage]]\nname = \"third\"\ntime_step = 1e-3\nend = { steps = 1 }\n" + load;
  };
  const std::string wall = parse(scene("", "")).setup.walls.front().name;
  const std::string load = "[[stage.load]]\nwall = \"" + wall + "\"\n";
  expect_refused(scene("until_stage = \"second\"\n", load), "stage[2].load[0].wall",
                 "is gone with the beginning of stage 'second'");
  EXPECT_NO_THROW(parse(scene("from_stage = \"third\"\n", load)));
  EXPECT_NO_THROW(parse(scene("", load)));
}

}  // namespace
}  // namespace talus::io::wall_motions_test
