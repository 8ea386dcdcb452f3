"""Runs that several tests look at."""

import copy
import pathlib

import pytest

import talus

ROOT = pathlib.Path(__file__).resolve().parents[2]

# Sixty grains fall into a box: contacts with walls and between grains, frames and every table of a box.
HEAP = {
    "name": "heap",
    "gravity": [0, 0, -9.81],
    "time_step": 1e-3,
    "box": True,
    "material": {"density": 2600, "friction": 0.35},
    "sample": {"kind": "deposition", "count": 60, "base": [0.08, 0.08], "radius_distribution": "uniform",
               "radius_min": 0.008, "radius_max": 0.01},
    "stage": [{"name": "rest", "end": {"steps": 30}}],
    "output": {"every_steps": 10},
    "checkpoint": {"every_steps": 5},
}


# Grains that are pressed and sheared in a periodic cell, which leans at the end: contacts across its faces.
SHEARED = {
    "name": "sheared",
    "time_step": 5e-4,
    "material": {"density": 2600},
    "cell": {"lengths": [0.05, 0.045, 0.05], "origin": [-1, 2, 3]},
    "sample": {"kind": "random", "count": 60, "radius": 0.005},
    "stage": [{"name": "shear", "shear_rates": [0, 2.0, 0], "stress": {"xx": 1e3, "yy": 1e3, "zz": 1e3},
               "end": {"steps": 400}}],
    "output": {"every_steps": 200, "xyz": True},
}


@pytest.fixture(scope="session")
def sheared_run(tmp_path_factory):
    return talus.run(copy.deepcopy(SHEARED), tmp_path_factory.mktemp("runs") / "sheared", threads=1, progress=False)


@pytest.fixture
def heap():
    return copy.deepcopy(HEAP)


@pytest.fixture(scope="session")
def heap_run(tmp_path_factory):
    return talus.run(copy.deepcopy(HEAP), tmp_path_factory.mktemp("runs") / "heap", threads=1, progress=False)


@pytest.fixture(scope="session")
def rolling_run(tmp_path_factory):
    scene = copy.deepcopy(HEAP)
    scene["material"]["rolling_resistance"] = 0.1
    return talus.run(scene, tmp_path_factory.mktemp("runs") / "rolling", threads=1, progress=False)
