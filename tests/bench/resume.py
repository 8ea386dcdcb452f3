#!/usr/bin/env python3
"""Runs that stop and go on at random, on ranks and threads drawn anew each time, against the run that was never stopped.

    tests/bench/resume.py OUT [--talus build/release/talus] [--trials 100] [--stops 1,1] [--minutes 30] [--patience 300] [--seed 1]
                          [--scene apps/scenes/demo.toml] [--subdomains 4] [--set KEY=VALUE ...] [--kill]

The digest of the end, and every CSV file but for its columns of wall-clock time, must be equal. `--stops 10,10`: ten
resumptions in a row. With --kill a run does not stop behind a step: one of its processes, a rank or mpirun, gets SIGKILL
at any moment, and all of them have to be gone within ten seconds. A line a trial tells what was done. A run that writes
nothing for --patience seconds is called hung; on cores that others use two ranks that wait for one another may take
hundreds of times their processor time. Ends after --minutes, and says how many trials there were. Exit code 1 where one
differs, fails or hangs, or no kill hit a run behind a checkpoint, on one rank or on two.
"""

import argparse
import collections
import csv
import json
import os
import pathlib
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time

CLOCKS = {"wall_s", "seconds"}  # columns that are of the day


def tables(folder):
    """Rows of every CSV file, by name, without the columns of clocks."""
    found = {}
    for path in sorted(folder.glob("*.csv")):
        with open(path, newline="") as file:
            found[path.name] = [{k: v for k, v in row.items() if k not in CLOCKS} for row in csv.DictReader(file)]
    return found


def summary(folder):
    return json.loads((folder / "run.json").read_text())["summary"]


def written(folder):
    """Sizes of what a run has written."""
    return sorted((path.name, path.stat().st_size) for path in folder.glob("*.[cl][so][vg]"))


def processes(folder):
    """Those that still run into a folder: mpirun and ranks, which it gives groups of their own."""
    found = []
    for entry in pathlib.Path("/proc").iterdir():
        if entry.name.isdigit() and int(entry.name) != os.getpid():
            try:
                words = (entry / "cmdline").read_bytes().split(b"\0")
            except OSError:
                continue
            if str(folder).encode() in words:
                found.append(int(entry.name))
    return found


def signalled(pid):
    """Whether there was such a process to kill."""
    try:
        os.kill(pid, signal.SIGKILL)
    except ProcessLookupError:
        return False
    return True


class Runner:
    def __init__(self, options):
        self.options = options
        self.kills = collections.Counter()  # by ranks, and whether there was a checkpoint

    def command(self, folder, ranks, threads, more):
        command = [self.options.talus, "run", self.options.scene, "--out", folder, "--quiet", "--threads", threads]
        command += ["--set", f"decomposition.subdomains={self.options.subdomains}"]
        for setting in self.options.set:
            command += ["--set", setting]
        if ranks > 1:
            command = ["mpirun", "--oversubscribe", "--bind-to", "none", "-n", ranks] + command
        return [str(word) for word in command + more]

    def kill(self, folder, ranks, threads, after, draw):
        """Begins a run and kills one of its processes after so many seconds. Whether there was one, and what went
        wrong or None: a run that ended by itself has to have ended well, and one that was killed within ten seconds."""
        command = self.command(folder, ranks, threads, ["--resume"])
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        time.sleep(after)
        if process.poll() is not None:
            return False, None if process.returncode in (0, 3) else f"exit {process.returncode}"
        hit = signalled(draw.choice(sorted(processes(folder)) or [process.pid]))
        until = time.monotonic() + 10
        while (left := processes(folder)) and time.monotonic() < until:
            process.poll()
            time.sleep(0.05)
        for pid in left:
            signalled(pid)
        process.wait()
        return hit, f"{len(left)} processes ran on after a kill" if left else None

    def run(self, folder, ranks, threads, more):
        command = self.command(folder, ranks, threads, more)
        with tempfile.TemporaryFile("w+") as said:
            process = subprocess.Popen(command, stdout=said, stderr=subprocess.STDOUT)
            seen, since = None, time.monotonic()
            while process.poll() is None:
                time.sleep(0.05)
                if (now := written(folder)) != seen:
                    seen, since = now, time.monotonic()
                if time.monotonic() - since > self.options.patience:
                    process.terminate()
                    process.wait()
                    return "hung"
            said.seek(0)
            code = process.returncode
            return code if code in (0, 3) else f"exit {code}: {said.read().strip()}"


def killed(runner, folder, seconds, draw):
    """Likewise, with kills: so many as there may be stops, each within so many seconds."""
    shutil.rmtree(folder, ignore_errors=True)
    history = []
    for _ in range(draw.randint(*runner.options.stops)):
        ranks = draw.randint(1, 2)
        after = draw.uniform(0, seconds)
        hit, failure = runner.kill(folder, ranks, 1, after, draw)
        saved = any(folder.glob("checkpoint*"))
        runner.kills[ranks, saved] += hit
        history.append(f"{'killed' if hit else 'done'} after {after:.2f} s on {ranks} ranks")
        if failure:
            return history, failure
        if not hit:
            break
    history.append("end on 1x1")
    code = runner.run(folder, 1, 1, ["--resume"])
    return history, None if code in (0, 3) else code


def trial(runner, folder, steps, draw):
    """What was done, and what went wrong or None."""
    shutil.rmtree(folder, ignore_errors=True)
    stops = sorted(draw.sample(range(1, steps), draw.randint(*runner.options.stops)))
    history = []
    for stop in [*stops, None]:
        ranks = draw.randint(1, 2)
        threads = draw.randint(1, 2) if ranks == 1 else 1
        history.append(f"{stop or 'end'} on {ranks}x{threads}")
        code = runner.run(folder, ranks, threads, ["--resume"] + (["--steps", stop] if stop else []))
        if code not in (0, 3):
            return history, code
    return history, None


def between(text):
    """"LOW,HIGH", or one number for both."""
    low, _, high = text.partition(",")
    return int(low), int(high or low)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--talus", default="build/release/talus")
    parser.add_argument("--scene", default="apps/scenes/demo.toml")
    parser.add_argument("--trials", type=int, default=100)
    parser.add_argument("--stops", type=between, default=(1, 1), metavar="LOW,HIGH")
    parser.add_argument("--minutes", type=float, default=30)
    parser.add_argument("--patience", type=float, default=300)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--subdomains", type=int, default=4)
    parser.add_argument("--set", action="append", default=[])
    parser.add_argument("--kill", action="store_true")
    options = parser.parse_args()
    until = time.monotonic() + 60 * options.minutes
    options.out = options.out.resolve()
    options.out.mkdir(parents=True, exist_ok=True)
    runner, draw = Runner(options), random.Random(options.seed)

    straight = options.out / "straight"
    shutil.rmtree(straight, ignore_errors=True)
    began = time.monotonic()
    code = runner.run(straight, 1, 1, [])
    if code not in (0, 3):
        sys.exit(f"resume: the uninterrupted run ended with {code}")
    steps, expected, seconds = summary(straight)["steps"], tables(straight), time.monotonic() - began
    print(f"{steps} steps, digest {summary(straight)['digest']}, {seconds:.1f} s", flush=True)

    done = wrong = 0
    while done < options.trials and time.monotonic() < until:
        folder = options.out / "parts"
        history, failure = killed(runner, folder, seconds, draw) if options.kill else trial(runner, folder, steps, draw)
        if failure is None:
            differ = [name for name, rows in expected.items() if tables(folder).get(name) != rows]
            if summary(folder)["digest"] != summary(straight)["digest"]:
                differ.append("digest")
            failure = "differs in " + ", ".join(differ) if differ else None
        done += 1
        wrong += failure is not None
        print(f"{done}: {'; '.join(history)}: {failure or 'equal'}", flush=True)
        if failure is not None:
            kept = options.out / f"wrong-{done}"
            shutil.rmtree(kept, ignore_errors=True)
            if folder.exists():
                folder.rename(kept)
    print(f"{done} of {options.trials} trials, {wrong} wrong")
    for (ranks, saved), kills in sorted(runner.kills.items()):
        print(f"{kills} kills on {ranks} ranks {'behind' if saved else 'before'} a checkpoint")
    void = options.kill and not all(runner.kills[ranks, True] for ranks in (1, 2))
    return 1 if wrong or done == 0 or void else 0


if __name__ == "__main__":
    sys.exit(main())
