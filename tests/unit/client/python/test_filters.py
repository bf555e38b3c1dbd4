# SPDX-License-Identifier: Apache-2.0
"""Pairs of features that do not count: what they leave out, also when the daemon dies; and which filters are refused."""
import numpy as np
import pytest
from fake_daemon import FakeDaemon
from support import bits, triangle_through_triangle

import warmfront
from warmfront import Body, FiltersInfo, InvalidArgumentError, PairFilters, UnimplementedError

BEFORE, AFTER, FACES = triangle_through_triangle()


def pairs_of(contacts):
    return {tuple(row) for row in np.asarray(contacts.v).tolist()}


def test_each_kind_leaves_its_pairs_out(anywhere):
    with anywhere.session(BEFORE, FACES) as session:
        all_pairs = pairs_of(session.step(AFTER))
    assert len(all_pairs) == 3
    vertex = next(v for v in all_pairs if v[0] in (3, 4, 5))[0] if any(v[0] >= 3 for v in all_pairs) else 3
    for filters, left in [
        (None, all_pairs),
        ({}, all_pairs),
        (PairFilters(patches=np.ones(6, np.int64)), set()),
        ({"patches": [1, 1, 1, 2, 2, 2]}, all_pairs),
        ({"patches": [1, 1, 1, 1, 1, 0]}, {v for v in all_pairs if 5 in v}),
        ({"excluded_vertex_pairs": [[0, vertex], [vertex, 1]]},
         {v for v in all_pairs if vertex not in v or not {0, 1} & set(v)}),
        (PairFilters(near_at_rest=10), set()),
        (PairFilters(near_at_rest=0.5), all_pairs),  # a unit apart at the start
        (PairFilters(near_at_rest=0.5, rest_positions=np.zeros((6, 3), np.float32)), set()),
        (PairFilters(within_edges=3), all_pairs),  # of two pieces
    ]:
        with anywhere.session(BEFORE, FACES, filters=filters) as session:
            answer = session.step(AFTER)
            assert pairs_of(answer) == left, filters
            counts = answer.statistics.counts
            # What is all in one patch is not even reached.
            reached = left != all_pairs and not (isinstance(filters, PairFilters) and filters.patches is not None)
            assert (counts.triangle_pairs_filtered + counts.feature_pairs_filtered > 0) == reached


def test_tangles_within_them_are_told_without_them(anywhere):
    with anywhere.session(0.5 * (BEFORE + AFTER), FACES, filters={"patches": np.ones(6, int)}) as session:
        assert not session.intersections()
        session.change_filters(None)
        assert session.intersections()


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_they_come_again_with_the_session(daemon, client, cloth, dtype):
    """Also after they were changed, and after a body was added."""
    frames = cloth.frames.astype(dtype)
    vertices = frames.shape[1]
    spare, _, faces = triangle_through_triangle(dtype)

    def play(disturb):
        answers = []
        filters = PairFilters(within_edges=1, near_at_rest=0.05, patches=np.arange(vertices) // 100)
        with client.session(frames[0], cloth.faces, bodies=cloth.bodies, filters=filters) as session:
            step = lambda k: answers.append(session.step(bodies={0: frames[k][:cloth.bodies[0].vertex_count]}))
            step(30)
            disturb()
            step(31)
            session.add_body(Body(6), faces, spare + dtype(50))
            disturb()
            step(32)
            session.change_filters({"excluded_vertex_pairs": np.array([[0, vertices], [1, vertices + 5]], np.uint16),
                                    "within_edges": 2})
            disturb()
            step(33)
            assert client.get_session(session.id).filters == FiltersInfo(2, 0, 2, False)
            session.change_filters(None)
            disturb()
            step(34)
            assert client.get_session(session.id).filters == FiltersInfo(0, 0, 0, False)
            return [bits(answer) for answer in answers], session.resumes

    undisturbed, none = play(lambda: None)
    answers, resumes = play(daemon.restart)
    assert answers == undisturbed
    assert none == 0 and resumes == 4


@pytest.mark.parametrize("message, filters", [
    (r"filters.within_edges: is 4", {"within_edges": 4}),
    (r"filters.within_edges: -1 is not an integer from 0 to 3", {"within_edges": -1}),
    (r"filters.near_at_rest: is nan", {"near_at_rest": np.nan}),
    (r"filters.near_at_rest: 'far' is not a number", {"near_at_rest": "far"}),
    (r"filters.rest_positions: shape \(6, 2\)", {"near_at_rest": 1, "rest_positions": np.zeros((6, 2))}),
    (r"filters.rest_positions: shape \(5, 3\), but \(6, 3\)", {"near_at_rest": 1, "rest_positions": np.zeros((5, 3))}),
    (r"filters.rest_positions: ", {"rest_positions": np.zeros((6, 3))}),
    (r"filters.excluded_vertex_pairs: int64 of shape \(3,\)", {"excluded_vertex_pairs": [0, 1, 2]}),
    (r"filters.excluded_vertex_pairs\[1\]: \[-1, 2\]", {"excluded_vertex_pairs": [[0, 1], [-1, 2]]}),
    (r"filters.excluded_vertex_pairs\[0\]: vertex 6 is not in \[0, 6\)", {"excluded_vertex_pairs": [[0, 6]]}),
    (r"filters.patches: float64", {"patches": np.ones(6)}),
    (r"filters.patches: shape \(2,\); give \(6,\)", {"patches": [1, 2]}),
    (r"filters: .*'edges'", {"edges": 1}),
    (r"filters: .*", 7),
])
def test_what_is_no_filter_changes_nothing(client, message, filters):
    with pytest.raises(InvalidArgumentError, match=message):
        client.session(BEFORE, FACES, filters=filters)
    with client.session(BEFORE, FACES, filters={"within_edges": 1}) as session:
        session.trial(AFTER)
        with pytest.raises(InvalidArgumentError, match=message):
            session.change_filters(filters)
        with pytest.raises(warmfront.FailedPreconditionError, match="no trial to take"):
            session.commit()
        assert len(session.step(AFTER)) == 3
    assert client.list_sessions() == []


def test_a_change_needs_its_rest_shape(anywhere):
    with anywhere.session(BEFORE, FACES) as session:
        with pytest.raises(InvalidArgumentError, match="filters.rest_positions: 0 values where 18 are expected .*near_at_rest needs them"):
            session.change_filters({"near_at_rest": 0.5})
        session.change_filters({"near_at_rest": 10, "rest_positions": BEFORE})
        assert not session.step(AFTER)


def test_a_daemon_that_is_older_than_filters_is_not_asked(tmp_path):
    fake = FakeDaemon(tmp_path)
    try:
        with warmfront.connect(fake.address) as client:
            with pytest.raises(UnimplementedError, match="filters: the daemon is older"):
                client.session(BEFORE[:3], FACES[:1], filters={"within_edges": 1})
            assert fake.received == [] and not fake.copies
            with client.session(BEFORE[:3], FACES[:1]) as session:
                with pytest.raises(UnimplementedError, match="filters: the daemon is older"):
                    session.change_filters({"within_edges": 1})
    finally:
        fake.stop()
