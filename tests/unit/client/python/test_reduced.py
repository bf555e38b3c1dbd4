# SPDX-License-Identifier: Apache-2.0
"""Reduced rows of proximity, of the real daemon: each closest pair once, as all rows have it and as the command line tells it in
its own process; their vertices by kind; and the rows of each vertex."""
import csv
import dataclasses
import subprocess

import numpy as np
import pytest
from conftest import BIN
from support import bits, triangle_through_triangle

import warmfront
from warmfront import Closest, InvalidArgumentError, Kind, UnimplementedError

BEFORE, AFTER, FACES = triangle_through_triangle()


def closest_pair(row, x):
    """By its features' vertices, the larger feature first; its own for faces and edges, and for parallel edges."""
    kind, v, weights, number = row
    split = 1 if kind == Kind.VERTEX_FACE else 2
    if kind == Kind.EDGE_EDGE:
        a, b = x[v[1]] - x[v[0]], x[v[3]] - x[v[2]]
        if (np.cross(a, b)**2).sum() < 1e-3 * (a @ a) * (b @ b):
            return number
    sides = [tuple(sorted(int(v[k]) for k in range(4) if weights[k] != 0 and (k < split) == first)) for first in (True, False)]
    return number if sum(map(len, sides)) == 4 else tuple(sorted(sides, key=lambda side: (-len(side), side)))


def grouped(rows, positions):
    """The first row of each closest pair, and how many have it."""
    x = np.asarray(positions, float)
    first, count = {}, {}
    for i, (kind, v, weights) in enumerate(zip(rows.kind, rows.v, rows.weights)):
        pair = closest_pair((kind, v, weights, i), x)
        first.setdefault(pair, i)
        count[pair] = count.get(pair, 0) + 1
    return np.array(list(first.values())), np.array(list(count.values()))


@pytest.mark.parametrize("where, frame", [("base", 30), ("trial_end", 32)])
def test_each_closest_pair_once(anywhere, cloth, where, frame):
    with anywhere.session(cloth.frames[30], cloth.faces, bodies=cloth.bodies) as session:
        session.trial(cloth.frames[32])
        rows = session.proximity(0.05, where=where, fields=["weights"])
        kept, multiplicity = grouped(rows, cloth.frames[frame])
        reduced = session.proximity(0.05, where=where, fields=["closest", "weights", "direction"], reduced=True)
        assert len(reduced) == len(kept) < len(rows) and (reduced.vf, reduced.ee) == (rows.vf, rows.ee)
        for name in ("kind", "status", "v", "toi", "weights"):
            assert (getattr(reduced, name) == getattr(rows, name)[kept]).all()
        assert (reduced.multiplicity == multiplicity).all() and multiplicity.max() > 4
        plain = session.proximity(0.05, where=where, reduced=True)
        assert plain.weights is None and plain.stencils().fv.weights is None and (plain.stencil == reduced.stencil).all()
        assert rows.multiplicity is None and rows.stencil is None
        session.submit(kind="proximity", min_separation=0.05, where=where, reduced=True)
        assert session.next_answer().multiplicity.tobytes() == plain.multiplicity.tobytes()

        vv, ev, ee, fv = told = reduced.stencils()
        assert vv is told.vv and ev is told.ev and ee is told.ee and fv is told.fv

        table = reduced.table()
        assert table.dtype.names == ("kind", "status", "v", "toi", "weights", "direction", "closest", "multiplicity", "stencil")
        assert (table["multiplicity"] == multiplicity).all() and (table["direction"] == reduced.direction).all()

        own = reduced.stencil == 15
        assert (reduced.multiplicity[own] == 1).all()
        on = (reduced.stencil[:, None] >> np.arange(4) & 1).astype(bool)
        assert (on[~own] == (reduced.weights[~own] != 0)).all()
        stencils = reduced.stencils()
        assert sorted(np.concatenate([s.rows for s in (stencils.vv, stencils.ev, stencils.ee, stencils.fv)])) == list(
            range(len(reduced)))
        for kind, size in (("vv", 2), ("ev", 3), ("ee", 4), ("fv", 4)):
            stencil = getattr(stencils, kind)
            assert stencil.v.shape == (len(stencil), size) and (stencil.multiplicity == reduced.multiplicity[stencil.rows]).all()
            apart = (stencil.weights[:, :, None] * cloth.frames[frame][stencil.v]).sum(1)
            length = np.linalg.norm(apart, axis=1)
            far = length > 1e-6
            assert np.allclose(apart[far] / length[far, None], reduced.direction[stencil.rows][far], atol=1e-4)
            for vertices, row in zip(stencil.v, stencil.rows):
                v, edges, bits = reduced.v[row], reduced.kind[row] == Kind.EDGE_EDGE, on[row]
                first, second = v[:2 if edges else 1][bits[:2 if edges else 1]], v[2 if edges else 1:][bits[2 if edges else 1:]]
                ordered = (second, first) if len(second) > len(first) else (first, second)
                assert (vertices == np.concatenate(ordered)).all()
        letters = {Closest.VERTEX_VERTEX: stencils.vv, Closest.EDGE_VERTEX: stencils.ev, Closest.FACE_VERTEX: stencils.fv}
        for closest, stencil in letters.items():
            assert (reduced.closest[stencil.rows] == closest).all() and len(stencil) > 0
        with pytest.raises(ValueError, match="reduced"):
            rows.stencils()


def test_is_what_the_command_line_tells_in_its_own_process(client, start_daemon, cloth, tmp_path):
    subprocess.run([BIN / "warmfront", "near", cloth.folder, "--distance", "0.05", "--reduced", "--frames", "30:31", "--contacts",
                    tmp_path / "near.csv"], check=True, stdout=subprocess.DEVNULL)
    with open(tmp_path / "near.csv", newline="") as file:
        expected = [(r["type"], r["v0"], r["v1"], r["v2"], r["v3"], r["multiplicity"], r["stencil"])
                    for r in csv.DictReader(file) if r["frame"] == "30"]
    small = start_daemon("--answer-chunk-bytes", "1KiB")
    for each in (client, warmfront.connect(small.address)):
        with each.session(cloth.frames[30], cloth.faces, bodies=cloth.bodies) as session:
            told = session.proximity(0.05, reduced=True)
            assert [("vf" if kind == Kind.VERTEX_FACE else "ee", *map(str, v), str(times), str(stencil))
                    for kind, v, times, stencil in zip(told.kind, told.v, told.multiplicity, told.stencil)] == expected


def test_what_is_near_nothing_has_no_rows(anywhere):
    with anywhere.session(BEFORE, FACES) as session:
        nothing = session.proximity(1e-3, reduced=True)
        assert len(nothing.multiplicity) == len(nothing.stencil) == 0 and not nothing
        assert [len(s) for s in vars(nothing.stencils()).values()] == [0, 0, 0, 0, 0]
        counted = session.proximity(2.0, report="count", reduced=True)
        assert counted.vf > 0 and len(counted) == len(counted.multiplicity) == 0


def test_is_of_proximity_alone(anywhere):
    with anywhere.session(BEFORE, FACES) as session:
        for kind in ("step", "trial", "max_step"):
            with pytest.raises(InvalidArgumentError, match="reduced"):
                session.submit(AFTER, kind=kind, reduced=True)
        with pytest.raises(InvalidArgumentError, match="commit"):
            session.submit(kind="commit", reduced=True)
        with pytest.raises(InvalidArgumentError, match="reduced"):
            session.submit(kind="intersections", reduced=True)
        with pytest.raises(InvalidArgumentError, match="reduced"):
            session.submit(kind="proximity", min_separation=1, report="vertex-distances", reduced=True)
        assert session.proximity(1e-3) is not None


def test_the_rows_of_each_vertex(anywhere, cloth):
    with anywhere.session(cloth.frames[30], cloth.faces, bodies=cloth.bodies) as session:
        n = len(cloth.frames[30])
        for pairs in (session.proximity(0.02), session.proximity(0.02, reduced=True), session.proximity(1e-12)):
            by_vertex = pairs.by_vertex(n)
            assert len(by_vertex) == n and by_vertex.begin[0] == 0 and by_vertex.begin[-1] == len(by_vertex.rows)
            for v in range(n):
                assert (by_vertex[v] == np.flatnonzero((pairs.v == v).any(1))).all()
        with pytest.raises(IndexError):
            by_vertex[n]
        with pytest.raises(ValueError, match="vertex"):
            session.proximity(0.02).by_vertex(3)


def test_a_row_with_a_vertex_twice_is_listed_once():
    by_vertex = warmfront.rows_by_vertex(np.array([[0, 1, 1, 2], [3, 0, 0, 0]], np.uint32), 5)
    assert [list(by_vertex[v]) for v in range(5)] == [[0, 1], [0], [0], [1], []]


def test_a_daemon_that_does_not_reduce_is_found_out_by_its_answer(client, cloth, monkeypatch):
    """An older daemon ignores fields that it does not know: simulated by not sending them."""
    question_of = warmfront._questions.question_of

    def older(kind, **options):
        unknown = question_of(kind, **{**options, "reduced": False})
        return dataclasses.replace(question_of(kind, **options), content=unknown.content)

    with client.session(cloth.frames[30], cloth.faces, bodies=cloth.bodies) as session:
        rows = session.proximity(0.02)
        monkeypatch.setattr(warmfront._questions, "question_of", older)
        with pytest.raises(UnimplementedError, match="reduced"):
            session.proximity(0.02, reduced=True)
        assert bits(session.proximity(0.02)) == bits(rows)
