"""Statistics of packings: fabric, forces, distances, motion. Functions of arrays, which a `Frame` has as attributes."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import ArrayLike

from .errors import MissingData
from .frame import Frame

UNIT = 1e-3  # by how much the length of a unit vector may be off: files may have it in single precision


def fabric_tensor(normals: ArrayLike) -> np.ndarray:
    """Fabric tensor F_ij = <n_i n_j> over contacts (Satake 1982): symmetric, of trace 1, I/3 where no direction is
    preferred.

    normals: unit vectors, shape (m, 3), of either sign; `frame.normals[frame.between_grains]`.
    Raises ValueError where there is no contact, and for normals that are no unit vectors.
    """
    n = np.asarray(normals, dtype=float).reshape(-1, 3)
    if len(n) == 0:
        raise ValueError("the fabric of no contact is not defined")
    wrong = np.count_nonzero(~(np.abs(np.linalg.norm(n, axis=1) - 1) < UNIT))
    if wrong:
        raise ValueError(f"normals: {wrong} of {len(n)} are no unit vectors")
    return n.T @ n / len(n)


def anisotropy(fabric: ArrayLike) -> float:
    """Anisotropy of a fabric tensor, a = 5 sqrt(3/2 D:D) with its deviator D = F - I/3 tr F; 0 without direction.

    Where normals are distributed about an axis as (1 + a (3 cos² - 1)/2)/4π over the sphere, |a| comes out. The
    `a_c` of cell.csv is defined otherwise (docs/theory.md): along the deviator of the stress, and 1.5 times this one
    where both have the same axes.
    """
    f = np.asarray(fabric, dtype=float)
    deviator = f - np.eye(3) * np.trace(f) / 3
    return float(5 * np.sqrt(1.5 * np.sum(deviator * deviator)))


def force_distribution(forces: ArrayLike, bins: int | ArrayLike = 40) -> tuple[np.ndarray, np.ndarray]:
    """Probability density P of f = F/<F>, of unit integral over the bins.

    forces: magnitudes [N], shape (m,); zeros and negative ones are left out: these contacts carry nothing.
    bins: number of bins between 0 and the largest f, or edges of f [1]. Returns centres of the bins and P, both [1].
    Raises ValueError where no force is positive, or some are not finite.
    """
    f = np.asarray(forces, dtype=float).ravel()
    if not np.isfinite(f).all():
        raise ValueError(f"forces: {np.count_nonzero(~np.isfinite(f))} of {len(f)} are not finite")
    f = f[f > 0]
    if len(f) == 0:
        raise ValueError("no contact carries a force")
    f = f / f.mean()
    number = isinstance(bins, (int, np.integer))
    if number and bins < 1:
        raise ValueError(f"bins must be 1 or more, got {bins}")
    edges = np.linspace(0, f.max(), int(bins) + 1) if number else np.asarray(bins, dtype=float)
    counts, edges = np.histogram(f, edges)
    return 0.5 * (edges[1:] + edges[:-1]), counts / (max(counts.sum(), 1) * np.diff(edges))


def pair_correlation(
    positions: ArrayLike,
    low: ArrayLike,
    high: ArrayLike,
    r_max: float,
    bins: int = 100,
    periodic: ArrayLike = (False, False, False),
    shears: ArrayLike = (0, 0, 0),
) -> tuple[np.ndarray, np.ndarray]:
    """Pair correlation g(r) up to r_max: density of centres at a distance r from a centre, over the mean density.

    positions: centres [m], shape (n, 3). low, high: corners of the box that holds them [m]; a box of periodic directions
    is the brick of the cell, whose edges may lean by `shears` (xy, xz, yz) [m]. In the others only grains farther than
    r_max from both faces are counted from, so that every shell is whole; the mean density is that of the box. bins:
    shells of equal thickness.
    Returns the mean radius of each shell [m] and g [1]; time and memory grow as n times the neighbours within r_max.

    Raises ValueError where r_max is no distance of this box: more than half of it between two of its faces; for
    shears between directions that are not both periodic; for corners that are no box; and for centres that are no
    numbers, or none.
    """
    x, low, high = np.asarray(positions, float).reshape(-1, 3), np.asarray(low, float), np.asarray(high, float)
    if not np.isfinite(x).all():
        raise ValueError(f"positions: those of {np.count_nonzero(~np.isfinite(x).all(axis=1))} grains are no numbers")
    if len(x) == 0:
        raise ValueError("positions: there are none")
    if not (np.isfinite(low).all() and np.isfinite(high).all() and (high > low).all()):
        raise ValueError(f"low, high: {low} and {high} are no corners of a box")
    size, wraps = high - low, np.broadcast_to(np.asarray(periodic, bool), 3)
    edges_of_cell, pairs = np.diag(size), ((0, 1), (0, 2), (1, 2))
    for (i, j), shear in zip(pairs, np.broadcast_to(np.asarray(shears, float), 3)):
        edges_of_cell[i, j] = shear
        if shear != 0 and not (wraps[i] and wraps[j]):
            raise ValueError("shears: both directions of one that is not 0 have to be periodic")
    widths = 1 / np.linalg.norm(np.linalg.inv(edges_of_cell), axis=1)  # between opposite faces
    if not 0 < r_max <= 0.5 * widths.min():
        raise ValueError(f"r_max = {r_max} m: must be above 0 and at most half of the box, {0.5 * widths.min()} m")
    inner = np.all(wraps | ((x >= low + r_max) & (x <= high - r_max)), axis=1)
    edges = np.linspace(0, r_max, bins + 1)
    counts = np.zeros(bins)
    parts = np.linalg.solve(edges_of_cell, (x - low).T).T
    parts = np.where(wraps, parts - np.floor(parts), parts)
    for first, second in _near_pairs(parts, widths, wraps, r_max, np.flatnonzero(inner)):
        d = x[second] - x[first]
        for axis in np.flatnonzero(wraps)[::-1]:
            d -= np.round(d[:, axis, None] / size[axis]) * edges_of_cell[:, axis]
        counts += np.histogram(np.sqrt(np.einsum("ij,ij->i", d, d)), edges)[0]
    shells = 4 / 3 * np.pi * np.diff(edges**3)
    density = len(x) / size.prod()
    with np.errstate(invalid="ignore", divide="ignore"):
        return 0.5 * (edges[1:] + edges[:-1]), counts / (inner.sum() * density * shells)


def displacements(frames: Sequence[Frame]) -> np.ndarray:
    """How far the grains of the first frame have moved until each frame [m], shape (frames, n, 3), in order of its ids.

    In a periodic cell against its flow: from one frame to the next a grain that stays where it is in the cell has moved
    by nothing, and what the others have moved adds up, through any face. So `(d**2).sum(axis=2).mean(axis=1)` is the
    mean square displacement. Two frames that follow one another have to be so near in time that no grain moves by half of
    an edge against the flow, nor the cell by a shear of half. Raises MissingData where a frame lacks one of the grains,
    and ValueError without a frame. Results of versions that wrote no cell are taken for those of no cell.
    """
    if len(frames) == 0:
        raise ValueError("the displacement from no frame is not defined")
    ids = frames[0].ids
    moved = np.zeros((len(frames), len(ids), 3))
    periodic = _is_periodic(frames[0])
    before, then = frames[0], frames[0].positions
    for k in range(1, len(frames)):
        now = frames[k]
        there = now.positions[now.rows(ids)]
        moved[k] = moved[k - 1] + (_moved(before, then, now, there) if periodic else there - then)
        before, then = now, there
    return moved


def _is_periodic(frame: Frame) -> bool:
    try:
        return len(frame.cell) > 0
    except MissingData:
        return False


def _moved(before: Frame, then: np.ndarray, now: Frame, there: np.ndarray) -> np.ndarray:
    """From positions `then` to those `there` [m], against the flow of the cell."""
    carried = (then - before.cell_origin) @ np.linalg.inv(_filled(before.cell)) @ _filled(_edges_carried(before, now))
    return now.nearest(there - now.cell_origin - carried)


def _edges_carried(before: Frame, now: Frame) -> np.ndarray:
    """The edges of the cell now [m] as the flow has carried those before: an edge that leaned by half of another was
    replaced since."""
    edges = now.cell.copy()
    flown = before.cell + (now.time - before.time) * before.cell_rates
    for of, by in ((2, 1), (2, 0), (1, 0)):
        if edges[by, by] > 0:
            edges[of] += np.rint((flown[of, by] - edges[of, by]) / edges[by, by]) * edges[by]
    return edges


def _filled(edges: np.ndarray) -> np.ndarray:
    """With 1 m along axes of walls, where nothing flows."""
    return edges + np.diag(np.where(np.diag(edges) == 0, 1.0, 0.0))


def _near_pairs(
    parts: np.ndarray, widths: np.ndarray, wraps: np.ndarray, reach: float, origins: np.ndarray
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Pairs (origin, other) within 3 x 3 x 3 cells at least as wide as `reach`; each pair once for its origin.

    parts: coordinates along the edges, from 0 to 1. widths: between opposite faces [m].
    """
    cells = np.maximum((widths / reach).astype(int), 1)
    place = np.clip((parts * cells).astype(int), 0, cells - 1)
    key = np.ravel_multi_index(place.T, cells)
    order = np.argsort(key, kind="stable")
    starts = np.searchsorted(key[order], np.arange(cells.prod() + 1))
    for shift in itertools.product(*[_shifts(c, w) for c, w in zip(cells, wraps)]):
        there = place[origins] + shift
        inside = np.all(wraps | ((there >= 0) & (there < cells)), axis=1)
        source = origins[inside]
        cell = np.ravel_multi_index((there[inside] % cells).T, cells)
        count = starts[cell + 1] - starts[cell]
        first = np.repeat(source, count)
        offset = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
        second = order[np.repeat(starts[cell], count) + offset]
        other = first != second
        yield first[other], second[other]


def _shifts(cells: int, wraps: bool) -> list[int]:
    """Neighbouring cells along one direction; of two periodic ones both neighbours are the same."""
    return [0] if cells == 1 else [0, 1] if cells == 2 and wraps else [-1, 0, 1]
