#!/usr/bin/env python3
"""What a true error costs: processor time of runs beside the errors of their steps, found without Talus's solver.

    tests/bench/true_error_cost.py OUT SCENE... --talus NAME=PROGRAM [NAME=PROGRAM ...] [--tolerances T ...]
        [--balance T] [--steps N] [--last] [--repeat N] [--set KEY=VALUE ...]

Every scene is run on one thread by every program with solver.tolerance and solver.balance_tolerance at each of the
tolerances: once with all steps in results.h5, whose contact problems are then made anew from the state before
(step_reference.py: which scenes, which errors) and solved (step_solvers.py: how); and --repeat times without output,
programs in turn, for the time. One line a run goes to OUT/rows.csv, one a judged step to OUT/steps.csv, with the units
in the heads of the columns; "certified" steps are those that Talus says have converged. Says so where the contacts or
velocities made anew are not the program's. Needs numpy, scipy, h5py, numba.
"""

import argparse
import csv
import math
import pathlib
import resource
import statistics
import subprocess

import step_reference

QUIET = ["output.every_steps=1000000", "output.stage_frames=false", "output.contacts=false", "output.fields=false",
         "output.pictures=false"]
WHOLE = ["output.every_steps=1", "output.stage_frames=true", "output.contacts=true", "output.fields=false",
         "output.pictures=false"]
FINISHED = (0, 3)  # exit codes: done, done with steps that missed their tolerance
MEASURES = ("V", "wf", "cf")
COLUMNS = ["scene", "program", "settings", "tolerance [1]", "balance_tolerance [1]", "exit", "steps [1]", "judged [1]",
           "missed [1]", "sweeps [1]", "processor [s]", "processor_least [s]", "processor_most [s]", "repeats [1]",
           "elapsed_in_steps [s]", "V [1]", "wf [1]", "cf [1]", "V_certified [1]", "wf_certified [1]",
           "cf_certified [1]", "unknown [1]", "reference_undone [1]"]
STEP_COLUMNS = ["scene", "program", "settings", "tolerance", "step", "certified", "error_rms", "balance", *MEASURES,
                "own", "strange", "undone", "way", "contacts"]


def run(program, scene, out, settings, options):
    """Runs a scene. Returns exit code (None: out of time) and processor time [s]."""
    command = [program, "run", scene, "--out", out, "--force", "--threads", "1"]
    command += ["--steps", options.steps] if options.steps else []
    for change in settings:
        command += ["--set", change]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    try:
        code = subprocess.run([str(word) for word in command], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                              timeout=options.limit).returncode
    except subprocess.TimeoutExpired:
        code = None
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return code, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def table(path):
    with open(path, newline="") as file:
        return [{key: float(value) for key, value in row.items()} for row in csv.DictReader(file)]


def judge(out, wanted, seconds):
    """True errors of the steps of a run, of those `wanted` (None: all), and the rows of its steps.csv."""
    scene = step_reference.Scene(out / "scene.resolved.toml")
    rows = table(out / "steps.csv")
    frames = step_reference.read_frames(out / "results.h5", wanted)
    found = []
    for row in rows:
        step = int(row["step"])
        if step not in frames or step - 1 not in frames or (wanted and step not in wanted):
            continue
        after = next(f for f in frames[step] if "pairs" in f)
        errors = step_reference.true_errors(scene, frames[step - 1][-1], after, seconds)
        found.append({"step": step, "certified": int(row["converged"]), "error_rms": row["error_rms"],
                      "balance": row["balance"], **errors})
    return found, rows


def worst(found, measure, certified=False):
    return max((f[measure] for f in found if not math.isnan(f[measure]) and (f["certified"] or not certified)),
               default=math.nan)


def measure(options, name, program, scene, tolerance):
    """Runs a scene with output and judges it. Returns a row without times, the errors of steps, the settings, and
    with --last the time, as the run wrote next to nothing."""
    balance = options.balance or tolerance
    settings = [f"solver.tolerance={tolerance}", f"solver.balance_tolerance={balance}", *options.set]
    output = [f"output.every_steps={options.steps - 1}", *WHOLE[1:]] if options.last else WHOLE
    folder = options.out / "run"
    code, seconds = run(program, scene, folder, settings + output, options)
    row = dict.fromkeys(COLUMNS, "")
    row.update({"scene": scene.stem, "program": name, "settings": " ".join(options.set), "tolerance [1]": tolerance,
                "balance_tolerance [1]": balance, "exit": "out of time" if code is None else code})
    found = []
    if code is None:
        row["processor [s]"] = f"{seconds:.4g}"
    if code in FINISHED:
        found, rows = judge(folder, {options.steps} if options.last else None, options.reference_seconds)
        row.update({"steps [1]": len(rows), "judged [1]": len(found),
                    "missed [1]": sum(not int(r["converged"]) for r in rows),
                    "sweeps [1]": int(sum(r["iterations"] for r in rows)),
                    "unknown [1]": sum(math.isnan(f["V"]) for f in found),
                    "reference_undone [1]": f"{worst(found, 'undone'):.1e}"})
        for m in MEASURES:
            row[f"{m} [1]"] = f"{worst(found, m):.3e}"
            row[f"{m}_certified [1]"] = f"{worst(found, m, True):.3e}"
        strange = sum(f["strange"] for f in found)
        own = worst(found, "own")
        if strange or own > 1e-9:
            print(f"{scene.stem}, {name}: the law is not the program's: {strange} contacts, {own:.1e}", flush=True)
    (folder / "results.h5").unlink(missing_ok=True)
    return row, found, settings, [seconds] if options.last else []


def take_times(options, entries):
    """Times of runs without output, in turn; entries: (row, program, scene, settings, times that there are)."""
    folder = options.out / "run"
    elapsed = [math.inf] * len(entries)
    for _ in range(options.repeat - options.last):
        for k, (row, program, scene, settings, times) in enumerate(entries):
            if row["exit"] not in FINISHED or sum(times) > options.limit:
                continue
            code, seconds = run(program, scene, folder, settings + QUIET, options)
            times.append(seconds)
            if code in FINISHED:
                elapsed[k] = min(elapsed[k], sum(r["wall_s"] for r in table(folder / "steps.csv")))
    for (row, _, _, _, times), inside in zip(entries, elapsed):
        if times:
            row.update({"processor [s]": f"{statistics.median(times):.4g}", "processor_least [s]": f"{min(times):.4g}",
                        "processor_most [s]": f"{max(times):.4g}", "repeats [1]": len(times),
                        "elapsed_in_steps [s]": "" if math.isinf(inside) else f"{inside:.4g}"})


def compare(options, scene, tolerance):
    """All programs on one scene: rows, and rows of steps."""
    entries, judged = [], []
    for name, program in (word.split("=", 1) for word in options.talus):
        row, found, settings, times = measure(options, name, program, scene, tolerance)
        entries.append((row, program, scene, settings, times))
        judged += [{"scene": scene.stem, "program": name, "settings": row["settings"], "tolerance": tolerance, **f}
                   for f in found]
    take_times(options, entries)
    return [entry[0] for entry in entries], judged


def write(path, columns, rows):
    """Adds rows to a table, with a head where it has none."""
    with open(path, "a", newline="") as file:
        writer = csv.DictWriter(file, columns)
        if file.tell() == 0:
            writer.writeheader()
        writer.writerows(rows)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("scenes", type=pathlib.Path, nargs="+", metavar="SCENE")
    parser.add_argument("--talus", nargs="+", default=["talus=build/release/talus"], metavar="NAME=PROGRAM")
    parser.add_argument("--tolerances", nargs="+", default=["1e-2", "1e-3", "1e-4"], metavar="T")
    parser.add_argument("--balance", help="solver.balance_tolerance [the tolerance]")
    parser.add_argument("--steps", type=int, help="of a run, at most [all]")
    parser.add_argument("--last", action="store_true",
                        help="judge the last of --steps alone; the judged run, with three frames, is one of --repeat")
    parser.add_argument("--repeat", type=int, default=3, help="runs for the time [3]")
    parser.add_argument("--limit", type=float, default=240, help="of a run [s]")
    parser.add_argument("--reference-seconds", type=float, default=120, help="of the reference of a step, swept [s]")
    parser.add_argument("--set", nargs="+", default=[], action="extend", metavar="KEY=VALUE")
    options = parser.parse_args()
    if options.last and (options.steps or 0) < 2:
        parser.error("--last needs --steps, 2 or more")
    options.out.mkdir(parents=True, exist_ok=True)
    for scene in options.scenes:
        for tolerance in options.tolerances:
            rows, judged = compare(options, scene, tolerance)
            write(options.out / "rows.csv", COLUMNS, rows)
            write(options.out / "steps.csv", STEP_COLUMNS, judged)
            for row in rows:
                print(*(row[c] if row[c] != "" else "-" for c in COLUMNS[:18]), flush=True)


if __name__ == "__main__":
    main()
