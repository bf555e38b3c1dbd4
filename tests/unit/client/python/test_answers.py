# SPDX-License-Identifier: Apache-2.0
"""Answers are those of the command line, bit for bit, however they are reported, chunked and typed."""
import copy
import csv
import json
import subprocess

import numpy as np
import pytest
from conftest import BIN
from support import bits, contacts_hash, triangle_through_triangle

import warmfront
from warmfront import Body, Kind, Options, Status


def detect(scene, tmp_path, *arguments):
    subprocess.run([BIN / "warmfront", "detect", scene.folder, "--json", tmp_path / "report.json", "--contacts",
                    tmp_path / "contacts.csv", *arguments], check=True, stdout=subprocess.DEVNULL)
    with open(tmp_path / "contacts.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    return json.loads((tmp_path / "report.json").read_text()), rows


def step_through(client, scene, frames=None, **options):
    frames = scene.frames if frames is None else frames
    with client.session(frames[0], scene.faces, bodies=scene.bodies, options=Options(**options)) as session:
        return [session.step(frame) for frame in frames[1:]]


@pytest.mark.parametrize("tier", ["fast", "certified", "exact"])
def test_answers_are_those_of_detect(client, cloth, tmp_path, tier):
    report, rows = detect(cloth, tmp_path, "--tier", tier)
    answers = step_through(client, cloth, tier=tier)
    assert contacts_hash(answers) == report["contacts_hash"]
    assert len(rows) > 500
    for answer, frame in zip(answers, report["frames"], strict=True):
        assert (answer.frame, answer.vf, answer.ee) == (frame["frame"], frame["vf"], frame["ee"])
        assert (answer.possible, answer.earliest_toi) == (frame["possible"], frame["earliest_toi"])
        assert answer.statistics.counts.bv_tests == frame["counts"]["bv_tests"]
        assert answer.statistics.front_state == frame["front_state"]
    told = [(str(answer.frame), "vf" if kind == Kind.VERTEX_FACE else "ee", *map(str, v), float(toi), Status(status).name.lower())
            for answer in answers for kind, v, toi, status in zip(answer.kind, answer.v, answer.toi, answer.status)]
    assert told == [(r["frame"], r["type"], r["v0"], r["v1"], r["v2"], r["v3"], float(r["toi"]), r["status"]) for r in rows]


def test_contacts_hash_is_that_of_the_command_line(anywhere, cloth, tmp_path):
    report, _ = detect(cloth, tmp_path)
    answers = step_through(anywhere, cloth)
    assert f"{warmfront.contacts_hash(answers):016x}" == report["contacts_hash"] == contacts_hash(answers)
    first, last = answers[:7], answers[7:]
    assert f"{warmfront.contacts_hash(iter(last), warmfront.contacts_hash(first)):016x}" == report["contacts_hash"]
    one = next(answer for answer in answers if len(answer) > 1)
    assert f"{warmfront.contacts_hash(one):016x}" == contacts_hash([one])
    assert len({warmfront.contacts_hash(each) for each in (first, last, answers, one, [])}) == 5


def test_contacts_hash_without_an_engine_is_the_same(anywhere, cloth, monkeypatch):
    """Of reduced answers and of half-spaces, too."""
    bodies = [*cloth.bodies, Body(kind="static", half_space=((0, 0, 0), (0, 0, 1)))]
    with anywhere.session(cloth.frames[20], cloth.faces, bodies=bodies) as session:
        answers = [session.step(cloth.frames[21], min_separation=0.01), session.proximity(0.02), session.proximity(0.02, reduced=True),
                   session.step(cloth.frames[22], report="count")]
    assert answers[0].vh > 0 and len(answers[2].stencils().fv.v) > 0 and len(answers[3]) == 0
    hashes = [warmfront.contacts_hash(answer) for answer in answers]
    assert hashes[3] == warmfront.contacts_hash(copy.copy(answers[3]))
    monkeypatch.setattr("warmfront._contact_hash._mixer", lambda: warmfront._contact_hash.mix_in_python)
    assert hashes == [warmfront.contacts_hash(answer) for answer in answers] and len(set(hashes)) == 4


@pytest.mark.parametrize("message, arguments", [
    ("answers: a int; give what step", (3,)), (r"answers\[0\]: a str; give what step", (["rows"],)),
    ("before: -1 is no hash", ([], -1)), ("before: 18446744073709551616 is no hash", ([], 2**64)), ("before: True is no", ([], True)),
])
def test_contacts_hash_of_what_is_no_answer(message, arguments):
    with pytest.raises(warmfront.InvalidArgumentError, match=message):
        warmfront.contacts_hash(*arguments)


def test_float64_positions_give_what_the_same_float32_positions_give(client, cloth):
    narrow = step_through(client, cloth)
    wide = step_through(client, cloth, cloth.frames.astype(np.float64))
    assert [bits(a) for a in narrow] == [bits(a) for a in wide]


def test_chunks_in_small_messages_are_joined(start_daemon, cloth):
    """Uploads, frames and answers in parts: what a daemon of small messages answers, another answers in one."""
    small = start_daemon("--max-message-bytes", "64KiB", "--answer-chunk-bytes", "1KiB")
    with warmfront.connect(small.address) as client:
        limits = client.server_info().limits
        pieces = step_through(client, cloth, cloth.frames[:20].astype(np.float64), min_separation=0.02, fields=["points"])
    assert limits.answer_chunk_bytes == 1024 and limits.max_message_bytes == 65536
    with warmfront.connect(start_daemon().address) as client:
        whole = step_through(client, cloth, cloth.frames[:20].astype(np.float64), min_separation=0.02, fields=["points"])
    assert max(len(answer) for answer in whole) > 10 * 1024 // 29
    assert [bits(a) for a in pieces] == [bits(a) for a in whole]


def test_a_frame_of_several_messages(start_daemon):
    """An n-fold scene whose positions do not fit in one message of the daemon."""
    before, after, faces = triangle_through_triangle()
    copies = 2000
    offsets = 10.0 * np.arange(copies)[:, None, None] * [1, 0, 0]
    V0, V1 = ((offsets + V).reshape(-1, 3) for V in (before, after))
    F = (6 * np.arange(copies)[:, None, None] + faces).reshape(-1, 3)
    assert V0.nbytes > 4 * 65536
    with warmfront.connect(start_daemon("--max-message-bytes", "64KiB").address) as client:
        with client.session(V0, F) as session:
            answer = session.step(V1)
            assert (answer.vf, answer.ee) == (copies, 2 * copies)
            assert (answer.v.reshape(copies, -1) // 6 == np.arange(copies)[:, None]).all() or len(set(answer.v[:, 0])) > copies


def test_reports(client, cloth):
    every = step_through(client, cloth)
    earliest = step_through(client, cloth, report="earliest")
    count = step_through(client, cloth, report="count")
    assert sum(map(len, every)) > sum(map(len, earliest)) > 0
    for a, e, c in zip(every, earliest, count, strict=True):
        assert e.earliest_toi == a.earliest_toi == c.earliest_toi
        first = a.toi == a.earliest_toi
        assert e.v.tolist() == a.v[first].tolist() and (e.toi == a.earliest_toi).all()
        assert (c.vf, c.ee, len(c)) == (a.vf, a.ee, 0) and bool(c) == bool(a)


def test_fields_come_where_asked_for(anywhere):
    before, after, faces = triangle_through_triangle()
    with anywhere.session(before, faces, options=Options(fields=["weights", "normal", "points"])) as session:
        contacts = session.step(after)
        rest = session.step(after)
    assert contacts.kind.tolist() == [Kind.VERTEX_FACE, Kind.EDGE_EDGE, Kind.EDGE_EDGE]
    assert contacts.v[0].tolist() == [3, 0, 1, 2] and (contacts.status == Status.HIT).all()
    assert np.allclose(contacts.toi, 0.5) and (contacts.toi <= 0.5).all()
    assert np.allclose(contacts.weights[0], [1, 0.5, 0.25, 0.25])
    assert np.allclose(contacts.normal[0], [0, 0, 1])
    assert np.allclose(contacts.points[0], [[0.25, 0.25, 0], [0.25, 0.25, 0]])
    assert rest.weights.shape[1:] == (4,) and rest.points.shape[1:] == (2, 3) and len(rest.points) == len(rest)
    table = contacts.table()
    assert table.dtype.names == ("kind", "status", "v", "toi", "weights", "normal", "points")
    assert (table["v"] == contacts.v).all() and (table["points"] == contacts.points).all()
    with anywhere.session(before, faces) as session:
        assert session.step(after).weights is None


def test_lists_and_whole_numbers_are_taken_exactly(anywhere):
    before, after, faces = triangle_through_triangle()
    before, after = 4 * before, 4 * after
    with anywhere.session(before, faces) as session:
        expected = bits(session.step(after))
    for V0, V1 in ((before.tolist(), after.tolist()), (before.astype(int), after.astype(np.int16)),
                   (before, after.tolist()), (before.tolist(), after.astype(np.float16))):
        with anywhere.session(V0, faces.tolist()) as session:
            assert bits(session.step(V1)) == expected
    with anywhere.session(before.astype(np.float32), faces) as session:
        assert session.info().dtype == "float32"
        session.step(after.tolist())
        with pytest.raises(warmfront.InvalidArgumentError, match=r"positions\[0, 0\]: 0.1 is not exactly a float32"):
            session.step((after + 0.1).tolist())


def test_contacts_know_their_bodies_faces_and_edges(anywhere, crowd):
    """By brute force over the scene's faces."""
    spare = crowd.frames[0][:crowd.bodies[0].vertex_count] + np.float32(100)
    own = crowd.faces[(crowd.faces < len(spare)).all(axis=1)]
    with anywhere.session(crowd.frames[0], crowd.faces, bodies=crowd.bodies, options=Options(min_separation=0.05)) as session:
        added = session.add_body(Body(len(spare)), own, spare)
        faces = np.concatenate([crowd.faces, own + len(crowd.frames[0])])
        edges = sorted({tuple(sorted((int(f[i]), int(f[i - 1])))) for f in faces for i in range(3)})
        assert session.edges.tolist() == [list(edge) for edge in edges]
        ends = np.cumsum([body.vertex_count for body in crowd.bodies] + [len(spare)])
        # The new body comes down on the first.
        moved = np.concatenate([crowd.frames[1], crowd.frames[1][:len(spare)] + np.float32(0.01)])
        contacts = session.step(moved)
        assert contacts.vf > 100 < contacts.ee and (contacts.bodies == added).any()
        for row, v in enumerate(contacts.v.tolist()):
            first, second = (int(np.searchsorted(ends, v[k], side="right")) for k in (0, 2))
            assert contacts.bodies[row].tolist() == [first, second]
            if contacts.kind[row] == Kind.VERTEX_FACE:
                assert faces[contacts.faces[row]].tolist() == v[1:] and contacts.edges[row].tolist() == [-1, -1]
            else:
                assert contacts.faces[row] == -1
                assert [edges[e] for e in contacts.edges[row]] == [tuple(sorted(v[:2])), tuple(sorted(v[2:]))]


def test_duplicate_faces_are_told_apart(anywhere):
    before, after, faces = triangle_through_triangle()
    faces = np.concatenate([faces, faces[:1], faces[:1, [1, 2, 0]]])
    with anywhere.session(before, faces) as session:
        contacts = session.step(after)
        assert contacts.faces[contacts.kind == Kind.VERTEX_FACE].tolist() == [0, 2, 3]
        assert contacts.bodies is None  # none were declared


def test_a_face_may_repeat_a_vertex(anywhere):
    before, after, _ = triangle_through_triangle()
    with anywhere.session(before, [[0, 1, 2], [3, 3, 4]]) as session:
        contacts = session.step(after)
        # The segment's first end; and the segment, which crosses the hypotenuse.
        assert contacts.v.tolist() == [[3, 0, 1, 2], [1, 2, 3, 4]]
        assert session.edges.tolist() == [[0, 1], [0, 2], [1, 2], [3, 3], [3, 4]]
