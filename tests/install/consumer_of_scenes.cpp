#include <mpi.h>  // of whom a user may want more than Talus does

#include <cstdio>

#include "io/scene/scene.hpp"

int main(int argc, char** argv) {
  MPI_Init(&argc, &argv);
  const talus::io::Scene scene = talus::io::parse_scene(R"(time_step = 1e-3
[material]
density = 2600
[sample]
kind = "lattice"
count = 8
base = [0.1, 0.1]
radius = 0.01
[[wall]]
name = "floor"
side = "z-"
[[stage]]
gravity = [0, 0, -9.81]
end = { steps = 1 }
)",
                                                        "eight.toml", {});
  std::printf("%zu stage\n", scene.setup.stages.size());
  MPI_Finalize();
  return scene.setup.stages.size() == 1 ? 0 : 1;
}
