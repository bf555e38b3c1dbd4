# SPDX-License-Identifier: Apache-2.0
"""How thick bodies and vertices are: what they meet then, also when the daemon dies; and which values are refused."""
import numpy as np
import pytest
from fake_daemon import FakeDaemon
from support import bits, triangle_through_triangle

import warmfront
from warmfront import Body, InvalidArgumentError, Options, UnimplementedError

BEFORE, AFTER, FACES = triangle_through_triangle()
BODIES = [Body(3), Body(3)]


def near(client, distance, **scene):
    with client.session(BEFORE, FACES, **{"bodies": BODIES, **scene}) as session:
        return session.proximity(distance)


def test_thickness_adds_to_every_separation(client):
    assert not near(client, 0.9)
    assert near(client, 1.0)
    assert near(client, 0.9, bodies=[Body(3, thickness=0.1), Body(3)])
    assert near(client, 0.9, bodies=[Body(3), Body(3, thickness=0.25)])
    assert near(client, 0, bodies=[Body(3, thickness=0.5), Body(3, thickness=0.5)])
    assert not near(client, 0, bodies=[Body(3, thickness=0.5), Body(3, thickness=0.25)])
    assert near(client, 0, thickness=[0.5] * 6)
    assert near(client, 0, bodies=[Body(3, thickness=0.25), Body(3)], thickness=np.float32([0.25] * 3 + [0.5] * 3))
    assert near(client, 0, thickness=0.5) and not near(client, 0, thickness=np.float32(0.4375)) and near(client, 1, thickness=0)
    assert near(client, 0, bodies=[Body(6, thickness=0.5)]), "of one body: twice"
    rows = near(client, 0, thickness=[1, 0, 0, 0, 0, 0])  # the pairs of one vertex, and of what has it
    assert len(rows) > 0 and all(0 in row for row in np.asarray(rows.v).tolist())


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_it_comes_again_with_the_session(daemon, client, cloth, dtype):
    frames = cloth.frames.astype(dtype)
    thickness = np.linspace(0, 0.02, frames.shape[1])
    spare, _, faces = triangle_through_triangle(dtype)
    bodies = [warmfront.Body(**{**body.__dict__, "thickness": 0.01}) for body in cloth.bodies]

    def play(disturb):
        answers = []
        with client.session(frames[0], cloth.faces, bodies=bodies, thickness=thickness) as session:
            step = lambda k: answers.append(session.step(bodies={0: frames[k][:bodies[0].vertex_count]}))
            step(30)
            disturb()
            step(31)
            session.add_body(Body(6, thickness=0.5), faces, spare)
            disturb()
            step(32)
            session.change_body(0, warmfront.Body(**{**bodies[0].__dict__, "thickness": 0.03}))
            disturb()
            step(33)
            assert client.get_session(session.id).most_thickness == 0.5 + thickness.max()
            return [bits(answer) for answer in answers], session.resumes

    undisturbed, none = play(lambda: None)
    answers, resumes = play(daemon.restart)
    assert answers == undisturbed and any(answer[1] + answer[2] > 0 for answer in answers)
    assert none == 0 and resumes == 3


def test_where_nothing_is_thick_or_not_any_more_the_session_is_made_again(daemon, client):
    """The daemon then reports no thickness, which must not be mistaken for a daemon too old for it."""
    with client.session(BEFORE, FACES, bodies=[Body(3, thickness=1), Body(3)], thickness=[0] * 6) as session:
        session.change_body(0, Body(3, "removed", thickness=1))
        daemon.restart()
        assert not session.step(bodies={1: AFTER[3:]}) and session.resumes == 1


@pytest.mark.parametrize("message, scene", [
    (r"bodies\[1\].thickness: is -1", {"bodies": [Body(3), Body(3, thickness=-1)]}),
    (r"bodies\[0\].thickness: is nan", {"bodies": [Body(3, thickness=np.nan), Body(3)]}),
    (r"thickness 'thick' is not a number", {"bodies": [Body(3, thickness="thick"), Body(3)]}),
    (r"thickness\[2\]: is inf", {"thickness": [0, 0, np.inf, 0, 0, 0]}),
    (r"thickness: shape \(2,\); give \(6,\)", {"thickness": [0, 1]}),
    (r"thickness: ", {"thickness": ["thin"] * 6}),
    (r"thickness: ", {"thickness": "thin"}),
    (r"thickness\[0\]: is -1", {"thickness": -1}),
    (r"thickness: tier .fast. decides touching", {"thickness": [1] * 6, "options": Options(tier="fast")}),
])
def test_what_is_no_thickness_is_refused(client, message, scene):
    with pytest.raises(InvalidArgumentError, match=message):
        near(client, 0, **scene)
    assert client.list_sessions() == []


def test_a_daemon_that_is_older_than_thickness_is_not_asked(tmp_path):
    fake = FakeDaemon(tmp_path)
    try:
        with warmfront.connect(fake.address) as client:
            for scene in ({"bodies": [Body(3, thickness=1)]}, {"thickness": [1, 1, 1]}):
                with pytest.raises(UnimplementedError, match="thickness: the daemon is older"):
                    client.session(BEFORE[:3], FACES[:1], **scene)
            assert fake.received == [] and not fake.copies
            with client.session(BEFORE[:3], FACES[:1], bodies=[Body(3)]) as session:
                with pytest.raises(UnimplementedError, match="thickness: the daemon is older"):
                    session.change_body(0, Body(3, thickness=1))
                with pytest.raises(UnimplementedError, match="thickness: the daemon is older"):
                    session.add_body(Body(3, thickness=1), FACES[:1], BEFORE[:3])
    finally:
        fake.stop()
