#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A cloth falls on a ball and hangs down around it: position-based dynamics in numpy, contacts by Warmfront.

    PYTHONPATH=build/release/python client/python/examples/cloth_on_ball.py [--server ADDR] [--steps N] [--blind]

One session answers all questions. A trial with a separation tells what comes within THICKNESS on the way that the solver
wants, with the closest points: these pairs are held apart. `max_step` tells how far the solution may go before anything
touches; only 0.9 of that is taken (as in IPC: Li et al. 2020), and the rest of the step is solved again. An exact trial of
the same way is what is committed, so that the commit counts the contacts of all motion that was made: not one, or something
touched, and the exit code is 1. With --blind the solver asks nothing, and the exact trials find out.
"""
import argparse
import sys

import numpy as np

import warmfront
from warmfront import Body

SIDE = 25  # vertices along an edge of the cloth
THICKNESS = 0.01  # kept by the solver between surfaces; the ball's radius is 0.5
DT = 1 / 60
GRAVITY = np.array([0, 0, -9.81])
ITERATIONS = 20
PIECES = 8  # most pieces of a step


def grid(side=SIDE):
    """A square cloth above the ball: positions (n, 3), faces (m, 3), springs (s, 2)."""
    line = np.linspace(-0.8, 0.8, side)
    x, y = np.meshgrid(line, line, indexing="ij")
    # Slightly off the middle, so that it slides.
    positions = np.stack([x + 0.05, y + 0.02, np.full_like(x, 0.62)], axis=-1).reshape(-1, 3)
    v = np.arange(side * side).reshape(side, side)
    a, b, c, d = (part.ravel() for part in (v[:-1, :-1], v[1:, :-1], v[1:, 1:], v[:-1, 1:]))
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    pairs = [(v[:-1], v[1:]), (v[:, :-1], v[:, 1:]), (v[:-1, :-1], v[1:, 1:]), (v[1:, :-1], v[:-1, 1:]),
             (v[:-2], v[2:]), (v[:, :-2], v[:, 2:])]
    return positions, faces, np.concatenate([np.stack([p.ravel(), q.ravel()], 1) for p, q in pairs])


def ball(rings=16, segments=24, radius=0.5):
    """A sphere of quads cut in two, its ends too: positions (n, 3), faces (m, 3)."""
    polar, turn = np.meshgrid(np.linspace(0, np.pi, rings + 1), np.arange(segments) * 2 * np.pi / segments, indexing="ij")
    z = np.stack([np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)], axis=-1).reshape(-1, 3)
    v = np.arange(len(z)).reshape(rings + 1, segments)
    v[0], v[-1] = v[0, 0], v[-1, 0]  # one vertex each
    a, b, c, d = v[:-1], v[1:], np.roll(v, -1, axis=1)[1:], np.roll(v, -1, axis=1)[:-1]
    faces = np.concatenate([np.stack([a, b, c], -1)[:-1].reshape(-1, 3), np.stack([a, c, d], -1)[1:].reshape(-1, 3)])
    used, numbers = np.unique(faces, return_inverse=True)
    return radius * z[used], numbers.reshape(-1, 3)


class Pairs:
    """Pairs that are to stay apart: four vertices each, their signed weights, and the direction of apart."""

    def __init__(self):
        self.v, self.weight, self.direction = np.empty((0, 4), int), np.empty((0, 4)), np.empty((0, 3))

    def add(self, contacts):
        # Push along the closest points. The features' normal differs from this direction where these lie on a face's rim or at
        # an edge's end; use it only where they coincide.
        apart = contacts.points[:, 0] - contacts.points[:, 1]
        distance = np.linalg.norm(apart, axis=1, keepdims=True)
        direction = np.where(distance > 1e-3 * THICKNESS, apart / np.maximum(distance, 1e-300), contacts.normal)
        # + on the vertex or first edge, - on the face or second.
        sign = np.where(contacts.kind[:, None] == warmfront.Kind.VERTEX_FACE, [1, -1, -1, -1], [1, 1, -1, -1])
        self.v = np.concatenate([self.v, contacts.v])
        self.weight = np.concatenate([self.weight, sign * contacts.weights])
        self.direction = np.concatenate([self.direction, direction])


class Solver:
    """Projects springs and pairs in turn (Jacobi, averaged); what is not cloth does not move."""

    def __init__(self, positions, cloth, springs):
        self.free = (np.arange(len(positions)) < cloth).astype(float)[:, None]
        self.springs = springs
        self.length = np.linalg.norm(positions[springs[:, 0]] - positions[springs[:, 1]], axis=1)

    def solve(self, wish, pairs):
        """Where everything goes, springs kept and pairs held THICKNESS apart, which has the last word."""
        x = wish.copy()
        for k in range(2 * ITERATIONS):
            if k < ITERATIONS:
                first, second = self.springs.T
                now = np.linalg.norm(x[first] - x[second], axis=1)
                half = (0.5 * (now - self.length) / now)[:, None] * (x[first] - x[second])
                self._push(x, self.springs, np.stack([-half, half], axis=1))
            weight = pairs.weight * self.free[pairs.v, 0]
            short = THICKNESS - np.einsum("ki,kid,kd->k", pairs.weight, x[pairs.v], pairs.direction)
            push = np.maximum(short, 0) / np.maximum((weight**2).sum(axis=1), 1e-9)
            self._push(x, pairs.v, (push[:, None] * weight)[..., None] * pairs.direction[:, None, :])
        return x

    def _push(self, x, v, push):
        """Of all that is asked of a vertex, the mean and half as much again: averages are slow."""
        total, count = np.zeros_like(x), np.zeros(len(x))
        np.add.at(total, v, push)
        np.add.at(count, v, (push != 0).any(axis=-1))
        x += 1.5 * self.free * total / np.maximum(count, 1.5)[:, None]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--server", help="HOST:PORT or unix:PATH; without it, a daemon of its own")
    parser.add_argument("--steps", type=int, default=90)
    parser.add_argument("--blind", action="store_true", help="ask nothing, and be found out")
    arguments = parser.parse_args()

    cloth, cloth_faces, springs = grid()
    sphere, sphere_faces = ball()
    n = len(cloth)
    positions, faces = np.concatenate([cloth, sphere]), np.concatenate([cloth_faces, sphere_faces + n])
    bodies = [Body(n, "deformable", "cloth"), Body(len(sphere), "static", "ball")]
    solver = Solver(positions, n, springs)
    x, velocity = positions, np.zeros_like(positions)
    print(f"{n} vertices of cloth over a ball of {len(sphere)}, {len(faces)} triangles, {arguments.steps} steps of 1/60 s")
    touched = shortened = 0
    with warmfront.connect(arguments.server) as client, client.session(positions, faces, bodies=bodies) as session:
        for step in range(1, arguments.steps + 1):
            pairs, lengths, met, start, goal = Pairs(), [], 0, x, x + solver.free * DT * (velocity + DT * GRAVITY)
            wish = goal
            while len(lengths) < PIECES and (not lengths or lengths[-1] < 1):
                if not arguments.blind:
                    pairs.add(session.trial(goal, min_separation=THICKNESS, fields=["weights", "normal", "points"]))
                goal = solver.solve(wish, pairs)
                limit = None if arguments.blind else session.max_step(goal)
                lengths.append(1.0 if limit is None or limit.first is None else 0.9 * limit.fraction)
                session.trial(goal, tier="exact")
                taken = session.commit(lengths[-1])
                met += taken.vf + taken.ee
                x = session.positions
            # Drag, and a limit: in a step nothing goes further than four times THICKNESS.
            velocity = 0.98 * (x - start) / DT
            velocity *= np.minimum(1, 4 * THICKNESS / DT / np.maximum(np.linalg.norm(velocity, axis=1, keepdims=True), 1e-9))
            touched += met
            shortened += len(lengths) > 1
            print(f"step {step:3}: {len(pairs.v):5} pairs held apart, step lengths "
                  f"{' '.join(f'{length:.2f}' for length in lengths)}, lowest at {x[:n, 2].min():6.3f}, exact contacts {met}",
                  flush=True)
    print(f"{shortened} of {arguments.steps} steps were made in pieces; contacts of all motion in the exact tier: {touched}: "
          + ("nothing passed through" if touched == 0 else "something passed through"))
    return 0 if touched == 0 else 1


if __name__ == "__main__":
    sys.exit(main())
