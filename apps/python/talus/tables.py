"""CSV tables of a run as numpy structured arrays."""

from __future__ import annotations

import csv
import io
import os
from pathlib import Path

import numpy as np

from .errors import DamagedFile

# Columns that hold whole numbers. Types do not follow from the values: a velocity may be "0" in every row.
INTEGERS = frozenset({
    "step", "candidates", "contacts", "active", "iterations", "worst_contact_body", "worst_contact_with", "worst_body",
    "overlap_body", "overlap_with", "migrants", "placed", "waiting", "no_room", "count",
})
FLAGS = frozenset({"converged"})
TEXTS = frozenset({"wall", "body", "insert", "remove", "material", "stage", "probe", "name"})


def read_table(path: str | os.PathLike[str]) -> np.ndarray:
    """The rows of a CSV table that Talus wrote, as a structured array: `table["time"]` [s], `table[-1]`.

    Counters are int64, `converged` is bool, names are str, everything else float64. A last line without its end, of a
    run that goes on or was killed, is left out. Units: docs/formats.md, and `Run.units`.

    Raises FileNotFoundError, and DamagedFile naming the file where it is no such table.
    """
    path = Path(path)
    try:
        with path.open(encoding="utf-8", newline="") as file:
            text = file.read()
    except UnicodeDecodeError as error:
        raise DamagedFile(f"{path}: is damaged: {error}") from error
    text = text[: text.rfind("\n") + 1]
    header, _, body = text.partition("\n")
    names = next(csv.reader([header]), [])
    if not names:
        raise DamagedFile(f"{path}: no header line; the table is empty or of another program")
    rows = [row for row in csv.reader(io.StringIO(body)) if row]
    for number, row in enumerate(rows, start=2):
        if len(row) != len(names):
            raise DamagedFile(f"{path}: row {number} has {len(row)} cells, the header {len(names)}")
    try:
        columns = [_column(name, [row[k] for row in rows]) for k, name in enumerate(names)]
    except DamagedFile as error:
        raise DamagedFile(f"{path}: is damaged: {error}") from None
    table = np.empty(len(rows), dtype=[(name, column.dtype) for name, column in zip(names, columns)])
    for name, column in zip(names, columns):
        table[name] = column
    return table


def _column(name: str, cells: list[str]) -> np.ndarray:
    if name in TEXTS:
        return np.array(cells, dtype=np.str_)
    try:
        if name in FLAGS:
            return np.array([cell == "1" for cell in cells], dtype=bool)
        return np.array(cells, dtype=np.str_).astype(np.int64 if name in INTEGERS else np.float64)
    except ValueError:
        wrong = [k for k, cell in enumerate(cells) if not _is_number(cell, int if name in INTEGERS else float)]
        if name in INTEGERS or len(wrong) < len(cells):
            what = f"`{cells[wrong[0]]}` in the column `{name}`"
            raise DamagedFile(f"row {wrong[0] + 2}: {what} is no number of its kind") from None
        return np.array(cells, dtype=np.str_)  # texts alone, in a column that this package does not know by name


def _is_number(cell: str, kind: type[int] | type[float]) -> bool:
    try:
        kind(cell)
    except ValueError:
        return False
    return True
