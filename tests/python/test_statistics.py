"""Statistics against closed forms."""

import itertools

import numpy as np
import pytest

import talus


def lattice(n, spacing=1.0):
    return spacing * (np.stack(np.meshgrid(*[np.arange(n)] * 3, indexing="ij"), -1).reshape(-1, 3) + 0.5)


def test_the_fabric_of_a_cubic_lattice_is_isotropic():
    assert np.allclose(talus.fabric_tensor(np.vstack([np.eye(3), -np.eye(3)])), np.eye(3) / 3)
    assert talus.anisotropy(talus.fabric_tensor(np.eye(3))) == pytest.approx(0)


def test_the_fabric_of_a_chain_lies_in_its_direction():
    n = np.array([[0.6, 0.0, 0.8]] * 7)
    assert np.allclose(talus.fabric_tensor(n), np.outer(n[0], n[0]))


def test_the_fabric_of_a_close_packed_layer():
    angles = np.radians([0, 60, 120])
    layer = np.stack([np.cos(angles), np.sin(angles), 0 * angles], -1)
    assert np.allclose(talus.fabric_tensor(layer), np.diag([0.5, 0.5, 0]))


def test_the_anisotropy_of_an_axial_distribution_is_its_coefficient():
    # (1 + a (3 c² - 1)/2)/4π over the sphere by midpoints of c and angles: its fabric is an integral.
    a, c, angle = 0.4, (np.arange(2000) + 0.5) / 1000 - 1, 2 * np.pi * np.arange(8) / 8
    weight = (1 + a * (3 * c**2 - 1) / 2) / len(c)
    s = np.sqrt(1 - c**2)
    normals = np.stack([np.outer(s, np.cos(angle)), np.outer(s, np.sin(angle)), np.outer(c, np.ones(8))], -1)
    fabric = np.einsum("k,kai,kaj->ij", weight / 8, normals, normals)
    assert talus.anisotropy(fabric) == pytest.approx(a, rel=1e-5)


def test_exponential_forces_have_an_exponential_distribution():
    forces = 3.7 * -np.log((np.arange(200_000) + 0.5) / 200_000)  # quantiles
    f, p = talus.force_distribution(forces, np.linspace(0, 4, 41))
    share = 1 - np.exp(-4)  # P is over the bins that were asked for
    assert np.allclose(p * share, np.exp(-f), rtol=3e-3)


def test_the_distribution_of_forces_is_of_unit_integral_and_mean():
    rng = np.random.default_rng(3)
    f, p = talus.force_distribution(np.append(rng.gamma(2, 5, 10_000), [0, -1]), 200)
    width = f[1] - f[0]
    assert p.sum() * width == pytest.approx(1) and (f * p).sum() * width == pytest.approx(1, rel=1e-3)
    with pytest.raises(ValueError, match="no contact"):
        talus.force_distribution([0.0])


@pytest.mark.parametrize("periodic", [False, True, (True, False, True)])
def test_an_ideal_gas_has_g_of_one(periodic):
    x = np.random.default_rng(7).random((6000, 3)) * [2, 1, 1.5]
    r, g = talus.pair_correlation(x, [0, 0, 0], [2, 1, 1.5], 0.2, bins=10, periodic=periodic)
    pairs = 6000 * 2000 * 4 / 3 * np.pi * np.diff(np.linspace(0, 0.2, 11) ** 3) * (1 if periodic is True else 0.3)
    assert np.all(np.abs(g - 1) < 5 / np.sqrt(pairs) + 0.02)
    assert r[0] == pytest.approx(0.01)


def test_a_lattice_has_its_shells_of_neighbours():
    r, g = talus.pair_correlation(lattice(7), [0] * 3, [7] * 3, 1.8, bins=180, periodic=[True] * 3)
    shells = 4 / 3 * np.pi * np.diff(np.linspace(0, 1.8, 181) ** 3)
    counts = g * shells
    found = {round(float(radius), 2): round(float(count)) for radius, count in zip(r, counts) if count > 0.5}
    assert sorted(found.values()) == [6, 8, 12] and sum(counts) == pytest.approx(6 + 12 + 8)


@pytest.mark.parametrize("r_max", [0.45, 0.2])
@pytest.mark.parametrize("periodic", [(False, False, False), (True, True, False)])
def test_pairs_are_those_of_brute_force(r_max, periodic):
    x, size = np.random.default_rng(5).random((300, 3)) * [1, 1.1, 2], np.array([1, 1.1, 2])
    d = x[:, None] - x[None]
    d -= np.where(periodic, size * np.round(d / size), 0)
    distance = np.linalg.norm(d, axis=-1)[np.all(np.asarray(periodic) | ((x >= r_max) & (x <= size - r_max)), axis=1)]
    r, g = talus.pair_correlation(x, [0, 0, 0], size, r_max, bins=5, periodic=periodic)
    counts = np.histogram(distance[distance > 0], np.linspace(0, r_max, 6))[0]
    shells = 4 / 3 * np.pi * np.diff(np.linspace(0, r_max, 6) ** 3)
    assert np.allclose(g * len(distance) * shells * 300 / size.prod(), counts)


def test_pairs_of_a_leaning_cell_are_those_of_all_images():
    size, (xy, xz, yz), r_max = np.array([1, 1.1, 1.3]), (0.4, -0.5, 0.3), 0.4
    edges = np.array([[size[0], xy, xz], [0, size[1], yz], [0, 0, size[2]]])
    x = np.random.default_rng(6).random((200, 3)) * size
    images = np.array(list(itertools.product([-2, -1, 0, 1, 2], repeat=3))) @ edges.T
    distance = np.linalg.norm(x[:, None, None] - x[None, :, None] - images, axis=-1).ravel()
    _, g = talus.pair_correlation(x, [0] * 3, size, r_max, bins=5, periodic=[True] * 3, shears=(xy, xz, yz))
    counts = np.histogram(distance[distance > 0], np.linspace(0, r_max, 6))[0]
    shells = 4 / 3 * np.pi * np.diff(np.linspace(0, r_max, 6) ** 3)
    assert counts.sum() > 1000 and np.allclose(g * 200 * shells * 200 / size.prod(), counts)
    with pytest.raises(ValueError, match="have to be periodic"):
        talus.pair_correlation(x, [0] * 3, size, 0.1, periodic=(True, True, False), shears=(0, 0.1, 0))


def test_more_than_half_of_the_box_is_refused():
    with pytest.raises(ValueError, match="at most half"):
        talus.pair_correlation(lattice(3), [0] * 3, [3] * 3, 1.6)


def test_corners_that_are_no_box_are_refused():
    x = np.full((4, 3), 0.5)
    for low, high in (([1, 1, 1], [0, 0, 0]), ([0, 0, 0], [1, 1, 0]), ([0, 0, 0], [1, 1, np.inf])):
        with pytest.raises(ValueError, match="no corners of a box"):
            talus.pair_correlation(x, low, high, r_max=0.1)
    with pytest.raises(ValueError, match="there are none"):
        talus.pair_correlation(np.zeros((0, 3)), [0, 0, 0], [1, 1, 1], r_max=0.1)


def test_forces_and_normals_that_are_no_numbers_are_refused():
    with pytest.raises(ValueError, match="1 of 3 are not finite"):
        talus.force_distribution([1, np.nan, 2])
    for normals in ([[1, 0, 0], [np.nan, 0, 0]], [[1, 0, 0], [2, 0, 0]]):
        with pytest.raises(ValueError, match="1 of 2 are no unit vectors"):
            talus.fabric_tensor(normals)


def test_centres_that_are_no_numbers_are_refused():
    x = lattice(3)
    x[4, 1] = np.nan
    with pytest.raises(ValueError, match="those of 1 grains are no numbers"):
        talus.pair_correlation(x, [0] * 3, [3] * 3, 0.5)


def lone_grain(velocity, **stage):
    """A run of one grain in a periodic cell, which flies at a velocity; a frame each tenth of a second."""
    return {
        "name": "lone-grain", "time_step": 1e-2, "material": {"density": 2600}, "cell": {"lengths": [1.0, 0.8, 0.9]},
        "sample": {"kind": "body", "name": "g", "radius": 0.05, "position": [0.3, 0.4, 0.5], "velocity": velocity},
        "stage": [{"name": "fly", "end": {"time": 2.0}, **stage}], "output": {"every_steps": 10},
    }


def test_what_flies_through_the_faces_of_a_cell_has_moved_by_velocity_times_time(tmp_path):
    velocity = np.array([2.0, -1.5, 0.7])
    run = talus.run(lone_grain(velocity.tolist()), tmp_path / "out", threads=1, progress=False)
    moved = talus.displacements(run.frames)
    assert moved.shape == (21, 1, 3) and np.allclose(moved[:, 0], np.outer(run.frames.times, velocity), atol=1e-9)


def test_what_follows_the_flow_of_a_cell_has_not_moved(tmp_path):
    run = talus.run(lone_grain([0.0, 0.0, 0.0], shear_rates=[0.7, 1.5, -0.9]), tmp_path / "out", threads=1, progress=False)
    leans = np.array([frame.cell[2, 0] for frame in run.frames])
    assert np.abs(np.diff(leans)).max() > 0.5  # edges were replaced
    assert np.abs(talus.displacements(run.frames)).max() < 1e-9


def test_between_walls_grains_have_moved_by_differences_of_positions(heap_run):
    moved = talus.displacements(heap_run.frames)
    assert np.array_equal(moved[-1], heap_run.frame(-1).positions - heap_run.frame(0).positions)
    with pytest.raises(ValueError, match="no frame"):
        talus.displacements([])
