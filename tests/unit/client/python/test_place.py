# SPDX-License-Identifier: Apache-2.0
"""Bodies that are placed elsewhere without a motion (teleport, reset), also when the daemon dies."""
import asyncio

import numpy as np
import pytest
from support import bits, triangle_through_triangle

from warmfront import Body, FailedPreconditionError, InvalidArgumentError

BEFORE, AFTER, FACES = triangle_through_triangle()


def test_it_meets_nothing_on_the_way(anywhere):
    with anywhere.session(BEFORE, FACES) as session:
        assert session.trial(AFTER)
        assert session.place(AFTER) is None
        assert session.last_frame == 1 and (session.positions == AFTER).all()
        with pytest.raises(FailedPreconditionError):
            session.commit()
        assert session.step(BEFORE), "back again it meets the triangle"
        with pytest.raises(InvalidArgumentError):
            session.place(AFTER[:5])
        asyncio.run(session.place_async(AFTER))
        assert session.submit_place(BEFORE).result() is None
        assert session.last_frame == 4 and not session.step(BEFORE)


def test_a_trial_by_poses_leaves_the_sign_of_zero(anywhere):
    V = np.array([[-0.0, -1, 0], [1, 0, 0], [0, 1, 0], [-.5, -.2, 0], [.8, -.2, 0], [.2, .3, .5]])
    with anywhere.session(V, [[0, 1, 2], [3, 4, 5]], bodies=[Body(3, "rigid"), Body(3)]) as session:
        assert session.max_step(V).fraction == 1
        session.trial(poses={0: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, .1]]})
        session.commit(0)
        assert np.signbit(session.positions[0, 0])
        assert session.max_step(session.positions).fraction == 1
        session.place(poses={0: np.eye(3, 4)})
        assert np.signbit(session.positions[0, 0])
        assert session.max_step(session.positions).fraction == 1


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_what_stays_keeps_its_bits_when_all_are_given(anywhere, dtype):
    V = np.array([[-0.0, -1, 0], [1, 0, 0], [0, 1, 0], [-.5, -.2, 5], [.8, -.2, 5], [.2, .3, 5.5], [9, 9, 9]], dtype)
    turned = np.array([[.6, -.8, 0, .1], [.8, .6, 0, 0], [0, 0, 1, .3]])
    bodies = [Body(3, "static"), Body(3, "rigid"), Body(1)]
    with anywhere.session(V, [[0, 1, 2], [3, 4, 5]], bodies=bodies) as session:
        session.step(poses={1: turned})
        where = session.positions.copy()
        session.change_body(1, Body(3, "removed"))
        assert session.positions.tobytes() == where.tobytes(), "what is removed stays where it was, though it was at a pose"
        given = where.astype(dtype)
        given[0, 0], given[3:6], given[6] = 0, 7, 8
        where[6] = 8
        session.step(given)
        assert session.positions.tobytes() == where.tobytes()
        given[6] = 9
        session.trial(given)
        session.commit(.5)
        where[6] = 8.5
        assert session.positions.tobytes() == where.tobytes()


def test_what_stays_may_be_in_many_places(anywhere):
    V = np.zeros((60, 3))
    V[:, 0] = np.arange(60)
    bodies = [Body(1, "static" if b % 2 else "deformable") for b in range(40)] + [Body(20, "static")]
    with anywhere.session(V, np.empty((0, 3), np.int32), bodies=bodies) as session:
        given = np.where(V == 0, -0.0, V)
        session.step(given)
        stays = np.repeat([b % 2 == 1 for b in range(40)] + [True], [1] * 40 + [20])
        assert not np.signbit(session.positions[stays]).any() and np.signbit(session.positions[~stays]).any()
        session.change_body(1, Body(1))
        session.step(given)
        assert np.signbit(session.positions[1, 1])


def test_it_comes_again_with_the_session(daemon, client):
    down = np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, -2]], float)

    def play(disturb):
        answers = []
        with client.session(BEFORE, FACES, bodies=[Body(3), Body(3, "rigid")]) as session:
            session.place(poses={1: down})
            disturb()
            answers.append(session.step(vertices=[0], vertex_positions=[[0, 0, -3]]))
            session.place(BEFORE)
            disturb()
            answers.append(session.step(poses={1: down}))
            return [bits(answer) for answer in answers], [len(answer) for answer in answers], session.resumes

    undisturbed, lengths, none = play(lambda: None)
    answers, again, resumes = play(daemon.restart)
    assert answers == undisturbed and lengths == again and lengths[1] > 0 and (none, resumes) == (0, 2)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_what_is_removed_is_not_changed_though_it_was_at_a_pose(anywhere, dtype):
    V = np.array([[0, -1, 0], [1, 0, 0], [0, 1, 0], [-.5, -.2, 5], [.8, -.2, 5], [.2, .3, 5.5]], dtype)
    with anywhere.session(V, [[0, 1, 2], [3, 4, 5]], bodies=[Body(3), Body(3, "rigid")]) as session:
        session.step(poses={1: np.eye(3, 4)})
        session.change_body(1, Body(3, "removed"))
        for kind in ("deformable", "static", "rigid"):
            with pytest.raises(InvalidArgumentError, match="was removed"):
                session.change_body(1, Body(3, kind))
