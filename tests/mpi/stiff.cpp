/// Problems that sweeps cannot see through, on several ranks: ADMM in body space gives the same bits wherever
/// the subdomains lie.

#include <numbers>

#include "tests/mpi/launcher.hpp"

namespace talus::test {
namespace {

/// Grains of 1 cm, 2600 kg/m^3, touching, in `across` x `across` columns of `high` on a floor; a scene of
/// two steps and 12 subdomains, further `tables` at its end.
class StiffRanks : public OnRanks {
 protected:
  void grains(int across, int high) {
    std::string rows = "id,x,y,z,radius\n";
    for (int k = 0; k < across * across * high; ++k)
      rows += fmt::format("{},{},{},{},0.01000001\n", k, 0.01 + 0.02 * (k % across),
                          0.01 + 0.02 * (k / across % across), 0.01 + 0.02 * (k / (across * across)));
    write(at("grains.csv"), rows);
  }
  void scene(const std::string& tables, const std::string& friction = "0.35",
             const std::string& solver = "max_iterations = 2000") {
    write(at("scene.toml"), fmt::format(R"(gravity = [0, 0, -9.81]
time_step = 1e-3
[material]
density = 2600
friction = {}
[sample]
kind = "bodies"
file = "grains.csv"
[[wall]]
name = "floor"
side = "z-"
position = 0
[[stage]]
name = "rest"
end = {{ steps = 2 }}
[solver]
{}
[decomposition]
subdomains = 12
[output]
pictures = false
)",
                                        friction, solver) +
                                tables);
  }
  /// 10^6 grain masses on `high` layers.
  void plate(int across, int high) {
    grains(across, high);
    const double mass = 1e6 * 2600 * 4.0 / 3 * std::numbers::pi * 1e-6;
    scene(
        fmt::format("[[wall]]\nname = \"plate\"\nside = \"z+\"\nposition = {}\ndrive = \"force\"\n"
                    "mass = {}\nforce = {}\n",
                    0.02 * high, mass, 9.81 * mass));
  }
};

TEST_F(StiffRanks, CarryAHeavyPlateWithTheSameBitsOnAnyRanksAndThreads) {
  plate(4, 15);
  ASSERT_EQ(run(1, "run scene.toml --out plain --threads 1 --set solver.method=nlgs").code, 3)
      << "the scene is to be too stiff for sweeps";
  const Outcome rests = run(1, "run scene.toml --force --steps 1 --out first --threads 1");
  ASSERT_EQ(rests.code, 0) << rests.messages;
  // A further step: grains that the plate has pressed are dealt out anew.
  const std::string keys = "run scene.toml --force --set allow_unconverged=true";
  const Outcome one = run(1, keys + " --out one --threads 1");
  ASSERT_EQ(one.code, 0) << one.messages;
  for (const auto& [ranks, threads] : {std::pair{1, 2}, {2, 1}, {2, 2}, {3, 1}, {4, 1}}) {
    const Outcome several = run(ranks, fmt::format("{} --out several --threads {}", keys, threads));
    ASSERT_EQ(several.code, 0) << several.messages;
    EXPECT_EQ(digest_of("several"), digest_of("one")) << ranks << " x " << threads;
    EXPECT_EQ(file("several", "walls.csv"), file("one", "walls.csv")) << ranks << " x " << threads;
  }
}

// The sweeps have run out when the column, which lies in all subdomains, is solved on its own.
TEST_F(StiffRanks, PutAColumnRightBehindTheLastSweepWithTheSameBitsOnAnyRanks) {
  grains(1, 60);
  for (const auto& [friction, subdomains] : {std::pair<std::string, int>{"0.35", 12}, {"0.0", 6}}) {
    scene("", friction, "max_iterations = 20\ntolerance = 1e-6");
    ASSERT_EQ(run(1, fmt::format("run scene.toml --threads 1 --out plain{} --set solver.method=nlgs "
                                 "--set decomposition.subdomains={}",
                                 friction, subdomains))
                  .code,
              3)
        << "the scene is to need more sweeps than it has";
    expect_same_bits(subdomains, {{2, 1}, {3, 1}}, "one" + friction);
  }
}

// Checks as close as they may be, all courses and couplings: what a rank does before it hears of a check is
// undone.
TEST_F(StiffRanks, DropTheSweepThatHidTheSumsThatCalledAdmm) {
  plate(4, 12);
  for (const std::string keys :
       {"solver.method=admm", "solver.check_every=2", "solver.tolerance=1e-6 --set solver.check_every=7",
        "decomposition.coupling=schwarz", "decomposition.exchange=ccs", "decomposition.mapping=cyclic"}) {
    const std::string command =
        "run scene.toml --force --steps 1 --threads 1 --set allow_unconverged=true --set " + keys;
    const Outcome one = run(1, command + " --out one");
    ASSERT_EQ(one.code, 0) << keys << ": " << one.messages;
    const Outcome several = run(3, command + " --out several");
    ASSERT_EQ(several.code, 0) << keys << ": " << several.messages;
    EXPECT_EQ(digest_of("several"), digest_of("one")) << keys;
  }
}

TEST_F(StiffRanks, CarryAColumnAcrossAllSubdomains) {
  grains(1, 300);
  scene("");
  const std::string keys =
      "run scene.toml --force --threads 1 --set decomposition.boxes=[1,1,12] --set "
      "decomposition.partitioner=boxes";
  const Outcome one = run(1, keys + " --out one");
  ASSERT_EQ(one.code, 0) << one.messages;
  for (const int ranks : {2, 4}) {
    const Outcome several = run(ranks, keys + " --out several");
    ASSERT_EQ(several.code, 0) << several.messages;
    EXPECT_EQ(digest_of("several"), digest_of("one")) << ranks;
  }
}

}  // namespace
}  // namespace talus::test
