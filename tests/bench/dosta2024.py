#!/usr/bin/env python3
"""Impact, drum and silo of Dosta et al. (Comput. Phys. Commun. 296 (2024) 109066), run with Talus and compared.

    tests/bench/dosta2024.py impact DATA OUT [--talus build/release/talus] [--set KEY=VALUE ...]
    tests/bench/dosta2024.py drum   DATA OUT ...
    tests/bench/dosta2024.py silo   DATA OUT ...

DATA is a folder with the published files (impact-25k-spheres.csv, drum-spheres.csv and the references' curves). The
silo makes its own filling, 100,000 grains that fall from a loose cloud, and opens its gate after SILO_FILL. The
scene and its grains are written to OUT, the results to OUT/results; then the curves are compared (with --only-compare
those of an earlier run). Exit code 1 where a number leaves its band. `impact --seeds N` runs the case N times, each
time with the grains shifted by up to 1e-9 m, and prints what each gives and their scatter. `impact --count N` lets
the ball fall onto an own filling of N grains, deposited and then left to come to rest; no curve of the
references goes with it.
"""

import argparse
import csv
import math
import pathlib
import random
import resource
import statistics
import subprocess
import sys

MATERIALS = """
[[material]]
name = "M1"
density = 2500
[[material]]
name = "M2"
density = 2000
[[material]]
name = "steel"
density = 7200
"""
# restitution, friction; the walls are steel
PAIRS = {
    ("M1", "M1"): (0.5, 0.3),
    ("M1", "M2"): (0.45, 0.2),
    ("M2", "M2"): (0.4, 0.4),
    ("M1", "steel"): (0.4, 0.2),
    ("M2", "steel"): (0.4, 0.2),
    ("steel", "steel"): (0.6, 0.5),
}


def pairs():
    return "".join(
        f'[[pair]]\nmaterial = "{a}"\nwith = "{b}"\nrestitution = {e}\nfriction = {mu}\n'
        for (a, b), (e, mu) in PAIRS.items()
    )


def plane(name, position):
    return f'[[wall]]\nname = "{name}"\nposition = {position}\nmaterial = "steel"\n'


def rows(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def write_grains(path, spheres, material):
    with open(path, "w") as file:
        file.write("id,x,y,z,radius,material\n")
        for s in spheres:
            file.write(f"{s['id']},{s['x']},{s['y']},{s['z']},{s['radius']},{material(s)}\n")


def shifted(spheres, seed):
    """The spheres, each shifted by up to 1e-9 m along every axis; with seed 0 as they are."""
    draws = random.Random(seed)
    for s in spheres if seed else []:
        s.update({axis: repr(float(s[axis]) + draws.uniform(-1e-9, 1e-9)) for axis in "xyz"})
    return spheres


PUBLISHED_BED = """[[sample]]
kind = "bodies"
file = "grains.csv"
[[sample]]
kind = "body"
name = "ball"
position = [0, 0, 0.06]
radius = 0.01
velocity = [0, 0, -5]
material = "steel"
"""


def own_bed(count):
    return f"""[[sample]]
kind = "deposition"
count = {count}
base = [0.098, 0.06]
origin = [-0.049, -0.03, -0.090243]
radius_distribution = "uniform"
radius_min = 0.00099
radius_max = 0.00101
material = "M1"
[[insert]]
name = "ball"
material = "steel"
radius = 0.01
count = 1
velocity = [0, 0, -5]
stage = "impact"
track = true
region = {{ shape = "disc", centre = [0, 0, 0.06], radius = 0.01 }}
[[stage]]
name = "settle"
end = {{ equilibrium = 1e-2, time = 0.1 }}
"""


def impact_scene(data, out, seed=0, count=0):
    if not count:
        write_grains(out / "grains.csv", shifted(rows(data / "impact-25k-spheres.csv"), seed), lambda s: "M1")
    return f"""name = "impact"
time_step = 1e-4
gravity = [0, 0, -9.8]
{MATERIALS}{pairs()}
{own_bed(count) if count else PUBLISHED_BED}
{plane("x-", -0.049)}{plane("x+", 0.049)}{plane("y-", -0.03)}{plane("y+", 0.03)}{plane("z-", -0.090243)}
[[stage]]
name = "impact"
end = {{ time = 0.1 }}
[solver]
tolerance = 1e-2
[output]
every = 5e-3
fields = false
contacts = false
pictures = false
"""


def drum_scene(data, out):
    write_grains(out / "grains.csv", rows(data / "drum-spheres.csv"),
                 lambda s: "M2" if float(s["radius"]) > 0.0015 else "M1")
    return f"""name = "drum"
time_step = 1e-3
gravity = [0, 0, -9.8]
{MATERIALS}{pairs()}
[sample]
kind = "bodies"
file = "grains.csv"
[[group]]
name = "drum"
[[group.motion]]
kind = "rotation"
axis = [0, 1, 0]
point = [0, 0, 0]
rate = -2.0
[[wall]]
name = "shell"
group = "drum"
shape = "cylinder"
start = [0, -0.03, 0]
end = [0, 0.03, 0]
radius = 0.1
inside = true
material = "steel"
[[wall]]
name = "front"
group = "drum"
side = "y-"
position = -0.03
material = "steel"
[[wall]]
name = "back"
group = "drum"
side = "y+"
position = 0.03
material = "steel"
[[probe]]
name = "zone-2"
every = 0.05
region = {{ shape = "box", low = [-0.1, -0.03, -0.1], high = [0, 0.03, 0] }}
[[stage]]
name = "turn"
end = {{ time = 5.0 }}
[solver]
tolerance = 1e-2
balance_tolerance = 0.2
overlap_tolerance = 0.3
overlap_correction = 0.1
[output]
every = 0.05
fields = false
contacts = false
pictures = false
"""


SILO_FILL = 0.32  # [s]; what is left of the kinetic energy then is a thousandth of a joule
SILO_COUNT = 100000


def silo_scene(data, out, orifice=0.03):
    """The published silo, whose funnel of 45 degrees ends at an orifice of this radius [m]: 0.03, large, or 0.02, small."""
    lip = 0.0145778 - (0.1 - orifice)
    return f"""name = "silo-100k"
time_step = 5e-4
gravity = [0, 0, -9.8]
allow_unconverged = true
{MATERIALS}{pairs()}
[[insert]]
name = "filling"
material = "M1"
radius = 0.002
count = {SILO_COUNT}
stage = "fill"
region = {{ shape = "cylinder", start = [0, 0, 0.0145778], end = [0, 0, 0.37], radius = 0.1 }}
[[remove]]
name = "out"
stage = "drain"
interval = 0.01
region = {{ shape = "beyond", point = [0, 0, {lip - 0.045:.7f}], normal = [0, 0, -1] }}
[[wall]]
name = "tube"
shape = "cylinder"
inside = true
start = [0, 0, 0.0145778]
end = [0, 0, 0.42]
radius = 0.1
material = "steel"
[[wall]]
name = "funnel"
shape = "cone"
inside = true
start = [0, 0, {lip:.7f}]
end = [0, 0, 0.0145778]
start_radius = {orifice}
end_radius = 0.1
material = "steel"
[[wall]]
name = "gate"
side = "z-"
position = {lip:.7f}
until_stage = "drain"
material = "steel"
[[probe]]
name = "orifice"
every = 0.01
region = {{ shape = "disc", centre = [0, 0, {lip:.7f}], axis = [0, 0, -1], radius = {orifice + 1e-4:.4f} }}
[[stage]]
name = "fill"
end = {{ time = {SILO_FILL} }}
[[stage]]
name = "drain"
end = {{ time = 4.5 }}
[solver]
tolerance = 1e-2
balance_tolerance = 0.2
overlap_correction = 0.1
[output]
every = 10
fields = false
pictures = false
"""


def curves(path, key):
    found = {}
    for row in rows(path):
        found.setdefault(row["code"], []).append((float(row["t"]), float(row[key])))
    return found


def at(curve, t):
    for (t0, v0), (t1, v1) in zip(curve, curve[1:]):
        if t0 <= t <= t1:
            return v0 + (v1 - v0) * (t - t0) / (t1 - t0)
    return None


def said(name, value, band, inside):
    print(f"{name:46s} {value:12.5g}   {band:28s} {'holds' if inside else 'DOES NOT HOLD'}")
    return inside


def ball_of(results):
    return [(float(r["time"]), float(r["z"])) for r in rows(results / "bodies.csv") if r["body"] == "ball"]


def rebound_speed(curve):
    """Of the ball after it has met the floor, mean from 0.035 to 0.045 s [m/s]."""
    return (at(curve, 0.045) - at(curve, 0.035)) / 0.01


def impact_seeds(args):
    """What each seed gives, beside the references."""
    found = []
    for seed in range(1, args.seeds + 1):
        folder = args.out / f"seed-{seed}"
        code, seconds = run(args, impact_scene, folder, seed=seed)
        if code not in (0, 3):
            return code
        ball = ball_of(folder / "results")
        # Where it turns: a ball that does not rebound may sink on in the 0.06 s that are left.
        time, lowest = min((row for row in ball if row[0] <= 0.035), key=lambda row: row[1])
        found.append((lowest - 0.06, time, rebound_speed(ball)))
        print("seed {}: deepest {:.4f} m at {:.4f} s, rebound {:.3f} m/s".format(seed, *found[-1])
              + f"; exit code {code}, {seconds:.0f} core-s", flush=True)
    for name, values in zip(("deepest [m]", "at [s]", "rebound [m/s]"), zip(*found)):
        print(f"{name:14s} mean {statistics.mean(values):.4f}, scatter {statistics.pstdev(values):.4f}, "
              f"{min(values):.4f} to {max(values):.4f}")
    return 0


def impact_count(args):
    """A filling of `args.count` grains: how deep the ball gets, when, and where it is at the end."""
    code, seconds = run(args, impact_scene, args.out, count=args.count)
    if code not in (0, 3):
        return code
    ball = ball_of(args.out / "results")
    start = ball[0][0]
    time, lowest = min(ball, key=lambda row: row[1])
    steps = [r for r in rows(args.out / "results" / "steps.csv") if float(r["time"]) > start]
    print(f"{args.count} grains: deepest {lowest - 0.06:.4f} m at {time - start:.4f} s, "
          f"{ball[-1][1] - 0.06:.4f} m at the end; {sum(r['converged'] != '1' for r in steps)} of {len(steps)} steps "
          f"of the impact missed, {sum(int(r['iterations']) for r in steps) / len(steps):.0f} sweeps a step; "
          f"exit code {code}, {seconds:.0f} core-s")
    return 0


def compare_impact(data, results):
    ball = ball_of(results)
    references = curves(data / "impact-25k-ball.csv", "z")
    # The references' clocks differ by what they fall in 0.05 ms before the first row.
    worst = max(abs(z - sum(known) / len(known))
                for t, z in ball if t <= 0.03
                for known in [[v for v in (at(c, t) for c in references.values()) if v is not None]] if known)
    deepest = min(ball, key=lambda row: row[1])
    ok = said("deepest, z - 0.06 [m]", deepest[1] - 0.06, "-0.1385 +- 0.002", abs(deepest[1] - 0.06 + 0.1385) <= 0.002)
    ok &= said("at [s]", deepest[0], "0.030 +- 0.001", abs(deepest[0] - 0.030) <= 0.001)
    ok &= said("falling curve to 0.03 s, furthest off [m]", worst, "<= 0.0015 of the mean", worst <= 0.0015)
    print(f"{'speed of the rebound, 0.035 to 0.045 s [m/s]':46s} {rebound_speed(ball):12.3g}   "
          + ", ".join(f"{code} {rebound_speed(c):.3g}" for code, c in references.items()))
    return ok


def maxima(curve):
    """Of a curve of a period of about 2 s: highest points with nothing higher within 0.7 s."""
    return [(t, v) for t, v in curve if t >= 0.3 and all(v >= w for s, w in curve if abs(s - t) <= 0.7)]


def wall_layer(results):
    """Mean velocity along the shell of the grains that lie on it below the bed, over the shell's; for each frame."""
    import h5py
    import numpy
    found = []
    with h5py.File(results / "results.h5") as file:
        for name in sorted(file["frames"]):
            frame = file["frames"][name]
            bodies = frame["bodies"]
            x, u, radius = bodies["x"][:], bodies["u"][:], bodies["radius"][:]
            distance = numpy.hypot(x[:, 0], x[:, 2])
            below = math.atan2(x[:, 2].mean(), x[:, 0].mean())
            aside = numpy.angle(numpy.exp(1j * (numpy.arctan2(x[:, 2], x[:, 0]) - below)))
            layer = (0.1 - radius - distance < 0.25 * radius) & (abs(aside) < math.pi / 6)
            # omega is -2 rad/s about y, which turns z into x.
            along = -2.0 * (x[:, 2] * u[:, 0] - x[:, 0] * u[:, 2]) / distance / (2.0 * 2.0 * 0.1)
            found.append((float(frame.attrs["time"]), float(along[layer].mean()), int(layer.sum())))
    return found


def compare_drum(data, results):
    own = [(float(r["time"]), int(r["count_M1"])) for r in rows(results / "probes.csv")]
    references = curves(data / "drum-zones.csv", "z2_m1")
    print("t [s]  M1 in zone 2: Talus, " + ", ".join(references))
    for t, count in own:
        print(f"{t:5.2f}  {count:6d}  " + "  ".join(f"{at(c, t) or 0:7.0f}" for c in references.values()))
    print("t [s]  grains on the shell, their velocity over the shell's")
    layer = wall_layer(results)
    for t, ratio, count in layer:
        print(f"{t:5.2f}  {count:5d}  {ratio:.3f}")
    ok = said("wall layer over the wall, mean from 0.3 s on", sum(v for t, v, _ in layer if t >= 0.3) /
              sum(t >= 0.3 for t, _, _ in layer), ">= 0.9", all(v >= 0.9 for t, v, _ in layer if t >= 0.3))
    tops = {code: maxima(c) for code, c in references.items()}
    for k, (t, v) in enumerate(maxima(own)[:3]):
        known = [peaks[k] for peaks in tops.values() if len(peaks) > k]
        mean = sum(p[1] for p in known) / len(known)
        ok &= said(f"maximum {k + 1} at {t:.2f} s", v, f"{mean:.0f} +- 10 %", abs(v - mean) <= 0.1 * mean)
    return ok


def line(points):
    """Slope of the line of least squares, and how far off it the furthest point is."""
    mt, mv = sum(t for t, _ in points) / len(points), sum(v for _, v in points) / len(points)
    b = sum((t - mt) * (v - mv) for t, v in points) / sum((t - mt) ** 2 for t, _ in points)
    return b, max(abs(v - mv - b * (t - mt)) for t, v in points)


def compare_silo(data, results):
    own = [(float(r["time"]) - SILO_FILL, SILO_COUNT - int(r["passed_count"]))
           for r in rows(results / "probes.csv") if r["probe"] == "orifice" and float(r["time"]) > SILO_FILL]
    references = curves(data / "silo-large-m1-count.csv", "count")
    print("t [s]  grains above the orifice: Talus, " + ", ".join(references))
    for t, count in own[19::20]:
        print(f"{t:5.2f}  {count:6d}  " + "  ".join(f"{at(c, t) or 0:7.0f}" for c in references.values()))
    slopes = {}
    for code, curve in {"Talus": own, **references}.items():
        # From a tenth to seven tenths of what leaves: the flow has begun, and the funnel is still full.
        rate, off = line([(t, v) for t, v in curve if 0.3 * SILO_COUNT <= v <= 0.9 * SILO_COUNT])
        slopes[code] = -rate
        print(f"{code}: {-rate:.0f} grains a second, furthest off the line by {off:.0f} grains")
    steps = [r for r in rows(results / "steps.csv") if float(r["time"]) > SILO_FILL]
    print(f"discharge: {sum(r['converged'] != '1' for r in steps)} of {len(steps)} steps missed, "
          f"{sum(int(r['iterations']) for r in steps) / len(steps):.0f} sweeps a step")
    return said("rate [grains/s]", slopes["Talus"], "23,200 +- 5 %", abs(slopes["Talus"] - 23200) <= 0.05 * 23200)


CASES = {"impact": (impact_scene, compare_impact), "drum": (drum_scene, compare_drum),
         "silo": (silo_scene, compare_silo)}


def run(args, scene, out, **choices):
    """Runs a scene into out/results: exit code and core-seconds."""
    out.mkdir(parents=True, exist_ok=True)
    (out / "scene.toml").write_text(scene(args.data, out, **choices))
    command = [args.talus, "run", str(out / "scene.toml"), "--out", str(out / "results"), "--force",
               "--threads", args.threads]
    for change in args.set:
        command += ["--set", change]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    code = subprocess.run(command).returncode
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return code, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("case", choices=CASES)
    parser.add_argument("data", type=pathlib.Path)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--talus", default="build/release/talus")
    parser.add_argument("--threads", default="1")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    parser.add_argument("--only-compare", action="store_true")
    parser.add_argument("--seeds", type=int, default=0, metavar="N", help="impact: so many runs from shifted grains")
    parser.add_argument("--count", type=int, default=0, metavar="N", help="impact: an own filling of N grains")
    args = parser.parse_args()
    scene, compare = CASES[args.case]
    if (args.seeds or args.count) and args.case != "impact":
        parser.error("--seeds and --count are for the impact")
    if args.seeds and args.count:
        parser.error("--seeds shifts the published bed: it takes no --count")
    if args.seeds or args.count:
        return impact_count(args) if args.count else impact_seeds(args)
    if not args.only_compare:
        code, seconds = run(args, scene, args.out)
        print(f"exit code {code}, {seconds:.1f} core-seconds")
        if code not in (0, 3):
            return code
    return 0 if compare(args.data, args.out / "results") else 1


if __name__ == "__main__":
    sys.exit(main())
