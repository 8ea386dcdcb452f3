/// Probes and fields on several ranks, and of runs that are stopped: same bits as on one that was not.

#include "tests/mpi/launcher.hpp"

namespace talus::test {
namespace {

/// Grains of two materials that rain into a box, through a plane and a disc.
const std::string rain = R"(name = "rain"
time_step = 2e-3
gravity = [0, 0, -9.81]
allow_unconverged = true
[[material]]
name = "dry"
density = 2600
[[material]]
name = "wet"
density = 1500
[[pair]]
material = "dry"
friction = 0.3
restitution = 0.4
[[sample]]
kind = "lattice"
cells = [6, 6, 5]
radius = 0.01
spacing = 1.1
origin = [0, 0, 0.02]
material = "wet"
[[insert]]
material = "dry"
radius = 0.012
rate = 300
count = 50
velocity = [0, 0, -1]
region = { shape = "box", low = [0, 0, 0.3], high = [0.14, 0.14, 0.4] }
[[remove]]
at = [0.1]
region = { shape = "beyond", point = [0.1, 0, 0], normal = [1, 0, 0] }
[[wall]]
name = "x-"
position = 0
[[wall]]
name = "x+"
position = 0.14
[[wall]]
name = "y-"
position = 0
[[wall]]
name = "y+"
position = 0.14
[[wall]]
name = "z-"
position = 0
[[stage]]
end = { steps = 80 }
[[probe]]
name = "plane"
region = { shape = "plane", point = [0, 0, 0.1], normal = [0.1, 0, -1] }
every_steps = 3
[[probe]]
name = "disc"
region = { shape = "disc", centre = [0.07, 0.07, 0.12], axis = [0, 0, -1], radius = 0.05 }
every = 0.017
[[probe]]
name = "box"
region = { shape = "box", low = [0.02, 0, 0], high = [0.13, 0.1, 0.09] }
[[probe]]
name = "cylinder"
region = { shape = "cylinder", start = [0, 0, 0], end = [0.14, 0.14, 0.1], radius = 0.05 }
every_steps = 7
[[field]]
name = "flow"
low = [0, 0, 0]
high = [0.14, 0.14, 0.14]
cells = [7, 7, 7]
width = 0.03
[solver]
max_iterations = 60
[decomposition]
repartition_every = 4
[output]
every_steps = 40
pictures = false
)";

class ProbesOnRanks : public OnRanks {
 protected:
  void SetUp() override { write(at("scene.toml"), rain); }
  void expect_same_reports(const std::string& one, const std::string& out) const {
    EXPECT_EQ(file(out, "probes.csv"), file(one, "probes.csv")) << out;
    for (const char* name :
         {"fields/field_flow_000001.vti", "fields/field_flow_000002.vti", "fields/field_flow.pvd"})
      EXPECT_EQ(file(out, name), file(one, name)) << out << name;
  }
};

TEST_F(ProbesOnRanks, ChangeNoBitWithRanksAndThreads) {
  for (const int subdomains : {1, 2, 8}) {
    const std::string one = fmt::format("one{}", subdomains);
    expect_same_bits(subdomains, {{1, 2}, {2, 1}, {3, 1}}, one,
                     [&](const std::string& out) { expect_same_reports(one, out); });
    EXPECT_NE(file(one, "probes.csv").find("\n3,0.006,plane,"), std::string::npos);
  }
}

TEST_F(ProbesOnRanks, GoOnWhereARunWasStopped) {
  const std::string command = "run scene.toml --set decomposition.subdomains=2 ";
  ASSERT_EQ(run(1, command + "--out straight --threads 1").code, 0);
  for (const auto& [steps, ranks] : std::vector<std::pair<int, int>>{{17, 2}, {44, 1}, {80, 2}})
    ASSERT_EQ(run(ranks, fmt::format("{} --out parts --resume --threads 1 --steps {}", command, steps)).code,
              0);
  expect_same_reports("straight", "parts");
}

/// Without any the files are those of ever.
TEST_F(ProbesOnRanks, AreNotThereWhereNobodyAskedForThem) {
  const std::size_t begin = rain.find("[[probe]]"), end = rain.find("[solver]");
  write(at("scene.toml"), rain.substr(0, begin) + rain.substr(end));
  ASSERT_EQ(run(1, "run scene.toml --out none --threads 1").code, 0);
  EXPECT_FALSE(fs::exists(at("none") / "probes.csv"));
  write(at("scene.toml"), rain);
  ASSERT_EQ(run(1, "run scene.toml --out some --threads 1").code, 0);
  EXPECT_EQ(digest_of("some"), digest_of("none"));
}

}  // namespace
}  // namespace talus::test
