# SPDX-License-Identifier: Apache-2.0
"""Memory shared with the daemon: the same bits as without, and answers that nobody changes while they are held."""
import gc
import time
import warnings

import numpy as np
import pytest

import warmfront
from support import bits
from warmfront._frame import VERTEX_POSITIONS, VERTICES, SentFrame
from warmfront._memory import SharedRegion, room_of
from warmfront.v1 import step_pb2

OPTIONS = warmfront.Options(fields=["weights", "normal", "points"])


def waves(frame, side=40):
    """Two sheets that pass through each other: more contacts a step than the room that there is at first."""
    x, y = np.meshgrid(np.arange(side, dtype=float), np.arange(side, dtype=float))
    height = 0.1 * np.sin(0.7 * x + 1.1 * y + 0.3 * frame)
    shift = (0.4 if frame % 2 == 0 else -0.4) + 0.1 * np.cos(0.9 * frame)
    return np.concatenate([np.stack([x, y, height], -1).reshape(-1, 3),
                           np.stack([x + 0.21, y + 0.13, height + shift], -1).reshape(-1, 3)])


def sheet_faces(side=40):
    v = np.arange(side * side).reshape(side, side)
    a, b, c, d = v[:-1, :-1].ravel(), v[:-1, 1:].ravel(), v[1:, :-1].ravel(), v[1:, 1:].ravel()
    one = np.concatenate([np.stack([a, b, c], -1), np.stack([b, d, c], -1)])
    return np.concatenate([one, one + side * side])


@pytest.fixture
def both(daemon):
    """A session with shared memory and one without."""
    with warmfront.connect(daemon.address) as shares, warmfront.connect(daemon.address, shared_memory=False) as streams:
        made = [client.session(waves(0), sheet_faces(), options=OPTIONS) for client in (shares, streams)]
        assert made[0].shares_memory and not made[1].shares_memory
        yield made


def test_a_closed_client_sends_nothing_more(daemon, monkeypatch):
    """Packets went on until the daemon knew of the close: here it never does."""
    client = warmfront.connect(daemon.address)
    session = client.session(waves(0), sheet_faces(), options=OPTIONS)
    session.step(waves(1))
    assert session.shares_memory
    for channel in client._connection._channels._channels:
        monkeypatch.setattr(channel.channel, "close", lambda: None)
    client.close()
    with pytest.raises(warmfront.FailedPreconditionError, match="the client is closed"):
        session.step(waves(2))


def test_every_question_has_the_same_answer(both):
    for frame in range(1, 6):
        steps = [session.step(waves(frame)) for session in both]
        assert len(steps[0]) > 1000
        assert bits(steps[0]) == bits(steps[1])
        trials = [session.trial(waves(frame + 1)) for session in both]
        assert bits(trials[0]) == bits(trials[1])
        near = [session.proximity(0.3, reduced=True) for session in both]
        assert bits(near[0]) == bits(near[1])
        distances = [session.vertex_distances(0.3).distances for session in both]
        assert np.array_equal(*distances)
        tangles = [session.intersections() for session in both]
        assert np.array_equal(tangles[0].edges, tangles[1].edges) and np.array_equal(tangles[0].faces, tangles[1].faces)
        far = [session.max_step(waves(frame + 1)).fraction for session in both]
        assert far[0] == far[1]


def test_what_moved_has_the_same_answer(daemon):
    """A cloth by its positions or its vertices, and a body by its pose."""
    half = len(waves(0)) // 2
    bodies = [warmfront.Body(half, kind="rigid"), warmfront.Body(half)]
    with warmfront.connect(daemon.address) as shares, warmfront.connect(daemon.address, shared_memory=False) as streams:
        sessions = [client.session(waves(0), sheet_faces(), bodies=bodies, options=OPTIONS) for client in (shares, streams)]
        assert sessions[0].shares_memory
        for frame in range(1, 7):
            if frame == 5:
                daemon.restart()
            pose = np.eye(3, 4)
            pose[0, 3] = 0.01 * frame
            above = waves(frame)[half:]
            moved = {"bodies": {1: above}} if frame % 2 else {"vertices": np.arange(half, 2 * half), "vertex_positions": above}
            answers = [session.trial(poses={0: pose}, **moved) for session in sessions]
            assert bits(answers[0]) == bits(answers[1]) and len(answers[0]) > 100
            answers = [session.step(poses={0: pose}, **moved) for session in sessions]
            assert bits(answers[0]) == bits(answers[1])
        assert sessions[0].resumes == 1
        for session in sessions:
            session.close()


def test_what_moved_is_in_the_memory_where_it_is_worth_it(tmp_path):
    with open(tmp_path / "memory", "w+b") as file:
        file.truncate(1 << 20)
        region = SharedRegion(file.fileno(), 1 << 20)
    vertices, positions = np.arange(9000, dtype="<u4").tobytes(), np.random.default_rng(1).random(27000).tobytes()
    frame = SentFrame(7, None, [(VERTICES, vertices), (VERTEX_POSITIONS, positions)], 50_000)
    assert len(frame.messages) > 4, "cut into messages, for a daemon that does not see the memory"
    assert frame.to_send(region, 64, False) == frame.messages == frame.to_send(None, 64, True)
    message, = frame.to_send(region, 64, True)
    step = step_pb2.StreamStepsRequest.FromString(message).step
    assert len(message) < 100 and step.frame == 7 and not step.HasField("moved") and step.HasField("answer_room")
    memory = np.frombuffer(region._map, np.uint8)
    for place, expected in ((step.shared_moved.vertices, vertices), (step.shared_moved.vertex_positions, positions)):
        assert memory[place.offset:place.offset + place.length].tobytes() == expected
    few = SentFrame(8, None, [(VERTICES, vertices[:40]), (VERTEX_POSITIONS, positions[:240])], 50_000)
    assert not step_pb2.StreamStepsRequest.FromString(few.to_send(region, 64, True)[0]).step.HasField("shared_moved")


def test_a_closed_session_has_closed_its_socket(daemon):
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always", ResourceWarning)
        with warmfront.connect(daemon.address) as client:
            with client.session(waves(0), sheet_faces(), options=OPTIONS) as session:
                assert session.shares_memory
                session.step(waves(1))
            del session
        del client
        gc.collect()
    assert [str(one.message) for one in warned] == []


def test_an_answer_stays_as_it_is(both):
    """However many are held, and whatever is asked meanwhile: the memory of none is used again."""
    held = [both[0].step(waves(frame)) for frame in range(1, 13)]
    expected = [both[1].step(waves(frame)) for frame in range(1, 13)]
    assert [bits(one) for one in held] == [bits(one) for one in expected]
    in_memory = [one for one in held if one.toi.base is not None and one.toi.base.base is not None]
    assert in_memory, "some are views into it"
    for one in in_memory:
        with pytest.raises(ValueError):
            one.toi[0] = 0
    part = held[5].v[3:9]
    copy = part.copy()
    del held, in_memory
    gc.collect()
    for frame in range(13, 40):
        both[0].step(waves(frame))
    assert np.array_equal(part, copy), "a slice of it keeps it"


def test_answers_outlive_session_and_daemon(daemon):
    with warmfront.connect(daemon.address) as client:
        session = client.session(waves(0), sheet_faces(), options=OPTIONS)
        for frame in range(1, 4):
            answer = session.step(waves(frame))
        before = bits(answer)
        session.close()
    daemon.kill()
    assert bits(answer) == before


def test_goes_on_after_the_daemon_dies(daemon, both):
    for frame in range(1, 7):
        if frame in (3, 5):
            daemon.restart()
        answers = [session.step(waves(frame)) for session in both]
        assert bits(answers[0]) == bits(answers[1])
        assert both[0].shares_memory
    assert both[0].resumes == 2


def test_a_daemon_may_be_told_not_to(start_daemon):
    with warmfront.connect(start_daemon("--no-shared-memory").address) as client:
        session = client.session(waves(0), sheet_faces())
        assert not session.shares_memory
        assert len(session.step(waves(1))) > 0


@pytest.mark.parametrize("microseconds", ["0", "100000"])
def test_however_long_a_daemon_waits_awake(start_daemon, microseconds):
    daemon = start_daemon("--spin-microseconds", microseconds)
    with warmfront.connect(daemon.address) as shares, warmfront.connect(daemon.address, shared_memory=False) as streams:
        sessions = [client.session(waves(0), sheet_faces(), options=OPTIONS) for client in (shares, streams)]
        assert sessions[0].shares_memory
        for frame in range(1, 5):
            answers = [session.step(waves(frame)) for session in sessions]
            assert bits(answers[0]) == bits(answers[1])
            time.sleep(0.15 * (frame % 2))  # asleep after that long at the latest


def test_not_over_tcp(daemon):
    with warmfront.connect(daemon.tcp()) as client:
        session = client.session(waves(0), sheet_faces())
        assert not session.shares_memory
        assert len(session.step(waves(1))) > 0


def test_where_the_daemon_refuses_it_all_goes_by_the_stream(start_daemon):
    with warmfront.connect(start_daemon("--max-session-bytes", "12MiB").address) as client:
        session = client.session(waves(0), sheet_faces())
        for frame in range(1, 4):
            assert len(session.step(waves(frame))) > 0


def test_blocks_are_used_again_when_nothing_refers_to_them(tmp_path):
    with open(tmp_path / "memory", "w+b") as file:
        file.truncate(4096)
        region = SharedRegion(file.fileno(), 4096)
    one, two = region.take(1000), region.take(2000)
    assert (one.offset, two.offset) == (0, room_of(1000))
    assert region.take(4096) is None
    view = memoryview(one.data[10:20].view("u1"))
    del one
    assert region.take(1000).offset != 0, "a view keeps it"
    del view
    gc.collect()
    assert region.take(1000).offset == 0
