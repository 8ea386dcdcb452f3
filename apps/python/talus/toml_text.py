"""A dict as TOML: tomli_w, told of numpy's numbers and of the arrays of tables that a scene may leave empty."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import tomli_w


def toml_text(scene: Mapping[str, Any]) -> str:
    """The dict as a TOML document. Reals are written so that they read back to the same bits.

    Raises TypeError naming the key for a value that TOML has no word for.
    """
    return tomli_w.dumps(_plain(scene, ""))


_ARRAYS_OF_TABLES = {
    "material", "pair", "sample", "insert", "remove", "probe", "field", "wall", "group", "motion", "stage", "load",
}


def _plain(value: Any, path: str) -> Any:
    """Values as Python's own; without empty arrays of tables, for which TOML has only a list."""
    if isinstance(value, Mapping):
        below = {key: f"{path}.{key}" if path else str(key) for key in value}
        return {
            key: _plain(each, below[key])
            for key, each in value.items()
            if not (key in _ARRAYS_OF_TABLES and isinstance(each, (list, tuple)) and len(each) == 0)
        }
    if isinstance(value, (np.generic, np.ndarray)):
        value = value.tolist()
    if isinstance(value, (list, tuple)):
        return [_plain(each, path) for each in value]
    if isinstance(value, (bool, int, float, str)):
        return value
    raise TypeError(f"{path}: a {type(value).__name__} cannot be written as TOML")
