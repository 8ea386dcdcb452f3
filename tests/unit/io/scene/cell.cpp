/// [cell], and the samples made for it.

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "apps/shared/sample_builder.hpp"
#include "tests/unit/io/scene/scene_text.hpp"

namespace talus::io::cell_test {
namespace {

using scene_test::replaced;

const std::string cube = R"(time_step = 1e-4
[material]
density = 2600
[cell]
lengths = [0.1, 0.1, 0.1]
[sample]
kind = "random"
count = 100
radius = 0.005
[[stage]]
end = { steps = 5 }
)";

Scene parsed(const std::string& text) {
  return parse_scene(text, "test.toml");
}

void refuse(const std::string& text, const std::string& key, const std::string& message) {
  try {
    Scene scene = parsed(text);
    place_walls(scene, build_sample(scene));
    FAIL() << "accepted: " << text;
  } catch (const SceneError& error) {
    const std::string what = error.what();
    EXPECT_NE(what.find(key), std::string::npos) << what;
    EXPECT_NE(what.find(message), std::string::npos) << what;
  }
}

TEST(CellScene, ReadsEdgesOriginAndShears) {
  const Scene scene =
      parsed(replaced(cube, "lengths = [0.1, 0.1, 0.1]",
                      "lengths = [0.1, 0.2, 0.3]\norigin = [1, 2, 3]\nshears = [0, 0.02, 0]"));
  EXPECT_EQ(scene.setup.domain.edges(), Vec3(0.1, 0.2, 0.3));
  EXPECT_EQ(scene.setup.domain.low, Vec3(1, 2, 3));
  EXPECT_EQ(scene.setup.domain.cell.xz, 0.02);
  const Scene again = parse_scene(resolved_scene(scene), "resolved.toml");
  EXPECT_EQ(again.setup.domain.edges(), scene.setup.domain.edges());
  EXPECT_EQ(again.setup.domain.cell.xz, 0.02);
  EXPECT_FALSE(parsed(scene_test::scene_with()).setup.domain.repeats);
}

TEST(CellScene, RefusesCellsThatLeanFarOrLieFarAway) {
  refuse(replaced(cube, "lengths", "shears = [0, 0.21, 0]\nlengths"), "test.toml:4", "twice the longer");
  refuse(replaced(cube, "lengths", "origin = [0, 1e9, 0]\nlengths"), "test.toml:4", "1e9 edges away");
  refuse(replaced(cube, "count", "velocity = [0, 1e25, 0]\ncount"), "test.toml:8: sample.velocity",
         "within 1e+15 m/s");
  parsed(replaced(cube, "lengths", "shears = [0, -0.19, 0]\norigin = [0, 1e7, 0]\nlengths"));
}

// Whoever takes [cell] out of a scene leaves its flow behind.
TEST(CellScene, RefusesFlowAndStressWithoutACell) {
  std::string boxed = replaced(cube, "[cell]\nlengths = [0.1, 0.1, 0.1]\n", "");
  boxed = replaced(boxed, "time_step", "box = true\ntime_step");
  boxed = replaced(boxed, "kind = \"random\"\ncount = 100", "kind = \"lattice\"\ncells = [3, 3, 3]");
  parsed(boxed);
  for (const std::string flow :
       {"strain_rates = [-1, 0, 0]", "shear_rates = [1, 0, 0]", "stress = { xx = 1e3 }"})
    refuse(replaced(boxed, "[[stage]]", "[[stage]]\n" + flow), "test.toml:10: stage 'stage-1'",
           "stage 'stage-1'");
}

TEST(CellScene, ReadsTheStressThatAStageFollowsAndWritesItAgain) {
  const Scene scene = parsed(replaced(
      replaced(cube, "lengths", "inertia = 4\nlengths"),
      "end =", "stress = { xx = 1e3, xz = -20, ramp_time = 0.5, amplitude_xx = 10, period = 0.1 }\nend ="));
  const auto expect = [](const Scene& read) {
    EXPECT_EQ(read.setup.cell_inertia, 4);
    const StressLoad& load = read.setup.stages.at(0).stress;
    EXPECT_EQ(load.to, (std::array<std::optional<double>, 6>{1e3, {}, {}, {}, -20.0, {}}));
    EXPECT_EQ(load.ramp_time, 0.5);
    EXPECT_EQ(load.amplitude, (std::array<double, 6>{10, 0, 0, 0, 0, 0}));
    EXPECT_EQ(load.period, 0.1);
    EXPECT_EQ(read.setup.decomposition.coupling, Coupling::nscdd);
  };
  expect(scene);
  expect(parse_scene(resolved_scene(scene), "resolved.toml"));
}

TEST(CellScene, RefusesAStressThatTheCellCannotFollow) {
  const auto stage = [](const std::string& keys) { return replaced(cube, "end =", keys + "\nend ="); };
  refuse(
      replaced(replaced(stage("stress = { xx = 1 }"), "[0.1, 0.1, 0.1]", "[0.1, 0.1, 0]"), "radius = 0.005",
               "radius = 0.005\nregion = { shape = \"box\", low = [0, 0, 0], high = [0.1, 0.1, 0.1] }"),
      "cell", "nothing bounds the sample along z");
  refuse(replaced(replaced(stage("stress = { zz = 1 }"), "[0.1, 0.1, 0.1]", "[0.1, 0.1, 0]"), "[sample]",
                  "[[wall]]\nname = \"z-\"\nside = \"z-\"\n[[wall]]\nname = \"z+\"\nside = "
                  "\"z+\"\n[sample]\nregion = { shape = "
                  "\"box\", low = [0, 0, 0], high = [0.1, 0.1, 0.1] }"),
         "stress.zz", "not periodic along z, so that nothing follows it");
  // The line is that of the stage's key, not that of [cell].
  refuse(stage("stress = { zz = 1 }\nstrain_rates = [0, 0, -1]"), "test.toml:11: stage 'stage-1': stress",
         "stress.zz: has a rate");
  refuse(stage("stress = { zz = 1, amplitude_xx = 2, period = 1 }"), "test.toml:11: stage 'stage-1': stress",
         "stress.amplitude_xx");
  refuse(stage("stress = { zz = 1, amplitude_zz = 2 }"), "test.toml:11: stage 'stage-1': stress", "period");
  refuse(stage("stress = { zz = 1, amplitude_zz = 2, period = 2e-4 }"),
         "test.toml:11: stage 'stage-1': stress.period", "a quarter of the period");
  refuse(stage("stress = { zx = 1 }"), "stage[0].stress.zx", "did you mean 'xz'?");
  refuse(stage("stress = { zz = 1 }") + "[decomposition]\ncoupling = \"alternating\"\n",
         "decomposition.coupling", "nscdd");
  refuse(stage("stress = { zz = 1 }") + "[solver]\noverlap_correction = 0.1\n", "solver.overlap_correction",
         "overlaps grow");
}

TEST(CellScene, ReadsAndWritesEndsByWhatTheGrainsDo) {
  const std::size_t end = cube.find("end ="), line = cube.find('\n', end);
  const auto with_end = [&](const std::string& conditions, const std::string& flow) {
    return std::string(cube).replace(end, line - end, flow + "end = { " + conditions + " }");
  };
  const std::string flow = "shear_rates = [0, 1, 0]\n";
  const Scene scene =
      parsed(with_end("stress_ratio = 0.3, inertial_below = 1e-4, inertial_above = 0.1, "
                      "inertial_hold = 7, steady = 0.02, steady_strain = 0.25",
                      flow));
  for (const Scene& read : {scene, parse_scene(resolved_scene(scene), "resolved.toml")}) {
    const StageEnd& ends = read.setup.stages.at(0).end;
    EXPECT_EQ(ends.stress_ratio, 0.3);
    EXPECT_EQ(ends.inertial_below, 1e-4);
    EXPECT_EQ(ends.inertial_above, 0.1);
    EXPECT_EQ(ends.inertial_hold, 7);
    EXPECT_EQ(ends.steady, 0.02);
    EXPECT_EQ(ends.steady_strain, 0.25);
  }
  EXPECT_EQ(parsed(with_end("steady = 0.02, steady_time = 0.5", "")).setup.stages.at(0).end.steady_time, 0.5);
  refuse(with_end("strain = 0.1", flow), "stage[0].end.strain", "the cell is not strained along that axis");
  refuse(with_end("equilibrium = 1e-3", "stress = { xx = 0, yy = 0, zz = 0 }\n"), "stage[0].end.equilibrium",
         "loads the sample");
  refuse(with_end("steady = 0.02", ""), "stage[0].end.steady", "give steady_time");
  refuse(with_end("inertial_below = 0.02", ""), "stage[0].end.inertial_below", "cell that flows");
  refuse(with_end("steady_strain = 0.5, steps = 3", flow), "stage[0].end.steady_strain", "steady is given");
}

TEST(CellScene, RandomGrainsStandInTheCell) {
  const Scene scene = parsed(cube);
  const Sample sample = build_sample(scene);
  ASSERT_EQ(sample.size(), 100u);
  for (const Vec3& x : sample.x) {
    EXPECT_GE(x.minCoeff(), 0);
    EXPECT_LE(x.maxCoeff(), 0.1);
  }
  EXPECT_TRUE(std::ranges::any_of(sample.x, [](const Vec3& x) { return x[2] < 0.005; }));
}

TEST(CellScene, NoiseOfALatticeMovesGrainsAndLeavesThemApart) {
  const std::string text = R"([sample]
kind = "lattice"
cells = [4, 4, 4]
spacing = 1.5
radius = 0.005
)";
  const auto sample_of = [&](const std::string& noise) {
    std::string scene = cube;
    const std::size_t from = scene.find("[sample]"), to = scene.find("[[stage]]");
    return build_sample(parsed(scene.replace(from, to - from, text + noise)));
  };
  const Sample still = sample_of(""), moved = sample_of("noise = 1.0\n");
  double farthest = 0, nearest = 1;
  for (std::size_t a = 0; a < moved.size(); ++a) {
    farthest = std::max(farthest, (moved.x[a] - still.x[a] - (moved.x[0] - still.x[0])).norm());
    for (std::size_t b = 0; b < a; ++b) nearest = std::min(nearest, (moved.x[a] - moved.x[b]).norm());
  }
  EXPECT_GT(farthest, 0.001);
  EXPECT_GE(nearest, 0.01);
}

TEST(CellScene, RefusesWhatACellHasNoRoomFor) {
  refuse(replaced(cube, "[0.1, 0.1, 0.1]", "[0.02, 0.1, 0.1]"), "cell.lengths", "along x is less than");
  refuse(replaced(cube, "[0.1, 0.1, 0.1]", "[0, 0, 0]"), "cell", "one of the lengths must be > 0");
  refuse(replaced(cube, "[0.1, 0.1, 0.1]", "[-0.1, 0.1, 0.1]"), "cell.lengths", "must be >= 0");
  refuse(replaced(cube, "time_step", "box = true\ntime_step"), "cell",
         "wall 'x-' bounds the sample along x, where the cell is periodic");
  refuse(replaced(cube, "[[stage]]",
                  "[[wall]]\nname = \"tilted\"\nnormal = [0, 1, 1]\npoint = [0, 0, 0]\n[[stage]]"),
         "cell", "wall 'tilted' bounds the sample along y");
  refuse(replaced(
             cube, "[[stage]]",
             "[[wall]]\nname = \"pipe\"\nshape = \"cylinder\"\nstart = [0, 0, 0]\nend = [0, 0, 1]\nradius = "
             "0.05\n[[stage]]"),
         "cell", "wall 'pipe' is no plane");
  const auto looks = [](const std::string& region) {
    return replaced(cube, "[[stage]]", "[[probe]]\nregion = { " + region + " }\n[[stage]]");
  };
  refuse(looks("shape = \"box\", low = [0, 0, 0], high = [1.7, 0.1, 0.1]"), "probe[0].region",
         "is more than 16 edges of the cell long along x");
  refuse(looks("shape = \"beyond\", point = [0, 0, 0.05], normal = [0, 0, 1]"), "probe[0].region",
         "across an axis along which the cell repeats");
  refuse(looks("shape = \"plane\", point = [0, 0, 0.05], normal = [0, 1, 1]"), "probe[0].region",
         "normal has to lie along x, y or z");
  refuse(replaced(looks("shape = \"plane\", point = [0, 0, 0.05], normal = [0, 0, 1]"), "[[stage]]",
                  "[[stage]]\nstrain_rates = [0, 0, 0.1]"),
         "probe[0].region", "the edges of the cell move");
  refuse(replaced(cube, "[[stage]]",
                  "[[field]]\nlow = [0, 0, 0]\nhigh = [0.1, 0.1, 2]\ncells = [9, 9, 99]\nwidth = "
                  "0.1\n[[stage]]"),
         "field[0]", "is more than 16 edges");
  refuse(replaced(cube, "[[stage]]",
                  "[[field]]\nlow = [0, 0, 0]\nhigh = [0.1, 0.1, 0.1]\ncells = [2, 2, 2]\nwidth = "
                  "10\n[[stage]]"),
         "field[0]", "with what it spreads grains over is more than 16 edges");
  refuse(looks("shape = \"disc\", centre = [1e14, 0, 0], axis = [1, 0, 0], radius = 0.01"), "probe[0].region",
         "edges away from the cell");
  refuse(replaced(cube, "[0.1, 0.1, 0.1]", "[0.1, 0.005, 0.1]"), "sample", "two of them have to fit");
  refuse(replaced(cube, "[0.1, 0.1, 0.1]", "[0.1, 0.1, 0.0]"), "sample.region", "nothing repeats along z");
  refuse(replaced(cube, "count = 100", "count = 4000"), "sample.count", "no room for a grain");
  refuse(replaced(cube, "lengths", "shears = [0.01, 0, 0]\nlength"), "cell.length",
         "did you mean 'lengths'?");
}

TEST(CellScene, RandomGrainsMayFillTheCellWhereverItLies) {
  const std::string box = "[sample.region]\nshape = \"box\"\nlow = [0.1, -0.2, 1000.3]\nhigh = ";
  const std::string there = replaced(replaced(cube, "[0.1, 0.1, 0.1]", "[0.08, 0.08, 0.08]"), "[sample]",
                                     "origin = [0.1, -0.2, 1000.3]\n[sample]");
  EXPECT_NO_THROW(parsed(replaced(there, "[[stage]]", box + "[0.18, -0.12, 1000.38]\n[[stage]]")))
      << "-0.12 + 0.2 is more than 0.08 in binary";
  refuse(replaced(there, "[[stage]]", box + "[0.18, -0.1199999, 1000.38]\n[[stage]]"), "sample.region",
         "is longer along y than the cell");
}

TEST(CellScene, RandomGrainsBetweenWallsNeedABox) {
  std::string text = replaced(cube, "[0.1, 0.1, 0.1]", "[0.1, 0.1, 0.0]");
  text = replaced(text, "[[stage]]", R"([sample.region]
shape = "box"
low = [0, 0, 0]
high = [0.1, 0.1, 0.2]
[[wall]]
name = "z-"
side = "z-"
[[wall]]
name = "z+"
side = "z+"
drive = "pressure"
pressure = 1e3
[[stage]])");
  Scene scene = parsed(text);
  const Sample sample = build_sample(scene);
  place_walls(scene, sample);
  for (const Vec3& x : sample.x) {
    EXPECT_GE(x[2], 0.005);
    EXPECT_LE(x[2], 0.195);
  }
  EXPECT_EQ(scene.setup.domain.edges(), Vec3(0.1, 0.1, 0));
}

}  // namespace
}  // namespace talus::io::cell_test
