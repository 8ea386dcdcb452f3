"""`talus convert` against readers of the two formats that share nothing with their writers."""

import resource
import shutil
import signal
import subprocess

import h5py
import numpy as np
import pytest

import talus

# Grains come while the run goes on, so that frames differ in their number.
RAIN = {
    "name": "rain", "gravity": [0, 0, -9.81], "time_step": 1e-3, "orientation": True,
    "material": {"density": 2600},
    "wall": [{"name": "floor", "point": [0, 0, 0], "normal": [0, 0, 1]}],
    "insert": [{"name": "rain", "radius": 0.01, "rate": 200, "count": 12,
                "region": {"shape": "box", "low": [0, 0, 0.1], "high": [0.2, 0.2, 0.3]}}],
    "stage": [{"name": "fall", "end": {"steps": 60}}],
    "output": {"every_steps": 20},
}


@pytest.fixture(scope="module")
def rain(tmp_path_factory):
    run = talus.run(RAIN, tmp_path_factory.mktemp("rain") / "run", threads=1, progress=False)
    counts = [len(frame.ids) for frame in run.frames]
    assert counts[0] == 0 and counts[1] < counts[-1], counts
    return run


def convert(*words):
    return subprocess.run([talus.find_program(), "convert", *map(str, words)], capture_output=True, text=True)


def read_dump(path):
    """Frames of a LAMMPS dump: (step, time, {column: values}), by the rules of its manual."""
    lines = iter(path.read_text().splitlines())
    frames, now = [], {}
    for line in lines:
        kind, _, rest = line.removeprefix("ITEM: ").partition(" ")
        assert line.startswith("ITEM: "), line
        if kind in ("UNITS", "TIME", "TIMESTEP"):
            now[kind] = next(lines)
        elif line == "ITEM: NUMBER OF ATOMS":
            now["count"] = int(next(lines))
        elif line.startswith("ITEM: BOX BOUNDS"):
            now["box"] = [[float(edge) for edge in next(lines).split()] for _ in range(3)]
        elif kind == "ATOMS":
            rows = np.array([[float(cell) for cell in next(lines).split()] for _ in range(now["count"])])
            frames.append((now, {name: rows.reshape(-1, len(rest.split()))[:, k] for k, name in enumerate(rest.split())}))
            now = {}
        else:
            raise AssertionError(line)
    return frames


def test_a_lammps_dump_has_the_frames_to_the_bit(rain):
    assert convert(rain.directory, "--to", "lammps").returncode == 0
    dumped = read_dump(rain.directory / "grains.lammpstrj")
    assert len(dumped) == len(rain.frames)
    for (head, atoms), frame in zip(dumped, rain.frames):
        assert int(head["TIMESTEP"]) == frame.step and float(head["TIME"]) == frame.time and head["UNITS"] == "si"
        assert np.array_equal(atoms["id"], frame.ids + 1) and np.all(atoms["type"] == 1)
        assert np.array_equal(atoms["radius"], frame.radii)
        for columns, values in [(("x", "y", "z"), frame.positions), (("vx", "vy", "vz"), frame.velocities),
                                (("quatw", "quati", "quatj", "quatk"), frame.orientations)] if len(frame.ids) else []:
            assert np.array_equal(np.stack([atoms[column] for column in columns], -1), values)
        for axis, (low, high) in enumerate(head["box"] if len(frame.ids) else []):
            assert low <= (frame.positions[:, axis] - frame.radii).min()
            assert high >= (frame.positions[:, axis] + frame.radii).max()


def test_a_dump_of_a_leaning_cell_has_the_box_around_it_and_its_tilts(sheared_run):
    assert convert(sheared_run.directory, "--to", "lammps").returncode == 0
    text = (sheared_run.directory / "grains.lammpstrj").read_text()
    assert text.count("ITEM: BOX BOUNDS pp pp pp\n") == 1 and text.count("ITEM: BOX BOUNDS xy xz yz pp pp pp\n") == 2
    frame = sheared_run.frame(-1)
    head, _ = read_dump(sheared_run.directory / "grains.lammpstrj")[-1]
    (x_low, x_high, xy), (y_low, y_high, xz), (z_low, z_high, yz) = head["box"]
    # By LAMMPS' manual: the corners of the cell, and what of them the bounds take in.
    corners = np.array([frame.cell_origin + np.array([i, j, k]) @ frame.cell for i in (0, 1) for j in (0, 1) for k in (0, 1)])
    assert [x_low, y_low, z_low] == pytest.approx(corners.min(axis=0)) and [xy, xz, yz] == [
        frame.cell[1, 0], frame.cell[2, 0], frame.cell[2, 1]]
    assert [x_high, y_high, z_high] == pytest.approx(corners.max(axis=0))


def test_extended_xyz_has_the_lattice(sheared_run):
    lines = (sheared_run.directory / "frames.xyz").read_text().splitlines()
    line = [line for line in lines if "Properties=" in line][-1]
    words = line.split('"')
    assert np.array_equal(np.array(words[1].split(), dtype=float).reshape(3, 3), sheared_run.frame(-1).cell)
    assert words[3].split() == ["-1", "2", "3"] and words[5] == "T T T"


def step_of(root, s):
    """Points and point data of step s, as docs.vtk.org says that PolyData with time is to be read."""
    steps = root["Steps"]
    part, parts = steps["PartOffsets"][s], steps["NumberOfParts"][s]
    assert parts == 1
    count, first = root["NumberOfPoints"][part], steps["PointOffsets"][s]
    for k, topology in enumerate(("Vertices", "Lines", "Polygons", "Strips")):
        group = root[topology]
        cells, ids = group["NumberOfCells"][part], group["NumberOfConnectivityIds"][part]
        start, begin = steps["CellOffsets"][s, k] + part, steps["ConnectivityIdOffsets"][s, k]
        offsets, connectivity = group["Offsets"][start:start + cells + 1], group["Connectivity"][begin:begin + ids]
        assert len(offsets) == cells + 1 and offsets[0] == 0 and offsets[-1] == len(connectivity) == ids
        assert cells == (count if k == 0 else 0)
        if k == 0:
            assert np.array_equal(connectivity, np.arange(count)) and np.all(np.diff(offsets) == 1)
    data = {}
    for name, values in root["PointData"].items():
        at = steps[f"PointDataOffsets/{name}"][s]
        data[name] = values[at:at + count]
    return root["Points"][first:first + count], data


def test_a_vtkhdf_file_has_the_frames_to_the_bit(rain):
    assert convert(rain.directory, "--to", "vtkhdf").returncode == 0
    with h5py.File(rain.directory / "grains.vtkhdf") as file:
        root = file["VTKHDF"]
        assert root.attrs["Type"] == b"PolyData" and list(root.attrs["Version"]) == [2, 0]
        assert root.attrs.get_id("Type").get_type().get_cset() == h5py.h5t.CSET_ASCII
        assert root["Steps"].attrs["NSteps"] == len(rain.frames)
        assert np.array_equal(root["Steps/Values"], rain.frames.times)
        for s, frame in enumerate(rain.frames):
            points, data = step_of(root, s)
            assert np.array_equal(points, frame.positions) and np.array_equal(data["id"], frame.ids)
            assert np.array_equal(data["velocity"], frame.velocities) and np.array_equal(data["radius"], frame.radii)
            if len(frame.ids):  # an empty frame does not say whether grains turn
                assert np.array_equal(data["orientation"], frame.orientations)
        missing = []
        file.visititems(lambda name, item: missing.append(name)
                        if isinstance(item, h5py.Dataset) and "units" not in item.attrs else None)
        assert not missing


# Rods that fall, and two spheres that come in among them.
RODS = {
    "name": "rods", "gravity": [0, 0, -9.81], "time_step": 1e-3, "box": True, "allow_unconverged": True,
    "material": {"density": 2600, "friction": 0.3},
    "sample": {"kind": "lattice", "shape": "rod", "cells": [3, 2, 2], "spacing": 1, "radius": 0.02},
    "insert": [{"name": "spheres", "radius": 0.004, "rate": 1000, "count": 2,
                "region": {"shape": "box", "low": [0.06, 0.03, 0.03], "high": [0.14, 0.11, 0.11]}}],
    "stage": [{"name": "fall", "end": {"steps": 80}}],
    "output": {"every_steps": 40},
}


@pytest.fixture(scope="module")
def rods(tmp_path_factory):
    return talus.run(RODS, tmp_path_factory.mktemp("rods") / "run", threads=1, progress=False)


def expect_rods(frame, ids, points, radii, velocities):
    """Three balls in a row where a rod is, that touch and move as it turns; of a sphere itself."""
    assert len(frame.ids) == 14 and len(ids) == 3 * 12 + 2
    assert np.linalg.norm(frame.angular_velocities, axis=1).max() > 0.1
    for k, grain in enumerate(frame.ids):
        mine = np.flatnonzero(ids == grain)
        at, own = points[mine] - frame.positions[k], radii[mine]
        if grain >= 12:
            assert np.array_equal(points[mine], frame.positions[[k]]) and np.array_equal(own, frame.radii[[k]])
            continue
        assert own == pytest.approx(np.full(3, frame.radii[k] / 3))
        middle = int(np.argmin(np.linalg.norm(at, axis=1)))
        ends = np.delete(at, middle, axis=0)
        assert at[middle] == pytest.approx(np.zeros(3), abs=1e-12) and ends[0] == pytest.approx(-ends[1], abs=1e-12)
        assert np.linalg.norm(ends[0]) == pytest.approx(2 * own[0])
        w, *axis = frame.orientations[k]
        turned = ends[0] + 2 * np.cross(-np.array(axis), np.cross(-np.array(axis), ends[0]) + w * ends[0])  # back
        assert abs(turned) == pytest.approx([0, 0, 2 * own[0]], abs=1e-12) or abs(turned) == pytest.approx(
            [2 * own[0], 0, 0], abs=1e-12), "along an axis of inertia of its own"
        assert velocities[mine] - frame.velocities[k] == pytest.approx(np.cross(frame.angular_velocities[k], at), abs=1e-12)


def test_a_lammps_dump_has_the_balls_of_clumps(rods):
    assert convert(rods.directory, "--to", "lammps").returncode == 0
    head, atoms = read_dump(rods.directory / "grains.lammpstrj")[-1]
    columns = lambda *names: np.stack([atoms[name] for name in names], -1)
    expect_rods(rods.frame(-1), atoms["mol"] - 1, columns("x", "y", "z"), atoms["radius"], columns("vx", "vy", "vz"))
    assert len(set(atoms["id"])) == len(atoms["id"]) == head["count"] and atoms["id"].min() == 1


def test_a_vtkhdf_file_and_the_fields_have_the_balls_of_clumps(rods):
    assert convert(rods.directory, "--to", "vtkhdf").returncode == 0
    with h5py.File(rods.directory / "grains.vtkhdf") as file:
        points, data = step_of(file["VTKHDF"], len(rods.frames) - 1)
    expect_rods(rods.frame(-1), data["id"], points, data["radius"], data["velocity"])
    vtp = sorted((rods.directory / "fields").glob("grains_*.vtp"))[-1]
    assert f'NumberOfPoints="{len(points)}"' in vtp.read_text()
    # Without the scene nobody knows the shapes: the spheres that hold the grains.
    alone = rods.directory.parent / "alone.h5"
    alone.write_bytes((rods.directory / "results.h5").read_bytes())
    assert convert(alone, "--to", "lammps").returncode == 0
    assert read_dump(rods.directory.parent / "grains.lammpstrj")[-1][0]["count"] == 14


def test_what_cannot_be_converted_is_refused_and_nothing_is_replaced(rain, tmp_path):
    (tmp_path / "mine").write_text("mine")
    for words, message in [((rain.directory, "--to", "vtk"), "no format 'vtk': lammps or vtkhdf"),
                           ((tmp_path, "--to", "lammps"), "no results.h5"),
                           ((rain.directory, "--to", "lammps", "-o", tmp_path / "mine"), "--force")]:
        ended = convert(*words)
        assert ended.returncode == 2 and message in ended.stderr, ended.stderr
    assert (tmp_path / "mine").read_text() == "mine"


@pytest.mark.parametrize("kind", ["lammps", "vtkhdf"])
def test_a_file_that_has_no_room_is_an_error_and_leaves_the_earlier_one(rain, tmp_path, kind):
    whole = tmp_path / f"grains.{kind}"
    assert convert(rain.directory, "--to", kind, "-o", whole).returncode == 0
    before = whole.read_bytes()
    for share in (0.1, 0.5, 0.99):
        words = [talus.find_program(), "convert", str(rain.directory), "--to", kind, "-o", str(whole), "--force"]
        room = int(share * len(before))
        ended = subprocess.run(words, capture_output=True, text=True,
                               preexec_fn=lambda: (signal.signal(signal.SIGXFSZ, signal.SIG_IGN),
                                                   resource.setrlimit(resource.RLIMIT_FSIZE, (room, room))))
        assert ended.returncode == 1 and "talus: error: " in ended.stderr, ended.stderr
        assert "HDF5-DIAG" not in ended.stderr
        assert whole.read_bytes() == before and list(tmp_path.iterdir()) == [whole]


def test_damaged_results_are_bad_input(rain, tmp_path):
    shutil.copytree(rain.directory, tmp_path / "run")
    with h5py.File(tmp_path / "run/results.h5", "r+") as file:
        del file["frames/000002/bodies/x"]
    (tmp_path / "out").write_text("mine")
    for kind in ("lammps", "vtkhdf"):
        ended = convert(tmp_path / "run", "--to", kind, "-o", tmp_path / "out", "--force")
        assert ended.returncode == 2 and "results.h5" in ended.stderr, ended.stderr
        assert (tmp_path / "out").read_text() == "mine" and len(list(tmp_path.iterdir())) == 2


def test_without_velocities_the_rest_is_converted(tmp_path):
    scene = {**RAIN, "output": {"every_steps": 20, "velocities": False}}
    run = talus.run(scene, tmp_path / "run", threads=1, progress=False)
    for kind in ("lammps", "vtkhdf"):
        assert convert(run.directory, "--to", kind).returncode == 0
    _, columns = read_dump(run.directory / "grains.lammpstrj")[-1]
    assert "vx" not in columns and np.array_equal(columns["x"], run.frame(-1).positions[:, 0])
    with h5py.File(run.directory / "grains.vtkhdf") as file:
        assert "velocity" not in file["VTKHDF/PointData"] and len(file["VTKHDF/PointData/radius"]) > 0
