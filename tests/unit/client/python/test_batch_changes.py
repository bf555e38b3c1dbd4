# SPDX-License-Identifier: Apache-2.0
"""Changes of the session beneath a batch: what the batch goes on with, and as what."""
import dataclasses

import numpy as np
import pytest
from support import triangle_through_triangle

import warmfront
from warmfront import Body, FailedPreconditionError

BEFORE, AFTER, FACES = triangle_through_triangle()
STAY, DOWN = np.eye(3, 4), np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, -2]], float)


def wall(z):
    return Body(kind="static", half_space=((0, 0, z), (0, 0, 1)))


def removed(batch, number):
    batch.session.change_body(number, dataclasses.replace(batch.session.bodies[number], kind="removed"))


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_what_one_copy_no_longer_has_is_left_out(anywhere, dtype):
    before, after = BEFORE.astype(dtype), AFTER.astype(dtype)
    with anywhere.batch(3, before, FACES, bodies=[Body(3), Body(3, "rigid")]) as batch:
        removed(batch, 0)  # of copy 0 what is deformable, of copy 2 what is rigid
        removed(batch, 5)
        still, moved = np.stack([before[:3]] * 3), np.stack([DOWN] * 3)[:, None]
        for ask in (lambda: batch.step(still, poses=moved), lambda: batch.step(poses=moved), lambda: batch.step(np.stack([after] * 3))):
            batch.place(np.stack([before] * 3))
            assert (ask().counts > 0).tolist() == [False, True, False]
        batch.place(np.stack([before] * 2), worlds=[0, 1])
        batch.place(after[None, :3], poses=DOWN[None, None], worlds=[1])
        assert (batch.positions[0, 3:] == before[3:]).all() and (batch.positions[1] == [*after[:3], *before[3:] + [0, 0, -2]]).all()
        batch.place(np.stack([before] * 3))
        assert batch.max_step(np.stack([after] * 3)).tolist() == [1, pytest.approx(0.5, abs=1e-5), 1]
        with pytest.raises(warmfront.InvalidArgumentError, match=r"positions\[2\].y: is not a number"):
            batch.step(np.where(np.arange(9).reshape(3, 3) == 7, np.nan, before[:3])[None], poses=STAY[None, None], worlds=[1])
        # Nothing is left of a copy.
        removed(batch, 1)
        assert batch.step(after[None], worlds=[0]).counts.tolist() == [0, 0, 0]
        assert not batch.step(still[:1], poses=STAY[None, None], worlds=[0])


def test_a_wall_that_is_added_is_shared(anywhere):
    ground = (wall(-9), None, None)
    with anywhere.batch(3, BEFORE, FACES, bodies=[Body(3), Body(3), wall(-0.75)], shared=[ground]) as batch:
        assert batch.session.add_body(wall(-1.5), None, None) == 10
        told = batch.step(np.stack([BEFORE + share * (AFTER - BEFORE) for share in (0.75, 0.95, 1.5)]))
        half = told.contacts.kind == warmfront.Kind.VERTEX_HALF_SPACE
        rows = sorted((int(world), int(v[3])) for world, v in zip(told.world[half], told.v[half]))
        assert rows == [(1, 2)] * 3 + [(2, -2)] * 3 + [(2, 2)] * 3, "the second shared body, and each copy's own"
        batch.session.add_body(dataclasses.replace(wall(-1.7), world=3), None, None)
        told = batch.step(np.stack([BEFORE] * 3))
        half = told.contacts.kind == warmfront.Kind.VERTEX_HALF_SPACE
        assert (2, -3) in {(int(world), int(v[3])) for world, v in zip(told.world[half], told.v[half])}


def test_a_body_may_make_way_for_one_of_as_many_vertices(anywhere):
    with anywhere.batch(2, BEFORE, FACES, bodies=[Body(3), Body(3)]) as batch:
        lifted = BEFORE[3:] + [0, 0, 4]
        batch.session.replace_body(3, lifted, [[2, 1, 0]])
        assert (batch.positions[1, 3:] == lifted).all()
        told = batch.step(np.stack([AFTER, np.concatenate([BEFORE[:3], lifted + AFTER[3:] - BEFORE[3:]])]))
        assert (told.counts > 0).tolist() == [True, False]
        batch.session.add_body(Body(3), [[0, 1, 2]], BEFORE[:3] + 50)
        with pytest.raises(FailedPreconditionError, match="batch: the session beneath has another number of vertices"):
            batch.step(np.stack([BEFORE] * 2))
