# SPDX-License-Identifier: Apache-2.0
"""Where a commit leaves what a session keeps to be created again: by the formula, number by number, for every kind of frame."""
import math

import numpy as np
import pytest

from warmfront import Body
from warmfront._part_way import part_way, pose_part_way, vertices_part_way
from warmfront._question import question_of
from warmfront._state import SceneState

TRIAL = question_of("trial")
BODIES = [Body(4), Body(4, "rigid"), Body(4, "rigid"), Body(4, "static")]
FACES = [[0, 1, 2], [4, 5, 6], [8, 9, 10], [12, 13, 14]]
FRACTIONS = [0, 5e-324, 0.1, 1 / 3, 0.5, 0.9, 1 - 2**-53, 1]


def one_number(x, y, f, dtype):
    """In Python's own floats, which are float64."""
    if f in (0, 1):
        return y if f == 1 else x
    d = y - x
    at = x + f * d if math.isfinite(d) else (1 - f) * x + f * y
    return float(dtype(at))


def draw(seed, dtype):
    """Large and small numbers, signed zeros among them."""
    numbers = np.random.default_rng(seed)
    values = numbers.standard_normal((16, 3)) * 10.0 ** numbers.integers(-12, 12, (16, 3))
    values[numbers.random((16, 3)) < 0.1] = 0.0
    values[numbers.random((16, 3)) < 0.1] = -0.0
    return values.astype(dtype)


def turned(angle, shift, dtype):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0, shift], [s, c, 0, 0], [0, 0, 1, -shift]]).astype(dtype).astype(np.float64)


def place(pose, rest):
    """In the engine's order of operations."""
    return [[(p[0] * x + p[1] * y) + p[2] * z + p[3] for p in pose.tolist()] for x, y, z in rest.tolist()]


def trial(state, positions=None, bodies=None, poses=None, vertices=None, vertex_positions=None):
    return state.encode(1, positions, bodies or {}, poses or {}, vertices, vertex_positions, 64, TRIAL)


def expected(X, Y, f, dtype):
    rows = []
    for x, y in zip(np.asarray(X, float), np.asarray(Y, float)):
        same = x.tobytes() == y.tobytes()
        rows.append(y.tolist() if same else [one_number(a, b, f, dtype) for a, b in zip(x.tolist(), y.tolist())])
    return np.array(rows).astype(dtype)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("f", FRACTIONS)
def test_whole_frames_bodies_and_vertices(dtype, f):
    for seed in range(20):
        X, Y = draw(2 * seed, dtype), draw(2 * seed + 1, dtype)
        Y[::3] = X[::3]
        Y[12:] = X[12:]
        state = SceneState(X, FACES, BODIES, [])
        state.take_part(trial(state, Y), f)
        assert state.placed().astype(dtype).tobytes() == expected(X, Y, f, dtype).tobytes()

        state = SceneState(X, FACES, BODIES, [])
        state.take_part(trial(state, bodies={0: Y[:4], 2: Y[8:12]}), f)
        Z = np.concatenate([Y[:4], X[4:8], Y[8:12], X[12:]])
        assert state.placed().astype(dtype).tobytes() == expected(X, Z, f, dtype).tobytes()

        state = SceneState(X, FACES, BODIES, [])
        state.take_part(trial(state, vertices=[2, 1], vertex_positions=Y[[2, 1]]), f)
        Z = X.copy()
        Z[[1, 2]] = Y[[1, 2]]
        assert state.placed().astype(dtype).tobytes() == expected(X, Z, f, dtype).tobytes()


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("f", FRACTIONS)
def test_poses(dtype, f):
    """From where a body is at positions, and from another pose; and from a pose to positions."""
    rest = draw(7, np.float32).astype(dtype)
    first, second = turned(0.3, 0.7, dtype), turned(1.1, -0.2, dtype)
    state = SceneState(rest, FACES, BODIES, [])
    state.take_part(trial(state, poses={1: first}), f)
    pose = np.array([[one_number(a, b, f, dtype) for a, b in zip(*rows)] for rows in zip(np.eye(3, 4).tolist(), first.tolist())])
    if f > 0:
        assert state.poses[1].tobytes() == pose.tobytes() and state.poses[2] is None
    assert state.placed()[4:8].tolist() == (place(pose, rest[4:8]) if f > 0 else rest[4:8].tolist())
    start = pose if f > 0 else np.eye(3, 4)
    state.take_part(trial(state, poses={1: second, 2: first}), f)
    pose = np.array([[one_number(a, b, f, dtype) for a, b in zip(*rows)] for rows in zip(start.tolist(), second.tolist())])
    if f > 0:
        assert state.poses[1].tobytes() == pose.tobytes()
    X = state.placed()
    Y = draw(9, dtype)
    state.take_part(trial(state, bodies={1: Y[4:8]}), f)
    assert state.placed()[4:8].tobytes() == expected(X[4:8], Y[4:8], f, dtype if f else np.float64).astype(np.float64).tobytes()
    assert state.poses[1] is None


def test_a_vertex_and_a_pose_that_do_not_move_keep_their_bits():
    zeros = np.array([[-0.0, 0.0, -0.0]])
    assert np.signbit(vertices_part_way(zeros, zeros.copy(), 0.5, np.dtype("f8"))).tolist() == [[True, False, True]]
    pose = np.eye(3, 4)
    pose[0, 3] = -0.0
    assert np.signbit(pose_part_way(pose, pose.copy(), 0.5, np.dtype("f8"))[0, 3])


def test_motions_beyond_float64():
    most = np.finfo(float).max
    at = part_way(np.array([-most, most]), np.array([most, most]), 0.25, np.dtype("f8"))
    assert at.tolist() == [0.75 * -most + 0.25 * most, most]
