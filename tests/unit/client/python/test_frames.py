# SPDX-License-Identifier: Apache-2.0
"""Frames that carry only what moved, scenes that change, and several frames in flight."""
import numpy as np
import pytest
from support import bits, triangle_through_triangle

from warmfront import Body, FailedPreconditionError, InvalidArgumentError, NotFoundError, Options


def turned(angle, shift):
    """A (3, 4) pose: a turn around z, then a shift."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0, shift[0]], [s, c, 0, shift[1]], [0, 0, 1, shift[2]]])


def placed(pose, rest):
    """In the engine's order of operations."""
    return ((pose[:, 0] * rest[:, 0:1] + pose[:, 1] * rest[:, 1:2]) + pose[:, 2] * rest[:, 2:3]) + pose[:, 3]


def test_bodies_and_single_vertices_are_as_all_positions(anywhere, cloth):
    n = cloth.bodies[0].vertex_count
    options = Options(min_separation=0.02)
    with anywhere.session(cloth.frames[0], cloth.faces, bodies=cloth.bodies, options=options) as whole, \
            anywhere.session(cloth.frames[0], cloth.faces, bodies=cloth.bodies, options=options) as parts:
        V = cloth.frames[0].copy()
        touched = 0
        for k, frame in enumerate(cloth.frames[1:30]):
            if k % 3 == 0:  # the cloth alone
                V[:n] = frame[:n]
                answer = parts.step(bodies={0: V[:n]})
            elif k % 3 == 1:  # every fifth of its vertices, and the ball
                V[:n:5] = frame[:n:5]
                V[n:] = frame[n:]
                answer = parts.step(bodies={1: V[n:]}, vertices=np.arange(0, n, 5), vertex_positions=V[:n:5])
            else:
                V = frame.copy()
                answer = parts.step(V)
            assert bits(answer) == bits(whole.step(V))
            touched += len(answer)
        assert touched > 1000
        before = whole.step(V)
        assert bits(parts.step()) == bits(before)  # nothing moves


def test_none_is_no_frame(anywhere):
    """What a function returns that forgets to return positions: not a frame in which nothing moves."""
    before, after, faces = triangle_through_triangle()
    with anywhere.session(before, faces) as session:
        for ask in (session.step, session.trial, session.max_step, session.place, session.submit):
            with pytest.raises(InvalidArgumentError, match="positions: None; give an array, or leave it out for a frame in which"):
                ask(None)
            with pytest.raises(InvalidArgumentError, match="positions: None"):
                ask(None, bodies={})
        assert not session.step()
        assert len(session.step(after)) == 3


def test_what_a_model_saves_is_told_where_asked(anywhere, cloth):
    n = cloth.bodies[0].vertex_count
    with anywhere.session(cloth.frames[0], cloth.faces, bodies=cloth.bodies, options=Options(explain=True)) as session:
        told = session.step(bodies={0: cloth.frames[1][:n]}).all_deformable
        assert told.positions_bytes == cloth.frames[0].nbytes > told.frame_bytes >= 12 * n
        assert told.statistics.counts.nodes_refit > 0
    with anywhere.session(cloth.frames[0], cloth.faces, bodies=cloth.bodies) as session:
        assert session.step(cloth.frames[1]).all_deformable is None


@pytest.mark.parametrize("named", [False, True])
def test_poses_are_as_the_positions_that_they_place(anywhere, crowd, named):
    rest = crowd.frames[0].astype(np.float64)
    ends = np.cumsum([body.vertex_count for body in crowd.bodies])
    ranges = [slice(end - body.vertex_count, end) for end, body in zip(ends, crowd.bodies)]
    rigid = [b for b, body in enumerate(crowd.bodies) if body.kind == "rigid"]
    options = Options(min_separation=0.05)
    with anywhere.session(rest, crowd.faces, bodies=crowd.bodies, options=options) as poses, \
            anywhere.session(rest, crowd.faces, bodies=crowd.bodies, options=options) as positions:
        V = rest.copy()
        found = 0
        for k in range(1, 8):
            moved = rigid[::2] if named else rigid
            given = {b: turned(0.1 * k * (b % 3), [0.02 * k * np.cos(b), 0.02 * k * np.sin(b), 0]) for b in moved}
            for b, pose in given.items():
                V[ranges[b]] = placed(pose, rest[ranges[b]])
            answer = poses.step(poses=given)
            assert bits(answer) == bits(positions.step(V))
            found += len(answer)
        assert found > 0


def test_bodies_are_added_and_changed(anywhere):
    before, after, faces = triangle_through_triangle()
    with anywhere.session(before[:3], faces[:1], bodies=[Body(3, "static")]) as session:
        assert session.add_body(Body(3, name="falling"), faces[:1], before[3:]) == 1
        contacts = session.step(bodies={1: after[3:]})
        assert (contacts.vf, contacts.ee) == (1, 2) and contacts.v.max() == 5
        session.change_body(1, Body(3, "removed"))
        assert not session.step()
        with pytest.raises(InvalidArgumentError):
            session.change_body(1, Body(3))
        assert session.info().body_count == 2


def test_excluded_pairs_and_groups_are_not_tested(anywhere):
    before, after, faces = triangle_through_triangle()
    with anywhere.session(before, faces, bodies=[Body(3), Body(3)], excluded_pairs=[(0, 1)]) as session:
        assert not session.step(after)
    with anywhere.session(before, faces, bodies=[Body(3, group=2, mask=2), Body(3, group=1, mask=1)]) as session:
        assert not session.step(after)
    with anywhere.session(before, faces, bodies=[Body(3, group=2, mask=1), Body(3, group=1, mask=2)]) as session:
        assert session.step(after)


def test_several_frames_in_flight_are_answered_in_order(client, cloth):
    with client.session(cloth.frames[0], cloth.faces, bodies=cloth.bodies) as session:
        single = [session.step(frame) for frame in cloth.frames[1:]]
    with client.session(cloth.frames[0], cloth.faces, bodies=cloth.bodies) as session:
        answers = []
        for frame in cloth.frames[1:]:
            session.submit(frame)
            if session.window == len(answers) + 1:
                with pytest.raises(FailedPreconditionError, match=f"{session.window} frames are unanswered"):
                    for _ in range(session.window):
                        session.submit(frame)
            if session._link.unanswered and len(session._link.unanswered) == session.window:
                answers.append(session.next_answer())
        while session._link.unanswered:
            answers.append(session.next_answer())
        with pytest.raises(FailedPreconditionError, match="no frame is unanswered"):
            session.next_answer()
    assert [bits(a) for a in answers] == [bits(a) for a in single]
    assert max(a.queue_ms for a in answers) > 0  # they waited for each other


def test_a_frame_that_fails_does_not_count(anywhere):
    before, after, faces = triangle_through_triangle()
    bad = after.copy()
    bad[4, 1] = np.inf
    with anywhere.session(before, faces) as session:
        assert [session.submit(V) for V in (bad, after, after)] == [1, 2, 3]
        with pytest.raises(InvalidArgumentError, match=r"positions\[4\]\.y"):
            session.next_answer()
        with pytest.raises(FailedPreconditionError, match="take their answers"):
            session.submit(after)
        for _ in range(2):
            with pytest.raises(FailedPreconditionError) as error:
                session.next_answer()
            assert error.value.reason == "FRAME_OUT_OF_ORDER" and error.value.expected_frame == 1
        assert session.submit(after) == 1
        assert len(session.next_answer()) == 3


def test_an_answer_that_is_due_comes_first(client):
    before, after, faces = triangle_through_triangle()
    with client.session(before, faces, bodies=[Body(3), Body(3)]) as session:
        session.submit(after)
        with pytest.raises(FailedPreconditionError, match="take their answers before a single step"):
            session.step(before)
        with pytest.raises(FailedPreconditionError, match="before changing the scene"):
            session.change_body(0, Body(3, "static"))
        assert len(session.next_answer()) == 3
    with pytest.raises(FailedPreconditionError, match="the session is closed"):
        session.step(before)
    with pytest.raises(NotFoundError):
        client.get_session(session.id)
