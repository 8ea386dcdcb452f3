#!/usr/bin/env python3
"""Runout of collapsing columns against height over length, beside Lube et al. (Phys. Rev. E 72 (2005) 041301).

    tests/bench/column_collapse.py OUT [--talus build/release/talus] [--ratios 0.5,1,2,4,8] [--finer F]
                                   [--set KEY=VALUE ...]

Runs apps/scenes/column-collapse.toml with a column of 0.1 m and as many grains as each ratio takes, and measures
where the deposit ends: in the middle of the first strip of two mean diameters, wherever it begins, that does not hold
half a layer of grains. --finer takes grains, the channel's width and time steps F times smaller, and so F^2 times as
many grains. Published, for many
materials in a channel: (end - length)/length = 1.2 a below a = 2.3 and 1.9 a^(2/3) above 2.8. Needs h5py. Exit code 1
where a runout is more than 10 % off.
"""

import argparse
import pathlib
import resource
import subprocess
import sys

import h5py
import numpy

LENGTH, WIDTH, RADIUS = 0.1, 0.024, 0.002  # [m]
TIME_STEP = 4e-4  # [s]
GRAINS_PER_RATIO = 4030
BAND = 0.1


def published(a):
    return 1.2 * a if a < 2.55 else 1.9 * a ** (2 / 3)


def frame(file, which):
    names = sorted(file["frames"])
    return file["frames"][names[which]]["bodies"]["x"][:]


def deposit_end(x, finer):
    """Where layers end [m]."""
    radius, width = RADIUS / finer, WIDTH / finer
    strip = 4 * radius
    ends = numpy.arange(strip, x[:, 0].max() + strip, 0.1 * radius)
    sorted_x = numpy.sort(x[:, 0])
    held = numpy.searchsorted(sorted_x, ends) - numpy.searchsorted(sorted_x, ends - strip)
    broken = numpy.flatnonzero(held < 0.5 * strip * width / (2 * radius) ** 2)
    # The middle of the first strip that does not hold half a layer.
    return (ends[broken[0]] if len(broken) else ends[-1]) - 0.5 * strip


def run(a, out, options):
    folder = out / f"ratio-{a:g}"
    command = [options.talus, "run", options.scene, "--out", folder, "--force", "--quiet", "--threads", "1"]
    finer = options.finer
    command += ["--set", f"sample.count={round(GRAINS_PER_RATIO * a * finer**2)}",
                "--set", f"sample.base=[{LENGTH}, {WIDTH / finer}]", "--set", f"time_step={TIME_STEP / finer}",
                "--set", f"sample.radius_min={0.9 * RADIUS / finer}", "--set", f"sample.radius_max={1.1 * RADIUS / finer}"]
    # The fall from the top, and as long again, several times over.
    command += ["--set", f"stage.collapse.end.time={0.5 + 4 * (2 * a * LENGTH / 9.81) ** 0.5:.2f}"]
    for setting in options.set:
        command += ["--set", setting]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    code = subprocess.run([str(word) for word in command]).returncode
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if code != 0:
        sys.exit(f"column_collapse: talus ended with exit code {code} at ratio {a:g}")
    return folder, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--talus", default="build/release/talus")
    parser.add_argument("--scene", default=pathlib.Path(__file__).parents[2] / "apps/scenes/column-collapse.toml")
    parser.add_argument("--ratios", default="0.5,1,2,4,8")
    parser.add_argument("--finer", type=float, default=1, metavar="F")
    parser.add_argument("--set", action="append", default=[])
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    right = True
    print("ratio  grains  runout  published   off  core-s")
    for text in options.ratios.split(","):
        folder, seconds = run(float(text), options.out, options)
        with h5py.File(folder / "results.h5") as file:
            first, last = frame(file, 0), frame(file, -1)
        a = (first[:, 2].max() + RADIUS / options.finer) / LENGTH
        runout = deposit_end(last, options.finer) / LENGTH - 1
        off = runout / published(a) - 1
        right &= abs(off) <= BAND
        print(f"{a:5.2f}  {len(last):6}  {runout:6.2f}  {published(a):9.2f}  {off:+4.0%}  {seconds:6.0f}", flush=True)
    sys.exit(0 if right else 1)


if __name__ == "__main__":
    main()
