#!/usr/bin/env python3
"""Discharge of a silo: Beverloo's law, two orifices, the head, no friction, a mesh, and looser solutions.

    tests/bench/silo.py published|ratio|orifices|head|fluid|mesh|tolerance OUT [--talus build/release/talus] [--set KEY=VALUE ...]

The silo is that of Dosta et al. (2024) with its materials: a tube of radius 0.1 m over a funnel of 45 degrees.
`published` and `ratio` fill it with 100,000 grains of 4 mm for each orifice. For the others, with grains of 6 mm, it is
filled once, on a funnel that goes on to a radius of 18 mm (OUT/fill-COUNT); each discharge begins from there, with the
funnel cut off at its orifice: what stood below falls, the rest flows. The rate is the slope of the number of grains
that have passed the orifice against time, from 0.2 s after the start until 55 % have left. Runs that stand in OUT with
the same scene are not run again. Exit code 1 where a number leaves its band.
"""

import argparse
import csv
import math
import pathlib
import resource
import struct
import subprocess
import sys

from dosta2024 import MATERIALS, pairs, silo_scene

GRAVITY = 9.8
RADIUS = 0.003  # of a grain [m]
TUBE = 0.1  # radius [m]
SHOULDER = 0.0145778  # height at which the funnel meets the tube [m]
FILL_RADIUS = 0.018  # where the funnel of the filling ends [m]
COUNT = 15000
BEVERLOO_K = 1.4  # Beverloo, Leniger and van de Velde (Chem. Eng. Sci. 15 (1961) 260)
BULK = 0.6  # solid fraction of a filling


def lip(radius):
    """Height of the funnel where it is as wide as `radius` [m]."""
    return SHOULDER - (TUBE - radius)


def tube(top):
    return f"""[[wall]]
name = "tube"
material = "steel"
shape = "cylinder"
inside = true
start = [0, 0, {SHOULDER}]
end = [0, 0, {top}]
radius = {TUBE}
"""


def funnel(radius):
    return f"""[[wall]]
name = "funnel"
material = "steel"
shape = "cone"
inside = true
start = [0, 0, {lip(radius)}]
end = [0, 0, {SHOULDER}]
start_radius = {radius}
end_radius = {TUBE}
"""


HEAD = f"""gravity = [0, 0, -{GRAVITY}]
time_step = 5e-4
allow_unconverged = true
{MATERIALS}{pairs()}"""
SOLVER = "[solver]\ntolerance = 1e-2\nbalance_tolerance = 0.2\noverlap_correction = 0.1\n"
OUTPUT = "[output]\nevery = 10\nfields = false\npictures = false\n"


NO_FRICTION = """[[stage.pair]]
material = "M1"
friction = 0
[[stage.pair]]
material = "M1"
with = "steel"
friction = 0
"""


def fill_scene(count):
    loose = count * 4 / 3 * math.pi * RADIUS**3 / (math.pi * TUBE**2) / 0.3
    return f"""{HEAD}{tube(SHOULDER + loose + 0.05)}{funnel(FILL_RADIUS)}
[[wall]]
name = "gate"
material = "steel"
side = "z-"
position = {lip(FILL_RADIUS)}
[[insert]]
name = "filling"
material = "M1"
radius = {RADIUS}
count = {count}
region = {{ shape = "cylinder", start = [0, 0, {SHOULDER}], end = [0, 0, {SHOULDER + loose}], radius = {TUBE} }}
[[stage]]
name = "fill"
end = {{ time = 0.8, equilibrium = 1e-2 }}
{SOLVER}{OUTPUT}"""


def drain_scene(state, radius, duration, walls, stage=""):
    return f"""{HEAD}{walls}
[[sample]]
kind = "state"
file = "{state.resolve()}"
[[remove]]
name = "out"
interval = 0.01
region = {{ shape = "beyond", point = [0, 0, {lip(radius) - 0.06}], normal = [0, 0, -1] }}
[[probe]]
name = "orifice"
every = 0.01
region = {{ shape = "disc", centre = [0, 0, {lip(radius)}], axis = [0, 0, -1], radius = {radius + 1e-4} }}
[[stage]]
name = "drain"
end = {{ time = {duration} }}
{stage}{SOLVER}{OUTPUT}contacts = false
"""


def rows(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def mesh(path, radius, sides, top):
    """STL of a shell of 2 mm around the space of the grains, a polygon of `sides` sides, of the area of the circle."""
    wide = math.sqrt(2 * math.pi / sides / math.sin(2 * math.pi / sides))
    inner = [(radius, lip(radius)), (TUBE, SHOULDER), (TUBE, top)]
    ring = [(r * wide, z) for r, z in inner] + [(r * wide + 0.002, z) for r, z in reversed(inner)]
    angles = [2 * math.pi * k / sides for k in range(sides)]
    points = [[(r * math.cos(a), r * math.sin(a), z) for a in angles] for r, z in ring]
    triangles = []
    for k, row in enumerate(points):
        after = points[(k + 1) % len(points)]
        for i in range(sides):
            j = (i + 1) % sides
            triangles += [(row[i], after[i], after[j]), (row[i], after[j], row[j])]
    with open(path, "wb") as file:
        file.write(bytes(80) + struct.pack("<I", len(triangles)))
        for corners in triangles:
            file.write(struct.pack("<12fH", 0, 0, 0, *(x for corner in corners for x in corner), 0))


class Runs:
    def __init__(self, options):
        self.options = options

    def run(self, name, scene, settings=()):
        """Results of a scene, and what they cost [core-seconds]."""
        folder = self.options.out / name
        changes = [*settings, *self.options.set]
        text = "".join(f"# --set {change}\n" for change in changes) + scene
        cost = folder / "core-seconds"
        if not (cost.exists() and (folder / "scene.toml").read_text() == text):
            folder.mkdir(parents=True, exist_ok=True)
            cost.unlink(missing_ok=True)
            (folder / "scene.toml").write_text(text)
            command = [self.options.talus, "run", folder / "scene.toml", "--out", folder / "results", "--force",
                       "--quiet", "--threads", "1"]
            for change in changes:
                command += ["--set", change]
            before = resource.getrusage(resource.RUSAGE_CHILDREN)
            code = subprocess.run([str(word) for word in command]).returncode
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            if code != 0:
                sys.exit(f"silo: talus ended with exit code {code} at {name}")
            cost.write_text(f"{after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime:.1f}\n")
        return folder / "results", float(cost.read_text())

    def filling(self, count=COUNT):
        return self.run(f"fill-{count}", fill_scene(count))[0] / "results.h5"

    def drain(self, name, radius, duration, count=COUNT, walls=None, stage="", settings=()):
        walls = tube(0.6) + funnel(radius) if walls is None else walls
        scene = drain_scene(self.filling(count), radius, duration, walls, stage)
        results, seconds = self.run(name, scene, settings)
        steps = rows(results / "steps.csv")
        return Discharge(name, results, count, seconds, len(steps),
                         sum(row["converged"] != "1" for row in steps), sum(int(row["iterations"]) for row in steps))


class Discharge:
    def __init__(self, name, results, count, seconds, steps, missed, sweeps):
        self.name, self.count, self.seconds = name, count, seconds
        self.steps, self.missed, self.sweeps = steps, missed, sweeps
        self.curve = [(float(r["time"]), int(r["passed_count"]))
                      for r in rows(results / "probes.csv") if r["probe"] == "orifice"]
        self.rate, self.furthest = slope([p for p in self.curve if p[0] >= 0.2 and p[1] <= 0.55 * count])

    def said(self):
        print(f"{self.name:28s} {self.rate:9.0f}/s, off a line by {self.furthest:5.0f} of {self.curve[-1][1]:6d}; "
              f"{self.missed} of {self.steps} steps missed, {self.sweeps / self.steps:.0f} sweeps a step, "
              f"{self.seconds:.0f} core-s", flush=True)


def slope(points):
    """Slope of the line of least squares, and how far off it the furthest point is."""
    n = len(points)
    mx, my = sum(p[0] for p in points) / n, sum(p[1] for p in points) / n
    b = sum((x - mx) * (y - my) for x, y in points) / sum((x - mx) ** 2 for x, y in points)
    return b, max(abs(y - my - b * (x - mx)) for x, y in points)


def verdict(name, value, band, inside):
    print(f"{name:58s} {value:10.4g}   {band:24s} {'holds' if inside else 'DOES NOT HOLD'}")
    return inside


def beverloo_rate(diameter):
    """Grains a second to be expected, for the duration of a run."""
    return 6100 * ((diameter - 2 * BEVERLOO_K * RADIUS) / (0.06 - 2 * BEVERLOO_K * RADIUS)) ** 2.5


def orifices(runs):
    diameters = [0.036, 0.042, 0.050, 0.060, 0.072]
    found = []
    for diameter in diameters:
        # Until 55 % have left, or for --longest.
        duration = round(min(runs.options.longest, 0.1 + 0.58 * COUNT / beverloo_rate(diameter)), 2)
        found.append(runs.drain(f"orifice-{1000 * diameter:.0f}", diameter / 2, duration))
        found[-1].said()
    d = 2 * RADIUS
    exponent, _ = slope([(math.log(D - BEVERLOO_K * d), math.log(f.rate)) for D, f in zip(diameters, found)])
    ok = verdict("exponent of D - 1.4 d", exponent, "2.5 +- 3 %", abs(exponent - 2.5) <= 0.075)
    # Q^(2/5) is a line in D that meets zero at k d.
    power = [(D, f.rate**0.4) for D, f in zip(diameters, found)]
    b, off = slope(power)
    mean = [sum(column) / len(power) for column in zip(*power)]
    k = (mean[0] - mean[1] / b) / d
    print(f"with the exponent 2.5: k = {k:.2f}, furthest off by {off / mean[1] * 2.5:.1%} of the mean rate")
    large, small = found[3].rate, found[0].rate
    print(f"rate at 60 mm over that at 36 mm {large / small:.2f}")
    return ok


def head(runs):
    full = runs.drain("orifice-50", 0.025, runs.options.longest)
    low = runs.drain("low-50", 0.025, min(1.0, runs.options.longest), count=COUNT * 2 // 3)
    full.said()
    low.said()
    ratio = low.rate / full.rate
    ok = verdict("rate with two thirds of the grains over that with all", ratio, "1 +- 3 %", abs(ratio - 1) <= 0.03)
    end = full.curve[-1][0]
    middle = (0.2 + end) / 2
    late = slope([p for p in full.curve if p[0] >= middle])[0] / slope(
        [p for p in full.curve if 0.2 <= p[0] <= middle])[0]
    return verdict("late over early in one discharge", late, "1 +- 3 %", abs(late - 1) <= 0.03) and ok


def head_of(count, radius):
    """Height over the orifice of so many grains of solid fraction BULK, with a level surface [m]."""
    volume = count * 4 / 3 * math.pi * RADIUS**3 / BULK
    part = math.pi / 3 * (TUBE**3 - radius**3)  # of the funnel, at 45 degrees
    if volume > part:
        return TUBE - radius + (volume - part) / (math.pi * TUBE**2)
    return (3 * volume / math.pi + radius**3) ** (1 / 3) - radius


def fluid(runs):
    """Without friction: v = c (2 g head)^(1/2) with a c that does not depend on the head."""
    radius = 0.025
    rough = runs.drain("orifice-50", radius, runs.options.longest)
    smooth = runs.drain("smooth-50", radius, 0.8, stage=NO_FRICTION)
    rough.said()
    smooth.said()
    discharge = []
    end = smooth.curve[-1][0]
    for k in range(3):
        window = [p for p in smooth.curve if 0.2 + k / 3 * (end - 0.2) <= p[0] <= 0.2 + (k + 1) / 3 * (end - 0.2)]
        depth = head_of(smooth.count - sum(p[1] for p in window) / len(window), radius)
        grains = math.pi * radius**2 * math.sqrt(2 * GRAVITY * depth) * BULK / (4 / 3 * math.pi * RADIUS**3)
        discharge.append((depth, slope(window)[0], slope(window)[0] / grains))
        print("head {:.4f} m: {:.0f}/s, c = {:.3f}".format(*discharge[-1]))
    power, _ = slope([(math.log(depth), math.log(rate)) for depth, rate, _ in discharge])
    ratio = smooth.rate / rough.rate
    ok = verdict("rate without friction over that with", ratio, ">= 1.3", ratio >= 1.3)
    return verdict("exponent of the head", power, "0.5 +- 0.1", abs(power - 0.5) <= 0.1) and ok


def mesh_case(runs):
    exact = runs.drain("orifice-60", 0.03, min(1.3, runs.options.longest))
    runs.options.out.mkdir(parents=True, exist_ok=True)
    file = (runs.options.out / "silo.stl").resolve()
    mesh(file, 0.03, 96, 0.6)
    wall = f'[[wall]]\nname = "silo"\nmaterial = "steel"\nshape = "mesh"\nfile = "{file}"\n'
    faceted = runs.drain("mesh-60", 0.03, min(1.3, runs.options.longest), walls=wall)
    exact.said()
    faceted.said()
    ratio = faceted.rate / exact.rate
    return verdict("rate of the mesh over that of cylinder and cone", ratio, "1 +- 1 %", abs(ratio - 1) <= 0.01)


def tolerance(runs):
    print("tolerance  balance  step [s]   rate [1/s]  sweeps a step  missed  core-s")
    for h in (2.5e-4, 5e-4, 1e-3):
        for bound, balance in ((1e-2, 0.2), (1e-2, 0.05), (1e-3, 0.05), (1e-4, 0.005)):
            run = runs.drain(f"tolerance-{bound:g}-{balance:g}-{h:g}", 0.025, 0.7, settings=[
                f"time_step={h:g}", f"solver.tolerance={bound:g}", f"solver.balance_tolerance={balance:g}"])
            print(f"{bound:9.0e}  {balance:7g}  {h:8.1e}   {run.rate:10.0f}  {run.sweeps / run.steps:13.0f}  "
                  f"{run.missed / run.steps:6.1%}  {run.seconds:6.0f}", flush=True)
    return True


def published_discharge(runs, name, orifice, duration):
    """The published case, but for grains above z = 0.053 m, which are taken away when it opens: some 40,000 are left."""
    scene = silo_scene(None, None, orifice)
    parts = [scene.index(f"[[{part}]]") for part in ("insert", "remove", "probe", "stage")]
    gate, drain = scene.index('[[wall]]\nname = "gate"'), scene.index('[[stage]]\nname = "drain"')
    solver = scene.index("[solver]")
    filled = runs.run(f"fill-{name}", scene[:parts[1]] + scene[scene.index("[[wall]]"):drain].replace(
        'until_stage = "drain"\n', "") + scene[solver:])[0]
    state = f'[[sample]]\nkind = "state"\nfile = "{(filled / "results.h5").resolve()}"\n'
    cut = ('[[remove]]\nname = "above"\nat = [0]\n'
           'region = { shape = "beyond", point = [0, 0, 0.053], normal = [0, 0, 1] }\n')
    left = '[[probe]]\nname = "left"\nregion = { shape = "beyond", point = [0, 0, 1], normal = [0, 0, -1] }\n'
    results, seconds = runs.run(name, scene[:parts[0]] + state + cut + scene[parts[1]:gate] + left
                                + scene[parts[2]:parts[3]] + scene[drain:], [f"stage.drain.end.time={duration}"])
    probes = rows(results / "probes.csv")
    count = max(int(row["count"]) for row in probes if row["probe"] == "left")
    steps = rows(results / "steps.csv")
    found = Discharge(name, results, count, seconds, len(steps),
                      sum(row["converged"] != "1" for row in steps), sum(int(row["iterations"]) for row in steps))
    found.said()
    return found


def published(runs):
    found = published_discharge(runs, "published", 0.03, 0.5)
    return verdict("rate [grains/s]", found.rate, "23,200 +- 5 %", abs(found.rate - 23200) <= 0.05 * 23200)


def ratio(runs):
    """Large orifice over small one, of 60 and 40 mm, from fillings of their own."""
    large = published_discharge(runs, "published-large", 0.03, 0.8)
    small = published_discharge(runs, "published-small", 0.02, 2.0)
    found = large.rate / small.rate
    return verdict("rate of the large orifice over the small one's", found, "3.10 +- 0.06", abs(found - 3.10) <= 0.06)


STUDIES = {"published": published, "ratio": ratio, "orifices": orifices, "head": head, "fluid": fluid, "mesh": mesh_case, "tolerance": tolerance}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("study", choices=STUDIES)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--talus", default="build/release/talus")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    parser.add_argument("--longest", type=float, default=1.5, help="duration of a discharge, at most [s]")
    options = parser.parse_args()
    sys.exit(0 if STUDIES[options.study](Runs(options)) else 1)


if __name__ == "__main__":
    main()
