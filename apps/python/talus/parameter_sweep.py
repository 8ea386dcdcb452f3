"""Many runs of one scene: every combination of some keys, and one table of what came out."""

from __future__ import annotations

import csv
import itertools
import os
import threading
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from .command import STOPPED, RunError, Stopped, demand_place_of_scene, run
from .results import Run
from .scene import Scene, SceneError

# Numbers of run.json's summary that stand in the table, and their types.
SUMMARY = {"steps": np.int64, "time": np.float64, "unconverged_steps": np.int64, "worst_error_rms": np.float64,
           "worst_balance": np.float64, "worst_overlap": np.float64, "iterations": np.int64, "wall_s": np.float64}

# What the table has of a run besides.
RUN_COLUMNS = ("directory", "exit_code", "digest")

Measure = Callable[[Run], float]


@dataclass
class Sweep:
    """The runs of a sweep. Entry k of each list belongs to row k of `table`."""

    keys: list[str]  #: dotted keys of the scene that were varied
    points: list[tuple[Any, ...]]  #: their values
    directories: list[Path]
    errors: list[RunError | None]  #: why a run failed or was stopped; None where it is done
    measured: list[dict[str, float]] = field(default_factory=list)

    @property
    def runs(self) -> list[Run | None]:
        """The runs that are done; None where one failed or was stopped."""
        return [None if error else Run(directory) for directory, error in zip(self.directories, self.errors)]

    @property
    def table(self) -> np.ndarray:
        """A row per run: the varied keys by their full names, `directory`, `exit_code` (0 done, 3 done and steps missed,
        1 failed, 75 stopped), numbers of the summary (time [s], wall_s [s], ...; 0 or nan where a run failed), `digest`,
        and what `measure` returned."""
        rows: list[dict[str, Any]] = []
        for point, directory, error, measured in zip(self.points, self.directories, self.errors, self.measured):
            row: dict[str, Any] = dict(zip(self.keys, point))
            summary = Run(directory).summary if (directory / "run.json").exists() else {}
            row["directory"] = str(directory)
            row["exit_code"] = error.exit_code if error else int(summary.get("exit_code") or 0)
            for name, kind in SUMMARY.items():
                value = summary.get(name)
                row[name] = kind(value) if value is not None else kind(0) if kind is np.int64 else np.nan
            row["digest"] = summary.get("digest") or ""
            row.update(measured)
            rows.append(row)
        names = list(dict.fromkeys(name for row in rows for name in row))
        columns = {name: np.array([_cell(row.get(name, np.nan)) for row in rows]) for name in names}
        table = np.empty(len(rows), dtype=[(name, column.dtype) for name, column in columns.items()])
        for name, column in columns.items():
            table[name] = column
        return table

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes `table` as CSV."""
        table = self.table
        with Path(path).open("w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(table.dtype.names)
            writer.writerows(table.tolist())


def sweep(
    scene: Scene | Mapping[str, Any] | str | os.PathLike[str],
    out: str | os.PathLike[str],
    keys: Mapping[str, Sequence[Any]] | None = None,
    *,
    jobs: int = 1,
    ranks: int = 1,
    threads: int | None = 1,
    resume: bool = False,
    force: bool = False,
    options: Sequence[str] = (),
    measure: Mapping[str, Measure] | None = None,
    progress: bool = False,
    program: str | None = None,
    **named: Sequence[Any],
) -> Sweep:
    """Runs a scene once for every combination of values, `jobs` runs at a time, into out/000, out/001, ...

    keys: {"material.friction": [0.2, 0.5], "stage.shear.time_step": [1e-3]}; `friction=[0.2, 0.5]` is short for the only
    key of this name outside arrays of tables in the resolved scene.
    resume: goes on with runs that were stopped and keeps those that are done. measure: a number of each run that is done,
    {"peak": lambda run: run.triaxial["q_over_p"].max()}. The table is also written to out/sweep.csv.

    All scenes are checked before the first run begins: raises SceneError where one is wrong, ValueError where nothing is
    varied, or a key twice, or a measure has the name of another column, FileExistsError where `out` has runs and neither `resume` nor `force` says what to do with them, or has
    scenes of other values, or of the user's own, which stay. A run that
    fails does not end the others: its row has the exit code, `errors` the message. What a `measure` raises is raised
    when all runs have ended and the table is written, with NaN in its place. So is an interrupt (Ctrl-C), which stops
    the runs that go on behind a checkpoint and begins no others: resume=True goes on. Runs of an earlier sweep beyond
    the number of the new ones stay, and are not in the table.
    """
    base = scene.copy() if isinstance(scene, Scene) else \
        Scene.load(scene) if isinstance(scene, (str, os.PathLike)) else Scene(scene)
    for key, given in {**(keys or {}), **named}.items():
        if isinstance(given, str) or not isinstance(given, Iterable):
            raise TypeError(f"{key}: give a list of values, [{given!r}]")
    if jobs < 1:
        raise ValueError(f"jobs must be 1 or more, got {jobs}")
    short = _full_names(base, named, program)
    twice = sorted({*(keys or {})} & {*short})
    if twice:
        raise ValueError(f"{', '.join(twice)}: varied twice, in full and in short; give all its values once")
    values = {**(keys or {}), **short}
    taken = sorted({*values, *RUN_COLUMNS, *SUMMARY} & set(measure or {}))
    if taken:
        raise ValueError(f"measure: the table has a column of its own called {', '.join(taken)}; choose another name")
    points = list(itertools.product(*values.values()))
    if not values or not points:
        raise ValueError("nothing is varied: sweep(scene, out, friction=[0.2, 0.5]) runs twice")
    scenes = []
    for point in points:
        changed = base.copy()
        for key, value in zip(values, point):
            changed[key] = value
        changed.check(program)
        scenes.append(changed)
    out = Path(out)
    directories = [out / f"{k:03}" for k in range(len(points))]
    there = [directory for directory in directories if (directory / "run.json").exists()]
    if there and not (resume or force):
        raise FileExistsError(f"{there[0]} holds a run: resume=True keeps what is done, force=True runs all anew")

    for changed, directory in zip(scenes, directories):
        demand_place_of_scene(changed, directory, replace=force, advice=(
            "a sweep of other values, or of another scene, was made here; take its values, choose another directory, or force=True runs all anew"))

    stop = threading.Event()

    def one(changed: Scene, directory: Path) -> RunError | None:
        try:
            run(changed, directory, ranks=ranks, threads=threads, resume=resume, force=force,
                options=options, progress=progress, program=program, _stop=stop)
        except RunError as error:
            return error
        return None

    failed: list[BaseException] = []
    with ThreadPoolExecutor(jobs) as pool:
        ended: list[Future[RunError | None]] = [pool.submit(one, *of_run) for of_run in zip(scenes, directories)]
        try:
            wait(ended)
        except KeyboardInterrupt as interrupt:  # only this thread is told
            stop.set()
            for future in ended:
                future.cancel()
            failed.append(interrupt)
    errors = [Stopped("not begun", STOPPED, directory) if future.cancelled() else future.result()
              for future, directory in zip(ended, directories)]

    def number_of(name: str, number: Measure, directory: Path) -> float:
        try:
            return float(number(Run(directory)))
        except Exception as error:  # the user's own function: the table comes first
            error.add_note(f"while '{name}' was measured of {directory}")
            failed.append(error)
            return float("nan")

    measured = [{} if error else {name: number_of(name, number, directory) for name, number in (measure or {}).items()}
                for directory, error in zip(directories, errors)]
    done = Sweep(list(values), points, directories, errors, measured)
    done.save(out / "sweep.csv")
    if failed:
        raise failed[0]
    return done


def _full_names(scene: Scene, named: Mapping[str, Sequence[Any]], program: str | None) -> dict[str, Sequence[Any]]:
    """Short names as dotted keys, as the resolved scene has them."""
    if not named:
        return {}
    known = _keys_of(scene.check(program).to_dict(), "")
    full: dict[str, Sequence[Any]] = {}
    for name, values in named.items():
        found = [key for key in known if key == name] or [key for key in known if key.endswith(f".{name}")]
        if len(found) != 1:
            raise SceneError(f"{name}: " + (f"may be {', '.join(found)}; give the full key in a dict" if found else
                                            "no key of the scene; keys in arrays of tables are given in a dict, "
                                            '{"stage.0.friction": [...]}'))
        full[found[0]] = values
    return full


def _keys_of(table: Mapping[str, Any], path: str) -> list[str]:
    names: list[str] = []
    for key, value in table.items():
        names += _keys_of(value, f"{path}{key}.") if isinstance(value, Mapping) else [f"{path}{key}"]
    return names


def _cell(value: Any) -> Any:
    return value if isinstance(value, (bool, int, float, str, np.generic)) else str(value)
