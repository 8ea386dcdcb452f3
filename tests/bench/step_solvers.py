"""Solves the contact problem of a step apart from Talus: exactly without friction, else by Gauss-Seidel to 1e-10.

Used by true_error_cost.py on the problems of step_reference.py: relative velocities v of contacts [m/s] from impulses
r [kg m/s], Signorini's condition 0 <= v_n + b, r_n >= 0, r_n (v_n + b) = 0 and Coulomb's law |r_t| <= mu r_n
(docs/theory.md). Every cluster of contacts that bodies and pushed walls join is a problem of its own.

* Without friction, and where the answer without friction has nothing slide, clusters of up to EXACT contacts are
  solved by least distance programming with non-negative least squares (Lawson and Hanson, Solving Least Squares
  Problems (1974), chapter 23): velocities are unique; of the forces that give them, those nearest to the run's.
* Else, and in larger clusters, nonlinear Gauss-Seidel (Jean, Comput. Methods Appl. Mech. Engrg. 177 (1999) 235) goes
  on from the run's impulses: plain where the contacts are few, else with momentum (Nesterov, Soviet Math. Dokl. 27
  (1983) 372) that begins again where it leads back (O'Donoghue and Candes, Found. Comput. Math. 15 (2015) 715).

Tuples that the loops take: contacts (first body, second body or -1 - wall, normals, biases [m/s], frictions [1]);
mobilities (1/m of bodies, R^2/I of bodies, 1/m of walls [1/kg]); state (impulses, velocities of bodies, their spin
omega R, velocities of walls). Needs numpy, scipy, numba.
"""

import math
import time

import numpy as np
from numba import njit
from scipy.optimize import nnls

EXACT = 600  # contacts, at most, for the dense method and for plain Gauss-Seidel
PLAIN_SWEEPS, PLAIN_GOAL = 200000, 1e-14
MOMENTUM_SWEEPS, MOMENTUM_GOAL = 50, 1e-10  # at a time; a residual
TINY = 1e-300


# ---- Gauss-Seidel --------------------------------------------------------------------------------------------------
@njit(cache=True)
def sweep(contacts, mobilities, state, back=False):
    """Makes every contact fulfil its law in turn, from the last to the first where `back`. In scalars: three times as
    fast as with vectors."""
    i, j, n, b, mu = contacts
    minv, smob, wall_minv = mobilities
    r, u, w, wall = state
    for place in range(len(i)):
        c = len(i) - 1 - place if back else place
        p, q, k = i[c], j[c], -1 - j[c]
        n0, n1, n2 = n[c, 0], n[c, 1], n[c, 2]
        a0, a1, a2 = w[p, 0], w[p, 1], w[p, 2]
        v0, v1, v2 = u[p, 0], u[p, 1], u[p, 2]
        wn = minv[p]
        wt = minv[p] + smob[p]
        if q >= 0:
            wn += minv[q]
            wt += minv[q] + smob[q]
            a0 += w[q, 0]
            a1 += w[q, 1]
            a2 += w[q, 2]
            v0 -= u[q, 0]
            v1 -= u[q, 1]
            v2 -= u[q, 2]
        else:
            wn += wall_minv[k]
            v0 -= wall[k, 0]
            v1 -= wall[k, 1]
            v2 -= wall[k, 2]
        v0 -= a1 * n2 - a2 * n1
        v1 -= a2 * n0 - a0 * n2
        v2 -= a0 * n1 - a1 * n0
        vn = v0 * n0 + v1 * n1 + v2 * n2
        rn = r[c, 0] * n0 + r[c, 1] * n1 + r[c, 2] * n2
        new = max(0.0, rn - (vn + b[c]) / wn)
        t0 = t1 = t2 = 0.0
        if mu[c] > 0:
            t0 = r[c, 0] - rn * n0 - (v0 - vn * n0) / wt
            t1 = r[c, 1] - rn * n1 - (v1 - vn * n1) / wt
            t2 = r[c, 2] - rn * n2 - (v2 - vn * n2) / wt
            size = math.sqrt(t0 * t0 + t1 * t1 + t2 * t2)
            if size > mu[c] * new:
                part = mu[c] * new / size
                t0 *= part
                t1 *= part
                t2 *= part
        d0, d1, d2 = new * n0 + t0 - r[c, 0], new * n1 + t1 - r[c, 1], new * n2 + t2 - r[c, 2]
        r[c, 0] += d0
        r[c, 1] += d1
        r[c, 2] += d2
        m0, m1, m2 = n1 * d2 - n2 * d1, n2 * d0 - n0 * d2, n0 * d1 - n1 * d0
        u[p, 0] += minv[p] * d0
        u[p, 1] += minv[p] * d1
        u[p, 2] += minv[p] * d2
        w[p, 0] -= smob[p] * m0
        w[p, 1] -= smob[p] * m1
        w[p, 2] -= smob[p] * m2
        if q >= 0:
            u[q, 0] -= minv[q] * d0
            u[q, 1] -= minv[q] * d1
            u[q, 2] -= minv[q] * d2
            w[q, 0] -= smob[q] * m0
            w[q, 1] -= smob[q] * m1
            w[q, 2] -= smob[q] * m2
        elif wall_minv[k] > 0:
            push = wall_minv[k] * (d0 * n0 + d1 * n1 + d2 * n2)
            wall[k, 0] -= push * n0
            wall[k, 1] -= push * n1
            wall[k, 2] -= push * n2


@njit(cache=True)
def sweep_on(contacts, mobilities, state, most, goal):
    """Sweeps until one changes impulses by `goal` of the largest; returns that change."""
    r = state[0]
    change = math.inf
    for _ in range(most):
        start = r.copy()
        sweep(contacts, mobilities, state)
        change = np.abs(r - start).max() / max(np.abs(r).max(), TINY)
        if change <= goal:
            break
    return change


def plainly_swept(problem, r):
    """Impulses by plain Gauss-Seidel from r on, and their last change."""
    for _ in range(4):  # velocities afresh, against drift
        state = (r.copy(), *problem.velocities(r))
        change = sweep_on(problem.contacts, problem.mobilities, state, PLAIN_SWEEPS // 4, PLAIN_GOAL)
        r = state[0]
    return r, change


@njit(cache=True)
def momentum_on(contacts, mobilities, state, last, pace):
    """Sweeps to and fro with momentum; `last` is the state behind the sweeps before. The pace: sweeps since momentum
    began again, how many it may grow for, and the least change. Returns the last change (rms) and the pace."""
    r, r0 = state[0], last[0]
    k, cap, least = pace
    change = math.inf
    start = np.empty_like(r)
    for _ in range(MOMENTUM_SWEEPS):
        start[:] = r
        sweep(contacts, mobilities, state)
        sweep(contacts, mobilities, state, True)
        size = along = step = 0.0
        for c in range(len(r)):
            for a in range(3):
                d = r[c, a] - start[c, a]
                step += d * d
                size += r[c, a] * r[c, a]
                along += d * (r[c, a] - r0[c, a])
        change = math.sqrt(step / max(size, TINY))
        if change < MOMENTUM_GOAL:
            break
        if change > 3 * least:  # momentum leads astray
            k, cap, least = 0, max(8, min(cap, k) // 2), change
        least = min(change, least)
        k = min(k + 1 if along >= 0 else 1, cap)
        beta = (k - 1) / (k + 2)
        for now, before in zip(state, last):
            for c in range(now.shape[0]):
                for a in range(3):
                    value = now[c, a]
                    now[c, a] += beta * (value - before[c, a])
                    before[c, a] = value
    return change, (k, cap, least)


def swept(problem, r, seconds):
    """Impulses by Gauss-Seidel from r on, with momentum for three quarters of the time, then without, until the goal
    is met or the time is over; and what is left undone: the last change, or what velocities moved by in the second
    half of the time, over what all impulses change them by."""
    halfway, with_momentum, pace = None, True, (1, 1000, math.inf)
    last = (r.copy(), *problem.velocities(r))
    r = r.copy()
    begin = time.process_time()
    while True:
        spent = (time.process_time() - begin) / seconds
        if with_momentum and spent >= 0.75:
            r, with_momentum = last[0].copy(), False
        state = (r, *problem.velocities(r))  # afresh, against drift
        if halfway is None and spent > 0.5:
            halfway = state[1].copy()
        if with_momentum:
            change, pace = momentum_on(problem.contacts, problem.mobilities, state, last, pace)
        else:
            change = sweep_on(problem.contacts, problem.mobilities, state, MOMENTUM_SWEEPS, MOMENTUM_GOAL)
        if change < MOMENTUM_GOAL:
            return r, change
        if spent > 1:
            u = problem.velocities(r)[0]
            return r, problem.momentum(u - halfway) / problem.momentum(u - problem.free_u)


# ---- without friction ----------------------------------------------------------------------------------------------
def matrix_of(problem, contacts):
    """Normal impulses of a cluster times this are changes of velocities times the root of the mass."""
    p = problem
    second = p.second[contacts]
    bodies = np.unique(np.concatenate([p.first[contacts], second[second >= 0]]))
    place = {int(body): 3 * k for k, body in enumerate(bodies)}
    row = {int(k): 3 * len(bodies) + c for c, k in enumerate(np.flatnonzero(p.wall_minv > 0))}
    H = np.zeros((3 * len(bodies) + len(row), len(contacts)))
    for c, contact in enumerate(contacts):
        i, j, n = int(p.first[contact]), int(p.second[contact]), p.n[contact]
        H[place[i] : place[i] + 3, c] = n * math.sqrt(p.minv[i])
        if j >= 0:
            H[place[j] : place[j] + 3, c] = -n * math.sqrt(p.minv[j])
        elif -1 - j in row:
            H[row[-1 - j], c] = -math.sqrt(p.wall_minv[-1 - j])
    return H


def least_distance(problem, contacts, run):
    """Normal impulses of a cluster without friction, nearest to the run's, and the largest condition that is broken
    over the largest condition; None, where no velocities fulfil all of them."""
    H = matrix_of(problem, contacts)
    norm = np.sqrt((H**2).sum(0))
    H, target = H / norm, -(problem.b + problem.free_vn)[contacts] / norm
    largest = np.abs(target).max()
    if (target <= 0).all():
        return np.zeros(len(contacts)), 0.0
    most = 100 * len(contacts) + 1000
    f = np.zeros(len(H) + 1)
    f[-1] = 1
    E = np.vstack([H, target / largest])
    y, _ = nnls(E, f, maxiter=most)
    rest = E @ y - f
    if -rest[-1] < 1e-13:
        return None, math.inf
    change = -rest[:-1] / rest[-1] * largest  # of velocities times the root of the mass
    lack = target - H.T @ change
    r = -y / rest[-1] * largest
    # Of the impulses with these velocities, those nearest to the run's.
    weight, scale = 1e6, max(r.max(), TINY)
    keep = (lack >= -1e-9 * largest) | (y > 0)
    A = np.vstack([weight * H[:, keep], np.eye(keep.sum())])
    near = np.concatenate([weight * change, np.maximum(run * norm, 0)[keep]])
    better = np.zeros(len(contacts))
    better[keep] = nnls(A, near / scale, maxiter=most)[0] * scale
    if np.abs(H @ better - change).max() < 1e-7 * np.abs(change).max():
        r = better
    return r / norm, max(lack.max(), 0) / largest


def exactly(problem, groups, run):
    """Impulses of all clusters without friction, None where one has none, and what is left undone."""
    p = problem
    normal, undone = np.zeros(len(run)), 0.0
    of_run = (run * p.n).sum(1)
    for contacts in groups:
        if len(contacts) == 1:
            c, a, o = contacts[0], p.first[contacts[0]], p.second[contacts[0]]
            mobility = p.minv[a] + (p.minv[o] if o >= 0 else p.wall_minv[-1 - o])
            normal[c] = max(0.0, -(p.free_vn[c] + p.b[c]) / mobility)
            continue
        found, left = least_distance(p, contacts, of_run[contacts])
        if found is None:
            return None, left
        normal[contacts] = found
        undone = max(undone, left)
    return normal[:, None] * p.n, undone


# ---- either --------------------------------------------------------------------------------------------------------
def groups_of(problem):
    """The contacts of each cluster."""
    label = problem.cluster[problem.first]
    order = np.argsort(label, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(label[order])) + 1)


def slides(problem, r):
    """Whether anything slides with the impulses r, so that friction would act."""
    u, w, wall = problem.velocities(r)
    spin = w[problem.first] + np.where((problem.second >= 0)[:, None], w[problem.second], 0)
    v = problem.relative(u, wall) - np.cross(spin, problem.n)
    v -= (v * problem.n).sum(1)[:, None] * problem.n
    return np.abs(v).max() >= 1e-9 * max(np.abs(problem.free_u).max(), TINY)


def solve(problem, run, seconds):
    """Impulses of the answer near the run's (None: there is none), what is left undone [1], and the way to it."""
    groups = groups_of(problem)
    if max(map(len, groups)) <= EXACT:
        r, undone = exactly(problem, groups, run)
        if r is None:
            return r, undone, "no answer"
        if (problem.mu == 0).all() or not slides(problem, r):
            return r, undone, "exact"
    if len(run) <= EXACT:
        return *plainly_swept(problem, run), "swept"
    return *swept(problem, run, seconds), "with momentum"
