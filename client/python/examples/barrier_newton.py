#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A cloth falls on a ball and rests on it without ever touching: Newton's method on an incremental potential whose barrier
keeps pairs apart (IPC: Li et al. 2020, without friction), in numpy (and scipy where it is), contacts by Warmfront.

    PYTHONPATH=build/release/python client/python/examples/barrier_newton.py [--server ADDR] [--steps N]

A step of time is the minimum of inertia, springs and barrier: E(x) = 1/2 |x - y|^2 m + h^2 (springs(x) + barrier(x)), with y
where everything would go by itself. One session answers each iteration of Newton's method from x towards x + p:
- how far may it go before a pair comes nearer than a tenth of its distance? max_step(). The line search begins there.
- what would the exact tier say of the way to a point of the line search? A trial, which commit() takes if the point is
  accepted, and counts what met. Nothing may: else the exit code is 1.
- what is within D_HAT at the end of that trial? proximity(), with distances, weights and directions: the barrier's value
  there and, once committed, its slope and curvature.
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
FIELDS = ["squared_distance", "weights", "direction"]


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


class Potential:
    """Of one step of time: its value, slope and (positive) curvature. Vertices below `free` move."""

    def __init__(self, y, free, springs, length):
        self.y, self.free, self.springs, self.length = y, free, springs, length

    def terms(self, x, near):
        """Springs and barrier alike: vertices (k, 4), weights (k, 4), directions (k, 3), and the value, slope and curvature
        along the direction, and the curvature across it. near: what is within D_HAT where everything is at x."""
        r = np.minimum(np.sqrt(near.squared_distance) / D_HAT, 1)  # of a pair just beyond, which may be listed too: 0
        log = np.log(r)
        # Weights are positive, the direction is towards the vertex or first edge: + on these, - on the face or second edge.
        sign = np.where(near.kind[:, None] == Kind.VERTEX_FACE, [1, -1, -1, -1], [1, 1, -1, -1])
        barrier = (near.v.astype(int), sign * near.weights, near.direction, -BARRIER * (r - 1)**2 * log,
                   -BARRIER * (2 * (r - 1) * log + (r - 1)**2 / r) / D_HAT,
                   BARRIER * (-2 * log - 4 * (r - 1) / r + ((r - 1) / r)**2) / D_HAT**2, np.zeros_like(r))
        a, b = self.springs.T
        along = x[a] - x[b]
        l = np.linalg.norm(along, axis=1)
        stretch = l - self.length
        ends, signs = np.stack([a, b, a, b], 1), np.tile([1, -1, 0, 0], (len(a), 1))
        springs = (ends, signs, along / l[:, None], STRETCH / 2 * stretch**2, STRETCH * stretch, np.full(len(a), STRETCH),
                   STRETCH * np.maximum(stretch / l, 0))
        return barrier, springs

    def value(self, x, near):
        total = MASS / 2 * ((x - self.y)[:self.free]**2).sum()
        return total + H**2 * sum(value.sum() for _, _, _, value, *_ in self.terms(x, near))

    def newton(self, x, near):
        """The direction (n, 3) down to the minimum, as the curvature at x has it."""
        slope = MASS * (x - self.y)
        slope[self.free:] = 0
        diagonal = np.arange(3 * self.free)
        rows, columns, values = [diagonal], [diagonal], [np.full(3 * self.free, MASS)]
        for v, weight, n, _, first, second, across in self.terms(x, near):
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
        near = session.proximity(D_HAT, fields=FIELDS)
        for step in range(1, arguments.steps + 1):
            start, y = x, x + H * velocity
            y[:n] += H * H * GRAVITY
            potential, iterations, cut = Potential(y, n, springs, length), 0, 0
            while True:
                p, decrease = potential.newton(x, near)
                iterations += 1
                if np.abs(p).max() < 1e-3 * H or iterations > ITERATIONS:
                    break
                fraction = session.max_step(x + p, keep_distance=0.1).fraction
                cut += fraction < 1
                value = potential.value(x, near)
                while True:
                    end = x + fraction * p
                    session.trial(end, tier="exact")
                    near = session.proximity(D_HAT, where="trial_end", fields=FIELDS)
                    if potential.value(end, near) <= value - 1e-4 * fraction * decrease or fraction <= 1e-9:
                        break
                    fraction /= 2
                taken = session.commit()
                touched += taken.vf + taken.ee
                x = session.positions
            velocity = 0.99 * (x - start) / H
            gap = np.sqrt(near.squared_distance.min(initial=D_HAT**2))
            print(f"step {step:3}: {iterations:2} iterations, {cut:2} cut short by what they would meet; {len(near):5} "
                  f"pairs near, nearest {gap:.5f}, lowest at {x[:n, 2].min():6.3f}", flush=True)
    print(f"contacts of all motion in the exact tier: {touched}: {'nothing' if touched == 0 else 'something'} touched")
    return 0 if touched == 0 else 1


if __name__ == "__main__":
    sys.exit(main())
