/// Materials, cohesion and rolling resistance on several ranks: same bits as on one.

#include "tests/mpi/launcher.hpp"

namespace talus::test {
namespace {

/// Wet and dry grains that fall into a box, and are pressed then.
const std::string mixed_scene = R"(name = "mixed"
time_step = 1e-3
gravity = [0, 0, -9.81]
allow_unconverged = true
box = true
[[material]]
name = "dry"
density = 2600
[[material]]
name = "wet"
density = 1500
[[material]]
name = "steel"
density = 7800
[[pair]]
material = "dry"
friction = 0.3
restitution = 0.4
rolling_resistance = 0.05
[[pair]]
material = "wet"
friction = 0.6
cohesion = 0.05
rolling_resistance = 0.2
[[pair]]
material = "wet"
with = "dry"
friction = 0.4
work_of_adhesion = 0.5
[[pair]]
material = "dry"
with = "steel"
friction = 0.2
[[sample]]
)";

std::string scene_text() {
  std::string text = mixed_scene;
  text.replace(text.find("[[sample]]"), 10, R"([sample]
kind = "bodies"
file = "bodies.csv"
[[wall]]
name = "z-"
material = "steel"
[[stage]]
end = { steps = 60 }
[[stage]]
restitution = 0
[[stage.load]]
wall = "x+"
drive = "pressure"
pressure = 500
[stage.end]
steps = 40
[solver]
max_iterations = 60
overlap_correction = 0.2
[decomposition]
repartition_every = 7
[output]
every_steps = 50
pictures = false)");
  return text;
}

std::string grains() {
  std::string text = "id,x,y,z,radius,material\n";
  for (int k = 0; k < 343; ++k)
    text += fmt::format("{},{},{},{},{},{}\n", k, 0.0201 * (k % 7) + 0.0003 * (k / 49), 0.0201 * (k / 7 % 7),
                        0.0201 * (k / 49), 0.0095 + 0.0001 * (k % 5), k % 3 == 0 ? "wet" : "dry");
  return text;
}

class MaterialsOnRanks : public OnRanks {
 protected:
  void SetUp() override {
    write(at("bodies.csv"), grains());
    write(at("scene.toml"), scene_text());
  }
};

TEST_F(MaterialsOnRanks, ChangeNoBitWithRanksAndThreads) {
  for (const int subdomains : {1, 8}) {
    const std::string one = fmt::format("one{}", subdomains);
    expect_same_bits(subdomains, {{1, 2}, {2, 1}, {2, 2}}, one, [&](const std::string& out) {
      const Frame a = last_frame(one), b = last_frame(out);
      EXPECT_EQ(a.contact_bodies, b.contact_bodies) << out;
      EXPECT_EQ(a.contact_force, b.contact_force) << out;
      EXPECT_EQ(a.material, b.material) << out;
    });
    const Frame a = last_frame(one);
    ASSERT_EQ(a.material.size(), 343u);
    for (std::size_t k = 0; k < 343; ++k) EXPECT_EQ(a.material[k], k % 3 == 0 ? 1 : 0);
  }
}

/// Rolling resistance in a small cluster, which is solved on its own at a check: behind it a sweep has gone
/// on where there are several ranks.
TEST_F(MaterialsOnRanks, RollingClustersAreCheckedAsTheyWere) {
  for (const std::string coupling : {"alternating", "nscdd"}) {
    write(at("scene.toml"), R"(name = "rolling"
allow_unconverged = true
time_step = 1e-4
box = true
[material]
density = 1000
wall_friction = 0.3
rolling_resistance = 0.03353
[sample]
kind = "lattice"
radius = 0.01
cells = [3, 3, 2]
velocity = [-0.0009358, -0.04879, -0.269]
[[stage]]
end = { steps = 6 }
[decomposition]
partitioner = "hilbert"
coupling = ")" + coupling + "\"\n");
    expect_same_bits(2, {{2, 1}}, "one_" + coupling);
    fs::remove_all(at("s2r2x1"));
  }
}

}  // namespace
}  // namespace talus::test
