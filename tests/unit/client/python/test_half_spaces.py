# SPDX-License-Identifier: Apache-2.0
"""Half-spaces: what they meet, how they move and change, also when the daemon dies; and what is refused."""
import numpy as np
import pytest
from fake_daemon import FakeDaemon
from support import bits

import warmfront
from warmfront import Body, InvalidArgumentError, Kind, UnimplementedError

TRIANGLE = np.array([[0, 0, 1], [1, 0, 1], [0, 1, 1]], float)
FACES = [[0, 1, 2]]
GROUND = Body(kind="static", half_space=((0, 0, 0), (0, 0, 2)))
UP = ((0, 0, 0), np.array([0, 0, 1], np.float32))


def lowered(by):
    return TRIANGLE - [0, 0, by]


def shift(z):
    pose = np.eye(3, 4)
    pose[2, 3] = z
    return pose


def test_vertices_meet_it(anywhere):
    with anywhere.session(TRIANGLE, FACES, bodies=[GROUND, Body(3)],
                        options=warmfront.Options(fields=["weights", "normal", "points"])) as session:
        assert not session.step(lowered(0.5))
        contacts = session.step(lowered(1.5))
        assert contacts and (contacts.vf, contacts.ee, contacts.vh) == (0, 0, 3)
        assert contacts.kind.tolist() == [Kind.VERTEX_HALF_SPACE] * 3
        assert contacts.v.tolist() == [[v, v, v, 0] for v in range(3)]
        assert contacts.bodies.tolist() == [[1, 0]] * 3
        assert np.allclose(contacts.toi, 0.5) and (contacts.toi <= 0.5).all()
        assert contacts.weights.tolist() == [[1, 0, 0, 0]] * 3 and contacts.normal.tolist() == [[0, 0, 1]] * 3
        assert (contacts.faces == -1).all() and (contacts.edges == -1).all()
        by_vertex = contacts.by_vertex(3)
        assert [by_vertex[v].tolist() for v in range(3)] == [[0], [1], [2]]
        assert warmfront.continuity(contacts, session.step(lowered(1.5))).kept.tolist() == [0, 1, 2]


def test_every_question_tells_of_it(anywhere):
    with anywhere.session(TRIANGLE, FACES, bodies=[Body(3), GROUND]) as session:
        assert session.proximity(0.9).vh == 0 and session.proximity(1).vh == 3
        near = session.proximity(2, reduced=True)
        stencils = near.stencils()
        assert len(stencils.vh) == 3 and stencils.vh.v.tolist() == [[0], [1], [2]] and not any(map(len, stencils))
        assert np.allclose(session.vertex_distances(2).distances, 1)
        step = session.max_step(lowered(2))
        assert abs(step.fraction - 0.5) < 1e-9 and step.first.kind == Kind.VERTEX_HALF_SPACE
        assert session.trial(lowered(2)).vh == 3
        assert session.commit(0.25).vh == 0
        assert session.trial(lowered(2)).vh == 3
        assert session.commit(1).vh == 3
        assert not session.intersections()


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_it_moves_changes_and_comes_again_with_the_session(daemon, client, dtype):
    start = TRIANGLE.astype(dtype)

    def play(disturb):
        with client.session(start, FACES, bodies=[Body(3)]) as session:
            answers = []
            assert session.add_body(Body(kind="rigid", half_space=UP), None, None) == 1
            disturb()
            answers.append(session.step(poses={1: shift(0.5)}))
            disturb()
            answers.append(session.step(lowered(0.75).astype(dtype)))  # which says nothing of it
            disturb()
            answers.append(session.step(poses={1: shift(-3)}))
            disturb()
            session.trial(poses={1: shift(5)})
            session.commit(0.5)
            disturb()
            answers.append(session.step())
            session.change_body(1, Body(kind="static", half_space=UP))  # where it was described
            disturb()
            answers.append(session.step())
            session.change_body(1, Body(kind="removed"))
            disturb()
            answers.append(session.step())
            return [bits(answer) for answer in answers], [answer.vh for answer in answers]

    undisturbed = play(lambda: None)
    assert play(daemon.restart) == undisturbed
    assert undisturbed[1] == [0, 3, 3, 3, 0, 0]


def test_what_is_none_is_refused(anywhere):
    for half_space in (5, ((0, 0), (0, 0, 1)), ((0, 0, 0), "up"), ((0, 0, 0),)):
        with pytest.raises(InvalidArgumentError, match="half_space"):
            anywhere.session(TRIANGLE, FACES, bodies=[Body(3), Body(kind="static", half_space=half_space)])
    for body, why in ((Body(kind="static", half_space=((0, 0, 0), (0, 0, 0))), "normal: is zero"),
                      (Body(half_space=UP), "kind: is deformable"), (Body(kind="static"), "vertex_count: is 0")):
        with pytest.raises(InvalidArgumentError, match=why):
            anywhere.session(TRIANGLE, FACES, bodies=[Body(3), body])
    with anywhere.session(TRIANGLE, FACES, bodies=[Body(3), Body(kind="rigid", half_space=UP)]) as session:
        for rows in (np.empty((0, 3)), TRIANGLE):
            with pytest.raises(InvalidArgumentError, match="body 1 is a half-space, which has no positions; it moves by poses"):
                session.step(bodies={1: rows}, poses={})
        with pytest.raises(InvalidArgumentError, match="half_space: is missing"):
            session.change_body(1, Body(kind="static"))


def test_a_daemon_that_is_older_than_half_spaces_is_not_asked(tmp_path):
    fake = FakeDaemon(tmp_path)
    try:
        with warmfront.connect(fake.address) as client:
            with pytest.raises(UnimplementedError, match="half_space: the daemon is older"):
                client.session(TRIANGLE, FACES, bodies=[GROUND, Body(3)])
            assert fake.received == [] and not fake.copies
            with client.session(TRIANGLE, FACES, bodies=[Body(3)]) as session:
                with pytest.raises(UnimplementedError, match="half_space: the daemon is older"):
                    session.add_body(GROUND, None, None)
    finally:
        fake.stop()
