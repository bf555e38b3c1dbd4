# SPDX-License-Identifier: Apache-2.0
"""Exactly one answer to each frame, of the same bits, also when the daemon dies."""
import os
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
from support import bits, eventually, triangle_through_triangle
from test_frames import turned

import warmfront
from warmfront import (Body, DeadlineExceededError, FailedPreconditionError, NotFoundError, Options, Timeouts,
                       UnavailableError)


def run(client, scene, act=lambda k, session: None, window=1):
    """All frames of the scene; act(k, session) after frame k was sent."""
    answers = []
    with client.session(scene.frames[0], scene.faces, bodies=scene.bodies, options=Options(min_separation=0.01)) as session:
        for k, frame in enumerate(scene.frames[1:], 1):
            session.submit(frame)
            act(k, session)
            if k >= window:
                answers.append(session.next_answer())
        for _ in range(window - 1):
            answers.append(session.next_answer())
        return [bits(answer) for answer in answers], session.resumes


@pytest.fixture
def undisturbed(client, cloth):
    answers, resumes = run(client, cloth)
    assert resumes == 0 and len(answers) == len(cloth.frames) - 1
    return answers


@pytest.mark.parametrize("window", [1, 4])
def test_a_daemon_killed_under_the_session(daemon, client, cloth, undisturbed, window):
    answers, resumes = run(client, cloth, lambda k, _: daemon.restart() if k in (7, 8, 30) else None, window)
    assert answers == undisturbed
    # Where frames are in flight, or an answer was on its way already, the kills after 7 and 8 are noticed as one.
    assert resumes >= 2


def test_a_daemon_that_drains_and_comes_back(daemon, client, cloth, undisturbed):
    def drain(k, _):
        if k == 20:
            daemon.send(signal.SIGTERM)
            assert daemon.process.wait(30) == 0
            daemon.start()
    answers, resumes = run(client, cloth, drain, window=4)
    assert answers == undisturbed
    assert resumes >= 1


def test_a_drain_that_is_shorter_than_a_step(start_daemon):
    """The daemon gives up what it computes for longer than it has, and the client sends it to the next one."""
    draw = np.random.default_rng(3)
    triangles = 3000  # for a step of half a second and more on a machine that does nothing else
    after = draw.uniform(0, 1, (3 * triangles, 3))
    before = after + np.repeat(np.arange(triangles), 3)[:, None] * 3.0
    daemon = start_daemon("--drain-timeout", "400ms")
    with warmfront.connect(daemon.address) as client, \
            client.session(before, np.arange(3 * triangles).reshape(-1, 3), options=Options(report="count")) as session:
        session.submit(after)
        eventually(lambda: client.server_info().frames_in_flight == 1)
        daemon.send(signal.SIGTERM)
        # On a busy machine the refusal may not be delivered in the tenth of a second that is left for it: 2 then.
        assert daemon.process.wait(30) in (0, 2)
        daemon.start()
        assert session.next_answer().vf > 1000
        assert session.resumes >= 1 and session.last_frame == 1


def test_a_session_that_someone_deletes(client, cloth, undisturbed):
    answers, resumes = run(client, cloth, lambda k, session: client.delete_session(session.id) if k == 20 else None)
    assert answers == undisturbed
    assert resumes == 1


def test_another_daemon_at_the_same_address_with_smaller_messages(start_daemon, cloth, tmp_path):
    first = start_daemon()
    with warmfront.connect(first.address) as client:
        undisturbed, _ = run(client, cloth)

        def replace(k, _):
            if k == 20:
                first._flags += ["--max-message-bytes", "64KiB", "--answer-chunk-bytes", "2KiB"]
                first.restart()
        answers, resumes = run(client, cloth, replace, window=4)
    assert answers == undisturbed and resumes >= 1


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_poses_additions_and_changes_come_again(daemon, client, crowd, dtype):
    """A session that is created again is in the state that every kind of frame and change leaves."""
    before, _, faces = triangle_through_triangle(dtype)

    def play(disturb):
        rest = crowd.frames[0].astype(dtype)
        answers = []
        with client.session(rest, crowd.faces, bodies=crowd.bodies, options=Options(min_separation=0.05)) as session:
            rigid = [b for b, body in enumerate(crowd.bodies) if body.kind == "rigid"]
            first = sum(body.vertex_count for body in crowd.bodies)
            step = lambda **frame: answers.append(session.step(**frame))
            for k in range(1, 4):
                step(poses={b: turned(0.1 * k, [0.03 * k * np.cos(b), 0.03 * k * np.sin(b), 0]) for b in rigid[:k]})
                disturb()
            added = session.add_body(Body(6, name="two"), faces, before)
            disturb()
            step(vertices=[first + 4, first + 1], vertex_positions=before[[4, 1]] - dtype(0.1))
            disturb()
            session.change_body(added, Body(6, "rigid"))
            disturb()
            step(poses={added: turned(0.5, [0.1, 0, -0.2]), rigid[0]: turned(0.4, [0, 0.05, 0])})
            disturb()
            if dtype is np.float64:  # in float32 its vertices are not known
                session.change_body(added, Body(6))
                disturb()
            step(bodies={added: before + dtype(0.05)})
            disturb()
            session.change_body(rigid[1], Body(1, "removed"))
            disturb()
            step(poses={b: turned(0.2, [0, 0, 0]) for b in rigid if b != rigid[1]})
            return [bits(answer) for answer in answers], session.resumes

    undisturbed, none = play(lambda: None)
    answers, resumes = play(daemon.restart)
    assert answers == undisturbed
    assert none == 0 and resumes >= 8
    assert sum(answer[1] + answer[2] for answer in answers) > 0


def test_a_change_whose_daemon_is_lost_is_made(daemon, client):
    before, after, faces = triangle_through_triangle()
    with client.session(before, faces, bodies=[Body(3), Body(3)]) as session:
        daemon.restart()
        session.change_body(1, Body(3, "removed"))
        assert session.resumes >= 1
        assert not session.step(after)


def test_a_daemon_that_hangs_is_given_up_in_time(daemon):
    before, after, faces = triangle_through_triangle()
    with warmfront.connect(daemon.address, timeouts=Timeouts(call=2, answer=0.5, resume=20)) as client:
        with client.session(before, faces) as session:
            daemon.send(signal.SIGSTOP)
            os.waitpid(daemon.process.pid, os.WUNTRACED)  # it has stopped
            session.submit(after)
            waker = threading.Timer(1.5, daemon.send, [signal.SIGCONT])
            waker.start()
            started = time.monotonic()
            assert len(session.next_answer()) == 3
            assert session.resumes >= 1 and time.monotonic() - started >= 0.5
            waker.join()
            assert len(session.step(before)) == 3


def test_waiting_may_be_interrupted(daemon, client):
    def interrupt(*_):
        raise KeyboardInterrupt

    before, after, faces = triangle_through_triangle()
    with client.session(before, faces) as session:
        daemon.send(signal.SIGSTOP)
        os.waitpid(daemon.process.pid, os.WUNTRACED)
        session.submit(after)
        old = signal.signal(signal.SIGALRM, interrupt)
        try:
            signal.setitimer(signal.ITIMER_REAL, 0.3)
            with pytest.raises(KeyboardInterrupt):
                session.next_answer()
        finally:
            signal.signal(signal.SIGALRM, old)
        daemon.send(signal.SIGCONT)
        contacts = session.next_answer()
        assert contacts.frame == 1 and len(contacts) == 3 and len(session.step(before)) == 3


def test_nothing_is_told_of_the_trial_before_one_that_was_given_up(daemon, client):
    before, after, faces = triangle_through_triangle()
    with client.session(before, faces) as session:
        assert session.trial(after) and session.proximity(2, where="trial_end")
        daemon.send(signal.SIGSTOP)
        os.waitpid(daemon.process.pid, os.WUNTRACED)
        with pytest.raises(DeadlineExceededError):
            session.trial(before, timeout=0.3)
        daemon.send(signal.SIGCONT)
        with pytest.raises(FailedPreconditionError, match="proximity: there is no trial"):
            session.proximity(2, where="trial_end")
        with pytest.raises(FailedPreconditionError, match="commit: there is no trial"):
            session.commit()
        assert session.trial(after) and session.proximity(2, where="trial_end") and session.commit().vf == 1


@pytest.mark.parametrize("seconds", [0.5, 4.5])
def test_a_timeout_says_that_no_daemon_is_there(daemon, seconds):
    before, after, faces = triangle_through_triangle()
    with warmfront.connect(daemon.address) as client:
        session = client.session(before, faces)
        daemon.kill()
        with pytest.raises(DeadlineExceededError, match=f"frame 1: no answer within {seconds} s; .*no Warmfront daemon answers"):
            session.step(after, timeout=seconds)
        daemon.start()
        assert len(session.step(after)) == 3


def test_no_daemon_within_the_resume_timeout(daemon):
    before, after, faces = triangle_through_triangle()
    with warmfront.connect(daemon.address, timeouts=Timeouts(resume=2)) as client:
        session = client.session(before, faces)
        daemon.kill()
        with pytest.raises(UnavailableError, match="could not be resumed within the resume timeout of 2 s: "):
            session.step(after)
        with pytest.raises(ConnectionError):  # for good, and as Python's own
            session.step(after)


# Found by a user: it waited for as long as an upload may take.
def test_no_daemon_for_a_new_session(daemon):
    before, _, faces = triangle_through_triangle()
    with warmfront.connect(daemon.address, timeouts=Timeouts(call=1, create=3600, resume=1)) as client:
        daemon.kill()
        with pytest.raises(UnavailableError, match="could not be made within the resume timeout of 1 s: .*no Warmfront daemon answers"):
            client.session(before, faces)
        daemon.start()
        client.session(before, faces).close()


def test_what_was_lost_and_found_is_logged(daemon, caplog):
    before, after, faces = triangle_through_triangle()
    with warmfront.connect(daemon.address) as client:
        session = client.session(before, faces)
        daemon.kill()
        daemon.start()
        assert len(session.step(after)) == 3
        said = [record.getMessage() for record in caplog.records if record.name == "warmfront"]
        assert len(said) == 2, said
        assert said[0].startswith(f"session {session.id}: the daemon is lost (") and said[0].endswith("looking for it for up to 60 s")
        assert said[1] == f"session {session.id} goes on after frame 0"


def test_a_daemon_with_lower_limits_ends_the_session_and_says_so(start_daemon):
    before, after, faces = triangle_through_triangle()
    daemon = start_daemon()
    with warmfront.connect(daemon.address) as client:
        session = client.session(before, faces)
        daemon._flags += ["--max-vertices", "3"]
        daemon.restart()
        with pytest.raises(warmfront.ResourceExhaustedError, match="could not be resumed: vertex_count: 6 .* it has ended") as error:
            session.step(after)
        assert error.value.limit == "max-vertices"


def test_a_frame_that_ends_every_daemon_is_not_sent_forever(daemon):
    before, after, faces = triangle_through_triangle()
    with warmfront.connect(daemon.address, timeouts=Timeouts(resumes_without_answer=2)) as client:
        session = client.session(before, faces)
        # In place of a frame that kills: a stream that loses its daemon at each write of one.
        send, sent = session._exchange.send, []

        def kill_and_send():
            sent.append(session._link.resumes)
            daemon.restart()
            send()
        session._exchange.send = kill_and_send
        with pytest.raises(UnavailableError, match="gave up after 2 resumes without an answer to frame 1"):
            session.step(after)
        assert max(sent) == 2


def test_a_session_is_gone_when_it_is_closed(client, cloth):
    with client.session(cloth.frames[0], cloth.faces) as session:
        session.step(cloth.frames[1])
    with pytest.raises(NotFoundError):
        client.get_session(session.id)
    session.close()  # again: nothing


def test_a_session_that_was_not_closed_says_so(client, cloth):
    session = client.session(cloth.frames[0], cloth.faces)
    with pytest.warns(ResourceWarning, match=session.id):
        del session


def test_a_user_who_configured_nothing_sees_that_a_session_was_not_closed(daemon):
    """Python hides ResourceWarnings by default; at the program's end too."""
    program = f"""
import numpy as np, warmfront
positions = np.eye(3)
def lose():
    lost = warmfront.connect({daemon.address!r}).session(positions, [[0, 1, 2]])
    print(lost.id)
lose()
left = warmfront.connect({daemon.address!r}).session(positions, [[0, 1, 2]])
print(left.id)
"""
    done = subprocess.run([sys.executable, "-c", program], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, check=True)
    for session_id in done.stdout.split():
        assert f"session {session_id} was not closed" in done.stderr
    assert len(done.stdout.split()) == 2
