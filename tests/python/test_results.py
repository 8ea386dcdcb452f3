"""A run is read as it was written: tables, frames, and errors that say what is missing."""

import csv
import json
import shutil
import subprocess
import threading

import h5py
import numpy as np
import pytest

import talus


def test_a_table_holds_what_another_reader_reads(heap_run):
    with open(heap_run.directory / "walls.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(heap_run.walls) == len(rows) == 30 * 6
    assert heap_run.walls.dtype.names == tuple(rows[0])
    assert [str(name) for name in heap_run.walls["wall"][:6]] == ["x-", "x+", "y-", "y+", "z-", "z+"]
    assert heap_run.walls["force_z"].tolist() == [float(row["force_z"]) for row in rows]


def test_types_of_columns_do_not_depend_on_their_values(heap_run):
    steps = heap_run.steps
    assert steps["step"].dtype == np.int64 and steps["converged"].dtype == bool
    assert steps["jump"].dtype == np.float64  # 0 in every row


def test_the_grains_gain_the_momentum_that_walls_and_gravity_give(heap_run):
    frame, walls = heap_run.frame(-1), heap_run.walls
    mass = 2600 * 4 / 3 * np.pi * frame.radii**3
    from_walls = 1e-3 * walls["force_z"].sum()  # time step times the forces of all steps
    gained = from_walls - 9.81 * mass.sum() * frame.time
    assert gained == pytest.approx(mass @ frame.velocities[:, 2], abs=1e-6 * from_walls)


def test_forces_of_contacts_add_up_to_those_of_the_walls(heap_run):
    frame = heap_run.frame(-1)
    for k, wall in enumerate(frame.walls):
        with_wall = frame.contacts[:, 1] == -(1 + k)
        total = frame.forces[with_wall].sum(axis=0)
        assert np.allclose(total, wall["force"], rtol=1e-9, atol=1e-9 * np.abs(frame.forces).max()), wall["name"]


def test_moments_are_there_where_contacts_resist_rolling(rolling_run, heap_run):
    frame = rolling_run.frame(-1)
    assert frame.moments.shape == frame.forces.shape and np.abs(frame.moments).max() > 0
    assert np.abs(np.einsum("ij,ij->i", frame.moments, frame.normals)).max() <= 1e-12 * np.abs(frame.moments).max()
    assert rolling_run.frame(0).moments.shape == (0, 3)
    with pytest.raises(talus.MissingData):
        heap_run.frame(-1).moments


def test_contacts_touch_where_positions_radii_and_normals_say(heap_run):
    frame = heap_run.frame(-1)
    pairs = frame.contacts[frame.between_grains]
    first, second = frame.rows(pairs[:, 0]), frame.rows(pairs[:, 1])
    branch = frame.positions[first] - frame.positions[second]
    distance = np.linalg.norm(branch, axis=1)
    gap = distance - frame.radii[first] - frame.radii[second]
    assert np.allclose(gap, frame.gaps[frame.between_grains], atol=1e-4 * frame.radii.min())
    assert np.allclose(branch / distance[:, None], frame.normals[frame.between_grains], atol=1e-2)
    assert np.all(frame.normal_forces > 0)


def test_a_periodic_cell_is_what_its_table_and_its_contacts_say(sheared_run):
    frame, row = sheared_run.frame(-1), sheared_run.cell[-1]
    names = ("edge_xx", "edge_yy", "edge_zz", "edge_xy", "edge_xz", "edge_yz")
    assert [frame.cell[k] for k in ((0, 0), (1, 1), (2, 2), (1, 0), (2, 0), (2, 1))] == [row[name] for name in names]
    assert np.all(frame.cell_origin == [-1, 2, 3])
    # dh/dt = L h: the shear of 2/s is prescribed, and the cell follows a stress along x.
    along_x = frame.cell_rates[0, 0] / frame.cell[0, 0]
    assert frame.cell_rates[2, 0] == pytest.approx(along_x * frame.cell[2, 0] + 2 * frame.cell[2, 2], rel=1e-3)
    low, high = frame.cell_origin, frame.cell_origin + np.diag(frame.cell)
    assert np.all((frame.positions >= low - 1e-12) & (frame.positions <= high + 1e-12)), "grains are wrapped"
    first, second = frame.rows(frame.contacts[:, 0]), frame.rows(frame.contacts[:, 1])
    across = frame.positions[first] - frame.positions[second]
    branch = frame.nearest(across)
    distance = np.linalg.norm(branch, axis=1)
    assert np.count_nonzero(np.linalg.norm(across, axis=1) > 2 * distance) > 10, "contacts across faces"
    assert np.allclose(distance - frame.radii[first] - frame.radii[second], frame.gaps, atol=1e-12)
    assert np.allclose(branch / distance[:, None], frame.normals, atol=2e-2)  # those of the middle of the step


def test_between_walls_there_is_no_cell(heap_run):
    with pytest.raises(talus.MissingData, match=r"no \[cell\]"):
        heap_run.frame(-1).cell


def test_frames_are_those_of_the_output_times(heap_run):
    assert [frame.step for frame in heap_run.frames] == [0, 10, 20, 30]
    assert np.allclose(heap_run.frames.times, [0, 0.01, 0.02, 0.03])
    assert heap_run.frame(-1).index == 3 and heap_run.frame(0).stage == "rest"
    assert [frame.step for frame in heap_run.frames[1:3]] == [10, 20]


def test_summary_is_that_of_the_program(heap_run):
    assert heap_run.status == "done" and heap_run.summary["steps"] == 30
    assert heap_run.json == json.loads((heap_run.directory / "run.json").read_text())
    assert heap_run.missed == heap_run.summary["unconverged_steps"]
    assert heap_run.scene["material"]["friction"] == 0.35


def test_every_column_has_its_unit(heap_run):
    units = heap_run.units("walls")
    assert tuple(units) == heap_run.walls.dtype.names
    assert units["force_z"] == "N" and units["torque_x"] == "N m" and units["time"] == "s"


def test_every_column_of_every_table_is_in_the_dictionary(heap_run):
    assert {"steps", "walls", "triaxial"} <= set(heap_run.tables)
    for name in heap_run.tables:
        assert tuple(heap_run.units(name)) == heap_run.table(name).dtype.names


def test_every_array_of_a_frame_has_its_unit(heap_run):
    units = {}
    with h5py.File(heap_run.directory / "results.h5") as file:
        file.visititems(lambda name, item: units.update({name: item.attrs["units"].decode()})
                        if isinstance(item, h5py.Dataset) else None)
    assert len(units) == 1 + 4 * 15  # the names of the walls, and the arrays of each frame
    assert units["frames/000003/bodies/u"] == "m/s" and units["frames/000000/contacts/force"] == "N"


def test_a_line_cut_by_a_kill_is_left_out(heap_run, tmp_path):
    text = (heap_run.directory / "steps.csv").read_text()
    (tmp_path / "steps.csv").write_text(text[:-7])
    assert len(talus.read_table(tmp_path / "steps.csv")) == 29


def test_quoted_names_are_read(tmp_path):
    (tmp_path / "walls.csv").write_text('step,wall,work\n1,"a ""left"", tilted\nwall",0\n')
    assert talus.read_table(tmp_path / "walls.csv")["wall"][0] == 'a "left", tilted\nwall'


def test_a_folder_that_is_no_run_is_named_with_the_runs_in_it(heap_run, tmp_path):
    with pytest.raises(FileNotFoundError, match="no such directory"):
        talus.open(tmp_path / "none")
    with pytest.raises(talus.NotARun, match="no run of Talus"):
        talus.open(tmp_path)
    with pytest.raises(talus.NotARun, match="there are runs in it: heap"):
        talus.open(heap_run.directory.parent)


def test_what_is_missing_is_said(heap_run):
    with pytest.raises(talus.MissingData, match="no frame 7; it has frames 0 to 3"):
        heap_run.frame(7)
    with pytest.raises(talus.MissingData, match="no bodies.csv; there are: .*steps"):
        heap_run.table("bodies")
    with pytest.raises(AttributeError, match="no inserted.csv"):
        heap_run.inserted
    with pytest.raises(talus.MissingData, match="orientation = true"):
        heap_run.frame(0).orientations
    with pytest.raises(talus.MissingData, match="walls have negative ids"):
        heap_run.frame(-1).rows(np.array([-1]))
    with pytest.raises(talus.MissingData, match="lacks 2 of the ids asked for, as 98765; they came later, or were removed"):
        heap_run.frame(-1).rows(np.array([0, 98765, 98766]))


def test_contacts_that_were_not_written_are_not_none(heap, tmp_path):
    heap["output"] = {"every_steps": 10, "contacts_every": 2, "velocities": False}
    run = talus.run(heap, tmp_path / "run", threads=1, progress=False)
    assert len(run.frame(2).contacts) > 0
    for ask in (lambda frame: frame.contacts, lambda frame: frame.normal_forces, lambda frame: frame.moments):
        with pytest.raises(talus.MissingData, match="output.contacts_every leaves them out"):
            ask(run.frame(1))
    view = [talus.find_program(), "view", str(run.directory), "--frame", "2", "--colour", "force", "-o",
            str(tmp_path / "force.png"), "--width", "64"]
    assert subprocess.run(view).returncode == 0, "forces are seen without velocities"
    view[4] = "1"
    refused = subprocess.run([*view, "--force"], capture_output=True, text=True)
    assert refused.returncode == 2 and "without its contacts" in refused.stderr
    with pytest.raises(talus.MissingData, match="'walls' is no array"):
        run.frame(1).array("walls")


def test_a_frame_without_grains_has_empty_arrays(tmp_path):
    scene = {"time_step": 1e-3, "orientation": True, "material": {"density": 2600},
             "insert": [{"name": "late", "radius": 0.01, "from": 0.015, "count": 1,
                         "region": {"shape": "box", "low": [0, 0, 0], "high": [0.1, 0.1, 0.1]}}],
             "stage": [{"name": "wait", "end": {"steps": 20}}], "output": {"every_steps": 10}}
    run = talus.run(scene, tmp_path / "run", threads=1, progress=False)
    for frame, grains in ((run.frame(0), 0), (run.frame(-1), 1)):
        assert frame.angular_velocities.shape == (grains, 3) and frame.orientations.shape == (grains, 4)


@pytest.mark.parametrize("content", [b'{"summary": {"status": "do', b"", b"[1, 2]", b"\xff\xfe{}", b'{"summary": 3}'])
def test_a_damaged_file_is_named(heap_run, tmp_path, content):
    other = tmp_path / "run"
    shutil.copytree(heap_run.directory, other)
    (other / "run.json").write_bytes(content)
    with pytest.raises(talus.DamagedFile, match="run/run.json: "):
        talus.open(other).status
    if content != b'{"summary": 3}':
        for name in ("status.json", "columns.json", "scene.resolved.toml"):
            (other / name).write_bytes(content)
        damaged = talus.open(other)
        for name, ask in (("status.json", lambda: damaged.progress), ("columns.json", lambda: damaged.units("steps"))):
            with pytest.raises(talus.DamagedFile, match=f"run/{name}: is damaged"):
                ask()
    (other / "scene.resolved.toml").write_bytes(b"seed = \n")
    with pytest.raises(talus.DamagedFile, match="scene.resolved.toml: is damaged"):
        talus.open(other).scene


def test_a_status_and_steps_that_no_run_has_are_damage(heap_run, tmp_path):
    other = tmp_path / "run"
    shutil.copytree(heap_run.directory, other)
    (other / "run.json").write_text('{"summary": {"status": 7}}')
    with pytest.raises(talus.DamagedFile, match="run/run.json: `status` is 7"):
        talus.open(other).status
    (other / "steps.csv").write_text("a,b\n1,2\n")
    with pytest.raises(talus.DamagedFile, match="run/steps.csv: has no column `converged`"):
        talus.open(other).steps


@pytest.mark.parametrize("name, content", [("results.h5", b""), ("results.h5", b"no HDF5"), ("steps.csv", b"\xff\n1\n"),
                                           ("steps.csv", b"step,time\n1\n"), ("steps.csv", b"step,time\n1,2\n"),
                                           ("steps.csv", b"time,converged\n1,1\nabc,1\n"),
                                           ("steps.csv", b"step,converged\n1,1\n2.5,1\n")])
def test_a_damaged_table_or_file_of_frames_is_named(heap_run, tmp_path, name, content):
    other = tmp_path / "run"
    shutil.copytree(heap_run.directory, other)
    (other / name).write_bytes(content)
    with pytest.raises(talus.DamagedFile, match=f"run/{name}: "):
        talus.open(other).frame(0).positions if name == "results.h5" else talus.open(other).missed


def test_an_array_that_every_frame_has_is_missing_only_in_a_damaged_file(heap_run, tmp_path):
    other = tmp_path / "run"
    shutil.copytree(heap_run.directory, other)
    with h5py.File(other / "results.h5", "r+") as file:
        del file["frames/000001/contacts/force"]
        file.attrs["format"] = np.bytes_(b"\xff\xfe")
    with pytest.raises(talus.DamagedFile, match="run/results.h5: "):
        talus.open(other).frame(1).positions
    with h5py.File(other / "results.h5", "r+") as file:
        file.attrs["format"] = "talus-results"
    with pytest.raises(talus.DamagedFile, match="has no 'contacts/force'"):
        talus.open(other).frame(1).forces


def test_frames_are_read_while_h5py_has_the_file_open(heap_run):
    with h5py.File(heap_run.directory / "results.h5") as file:
        assert len(talus.open(heap_run.directory).frame(0).positions) == len(file["frames/000000/bodies/x"])


def test_other_formats_are_refused(heap_run, tmp_path):
    other = tmp_path / "run"
    shutil.copytree(heap_run.directory, other)
    with h5py.File(other / "results.h5", "a") as file:
        file.attrs["format_version"] = 0
    with pytest.raises(ValueError, match="format 0 of results.h5; this package reads format 1"):
        talus.open(other).frames
    (other / "results.h5").unlink()
    assert len(talus.open(other).frames) == 0
    with pytest.raises(talus.MissingData, match="it has none yet"):
        talus.open(other).frame(-1)


def test_a_run_is_read_while_it_goes_on_and_after_it_is_resumed(heap, tmp_path):
    heap["stage"][0]["end"]["steps"] = 400
    heap["output"]["every_steps"] = 2
    out = tmp_path / "live"
    seen = []

    def look():
        while True:
            if (out / "run.json").exists():
                run = talus.open(out)
                frames = run.frames
                seen.append(len(frames))
                try:
                    assert not len(frames) or np.isfinite(frames[-1].positions).all()
                except talus.MissingData:  # the frame of the stop: the run that goes on from before it has cut it off
                    assert resumed.is_set()
                if "steps" in run.tables:
                    steps = run.steps["step"]  # read once: the next look may see more
                    assert steps.tolist() == list(range(1, len(steps) + 1))
            if done.is_set():
                return

    done, resumed = threading.Event(), threading.Event()
    failure = []

    def watch():
        try:
            look()
        except BaseException as error:  # what a thread raises is lost otherwise
            failure.append(error)

    reader = threading.Thread(target=watch)
    reader.start()
    try:
        with pytest.raises(talus.Stopped):
            talus.run(heap, out, threads=1, progress=False,
                      options=["--max-walltime", "0:00:03", "--set", "stage.0.end.steps=1000000"])
        run = talus.open(out)
        assert run.status == "stopped"
        steps = run.summary["steps"]
        cut = run.frame(-1)
        resumed.set()
        talus.run(heap, out, threads=1, progress=False, resume=True,
                  options=["--set", f"stage.0.end.steps={steps + 40}"])
    finally:
        done.set()
        reader.join()
    assert not failure, failure
    with pytest.raises(talus.MissingData, match="no longer there"):
        talus.Frame(out / "results.h5", cut.index, cut.step - 1, cut.time, cut.stage).positions
    assert run.status == "done" and len(run.steps) == steps + 40 and run.frame(-1).step == steps + 40
    assert len(set(seen)) > 2, "the reader never met a run that goes on"
