# SPDX-License-Identifier: Apache-2.0
"""Questions about a state, of the real daemon: what is near, and what is tangled, where the session is and where a trial ends."""
import asyncio

import numpy as np
import pytest
from support import bits, triangle_through_triangle

import warmfront
from warmfront import Closest, FailedPreconditionError, InvalidArgumentError, Kind, Options, ResourceExhaustedError

BEFORE, AFTER, FACES = triangle_through_triangle()
TELL = ["squared_distance", "weights", "points", "direction", "closest"]


def distances(positions, pairs):
    """Of the closest points that weights and vertices give, computed here."""
    x = np.asarray(positions, float)[pairs.v]
    split = np.where(pairs.kind == Kind.VERTEX_FACE, 1, 2)[:, None]
    side = np.where(np.arange(4)[None, :] < split, 1.0, -1.0)
    return np.linalg.norm((x * (side * pairs.weights)[:, :, None]).sum(1), axis=1)


def test_what_is_near_and_how_near(anywhere, cloth):
    with anywhere.session(cloth.frames[30], cloth.faces, bodies=cloth.bodies) as session:
        pairs = session.proximity(0.02, fields=TELL)
        assert len(pairs) > 100 and pairs.vf + pairs.ee == len(pairs) and pairs.earliest_toi is None
        assert (pairs.toi == 0).all() and session.last_frame == 0
        apart = distances(cloth.frames[30], pairs)
        assert np.allclose(apart**2, pairs.squared_distance, rtol=1e-6, atol=1e-12) and apart.max() <= 0.02 * (1 + 1e-4)
        assert np.allclose(pairs.distance, apart, rtol=1e-6, atol=1e-12) and session.proximity(0.02).distance is None
        between = pairs.points[:, 0] - pairs.points[:, 1]
        assert np.allclose(between, pairs.direction * np.sqrt(pairs.squared_distance)[:, None], atol=1e-9)
        zeros = (pairs.weights == 0).sum(1)
        vf = pairs.kind == Kind.VERTEX_FACE
        assert ((pairs.closest == Closest.FACE_VERTEX) == (vf & (zeros == 0))).all()
        assert ((pairs.closest == Closest.EDGE_EDGE) == (~vf & (zeros == 0))).all()
        assert bits(session.proximity(0.02, fields=TELL)) == bits(pairs)
        assert session.proximity(0.02, report="count").vf == pairs.vf
        exact = session.proximity(0.02, tier="exact")
        assert exact.possible == 0 and len(exact) <= len(pairs)


def test_where_a_trial_ends(anywhere, cloth):
    with anywhere.session(cloth.frames[28], cloth.faces, bodies=cloth.bodies) as session, \
            anywhere.session(cloth.frames[32], cloth.faces, bodies=cloth.bodies) as there:
        with pytest.raises(FailedPreconditionError, match="trial"):
            session.proximity(0.02, where="trial_end")
        told = session.trial(cloth.frames[32])
        near = session.proximity(0.02, where="trial_end")
        assert (near.toi == 1).all() and (near.v == there.proximity(0.02).v).all()
        assert len(session.proximity(0.02)) > 0
        taken = session.commit()
        assert (taken.vf, taken.ee) == (told.vf, told.ee)
        assert (session.proximity(0.02).v == near.v).all()


def test_edges_and_faces_that_meet(anywhere):
    with anywhere.session(BEFORE, FACES) as session:
        apart = session.intersections()
        assert not apart and len(apart) == 0 and apart.count == 0
        half = (np.asarray(BEFORE, float) + AFTER) / 2 - [0, 0, 0]
        session.trial(AFTER)
        assert session.intersections(where="trial_end").count == len(session.intersections(where="trial_end"))
        tilted = np.array(half)
        tilted[3] += [0, 0, 0.25]
        tilted[4] -= [0, 0, 0.25]
        session.step(tilted)
        meeting = session.intersections()
        assert meeting and meeting.count == len(meeting) >= 1
        for edge, face in zip(meeting.edges, meeting.faces):
            assert set(edge) <= {3, 4, 5} or set(edge) <= {0, 1, 2}
            assert not set(edge) & set(face)
        assert session.intersections(report="any").count == 1 and len(session.intersections(report="any")) == 0
        assert session.intersections(report="count").count == meeting.count


def test_how_far_each_vertex_is_from_anything(anywhere, cloth):
    d = 0.02
    with anywhere.session(cloth.frames[30], cloth.faces, bodies=cloth.bodies) as session:
        rows = session.proximity(d, fields=["squared_distance"])
        told = session.vertex_distances(d)
        expected = np.full(len(cloth.frames[30]), d)
        np.minimum.at(expected, rows.v, np.minimum(np.sqrt(rows.squared_distance), d)[:, None])
        assert len(told) == len(expected) and (told.vf, told.ee) == (rows.vf, rows.ee) and told.vf > 0
        distances = np.asarray(told)
        assert (distances <= expected * (1 + 1e-12)).all() and np.allclose(distances, expected, rtol=0, atol=1e-6)
        assert not told.distances.flags.writeable and told.statistics.counts.elementary_tests > 0
        session.trial(cloth.frames[31])
        end = session.vertex_distances(d, where="trial_end", tier="exact")
        session.submit(kind="proximity", min_separation=d, report="vertex-distances", where="trial_end", tier="exact")
        assert bits_of(session.next_answer()) == bits_of(end) and bits_of(end) != bits_of(told)
        assert bits_of(session.submit_vertex_distances(d).result()) == bits_of(told)
        assert bits_of(asyncio.run(session.vertex_distances_async(d))) == bits_of(told)
        session.commit()
        assert bits_of(session.vertex_distances(d, tier="exact")) == bits_of(end)
        with pytest.raises(InvalidArgumentError, match="vertex_distances"):
            session.proximity(d, report="vertex-distances")
        with pytest.raises(InvalidArgumentError, match="report"):
            session.intersections(report="vertex-distances")
        for ask in (session.proximity, session.vertex_distances):
            with pytest.raises(InvalidArgumentError, match="distance: -1.0 is not a finite length"):
                ask(-1)
            with pytest.raises(InvalidArgumentError, match="distance: inf is not a finite length"):
                ask(np.inf)
            with pytest.raises(InvalidArgumentError, match="distance: 'far' is no number"):
                ask("far")


def bits_of(told):
    return told.distances.tobytes()


def test_one_after_the_other_as_futures_and_for_asyncio(anywhere, cloth):
    async def ask(session):
        return await session.proximity_async(0.02), await session.intersections_async(report="any")

    with anywhere.session(cloth.frames[30], cloth.faces, bodies=cloth.bodies) as session:
        expected = session.proximity(0.02)
        session.submit(kind="proximity", min_separation=0.02)
        session.submit(cloth.frames[31], kind="trial")
        session.submit(kind="proximity", min_separation=0.02, where="trial_end")
        session.submit(kind="commit", fraction=1)
        near, told, end, taken = (session.next_answer() for _ in range(4))
        assert bits(near) == bits(expected) and taken.vf == told.vf and taken.frame == 1
        session.submit(kind="intersections", report="count")
        assert isinstance(session.next_answer(), warmfront.Intersections)
        assert (session.proximity(0.02).v == end.v).all()
        assert bits(session.submit_proximity(0.02).result()) == bits(session.proximity(0.02))
        near, tangled = asyncio.run(ask(session))
        assert bits(near) == bits(session.proximity(0.02)) and tangled.count in (0, 1)


def test_what_is_refused_changes_nothing(anywhere, cloth):
    options = Options(max_contacts=5)
    with anywhere.session(cloth.frames[30], cloth.faces, bodies=cloth.bodies, options=options) as session:
        session.trial(cloth.frames[30])
        for wrong in ({"distance": -1}, {"distance": float("nan")}, {"distance": "far"},
                      {"distance": 0.1, "where": "elsewhere"}, {"distance": 0.1, "report": "earliest"},
                      {"distance": 0.1, "report": "any"}, {"distance": 0.1, "fields": ["colour"]}):
            with pytest.raises(InvalidArgumentError):
                session.proximity(**wrong)
        with pytest.raises(InvalidArgumentError, match="report"):
            session.intersections(report="earliest")
        with pytest.raises(InvalidArgumentError, match="where"):
            session.submit(cloth.frames[30], where="base")
        with pytest.raises(InvalidArgumentError, match="moves nothing"):
            session.submit(cloth.frames[30], kind="proximity", min_separation=0.1)
        with pytest.raises(ResourceExhaustedError, match="max_contacts"):
            session.proximity(0.1)
        assert session.commit().frame == 1
