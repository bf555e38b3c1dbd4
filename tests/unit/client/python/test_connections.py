# SPDX-License-Identifier: Apache-2.0
"""Many sessions of one client over connections that carry few calls; and answers too large for the buffers between."""
import contextlib
import threading

import numpy as np
import pytest
from support import bits, triangle_through_triangle

import warmfront
from warmfront import Timeouts

# What does not get through is an error in a few seconds, and not in minutes.
SHORT = Timeouts(call=10, create=10, answer=10, resume=20)


def test_a_client_opens_as_many_connections_as_its_sessions_need(start_daemon):
    daemon = start_daemon("--max-streams-per-connection", "2")
    before, after, faces = triangle_through_triangle()
    with warmfront.connect(daemon.address, timeouts=SHORT) as client, contextlib.ExitStack() as stack:
        sessions = []
        for _ in range(7):
            sessions.append(stack.enter_context(client.session(before, faces)))
            assert client.server_info().limits.max_streams == 2
        first = [bits(session.step(after)) for session in sessions]
        assert first == first[:1] * 7
        # They all come back too, though the daemon allows fewer by then.
        daemon._flags[:] = ["--max-streams-per-connection", "1"]
        daemon.restart()
        second = [bits(session.step(before)) for session in sessions]
        assert second == second[:1] * 7
        assert [session.resumes for session in sessions] == [1] * 7


def test_sessions_in_threads_whose_calls_are_more_than_a_connection_carries(start_daemon):
    daemon = start_daemon("--max-streams-per-connection", "1")
    before, after, faces = triangle_through_triangle()
    with warmfront.connect(daemon.address, timeouts=SHORT) as client:
        answers = []

        def play():
            with client.session(before, faces) as session:
                answers.append(bits(session.step(after)))

        threads = [threading.Thread(target=play) for _ in range(6)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert answers == answers[:1] * 6


def test_a_closed_client_says_so(client):
    client.close()
    with pytest.raises(warmfront.FailedPreconditionError, match="the client is closed"):
        client.server_info()


def test_frames_are_taken_while_answers_wait(start_daemon):
    """Answers larger than sockets and windows buffer, from a daemon that stops reading while an answer waits."""
    daemon = start_daemon("--max-queued-bytes", "1", "--write-stall-timeout", "20s")
    side = 200
    x, y = np.meshgrid(np.arange(side, dtype=float), np.arange(side, dtype=float), indexing="ij")
    flat = np.stack([x.ravel(), y.ravel(), 0.1 * np.sin(x + y).ravel()], axis=1)
    corner = (np.arange(side - 1)[:, None] * side + np.arange(side - 1)).ravel()
    grid = np.concatenate([np.stack([corner, corner + 1, corner + side], axis=1),
                           np.stack([corner + 1, corner + side + 1, corner + side], axis=1)])
    faces = np.concatenate([grid, grid + side * side])

    def frame(k):
        return np.concatenate([flat, flat + [0.21, 0.13, 0.4 if k % 2 == 0 else -0.4]])

    with warmfront.connect(daemon.address) as client, client.session(frame(0), faces) as session:
        for k in range(1, session.window + 1):
            session.submit(frame(k))
        counts = [len(session.next_answer()) for _ in range(session.window)]
        assert min(counts) > 50_000 and session.resumes == 0
