"""The contact problem of one step of a Talus run, made anew from the frame before it, and the true errors of the step.

Used by true_error_cost.py. The laws are those of docs/theory.md, written a second time, so that a mistake in Talus is
no mistake here: for spheres of one material, planes with a fixed load, no cell, no cohesion and no rolling resistance.
A resolved scene without solver.restitution_law is of a Talus with the laws before it: overlaps in the bias, and
impacts with e > 0 only where spheres overlap. With Moreau's law the problem is that of the mean velocity
(v + E v_before)/(1 + E).

SI units: lengths in m, velocities and biases in m/s, impulses in kg m/s; a spin is omega R [m/s].

Errors [1]: V, momentum sum m|u - u*| over what contacts exchange, sum m|u* - u_free|; wf, of the worst wall's force
over the largest wall force or load; cf, of the worst contact's force over the largest. With * the answer of
step_solvers.py. Needs numpy, scipy, h5py.
"""

import math
import tomllib

import h5py
import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

import step_solvers

SIDES = {f"{axis}{sign}": (k, 1 if sign == "-" else -1) for k, axis in enumerate("xyz") for sign in "-+"}


class Scene:
    """What the reference needs of a resolved scene."""

    def __init__(self, path):
        with open(path, "rb") as file:
            self.all = tomllib.load(file)
        solver = self.all["solver"]
        self.density = self.all["material"]["density"]
        self.alert = self.all["detection"]["alert"]
        self.new = "restitution_law" in solver
        self.moreau = solver.get("restitution_law") == "moreau"
        self.in_bias = 0.0 if self.new else solver["overlap_correction"]
        self.walls = []
        for wall in self.all.get("wall", []):
            if "side" in wall:
                axis, sign = SIDES[wall["side"]]
                normal = sign * np.eye(3)[axis]
            else:
                normal = np.array(wall["normal"], float)
            self.walls.append({**wall, "normal": normal / np.linalg.norm(normal)})

    def stage_of(self, name):
        """The stage, and the walls with the loads that it leaves them."""
        walls = [dict(wall) for wall in self.walls]
        for stage in self.all["stage"]:
            for load in stage.get("load", []):
                wall = next(w for w in walls if w["name"] == load["wall"])
                for key in ("velocity", "pressure", "force", "mass"):
                    wall.pop(key, None)
                wall.update({key: value for key, value in load.items() if key != "wall"})
            if stage["name"] == name:
                return stage, walls
        raise SystemExit(f"no stage '{name}'")


def read_frames(path, wanted):
    """Frames by step, of the steps in `wanted` and those before them (None: all), grains in order of id."""
    frames = {}
    with h5py.File(path) as file:
        for key in sorted(file["frames"]):
            group = file["frames"][key]
            step = int(group.attrs["step"])
            if wanted is not None and step not in wanted and step + 1 not in wanted:
                continue
            stage = group.attrs["stage"]
            frame = {"stage": stage.decode() if isinstance(stage, bytes) else stage}
            order = np.argsort(group["bodies/id"][()])
            for name in ("id", "x", "radius", "u", "omega"):
                if name in group["bodies"]:
                    frame[name] = group["bodies"][name][()][order]
            for name in ("position", "velocity"):
                frame["wall_" + name] = group["walls"][name][()] if "walls" in group else np.zeros(0)
            if "contacts" in group:
                frame["pairs"], frame["force"] = group["contacts/bodies"][()], group["contacts/force"][()]
            frames.setdefault(step, []).append(frame)
    return frames


class Law:
    """Which pairs are contacts in a stage, and their biases."""

    def __init__(self, scene, stage, smallest):
        self.h = float(stage["time_step"])
        self.gravity = np.array(stage.get("gravity", [0, 0, 0]), float)
        self.e = stage.get("restitution", 0.0)
        self.reflection = self.e if scene.moreau else 0.0  # E of Moreau's law
        self.part = 1 + self.reflection
        self.new, self.in_bias = scene.new, scene.in_bias
        self.alert = 0.1 * smallest if scene.alert == "auto" else float(scene.alert)
        self.turning = 0.5 * smallest  # the farthest that an impact is foreseen from [m]
        self.slow = 2 * self.h * np.linalg.norm(self.gravity)

    def of(self, gap, v, v_free):
        """Biases [m/s] and which pairs are contacts, by gap and speed apart, that with the loads of the step too."""
        found = ~((gap >= self.alert) & (gap >= -self.h * v_free))
        bias = np.where(gap > 0, gap, self.in_bias * gap) / self.h
        if self.e > 0:
            quick = np.abs(v) > self.slow
            if self.new:
                closes = (v < 0) & (gap < -self.h * v_free)
                meets = (gap <= 0) | (closes & (gap < self.turning))
                found &= ~(quick & ~meets & (closes | (self.e >= 1)))
            else:
                meets = gap <= 0
                found &= ~(quick & ~meets)
            bias = np.where(quick & meets, self.e * v, bias)
        if self.reflection > 0:
            bias = np.maximum(bias - self.reflection * v, 0) / self.part
        return bias, found


class Problem:
    """The contact problem of one step: bodies, walls, contacts by number of body, and velocities without contacts."""

    def __init__(self, scene, before, stage_name):
        stage, walls = scene.stage_of(stage_name)
        radius, x, u = before["radius"], before["x"], before["u"]
        self.law = law = Law(scene, stage, radius.min())
        self.mass = scene.density * 4 / 3 * math.pi * radius**3
        self.minv = 1 / self.mass
        self.smob = (2.5 if scene.all.get("rotation", True) else 0.0) * self.minv
        self.before_u = u
        self.rounding = np.finfo(float).eps * np.abs(x).max() / law.h  # of positions, over a step [m/s]
        self.free_u = u + law.h * law.gravity / law.part
        self.free_w = before["omega"] * radius[:, None] if "omega" in before else np.zeros_like(u)
        self.set_walls(walls, before)
        middle = x + law.h / 2 * u
        found = [self.pairs(middle, radius, stage)]
        found += [self.at_wall(k, middle, radius, before, stage) for k in range(len(walls))]
        self.first, self.second, self.n, self.b, self.mu = map(np.concatenate, zip(*found))
        self.contacts = self.first, self.second, self.n, self.b, self.mu
        self.mobilities = self.minv, self.smob, self.wall_minv
        self.free_vn = (self.relative(self.free_u, self.free_wall) * self.n).sum(1)
        self.cluster = self.clusters()

    def set_walls(self, walls, before):
        """Normals, mobilities (0 of walls that are not pushed), loads [N], velocities before and without contacts."""
        count = len(walls)
        self.normal = np.array([wall["normal"] for wall in walls]).reshape(-1, 3)
        self.wall_minv, self.load, self.before_wall = np.zeros(count), np.zeros(count), np.zeros((count, 3))
        self.driven = 0.0  # speed of the fastest wall that is driven
        for k, wall in enumerate(walls):
            if wall["drive"] == "velocity":
                self.before_wall[k] = wall["velocity"]
                self.driven = max(self.driven, np.linalg.norm(wall["velocity"]))
            elif wall["drive"] in ("pressure", "force"):
                self.before_wall[k] = before["wall_velocity"][k] * self.normal[k]
                mass = wall["mass"] if isinstance(wall.get("mass"), float) else 0.1 * self.mass.sum()
                self.wall_minv[k] = 1 / mass
                self.load[k] = (wall["force"] if wall["drive"] == "force"
                                else wall["pressure"] * face(self.normal, before["wall_position"], k))
        self.wall_gain = self.law.h * (self.load * self.wall_minv)[:, None] * self.normal
        self.free_wall = self.before_wall + self.wall_gain / self.law.part

    def pairs(self, middle, radius, stage):
        """Contacts of two bodies: numbers, normals, biases, frictions."""
        u = self.before_u
        reach = 2 * radius.max() + self.law.alert + 2 * self.law.h * lengths(u).max()
        near = cKDTree(middle).query_pairs(reach, output_type="ndarray")
        i, j = near.max(1), near.min(1)
        d = middle[i] - middle[j]
        distance = lengths(d)
        n = d / distance[:, None]
        v = ((u[i] - u[j]) * n).sum(1)
        bias, found = self.law.of(distance - radius[i] - radius[j], v, v)
        c = np.flatnonzero(found)
        c = c[np.lexsort((j[c], i[c]))]
        return i[c], j[c], n[c], bias[c], np.full(len(c), float(stage.get("friction", 0)))

    def at_wall(self, k, middle, radius, before, stage):
        """Contacts with a wall: likewise, with -1 - k as the second number."""
        n, h = self.normal[k], self.law.h
        position = before["wall_position"][k] + h / 2 * self.before_wall[k] @ n
        v = (self.before_u - self.before_wall[k]) @ n
        fall = n @ (h * self.law.gravity - self.wall_gain[k])
        bias, found = self.law.of(middle @ n - position - radius, v, v + fall)
        i = np.flatnonzero(found)
        return (i, np.full(len(i), -1 - k), np.tile(n, (len(i), 1)), bias[i],
                np.full(len(i), float(stage.get("wall_friction", 0))))

    def clusters(self):
        """A number of its cluster for each body, then for each wall; pushed walls join what touches them."""
        bodies, wall = len(self.mass), -1 - self.second
        pushed = self.second < 0
        pushed[pushed] = self.wall_minv[wall[pushed]] > 0
        other = np.where(pushed, bodies + wall, np.where(self.second >= 0, self.second, self.first))
        graph = coo_matrix((np.ones(len(other)), (self.first, other)), (bodies + len(self.wall_minv),) * 2)
        return connected_components(graph, directed=False)[1]

    def velocities(self, r):
        """Velocities of bodies, their spin and velocities of walls with the impulses r."""
        u, w = self.free_u.copy(), self.free_w.copy()
        turn = np.cross(self.n, r)
        i, j, on_body = self.first, self.second, self.second >= 0
        for c in range(3):
            size = len(u)
            u[:, c] += self.minv * np.bincount(i, r[:, c], size)
            w[:, c] -= self.smob * np.bincount(i, turn[:, c], size)
            u[:, c] -= self.minv * np.bincount(j[on_body], r[on_body, c], size)
            w[:, c] -= self.smob * np.bincount(j[on_body], turn[on_body, c], size)
        push = (self.wall_impulses(r) * self.normal).sum(1)
        return u, w, self.free_wall - (self.wall_minv * push)[:, None] * self.normal

    def relative(self, u, wall):
        """Velocities of centres at contacts, of the first against the second."""
        other = np.where((self.second >= 0)[:, None], u[self.second], 0)
        other[self.second < 0] = wall[-1 - self.second[self.second < 0]]
        return u[self.first] - other

    def momentum(self, u):
        return (self.mass * lengths(u)).sum()

    def mean(self, after, before):
        """The velocity that the problem is for, from those after and before the step."""
        return (after + self.law.reflection * before) / self.law.part

    def impulses_of(self, after):
        """Impulses of the run's contacts, and how many of these are no contacts of the problem."""
        ids = after["id"]
        run = {(int(a), int(b)): f for (a, b), f in zip(after["pairs"], after["force"] * self.law.h / self.law.part)}
        r = np.zeros((len(self.first), 3))
        found = 0
        for c, (i, j) in enumerate(zip(self.first, self.second)):
            a, b = int(ids[i]), int(ids[j]) if j >= 0 else int(j)
            if (a, b) in run:
                r[c] = run[a, b]
            elif (b, a) in run:
                r[c] = -run[b, a]
            else:
                continue
            found += 1
        return r, len(run) - found

    def wall_impulses(self, r):
        """Sums of impulses at each wall."""
        on_wall = self.second < 0
        out = np.zeros((len(self.normal), 3))
        np.add.at(out, -1 - self.second[on_wall], r[on_wall])
        return out


def lengths(vectors):
    return np.sqrt((vectors**2).sum(1))


def face(normals, positions, k):
    """Area of a wall's face in the box of walls [m2]."""
    axes = np.abs(normals).argmax(1)
    area = 1.0
    for axis in set(axes) - {axes[k]}:
        area *= np.ptp((positions * normals[np.arange(len(axes)), axes])[axes == axis])
    return area


def true_errors(scene, before, after, seconds):
    """Errors of one step of a run, between the frames before and after it; V, wf and cf are nan where it has no answer.

    Also: own, what the problem's velocities differ by from the run's with the run's impulses, and strange, contacts of
    the run that the problem lacks (either says that the law here is not the program's); undone and way, of the answer.
    """
    p = Problem(scene, before, after["stage"])
    run_u = p.mean(after["u"], p.before_u)
    found = {"V": math.nan, "wf": math.nan, "cf": math.nan, "contacts": len(p.first)}
    run, found["strange"] = p.impulses_of(after)
    largest_speed = max(np.abs(run_u).max(), np.abs(p.free_u).max(), step_solvers.TINY)
    found["own"] = np.abs(p.velocities(run)[0] - run_u).max() / largest_speed
    if not len(p.first):
        return {**found, "V": found["own"], "wf": 0.0, "cf": 0.0, "undone": 0.0, "way": "free"}
    r, found["undone"], found["way"] = step_solvers.solve(p, run, seconds)
    if r is None:
        return found
    u, _, wall = p.velocities(r)
    # Rounding of positions is no error: of a body by its mass, of a force by the mass of its cluster.
    wrong = (p.mass * np.maximum(lengths(run_u - u) - p.rounding, 0)).sum()
    exchanged = p.momentum(u - p.free_u)
    bodies = len(p.mass)
    behind = p.rounding * np.bincount(p.cluster[:bodies], p.mass)
    for k in np.flatnonzero(p.wall_minv > 0):
        run_wall = p.mean(after["wall_velocity"][k] * p.normal[k], p.before_wall[k])
        wrong += np.linalg.norm(run_wall - wall[k]) / p.wall_minv[k]
        exchanged += np.linalg.norm(wall[k] - p.free_wall[k]) / p.wall_minv[k]
    due, carried = p.wall_impulses(r), p.wall_impulses(run)
    largest = max(np.abs(due).max(initial=0), p.load.max(initial=0) * p.law.h / p.law.part)
    exchanged = max(exchanged, 1e-2 * largest, p.mass.sum() * p.driven, 1e-12 * p.momentum(p.free_u), step_solvers.TINY)
    of_walls = max(np.abs(due - carried).max(initial=0) - behind.max(), 0)
    of_contacts = np.maximum(lengths(r - run) - behind[p.cluster[p.first]], 0).max()
    return {**found, "V": wrong / exchanged, "wf": of_walls / max(largest, 1e-2 * exchanged),
            "cf": of_contacts / max(lengths(r).max(), 1e-3 * exchanged)}
