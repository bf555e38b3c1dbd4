# SPDX-License-Identifier: Apache-2.0
"""A session in this process: the same answers, errors and bits as behind a daemon, whatever is asked and in whichever order;
what it does with memory, locks, signals and threads."""
import os
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
from asker import Asker, counts, large, outcome, scene, steps, told
from support import triangle_through_triangle

import warmfront
from warmfront import Body, Options, WarmfrontError

if not warmfront.has_engine():
    pytest.skip("this package has no engine: built without pybind11-dev, or with sanitizers", allow_module_level=True)

BEFORE, AFTER, FACES = triangle_through_triangle()


def poses_of(session):
    return {body: pose.tobytes() for body, pose in session.poses.items()}


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("seed", range(8))
def test_whatever_is_asked_is_answered_alike(client, seed, dtype):
    """The same calls of a session behind a daemon and of one in this process, refused ones included."""
    frames, faces, bodies = scene(dtype)
    # A daemon's own limit is another one.
    arguments = dict(bodies=bodies, thickness=[0.0, 0.01][seed % 2], first_frame=seed, options=Options(max_contacts=10**7))
    asker = Asker(seed, frames, dtype)
    answers = []
    posed = 0
    with client.session(frames[0], faces, **arguments) as there, warmfront.Collider(frames[0], faces, **arguments) as here:
        def both(call):
            a, b = (outcome(lambda session=session: call(session)) for session in (there, here))
            assert a == b, (seed, len(answers))
            answers.append(a)

        for _ in range(150):
            kind = asker.draw.choice(["step", "trial", "trial", "max_step", "commit", "commit", "proximity", "vertex_distances",
                                      "intersections", "place", "change"])
            if kind == "change":
                if asker.draw.random() < 0.3:
                    both(asker.change(there))
            elif kind == "commit":
                fraction = asker.draw.choice([0, 0.25, 1 / 3, 1, 1.5])
                both(lambda session: session.commit(fraction))
            elif kind == "proximity":
                distance, options = asker.draw.choice([0.2, 0.5, -1]), asker.options(kind)
                both(lambda session: session.proximity(distance, **options))
            elif kind == "vertex_distances":
                where = asker.draw.choice(["base", "trial_end"])
                both(lambda session: session.vertex_distances(0.5, where=where))
            elif kind == "intersections":
                options = {"report": asker.draw.choice(["all", "count", "any", "earliest"]), "where": asker.draw.choice(["base", "trial_end"])}
                both(lambda session: session.intersections(**options))
            else:
                motion, options = asker.motion(there), {} if kind == "place" else asker.options(kind)
                both(lambda session: getattr(session, kind)(**motion, **options))
            assert there.last_frame == here.last_frame and there.positions.tobytes() == here.positions.tobytes()
            assert there.edges.tobytes() == here.edges.tobytes() and there.bodies == here.bodies
            assert poses_of(there) == poses_of(here)
            posed += len(here.poses)
        same = ("vertex_count", "face_count", "edge_count", "lone_edge_count", "body_count", "dtype", "filters", "most_thickness",
                "world_count", "screw_count", "last_frame")
        assert [getattr(there.info(), name) for name in same] == [getattr(here.info(), name) for name in same]
    kinds = [answer[0] for answer in answers]
    assert (posed > 0 or seed in (4, 6)) and len(set(kinds)) >= 7 and sum(kind.endswith("Error") for kind in kinds) >= 10 and kinds.count("contacts") >= 10


@pytest.mark.parametrize("seed", range(4))
def test_several_on_the_way_are_answered_alike(client, seed):
    frames, faces, bodies = scene(np.float64)
    asker = Asker(100 + seed, frames, np.float64)
    d = asker.draw
    with client.session(frames[0], faces, bodies=bodies) as there, warmfront.Collider(frames[0], faces, bodies=bodies) as here:
        assert there.window == here.window
        waiting = 0
        for _ in range(120):
            if waiting and d.random() < 0.45:
                a, b = (outcome(session.next_answer) for session in (there, here))
                waiting -= 1
            else:
                kind = d.choice(["step", "trial", "max_step", "commit", "proximity", "intersections", "place"])
                given = dict(kind=kind)
                if kind == "commit":
                    given["fraction"] = d.choice([0.5, 1.0])
                elif kind == "proximity":
                    given.update(min_separation=0.3, where=d.choice(["base", "trial_end"]))
                elif kind != "intersections":
                    # What follows a frame that fails begins elsewhere: its rows are of fixed places.
                    given["positions"] = frames[d.randrange(8)] if d.random() < 0.85 else np.full_like(frames[0], np.inf)
                a, b = (outcome(lambda: session.submit(**given)) for session in (there, here))
                waiting += a[0] == "value"
            assert a[0] == b[0] and (a[0].endswith("Error") or a == b), (a, b)
            if a[0].endswith("Error"):
                assert a[2:] == b[2:]
        for _ in range(waiting):
            assert outcome(there.next_answer)[0] == outcome(here.next_answer)[0]
        assert there.last_frame == here.last_frame and there.positions.tobytes() == here.positions.tobytes()
        assert poses_of(there) == poses_of(here)


def test_all_deformable_is_told_alike(client, cloth):
    arguments = dict(bodies=cloth.bodies, options=Options(explain=True))
    with client.session(cloth.frames[0], cloth.faces, **arguments) as there:
        here = warmfront.Collider(cloth.frames[0], cloth.faces, **arguments)
        for k in (1, 2, 3):
            a, b = there.step(cloth.frames[k]), here.step(cloth.frames[k])
            assert counts(a.statistics) == counts(b.statistics)
            x, y = a.all_deformable, b.all_deformable
            assert counts(x.statistics) == counts(y.statistics)
            assert (x.frame_bytes, x.positions_bytes) == (y.frame_bytes, y.positions_bytes)


def test_every_option_and_field_of_the_contract_reaches_the_engine():
    """What is read of a message: all that the contract has."""
    from warmfront import _engine
    from warmfront.v1 import options_pb2, session_pb2, step_pb2

    class Watched:
        def __init__(self, message, seen):
            self._message, self._seen = message, seen

        def __getattr__(self, name):
            self._seen.add(name)
            return getattr(self._message, name)

    question = step_pb2.Question(tolerance=0.5, min_separation=0.5, max_contacts=5, keep_distance=0.5)
    question.fields.SetInParent()
    seen = set()
    _engine.Question(Watched(question, seen))
    assert seen - {"HasField"} == set(step_pb2.Question.DESCRIPTOR.fields_by_name)

    everything = Options(tier="exact", tolerance=0.5, min_separation=0.25, report="count", front="paper", bounds="aabb", normal_cones=True,
                         lazy_front=False, leaf_size=8, rebuild_after_stalled_steps=5, rebuild_every_steps=6, max_front_bytes=1 << 20,
                         max_contacts=77, find_bodies=False, find_rigid=False, separate_parts=False, explain=True,
                         fields=("weights", "normal", "points", "direction", "squared_distance", "closest"))
    assert set(options_pb2.ColliderOptions.DESCRIPTOR.fields_by_name) == set(Options.__dataclass_fields__)
    assert warmfront.Collider(BEFORE, FACES, options=everything).info().options == everything
    assert set(session_pb2.Body.DESCRIPTOR.fields_by_name) == set(Body.__dataclass_fields__)


def test_columns_outlive_what_told_them_and_are_read_only():
    session = warmfront.Collider(BEFORE, FACES)
    contacts = session.step(AFTER)
    v, toi = contacts.v, contacts.toi
    kept = v.tobytes(), toi.tobytes()
    assert v.base is not None and not v.flags.writeable and not toi.flags.writeable and v.flags.aligned
    with pytest.raises(ValueError):
        v[0, 0] = 1
    del contacts
    for _ in range(20):
        session.step(BEFORE)
        session.step(AFTER)
    session.close()
    del session
    assert (v.tobytes(), toi.tobytes()) == kept


def test_what_is_given_is_left_as_it_is_and_may_be_read_only():
    after = AFTER.copy()
    after.flags.writeable = False
    session = warmfront.Collider(BEFORE, FACES)
    session.step(after)
    session.submit(after, kind="trial")
    assert (after == AFTER).all() and len(session.next_answer()) == 0
    moved = BEFORE.copy()
    session.submit(moved)
    moved[:] = np.nan  # free to be changed at once
    assert len(session.next_answer()) == 3


def test_closed(anywhere):
    session = anywhere.session(BEFORE, FACES)
    assert len(session.step(AFTER)) == 3
    session.close()
    session.close()
    for call in (lambda: session.step(AFTER), lambda: session.positions, lambda: session.edges, session.info, session.commit,
                 lambda: session.submit(AFTER), session.next_answer, lambda: session.change_filters(None)):
        with pytest.raises(warmfront.FailedPreconditionError, match="^the session is closed$"):
            call()
    assert session.last_frame == 1 and len(session.id) == 36  # which cannot become others


def test_other_threads_go_on_meanwhile():
    above, below, faces = large()
    session = warmfront.Collider(above, faces, threads=1)
    ticks = []
    stop = threading.Event()

    def tick():
        while not stop.is_set():
            ticks.append(1)
            time.sleep(0.001)

    thread = threading.Thread(target=tick)
    thread.start()
    try:
        before = len(ticks)
        assert len(session.step(below)) > 10_000
        assert len(ticks) > before
    finally:
        stop.set()
        thread.join()


def test_close_stops_what_another_thread_waits_for():
    above, below, faces = large()
    session = warmfront.Collider(above, faces, threads=1)
    errors = []

    def step_for_ever():
        try:
            while True:
                session.step(below)
                session.step(above)
        except WarmfrontError as error:
            errors.append(error)

    thread = threading.Thread(target=step_for_ever)
    thread.start()
    session.close()
    thread.join(60)
    assert not thread.is_alive()
    assert isinstance(errors[0], warmfront.FailedPreconditionError) and errors[0].message == "the session is closed"


def test_a_time_limit_leaves_everything_as_it_was():
    above, below, faces = large()
    session = warmfront.Collider(above, faces, threads=1)
    with pytest.raises(warmfront.DeadlineExceededError, match=r"frame 1: no answer within 1e-06 s; it does not count") as error:
        session.step(below, timeout=1e-6)
    assert isinstance(error.value, TimeoutError) and session.last_frame == 0
    assert session.positions.tobytes() == above.tobytes()
    fresh = warmfront.Collider(above, faces, threads=2)
    a, b = session.step(below, timeout=600), fresh.step(below)
    assert a.frame == b.frame == 1 and a.v.tobytes() == b.v.tobytes() and a.toi.tobytes() == b.toi.tobytes()


def test_many_colliders_in_many_threads(cloth):
    expected = [told(answer)[-1] for answer in steps(cloth, 1)]
    results = {}

    def run(k):
        results[k] = [told(answer)[-1] for answer in steps(cloth, 1 + k % 3)]

    threads = [threading.Thread(target=run, args=(k,)) for k in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(results[k] == expected for k in range(6))


def test_open_is_any_of_three(daemon):
    answers = []
    for server, kind in ((None, warmfront.Collider), ("local", warmfront.Session), (daemon.address, warmfront.Session)):
        with warmfront.open(BEFORE, FACES, server=server, options=Options(fields=["points"])) as session:
            assert type(session) is kind and isinstance(session, warmfront.AnySession)
            answers.append(told(session.step(AFTER)))
        with warmfront.open_batch(3, BEFORE, FACES, server=server) as batch:
            answers[-1] = (answers[-1], batch.step(np.stack([AFTER] * 3)).counts.tolist())
    assert answers[0] == answers[1] == answers[2]


def test_what_open_started_ends_with_it():
    with warmfront.open(BEFORE, FACES, server="local") as session:
        daemon = session._link.connection._private
        assert len(session.step(AFTER)) == 3 and daemon._process.poll() is None
    assert daemon._process.poll() is not None


@pytest.mark.parametrize("given, message", [
    (dict(threads=-1), r"threads: -1 is not in \[0, 1024\]; give how many may compute"),
    (dict(threads=-1, server="local"), r"threads: -1 is not in \[0, 1024\]; give how many may compute"),
    (dict(threads="2", server="local"), r"threads: '2' is not in"),
    (dict(threads=2.5), r"threads: 2.5 is not in"),
    (dict(security=warmfront.Security(tls=True)), "security: it is of a connection"),
    (dict(timeouts=warmfront.Timeouts(answer=1)), "timeouts: it is of a connection"),
    (dict(server="localhost"), "HOST:PORT"),
    (dict(server="127.0.0.1:1", threads=2), "threads: how many a daemon has"),
])
def test_what_open_refuses(given, message):
    with pytest.raises(warmfront.InvalidArgumentError, match=message):
        warmfront.open(BEFORE, FACES, **given)


def test_who_computes_here_loads_no_grpc():
    program = "import sys, warmfront; warmfront.Collider([[0., 0, 0]]); assert 'grpc' not in sys.modules"
    subprocess.run([sys.executable, "-c", program], check=True, timeout=60)


def test_nothing_is_left_behind():
    """A session that is dropped, its questions unanswered, ends its thread and its memory."""
    def drop():
        session = warmfront.Collider(BEFORE, FACES)
        session.submit(AFTER)
        session.submit(BEFORE, kind="trial")

    drop()
    count = len(os.listdir("/proc/self/task"))
    for _ in range(200):
        drop()
    assert len(os.listdir("/proc/self/task")) <= count + 4
