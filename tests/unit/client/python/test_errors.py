# SPDX-License-Identifier: Apache-2.0
"""Bad input gives the exception of its canonical code, and a message that says what and where."""
import copy
import pickle
import re
import socket

import numpy as np
import pytest
from support import triangle_through_triangle

import warmfront
from warmfront import Body, Code, InvalidArgumentError, Options, Timeouts, Security, WarmfrontError

BEFORE, AFTER, FACES = triangle_through_triangle()


def nan_at(vertex):
    positions = BEFORE.copy()
    positions[vertex, 2] = np.nan
    return positions


@pytest.mark.parametrize("message, arguments", [
    (r"positions: str; give an array", dict(positions="many")),
    (r"positions: list; give an array.*inhomogeneous", dict(positions=[[0, 0, 0], [1, 1]])),
    (r"positions: complex128 numbers", dict(positions=BEFORE + 1j)),
    (r"positions\[1, 2\]: 9007199254740993 is not exactly a float64",
     dict(positions=np.where(np.arange(18).reshape(6, 3) == 5, 2**53 + 1, 2**60))),
    (r"positions: shape \(6, 2\), but \(n, 3\) is expected", dict(positions=BEFORE[:, :2])),
    (r"positions\[4\].z: is not a number", dict(positions=nan_at(4))),
    (r"faces: shape \(6,\); give \(m, 3\)", dict(faces=FACES.ravel())),
    (r"faces: float64 numbers; give integers", dict(faces=FACES.astype(float))),
    (r"faces\[1\]: index 4294967296 is beyond int32", dict(faces=FACES + [[0, 0, 0], [2**32 - 3, 0, 0]])),
    (r"faces\[1\].*6", dict(faces=FACES + [[0, 0, 0], [0, 0, 1]])),
    (r"faces\[0\]", dict(faces=np.array([[0, 1, -1]]))),
    (r"bodies: cover 5 of 6 vertices", dict(bodies=[Body(3), Body(2)])),
    (r"body 'b': kind 'soft' is none of", dict(bodies=[Body(6, "soft", "b")])),
    (r"body 1: group -1 is not an integer from 0 to 4294967295", dict(bodies=[Body(3), Body(3, group=-1)])),
    (r"excluded_pairs\[0\]", dict(bodies=[Body(3), Body(3)], excluded_pairs=[(0, 2)])),
    (r"excluded_pairs\[0\]: \(0, -1\) are no two indices of bodies", dict(bodies=[Body(3), Body(3)], excluded_pairs=[(0, -1)])),
    (r"options.tier: 'sure' is none of fast, certified, exact", dict(options=Options(tier="sure"))),
    (r"options.fields: 'depth' is none of", dict(options=Options(fields=["depth"]))),
    (r"options.leaf_size: -1 is not a number", dict(options=Options(leaf_size=-1))),
    (r"tolerance", dict(options=Options(tolerance=2.0))),
    (r"min_separation", dict(options=Options(tier="fast", min_separation=0.1))),
    (r"session_id", dict(id="mine")),
])
def test_a_bad_scene(client, message, arguments):
    with pytest.raises(InvalidArgumentError, match=message) as error:
        client.session(**{"positions": BEFORE, "faces": FACES, **arguments})
    assert error.value.code == Code.INVALID_ARGUMENT and isinstance(error.value, ValueError)
    assert client.list_sessions() == []


@pytest.mark.parametrize("message, frame", [
    (r"frame 1: positions: shape \(5, 3\), but \(6, 3\) is expected", dict(positions=AFTER[:5])),
    (r"frame 1: positions\[0, 0\]: 0.1.* is not exactly a float64", dict(positions=np.full((6, 3), np.longdouble("0.1")))),
    (r"frame 1: positions\[0, 0\]: 18014398509481985 is not exactly a float64", dict(positions=np.full((6, 3), 2**54 + 1))),
    (r"frame 1: positions\[2\].z: is not a number", dict(positions=nan_at(2))),
    (r"gives all vertices and also parts", dict(positions=AFTER, poses={1: np.eye(3, 4)})),
    (r"frame 1: bodies\[2\]: body 2 is not in \[0, 2\)", dict(bodies={2: AFTER[:3]})),
    (r"frame 1: bodies\[0\]: shape \(6, 3\), but \(3, 3\)", dict(bodies={0: AFTER})),
    (r"frame 1: poses\[1\]: shape \(4, 4\); give a \(3, 4\)", dict(poses={1: np.eye(4)})),
    (r"frame 1: .*pose", dict(poses={1: 2 * np.eye(3, 4)})),
    (r"frame 1: .*0", dict(poses={0: np.eye(3, 4)})),
    (r"frame 1: poses\[cloth\]: body 'cloth' is not in", dict(poses={"cloth": np.eye(3, 4)})),
    (r"frame 1: vertices and vertex_positions belong together", dict(vertices=[1])),
    (r"frame 1: vertices\[1\]: -1 is no index", dict(vertices=[0, -1], vertex_positions=AFTER[:2])),
    (r"frame 1: vertices", dict(vertices=[0, 7], vertex_positions=AFTER[:2])),
    (r"frame 1: vertices", dict(vertices=[1, 1], vertex_positions=AFTER[:2])),
    (r"frame 1: vertex_positions: shape \(3, 3\), but \(2, 3\)", dict(vertices=[0, 1], vertex_positions=AFTER[:3])),
])
def test_a_bad_frame_changes_nothing(anywhere, message, frame):
    with anywhere.session(BEFORE, FACES, bodies=[Body(3), Body(3, "rigid")]) as session:
        with pytest.raises(InvalidArgumentError, match=message):
            session.step(**frame)
        assert session.last_frame == 0
        assert len(session.step(AFTER)) == 3


def test_codes_of_the_daemon_have_classes_of_their_own(client):
    with client.session(BEFORE, FACES) as session:
        with pytest.raises(warmfront.AlreadyExistsError) as error:
            client.session(BEFORE, FACES, id=session.id)
        assert error.value.reason == "SESSION_EXISTS" and session.id in error.value.message
        with pytest.raises(warmfront.FailedPreconditionError, match="bodies"):
            session.add_body(Body(3), FACES[:1], BEFORE[:3])
    with pytest.raises(warmfront.NotFoundError) as error:
        client.delete_session(session.id)
    assert error.value.code == Code.NOT_FOUND and isinstance(error.value, WarmfrontError)


def test_limits_say_which_and_the_session_goes_on(anywhere):
    with anywhere.session(BEFORE, FACES, options=Options(max_contacts=2)) as session:
        with pytest.raises(warmfront.ResourceExhaustedError, match="contacts") as error:
            session.step(AFTER)
        assert error.value.reason == "LIMIT" and error.value.limit
        assert not session.step(BEFORE)


def test_who_has_no_room_for_more_contacts_is_told_so(start_daemon, cloth):
    with warmfront.connect(start_daemon("--max-session-bytes", "4MiB").address) as client:
        for fields, most, why in (((), 10**6, "room for no more"), (("normal",), 10**6, "room for no more"), ((), 50, "$")):
            options = Options(min_separation=0.5, fields=fields, max_contacts=most)
            with client.session(cloth.frames[0], cloth.faces, bodies=cloth.bodies, options=options) as session:
                room = session.info().options.max_contacts
                assert room < 20000
                with pytest.raises(warmfront.ResourceExhaustedError, match=f"more than {room} contacts; raise .*{why}") as error:
                    session.step(cloth.frames[1])
                assert error.value.limit == "max-contacts" and ("room" in str(error.value)) == (most > 50)


def test_a_socket_in_a_folder_that_is_not_there_is_not_waited_for():
    with pytest.raises(warmfront.UnavailableError, match="there is no folder /nonexistent; is this the path"):
        warmfront.connect("unix:/nonexistent/warmfront.sock")


def test_nobody_answers():
    """The message has the system's reason, as the C++ client's has."""
    with pytest.raises(warmfront.UnavailableError, match="127.0.0.1:1: no Warmfront daemon answers .*Connection refused.* is it "
                                                    "running there?"):
        warmfront.connect("127.0.0.1:1", timeouts=Timeouts(call=0.3))


@pytest.mark.parametrize("address", ["http://localhost:50061", "localhost", "localhost:", "localhost:http", ":50051",
                                     "::1:50051", "127.0.0.1:0", "127.0.0.1:65536", "unix:", "unix:/tmp/" + 103 * "x", ""])
def test_what_is_no_address_is_refused_at_once(address):
    """The error comes at once; gRPC would try to resolve the address first."""
    with pytest.raises(ValueError, match=r"HOST:PORT \(an IPv6 host in brackets\) or unix:PATH is expected") as error:
        warmfront.connect(address)
    assert repr(address) in str(error.value) and isinstance(error.value, InvalidArgumentError)


def test_who_takes_time_to_answer_is_connected_to_once(tmp_path):
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(str(tmp_path / "silent"))
        listener.listen(64)
        with pytest.raises(warmfront.UnavailableError):
            warmfront.connect(f"unix:{tmp_path}/silent", timeouts=Timeouts(call=1.5))
        listener.setblocking(False)
        listener.accept()
        with pytest.raises(BlockingIOError):
            listener.accept()


def test_times_are_positive():
    with pytest.raises(InvalidArgumentError, match="timeouts.answer: 0 seconds"):
        Timeouts(answer=0)


@pytest.mark.parametrize("security, message", [
    (Security(ca_file="/no/such/ca.pem"), "CA file /no/such/ca.pem: it cannot be read"),
    (Security(cert_file="mine.pem"), "a client certificate needs its key"),
])
def test_credentials_that_cannot_be_used(security, message):
    with pytest.raises(InvalidArgumentError, match=message):
        warmfront.connect("127.0.0.1:1", security=security)


def test_tokens(start_daemon, tmp_path):
    (tmp_path / "tokens").write_text("a-secret-of-some-length alice\nanother-secret-of-length bob admin\n")
    for name, token in (("alice", "a-secret-of-some-length\n"), ("bob", "another-secret-of-length"), ("eve", "guess"),
                        ("two", "two words")):
        (tmp_path / name).write_text(token)
    address = start_daemon("--token-file", str(tmp_path / "tokens")).tcp()

    def connect(name, to=address):
        return warmfront.connect(to, security=Security(token_file=str(tmp_path / name)))

    with connect("alice") as alice, connect("bob") as bob, alice.session(BEFORE, FACES) as session:
        assert len(session.step(AFTER)) == 3
        assert bob.list_sessions() == [] and [s.principal for s in bob.list_all_sessions()] == ["alice"]
        with pytest.raises(warmfront.PermissionDeniedError):
            alice.list_all_sessions()
        with pytest.raises(warmfront.NotFoundError):
            bob.delete_session(session.id)
        bob.delete_any_session(session.id)
        assert len(session.step(BEFORE)) == 3 and session.resumes == 1
    for nobody in ("eve", None):
        with pytest.raises(warmfront.UnauthenticatedError):
            connect(nobody) if nobody else warmfront.connect(address)
    with pytest.raises(InvalidArgumentError, match="one token is expected"):
        connect("two")
    with pytest.raises(InvalidArgumentError, match="would travel to 10.0.0.1:1 in the clear"):
        connect("alice", "10.0.0.1:1")


@pytest.mark.parametrize("given", ["zzz", "00000000-0000-0000-0000-000000000000\n", "\u0663" * 36, "x" * 100_000, b"1"])
def test_an_id_that_is_none_is_refused_at_once(client, given):
    with pytest.raises(InvalidArgumentError, match="session_id: a UUID of 8-4-4-4-12 hexadecimal digits is expected, got"):
        client.session(BEFORE, FACES, id=given)


@pytest.mark.parametrize("message, ask", [
    ("bodies: a list; give a dict", lambda s: s.trial(bodies=[AFTER])),
    ("poses: a list; give a dict", lambda s: s.trial(poses=[np.eye(4)])),
    ("options.fields: 5; give a list of ", lambda s: s.change_options(warmfront.Options(fields=5))),
    ("filters.rest_positions: has no effect while near_at_rest is 0", lambda s: s.change_filters({"rest_positions": BEFORE})),
    ("timeout: '3' is no number", lambda s: s.trial(AFTER, timeout="3")),
    ("fraction: '0.5' is no number", lambda s: (s.trial(AFTER), s.commit("0.5"))),
    ("distance: '0.1' is no number", lambda s: s.proximity("0.1")),
    ("distance: True is no number", lambda s: s.proximity(True)),
    ("keep_distance: '0.1' is no number", lambda s: s.max_step(AFTER, keep_distance="0.1")),
    ("options: a dict; give warmfront.Options", lambda s: s.change_options({"tier": "exact"})),
])
def test_arguments_of_other_types_are_named(anywhere, message, ask):
    with anywhere.session(BEFORE, FACES) as session:
        with pytest.raises(InvalidArgumentError, match=re.escape(message)):
            ask(session)
        assert len(session.step(AFTER)) > 0, "the session is as it was"


@pytest.mark.parametrize("message, given", [
    ("bodies: a Body; give a list", {"bodies": Body(6)}),
    ("bodies[1]: a int; give a warmfront.Body", {"bodies": [Body(3), 3]}),
    ("options: a dict; give warmfront.Options", {"options": {"tier": "exact"}}),
    ("first_frame: -1 is not a whole number in [0, 2^63)", {"first_frame": -1}),
    ("first_frame: 1.5 is not a whole number", {"first_frame": 1.5}),
])
def test_scenes_of_other_types_are_named(anywhere, message, given):
    with pytest.raises(InvalidArgumentError, match=re.escape(message)):
        anywhere.session(BEFORE, FACES, **given)


def test_answers_are_pickled_and_copied(anywhere):
    with anywhere.session(BEFORE, FACES) as session:
        contacts = session.step(AFTER)
    for again in (pickle.loads(pickle.dumps(contacts)), copy.deepcopy(contacts)):
        assert again.v.tolist() == contacts.v.tolist() and again.toi.tobytes() == contacts.toi.tobytes()
        assert again.statistics == contacts.statistics and again.faces.tolist() == contacts.faces.tolist()


def test_sessions_and_what_makes_them_are_not_copied(anywhere):
    with anywhere.session(BEFORE, FACES) as session, anywhere.batch(2, BEFORE, FACES) as batch:
        for each in (session, batch, anywhere):
            if not isinstance(each, (warmfront.AnySession, warmfront.Batch, warmfront.Client)):
                continue  # this process
            for call in (copy.copy, copy.deepcopy, pickle.dumps):
                with pytest.raises(TypeError, match=f"a {type(each).__name__} is not copied or pickled: .* again$|.*`positions`$"):
                    call(each)
        assert len(session.step(AFTER)) == 3


def test_a_bad_motion_names_its_body_not_its_place_in_the_frame(anywhere):
    """Frames are dicts by body: where in the list that is made of them a body stands, their caller does not know."""
    bodies = [Body(3), Body(3, name="cloth")]
    wrong = AFTER[3:].copy()
    wrong[2, 1] = np.nan
    sheared = np.eye(3, 4)
    sheared[0, 1] = 0.5
    with anywhere.session(BEFORE, FACES, bodies=bodies) as session:
        with pytest.raises(InvalidArgumentError, match=re.escape('bodies[0]: body 1 ("cloth"): positions[2].y: is not a number')):
            session.step(bodies={1: wrong})
        session.change_body(1, Body(3, "rigid", name="cup"))
        for pose, what in ((np.full((3, 4), np.nan), "pose[0]: is not a number"), (sheared, "pose: is not rigid: columns 0 and 1")):
            with pytest.raises(InvalidArgumentError, match=re.escape(f'poses[0]: body 1 ("cup"): {what}')):
                session.step(poses={1: pose})
        assert session.last_frame == 0


def test_a_body_is_named_by_its_name_too(anywhere):
    bodies = [Body(3, "static", name="table"), Body(3, "rigid", name="ü" * 40 + "\n")]
    with anywhere.session(BEFORE, FACES, bodies=bodies) as session:
        for message, motion in ((r'moves, but body 0 ("table") is static', dict(positions=BEFORE + 1)),
                                (r'bodies[0]: body 0 ("table") is static', dict(bodies={0: BEFORE[:3]})),
                                (f'is of the rigid body 1 ("{"ü" * 32}..."); give its pose', dict(vertices=[4], vertex_positions=AFTER[:1]))):
            with pytest.raises(InvalidArgumentError, match=re.escape(message)):
                session.step(**motion)
        session.change_body(1, Body(3, "removed", name="was\na cup"))
        with pytest.raises(InvalidArgumentError, match=re.escape('body 1 ("was?a cup") was removed; add a new one, or replace it')):
            session.change_body(1, Body(3))


@pytest.mark.parametrize("message, ask", [
    (r"Body: vertex_count 'cloth' is not a number", lambda s: Body("cloth", 8)),
    (r"Body: vertex_count None", lambda s: Body(None)),
    (r"Body: first_vertex '3'", lambda s: Body(3, first_vertex="3")),
    (r"body: None; give a Body", lambda s: s.change_body(0, None)),
    (r"body: None; give a Body", lambda s: s.add_body(None, FACES, BEFORE)),
    (r"body: {}; give a Body", lambda s: s.replace_body(0, BEFORE, FACES, body={})),
    (r"excluded_pairs: None; give pairs", lambda s: s.change_excluded_pairs(None)),
    (r"excluded_pairs\[0\]: 1 are no two", lambda s: s.change_excluded_pairs([1, 2])),
    (r"fields: 3; give names", lambda s: s.trial(AFTER, fields=3)),
    (r"vertex_count: -1; give how many", lambda s: s.trial(AFTER).by_vertex(-1)),
    (r"continuity: earlier: int; give Contacts", lambda s: warmfront.continuity(1, 2)),
    (r"continuity: now: int; give Contacts", lambda s: warmfront.continuity(None, 2)),
    (r"continuity: earlier: ndarray; give Contacts", lambda s: warmfront.continuity(FACES, s.trial(AFTER))),
    (r"Body: first_vertex array", lambda s: Body(3, first_vertex=np.arange(2))),
    (r"stencils: the rows are not reduced", lambda s: s.trial(AFTER).stencils()),
])
def test_what_is_of_no_such_type(client, message, ask):
    with client.session(BEFORE, FACES, bodies=[Body(6)]) as session:
        with pytest.raises(InvalidArgumentError, match=message):
            ask(session)
        assert len(session.step(AFTER)) > 0
