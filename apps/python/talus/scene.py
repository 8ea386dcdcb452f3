"""Scenes: what a run depends on, as a dict that reads and writes TOML."""

from __future__ import annotations

import copy
import os
import re
import tempfile
import tomllib
from collections.abc import Iterator, Mapping, MutableMapping
from pathlib import Path
from typing import Any

from . import command
from .toml_text import toml_text


class SceneError(ValueError):
    """What the program finds wrong with a scene, in its words."""


class Scene(MutableMapping[str, Any]):
    """A scene as a dict of the keys of docs/scenes.md, in SI units; keys may be dotted, as those of `--set`.

        scene = talus.Scene.load("apps/scenes/demo.toml")
        scene["material.friction"] = 0.5
        scene["wall.z+.pressure"] = 2e4       # elements of arrays go by name or by number
        scene.check()                         # the program's own checks

    `folder`: where relative paths in the scene begin; that of the file it was loaded from, else the present one.
    """

    def __init__(self, keys: Mapping[str, Any], folder: str | os.PathLike[str] = ".", name: str = "scene") -> None:
        self._keys: dict[str, Any] = copy.deepcopy(dict(keys))
        self.folder = Path(folder)
        self.name = str(self._keys.get("name", name))  #: of the results, where the scene says nothing else

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Scene:
        """The scene of a TOML file. Raises SceneError where the file is no TOML, or a folder."""
        path = Path(path)
        if path.is_dir():
            raise SceneError(f"{path}: is a folder; give a scene file in it")
        try:
            keys = tomllib.loads(path.read_text(encoding="utf-8"))
        except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
            raise SceneError(f"{path}: {error}") from None
        return cls(keys, path.parent, path.stem)

    def copy(self) -> Scene:
        """A scene of its own with the same keys."""
        return Scene(self._keys, self.folder, self.name)

    def to_dict(self) -> dict[str, Any]:
        """A copy of the keys as nested dicts and lists."""
        return copy.deepcopy(self._keys)

    # ---- keys

    def __getitem__(self, key: str) -> Any:
        return _descend(self._keys, key.split("."), key)

    def __setitem__(self, key: str, value: Any) -> None:
        *parents, last = key.split(".")
        place: Any = self._keys
        for k, part in enumerate(parents):
            if isinstance(place, dict):
                place.setdefault(part, {})
            place = _descend(place, [part], ".".join(parents[: k + 1]))
        if isinstance(place, list):
            place[_element(place, last, key)] = value
        elif isinstance(place, dict):
            place[last] = value
        else:
            raise KeyError(f"{key}: '{'.'.join(parents)}' is no table")

    def __delitem__(self, key: str) -> None:
        *parents, last = key.split(".")
        place = _descend(self._keys, parents, key)
        if isinstance(place, list):
            del place[_element(place, last, key)]
        elif isinstance(place, dict) and last in place:
            del place[last]
        else:
            raise KeyError(key)

    def __iter__(self) -> Iterator[str]:
        return iter(self._keys)

    def __len__(self) -> int:
        return len(self._keys)

    def __repr__(self) -> str:
        return f"Scene({self._keys!r})"

    # ---- TOML and checks

    def to_toml(self) -> str:
        """The scene as TOML, paths in it as they are."""
        return toml_text(self._keys)

    def toml_for(self, folder: str | os.PathLike[str]) -> str:
        """The scene as TOML of a file in `folder`: relative paths in it are changed to begin there."""
        return toml_text(_moved(self._keys, self.folder, Path(folder)))

    def write(self, path: str | os.PathLike[str]) -> None:
        """Writes the scene to a new file; relative paths in it are changed to begin at its folder.

        Raises FileExistsError where the file is there and holds something else.
        """
        path = Path(path)
        written = self.toml_for(path.parent)
        if path.exists():
            if path.read_text(encoding="utf-8") == written:
                return
            raise FileExistsError(f"{path}: exists and holds another scene; remove it, or choose another directory")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(written, encoding="utf-8")

    def check(self, program: str | None = None) -> Scene:
        """The resolved scene, with every default, after the program's own checks (`talus run --dry-run`).

        Raises SceneError with the program's message, which names the key and what was probably meant.
        """
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / f"{self.name}.toml"
            self.write(path)
            ended = command.call([command.find_program(program), "run", str(path), "--dry-run"])
            if ended.returncode != 0:
                # Lines are those of a file that nobody has.
                said = command.message_of(ended.stderr)
                raise SceneError(re.sub(re.escape(str(path)) + r"(:\d+)?", lambda _: path.name, said))
            return Scene(tomllib.loads(ended.stdout), folder, self.name)


def _element(place: list[Any], part: str, key: str) -> int:
    """Index of an element that goes by number or by its name."""
    if part.lstrip("-").isdigit() and -len(place) <= int(part) < len(place):
        return int(part)
    for k, each in enumerate(place):
        if isinstance(each, Mapping) and each.get("name") == part:
            return k
    names = [str(each["name"]) for each in place if isinstance(each, Mapping) and "name" in each]
    raise KeyError(f"{key}: no element '{part}'; there are {len(place)}" + (f": {', '.join(names)}" if names else ""))


def _descend(place: Any, parts: list[str], key: str) -> Any:
    for part in parts:
        if isinstance(place, list):
            place = place[_element(place, part, key)]
        elif isinstance(place, Mapping) and part in place:
            place = place[part]
        else:
            raise KeyError(f"{key}: the scene has no '{part}' there")
    return place


def _moved(place: Any, origin: Path, target: Path) -> Any:
    """A copy of the keys in which relative values of `file` lead from `target` to where they led from `origin`."""
    if isinstance(place, Mapping):
        return {key: os.path.relpath(origin / value, target)
                if key == "file" and isinstance(value, str) and not os.path.isabs(value)
                else _moved(value, origin, target) for key, value in place.items()}
    return [_moved(each, origin, target) for each in place] if isinstance(place, list) else place
