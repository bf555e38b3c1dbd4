# SPDX-License-Identifier: Apache-2.0
"""Options and excluded pairs that change: from the next question on, through a resume, and what is refused."""
import dataclasses

import numpy as np
import pytest
from fake_daemon import FakeDaemon
from support import bits

import warmfront
from warmfront import Body, FailedPreconditionError, InvalidArgumentError, Options, UnimplementedError

FACES = np.array([[0, 1, 2], [1, 3, 2], [4, 5, 6], [5, 7, 6]])
BODIES = [Body(4), Body(4)]


def squares(height):
    square = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], np.float64)
    return np.concatenate([square, square + [0.1, 0.2, height]])


def test_options_hold_from_the_next_question_on(daemon, client):
    with client.session(squares(0.5), FACES, bodies=BODIES, options=Options(report="count")) as session:
        assert session.options == Options(report="count")
        assert len(session.step(squares(0.4))) == 0
        other = dataclasses.replace(session.options, report="all", min_separation=0.35, fields=["points"])
        session.change_options(other)
        assert session.options == other
        assert session.info().options.min_separation == 0.35
        answer = session.step(squares(0.3))
        assert len(answer) > 0 and answer.points.shape == (len(answer), 2, 3)
        daemon.restart()
        assert bits(session.trial(squares(0.2)))[1:] == bits(session.trial(squares(0.2)))[1:]
        assert len(session.trial(squares(0.2))) > 0 and session.resumes == 1
        assert session.info().options.min_separation == 0.35


def test_excluded_pairs_come_and_go(daemon, client):
    with client.session(squares(0.5), FACES, bodies=BODIES) as session:
        assert len(session.trial(squares(-0.5))) > 0
        session.change_excluded_pairs([(0, 1)])
        assert len(session.trial(squares(-0.5))) == 0
        daemon.restart()
        assert len(session.trial(squares(-0.5))) == 0
        session.change_excluded_pairs([])
        assert len(session.trial(squares(-0.5))) > 0


@pytest.mark.parametrize("message, change", [
    (r"options\.leaf_size: is fixed", lambda s: s.change_options(Options(leaf_size=4))),
    (r"options: tolerance", lambda s: s.change_options(Options(tolerance=0.0))),
    (r"options\.tier: 'right' is none of", lambda s: s.change_options(Options(tier="right"))),
    (r"changes\[0\]: excluded_pairs\[1\]: body 2 is not in \[0, 2\)", lambda s: s.change_excluded_pairs([(0, 1), (0, 2)])),
    (r"excluded_pairs\[0\]: \(0, -1\) are no two indices of bodies", lambda s: s.change_excluded_pairs([(0, -1)])),
    (r"excluded_pairs\[0\]: \(0,\) are no two", lambda s: s.change_excluded_pairs([(0,)])),
])
def test_what_does_not_fit_is_refused(anywhere, message, change):
    with anywhere.session(squares(0.5), FACES, bodies=BODIES) as session:
        with pytest.raises(InvalidArgumentError, match=message):
            change(session)
        assert session.options == Options()
        assert len(session.step(squares(-0.5))) > 0, "it is as it was"


def test_what_is_larger_than_a_message_is_sent_in_pieces(start_daemon):
    daemon = start_daemon("--max-message-bytes", "65536")
    n = 120
    x, y = np.meshgrid(np.arange(n + 1.0), np.arange(n + 1.0), indexing="ij")
    sheet = np.stack([x.ravel(), y.ravel(), np.full(x.size, 0.2)], axis=1)
    corner = np.arange(n * n) // n * (n + 1) + np.arange(n * n) % n
    faces = np.stack([corner, corner + n + 1, corner + 1], axis=1)
    with warmfront.connect(daemon.address) as client, client.session(squares(0.5), FACES, bodies=BODIES) as session:
        session.replace_body(1, sheet, faces)
        assert session.info().vertex_count == 4 + len(sheet)
        session.change_filters({"patches": np.ones(4 + len(sheet), np.uint32)})
        session.change_filters(None)
        session.add_body(Body(len(sheet)), faces, sheet + [0, 0, 1])
        session.replace_elements(2, faces[:-1])
        daemon.restart()
        answer = session.step(bodies={1: sheet - [0, 0, 0.5]})
        assert len(answer) > 0 and session.resumes == 1
        assert session.info().face_count == 2 + len(faces) + len(faces) - 1


def test_changes_in_one_are_those_one_after_the_other(anywhere):
    apart, X = squares(0.5), np.array([[2, 2, 0], [3, 2, 0], [2, 3, 0.0]])
    far = np.array([[2, 2, 1], [3, 2, 1], [2, 3, 1], [4, 4, 1.0]])

    def carry_out(change):
        change.replace_elements(0, FACES[:1], edges=[[1, 3]])
        assert change.add_body(Body(3, "rigid"), [[0, 1, 2]], X) == 2
        change.change_filters({"excluded_vertex_pairs": [[0, 10]]})  # a vertex of the new body
        change.change_filters(None)
        change.replace_body(1, far[:3], [[0, 1, 2]])
        change.change_body(2, Body(3, "deformable"))
        change.change_excluded_pairs([(0, 2)])
        change.change_options(Options(min_separation=0.2))

    told = []
    for in_one in (False, True):
        with anywhere.session(apart, FACES, bodies=BODIES) as session:
            session.step(squares(0.4))
            if in_one:
                with session.changes() as change:
                    carry_out(change)
                    assert len(session.trial(squares(-0.5))) > 0, "nothing is changed before the end"
            else:
                carry_out(session)
            assert session.options == Options(min_separation=0.2) and session.last_frame == 1
            down = session.positions - [0, 0, 1]
            down[:4] = session.positions[:4]
            told.append((bits(session.step(down))[1:], session.info().vertex_count, session.info().body_count, session.positions.tobytes()))
    assert told[0] == told[1] and told[0][1:3] == (10, 3)


def test_changes_in_one_survive_the_daemon(daemon, client):
    with client.session(squares(0.5), FACES, bodies=BODIES) as session:
        with session.changes() as change:
            change.replace_elements(1, FACES[:1])
            change.change_options(Options(min_separation=0.3))
            daemon.restart()
        daemon.restart()
        assert len(session.step(squares(0.2))) > 0 and session.resumes >= 1
        assert session.info().face_count == 3 and session.info().options.min_separation == 0.3


def test_changes_in_one_are_all_or_none(anywhere):
    with anywhere.session(squares(0.5), FACES, bodies=BODIES) as session:
        with pytest.raises(InvalidArgumentError, match=r"changes\[1\]: .*faces\[0\]\[2\]: vertex index 9"), session.changes() as change:
            change.replace_elements(0, FACES[:1])
            change.replace_elements(1, [[0, 1, 9]])
            change.change_options(Options(min_separation=0.3))
        with pytest.raises(InvalidArgumentError, match=r"options\.leaf_size: is fixed"), session.changes() as change:
            change.replace_elements(0, FACES[:1])
            change.change_options(Options(leaf_size=4))
        with pytest.raises(ZeroDivisionError), session.changes() as change:
            change.replace_elements(0, FACES[:1])
            1 / 0
        with session.changes():
            pass
        assert session.options == Options() and session.info().face_count == 4
        for go_on in (lambda: session.step(squares(0.4)), lambda: session.change_filters(None)):
            with pytest.raises(FailedPreconditionError, match="has gone on since"), session.changes() as change:
                change.replace_elements(0, FACES[:1])
                go_on()
        session.submit(squares(0.3))
        with pytest.raises(FailedPreconditionError, match="unanswered"), session.changes():
            pass
        session.next_answer()
        assert session.info().face_count == 4 and len(session.step(squares(-0.5))) > 0
        with session.changes() as change:
            change.change_options(Options(report="count"))
        assert session.options == Options(report="count")


def test_not_while_frames_are_on_their_way(anywhere):
    with anywhere.session(squares(0.5), FACES, bodies=BODIES) as session:
        session.submit(squares(-0.5))
        for change in (lambda: session.change_options(Options()), lambda: session.change_excluded_pairs([])):
            with pytest.raises(FailedPreconditionError, match="unanswered"):
                change()
        assert len(session.next_answer()) > 0


def test_an_older_daemon_is_not_asked(tmp_path):
    fake = FakeDaemon(tmp_path)
    try:
        with warmfront.connect(fake.address) as client, client.session(np.zeros((3, 3)), [[0, 1, 2]], bodies=[Body(3)]) as session:
            for change in (lambda: session.change_options(Options()), lambda: session.change_excluded_pairs([])):
                with pytest.raises(UnimplementedError, match="older than changes of options"):
                    change()
    finally:
        fake.stop()
