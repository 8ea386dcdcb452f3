"""One frame of results.h5: grains, contacts and walls at an output time."""

from __future__ import annotations

import time as clock
from functools import cached_property
from pathlib import Path
from typing import Callable, TypeVar

import h5py
import numpy as np

from .errors import DamagedFile, MissingData, NotThere

T = TypeVar("T")

FORMAT, FORMAT_VERSION = "talus-results", 1
# The program writes a frame within milliseconds, and names it when it is whole. A reader that looks in between may
# meet a directory of the file that changes; it looks again.
RETRIES, RETRY_WAIT = 20, 0.05  # [1], [s]


def text(value: object) -> str:
    """A text attribute or cell of an HDF5 file."""
    return value.decode() if isinstance(value, bytes) else str(value)


def read_file(path: Path, read: Callable[[h5py.File], T]) -> T:
    """What `read` returns of a results.h5 that may be written at this moment.

    Raises MissingData where there is no file, DamagedFile where it cannot be read, ValueError where it is of another
    format.
    """
    locking: bool | None = False
    for attempt in range(RETRIES):
        try:
            with h5py.File(path, "r", locking=locking) as file:
                kind, version = text(file.attrs.get("format", "")), int(file.attrs.get("format_version", 0))
                if kind != FORMAT:
                    raise ValueError(f"{path}: no results of Talus (its attribute 'format' is '{kind}')")
                if version != FORMAT_VERSION:
                    raise ValueError(f"{path}: format {version} of results.h5; this package reads format "
                                     f"{FORMAT_VERSION}: use the package of the Talus that wrote it")
                return read(file)
        except FileNotFoundError:
            raise MissingData(f"{path}: no such file; the run has not come to its first frame") from None
        except (MissingData, PermissionError):
            raise
        except (OSError, KeyError, RuntimeError, TypeError, UnicodeDecodeError) as error:
            if attempt + 1 == RETRIES and isinstance(error, NotThere):
                raise MissingData(error.args[0]) from None
            if attempt + 1 == RETRIES:
                raise DamagedFile(f"{path}: cannot be read: {error}; where a run was killed, `talus run ... "
                                  "--resume` mends the file") from error
            if "locking flag" in str(error):  # the caller has it open, as h5py opens files by itself
                locking = None
                continue
            clock.sleep(RETRY_WAIT)
    raise AssertionError("unreachable")


class Frame:
    """Grains, contacts and walls at one output time, in SI units. Arrays are read when they are asked for, and kept.

    Grains stand in order of `ids` (shape n), contacts in order of their ids (shape m).
    """

    def __init__(self, path: Path, index: int, step: int, time: float, stage: str) -> None:
        self._path = path
        self.index = index  #: number of the frame, from 0
        self.step = step  #: time step behind which it was written
        self.time = time  #: [s]
        self.stage = stage  #: name of the stage

    def __repr__(self) -> str:
        return f"<Frame {self.index}: step {self.step}, {self.time:.6g} s, stage '{self.stage}'>"

    def array(self, name: str) -> np.ndarray:
        """Any array of the frame by its name in results.h5 (docs/formats.md): "bodies/x", "walls/force"."""

        def read(file: h5py.File) -> np.ndarray:
            group = file.get(f"frames/{self.index:06}")
            if group is None or int(group.attrs["step"]) != self.step:
                raise NotThere(f"{self._path}: frame {self.index} of step {self.step} is no longer there: the run went on "
                               "from a checkpoint before it; ask the run for its frames again")
            if name.startswith("contacts/") and not int(group.attrs.get("contacts", 1)):
                raise MissingData(f"{self._path}: frame {self.index} was written without its contacts (the scene says "
                                  "output.contacts = false, or output.contacts_every leaves them out of this frame)")
            if name not in group:
                if name in _OF_EVERY_FRAME:
                    raise KeyError(f"frame {self.index} has no '{name}', which every frame has")
                hint = _WRITTEN_BY.get(name, "")
                raise MissingData(f"{self._path}: frame {self.index} has no '{name}'{hint}")
            if not isinstance(group[name], h5py.Dataset):
                raise MissingData(f"{self._path}: '{name}' is no array but a group of arrays: {', '.join(group[name])}")
            values: np.ndarray = group[name][()]
            return values

        return read_file(self._path, read)

    def _of_grains(self, name: str, columns: tuple[int, ...], dtype: str = "f8") -> np.ndarray:
        """An array that a frame without grains does not have, whatever the scene asks for."""
        return self.array(name) if len(self.ids) else np.zeros((0, *columns), dtype)

    @cached_property
    def ids(self) -> np.ndarray:
        """Identity of each grain for the whole run, ascending; shape (n,)."""
        return self.array("bodies/id")

    @cached_property
    def positions(self) -> np.ndarray:
        """Centres [m]; shape (n, 3)."""
        return self.array("bodies/x")

    @cached_property
    def radii(self) -> np.ndarray:
        """Radii [m], of a clump that of the sphere that holds it; shape (n,)."""
        return self.array("bodies/radius")

    @cached_property
    def velocities(self) -> np.ndarray:
        """Velocities of the centres [m/s]; shape (n, 3)."""
        return self.array("bodies/u")

    @cached_property
    def angular_velocities(self) -> np.ndarray:
        """Angular velocities [rad/s]; shape (n, 3)."""
        return self._of_grains("bodies/omega", (3,))

    @cached_property
    def orientations(self) -> np.ndarray:
        """Unit quaternions (w, x, y, z); shape (n, 4)."""
        return self._of_grains("bodies/orientation", (4,))

    @cached_property
    def materials(self) -> np.ndarray:
        """Number of each grain's [[material]], from 0; shape (n,)."""
        return self._of_grains("bodies/material", (), "i8")

    @cached_property
    def contacts(self) -> np.ndarray:
        """Ids of the two bodies of each contact with a force; the second is -(1 + k) at wall k; shape (m, 2)."""
        return self.array("contacts/bodies")

    @cached_property
    def forces(self) -> np.ndarray:
        """Force on the first body of each contact, mean over the step [N]; shape (m, 3)."""
        return self.array("contacts/force")

    @cached_property
    def moments(self) -> np.ndarray:
        """Moment of rolling resistance on the first body of each contact, mean over the step [N m]; shape (m, 3)."""
        if len(self.contacts) == 0:
            return np.zeros((0, 3))
        return self.array("contacts/moment")

    @cached_property
    def points(self) -> np.ndarray:
        """Points of contact [m]; shape (m, 3)."""
        return self.array("contacts/point")

    @cached_property
    def normals(self) -> np.ndarray:
        """Unit normals from the second body to the first; shape (m, 3)."""
        return self.array("contacts/normal")

    @cached_property
    def gaps(self) -> np.ndarray:
        """Gaps at the end of the step [m], negative where bodies overlap; shape (m,)."""
        return self.array("contacts/gap")

    @property
    def normal_forces(self) -> np.ndarray:
        """Normal components of `forces` [N], positive where bodies press on each other; shape (m,)."""
        return np.einsum("ij,ij->i", self.forces, self.normals)

    @property
    def between_grains(self) -> np.ndarray:
        """True for contacts of two grains, False for those with a wall; shape (m,)."""
        return self.contacts[:, 1] >= 0

    @cached_property
    def walls(self) -> np.ndarray:
        """Walls as a structured array: `name`, `position` [m] and `velocity` [m/s] along the normal, `force` (3) [N]."""

        def read(file: h5py.File) -> list[str]:
            return [text(name) for name in file["walls/name"][()]]

        names = read_file(self._path, read)
        walls = np.empty(len(names), dtype=[("name", np.array(names or [""]).dtype), ("position", "f8"),
                                            ("velocity", "f8"), ("force", "f8", 3)])
        walls["name"] = names
        for column in ("position", "velocity", "force"):
            walls[column] = self.array(f"walls/{column}")
        return walls

    @cached_property
    def cell(self) -> np.ndarray:
        """Edges a, b, c of the periodic cell [m], one a row, 0 along axes of walls; shape (3, 3)."""
        return self.array("cell/edges")

    @cached_property
    def cell_rates(self) -> np.ndarray:
        """How fast these edges change [m/s]; shape (3, 3)."""
        return self.array("cell/rates")

    @cached_property
    def cell_origin(self) -> np.ndarray:
        """Lower corner of the periodic cell [m]; `positions` lie in the brick between it and the diagonal of `cell`."""
        return self.array("cell/origin")

    def nearest(self, differences: np.ndarray) -> np.ndarray:
        """Differences of positions [m], shape (..., 3), to the nearest image in the periodic cell."""
        d = np.array(differences, dtype=float)
        for axis in (2, 1, 0):
            edge = self.cell[axis]
            if edge[axis] > 0:
                d -= np.rint(d[..., axis, None] / edge[axis]) * edge
        return d

    def rows(self, ids: np.ndarray) -> np.ndarray:
        """Rows of `positions` and the like at which the grains of these ids stand, of any shape.

        Raises MissingData for an id that no grain of this frame has, above all that of a wall (negative).
        """
        ids = np.asarray(ids)
        rows = np.minimum(np.searchsorted(self.ids, ids), max(len(self.ids) - 1, 0))
        if ids.size and (len(self.ids) == 0 or not np.array_equal(self.ids[rows], ids)):
            lacking = np.setdiff1d(ids, self.ids)
            why = ("walls have negative ids: choose contacts by `between_grains` first" if lacking[0] < 0 else
                   "they came later, or were removed before; choose frames, or ids, that have both")
            raise MissingData(f"{self._path}: frame {self.index} lacks {len(lacking)} of the ids asked for, as "
                              f"{lacking[0]}; {why}")
        return rows


_OF_EVERY_FRAME = {"bodies/id", "bodies/x", "bodies/radius", "contacts/bodies", "contacts/force", "walls/position",
                   "walls/velocity", "walls/force"}
_WRITTEN_BY = {
    "bodies/u": " (the scene says output.velocities = false)",
    "bodies/omega": " (the scene says rotation = false, or output.velocities = false)",
    "bodies/orientation": " (the scene does not say orientation = true)",
    "bodies/material": " (the materials of the scene have no names)",
    "cell/edges": " (the scene has no [cell], or the run is of an earlier version)",
    "cell/rates": " (the scene has no [cell], or the run is of an earlier version)",
    "cell/origin": " (the scene has no [cell], or the run is of an earlier version)",
    "contacts/moment": " (no contact of the scene resists rolling)",
    "contacts/point": " (the scene says output.contact_geometry = false)",
    "contacts/normal": " (the scene says output.contact_geometry = false)",
    "contacts/gap": " (the scene says output.contact_geometry = false)",
}
