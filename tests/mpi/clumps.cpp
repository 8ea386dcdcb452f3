/// Clumps on several ranks: same bits as on one.

#include "tests/mpi/launcher.hpp"

namespace talus::test {
namespace {

/// Rods that fall into a box, and are pressed then.
const std::string rods = R"(name = "rods"
time_step = 1e-3
gravity = [0, 0, -9.81]
allow_unconverged = true
box = true
[material]
density = 2600
friction = 0.3
restitution = 0.2
[sample]
kind = "lattice"
shape = "rod"
cells = [5, 4, 5]
spacing = 1
radius_distribution = "uniform"
radius_min = 0.02
radius_max = 0.03
[[stage]]
end = { steps = 120 }
[[stage]]
restitution = 0
end = { steps = 30 }
[[stage.load]]
wall = "x+"
drive = "pressure"
pressure = 2000
[solver]
max_iterations = 60
overlap_correction = 0.2
[[insert]]
name = "spheres"
radius = 0.005
rate = 500
count = 3
region = { shape = "box", low = [0.05, 0.05, 0.05], high = [0.2, 0.15, 0.2] }
[decomposition]
subdomains = 6
repartition_every = 7
[output]
every_steps = 50
pictures = false
)";

class ClumpsOnRanks : public OnRanks {
 protected:
  void SetUp() override { write(at("scene.toml"), rods); }
};

TEST_F(ClumpsOnRanks, ChangeNoBitWithRanksAndThreads) {
  for (const std::string coupling : {"alternating", "nscdd"}) {
    const std::string set = " --set decomposition.coupling=" + coupling;
    ASSERT_EQ(run(1, "run scene.toml --force --threads 1 --out one" + set).code, 0);
    ASSERT_EQ(run(2, "run scene.toml --force --threads 2 --out two" + set).code, 0);
    ASSERT_EQ(run(3, "run scene.toml --force --threads 1 --out three" + set).code, 0);
    EXPECT_EQ(digest_of("one"), digest_of("two"));
    EXPECT_EQ(digest_of("one"), digest_of("three"));
    EXPECT_EQ(file("one", "walls.csv"), file("three", "walls.csv"));
    EXPECT_EQ(file("one", "fields/grains_000002.vtp"), file("three", "fields/grains_000002.vtp"));
  }
}

TEST_F(ClumpsOnRanks, AreRefusedWhereTheyWouldBeTakenForSpheres) {
  const auto refused = [&](const std::string& set, const std::string& why) {
    const Outcome outcome = run(1, "run scene.toml --out refused --set " + set);
    EXPECT_NE(outcome.code, 0) << set;
    EXPECT_NE(outcome.messages.find(why), std::string::npos) << outcome.messages;
  };
  refused("solver.method=nncg", "contacts of clumps cannot be carried on");
  refused("decomposition.coupling=schwarz", "contacts of clumps are not damped");
  refused("material.rolling_resistance=0.1 --set material.wall_friction=0.3", "clumps have none");
  refused("sample.shape=cube", "cube");
}

}  // namespace
}  // namespace talus::test
