#!/usr/bin/env python3
"""A heavy ball that falls on one grain on a floor, along a line: what restitution means when a light body is between.

    tests/bench/ball_on_grain.py [--talus build/release/talus --out FOLDER]

Ball, grain, floor and speed are those at the deepest place of the impact of Dosta et al. (2024): 10 mm of steel, 1 mm
of M1, 2.3 m/s, e = 0.4 between ball and grain and between grain and floor. Three models: viscoelastic contacts as in
the references (Hertz, damping after Tsuji et al. 1992 with the reduced mass of the pair), rigid bodies that collide
one pair after the other (event by event, exact), and, with --talus, the program, for a grain on the floor or above it.
"""

import argparse
import csv
import math
import pathlib
import subprocess

BALL, GRAIN, SPEED = 0.01, 0.001, 2.3  # radii [m], [m/s]
BALL_MASS = 7200 * 4 / 3 * math.pi * BALL**3
GRAIN_MASS = 2500 * 4 / 3 * math.pi * GRAIN**3


def hertz(radius, stiffness, mass, e):
    """Force [N] of an overlap [m] and its rate [m/s], for reduced radius, modulus and mass of the pair."""
    damping = -math.log(e) / math.hypot(math.log(e), math.pi)

    def force(overlap, rate):
        if overlap <= 0:
            return 0.0
        normal = 2 * stiffness * math.sqrt(radius * overlap)
        return max(0.0, 2 / 3 * normal * overlap + 2 * math.sqrt(5 / 6) * damping * math.sqrt(normal * mass) * rate)

    return force


def viscoelastic(e, grains):
    """Speed of the ball after, when it stands on so many grains alike."""
    soft, steel = (1 - 0.2**2) / 1e9, (1 - 0.2**2) / 210e9
    modulus = 1 / (soft + steel)
    upper = hertz(1 / (1 / BALL + 1 / GRAIN), modulus, 1 / (1 / BALL_MASS + 1 / GRAIN_MASS), e)
    lower = hertz(GRAIN, modulus, GRAIN_MASS, e)
    x, v, y, w, dt = 0.0, -SPEED, 0.0, 0.0, 2e-8
    while x <= 0 or v <= 0:
        above, below = upper(y - x, w - v), lower(-y, -w)
        v += above / (BALL_MASS / grains) * dt
        w += (below - above) / GRAIN_MASS * dt
        x, y = x + v * dt, y + w * dt
    return v


def events(e, gap, grains):
    """Speed of the ball after the last collision of rigid bodies; upwards positive."""
    mass = BALL_MASS / grains
    v, w = -SPEED, 0.0
    x, y = 0.0, 0.0  # room between ball and grain, and between grain and floor
    y = gap
    for _ in range(10**6):
        if x == 0 and v < w:
            relative = v - w
            common = (mass * v + GRAIN_MASS * w) / (mass + GRAIN_MASS)
            v = common - e * relative * GRAIN_MASS / (mass + GRAIN_MASS)
            w = common + e * relative * mass / (mass + GRAIN_MASS)
        elif y == 0 and w < 0:
            w = -e * w
        else:
            times = [x / (w - v) if w > v else math.inf, y / -w if w < 0 else math.inf]
            if min(times) == math.inf:
                break
            t = min(times)
            x = 0.0 if t == times[0] else x + (v - w) * t
            y = 0.0 if t == times[1] else y + w * t
        if abs(v) < 1e-9 * SPEED:
            break
    return v


def talus(options, e, gap, step):
    """The same by the program: the speed of the ball 2 ms after the first contact [m/s]."""
    folder = options.out / f"e{e}-gap{gap}-h{step}"
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "scene.toml").write_text(f"""time_step = {step}
[[material]]
name = "M1"
density = 2500
[[material]]
name = "steel"
density = 7200
[[pair]]
material = "M1"
with = "steel"
restitution = {e}
[[sample]]
kind = "body"
name = "grain"
radius = {GRAIN}
position = [0, 0, {GRAIN + gap}]
material = "M1"
[[sample]]
kind = "body"
name = "ball"
radius = {BALL}
position = [0, 0, {2 * GRAIN + gap + BALL + 0.00037}]
velocity = [0, 0, {-SPEED}]
material = "steel"
[[wall]]
name = "floor"
side = "z-"
position = 0
material = "steel"
[[stage]]
end = {{ time = 0.0025 }}
[output]
every = 1
fields = false
pictures = false
""")
    subprocess.run([options.talus, "run", folder / "scene.toml", "--out", folder / "results", "--force", "--quiet",
                    "--threads", "1"], check=False, stderr=subprocess.DEVNULL)
    with open(folder / "results" / "bodies.csv", newline="") as file:
        path = [(float(r["time"]), float(r["z"])) for r in csv.DictReader(file) if r["body"] == "ball"]
    (t0, z0), (t1, z1) = path[-6], path[-1]
    return (z1 - z0) / (t1 - t0)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--talus")
    parser.add_argument("--out", type=pathlib.Path)
    options = parser.parse_args()
    print("rebound over the speed before")
    for e in (0.4, 0.95):
        for grains in (1, 7, 20):
            print(f"e = {e}, {grains:2d} grains under the ball: viscoelastic {viscoelastic(e, grains) / SPEED:.2f}, "
                  f"rigid event by event {events(e, 0, grains) / SPEED:.3f}")
    if options.talus:
        for e in (0.4, 0.95):
            for gap in (0, 1e-4):
                for step in (1e-4, 1e-5):
                    print(f"Talus, e = {e}, grain {1000 * gap:g} mm above the floor, h = {step:g} s: "
                          f"{talus(options, e, gap, step) / SPEED:.2f}")


if __name__ == "__main__":
    main()
