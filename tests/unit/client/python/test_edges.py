# SPDX-License-Identifier: Apache-2.0
"""Edges of no face, hair and rods: what they meet, also when the daemon dies; and which edges are refused."""
import numpy as np
import pytest
from fake_daemon import FakeDaemon
from support import bits, triangle_through_triangle

import warmfront
from warmfront import Body, InvalidArgumentError, Kind, UnimplementedError

CROSS = np.array([[-1, 0, 0], [1, 0, 0], [0, -1, 1], [0, 1, 1]], float)  # a rod along x, and one along y above it
RODS = [[0, 1], [2, 3]]


def lowered(to):
    after = CROSS.copy()
    after[2:, 2] = to
    return after


@pytest.mark.parametrize("edges", [RODS, np.array(RODS, np.uint8), np.array(RODS[::-1])[:, ::-1]])
def test_rods_meet(client, edges):
    for faces in (None, [], np.zeros((0, 3), np.int64)):
        with client.session(CROSS, faces, edges=edges) as session:
            assert not session.proximity(0.99) and session.proximity(1).ee == 1
            contacts = session.step(lowered(-1))
            assert contacts.v.tolist() == [[0, 1, 2, 3]] and contacts.edges.tolist() == [[0, 1]]
            info = client.get_session(session.id)
            assert (info.face_count, info.edge_count, info.lone_edge_count) == (0, 2, 2)


def test_a_side_of_a_face_given_again_adds_nothing(client):
    before, after, faces = triangle_through_triangle()
    with client.session(before, faces) as session:
        expected = bits(session.step(after))
    with client.session(before, faces, edges=[[1, 0], [4, 5]]) as session:
        assert bits(session.step(after)) == expected
        assert client.get_session(session.id).lone_edge_count == 0


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_they_come_again_with_the_session(daemon, client, dtype):
    before = CROSS.astype(dtype)

    def play(disturb):
        answers = []
        with client.session(before, edges=RODS, bodies=[Body(2), Body(2)]) as session:
            answers.append(session.step(lowered(0.5).astype(dtype)))
            disturb()
            session.add_body(Body(3), None, before[:3] + dtype(0.25), edges=[[0, 1], [1, 2]])
            disturb()
            answers.append(session.step(bodies={1: lowered(-0.5)[2:].astype(dtype)}))
            disturb()
            answers.append(session.proximity(0.5))
            return [bits(answer) for answer in answers], [len(answer) for answer in answers]

    undisturbed = play(lambda: None)
    assert play(daemon.restart) == undisturbed
    assert undisturbed[1][1] > 0


@pytest.mark.parametrize("message, edges", [
    (r"edges: shape \(1, 3\); give \(k, 2\) vertex indices", [[0, 1, 2]]),
    (r"edges: shape \(2,\)", [0, 1]),
    (r"edges: float64 numbers; give integers", [[0.5, 1]]),
    (r"edges\[1\]\[0\]: vertex index 9 is not in \[0, 4\)", [[0, 1], [9, 2]]),
    (r"edges\[0\]: joins vertex 3 to itself", [[3, 3]]),
])
def test_what_is_no_edge_is_refused(client, message, edges):
    with pytest.raises(InvalidArgumentError, match=message):
        client.session(CROSS, edges=edges)
    assert client.list_sessions() == []


def test_points_come_near_edges_and_each_other(anywhere):
    points = np.array([[0, 0, 0.3], [0, 0.4, 0.3], [9, 9, 9]])
    with anywhere.session(np.concatenate([CROSS, points]), edges=RODS) as session:
        assert not session.step(np.concatenate([CROSS, points + [0, 0, -0.1]])), "touching is all that counts"
        near = session.proximity(0.45)
        assert near.kind.tolist() == [Kind.VERTEX_EDGE, Kind.VERTEX_EDGE, Kind.VERTEX_VERTEX]
        assert near.v.tolist() == [[4, 4, 0, 1], [5, 5, 0, 1], [4, 4, 5, 5]]
        assert (near.vf, near.ee, near.ve, near.vv, len(near)) == (0, 3, 2, 1, 3)
        assert near.edges.tolist() == [[-1, 0], [-1, 0], [-1, -1]] and near.faces.tolist() == [-1, -1, -1]
        reduced = session.proximity(0.45, reduced=True)
        stencils = reduced.stencils()
        assert stencils.ev.v.tolist() == [[0, 1, 4], [0, 1, 5]] and stencils.vv.v.tolist() == [[4, 5]]
        assert warmfront.continuity(near, session.proximity(0.45)).kept.tolist() == [0, 1, 2]


def test_particles_of_a_radius_collide(anywhere):
    """Two that pass each other, and a third that stays away."""
    before = np.array([[0, 0, 0], [1, 0.1, 0], [0, 5, 0]], float)
    after = np.array([[1, 0, 0], [0, 0.1, 0], [0, 5, 0]], float)
    with anywhere.session(before, thickness=0.1) as session:
        contacts = session.step(after)
        assert contacts.v.tolist() == [[0, 0, 1, 1]] and contacts.vv == 1
        closing = (1 - np.sqrt(0.2 ** 2 - 0.1 ** 2)) / 2
        assert contacts.toi[0] <= closing and contacts.toi[0] > closing - 1e-5


def test_a_daemon_that_is_older_than_edges_is_not_asked(tmp_path):
    fake = FakeDaemon(tmp_path)
    try:
        with warmfront.connect(fake.address) as client:
            with pytest.raises(UnimplementedError, match="edges: the daemon is older"):
                client.session(CROSS, edges=RODS)
            assert fake.received == [] and not fake.copies
            with client.session(CROSS[:3], [[0, 1, 2]], bodies=[Body(3)]) as session:
                with pytest.raises(UnimplementedError, match="edges: the daemon is older"):
                    session.add_body(Body(2), None, CROSS[:2], edges=[[0, 1]])
    finally:
        fake.stop()
