/// Walls that are no planes, on several ranks: same bits as on one.

#include <algorithm>

#include "io/files/stl.hpp"
#include "tests/mpi/launcher.hpp"
#include "tests/unit/mesh_makers.hpp"

namespace talus::test {
namespace {

/// Grains that fall through a funnel of triangles onto a plate in a tube.
const std::string funnel_scene = R"(name = "funnel"
time_step = 1e-3
gravity = [0, 0, -9.81]
allow_unconverged = true
[material]
density = 2600
friction = 0.3
[sample]
kind = "lattice"
cells = [5, 5, 6]
spacing = 1.02
radius = 0.01
[[wall]]
name = "funnel"
shape = "mesh"
file = "funnel.stl"
[[wall]]
name = "tube"
shape = "cylinder"
start = [0.05, 0.05, -0.2]
end = [0.05, 0.05, -0.06]
radius = 0.05
inside = true
[[wall]]
name = "plate"
shape = "disc"
centre = [0.05, 0.05, -0.08]
axis = [0, 0, 1]
radius = 0.02
[[wall]]
name = "floor"
side = "z-"
position = -0.2
[[stage]]
end = { steps = 160 }
[solver]
max_iterations = 60
[decomposition]
repartition_every = 7
[output]
every_steps = 80
contacts = true
pictures = false
)";

class SurfacesOnRanks : public OnRanks {
 protected:
  void SetUp() override {
    // Its grains stand above the funnel's mouth.
    write(at("funnel.stl"),
          io::stl_text(moved(funnel_mesh(0.03, 0.09, 0.06, 0.01, 16), Vec3(0.05, 0.05, -0.06))));
    write(at("scene.toml"), funnel_scene);
  }
};

TEST_F(SurfacesOnRanks, ChangeNoBitWithRanksAndThreads) {
  for (const int subdomains : {2, 8})
    expect_same_bits(subdomains, {{1, 2}, {2, 1}, {2, 2}}, fmt::format("one{}", subdomains),
                     [&](const std::string& out) {
                       const Frame a = last_frame(fmt::format("one{}", subdomains)), b = last_frame(out);
                       EXPECT_EQ(a.contact_bodies, b.contact_bodies) << out;
                       EXPECT_EQ(a.contact_force, b.contact_force) << out;
                     });
  const Frame end = last_frame("one8");
  for (const std::int64_t w : {0, 2})
    EXPECT_TRUE(std::ranges::any_of(end.contact_bodies, [&](const auto& pair) { return pair[1] == -1 - w; }))
        << "grains touch wall " << w;
}

}  // namespace
}  // namespace talus::test
