# SPDX-License-Identifier: Apache-2.0
"""Trials and commits as the client tracks them, against a daemon that does what the test says: what is sent, in
which order, what is sent again, and where the session is."""
import asyncio
import concurrent.futures
import threading
import time

import numpy as np
import pytest
from fake_daemon import motion_hash, part_way
from fake_session import FACES, client, draw, fake, once, sent, session  # noqa: F401 (fixtures)

import warmfront
from warmfront import Committed, FailedPreconditionError, InvalidArgumentError, UnimplementedError


def test_a_trial_leaves_the_session_where_it_is(fake, session):
    X, Y, Z = (draw(k, session.positions.dtype) for k in range(3))
    for V in (Y, Z, Y):
        answer = session.trial(V)
        assert (answer.frame, answer.earliest_toi) == (1, motion_hash(X, V))
        assert session.last_frame == 0 and (session.positions == X).all()
    assert session.step(Z).earliest_toi == motion_hash(X, Z)
    assert session.trial(Y).frame == 2
    assert sent(fake) == ["create", "attach", "trial 1", "trial 1", "trial 1", "step 1", "trial 2"]


@pytest.mark.parametrize("fraction", [0, 1e-300, 0.1, 1 / 3, 0.5, 0.9, 1 - 2**-53, 1])
def test_a_commit_takes_the_last_trial_up_to_its_fraction(fake, session, fraction):
    X, Y = session.positions, draw(2, session.positions.dtype)
    session.trial(draw(1, X.dtype))
    session.trial(Y)
    taken = session.commit(fraction)
    assert isinstance(taken, Committed) and (taken.frame, taken.fraction) == (1, fraction) and session.last_frame == 1
    expected = part_way(X, Y, fraction, X.dtype)
    assert session.positions.tobytes() == fake.copy().at.tobytes() == expected.tobytes()
    told = motion_hash(X, Y)  # by what the trial told, which listed nothing but has an earliest time
    assert taken.earliest_toi == (told if told <= fraction else None) and (taken.vf, taken.ee, taken.possible) == (0, 0, 0)
    if fraction == 1:
        assert session.positions.tobytes() == Y.tobytes()
    if fraction == 0:
        assert session.positions.tobytes() == X.tobytes()
    assert session.step(X).earliest_toi == motion_hash(expected, X)


def test_max_step_is_a_trial(fake, session):
    X, Y = session.positions, draw(1, session.positions.dtype)
    answer = session.max_step(Y)
    assert answer.fraction == float(answer) == motion_hash(X, Y) and answer.first is None and answer.overlaps_at_start == 0
    assert session.max_step(Y, leave_out_overlaps=True).overlaps_at_start == 7
    assert session.commit(answer.fraction).frame == 1
    assert sent(fake)[2:] == ["max_step 1", "max_step 1", f"commit 1 {answer.fraction:g}"]


@pytest.mark.parametrize("prepare", [
    lambda session, V: None, lambda session, V: session.step(V), lambda session, V: (session.trial(V), session.commit()),
    lambda session, V: (session.trial(V), session.step(V)),
    lambda session, V: (session.trial(V), failing(lambda: session.trial(V * np.inf))),
    lambda session, V: (session.trial(V), failing(lambda: session.step(V * np.inf))),
], ids=["nothing", "step", "commit", "step after it", "failed trial", "failed step"])
def test_a_commit_without_a_trial(fake, session, prepare):
    prepare(session, draw(1, session.positions.dtype))
    before, came = session.last_frame, len(fake.received)
    for call in (session.commit, lambda: session.submit(kind="commit")):
        with pytest.raises(FailedPreconditionError, match="no trial to take since the last step, place, commit, failure or change"):
            call()
    assert session.last_frame == before and len(fake.received) == came


def failing(call):
    with pytest.raises(InvalidArgumentError, match="is not a number"), np.errstate(invalid="ignore"):
        call()


@pytest.mark.parametrize("fraction, message", [(-1e-9, "-1e-09 is not in"), (1.5, "1.5 is not in"), (np.nan, "nan is not in"),
                                               ("half", "'half' is no number"), (None, "None is no number")])
def test_a_fraction_is_a_number_up_to_1(session, fraction, message):
    session.trial(draw(1, session.positions.dtype))
    for call in (session.commit, lambda f: session.submit(kind="commit", fraction=f)):
        with pytest.raises(InvalidArgumentError, match="fraction: " + message):
            call(fraction)
    session.commit(1)  # the trial still stands


@pytest.mark.parametrize("message, call", [
    ("tier: 'sure' is none of fast, certified, exact", lambda s, V: s.trial(V, tier="sure")),
    ("report: 'nearest' is none of", lambda s, V: s.step(V, report="nearest")),
    ("fields: 'depth' is none of weights, normal, points", lambda s, V: s.trial(V, fields=["depth"])),
    ("tolerance: 'small' is not a number", lambda s, V: s.max_step(V, tolerance="small")),
    ("max_contacts: -1 is not a number", lambda s, V: s.trial(V, max_contacts=-1)),
    ("kind: 'look' is none of step, trial, max_step, commit", lambda s, V: s.submit(V, kind="look")),
    ("max_step: it tells the first contact alone", lambda s, V: s.submit(V, kind="max_step", report="all")),
    ("max_step: it tells the first contact alone", lambda s, V: s.submit(V, kind="max_step", fields=[])),
    ("leave_out_overlaps: it is of max_step alone, and not of a trial", lambda s, V: s.submit(V, kind="trial", leave_out_overlaps=True)),
    ("keep_distance: it is of max_step alone, and not of a step", lambda s, V: s.submit(V, keep_distance=0.5)),
    ("keep_distance: 0.0 is not in", lambda s, V: s.max_step(V, keep_distance=0)),
    ("keep_distance: 1.0 is not in", lambda s, V: s.max_step(V, keep_distance=1)),
    ("keep_distance: nan is not in", lambda s, V: s.max_step(V, keep_distance=np.nan)),
    ("keep_distance: 'half' is no number", lambda s, V: s.submit(V, kind="max_step", keep_distance="half")),
    ("commit: it takes the last trial as it is", lambda s, V: s.submit(kind="commit", keep_distance=0.5)),
    ("commit: it takes the last trial as it is", lambda s, V: s.submit(V, kind="commit")),
    ("commit: it takes the last trial as it is", lambda s, V: s.submit(kind="commit", tier="fast")),
    ("frame 1: positions: shape", lambda s, V: s.trial(V[:2])),
    ("timeout: 0 seconds; give a positive time", lambda s, V: s.trial(V, timeout=0)),
    ("timeout: -1 seconds; give a positive time", lambda s, V: s.commit(timeout=-1)),
])
def test_a_wrong_call_sends_nothing(fake, session, message, call):
    V = draw(1, session.positions.dtype)
    session.trial(V)
    came = len(fake.received)
    with pytest.raises(InvalidArgumentError, match="^" + message):
        call(session, V)
    assert len(fake.received) == came
    if message.startswith("frame"):  # as after any question that fails
        with pytest.raises(FailedPreconditionError):
            session.commit(0.5)
        session.trial(V)
    session.commit(0.5)


def test_options_of_one_question_travel_with_it(fake, client):
    questions = []
    steps = fake._words
    fake._words = lambda request: questions.append(request) or steps(request)
    with client.session(draw(0), FACES, options=warmfront.Options(fields=["normal"])) as session:
        assert session.trial(draw(1), tier="exact", tolerance=1e-3, report="count", max_contacts=5).normal is not None
        answer = session.step(draw(1), min_separation=0.25, fields=["weights"])
        assert answer.normal is None and answer.weights.shape == (0, 4)
        assert session.trial(draw(2), fields=[]).normal is None
        session.max_step(draw(2), leave_out_overlaps=True, keep_distance=0.25)
        session.step(draw(2))
    first, second, third, fourth, fifth = (q.step.question for q in questions[1:])
    assert (first.kind, first.tier, first.tolerance, first.report, first.max_contacts) == (2, 3, 1e-3, 3, 5)
    assert not first.HasField("fields") and not first.HasField("min_separation")
    assert (second.kind, second.min_separation, second.fields.weights, second.fields.normal) == (1, 0.25, True, False)
    assert third.HasField("fields") and fourth.kind == 3 and fourth.leave_out_overlaps
    assert fourth.keep_distance == 0.25 and not first.HasField("keep_distance")
    assert not questions[-1].step.HasField("question")  # what daemons took before there were questions


def test_a_daemon_that_is_older_than_keep_distance_is_found_out(fake, client):
    fake.keeps_distances = False
    with client.session(draw(0), FACES) as session:
        with pytest.raises(UnimplementedError, match="keep_distance: the daemon is older"):
            session.max_step(draw(1), keep_distance=0.5)
        session.max_step(draw(1))
        session.commit(0.5)


def test_questions_in_flight_are_answered_in_order(fake, session):
    X, Y, Z = (draw(k, session.positions.dtype) for k in range(3))
    numbers = [session.submit(Y, kind="trial"), session.submit(kind="commit", fraction=0.5), session.submit(Z, kind="max_step"),
               session.submit(Z)]
    assert numbers == [1, 1, 2, 2]
    with pytest.raises(FailedPreconditionError, match="4 frames are unanswered"):
        session.submit(Z)
    with pytest.raises(FailedPreconditionError, match="take their answers before a single step"):
        session.trial(Z)
    middle = part_way(X, Y, 0.5, X.dtype)
    assert session.next_answer().earliest_toi == motion_hash(X, Y)
    assert session.next_answer().frame == 1 and session.positions.tobytes() == middle.tobytes()
    assert session.next_answer().fraction == motion_hash(middle, Z)
    assert session.next_answer().earliest_toi == motion_hash(middle, Z)
    assert session.last_frame == 2


def test_what_follows_a_failed_trial_stands_and_what_follows_a_failed_commit_does_not(session):
    Y = draw(1, session.positions.dtype)
    bad = np.full_like(Y, np.nan)
    session.submit(bad, kind="trial")
    session.submit(Y)
    failing(session.next_answer)
    assert session.next_answer().frame == 1
    assert [session.submit(bad, kind="trial"), session.submit(kind="commit"), session.submit(Y)] == [2, 2, 3]
    failing(session.next_answer)
    with pytest.raises(FailedPreconditionError, match="no trial was answered"):
        session.next_answer()
    with pytest.raises(FailedPreconditionError, match="take their answers before sending more"):
        session.submit(Y)
    with pytest.raises(FailedPreconditionError, match="frame 3: 2 is expected"):
        session.next_answer()
    assert session.step(Y).frame == 2


def test_futures_have_their_turn(session):
    X, Y, Z = (draw(k, session.positions.dtype) for k in range(3))
    futures = [session.submit_trial(Y), session.submit_max_step(Y), session.submit_commit(0.5), session.submit_step(Z)]
    concurrent.futures.wait(futures)
    middle = part_way(X, Y, 0.5, X.dtype)
    assert futures[0].result().earliest_toi == futures[1].result().fraction == motion_hash(X, Y)
    assert futures[2].result().frame == 1 and futures[3].result().earliest_toi == motion_hash(middle, Z)
    with pytest.raises(InvalidArgumentError, match="shape"):
        session.submit_trial(Z[:1]).result()
    results = []
    threads = [threading.Thread(target=lambda: results.append(session.trial(Y).earliest_toi)) for _ in range(4)]
    for thread in threads:
        thread.start()
    results.append(session.submit_trial(Y).result().earliest_toi)
    for thread in threads:
        thread.join()
    assert results == [motion_hash(Z, Y)] * 5


def test_asyncio(client):
    async def line_search(k):
        with client.session(draw(0), FACES) as session:
            assert (await session.trial_async(draw(k), tier="exact")).frame == 1
            far = await session.max_step_async(draw(k), leave_out_overlaps=True)
            taken = await session.commit_async(far.fraction)
            assert (await session.step_async(draw(1))).frame == 2
            return taken.fraction

    async def all_of_them():
        return await asyncio.gather(*(line_search(k) for k in range(1, 5)))

    assert asyncio.run(all_of_them()) == [motion_hash(draw(0), draw(k)) for k in range(1, 5)]


def test_waiting_for_asyncio_may_be_given_up(fake, client):
    async def impatient(session):
        with pytest.raises(asyncio.TimeoutError):
            await asyncio.wait_for(session.trial_async(draw(1), timeout=0.5), 0.1)
        return await session.trial_async(draw(1))  # after the other one's end

    with client.session(draw(0), FACES) as session:
        fake.disturb = once("trial 1", "hang")
        assert asyncio.run(impatient(session)).earliest_toi == motion_hash(draw(0), draw(1))


def test_what_has_not_begun_is_cancelled_with_the_session(fake, client):
    session = client.session(draw(0), FACES)
    fake.disturb = once("trial 1", "hang")
    first, second = session.submit_trial(draw(1)), session.submit_trial(draw(1))
    while "trial 1" not in fake.received:
        time.sleep(0.01)
    session.close()
    with pytest.raises(FailedPreconditionError, match="the session is closed"):
        first.result(30)
    with pytest.raises(concurrent.futures.CancelledError):
        second.result(30)
    with pytest.raises(FailedPreconditionError, match="the session is closed"):
        session.submit_trial(draw(1)).result(30)
