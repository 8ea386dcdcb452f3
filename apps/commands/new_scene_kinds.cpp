/// The scenes that `talus new` begins with: each runs within a minute, and says what to change.

#include "apps/commands/new_scene.hpp"

namespace talus {

namespace {

constexpr std::string_view triaxial =
    R"(description = "Triaxial test: compaction without friction, then shear"
seed = 1
box = true           # six walls around the sample: x-, x+, y-, y+, z-, z+

[material]
density = 2600       # kg/m³
friction = 0.35      # between grains; 0 while it is compacted, below
wall_friction = 0    # smooth walls keep the stress uniform

[sample]
kind = "deposition"
count = 1000
base = [0.18, 0.18]  # m; the height follows
radius_distribution = "uniform"
radius_min = 0.008   # m
radius_max = 0.012

# Three walls are pressed; the others stand.
[[wall]]
name = "x+"
drive = "pressure"
pressure = 1e4       # Pa

[[wall]]
name = "y+"
drive = "pressure"
pressure = 1e4

[[wall]]
name = "z+"
drive = "pressure"
pressure = 1e4

[[stage]]
name = "compaction"
friction = 0         # frictionless grains pack densely; give 0.3 for a loose sample
time_step = 1e-3     # s
end = { equilibrium = 1e-3, steps = 300 }

[[stage]]
name = "shear"
time_step = 1e-3
end = { strain = 0.2, strain_axis = "z" }

[[stage.load]]
wall = "z+"
drive = "velocity"
velocity = [0, 0, -0.06]  # m/s

[solver]
tolerance = 1e-3
max_iterations = 4000
overlap_correction = 0.1

[output]
every = 0.1          # s, between frames
)";

constexpr std::string_view silo =
    R"(description = "A silo is filled through its top, and drains when its gate opens"
time_step = 5e-4          # s
gravity = [0, 0, -9.81]   # m/s²
allow_unconverged = true  # impacts of the rain; the steps are marked all the same

[material]
density = 2500            # kg/m³
friction = 0.3
wall_friction = 0.2
restitution = 0.3

# Grains come at a rate until there are enough.
[[insert]]
name = "rain"
radius = 0.006            # m
rate = 3000               # grains a second
count = 1500
velocity = [0, 0, -1.5]   # m/s
stage = "fill"
region = { shape = "cylinder", start = [0, 0, 0.3], end = [0, 0, 0.4], radius = 0.09 }

# What falls out is taken away; removed.csv has the discharge.
[[remove]]
name = "out"
stage = "drain"
interval = 0.005          # s
region = { shape = "beyond", point = [0, 0, -0.15], normal = [0, 0, -1] }

[[wall]]
name = "tube"
shape = "cylinder"
inside = true
start = [0, 0, 0]
end = [0, 0, 0.45]
radius = 0.1

[[wall]]
name = "funnel"
shape = "cone"
inside = true
start = [0, 0, -0.07]
end = [0, 0, 0]
start_radius = 0.035      # of the orifice
end_radius = 0.1

[[wall]]
name = "gate"
side = "z-"
position = -0.07
until_stage = "drain"     # it is gone then

[[stage]]
name = "fill"
end = { time = 0.9 }      # s

[[stage]]
name = "drain"
end = { time = 1.5 }

[solver]
tolerance = 1e-2

[output]
every = 0.1               # s, between frames
)";

constexpr std::string_view drum =
    R"(description = "A rotating drum: grains settle, then shell and ends turn as one"
time_step = 5e-4          # s
gravity = [0, 0, -9.81]   # m/s²
allow_unconverged = true  # impacts while the grains settle; the steps are marked all the same

[material]
density = 2500            # kg/m³
friction = 0.3
wall_friction = 0.4
restitution = 0.3

[sample]
kind = "lattice"
cells = [12, 5, 10]
spacing = 1.03
radius_distribution = "uniform"
radius_min = 0.0045       # m
radius_max = 0.0050

[[group]]
name = "drum"             # a row in walls.csv: force, torque about the axis, work

[[group.motion]]
kind = "rotation"
axis = [0, 1, 0]
point = [0.06, 0, 0.06]   # m
rate = -2.0               # rad/s
from_stage = "turn"

[[wall]]
name = "shell"
group = "drum"
shape = "cylinder"
start = [0.06, -0.001, 0.06]
end = [0.06, 0.053, 0.06]
radius = 0.1
inside = true

[[wall]]
name = "front"
group = "drum"
side = "y-"
position = -0.001

[[wall]]
name = "back"
group = "drum"
side = "y+"
position = 0.053

[[stage]]
name = "settle"
end = { time = 0.25 }     # s

[[stage]]
name = "turn"
end = { time = 2.0 }

[solver]
tolerance = 1e-2
overlap_correction = 0.1

[output]
every = 0.05              # s, between frames
)";

constexpr std::string_view heap = R"(description = "Grains fall on a rough floor and make a heap"
time_step = 5e-4          # s
gravity = [0, 0, -9.81]   # m/s²
allow_unconverged = true  # impacts; the steps are marked all the same

[material]
density = 2600            # kg/m³
friction = 0.5
wall_friction = 0.6       # of the floor
rolling_resistance = 0.05 # steepens the heap; 0 for smooth spheres

# Without grains at the beginning; they come from a small disc above the floor.
[[insert]]
name = "nozzle"
radius_distribution = "uniform"
radius_min = 0.005        # m
radius_max = 0.006
rate = 400                # grains a second
count = 600
velocity = [0, 0, -0.5]   # m/s
region = { shape = "disc", centre = [0, 0, 0.2], radius = 0.03 }

# Grains that roll away do not roll for ever.
[[remove]]
name = "away"
interval = 0.05           # s
region = { shape = "beyond", point = [0, 0, -0.2], normal = [0, 0, -1] }

[[wall]]
name = "floor"
shape = "disc"
centre = [0, 0, 0]
axis = [0, 0, 1]
radius = 0.2              # m

[[stage]]
name = "pour"
end = { time = 2.0 }      # s

[solver]
tolerance = 1e-2

[output]
every = 0.1               # s, between frames
)";

constexpr std::string_view periodic =
    R"(description = "A dense flow without walls: spheres in a periodic cell are squeezed, then sheared"
seed = 1
time_step = 1e-4          # s
allow_unconverged = true  # where the flow lets go for a moment; the steps are marked all the same

[material]
density = 2600            # kg/m³

# Space repeats itself along x, y and z. A length that is left at 0 is bounded by walls instead.
[cell]
lengths = [0.016, 0.016, 0.016]       # m

# Random places overlap unless there is room: begin at a solid fraction of 0.3 or less, and squeeze.
[sample]
kind = "random"
count = 300
radius_distribution = "uniform"
radius_min = 0.0009       # m
radius_max = 0.0011

# Without friction grains come closer before they jam. A strain of 0.19 along each axis raises the solid
# fraction by a factor of exp(3 x 0.19), from 0.31 to 0.55: with friction grains jam at some 0.58.
[[stage]]
name = "squeeze"
friction = 0
strain_rates = [-5.0, -5.0, -5.0]     # dv_x/dx, dv_y/dy, dv_z/dz [1/s]
end = { strain = 0.19 }

# At constant volume; the pressure follows, and grows with the square of the rate.
[[stage]]
name = "shear"
friction = 0.3
shear_rates = [0.0, 20.0, 0.0]        # dv_x/dy, dv_x/dz, dv_y/dz [1/s]
end = { time = 0.1 }      # s: a shear strain of 2

[solver]
tolerance = 1e-3
overlap_correction = 0.1

[output]
every_steps = 250         # frames; cell.csv has stresses, solid fraction and inertial number of each step
)";

}  // namespace

const std::vector<SceneKind>& scene_kinds() {
  static const std::vector<SceneKind> kinds{
      {"triaxial", "a box of spheres is compacted and sheared", triaxial},
      {"silo", "grains fill a silo and drain from it", silo},
      {"drum", "grains in a drum that turns", drum},
      {"heap", "grains fall on a floor", heap},
      {"periodic", "a periodic cell of spheres is squeezed and sheared", periodic},
  };
  return kinds;
}

}  // namespace talus
