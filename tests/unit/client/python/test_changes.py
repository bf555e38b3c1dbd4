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
def test_what_does_not_fit_is_refused(client, message, change):
    with client.session(squares(0.5), FACES, bodies=BODIES) as session:
        with pytest.raises(InvalidArgumentError, match=message):
            change(session)
        assert session.options == Options()
        assert len(session.step(squares(-0.5))) > 0, "it is as it was"


def test_not_while_frames_are_on_their_way(client):
    with client.session(squares(0.5), FACES, bodies=BODIES) as session:
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
