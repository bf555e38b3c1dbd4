# SPDX-License-Identifier: Apache-2.0
"""An interrupt at every line of the client, one after the other: the session is where it was before the call, or after it, and
goes on from there."""
import dataclasses
import pathlib
import sys
import threading

import numpy as np
import pytest
from support import triangle_through_triangle

import warmfront
from warmfront import Body, Options

BEFORE, AFTER, FACES = triangle_through_triangle()
OURS = str(pathlib.Path(warmfront.__file__).parent)
# What waits for a daemon is gRPC's and the stream's: what they hold is dropped as a whole.
NOT_OURS = ("_connection.py", "_stream.py", "_channels.py", "_resume.py", "_exchange.py", "_background.py")
TURN = np.array([[0, -1, 0, 0.1], [1, 0, 0, 0.2], [0, 0, 1, -0.3]])


class Interrupt(KeyboardInterrupt):
    pass


class At:
    """Raises at the n-th line that is executed."""

    def __init__(self, n):
        self.left = n

    def __enter__(self):
        self.before = sys.gettrace()
        sys.settrace(self.enter)

    def __exit__(self, *_):
        sys.settrace(self.before)

    def enter(self, frame, event, argument):
        name = frame.f_code.co_filename
        return self.line if name.startswith(OURS) and not name.endswith(NOT_OURS) else None

    def line(self, frame, event, argument):
        if event == "line":
            self.left -= 1
            if self.left < 0:
                raise Interrupt
        return self.line


def everything(session):
    """That tells one state from another; the last is an answer about the scene."""
    near = session.proximity(20)
    info = session.info()
    return (session.last_frame, info.last_frame, tuple(session.bodies), [(b, pose.tobytes()) for b, pose in session.poses.items()],
            session.positions.tobytes(), info.vertex_count, info.face_count, info.body_count, session.options.min_separation,
            warmfront.contacts_hash(near))


def both(session):
    with session.changes() as changes:
        changes.add_body(Body(3), [[0, 1, 2]], BEFORE[:3] + 7)
        changes.change_options(Options(min_separation=0.25))


CALLS = {
    "step": lambda s: s.step(bodies={0: BEFORE[:3] + 0.1}, poses={1: TURN}),
    "whole step": lambda s: s.step(AFTER),
    "place": lambda s: s.place(poses={1: TURN}),
    "commit": lambda s: s.commit(0.3),
    "add": lambda s: s.add_body(Body(3), [[0, 1, 2]], BEFORE[:3] + 7),
    "replace": lambda s: s.replace_body(0, np.concatenate([BEFORE[:3]] * 2), [[0, 1, 2], [3, 4, 5]]),
    "elements": lambda s: s.replace_elements(0, np.empty((0, 3), int)),
    "body": lambda s: s.change_body(1, dataclasses.replace(s.bodies[1], kind="removed")),
    "excluded": lambda s: s.change_excluded_pairs([(0, 1)]),
    "options": lambda s: s.change_options(Options(min_separation=0.5)),
    "changes": both,
}


FRAMES = {"step", "whole step", "place", "commit"}


@pytest.mark.parametrize("call", CALLS)
def test_all_of_a_call_happens_or_nothing(anywhere, call):
    if call in FRAMES and isinstance(anywhere, warmfront.Client):
        pytest.skip("an answer of a daemon that is being taken is not taken back")

    def made():
        session = anywhere.session(BEFORE, FACES, bodies=[Body(3), Body(3, "rigid", screw=True)])
        session.place(poses={1: TURN[[1, 0, 2]] * [[1], [1], [-1]]})
        if call == "commit":
            session.trial(bodies={0: BEFORE[:3] + 0.1}, poses={1: np.eye(3, 4)})
        return session

    with made() as session:
        before = everything(session)
    with made() as session:
        CALLS[call](session)
        after = everything(session)
    assert before != after
    seen = set()
    for n in range(10_000):
        with made() as session:
            try:
                with At(n):
                    CALLS[call](session)
            except Interrupt:
                now = everything(session)
                assert now in (before, after), n
                seen.add(now == after)
                continue
        break
    assert seen == {False, True} and n > 20


def test_other_threads_may_look_meanwhile():
    if not warmfront.has_engine():
        pytest.skip("this package has no engine: built without pybind11-dev, or with sanitizers")
    ended = threading.Event()
    with warmfront.Collider(BEFORE, FACES, bodies=[Body(3), Body(3, "rigid")]) as session:
        def look():
            while not ended.is_set():
                session.last_frame, session.positions_dtype, session.info()
        looking = threading.Thread(target=look)
        looking.start()
        try:
            for k in range(1, 2001):
                pose = np.eye(3, 4) + k * np.eye(3, 4, 3)
                session.step(poses={1: pose})
                assert session.last_frame == k and session.poses[1].tobytes() == pose.tobytes()
        finally:
            ended.set()
            looking.join()
