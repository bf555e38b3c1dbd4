# SPDX-License-Identifier: Apache-2.0
"""Elements and bodies that are replaced: numbers and answers are those of a session made anew, also when the
daemon dies; and what is refused."""
import numpy as np
import pytest
from fake_daemon import FakeDaemon
from support import bits

import warmfront
from warmfront import Body, FailedPreconditionError, InvalidArgumentError, UnimplementedError


def sheet(n, height, dtype=np.float64):
    """n x n quads of side 1."""
    x, y = np.meshgrid(np.arange(n + 1) / n, np.arange(n + 1) / n, indexing="ij")
    return np.stack([x.ravel(), y.ravel(), np.full(x.size, height)], axis=1).astype(dtype)


def grid(n):
    corners = np.array([i * (n + 1) + j for i in range(n) for j in range(n)])
    return np.concatenate([np.stack([corners, corners + n + 1, corners + 1], 1),
                           np.stack([corners + 1, corners + n + 1, corners + n + 2], 1)])


def three(quads, dtype=np.float64):
    """Sheets above each other: positions, faces, bodies."""
    rows = [sheet(n, 0.1 * k, dtype) for k, n in enumerate(quads)]
    firsts = np.cumsum([0] + [len(of) for of in rows])
    faces = np.concatenate([grid(n) + first for n, first in zip(quads, firsts)])
    return np.concatenate(rows), faces, [Body(len(of)) for of in rows]


def squeezed(positions, factor):
    after = positions.copy()
    after[:, 2] *= positions.dtype.type(factor)
    return after


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_it_is_a_session_made_anew(daemon, client, dtype):
    def play(disturb):
        before, faces, bodies = three([3, 4, 5], dtype)
        with client.session(before, faces, bodies=bodies) as session:
            assert session.step(squeezed(before, -1))
            disturb()
            session.replace_body(1, sheet(6, -0.1, dtype), grid(6), edges=[[0, 48]])
            disturb()
            session.replace_elements(0, grid(3)[:-2], edges=[[0, 15]])
            disturb()
            assert session.positions.shape == (16 + 49 + 36, 3)
            here = session.positions
            return here, bits(session.step(squeezed(here, -0.5)))

    here, undisturbed = play(lambda: None)
    assert bits_of_fresh(client, here) == undisturbed[1:]
    again = play(daemon.restart)
    assert again[0].tobytes() == here.tobytes() and again[1] == undisturbed


def bits_of_fresh(client, here):
    _, faces, bodies = three([3, 6, 5], here.dtype)
    faces = np.concatenate([faces[:16], faces[18:]])
    with client.session(here, faces, bodies=bodies, edges=[[16, 64], [0, 15]]) as session:
        answer = session.step(squeezed(here, -0.5))
        assert len(answer) > 0 and (answer.bodies < 3).all() and (answer.faces >= -1).all()
        return bits(answer)[1:]


def test_bodies_come_and_go_at_one_index(start_daemon):
    # One thread: a second one has buffers of its own from whenever it first helps.
    daemon = start_daemon("--threads", "1")
    before, faces, bodies = three([3, 3])
    with warmfront.connect(daemon.address) as client, client.session(before, faces, bodies=bodies) as session:
        at = []
        for k in range(30):
            session.replace_body(1, np.zeros((0, 3)), body=Body(0, kind="removed"))
            assert len(session.positions) == 16
            session.replace_body(1, sheet(4, 0.2), grid(4), body=Body(25, name=f"sheet {k}"))
            session.step(squeezed(session.positions, 0.99))
            at.append(client.get_session(session.id).memory_bytes)
        assert at[-1] < 1.02 * at[5]


def test_faces_in_turns_are_ordered(daemon, client):
    before, faces, bodies = three([2, 3, 2])
    mixed = faces[np.random.default_rng(1).permutation(len(faces))]
    with client.session(before, mixed, bodies=bodies) as session:
        session.replace_elements(1, grid(3))
        expected = bits(session.trial(squeezed(before, -1)))
        daemon.restart()
        assert bits(session.trial(squeezed(before, -1))) == expected
        assert len(session.trial(squeezed(before, -1)).faces) > 0


def test_a_scene_without_bodies_is_replaced_as_a_whole(anywhere):
    before, faces, _ = three([3, 3])
    with anywhere.session(before, faces) as session:
        session.replace_elements(0, faces[:-5])
        answer = bits(session.step(squeezed(before, -1)))
        with pytest.raises(FailedPreconditionError, match="declares none"):
            session.replace_body(0, before, faces, body=Body(len(before)))
        with pytest.raises(InvalidArgumentError, match="index 0 is all of it"):
            session.replace_elements(1, faces)
    with anywhere.session(before, faces[:-5]) as session:
        assert bits(session.step(squeezed(before, -1))) == answer


def test_thickness_and_filters_go_with_the_vertices(daemon, client):
    before, faces, bodies = three([3, 3])
    thickness = np.r_[np.zeros(16), np.full(16, 0.06)]
    filters = warmfront.PairFilters(near_at_rest=0.01, excluded_vertex_pairs=[[0, 16]], patches=np.ones(32, int))
    with client.session(before, faces, bodies=bodies, thickness=thickness, filters=filters) as session:
        with pytest.raises(FailedPreconditionError, match="thickness"):
            session.replace_body(1, sheet(2, 0.1), grid(2))
        with pytest.raises(FailedPreconditionError, match="names vertex 16"):
            session.replace_body(1, sheet(2, 0.1), grid(2), thickness=0.06)
        session.change_filters({"near_at_rest": 0.01, "rest_positions": before, "patches": np.ones(32, int)})
        session.replace_body(1, sheet(2, 0.05), grid(2), thickness=np.full(9, 0.06))
        expected = bits(session.proximity(0))
        assert len(session.proximity(0)) > 0
        daemon.restart()
        session.step()
        assert bits(session.proximity(0))[1:] == expected[1:]


def test_what_is_added_may_have_thickness_of_its_vertices(anywhere):
    before, faces, bodies = three([3, 3])
    above = sheet(2, 0.05)
    counts = []
    for thickness in (None, 0, 0.06, np.full(9, 0.06)):
        with anywhere.session(before, faces, bodies=bodies) as session:
            assert session.add_body(Body(9), grid(2), above, thickness=thickness) == 2
            assert session.info().most_thickness == (0.06 if np.any(thickness) else 0)
            counts.append(len(session.proximity(0)))
    assert counts[0] == counts[1] < counts[2] == counts[3]
    with anywhere.session(before, faces, bodies=bodies, thickness=0.01) as session:
        with pytest.raises(InvalidArgumentError, match=r"thickness: shape \(4,\); give \(9,\)"):
            session.add_body(Body(9), grid(2), above, thickness=[0.06] * 4)


def test_where_what_was_thick_made_way_the_session_is_made_again(daemon, client):
    before, faces, bodies = three([3, 3])
    with client.session(before, faces, bodies=bodies, thickness=np.r_[np.zeros(16), np.full(16, 0.06)]) as session:
        session.replace_body(1, sheet(2, 0.05), grid(2), thickness=0)
        daemon.restart()
        session.step()
        assert session.resumes == 1 and client.get_session(session.id).most_thickness == 0


@pytest.mark.parametrize("message, replace", [
    (r"index: body 2 is not in \[0, 2\); give the number of one of the scene's bodies", lambda s: s.replace_elements(2, [])),
    (r"faces\[0\]\[2\]: vertex index 16 is not in \[0, 16\); a body's faces and edges number its own vertices, from 0",
     lambda s: s.replace_elements(1, [[0, 1, 16]])),
    (r"edges\[0\]: joins vertex 3 to itself", lambda s: s.replace_elements(1, [], edges=[[3, 3]])),
    (r"positions: shape \(4, 2\)", lambda s: s.replace_body(1, np.zeros((4, 2)), [])),
    (r"no vertices and no positions", lambda s: s.replace_body(1, np.zeros((4, 3)), body=Body(4, kind="removed"))),
    (r"vertex_count: is 0", lambda s: s.replace_body(1, np.zeros((0, 3)))),
])
def test_what_does_not_fit_is_refused(anywhere, message, replace):
    before, faces, bodies = three([3, 3])
    with anywhere.session(before, faces, bodies=bodies) as session:
        with pytest.raises(InvalidArgumentError, match=message):
            replace(session)
        assert session.step(squeezed(before, -1)), "it is as it was"


def test_an_older_daemon_is_not_asked(tmp_path):
    fake = FakeDaemon(tmp_path)
    try:
        with warmfront.connect(fake.address) as client, client.session(np.zeros((3, 3)), [[0, 1, 2]], bodies=[Body(3)]) as session:
            with pytest.raises(UnimplementedError, match="older than replacing"):
                session.replace_elements(0, [])
    finally:
        fake.stop()
