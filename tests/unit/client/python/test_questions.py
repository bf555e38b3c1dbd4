# SPDX-License-Identifier: Apache-2.0
"""Trials, max_step and commits of the real daemon: a trial answers as a step would, a commit leaves everything where the formula
says, and also when daemons die, answers are the same."""
import threading

import numpy as np
import pytest
from conftest import BIN
from support import bits, triangle_through_triangle
from switchboard import Switchboard
from test_frames import turned
from test_two_daemons import eventually

import warmfront
from warmfront import (Body, FailedPreconditionError, InvalidArgumentError, Kind, Options, ResourceExhaustedError, Status)

BEFORE, AFTER, FACES = triangle_through_triangle()


def test_a_trial_answers_as_the_step_would(anywhere, cloth):
    with anywhere.session(cloth.frames[0], cloth.faces, bodies=cloth.bodies) as session, \
            anywhere.session(cloth.frames[0], cloth.faces, bodies=cloth.bodies) as steps:
        found = 0
        for k in range(1, 40):
            near, far = cloth.frames[k], cloth.frames[min(k + 3, 59)]
            session.trial(far)
            session.max_step(far)
            told = session.trial(near)
            found += len(told)
            assert bits(told) == bits(steps.step(near))
            taken = session.commit()
            assert (taken.frame, taken.vf, taken.ee, taken.earliest_toi) == (k, told.vf, told.ee, told.earliest_toi)
            assert session.positions.tobytes() == near.tobytes()
        assert found > 500 and session.info().last_frame == 39


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("fraction", [0, 0.3, 1 / 3, 0.999, 1])
def test_after_a_commit_answers_are_those_of_a_session_made_there(anywhere, cloth, dtype, fraction):
    frames = cloth.frames.astype(dtype)
    options = Options(fields=["weights", "normal", "points"], min_separation=0.005)
    with anywhere.session(frames[20], cloth.faces, bodies=cloth.bodies, options=options) as session:
        for k in (24, 28, 32):
            told = session.trial(frames[k])
            taken = session.commit(fraction)
            within = told.toi <= fraction
            assert (taken.vf, taken.ee) == tuple(int((within & (told.kind == kind)).sum())
                                              for kind in (Kind.VERTEX_FACE, Kind.EDGE_EDGE))
            with anywhere.session(session.positions, cloth.faces, bodies=cloth.bodies, options=options,
                                first_frame=session.last_frame) as fresh:
                assert bits(session.trial(frames[40])) == bits(fresh.step(frames[40]))


def test_overlaps_at_the_start_are_counted_whether_or_not_they_are_left_out(anywhere):
    with anywhere.session(BEFORE, FACES) as session:
        for V in (AFTER, BEFORE + [0, 0, 1]):
            among, out = (session.max_step(V, min_separation=1.5, leave_out_overlaps=left) for left in (False, True))
            listed = session.trial(V, min_separation=1.5)
            # What moves along with the others comes no nearer.
            assert among.fraction == (0 if V is AFTER else 1) and among.overlaps_at_start == out.overlaps_at_start > 0
            assert among.overlaps_at_start == (listed.status == Status.OVERLAP_AT_START).sum()
        assert session.max_step(AFTER).overlaps_at_start == 0


def test_how_far(anywhere):
    with anywhere.session(BEFORE, FACES) as session:
        limit = session.max_step(AFTER)
        assert repr(limit).startswith("MaxStep(fraction=0.49999") and "statistics" not in repr(limit)
        assert 0.499 < limit.fraction <= 0.5 and float(limit) == limit.fraction
        assert limit.first.kind in (Kind.VERTEX_FACE, Kind.EDGE_EDGE) and limit.first.status == Status.HIT
        assert set(limit.first.v) <= set(range(6)), "three vertices and two edges touch within what a commit rounds"
        assert limit.first.toi == limit.fraction and limit.statistics.counts.vertices_moved == 3
        assert session.max_step(BEFORE + [0, 0, 1]).fraction == 1 and session.max_step(BEFORE + [0, 0, 1]).first is None
        assert session.max_step(AFTER, min_separation=0.25).fraction == pytest.approx(0.375, abs=1e-5)
        assert 0.5 - 1e-12 < session.max_step(AFTER, tier="exact").fraction < 0.5, "there is room for what a commit rounds"
        # Within the separation at the start: it is not left out unless that is asked for.
        assert session.max_step(AFTER, min_separation=1.5).fraction == 0
        away = session.max_step(BEFORE + [0, 0, 1], min_separation=1.5, leave_out_overlaps=True)
        assert away.overlaps_at_start > 0 and away.fraction == 1
        # The vertex is 1 above the face and goes to 1 below it.
        assert session.max_step(AFTER, keep_distance=0.5).fraction == pytest.approx(0.25, rel=1e-2)
        assert session.max_step(AFTER, keep_distance=0.5).fraction <= 0.25
        assert session.max_step(AFTER, keep_distance=0.5, min_separation=0.2).fraction == pytest.approx(0.2, rel=1e-2)
        assert session.max_step(AFTER, keep_distance=0.9, tier="exact").fraction == pytest.approx(0.05, rel=1e-2)
        assert session.submit_max_step(AFTER, keep_distance=0.5).result().fraction == pytest.approx(0.25, rel=1e-2)
        assert session.max_step(BEFORE + [0, 0, 1], keep_distance=0.999).fraction == 1
        session.max_step(AFTER)
        taken = session.commit(0.9 * limit.fraction)
        assert taken.vf == taken.ee == 0 and taken.earliest_toi is None
        assert not session.step(BEFORE)  # it did not pass through


def test_options_of_one_question_are_of_that_question(anywhere):
    with anywhere.session(BEFORE, FACES, options=Options(tier="exact")) as session:
        plain = session.trial(AFTER)
        assert plain.toi.tolist() == [0.5] * 3 and plain.normal is None
        assert session.trial(AFTER, fields=["normal"]).normal.shape == (3, 3)
        assert len(session.trial(AFTER, report="count")) == 0 and session.trial(AFTER, report="count").vf == 1
        assert len(session.trial(BEFORE, tier="certified", min_separation=2)) > 3 and len(session.trial(BEFORE)) == 0
        assert (session.trial(AFTER, tier="certified", tolerance=1e-2).toi < 0.5).all()
        assert bits(session.trial(AFTER)) == bits(plain)
        with pytest.raises(ResourceExhaustedError, match="contacts"):
            session.trial(AFTER, max_contacts=2)
        assert bits(session.step(AFTER, report="earliest")) == bits(plain)


def test_the_daemon_refuses_to_keep_a_distance_in_the_fast_tier(anywhere):
    with anywhere.session(BEFORE, FACES) as session:
        with pytest.raises(InvalidArgumentError, match="keep_distance"):
            session.max_step(AFTER, tier="fast", keep_distance=0.5)
        with pytest.raises(FailedPreconditionError):
            session.commit()
        assert session.last_frame == 0 and len(session.trial(AFTER)) == 3


def test_counted_and_partly_taken(anywhere):
    with anywhere.session(BEFORE, FACES) as session:
        session.trial(AFTER, report="count")
        taken = session.commit(0.75)
        assert taken.vf is taken.ee is taken.possible is None and 0.499 < taken.earliest_toi <= 0.5
        session.trial(BEFORE, report="count")
        assert (session.commit().vf, session.last_frame) == (1, 2)


@pytest.mark.parametrize("message, question", [
    ("tolerance", dict(tolerance=2.0)), ("tolerance", dict(tolerance=-1.0)), ("min_separation", dict(min_separation=-1.0)),
    ("min_separation", dict(tier="fast", min_separation=0.1)), ("max_contacts", dict(max_contacts=2**60)),
])
def test_options_that_the_daemon_refuses(anywhere, message, question):
    with anywhere.session(BEFORE, FACES) as session:
        for ask in (session.trial, session.step, session.max_step):
            with pytest.raises(InvalidArgumentError, match=message):
                ask(AFTER, **question)
        with pytest.raises(FailedPreconditionError):
            session.commit()
        assert session.last_frame == 0 and len(session.trial(AFTER)) == 3


def test_a_change_that_is_refused_ends_the_trial_too(client):
    with client.session(BEFORE, FACES, bodies=[Body(3), Body(3)]) as session:
        for change in (lambda: session.change_body(7, Body(3)), lambda: session.add_body(Body(3), [[0, 1, 9]], BEFORE[:3])):
            session.trial(AFTER)
            with pytest.raises(InvalidArgumentError):
                change()
            with pytest.raises(FailedPreconditionError, match="no trial to take"):
                session.commit()
        assert session.trial(AFTER) and session.commit().vf == 1 and session.resumes == 0


def play(session, crowd, dtype, disturb):
    """Trials and commits of all kinds of frames and changes."""
    told = []
    rigid = [b for b, body in enumerate(crowd.bodies) if body.kind == "rigid"]

    def ask(fraction, **frame):
        told.append(bits(session.trial(**frame)))
        disturb()
        told.append(session.max_step(**frame).fraction)
        disturb()
        told.append(session.commit(fraction))
        disturb()
        told.append(session.positions.tobytes())

    for k, fraction in enumerate((0.3, 1, 0.5, 0, 0.9)):
        ask(fraction, poses={b: turned(0.1 * k, [0.03 * k * np.cos(b), 0.03 * k * np.sin(b), 0]) for b in rigid[:k + 2]})
    before, _, faces = triangle_through_triangle(dtype)
    first = len(session.positions)
    added = session.add_body(Body(6, name="two"), faces, before)
    ask(0.4, vertices=[first + 4, first + 1], vertex_positions=before[[4, 1]] - dtype(0.1))
    ask(0.7, bodies={added: before + dtype(0.05)}, poses={rigid[0]: turned(0.4, [0, 0.05, 0])})
    everything = session.positions
    ends = np.cumsum([body.vertex_count for body in crowd.bodies])
    for b in rigid:
        everything[ends[b] - crowd.bodies[b].vertex_count:ends[b]] += dtype(0.01)
    ask(1 / 3, positions=everything)
    session.submit(everything, kind="trial")
    session.submit(kind="commit", fraction=0.6)
    session.submit(poses={rigid[1]: turned(0.2, [0, 0, 0])})
    disturb()
    told += [bits(session.next_answer()), session.next_answer(), bits(session.next_answer())]
    return told


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_daemons_that_are_killed_between_a_trial_and_its_commit(daemon, client, crowd, dtype):
    def session():
        return client.session(crowd.frames[0].astype(dtype), crowd.faces, bodies=crowd.bodies,
                              options=Options(min_separation=0.05))

    with session() as calm:
        expected = play(calm, crowd, dtype, lambda: None)
        assert calm.resumes == 0
    with session() as killed:
        assert play(killed, crowd, dtype, daemon.restart) == expected
        assert killed.resumes >= 20


@pytest.mark.parametrize("lead_back", [True, False])
def test_a_commit_whose_answer_is_lost_is_made_once(start_daemon, tmp_path, lead_back):
    a, b = start_daemon(), start_daemon()
    for daemon in (a, b):
        daemon.tcp()
    with Switchboard(tmp_path / "board.sock", a) as board, warmfront.connect(board.address) as client, \
            client.session(BEFORE, FACES) as session, warmfront.connect(a.address) as direct:
        told = session.trial(AFTER)
        board.lose_answers()
        taken = []
        committing = threading.Thread(target=lambda: taken.append(session.commit(0.4)))
        committing.start()
        eventually(lambda: direct.get_session(session.id).last_frame == 1)
        board.lead_to(a if lead_back else b)
        committing.join()
        assert taken[0].frame == session.last_frame == 1 and taken[0].vf == 0 and session.resumes == 1
        assert len(told) == len(session.step(AFTER)) == 3
        if lead_back:
            assert direct.get_session(session.id).last_frame == 2


def test_a_trial_that_is_given_up_in_time(client):
    n = 120  # a grid whose vertices all move to one place: minutes of work
    row, column = np.meshgrid(np.arange(n), np.arange(n), indexing="ij")
    corner = (row * n + column)[:-1, :-1].ravel()
    faces = np.concatenate([np.stack([corner, corner + 1, corner + n], 1), np.stack([corner + 1, corner + n + 1, corner + n], 1)])
    start = np.stack([row.ravel(), column.ravel(), np.zeros(n * n)], 1).astype(float)
    with client.session(start, faces, options=Options(report="count")) as session:
        for ask in (session.trial, session.step):
            with pytest.raises(warmfront.DeadlineExceededError):
                ask(np.zeros_like(start), timeout=0.5)
        eventually(lambda: client.server_info().frames_in_flight == 0)
        assert not session.step(start + [0, 0, 1]) and session.last_frame == 1


def test_a_state_is_no_faster_in_tier_fast(anywhere):
    """Which decides touching alone: distances are told as in tier certified, whoever says "fast"."""
    for options in (Options(), Options(tier="fast")):
        with anywhere.session(BEFORE, FACES, options=options) as session:
            certified = bits(session.proximity(1.5, tier="certified"))
            assert bits(session.proximity(1.5, tier="fast")) == certified and len(certified) > 0
            assert session.vertex_distances(1.5, tier="fast").distances.tolist() == \
                session.vertex_distances(1.5, tier="certified").distances.tolist()


def test_its_own_daemon_answers_the_same(anywhere, cloth, monkeypatch):
    monkeypatch.setenv("WARMFRONTD", str(BIN / "warmfrontd"))
    with anywhere.session(cloth.frames[30], cloth.faces, bodies=cloth.bodies) as session, warmfront.connect() as own, \
            own.session(cloth.frames[30], cloth.faces, bodies=cloth.bodies) as other:
        assert bits(session.trial(cloth.frames[33])) == bits(other.submit_trial(cloth.frames[33]).result())
        assert session.commit(0.5) == other.commit(0.5)
