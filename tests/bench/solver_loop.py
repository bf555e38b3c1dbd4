#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Questions a second of a solver's loop: one session with trials and commits, against three sessions that can only step.

    PYTHONPATH=build/release/python tests/bench/solver_loop.py [--side N] [--frames N] [--rounds N] [--server ADDR]

A cloth waves over a ball. A frame is three questions of the way from X to Y (what comes near, with the closest points; how
far may it go; is there an exact contact on the part that is taken) and a move by 0.9 of it. One session: trial, max_step,
trial, commit. Three sessions, each with options of its own: a step to Y each in two of them and back to where the move ends,
and a step there in the third. Both give the same answers, which is checked. The variants take turns, round after round.
"""
import argparse
import pathlib
import statistics
import sys
import time

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).parents[2] / "client/python/examples"))
import cloth_on_ball as example  # noqa: E402
import warmfront  # noqa: E402
from warmfront import Body, Options  # noqa: E402

TAKEN = 0.9
NEAR = 0.01
FIELDS = ["weights", "normal", "points"]


def scene(side):
    cloth, faces, _ = example.grid(side)
    ball, ball_faces = example.ball()
    positions, n = np.concatenate([cloth, ball]), len(cloth)
    return positions, np.concatenate([faces, ball_faces + n]), n, [Body(n, "deformable", "cloth"), Body(len(ball), "static", "ball")]


def goal(start, n, k):
    """Where the solver would go in frame k: waves that run over the cloth, which sinks towards the ball and rises again."""
    y = start.copy()
    x = start[:n, 0]
    y[:n, 2] += 0.03 * np.sin(8 * x + 0.35 * k) - 0.055 * (1 - np.cos(0.2 * k))
    return y


def part_way(x, y):
    """As the daemon computes a commit (proto/warmfront/v1/step.proto)."""
    return np.where(x == y, x, x + TAKEN * (y - x))


class OneSession:
    QUESTIONS = 3

    def __init__(self, client, positions, faces, bodies, n):
        self.session = client.session(positions, faces, bodies=bodies)

    def frame(self, x, y, n):
        near = self.session.trial(bodies={0: y[:n]}, min_separation=NEAR, fields=FIELDS)
        limit = self.session.max_step(bodies={0: y[:n]})
        exact = self.session.trial(bodies={0: y[:n]}, tier="exact", report="earliest")
        taken = self.session.commit(TAKEN)
        return len(near), limit.fraction, exact.earliest_toi, taken.frame

    def close(self):
        self.session.close()


class ThreeSessions:
    QUESTIONS = 3

    def __init__(self, client, positions, faces, bodies, n):
        def session(**options):
            return client.session(positions, faces, bodies=bodies, options=Options(**options))
        self.near, self.guard = session(min_separation=NEAR, fields=FIELDS), session(report="earliest")
        self.judge = session(tier="exact", report="earliest")

    def frame(self, x, y, n):
        at = part_way(x, y)
        near = self.near.step(bodies={0: y[:n]})
        self.near.step(bodies={0: at[:n]})
        limit = self.guard.step(bodies={0: y[:n]})
        self.guard.step(bodies={0: at[:n]})
        exact = self.judge.step(bodies={0: y[:n]})
        self.judge.step(bodies={0: at[:n]})
        return len(near), 1.0 if limit.earliest_toi is None else limit.earliest_toi, exact.earliest_toi, None

    def close(self):
        for session in (self.near, self.guard, self.judge):
            session.close()


def play(kind, client, side, frames):
    """Milliseconds of each frame but the first three, and the answers."""
    positions, faces, n, bodies = scene(side)
    loop = kind(client, positions, faces, bodies, n)
    x, took, answers = positions, [], []
    for k in range(1, frames + 1):
        y = goal(positions, n, k)
        begin = time.perf_counter()
        answers.append(loop.frame(x, y, n)[:3])
        took.append(1e3 * (time.perf_counter() - begin))
        x = part_way(x, y)
    loop.close()
    return took[3:], answers


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--side", type=int, default=60, help="vertices along an edge of the cloth")
    parser.add_argument("--frames", type=int, default=60)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--server", help="HOST:PORT or unix:PATH; without it, a daemon of its own")
    arguments = parser.parse_args()
    times = {OneSession: [], ThreeSessions: []}
    with warmfront.connect(arguments.server) as client:
        for _ in range(arguments.rounds):
            answers = {}
            for kind in times:
                took, answers[kind] = play(kind, client, arguments.side, arguments.frames)
                times[kind].append(statistics.median(took))
            if answers[OneSession] != answers[ThreeSessions]:
                print("solver_loop.py: the answers differ", file=sys.stderr)
                return 1
    met = sum(row[0] for row in answers[OneSession])
    print(f"{arguments.side}^2 vertices, {arguments.frames} frames, {met} near pairs; medians of {arguments.rounds} rounds")
    rate = {kind: 1e3 * kind.QUESTIONS / statistics.median(ms) for kind, ms in times.items()}
    for kind, ms in times.items():
        print(f"{kind.__name__}: {statistics.median(ms):.2f} ms a frame, {rate[kind]:.0f} questions a second")
    print(f"one session against three: {rate[OneSession] / rate[ThreeSessions]:.2f} times the questions a second")
    return 0


if __name__ == "__main__":
    sys.exit(main())
