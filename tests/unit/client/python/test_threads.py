# SPDX-License-Identifier: Apache-2.0
"""Sessions of one client in threads of their own, and the wire's walk through bytes that are no message."""
import os
import random
import threading
import time

import numpy as np
import pytest
from support import bits

import warmfront
from warmfront import Options
from warmfront._contacts import AnswerPart, parse_response
from warmfront.v1 import step_pb2


def test_sessions_in_threads_over_a_daemon_that_is_killed(daemon, client, cloth, crowd):
    def play(scene, results, k):
        with client.session(scene.frames[0], scene.faces, bodies=scene.bodies, options=Options(min_separation=0.01)) as session:
            results[k] = [bits(session.step(frame)) for frame in scene.frames[1:]]

    scenes = [cloth, crowd, cloth, crowd]
    alone, together = {}, {}
    for k in range(2):
        play(scenes[k], alone, k)
    threads = [threading.Thread(target=play, args=(scene, together, k)) for k, scene in enumerate(scenes)]
    for thread in threads:
        thread.start()
    daemon.restart()
    for thread in threads:
        thread.join()
    assert [together[k] == alone[k % 2] for k in range(4)] == [True] * 4
    assert client.list_sessions() == []


def test_a_step_is_given_up_by_closing_its_session_from_another_thread(client):
    # A grid whose vertices all move to one place: minutes of work.
    n = 120
    row, column = np.meshgrid(np.arange(n), np.arange(n), indexing="ij")
    corner = (row * n + column)[:-1, :-1].ravel()
    faces = np.concatenate([np.stack([corner, corner + 1, corner + n], 1), np.stack([corner + 1, corner + n + 1, corner + n], 1)])
    start = np.stack([row.ravel(), column.ravel(), np.zeros(n * n)], 1).astype(float)
    session = client.session(start, faces.astype(np.int32), options=Options(report="count"))
    raised = []

    def step():
        try:
            session.step(np.zeros_like(start))
        except warmfront.WarmfrontError as error:
            raised.append(error)

    thread = threading.Thread(target=step)
    thread.start()
    while client.server_info().frames_in_flight == 0:
        time.sleep(0.01)
    session.close()
    thread.join(60)
    assert not thread.is_alive()
    assert isinstance(raised[0], warmfront.FailedPreconditionError) and "closed" in raised[0].message
    deadline = time.monotonic() + 60
    while client.server_info().frames_in_flight > 0 and time.monotonic() < deadline:
        time.sleep(0.01)
    info = client.server_info()
    assert (info.frames_in_flight, info.sessions, info.principal.sessions) == (0, 0, 0)


@pytest.mark.filterwarnings("ignore:Unexpected end-group tag")
def test_bytes_that_are_no_message_are_an_error():
    draw = random.Random(1)
    answer = step_pb2.StepAnswer(frame=7, last=True, summary=step_pb2.StepSummary(vf=1, rows=1))
    answer.contacts.kind, answer.contacts.status, answer.contacts.v, answer.contacts.toi = b"\0", b"\1", bytes(16), bytes(8)
    good = step_pb2.StreamStepsResponse(answer=answer).SerializeToString()
    assert parse_response(good).columns["v"].tolist() == [[0, 0, 0, 0]]
    parsed = 0
    for _ in range(20000):
        message = bytearray(good)
        for _ in range(draw.randint(1, 4)):
            message[draw.randrange(len(message))] = draw.randrange(256)
        if draw.random() < 0.5:
            del message[draw.randint(1, len(message)):]
        try:
            parsed += isinstance(parse_response(bytes(message)), AnswerPart)
        except warmfront.InternalError as error:
            assert "malformed" in error.message
    assert 100 < parsed < 15000
    with pytest.raises(warmfront.InternalError, match="column toi of 7 bytes"):
        parse_response(bytes.fromhex("0a0b1209") + bytes([0x22, 7]) + os.urandom(7))
