# SPDX-License-Identifier: Apache-2.0
"""Trials and commits when connections end, answers come late and copies forget, against a daemon that does what the test says."""
import itertools
import threading
import time

import pytest
from fake_daemon import motion_hash, part_way
from fake_session import FACES, client, draw, fake, once, sent, session  # noqa: F401 (fixtures)

import warmfront
from warmfront import DeadlineExceededError, UnimplementedError


# Each request of this history, disturbed in each way: the answers are the same.
def history(session):
    dtype = session.positions.dtype
    V = [draw(k, dtype) for k in range(8)]
    told = [session.trial(V[1]).earliest_toi, session.trial(V[2]).earliest_toi, session.commit(0.3),
            session.max_step(V[3]).fraction, session.commit(1), session.step(V[4]).earliest_toi]
    session.submit(V[5], kind="trial")
    session.submit(kind="commit", fraction=0.7)
    session.submit(V[6])
    session.submit(V[7], kind="trial")
    told += [session.next_answer().earliest_toi, session.next_answer(), session.next_answer().earliest_toi,
             session.next_answer().earliest_toi]
    return [*told, session.commit(0.25), session.positions.tobytes(), session.last_frame]


REQUESTS = ["trial 1", "commit 1 0.3", "max_step 2", "commit 2 1", "step 3", "trial 4", "commit 4 0.7", "step 5", "trial 6",
            "commit 6 0.25"]


@pytest.mark.parametrize("words, what", itertools.product(REQUESTS, ["cut", "lose", "forget", "drain"]))
def test_a_history_that_is_disturbed_is_answered_as_one_that_is_not(fake, session, client, words, what):
    with client.session(session.positions, FACES) as calm:
        expected = history(calm)
    fake.disturb = once(words, what)
    assert history(session) == expected
    assert session.resumes == 1


def test_a_trial_is_sent_again_before_its_commit_and_answered_once(fake, session):
    session.trial(draw(1, session.positions.dtype))
    sent(fake)
    fake.disturb = once("commit 1 0.5", "cut")
    session.commit(0.5)
    assert sent(fake) == ["commit 1 0.5", "attach", "trial 1", "commit 1 0.5"]
    session.trial(draw(2, session.positions.dtype))
    sent(fake)
    fake.disturb = once("commit 2 0.5", "lose")  # this copy has carried it out: it is only asked for the answer
    session.commit(0.5)
    assert sent(fake) == ["commit 2 0.5", "attach", "commit 2 0.5"]
    session.trial(draw(3, session.positions.dtype))
    sent(fake)
    fake.disturb = once("commit 3 0.5", "forget")
    session.commit(0.5)
    assert sent(fake)[-4:] == ["create", "attach", "trial 3", "commit 3 0.5"]
    assert fake.copy().at.tobytes() == session.positions.tobytes()


def test_a_trial_that_is_superseded_is_not_sent_again(fake, session):
    session.trial(draw(1, session.positions.dtype))
    session.step(draw(2, session.positions.dtype))
    sent(fake)
    fake.disturb = once("step 2", "forget")
    session.step(draw(3, session.positions.dtype))
    assert [word for word in sent(fake) if "trial" in word] == []


def test_a_trial_that_another_daemon_refuses_is_the_commits_error(fake, session, monkeypatch):
    from fake_daemon import Copy, Refused
    session.trial(draw(1, session.positions.dtype))
    X = session.positions
    ask = Copy.ask

    def refuse(copy, frame, *knows):
        if frame.question.kind == 2:
            raise Refused(8, "more than max-contacts", 8)
        return ask(copy, frame, *knows)
    monkeypatch.setattr(Copy, "ask", refuse)
    fake.disturb = once("commit 1 0.5", "forget")
    with pytest.raises(warmfront.ResourceExhaustedError, match="more than max-contacts"):
        session.commit(0.5)
    assert session.last_frame == 0 and session.positions.tobytes() == X.tobytes()
    assert session.step(X).frame == 1


def test_a_step_within_its_time(fake, session):
    """A question that is not answered in time does not count, even if the daemon had carried it out."""
    X, Y, Z = (draw(k, session.positions.dtype) for k in range(3))
    fake.disturb = once("step 1", "hang")
    began = time.monotonic()
    with pytest.raises(DeadlineExceededError, match="frame 1: no answer within 0.2 s; it does not count"):
        session.step(Y, timeout=0.2)
    assert time.monotonic() - began >= 0.2 and session.last_frame == 0
    assert session.step(Z, timeout=30).earliest_toi == motion_hash(X, Z)
    # All of them: on a busy machine one may come when it is waited for no more, and the next one is asked.
    fake.disturb = lambda came: "hang" if came == "trial 2" else None
    for k in range(8):  # more often than a session may resume without an answer
        with pytest.raises(DeadlineExceededError):
            session.trial(X, timeout=0.05)
    fake.disturb = lambda came: None
    session.trial(Y)
    fake.disturb = once("commit 2 0.5", "hang")
    with pytest.raises(DeadlineExceededError):
        session.commit(0.5, timeout=0.2)
    assert session.positions.tobytes() == Z.tobytes()
    session.commit(0.5)  # the trial stands
    assert session.positions.tobytes() == part_way(Z, Y, 0.5, Z.dtype).tobytes() == fake.copy().at.tobytes()


def test_a_daemon_that_is_away_for_longer_than_the_time(fake, session):
    Y = draw(1, session.positions.dtype)
    fake._server.stop(None).wait()
    with pytest.raises(DeadlineExceededError, match="no answer within 0.5 s"):
        session.step(Y, timeout=0.5)
    with pytest.raises(DeadlineExceededError):  # it is not over for that
        session.step(Y, timeout=0.5)


def test_a_step_that_was_given_up_and_done_all_the_same(fake, session):
    X, Y, Z = (draw(k, session.positions.dtype) for k in range(3))
    done = threading.Event()

    def carry_out_and_hang(words):
        if words == "step 1" and not done.is_set():
            fake.copy().ask(fake_frame(Y), False)
            done.set()
            return "hang"
    fake.disturb = carry_out_and_hang
    with pytest.raises(DeadlineExceededError):
        session.step(Y, timeout=0.3)
    assert done.is_set() and fake.copy().state.frame == 1
    for V in (Z, Y):
        assert session.trial(V).earliest_toi == motion_hash(X, V)
    assert session.step(Z).earliest_toi == motion_hash(X, Z) and session.last_frame == 1


def fake_frame(V):
    from warmfront.v1 import step_pb2
    return step_pb2.StepFrame(frame=1, positions=V.tobytes())


def test_an_older_daemon_is_found_out(fake, session):
    fake.ignores_questions = True
    with pytest.raises(UnimplementedError, match="older than trials, and took the trial for a step"):
        session.trial(draw(1, session.positions.dtype))
    with pytest.raises(UnimplementedError):  # for good: it is not where the session is
        session.step(draw(1, session.positions.dtype))


def test_a_session_that_someone_else_moves(fake, session):
    Y = draw(1, session.positions.dtype)
    session.trial(Y)
    fake.copy().ask(fake_frame(Y), False)
    session.commit(0.5)  # at a copy of its own, which is made again
    assert session.resumes == 1
    assert fake.copy().at.tobytes() == session.positions.tobytes()


def test_a_copy_that_forgot_the_trial_is_made_again(fake, session):
    Y = draw(1, session.positions.dtype)
    session.trial(Y)
    fake.copy().trial = None
    sent(fake)
    session.commit(0.5)
    assert session.resumes == 1 and sent(fake) == ["commit 1 0.5", "create", "attach", "trial 1", "commit 1 0.5"]
    assert fake.copy().at.tobytes() == session.positions.tobytes()
