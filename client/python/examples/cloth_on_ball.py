#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A cloth falls on a ball and hangs down around it: position-based dynamics in numpy, contacts by Warmfront.

    warmfrontd &
    PYTHONPATH=build/release/python client/python/examples/cloth_on_ball.py [--server ADDR] [--steps N] [--blind]

Three sessions with different options. `near` reports pairs that come within THICKNESS in a step, with the closest points:
the solver holds these pairs apart. `guard` reports the `earliest` time of impact of the motion that the solver wants: this
is its step length. Only 0.9 of it is taken (as in IPC: Li et al. 2020), pairs that would meet then are held apart, too, and
the remaining step is solved again. `judge`, in the exact tier, counts the contacts of all motion that was made: any contact
means that something touched, and the exit code is 1. With --blind the solver uses neither `near` nor `guard`, and `judge`
counts the contacts.
"""
import argparse
import sys

import numpy as np

import warmfront
from warmfront import Body, Options

SIDE = 25  # vertices along an edge of the cloth
THICKNESS = 0.01  # kept by the solver between surfaces; the ball's radius is 0.5
DT = 1 / 60
GRAVITY = np.array([0, 0, -9.81])
ITERATIONS = 20
PIECES = 8  # most pieces of a step


def grid():
    """A square cloth above the ball: positions (n, 3), faces (m, 3), springs (s, 2)."""
    line = np.linspace(-0.8, 0.8, SIDE)
    x, y = np.meshgrid(line, line, indexing="ij")
    # Slightly off the middle, so that it slides.
    positions = np.stack([x + 0.05, y + 0.02, np.full_like(x, 0.62)], axis=-1).reshape(-1, 3)
    v = np.arange(SIDE * SIDE).reshape(SIDE, SIDE)
    a, b, c, d = (part.ravel() for part in (v[:-1, :-1], v[1:, :-1], v[1:, 1:], v[:-1, 1:]))
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    pairs = [(v[:-1], v[1:]), (v[:, :-1], v[:, 1:]), (v[:-1, :-1], v[1:, 1:]), (v[1:, :-1], v[:-1, 1:]),
             (v[:-2], v[2:]), (v[:, :-2], v[:, 2:])]
    return positions, faces, np.concatenate([np.stack([p.ravel(), q.ravel()], 1) for p, q in pairs])


def ball(rings=16, segments=24, radius=0.5):
    """A sphere of quads cut in two: positions (n, 3), faces (m, 3)."""
    polar, turn = np.meshgrid(np.linspace(0, np.pi, rings + 1)[1:-1], np.arange(segments) * 2 * np.pi / segments, indexing="ij")
    belt = np.stack([np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)], axis=-1).reshape(-1, 3)
    v = np.arange(len(belt)).reshape(rings - 1, segments)
    right = np.roll(v, -1, axis=1)
    top, bottom = len(belt), len(belt) + 1
    faces = [np.stack([np.full(segments, top), v[0], right[0]], 1), np.stack([np.full(segments, bottom), right[-1], v[-1]], 1)]
    for upper, lower, upper_right, lower_right in zip(v[:-1], v[1:], right[:-1], right[1:]):
        faces += [np.stack([upper, lower, lower_right], 1), np.stack([upper, lower_right, upper_right], 1)]
    return radius * np.concatenate([belt, [[0, 0, 1], [0, 0, -1]]]), np.concatenate(faces)


class Pairs:
    """Pairs that are to stay apart: four vertices each, their signed weights, and the direction of apart."""

    def __init__(self):
        self.v = np.empty((0, 4), int)
        self.weight = np.empty((0, 4))
        self.direction = np.empty((0, 3))

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
        self.x = positions.copy()
        self.velocity = np.zeros_like(positions)
        self.free = (np.arange(len(positions)) < cloth).astype(float)[:, None]
        self.springs = springs
        self.length = np.linalg.norm(positions[springs[:, 0]] - positions[springs[:, 1]], axis=1)

    def wish(self):
        """Where everything would go without springs and contacts."""
        return self.x + self.free * DT * (self.velocity + DT * GRAVITY)

    def solve(self, wish, pairs):
        """Where everything goes, springs kept and pairs held THICKNESS apart, which has the last word."""
        x = wish.copy()
        for _ in range(ITERATIONS):
            x += self._springs(x)
            x += self._apart(x, pairs)
        for _ in range(ITERATIONS):
            x += self._apart(x, pairs)
        return x

    def take(self, x):
        """The step is made. Drag, and a limit: in a step nothing goes further than four times THICKNESS."""
        self.velocity = 0.98 * (x - self.x) / DT
        speed = np.linalg.norm(self.velocity, axis=1, keepdims=True)
        self.velocity *= np.minimum(1, 4 * THICKNESS / DT / np.maximum(speed, 1e-9))
        self.x = x

    def _springs(self, x):
        first, second = self.springs.T
        along = x[first] - x[second]
        now = np.linalg.norm(along, axis=1)
        half = (0.5 * (now - self.length) / now)[:, None] * along
        return self._averaged(self.springs, np.stack([-half, half], axis=1))

    def _apart(self, x, pairs):
        weight = pairs.weight * self.free[pairs.v, 0]
        distance = np.einsum("ki,kid,kd->k", pairs.weight, x[pairs.v], pairs.direction)
        near = distance < THICKNESS
        weight, v = weight[near], pairs.v[near]
        push = (THICKNESS - distance[near]) / np.maximum((weight**2).sum(axis=1), 1e-9)
        return self._averaged(v, (push[:, None] * weight)[..., None] * pairs.direction[near][:, None, :])

    def _averaged(self, v, push):
        """Of all that is asked of a vertex, the mean and half as much again: averages are slow."""
        total, count = np.zeros_like(self.x), np.zeros(len(self.x))
        np.add.at(total, v, push)
        np.add.at(count, v, (push != 0).any(axis=-1))
        return 1.5 * self.free * total / np.maximum(count, 1.5)[:, None]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--server", default="127.0.0.1:50051", help="HOST:PORT or unix:PATH")
    parser.add_argument("--steps", type=int, default=90)
    parser.add_argument("--blind", action="store_true", help="ask for no contacts, and be found out")
    arguments = parser.parse_args()

    cloth, cloth_faces, springs = grid()
    sphere, sphere_faces = ball()
    n = len(cloth)
    positions = np.concatenate([cloth, sphere])
    faces = np.concatenate([cloth_faces, sphere_faces + n])
    bodies = [Body(n, "deformable", "cloth"), Body(len(sphere), "static", "ball")]
    solver = Solver(positions, n, springs)

    def session(**options):
        return client.session(positions, faces, bodies=bodies, options=Options(**options))

    with warmfront.connect(arguments.server) as client, \
            session(min_separation=THICKNESS, fields=["weights", "normal", "points"]) as near, \
            session(report="earliest", fields=["weights", "normal", "points"]) as guard, session(tier="exact", report="count") as judge:
        print(f"{n} vertices of cloth over a ball of {len(sphere)}, {len(faces)} triangles, {arguments.steps} steps of 1/60 s")
        touched = shortened = 0
        for step in range(1, arguments.steps + 1):
            pairs, lengths, met = Pairs(), [], 0
            wish, x = solver.wish(), solver.x
            if not arguments.blind:
                pairs.add(near.step(bodies={0: wish[:n]}))
            while len(lengths) < PIECES:
                goal = solver.solve(wish, pairs)
                first = None if arguments.blind else guard.step(bodies={0: goal[:n]})
                lengths.append(0.9 * first.earliest_toi if first else 1.0)
                x = goal if not first else x + lengths[-1] * (goal - x)
                verdict = judge.step(bodies={0: x[:n]})
                met += verdict.vf + verdict.ee
                if not first:
                    break
                guard.step(bodies={0: x[:n]})  # back along a motion with a known answer
                pairs.add(first)
            if not arguments.blind:
                near.step(bodies={0: x[:n]})
            solver.take(x)
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
