"""The directory of a run: tables, summary, frames. Read anew when files change, so a run may still go on."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, overload

import h5py
import numpy as np

from .errors import DamagedFile, MissingData, NotARun, NotThere
from .frame import Frame, read_file, text
from .tables import read_table


STATUSES = ("running", "done", "stopped", "failed")


def open_run(directory: str | os.PathLike[str]) -> Run:
    """The run in a directory, which may still go on, have been stopped or failed.

    Raises FileNotFoundError where there is no directory, NotARun where no run was begun in it. What is asked of the run
    raises DamagedFile where a file that tells it is damaged.
    """
    return Run(directory)


class Run:
    """What a run left behind, or has so far. Quantities are in SI units; docs/formats.md describes every column.

    `run.steps`, `run.walls`, `run.triaxial`, `run.bodies`, ...: the table steps.csv and so on, as a numpy structured
    array (`run.steps["error_rms"]`). `run.tables` lists those that there are.
    """

    def __init__(self, directory: str | os.PathLike[str]) -> None:
        self.directory = Path(directory)
        if not self.directory.exists():
            raise FileNotFoundError(f"{self.directory}: no such directory; runs are written to the one that --out names")
        if not (self.directory / "run.json").exists() and not (self.directory / "status.json").exists():
            inside = sorted(path.parent.name for path in self.directory.glob("*/run.json")) if self.directory.is_dir() else []
            hint = f"; there are runs in it: {', '.join(inside[:5])}" if inside else ""
            raise NotARun(f"{self.directory}: no run of Talus was begun there (no run.json){hint}")
        self._kept: dict[Path, tuple[tuple[int, int, int], Any]] = {}

    def __repr__(self) -> str:
        return f"<Run {self.directory}: {self.status}>"

    # ---- provenance and summary

    @property
    def json(self) -> dict[str, Any]:
        """All of run.json: `provenance` and `summary`; empty before the run has written it."""
        return self._json("run.json")

    @property
    def summary(self) -> dict[str, Any]:
        """`summary` of run.json: status, steps, digest, converged_steps, worst errors, wall_s [s], ... (docs/formats.md)."""
        return self._part_of_json("summary")

    @property
    def provenance(self) -> dict[str, Any]:
        """`provenance` of run.json: version, git_hash, host, threads, command_line, seed, ..."""
        return self._part_of_json("provenance")

    @property
    def progress(self) -> dict[str, Any]:
        """status.json: stage, stage_fraction, step, time [s], missed_steps, steps_per_s; of a run that goes on, a second old."""
        return self._json("status.json")

    @property
    def status(self) -> str:
        """"running", "done", "stopped" or "failed". A run that was killed says "running": `talus status` can tell."""
        status = self.summary.get("status", "running")
        if status not in STATUSES:
            raise DamagedFile(f"{self.directory / 'run.json'}: `status` is {status!r}, none of {', '.join(STATUSES)}")
        return str(status)

    @property
    def missed(self) -> int:
        """Steps so far that missed their tolerance or overlapped beyond it; 0: every step carries its certificate."""
        steps = self.steps
        return int(np.count_nonzero(~steps["converged"])) if len(steps) else 0

    @property
    def scene(self) -> dict[str, Any]:
        """The scene as it was run, with every default spelled out (scene.resolved.toml)."""
        import tomllib

        return _parsed(self.directory / "scene.resolved.toml", tomllib.loads)

    # ---- tables

    @property
    def tables(self) -> list[str]:
        """Names of the tables that there are: "steps", "walls", ..."""
        return sorted(path.stem for path in self.directory.glob("*.csv"))

    def table(self, name: str) -> np.ndarray:
        """The table `name`.csv as a structured array; raises MissingData where the run has not written it."""
        path = self.directory / f"{name}.csv"
        if not path.exists():
            raise MissingData(f"{self.directory}: no {name}.csv; there are: {', '.join(self.tables) or 'no tables yet'} "
                              "(docs/formats.md says which scene writes which)")
        table = self._read(path, read_table)
        if name == "steps" and "converged" not in (table.dtype.names or ()):
            raise DamagedFile(f"{path}: has no column `converged`, as the table of a run has")
        return table

    def __getattr__(self, name: str) -> np.ndarray:
        if name.startswith("_"):
            raise AttributeError(name)
        try:
            return self.table(name)
        except MissingData as error:
            raise AttributeError(str(error)) from None

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *self.tables})

    def units(self, table: str) -> dict[str, str]:
        """Unit of each column of a table, from columns.json of the run: {"time": "s", "step": "1", ...}."""
        columns = self._json("columns.json").get(f"{table}.csv")
        if columns is None:
            raise MissingData(f"{self.directory}: columns.json does not know {table}.csv")
        return {column["name"]: column["unit"] for column in columns}

    # ---- frames

    @property
    def frames(self) -> Frames:
        """The frames of results.h5 so far, as a sequence: `len(run.frames)`, `for frame in run.frames`."""
        path = self.directory / "results.h5"
        return Frames(path, self._read(path, _list_frames) if path.exists() else [])

    def frame(self, index: int) -> Frame:
        """Frame `index`, from 0; -1 is the last one. Raises MissingData where the run has none of this number."""
        return self.frames[index]

    # ---- files that change

    def _part_of_json(self, name: str) -> dict[str, Any]:
        part = self.json.get(name, {})
        if not isinstance(part, dict):
            raise DamagedFile(f"{self.directory / 'run.json'}: `{name}` is no table of names and values")
        return part

    def _json(self, name: str) -> dict[str, Any]:
        path = self.directory / name
        if not path.exists():
            return {}
        return self._read(path, lambda path: _parsed(path, json.loads))

    def _read(self, path: Path, read: Any) -> Any:
        """What `read(path)` returns, kept until the file changes."""
        stat = path.stat()
        state = (stat.st_mtime_ns, stat.st_size, stat.st_ino)
        if path not in self._kept or self._kept[path][0] != state:
            self._kept[path] = (state, read(path))
        return self._kept[path][1]


class Frames(Sequence[Frame]):
    """Frames of a run in the order of time; only what is asked of a frame is read."""

    def __init__(self, path: Path, listed: list[tuple[int, float, str]]) -> None:
        self._path, self._listed = path, listed

    def __len__(self) -> int:
        return len(self._listed)

    @property
    def times(self) -> np.ndarray:
        """Time of each frame [s]."""
        return np.array([time for _, time, _ in self._listed])

    @overload
    def __getitem__(self, index: int) -> Frame: ...
    @overload
    def __getitem__(self, index: slice) -> list[Frame]: ...
    def __getitem__(self, index: int | slice) -> Frame | list[Frame]:
        if isinstance(index, slice):
            return [self[k] for k in range(*index.indices(len(self)))]
        count = len(self)
        if not -count <= index < count:
            have = f"it has frames 0 to {count - 1}" if count else "it has none yet"
            raise MissingData(f"{self._path}: no frame {index}; {have}")
        index %= count
        return Frame(self._path, index, *self._listed[index])

    def __iter__(self) -> Iterator[Frame]:
        return (self[k] for k in range(len(self)))


def _parsed(path: Path, parse: Callable[[str], Any]) -> dict[str, Any]:
    """The names and values in a text file; raises DamagedFile where it holds none."""
    try:
        content = parse(path.read_text(encoding="utf-8"))
    except ValueError as error:  # also what is no UTF-8
        raise DamagedFile(f"{path}: is damaged: {error}; `talus run ... --resume` writes it anew from a checkpoint, where "
                          "there is one") from error
    if not isinstance(content, dict):
        raise DamagedFile(f"{path}: is damaged: it holds no table of names and values")
    return content


def _list_frames(path: Path) -> list[tuple[int, float, str]]:
    def read(file: h5py.File) -> list[tuple[int, float, str]]:
        frames = file["frames"]
        names = sorted(frames)
        if names != [f"{k:06}" for k in range(len(names))]:
            raise NotThere(f"{path}: a frame is missing; `talus run ... --resume` mends the file of a killed run")
        attributes = [frames[name].attrs for name in names]
        return [(int(a["step"]), float(a["time"]), text(a["stage"])) for a in attributes]

    return read_file(path, read)
