"""The program: where it is, how it is started, and how it ends."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import threading
import time
import zlib
from collections.abc import Callable, Mapping, Sequence
from numbers import Integral
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from . import results

if TYPE_CHECKING:
    from .scene import Scene

# Exit codes of `talus run` (docs/formats.md).
DONE, FAILED, BAD_INPUT, TOLERANCE_MISSED, STOPPED = 0, 1, 2, 3, 75
POLL = 0.2  # [s] between looks at a run that goes on

# First line of the scenes that `run` writes, with the CRC-32 of the rest: others are the user's own, and stay.
MARK = b"# Written by talus.run, which may write it anew as long as nothing is changed in it: "

Progress = Callable[[dict[str, Any]], None]


class RunError(RuntimeError):
    """The program failed. `message`: what it said; `exit_code`: 1 failed, 2 bad input; `directory`: of the results."""

    def __init__(self, message: str, exit_code: int, directory: Path) -> None:
        super().__init__(message)
        self.message, self.exit_code, self.directory = message, exit_code, directory


class Stopped(RunError):
    """The run was stopped behind a checkpoint (exit code 75): `talus.run(..., resume=True)` goes on from there."""


def find_program(program: str | os.PathLike[str] | None = None) -> str:
    """Path of `talus`: the one given, else that of the environment variable TALUS, else the one on PATH, else
    build/release/talus of the tree that this package lies in.

    Raises FileNotFoundError that says so.
    """
    tree = Path(__file__).resolve().parents[3] / "build" / "release" / "talus"
    for named in (program, os.environ.get("TALUS")):
        if named:
            found = shutil.which(str(named))
            if found is None:
                raise FileNotFoundError(f"{named}: no program there")
            return os.path.abspath(found)
    found = shutil.which("talus") or (str(tree) if tree.is_file() else None)
    if found is None:
        raise FileNotFoundError("no program `talus` on PATH; build it (`bash apps/demo.sh`), or name it with the "
                                "environment variable TALUS or with program=")
    return os.path.abspath(found)


def call(words: Sequence[str]) -> subprocess.CompletedProcess[str]:
    """Runs a command that ends soon; returns its exit code and what it wrote."""
    return subprocess.run(words, capture_output=True, text=True, errors="replace", stdin=subprocess.DEVNULL)


def message_of(stderr: str) -> str:
    """The errors among what the program said on stderr, without "talus: error: "; all it said where there are none."""
    errors = [line.partition("error: ")[2] for line in stderr.splitlines() if line.startswith("talus: error: ")]
    return "\n".join(dict.fromkeys(errors)) or stderr.strip() or "the program said nothing"


def run(
    scene: Scene | Mapping[str, Any] | str | os.PathLike[str],
    out: str | os.PathLike[str] | None = None,
    *,
    ranks: int = 1,
    threads: int | None = None,
    settings: Mapping[str, Any] | None = None,
    force: bool = False,
    resume: bool = False,
    options: Sequence[str] = (),
    progress: bool | Progress = True,
    program: str | os.PathLike[str] | None = None,
    _stop: threading.Event | None = None,  # set by another thread, where no interrupt reaches this one
) -> results.Run:
    """Runs a scene to its end and returns the run. Steps that missed their tolerance are no error: see `Run.missed`.

    scene: a `Scene`, a dict or the path of a scene file. All but a file without `settings` is written beside the results
    as OUT.toml. What stands there is written over with `force` or `resume` only, and only where this function wrote it;
    it stays where the program finds the scene wrong.
    out: directory of the results, by default out/NAME. Results that are there are refused without `force` or `resume`.
    ranks, threads: MPI ranks (by mpirun) and threads of each; where nothing is said as `talus run` chooses.
    settings: keys that differ from the scene, {"material.friction": 0.5}.
    options: further options of `talus run`: ["--steps", "10"].
    progress: True writes a line to stderr; a function is called with what status.json has, about twice a second.

    Raises Stopped (exit code 75) where the run was stopped behind a checkpoint, RunError with the program's message
    where it failed (1) or the scene or an option is wrong (2), FileExistsError where OUT.toml holds another scene. An
    interrupt (Ctrl-C) stops the run behind a checkpoint, and is raised as KeyboardInterrupt.
    """
    from .scene import Scene

    if not isinstance(ranks, Integral) or ranks < 1:
        raise ValueError(f"ranks must be a whole number, 1 or more, got {ranks}")
    if isinstance(options, str):
        raise TypeError(f"options are a list of words, [{', '.join(repr(word) for word in options.split())}], not one text")
    talus = find_program(program)
    written: _SceneFile | None = None
    if isinstance(scene, (str, os.PathLike)) and not settings:
        path, name = Path(scene), Path(scene).stem
        directory = Path(out) if out is not None else Path("out") / Scene.load(path).name
    else:
        changed = Scene.load(scene) if isinstance(scene, (str, os.PathLike)) else \
            scene.copy() if isinstance(scene, Scene) else Scene(scene)
        for key, value in (settings or {}).items():
            changed[key] = value
        name = changed.name
        directory = Path(out) if out is not None else Path("out") / name
        written = _SceneFile(changed, directory)
        path = written.path
        written.put(replace=force or resume)
    words = [talus, "run", str(path), "--out", str(directory)]
    if ranks > 1:
        words = ["mpirun", "-n", str(ranks), *words]
    if threads is not None:
        words += ["--threads", str(threads)]
    words += ["--force"] * force + ["--resume"] * resume + list(options)
    try:
        exit_code, stderr = _follow(words, directory, _reporter(progress, name), _stop)
    except OSError:  # mpirun is missing, for instance
        if written is not None:
            written.take_back()
        raise
    if exit_code in (DONE, TOLERANCE_MISSED):
        return results.Run(directory)
    if exit_code == BAD_INPUT and written is not None:
        written.take_back()
    raise (Stopped if exit_code == STOPPED else RunError)(message_of(stderr), exit_code, directory)


class _SceneFile:
    """OUT.toml, the scene of a run beside its results OUT."""

    def __init__(self, scene: Scene, directory: Path) -> None:
        self.path = directory.parent / f"{directory.name}.toml"
        self.plain = scene.toml_for(self.path.parent).encode()
        self.marked = MARK + f"{zlib.crc32(self.plain):08x}\n".encode() + self.plain
        self.former = self.path.read_bytes() if self.path.exists() else None

    def holds_another(self) -> bool:
        return self.former is not None and self.former not in (self.marked, self.plain)

    def demand_place(self, replace: bool, advice: str) -> None:
        """Raises FileExistsError where there is another scene that must stay."""
        if self.path.is_symlink():
            raise FileExistsError(f"{self.path}: is a symbolic link, and the scene would be written there; choose another "
                                  "directory of results")
        if not self.holds_another():
            return
        head, _, rest = (self.former or b"").partition(b"\n")
        if head != MARK + f"{zlib.crc32(rest):08x}".encode():
            raise FileExistsError(f"{self.path}: exists, and is not as talus.run writes scenes, which would be written there; "
                                  "choose another directory of results")
        if not replace:
            raise FileExistsError(f"{self.path}: exists and holds another scene; {advice}")

    def put(self, replace: bool) -> None:
        self.demand_place(replace, "force=True begins anew, resume=True goes on with the changed scene, or choose another "
                                   "directory")
        if self.former is None or self.holds_another():
            self._write(self.marked)

    def take_back(self) -> None:
        """What was there before `put`, unless somebody has written there since."""
        if self.former in (self.marked, self.plain) or not self.path.exists() or self.path.read_bytes() != self.marked:
            return
        if self.former is None:
            self.path.unlink()
        else:
            self._write(self.former)

    def _write(self, content: bytes) -> None:
        self.path.parent.mkdir(parents=True, exist_ok=True)
        number, part = tempfile.mkstemp(prefix=self.path.name + ".", suffix=".part", dir=self.path.parent)
        try:
            with os.fdopen(number, "wb") as file:
                file.write(content)
            os.chmod(part, 0o644)
            os.replace(part, self.path)
        except BaseException:
            os.unlink(part)
            raise


def demand_place_of_scene(scene: Scene, directory: Path, replace: bool, advice: str) -> None:
    """Raises FileExistsError where `run` would not write the scene beside the results in `directory`. advice: what to do
    where the scene there is another one."""
    _SceneFile(scene, directory).demand_place(replace, advice)


def _follow(words: list[str], directory: Path, report: Progress, stop: threading.Event | None) -> tuple[int, str]:
    """Runs the command to its end, or until `stop` is set; returns its exit code and what it said on stderr."""
    began = time.time()
    with tempfile.TemporaryFile("w+", errors="replace") as said:
        process = subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=said)
        try:
            while True:
                try:
                    process.wait(POLL)
                    break
                except subprocess.TimeoutExpired:
                    if stop is not None and stop.is_set():
                        process.terminate()  # the program writes a checkpoint and ends
                        process.wait()
                        break
                    status = _status(directory)
                    if status.get("heartbeat", 0) >= began:  # not that of an earlier run
                        report(status)
        except KeyboardInterrupt:
            process.terminate()  # the program writes a checkpoint and ends
            process.wait()
            raise
        finally:
            if process.poll() is None:
                process.terminate()
                process.wait()
        report({})
        said.seek(0)
        return process.returncode, said.read()


def _status(directory: Path) -> dict[str, Any]:
    try:
        return results.Run(directory).progress
    except (OSError, ValueError):
        return {}  # not begun yet


def _reporter(progress: bool | Progress, name: str, stream: TextIO | None = None) -> Progress:
    """What is called with the run's status; an empty one says that it has ended."""
    if not isinstance(progress, bool):
        follow = progress
        return lambda status: follow(status) if status else None
    stream = stream or sys.stderr
    shown = [""]

    def report(status: dict[str, Any]) -> None:
        if not progress or not (status or shown[0]):
            return
        line = (f"{name}: {status.get('stage', '')} {100 * status.get('stage_fraction', 0):.0f} %, step "
                f"{status.get('step', 0)}, {status.get('time', 0):.4g} s") if status else ""
        if line != shown[0]:
            stream.write("\r" + line.ljust(len(shown[0])) if line else "\n")
            stream.flush()
            shown[0] = line

    return report
