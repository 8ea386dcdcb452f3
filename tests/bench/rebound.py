#!/usr/bin/env python3
"""What the rebound of the ball in the impact of Dosta et al. (2024) depends on: restitution, its law, the time step.

    tests/bench/rebound.py DATA OUT [--talus build/release/talus] [--only NAME ...]

Runs the case of `dosta2024.py impact` until 0.028 s, when the ball is 4 mm from its deepest place (OUT/before, taken as
it is when it stands), and from there, once for each variant, until 0.034 s. Prints the velocity of the ball every half
millisecond. Needs h5py. ball_on_grain.py has the closed case of one grain below the ball.
"""

import argparse
import pathlib
import resource
import subprocess

import h5py

from dosta2024 import impact_scene

BEFORE, AFTER = 0.028, 0.006  # [s]
M1_STEEL = "pair.3.restitution"  # the ball and the floor are steel
VARIANTS = {
    "as published": [],
    "M1-steel 0.95": [f"{M1_STEEL}=0.95"],
    "h over 4": ["time_step=2.5e-5"],
    "h over 10": ["time_step=1e-5"],
    "Newton's law": ["solver.restitution_law=newton"],
    "Newton's law, M1-steel 0.95": ["solver.restitution_law=newton", f"{M1_STEEL}=0.95"],
    "M1-steel 0.95, h over 4": ["time_step=2.5e-5", f"{M1_STEEL}=0.95"],
}


def talus(options, scene, out, settings):
    command = [options.talus, "run", scene, "--out", out, "--force", "--quiet", "--threads", "1"]
    for change in settings:
        command += ["--set", change]
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    code = subprocess.run([str(word) for word in command], stderr=subprocess.DEVNULL).returncode
    if code not in (0, 3):  # 3: steps that missed, by overlaps
        raise SystemExit(f"rebound: talus ended with exit code {code}: {out}")
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=pathlib.Path)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--talus", default="build/release/talus")
    parser.add_argument("--only", nargs="+", choices=VARIANTS, default=list(VARIANTS), metavar="NAME",
                        help="variants, as printed")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    state = options.out / "before" / "results.h5"
    scene = impact_scene(options.data, options.out).replace("contacts = false", "contacts = true")
    (options.out / "before.toml").write_text(scene)
    if not state.exists():
        talus(options, options.out / "before.toml", state.parent,
              [f"stage.impact.end.time={BEFORE}", "output.every=1"])
    # The ball, which a state does not name, is the last body.
    samples, walls = scene.index("[[sample]]"), scene.index("[[wall]]")
    late = f'[[sample]]\nkind = "state"\nfile = "{state.resolve()}"\n'
    (options.out / "late.toml").write_text(scene[:samples] + late + scene[walls:])
    for name, settings in VARIANTS.items():
        if name not in options.only:
            continue
        out = options.out / name.replace(" ", "-").replace(",", "").replace("'", "")
        seconds = talus(options, options.out / "late.toml", out,
                        ["output.every=5e-4", "output.contacts=false", f"stage.impact.end.time={AFTER}", *settings])
        with h5py.File(out / "results.h5") as file:
            path = [file["frames"][frame]["bodies"]["u"][-1, 2] for frame in sorted(file["frames"])]
        print(f"{name:28s} {' '.join(f'{v:5.2f}' for v in path)}  {seconds:.0f} core-s", flush=True)


if __name__ == "__main__":
    main()
