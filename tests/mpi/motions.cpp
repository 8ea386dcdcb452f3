/// Walls that move by themselves, on several ranks and stopped in motion: same bits as on one, straight on.

#include "io/files/stl.hpp"
#include "tests/mpi/launcher.hpp"
#include "tests/unit/mesh_makers.hpp"

namespace talus::test {
namespace {

/// Grains in a mesh that turns and shakes, with a rolling resistance, on a belt behind a gate that opens.
const std::string moving_scene = R"(name = "moving"
time_step = 1e-3
gravity = [0, 0, -9.81]
allow_unconverged = true
[material]
density = 2600
friction = 0.3
wall_friction = 0.5
[sample]
kind = "lattice"
cells = [5, 5, 6]
spacing = 1.02
radius = 0.01
[[group]]
name = "hopper"
[[group.motion]]
kind = "rotation"
axis = [0.1, 0, 1]
point = [0.05, 0.05, 0]
rate = 3.0
from_stage = "turn"
[[group.motion]]
kind = "oscillation"
direction = [1, 0, 1]
amplitude = 1e-3
frequency = 30
[[wall]]
name = "funnel"
shape = "mesh"
file = "funnel.stl"
group = "hopper"
[[wall]]
name = "gate"
shape = "disc"
centre = [0.05, 0.05, -0.055]
axis = [0, 0, 1]
radius = 0.03
until_stage = "turn"
[[wall]]
name = "drum"
shape = "cylinder"
start = [0.05, 0.05, -0.2]
end = [0.05, 0.05, -0.06]
radius = 0.06
inside = true
[[wall.motion]]
kind = "rotation"
axis = [0, 0, 1]
point = [0.05, 0.05, 0]
rate = -4
[[wall]]
name = "floor"
side = "z-"
position = -0.12
[[wall.motion]]
kind = "table"
file = "way.csv"
axis = [0, 1, 0]
point = [0.05, 0.05, -0.12]
[[wall.motion]]
kind = "velocity"
velocity = [0.1, 0.05, 0]
surface_only = true
[[wall]]
name = "lid"
side = "z+"
position = 0.2
drive = "force"
force = 0
mass = 0.1
weight = true
tangential_velocity = [0.1, 0, 0]
[[stage]]
name = "settle"
end = { steps = 60 }
[[stage]]
name = "turn"
end = { steps = 100 }
[solver]
max_iterations = 60
[decomposition]
repartition_every = 7
[output]
every_steps = 80
pictures = false
)";

class MotionsOnRanks : public OnRanks {
 protected:
  void SetUp() override {
    write(at("funnel.stl"),
          io::stl_text(moved(funnel_mesh(0.03, 0.09, 0.06, 0.01, 16), Vec3(0.05, 0.05, -0.06))));
    write(at("way.csv"), "t,vx,vy,vz,angle\n0,0,0,0,0\n0.1,0,0,0.05,0.02\n0.2,0,0,0,0.04\n");
    write(at("scene.toml"), moving_scene);
  }
};

TEST_F(MotionsOnRanks, ChangeNoBitWithRanksAndThreads) {
  for (const int subdomains : {1, 4})
    expect_same_bits(subdomains, {{1, 2}, {2, 1}, {3, 2}}, fmt::format("one{}", subdomains));
}

TEST_F(MotionsOnRanks, GoOnFromACheckpointInMotion) {
  for (const char* keys :
       {"", "--set time_step=auto --set stage.0.end.steps=40 --set stage.1.end.steps=60"}) {
    const std::string command = fmt::format("run scene.toml {} --set decomposition.subdomains=2 ", keys);
    const Outcome straight = run(1, command + "--force --out straight --threads 1");
    ASSERT_EQ(straight.code, 0) << straight.messages;
    std::filesystem::remove_all(at("parts"));
    for (const int stop : {13, 60, 77}) {
      const Outcome part =
          run(stop == 60 ? 2 : 1, fmt::format("{} --resume --out parts --steps {}", command, stop));
      ASSERT_EQ(part.code, 0) << part.messages;
    }
    const Outcome rest = run(2, command + "--resume --out parts --threads 1");
    ASSERT_EQ(rest.code, 0) << rest.messages;
    EXPECT_EQ(digest_of("parts"), digest_of("straight")) << keys;
    EXPECT_EQ(file("parts", "walls.csv"), file("straight", "walls.csv")) << keys;
  }
}

}  // namespace
}  // namespace talus::test
