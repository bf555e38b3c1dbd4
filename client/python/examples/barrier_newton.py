#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A cloth falls on a ball and rests on it without ever touching: Newton's method on an incremental potential whose barrier
keeps pairs apart (IPC: Li et al. 2020, without friction), in numpy (and scipy where it is), contacts by Warmfront.

    PYTHONPATH=build/release/python client/python/examples/barrier_newton.py [--server ADDR] [--steps N]

A step of time is the minimum of inertia, springs and barrier: E(x) = 1/2 |x - y|^2 m + h^2 (springs(x) + barrier(x)), with y
where everything would go by itself. Each iteration of Newton asks the session:
- which pairs come within D_HAT on the way to x + p? A trial with a separation. The barrier sums over these.
- how far may it go before a pair comes nearer than a tenth of its distance? max_step(). The line search begins there.
- what would the exact tier say of it? A trial; and then commit() takes as much of it as the line search wants, and counts
  what met. Nothing may: else the exit code is 1.
"""
import argparse
import sys

import numpy as np
from cloth_on_ball import ball, grid

import warmfront
from warmfront import Body, Kind

SIDE = 15  # vertices along an edge of the cloth
D_HAT = 0.02  # the barrier begins at this distance; the ball's radius is 0.5
H = 1 / 50
MASS, STRETCH, BARRIER = 1e-3, 20.0, 1e-3  # of a vertex; of springs; of the barrier
GRAVITY = np.array([0, 0, -9.81])
ITERATIONS = 60


def solve(matrix_of, size, right):
    """The blocks (rows, columns, values) as a matrix, solved: sparse where scipy is."""
    rows, columns, values = matrix_of
    try:
        from scipy.sparse import csc_matrix
        from scipy.sparse.linalg import spsolve
        return spsolve(csc_matrix((values, (rows, columns)), (size, size)), right)
    except ImportError:
        dense = np.zeros((size, size))
        np.add.at(dense, (rows, columns), values)
        return np.linalg.solve(dense, right)


def on_segments(a, b, c):
    """Where on b to c (k, 3) is nearest to a: a number in [0, 1] each."""
    along = c - b
    return np.clip(((a - b) * along).sum(1) / np.maximum((along**2).sum(1), 1e-300), 0, 1)


def nearest(kind, p):
    """The closest points of pairs p (k, 4, 3) as signed weights (k, 4): + on the vertex or first edge, - on the other. The
    least of what edges and ends give, and of what lies inside, where that is."""
    vf = kind == Kind.VERTEX_FACE
    candidates = []

    def add(weight, where=True):
        length = np.linalg.norm(np.einsum("ki,kid->kd", weight, p), axis=1)
        candidates.append((np.where(where, length, np.inf), weight))

    # The vertex and the face's edges; or each end of an edge and the other edge.
    for a, b, c, sign in ((0, 1, 2, 1), (0, 2, 3, 1), (0, 3, 1, 1)):
        s, weight = on_segments(p[:, a], p[:, b], p[:, c]), np.zeros((len(p), 4))
        weight[:, a], weight[:, b], weight[:, c] = sign, s - 1, -s
        add(weight, vf)
    for a, b, c, sign in ((0, 2, 3, 1), (1, 2, 3, 1), (2, 0, 1, -1), (3, 0, 1, -1)):
        s, weight = on_segments(p[:, a], p[:, b], p[:, c]), np.zeros((len(p), 4))
        weight[:, a], weight[:, b], weight[:, c] = sign, sign * (s - 1), -sign * s
        add(weight, ~vf)
    # Inside: the vectors that span the pair's plane, and the least squares of them.
    u = np.where(vf[:, None], p[:, 2] - p[:, 1], p[:, 1] - p[:, 0])
    w = np.where(vf[:, None], p[:, 3] - p[:, 1], p[:, 2] - p[:, 3])
    d = np.where(vf[:, None], p[:, 0] - p[:, 1], p[:, 2] - p[:, 0])
    uu, uw, ww, ud, wd = ((a * b).sum(1) for a, b in ((u, u), (u, w), (w, w), (u, d), (w, d)))
    area = uu * ww - uw * uw
    with np.errstate(divide="ignore", invalid="ignore"):
        s, t = (ww * ud - uw * wd) / area, (uu * wd - uw * ud) / area
        face = np.stack([np.ones_like(s), s + t - 1, -s, -t], 1)
        edges = np.stack([1 - s, s, t - 1, -t], 1)
        inside = (area > 1e-12 * uu * ww) & (s >= 0) & (t >= 0) & np.where(vf, s + t <= 1, (s <= 1) & (t <= 1))
        add(np.where(inside[:, None], np.where(vf[:, None], face, edges), 0), inside)
    best = np.argmin([length for length, _ in candidates], axis=0)
    return np.stack([weight for _, weight in candidates])[best, np.arange(len(p))]


class Potential:
    """Of one step of time: its value, slope and (positive) curvature. Vertices below `free` move."""

    def __init__(self, y, free, springs, length):
        self.y, self.free, self.springs, self.length = y, free, springs, length

    def terms(self, x, pairs):
        """Springs and barrier alike: vertices (k, 4), weights (k, 4), directions (k, 3), and the value, slope and curvature along
        the direction, and the curvature across it."""
        kind, v = pairs
        weight = nearest(kind, x[v])
        apart = np.einsum("ki,kid->kd", weight, x[v])
        d = np.linalg.norm(apart, axis=1)
        near = d < D_HAT
        v, weight, apart, d = v[near], weight[near], apart[near], d[near]
        with np.errstate(divide="ignore", invalid="ignore"):
            r = d / D_HAT
            log = np.log(r)
            barrier = (v, weight, apart / d[:, None], -BARRIER * (r - 1)**2 * log,
                       -BARRIER * (2 * (r - 1) * log + (r - 1)**2 / r) / D_HAT,
                       BARRIER * (-2 * log - 4 * (r - 1) / r + ((r - 1) / r)**2) / D_HAT**2, np.zeros_like(d))
        a, b = self.springs.T
        along = x[a] - x[b]
        l = np.linalg.norm(along, axis=1)
        stretch = l - self.length
        ends, signs = np.stack([a, b, a, b], 1), np.tile([1, -1, 0, 0], (len(a), 1))
        springs = (ends, signs, along / l[:, None], STRETCH / 2 * stretch**2, STRETCH * stretch, np.full(len(a), STRETCH),
                   STRETCH * np.maximum(stretch / l, 0))
        return barrier, springs

    def value(self, x, pairs):
        total = MASS / 2 * ((x - self.y)[:self.free]**2).sum()
        return total + H**2 * sum(value.sum() for _, _, _, value, *_ in self.terms(x, pairs))

    def newton(self, x, pairs):
        """The direction (n, 3) down to the minimum, as the curvature at x has it."""
        slope = MASS * (x - self.y)
        slope[self.free:] = 0
        diagonal = np.arange(3 * self.free)
        rows, columns, values = [diagonal], [diagonal], [np.full(3 * self.free, MASS)]
        for v, weight, n, _, first, second, across in self.terms(x, pairs):
            np.add.at(slope, v, H**2 * (first[:, None] * weight)[..., None] * n[:, None])
            nn = n[:, :, None] * n[:, None, :]
            along = second[:, None, None] * nn + across[:, None, None] * (np.eye(3) - nn)
            block = H**2 * np.einsum("ki,kj,kab->kiajb", weight, weight, along)
            index = np.broadcast_to(3 * v[:, :, None] + np.arange(3), (*v.shape, 3))
            row, column = np.broadcast_arrays(index[:, :, :, None, None], index[:, None, None, :, :])
            moves = (row < 3 * self.free) & (column < 3 * self.free) & (block != 0)
            rows.append(row[moves]), columns.append(column[moves]), values.append(block[moves])
        matrix = [np.concatenate(parts) for parts in (rows, columns, values)]
        p = np.zeros_like(x)
        p[:self.free] = -solve(matrix, 3 * self.free, slope[:self.free].ravel()).reshape(-1, 3)
        return p, -(slope * p).sum()


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--server", help="HOST:PORT or unix:PATH; without it, a daemon of its own")
    parser.add_argument("--steps", type=int, default=40)
    arguments = parser.parse_args()

    cloth, cloth_faces, springs = grid(SIDE)
    sphere, sphere_faces = ball(10, 16)
    n = len(cloth)
    x, faces = np.concatenate([cloth, sphere]), np.concatenate([cloth_faces, sphere_faces + n])
    length = np.linalg.norm(x[springs[:, 0]] - x[springs[:, 1]], axis=1)
    velocity, touched = np.zeros_like(x), 0
    bodies = [Body(n, "deformable", "cloth"), Body(len(sphere), "static", "ball")]
    print(f"{n} vertices of cloth over a ball of {len(sphere)}, {len(faces)} triangles, {arguments.steps} steps of 1/50 s")
    with warmfront.connect(arguments.server) as client, client.session(x, faces, bodies=bodies) as session:
        for step in range(1, arguments.steps + 1):
            start, y = x, x + H * velocity
            y[:n] += H * H * GRAVITY
            potential, iterations, cut = Potential(y, n, springs, length), 0, 0
            still = session.trial(min_separation=D_HAT)  # nothing moves: what is near where it is
            pairs = still.kind, still.v.astype(int)
            while True:
                p, decrease = potential.newton(x, pairs)
                iterations += 1
                if np.abs(p).max() < 1e-3 * H or iterations > ITERATIONS:
                    break
                way = session.trial(x + p, min_separation=D_HAT)
                pairs = way.kind, way.v.astype(int)
                # What is nearer than rounding tells apart does not hold up everything else; the barrier pushes it away.
                fraction = session.max_step(x + p, leave_out_overlaps=True, keep_distance=0.1).fraction
                cut += fraction < 1
                value = potential.value(x, pairs)
                while potential.value(x + fraction * p, pairs) > value - 1e-4 * fraction * decrease and fraction > 1e-9:
                    fraction /= 2
                session.trial(x + p, tier="exact")
                taken = session.commit(fraction)
                touched += taken.vf + taken.ee
                x = session.positions
            velocity = 0.99 * (x - start) / H
            kind, v = pairs
            gap = np.linalg.norm(np.einsum("ki,kid->kd", nearest(kind, x[v]), x[v]), axis=1).min(initial=D_HAT)
            print(f"step {step:3}: {iterations:2} iterations, {cut:2} cut short by what they would meet; {len(v):5} pairs looked "
                  f"at, nearest {gap:.5f}, lowest at {x[:n, 2].min():6.3f}", flush=True)
    print(f"contacts of all motion in the exact tier: {touched}: " + ("nothing touched" if touched == 0 else "something touched"))
    return 0 if touched == 0 else 1


if __name__ == "__main__":
    sys.exit(main())
