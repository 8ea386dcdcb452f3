"""Talus in Python: read runs, write scenes, start runs, and measure packings. All quantities are in SI units.

    import talus

    run = talus.open("out/demo")               # also while it goes on
    run.steps["error_rms"], run.walls, run.triaxial    # tables: numpy structured arrays
    frame = run.frame(-1)
    frame.positions, frame.contacts, frame.forces      # [m], ids, [N]

    scene = talus.Scene.load("apps/scenes/demo.toml")
    scene["material.friction"] = 0.5
    run = talus.run(scene, "out/rough", ranks=2)       # raises talus.RunError if the program fails
    talus.sweep(scene, "out/sweep", friction=[0.2, 0.3, 0.5]).table
"""

from .command import RunError, Stopped, find_program, run
from .errors import DamagedFile, MissingData, NotARun
from .frame import Frame
from .parameter_sweep import Sweep, sweep
from .results import Run, open_run
from .scene import Scene, SceneError
from .statistics import anisotropy, displacements, fabric_tensor, force_distribution, pair_correlation
from .tables import read_table

open = open_run  # `talus.open`; inside this package the name would hide the built-in

__version__ = "0.1.0"
__all__ = [
    "DamagedFile", "Frame", "MissingData", "NotARun", "Run", "RunError", "Scene", "SceneError", "Stopped", "Sweep",
    "anisotropy", "displacements", "fabric_tensor", "find_program", "force_distribution", "open", "open_run",
    "pair_correlation", "read_table", "run", "sweep",
]
