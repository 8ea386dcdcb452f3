/// A periodic cell on several ranks: same bits as on one.

#include "tests/mpi/launcher.hpp"

namespace talus::test {
namespace {

/// Grains that are pressed by a lid, between faces along x and y.
const std::string pressed_cell = R"(name = "cell"
time_step = 5e-4
allow_unconverged = true
[material]
density = 2600
friction = 0.4
[cell]
lengths = [0.12, 0.1, 0.0]
origin = [-0.03, 0, 0]
[sample]
kind = "random"
count = 300
radius_distribution = "uniform"
radius_min = 0.006
radius_max = 0.009
velocity = [0.4, 0.2, -0.3]
[sample.region]
shape = "box"
low = [-0.03, 0, 0]
high = [0.09, 0.1, 0.25]
[[wall]]
name = "z-"
side = "z-"
[[wall]]
name = "z+"
side = "z+"
drive = "pressure"
pressure = 2e3
[[stage]]
end = { steps = 150 }
[solver]
max_iterations = 60
[decomposition]
repartition_every = 5
[output]
every_steps = 100
pictures = false
)";

class CellsOnRanks : public OnRanks {
 protected:
  void SetUp() override { write(at("scene.toml"), pressed_cell); }
  /// Stopped on two ranks after so many steps, each time, then run to the end on one: the digest of
  /// `whole`, which ran in one piece.
  void expect_same_when_stopped(int subdomains, const std::vector<std::size_t>& steps,
                                const std::string& whole) const {
    const std::string command = fmt::format(
        "run scene.toml --set decomposition.subdomains={} --threads 1 --out parts --resume", subdomains);
    for (const std::size_t before : steps) {
      const Outcome first = run(2, fmt::format("{} --steps {}", command, before));
      ASSERT_EQ(first.code, 0) << first.messages;
    }
    const Outcome rest = run(1, command);
    ASSERT_EQ(rest.code, 0) << rest.messages;
    EXPECT_EQ(digest_of("parts"), digest_of(whole));
  }
};

TEST_F(CellsOnRanks, ChangeNoBitWithRanksAndThreads) {
  for (const int subdomains : {1, 2, 8}) {
    const std::string one = fmt::format("one{}", subdomains);
    expect_same_bits(subdomains, {{1, 2}, {2, 1}}, one, [&](const std::string& out) {
      const Frame a = last_frame(one), b = last_frame(out);
      EXPECT_EQ(a.x, b.x) << out;
      EXPECT_EQ(a.contact_bodies, b.contact_bodies) << out;
      EXPECT_EQ(a.contact_force, b.contact_force) << out;
    });
    const Frame frame = last_frame(one);
    ASSERT_EQ(frame.id.size(), 300u);
    for (const Vec3& x : frame.x) {
      EXPECT_GE(x[0], -0.03 - 1e-12);
      EXPECT_LE(x[0], 0.09 + 1e-12);
    }
  }
}

TEST_F(CellsOnRanks, GoOnFromACheckpointToTheSameBits) {
  const std::string command = "run scene.toml --set decomposition.subdomains=4 --threads 1";
  const Outcome whole = run(1, command + " --out whole");
  ASSERT_EQ(whole.code, 0) << whole.messages;
  const Outcome first = run(2, command + " --out parts --set checkpoint.every_steps=10 --steps 60");
  ASSERT_EQ(first.code, 0) << first.messages;
  const Outcome rest = run(1, command + " --out parts --set checkpoint.every_steps=10 --resume");
  ASSERT_EQ(rest.code, 0) << rest.messages;
  EXPECT_EQ(digest_of("parts"), digest_of("whole"));
}

TEST_F(CellsOnRanks, FlowToTheSameBitsOnAnyRanksAndBehindACheckpoint) {
  std::string scene = pressed_cell;
  scene.replace(scene.find("end = { steps = 150 }"), 0,
                "shear_rates = [20.0, 0.0, 0.0]\nstrain_rates = [-0.5, 0.2, 0.0]\n");
  write(at("scene.toml"), scene);
  expect_same_bits(4, {{1, 2}, {2, 1}}, "one");
  expect_same_when_stopped(4, {67}, "one");
}

/// Walls along z, a stress along x and y, and rough walls that stretch with the cell.
TEST_F(CellsOnRanks, FollowAStressBetweenWallsToTheSameBitsOnAnyRanksAndBehindACheckpoint) {
  std::string scene = pressed_cell;
  scene.replace(scene.find("friction = 0.4"), 0, "wall_friction = 0.5\n");
  // From step 142 on the cell would be too small for its grains.
  const std::string end = "end = { steps = 150 }";
  scene.replace(scene.find(end), end.size(), "stress = { xx = 1e3, yy = 2e3 }\nend = { steps = 110 }");
  write(at("scene.toml"), scene);
  for (const int subdomains : {1, 4})
    expect_same_bits(subdomains, {{1, 2}, {2, 1}}, fmt::format("walled{}", subdomains));
  expect_same_when_stopped(4, {67}, "walled4");
}

/// Grains that a stress squeezes, while they are sheared at constant pressure.
const std::string stressed_cell = R"(name = "cell"
time_step = 1e-4
[material]
density = 2600
[cell]
lengths = [0.0192, 0.0192, 0.0192]
[sample]
kind = "random"
count = 300
radius = 0.001
[[stage]]
name = "press"
stress = { xx = 100, yy = 100, zz = 100 }
end = { steps = 150 }
[[stage]]
name = "shear"
friction = 0.3
shear_rates = [0.0, 5.0, 0.0]
stress = { zz = 100, ramp_time = 1e-3 }
end = { steps = 60 }
[decomposition]
repartition_every = 5
[output]
every_steps = 100
pictures = false
)";

TEST_F(CellsOnRanks, FollowAStressToTheSameBitsOnAnyRanksAndBehindACheckpoint) {
  write(at("scene.toml"), stressed_cell);
  for (const int subdomains : {1, 2, 8})
    expect_same_bits(subdomains, {{1, 2}, {2, 1}}, fmt::format("stressed{}", subdomains));
  const Outcome full =
      run(1, "run scene.toml --out full --set decomposition.subdomains=1 --set solver.precision=double");
  ASSERT_EQ(full.code, 0) << full.messages;
  EXPECT_NE(digest_of("full"), digest_of("stressed1")) << "single precision was not used";
  expect_same_when_stopped(8, {70, 171}, "stressed8");
}

/// Moving grains push a cell from the first step on, before they are dealt out to subdomains.
TEST_F(CellsOnRanks, FollowAStressWithGrainsThatMoveAtFirst) {
  std::string scene = stressed_cell;
  scene.insert(scene.find("[[stage]]"), "velocity = [0.3, 0.7, -0.1]\n");
  scene.replace(scene.find("steps = 150"), 11, "steps = 5");
  write(at("scene.toml"), scene);
  expect_same_bits(2, {{2, 1}}, "moving");
}

/// Ends that look back: they come with the same step on any ranks, and where a run was stopped before.
TEST_F(CellsOnRanks, EndTheirStagesWithTheSameStepOnAnyRanksAndBehindACheckpoint) {
  std::string scene = stressed_cell;
  const auto change = [&](const std::string& from, const std::string& to) {
    scene.replace(scene.find(from), from.size(), to);
  };
  change("end = { steps = 150 }", "end = { steady = 0.1, steady_time = 2e-3, steps = 400 }");
  change("end = { steps = 60 }", "end = { inertial_below = 0.08, inertial_hold = 0.2, steps = 400 }");
  write(at("scene.toml"), scene);
  expect_same_bits(8, {{2, 1}}, "ends");
  const Table steps = read_table(at("ends") / "cell.csv");
  ASSERT_GT(steps.rows.size(), 20U);
  ASSERT_LT(steps.rows.size(), 400U) << "ends by what the grains do, not by steps";
  expect_same_when_stopped(8, {70, steps.rows.size() - 3}, "ends");
  EXPECT_EQ(read_table(at("parts") / "cell.csv").rows.size(), steps.rows.size());
}

}  // namespace
}  // namespace talus::test
