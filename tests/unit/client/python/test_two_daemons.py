# SPDX-License-Identifier: Apache-2.0
"""A session that moves to another daemon and back: only a copy that is in the session's own state may answer.

The last step of each history is also made by the engine in a process of its own, cold, from the positions before it: its
contacts are the same bits.
"""
import json
import os
import signal
import subprocess
import threading

import numpy as np
import pytest
from conftest import BIN
from support import contacts_hash, eventually, triangle_through_triangle
from switchboard import Switchboard

import warmfront
from warmfront import Body, InvalidArgumentError, ResourceExhaustedError
from warmfront._connection import Connection
from warmfront._resume import Link

# Two bodies that are not tested against each other.
APART = [Body(3), Body(3, mask=2)]


def engine_hash(folder, before, after, faces):
    """`contacts_hash` of the step between two positions, in-process and without a session."""
    paths = []
    for name, positions in (("before", before), ("after", after)):
        paths.append(folder / f"{name}.ply")
        header = ["ply", "format ascii 1.0", f"element vertex {len(positions)}", "property double x", "property double y",
                  "property double z", f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
        rows = [" ".join(repr(float(x)) for x in row) for row in positions]
        paths[-1].write_text("\n".join(header + rows + [f"3 {a} {b} {c}" for a, b, c in faces]) + "\n")
    out = subprocess.run([BIN / "warmfront", "detect", *paths, "--json", "-"], check=True, stdout=subprocess.PIPE).stdout
    return json.loads(out)["contacts_hash"]


def freeze(daemon):
    daemon.send(signal.SIGSTOP)
    os.waitpid(daemon.process.pid, os.WUNTRACED)


@pytest.fixture
def two(start_daemon, tmp_path):
    """Daemons A and B, a switchboard that leads to A, and a client of the switchboard."""
    a, b = start_daemon(), start_daemon("--max-contacts", "2")
    for daemon in (a, b):
        daemon.tcp()  # it serves
    with Switchboard(tmp_path / "board.sock", a) as board, warmfront.connect(board.address) as client:
        yield a, b, board, client


def test_a_copy_that_missed_a_change_is_not_taken_for_the_session(two, tmp_path):
    a, b, board, client = two
    before, after, faces = triangle_through_triangle()
    with client.session(before, faces, bodies=APART) as session:
        assert not session.step(before)
        freeze(a)
        board.lead_to(b)
        session.change_body(1, Body(3))
        a.send(signal.SIGCONT)
        b.kill()
        board.lead_to(a)
        answer = session.step(after)
        assert len(answer) == 3
        assert contacts_hash([answer]) == engine_hash(tmp_path, before, after, faces)


def test_a_copy_that_computed_a_frame_which_the_other_refused_is_not_taken_for_the_session(two, tmp_path):
    a, b, board, client = two
    before, after, faces = triangle_through_triangle()
    with client.session(before, faces) as session, warmfront.connect(a.address) as direct:
        session.step(before)
        board.lose_answers()
        session.submit(after)
        eventually(lambda: direct.get_session(session.id).last_frame == 2)
        board.lead_to(b)
        with pytest.raises(ResourceExhaustedError):
            session.next_answer()
        assert not session.step(before)  # another frame 2
        b.kill()
        board.lead_to(a)
        last = after - [0, 0, 1]
        answer = session.step(last)
        assert len(answer) == 3
        assert contacts_hash([answer]) == engine_hash(tmp_path, before, last, faces)


def test_an_answer_that_was_lost_is_only_taken_for_the_same_frame(two, tmp_path):
    a, _, board, client = two
    before, after, faces = triangle_through_triangle()
    with client.session(before, faces) as session, warmfront.connect(a.address) as direct:
        board.lose_answers()
        session.submit(after)
        eventually(lambda: direct.get_session(session.id).last_frame == 1)
        board.lead_to(a)
        answer = session.next_answer()
        assert contacts_hash([answer]) == engine_hash(tmp_path, before, after, faces)
        assert direct.get_session(session.id).steps == 1 and session.resumes == 1


def test_a_change_whose_answer_is_lost_is_done_once(two):
    a, _, board, client = two
    before, after, faces = triangle_through_triangle()
    with client.session(before, faces, bodies=[Body(3), Body(3)]) as session, warmfront.connect(a.address) as direct:
        assert len(session.step(after)) == 3
        board.lose_answers()
        added = []
        changing = threading.Thread(target=lambda: added.append(session.add_body(Body(3), faces[:1], before[:3] + 5)))
        changing.start()
        eventually(lambda: direct.get_session(session.id).body_count == 3)
        board.lead_to(a)
        changing.join()
        info = direct.get_session(session.id)
        assert added == [2] and info.body_count == 3 and session.resumes == 1
        assert info.steps == 1  # still the copy that carried it out
        assert len(session.step(np.concatenate([before, before[:3] + 5]))) == 3


def test_a_resume_waits_for_room(two, start_daemon):
    _, _, board, client = two
    full = start_daemon("--max-sessions", "1")
    before, after, faces = triangle_through_triangle()
    with warmfront.connect(full.tcp()) as direct, client.session(before, faces) as session:
        other = direct.session(before, faces)
        board.lead_to(full)
        closing = threading.Timer(1, other.close)
        closing.start()
        assert len(session.step(after)) == 3
        closing.join()
    with warmfront.connect(full.tcp()) as direct, direct.session(before, faces):
        with pytest.raises(ResourceExhaustedError):  # who asks for one is told at once
            direct.session(before, faces)


def test_a_daemon_that_states_nothing_of_its_sessions_is_not_trusted_with_a_copy(two, monkeypatch):
    """A daemon too old to report states: its copy is created again at each resume."""
    a, _, board, client = two
    attach, create, change = Link._attach, Connection.create, Connection.change

    def attach_to_older(link):
        attach(link)
        for name in ("state", "state_before"):
            link._attached.ClearField(name)

    def create_at_older(*arguments):
        response = create(*arguments)
        response.session.ClearField("state")
        return response

    def change_at_older(connection, request):
        response = change(connection, request)
        response.ClearField("state")
        return response

    monkeypatch.setattr(Link, "_attach", attach_to_older)
    monkeypatch.setattr(Connection, "create", create_at_older)
    monkeypatch.setattr(Connection, "change", change_at_older)
    before, after, faces = triangle_through_triangle()
    with client.session(before, faces, bodies=[Body(3), Body(3)]) as session, warmfront.connect(a.address) as direct:
        assert len(session.step(after)) == 3 and session.resumes == 0
        board.lead_to(a)
        assert len(session.step(before)) == 3 and session.resumes == 1
        assert direct.get_session(session.id).steps == 1  # made again from frame 1
        session.change_body(1, Body(3, "removed"))
        assert not session.step(after)


def test_a_wrong_change_while_the_daemon_is_away_is_refused(two):
    a, b, board, client = two
    before, after, faces = triangle_through_triangle()
    with client.session(before, faces, bodies=[Body(3), Body(3)]) as session:
        for daemon in (b, a):
            board.lead_to(daemon)
            with pytest.raises(InvalidArgumentError):
                session.add_body(Body(3), [[0, 1, 77]], before[:3])
        assert len(session.step(after)) == 3
