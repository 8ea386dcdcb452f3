"""A dict as TOML, as far as scenes need it: tables, arrays of tables, texts, numbers, flags and lists of these."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np


def toml_text(scene: Mapping[str, Any]) -> str:
    """The dict as a TOML document. Reals are written so that they read back to the same bits.

    Raises TypeError naming the key for a value that TOML has no word for.
    """
    return "\n".join(_table(scene, "", "")).strip() + "\n"


def _table(table: Mapping[str, Any], path: str, header: str) -> list[str]:
    """Lines of a table: its own keys first, then the tables in it, since a header ends what stands before it."""
    lines = ["", header] if header else []
    inner: list[str] = []
    for key, value in table.items():
        name = key if key.replace("_", "a").replace("-", "a").isalnum() and key.isascii() else json.dumps(key)
        below = f"{path}.{name}" if path else name
        if isinstance(value, Mapping):
            inner += _table(value, below, f"[{below}]")
        elif _is_list(value) and len(value) > 0 and all(isinstance(each, Mapping) for each in value):
            for each in value:
                inner += _table(each, below, f"[[{below}]]")
        elif not (_is_list(value) and len(value) == 0 and key in _ARRAYS_OF_TABLES):
            lines.append(f"{name} = {_value(value, below)}")
    return lines + inner


_ARRAYS_OF_TABLES = {"wall", "stage", "load", "motion", "group", "pair", "insert", "remove"}


def _is_list(value: Any) -> bool:
    return isinstance(value, (list, tuple, np.ndarray))


def _value(value: Any, path: str) -> str:
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return repr(value)  # "inf" and "nan" are TOML, too
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_value(each, path) for each in value) + "]"
    if isinstance(value, Mapping):  # a table within a mixed list
        return "{ " + ", ".join(f"{json.dumps(k)} = {_value(v, path)}" for k, v in value.items()) + " }"
    raise TypeError(f"{path}: a {type(value).__name__} cannot be written as TOML")
