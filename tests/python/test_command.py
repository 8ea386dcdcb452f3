"""Scenes and runs: what Python writes the program reads, and what the program says Python raises."""

import csv
import os
import signal
import threading
import time
import tomllib

import numpy as np
import pytest

import talus
from talus.toml_text import toml_text

from conftest import ROOT


@pytest.mark.parametrize("path", sorted((ROOT / "apps/scenes").glob("*.toml")), ids=lambda path: path.stem)
def test_scenes_that_ship_are_written_as_they_were_read(path):
    scene = talus.Scene.load(path)
    assert tomllib.loads(scene.to_toml()) == tomllib.loads(path.read_text())


def test_values_of_toml_survive():
    value = {"a": 0.1, "b": 1e-300, "c": [1, 2.5], "text": 'quote " \\ \n ü \x01', "flag": True, "t": {"x y": [{"k": 1}, {}]},
             "np": np.float64(0.25), "array": np.array([1.0, 2.0]), "inf": float("inf")}
    back = tomllib.loads(toml_text(value))
    assert back.pop("array") == [1.0, 2.0] and back.pop("np") == 0.25
    assert back == {key: value[key] for key in back} and set(back) == set(value) - {"array", "np"}
    with pytest.raises(TypeError, match="material.density"):
        toml_text({"material": {"density": None}})


def test_keys_are_those_of_set(heap):
    scene = talus.Scene(heap)
    scene["stage.rest.friction"] = 0.1
    scene["solver.tolerance"] = 1e-5
    assert scene["stage.0.friction"] == 0.1 and scene["solver"] == {"tolerance": 1e-5}
    with pytest.raises(KeyError, match="no element 'shear'; there are 1: rest"):
        scene["stage.shear.friction"] = 0.1
    assert "solver" not in heap, "a scene has its own copy"


def test_the_program_checks_a_scene(heap):
    resolved = talus.Scene(heap).check()
    assert resolved["solver.tolerance"] > 0 and len(resolved["wall"]) == 6
    heap["material"]["frction"] = 0.1
    with pytest.raises(talus.SceneError, match=r"^\w+\.toml: material.frction: unknown key; did you mean 'friction'"):
        talus.Scene(heap).check()


def test_files_of_a_scene_are_found_from_another_folder(tmp_path):
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "grains.csv").write_text("id,x,y,z,radius\n0,0.5,0.5,0.5,0.1\n")
    scene = talus.Scene({"time_step": 1e-3, "box": True, "material": {"density": 2600},
                         "sample": {"kind": "bodies", "file": "data/grains.csv"},
                         "stage": [{"name": "one", "end": {"steps": 1}}]}, folder=tmp_path)
    run = talus.run(scene, tmp_path / "elsewhere" / "out", threads=1, progress=False)
    assert run.frame(-1).radii.tolist() == [0.1]


def test_errors_carry_message_and_exit_code(heap, tmp_path):
    heap["material"]["friction"] = -1
    with pytest.raises(talus.RunError, match="material.friction: must be 0 to") as raised:
        talus.run(heap, tmp_path / "bad", progress=False)
    assert raised.value.exit_code == 2 and "must be 0 to" in raised.value.message
    with pytest.raises(FileNotFoundError):
        talus.run(heap, tmp_path / "bad", program=tmp_path / "no-talus")


def test_results_are_not_overwritten(heap_run, heap):
    before = heap_run.summary["digest"]
    with pytest.raises(talus.RunError, match="not empty") as raised:
        talus.run(heap, heap_run.directory, progress=False)
    assert raised.value.exit_code == 2 and heap_run.summary["digest"] == before
    heap["seed"] = 5
    with pytest.raises(FileExistsError, match="holds another scene"):
        talus.run(heap, heap_run.directory, progress=False)


def test_a_scene_of_the_users_own_is_never_written_over(heap, tmp_path):
    own = tmp_path / "dam.toml"
    own.write_text("# mine\n" + talus.Scene(heap).to_toml())
    before = own.read_text()
    scene = talus.Scene.load(own)
    scene["material.friction"] = 0.2
    for options in ({}, {"force": True}, {"resume": True}):
        with pytest.raises(FileExistsError, match="not as talus.run writes scenes"):
            talus.run(scene, tmp_path / "dam", progress=False, **options)
        assert own.read_text() == before
    talus.run(heap, tmp_path / "run", threads=1, progress=False)
    edited = (tmp_path / "run.toml").read_text() + "# mine\n"
    (tmp_path / "run.toml").write_text(edited)
    with pytest.raises(FileExistsError, match="not as talus.run writes scenes"):
        talus.run(scene, tmp_path / "run", progress=False, force=True)
    (tmp_path / "sweep").mkdir()
    (tmp_path / "sweep" / "001.toml").write_text("# mine\n")
    with pytest.raises(FileExistsError, match="001.toml"):
        talus.sweep(heap, tmp_path / "sweep", friction=[0.1, 0.2], force=True)
    (tmp_path / "linked.toml").symlink_to(own)
    with pytest.raises(FileExistsError, match="symbolic link"):
        talus.run(scene, tmp_path / "linked", progress=False, force=True)
    assert own.read_text() == before and (tmp_path / "run.toml").read_text() == edited
    assert [path.name for path in (tmp_path / "sweep").iterdir()] == ["001.toml"]


def test_a_run_that_cannot_begin_leaves_no_scene(heap, tmp_path, monkeypatch):
    program = talus.find_program()
    monkeypatch.setenv("PATH", "")
    with pytest.raises(FileNotFoundError, match="mpirun"):
        talus.run(heap, tmp_path / "run", ranks=2, progress=False, program=program)
    assert not list(tmp_path.iterdir())


def test_a_scene_that_the_program_refuses_blocks_no_better_one(heap, tmp_path):
    out = tmp_path / "run"
    with pytest.raises(talus.RunError, match="frictoin"):
        talus.run(heap, out, settings={"material.frictoin": 0.3}, threads=1, progress=False)
    assert not list(tmp_path.iterdir())
    talus.run(heap, out, settings={"material.friction": 0.3}, threads=1, progress=False)
    kept = (tmp_path / "run.toml").read_text()
    with pytest.raises(FileExistsError, match="force=True begins anew"):
        talus.run(heap, out, progress=False)
    with pytest.raises(talus.RunError):
        talus.run(heap, out, settings={"material.frictoin": 0.3}, force=True, progress=False)
    assert (tmp_path / "run.toml").read_text() == kept
    longer = talus.Scene.load(tmp_path / "run.toml")
    longer["stage.rest.end.steps"] = 40
    assert talus.run(longer, out, resume=True, threads=1, progress=False).summary["steps"] == 40
    assert talus.run(heap, out, force=True, threads=1, progress=False).summary["steps"] == 30


def test_arguments_of_another_kind_are_named(heap, tmp_path):
    with pytest.raises(ValueError, match="ranks must be a whole number, 1 or more, got 0"):
        talus.run(heap, tmp_path / "run", ranks=0)
    with pytest.raises(ValueError, match="whole number, 1 or more, got 2.5"):
        talus.run(heap, tmp_path / "run", ranks=2.5)
    with pytest.raises(TypeError, match="'--steps', '2'"):
        talus.run(heap, tmp_path / "run", options="--steps 2")
    with pytest.raises(TypeError, match="friction: give a list of values"):
        talus.sweep(heap, tmp_path / "sweep", friction=0.3)
    with pytest.raises(talus.SceneError, match="is a folder"):
        talus.Scene.load(tmp_path)
    assert not list(tmp_path.iterdir())


def test_missed_steps_are_a_flag(heap, tmp_path):
    run = talus.run(heap, tmp_path / "missed", threads=1, progress=False,
                    settings={"solver": {"method": "nlgs", "max_iterations": 1}})
    assert run.missed > 0 and run.summary["exit_code"] == 3 and run.status == "done"


def test_ranks_give_the_bits_of_one(heap, tmp_path):
    settings = {"decomposition": {"subdomains": 2}}
    digests = {talus.run(heap, tmp_path / f"ranks{n}", ranks=n, threads=1, progress=False,
                         settings=settings).summary["digest"] for n in (1, 2)}
    assert len(digests) == 1


def test_an_error_of_several_ranks_is_said_once(heap, tmp_path):
    heap["materal"] = {}
    with pytest.raises(talus.RunError) as raised:
        talus.run(heap, tmp_path / "bad", ranks=2, threads=1, progress=False)
    assert raised.value.exit_code == 2 and raised.value.message.count("materal") == 1
    assert "mpirun" not in raised.value.message


def test_progress_is_told(heap, tmp_path):
    heap["stage"][0]["end"]["steps"] = 10**9
    told = []
    with pytest.raises(talus.Stopped) as raised:
        talus.run(heap, tmp_path / "told", threads=1, progress=told.append, options=["--max-walltime", "0:00:03"])
    assert raised.value.exit_code == 75
    steps = [status["step"] for status in told if status.get("step")]
    assert steps and steps == sorted(steps) and all("heartbeat" in status for status in told)


def interrupt_this_process_behind_a_checkpoint_of(run):
    def interrupt():
        deadline = time.monotonic() + 60
        while time.monotonic() < deadline and not list(run.glob("checkpoint_*.h5")):
            time.sleep(0.05)
        os.kill(os.getpid(), signal.SIGINT)

    threading.Thread(target=interrupt).start()


def test_an_interrupt_stops_the_run_behind_a_checkpoint(heap, tmp_path):
    heap["stage"][0]["end"]["steps"] = 10**9
    interrupt_this_process_behind_a_checkpoint_of(tmp_path / "run")
    with pytest.raises(KeyboardInterrupt):
        talus.run(heap, tmp_path / "run", threads=1, progress=False)
    run = talus.open(tmp_path / "run")
    assert run.status == "stopped" and run.summary["exit_code"] == 75


@pytest.mark.parametrize("jobs", [1, 2])
def test_an_interrupt_of_this_process_alone_stops_all_runs_of_a_sweep(heap, tmp_path, jobs):
    out = tmp_path / "sweep"
    interrupt_this_process_behind_a_checkpoint_of(out / "001")
    with pytest.raises(KeyboardInterrupt):
        talus.sweep(heap, out, {"stage.0.end.steps": [3, 10**9, 10**8]}, jobs=jobs)
    assert [talus.open(out / run).status for run in ("000", "001")] == ["done", "stopped"]
    assert not (out / "002/run.json").exists() or talus.open(out / "002").status == "stopped"
    with (out / "sweep.csv").open() as file:
        assert [row["exit_code"] for row in csv.DictReader(file)] == ["0", "75", "75"]


def test_a_sweep_is_a_product_with_a_table(heap, tmp_path):
    swept = talus.sweep(heap, tmp_path / "sweep", {"stage.rest.end.steps": [5, 7]}, friction=[0.1, 0.5], jobs=2,
                        measure={"grains": lambda run: len(run.frame(-1).ids)})
    table = swept.table
    assert table["material.friction"].tolist() == [0.1, 0.5, 0.1, 0.5]
    assert table["stage.rest.end.steps"].tolist() == table["steps"].tolist() == [5, 5, 7, 7]
    assert table["grains"].tolist() == [60] * 4 and len(set(table["digest"])) == 4
    assert all(run.scene["material"]["friction"] == mu for run, mu in zip(swept.runs, table["material.friction"]))
    assert len(talus.read_table(tmp_path / "sweep" / "sweep.csv")) == 4
    again = talus.sweep(heap, tmp_path / "sweep", {"stage.rest.end.steps": [5, 7]}, friction=[0.1, 0.5], resume=True)
    assert again.table["digest"].tolist() == table["digest"].tolist()
    written = (tmp_path / "sweep" / "sweep.csv").read_bytes()
    with pytest.raises(FileExistsError, match="resume=True keeps what is done"):
        talus.sweep(heap, tmp_path / "sweep", {"stage.rest.end.steps": [5, 7]}, friction=[0.1, 0.5])
    assert (tmp_path / "sweep" / "sweep.csv").read_bytes() == written
    with pytest.raises(AttributeError, match="no_such_table"):
        talus.sweep(heap, tmp_path / "sweep", {"stage.rest.end.steps": [5, 7]}, friction=[0.1, 0.5], resume=True,
                    measure={"a": lambda run: run.no_such_table, "grains": lambda run: len(run.frame(-1).ids)})
    assert talus.read_table(tmp_path / "sweep" / "sweep.csv")["grains"].tolist() == [60] * 4
    written = (tmp_path / "sweep" / "sweep.csv").read_bytes()
    with pytest.raises(FileExistsError, match="a sweep of other values, or of another scene"):
        talus.sweep(heap, tmp_path / "sweep", {"stage.rest.end.steps": [5, 7]}, friction=[0.2, 0.6], resume=True)
    assert (tmp_path / "sweep" / "sweep.csv").read_bytes() == written


def test_a_sweep_says_which_key_it_does_not_know(heap, tmp_path):
    with pytest.raises(talus.SceneError, match="frictoin: no key of the scene"):
        talus.sweep(heap, tmp_path / "sweep", frictoin=[1])
    with pytest.raises(talus.SceneError, match="must be 0 to"):
        talus.sweep(heap, tmp_path / "sweep", friction=[0.1, -1])
    for name in ("material.friction", "steps", "digest"):
        with pytest.raises(ValueError, match=f"a column of its own called {name}"):
            talus.sweep(heap, tmp_path / "sweep", friction=[0.1], measure={name: lambda run: 1.0})
    with pytest.raises(ValueError, match="material.friction: varied twice"):
        talus.sweep(heap, tmp_path / "sweep", {"material.friction": [0.1, 0.2]}, friction=[0.5])
    with pytest.raises(ValueError, match="jobs must be 1 or more"):
        talus.sweep(heap, tmp_path / "sweep", friction=[0.1], jobs=0)
    assert not (tmp_path / "sweep").exists(), "nothing is run before all scenes are sound"


def test_a_run_that_fails_leaves_a_row_and_the_others(heap, tmp_path):
    swept = talus.sweep(heap, tmp_path / "sweep", {"seed": [1, 2]}, options=["--dump-fclib", "99"])
    assert swept.table["exit_code"].tolist() == [1, 1] and all(swept.errors) and swept.runs == [None, None]
