# SPDX-License-Identifier: Apache-2.0
"""What is asked of two sessions alike, at random, and what they are told, as values to compare; and scenes for both."""
import random

import numpy as np
from support import COLUMNS, triangle_through_triangle

import warmfront
from warmfront import Body, Committed, Contacts, Intersections, MaxStep, Options, VertexDistances, WarmfrontError

BEFORE, _, FACES = triangle_through_triangle()
# Of statistics, what is the same in every run.
COUNTS = ("vertices_moved", "triangle_pairs", "elementary_tests", "exact_tests", "feature_pairs_filtered", "parts_moved")


def counts(statistics):
    return tuple(getattr(statistics.counts, name) for name in COUNTS)


def told(answer):
    """All of an answer but times: a value to compare."""
    if isinstance(answer, Contacts):
        columns = tuple((name, None if column is None else (column.dtype.str, column.shape, len(column) > 0 and column.flags.writeable, column.tobytes()))
                        for name in (*COLUMNS, "direction", "squared_distance", "closest", "worlds", "world_tois", "bodies", "faces",
                                     "edges") for column in [getattr(answer, name)])
        return ("contacts", answer.frame, answer.vf, answer.ee, answer.ve, answer.vv, answer.vh, answer.possible,
                answer.earliest_toi, bool(answer), len(answer), repr(answer), answer.statistics.front_state, columns)
    if isinstance(answer, Intersections):
        return ("intersections", answer.frame, answer.count, answer.edges.tobytes(), answer.edges.shape, answer.faces.tobytes(),
                answer.faces.shape)
    if isinstance(answer, VertexDistances):
        return ("distances", answer.frame, answer.distances.tobytes(), answer.distances.flags.writeable, answer.vf, answer.ee,
                answer.vh, answer.possible)
    if isinstance(answer, MaxStep):
        return ("max_step", answer.fraction, answer.first, answer.overlaps_at_start, answer.worlds.tobytes(),
                answer.world_fractions.tobytes())
    if isinstance(answer, Committed):
        return ("commit", answer)
    return ("value", answer)


def outcome(call):
    """The answer, or the error: its type, words and what a program reads of it."""
    try:
        return told(call())
    except WarmfrontError as error:
        return (type(error).__name__, error.message, error.reason, error.limit, error.expected_frame, error.retry_after)


def turned(angle, shift):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0, shift], [s, c, 0, 0], [0, 0, 1, 0]])


class Asker:
    """Draws what is asked next, right or wrong, of two sessions alike."""

    def __init__(self, seed, frames, dtype):
        self.draw = random.Random(seed)
        self.frames = frames
        self.dtype = dtype
        self.n = frames.shape[1]

    def motion(self, session):
        d = self.draw
        n = len(session.positions)
        kind = d.choice(["all", "all", "bodies", "vertices", "poses", "bad"])
        if kind == "all" and n == self.n:
            return dict(positions=self.frames[d.randrange(len(self.frames))])
        if kind == "bodies":
            k = d.randrange(2)
            x = session.positions
            return dict(bodies={0: (x[:9] + self.dtype(d.choice([0.0, 0.25, -0.5]))), 2: x[12:15] + self.dtype(0.125)} if k else
                        {0: x[:9] + self.dtype(0.5)})
        if kind == "vertices":
            at = sorted(d.sample(range(9), 3))
            return dict(vertices=at, vertex_positions=session.positions[at] + self.dtype(d.choice([0.25, -0.25])))
        if kind == "poses":
            return dict(poses={1: turned(d.random(), d.random()).astype(self.dtype).astype(float)})
        bad = session.positions.copy()
        bad[d.randrange(n), d.randrange(3)] = np.nan
        return d.choice([dict(positions=bad), dict(positions=bad[:3]), dict(bodies={7: bad}), dict(vertices=[1]),
                         dict(poses={0: np.eye(3, 4)}), dict(poses={1: 2 * np.eye(3, 4)}), dict(vertices=[0, 0], vertex_positions=bad[:2])])

    def options(self, kind):
        d = self.draw
        out = {}
        if kind in ("step", "trial") and d.random() < 0.3:
            out["report"] = d.choice(["all", "earliest", "count", "candidates", "any", "most"])
        if kind in ("step", "trial", "proximity") and d.random() < 0.4:
            out["fields"] = d.choice([["weights"], ["points", "normal"], ["squared_distance", "direction", "closest"], [], ["depth"]])
        if kind != "proximity" and d.random() < 0.3:
            out["min_separation"] = d.choice([0.0, 0.1, 0.5, -1.0])
        if d.random() < 0.3:
            out["tier"] = d.choice(["fast", "certified", "exact"])
        if d.random() < 0.1:
            out["max_contacts"] = d.choice([2, 10**6, 10**12])
        if kind == "max_step":
            out.pop("fields", None)
            if d.random() < 0.3:
                out["keep_distance"] = d.choice([0.1, 0.5, 2.0])
            if d.random() < 0.3:
                out["leave_out_overlaps"] = True
        if kind == "proximity":
            out["where"] = d.choice(["base", "base", "trial_end"])
            if d.random() < 0.3:
                out["reduced"] = True
            if d.random() < 0.2:
                out["report"] = d.choice(["count", "earliest"])
        return out

    def change(self, session):
        d = self.draw
        x = session.positions
        which = d.randrange(9)
        if which == 0:
            filters = d.choice([None, {"within_edges": 1}, {"within_edges": 9}])
            return lambda s: s.change_filters(filters)
        if which == 1:
            return lambda s: s.change_excluded_pairs([(0, 1)])
        if which == 2:
            return lambda s: s.change_excluded_pairs([(0, 99)])
        if which == 3:
            return lambda s: s.change_options(Options(tier="exact", fields=["points"], max_contacts=10**6))
        if which == 4:
            return lambda s: s.change_options(Options(leaf_size=8, max_contacts=10**6))
        if which == 5:
            return lambda s: s.change_body(0, Body(9, thickness=0.01))
        if which == 6:
            return lambda s: s.change_body(1, Body(3, "deformable"))
        if which == 7:
            faces = d.choice([FACES[:1], np.array([[0, 1, 2], [3, 4, 5], [6, 7, 8]]), np.array([[0, 1, 9]])])
            return lambda s: s.replace_elements(0, faces)
        return lambda s: s.add_body(Body(3, name="more"), FACES[:1], x[:3] + x.dtype.type(3))


def scene(dtype):
    """Three triangles that deform, a rigid one, one that deforms, and a ground that is a half-space; frames of motion."""
    rng = np.random.default_rng(5)
    shape = np.concatenate([BEFORE, BEFORE[:3] + [0, 0, 0.5], BEFORE[:3] + [0.1, 0.1, 1.5], BEFORE[:3] + [0, 0, 2]])
    frames = np.stack([shape + [0, 0, -0.2 * k] + 0.05 * rng.standard_normal(shape.shape) for k in range(8)]).astype(dtype)
    frames[:, 9:12] = frames[0, 9:12] + np.arange(8)[:, None, None].astype(dtype) * dtype(0.125)
    faces = np.arange(15).reshape(5, 3)
    bodies = [Body(9, name="cloth"), Body(3, "rigid"), Body(3), Body(kind="static", half_space=((0, 0, -0.5), (0, 0, 1)))]
    return frames, faces, bodies


def large():
    """A scene whose step from cold takes a while: a grid that falls through another, all of it at once."""
    n = 160
    grid = np.stack([*np.meshgrid(np.arange(n), np.arange(n), indexing="ij"), np.zeros((n, n))], axis=-1).reshape(-1, 3).astype(float)
    i = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).reshape(-1)
    faces = np.concatenate([np.stack([i, i + 1, i + n], 1), np.stack([i + 1, i + n + 1, i + n], 1)])
    above = np.concatenate([grid, grid + [0.3, 0.3, 1]])
    below = above.copy()
    below[n * n:, 2] = -1
    return above, below, np.concatenate([faces, faces + n * n])


def steps(cloth, threads):
    with warmfront.Collider(cloth.frames[20], cloth.faces, bodies=cloth.bodies, threads=threads) as session:
        return [session.step(frame) for frame in cloth.frames[21:40]]
