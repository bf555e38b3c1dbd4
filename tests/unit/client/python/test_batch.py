# SPDX-License-Identifier: Apache-2.0
"""Worlds, and batches of copies: what each meets alone, in one session, also when the daemon dies."""
import dataclasses

import numpy as np
import pytest
from fake_daemon import FakeDaemon
from support import bits, triangle_through_triangle

import warmfront
from warmfront import Body, FailedPreconditionError, InvalidArgumentError, UnimplementedError

BEFORE, AFTER, FACES = triangle_through_triangle()
PAIR = [Body(3), Body(3)]
GROUND = (Body(4, "static", name="ground"), [[0, 1, 2], [0, 2, 3]],
          [[-9, -9, -3], [9, -9, -3], [9, 9, -3], [-9, 9, -3.0]])


def at_fractions(fractions):
    """(n, 6, 3): of each copy that part of the way; beyond 1 it goes on."""
    return BEFORE + np.reshape(fractions, (-1, 1, 1)) * (AFTER - BEFORE)


def test_bodies_of_two_worlds_never_meet(anywhere):
    for worlds, met in (((0, 0), True), ((1, 0), True), ((7, 7), True), ((1, 2), False), ((2 ** 32 - 1, 1), False)):
        bodies = [Body(3, world=worlds[0]), Body(3, world=worlds[1])]
        with anywhere.session(BEFORE, FACES, bodies=bodies) as session:
            assert bool(session.step(AFTER)) == met
            assert session.info().world_count == len({world for world in worlds if world})
            session.change_body(0, Body(3, world=worlds[1]))
            assert session.step(BEFORE), "now they are in one"
    with pytest.raises(InvalidArgumentError, match="world 4294967296 is not"):
        anywhere.session(BEFORE, FACES, bodies=[Body(3, world=2 ** 32), Body(3)])


def test_the_earliest_of_each_world_is_told(anywhere):
    positions = np.concatenate([BEFORE, BEFORE, BEFORE])
    target = np.concatenate(at_fractions([1, 0.25, 4]))
    bodies = [Body(3, world=world) for world in (5, 5, 9, 9, 7, 7)]
    faces = np.concatenate([FACES + 6 * k for k in range(3)])
    with anywhere.session(positions, faces, bodies=bodies) as session:
        told = session.trial(target, report="earliest", tier="exact")
        assert told.worlds.tolist() == [5, 7, 9] and told.world_tois.tolist() == [0.5, 0.125, np.inf]
        assert told.earliest_toi == 0.125 and set(told.toi) == {0.5, 0.125} and not told.worlds.flags.writeable
        limit = session.max_step(target, tier="exact")
        assert limit.fraction == limit.world_fractions[1] and limit.worlds.tolist() == [5, 7, 9]
        assert limit.world_fractions.tolist() == pytest.approx([0.5, 0.125, 1], rel=1e-12)
        assert len(session.trial(target).worlds) == 0, "of report earliest alone"
    with anywhere.session(BEFORE, FACES, bodies=PAIR) as session:
        assert len(session.step(AFTER, report="earliest").worlds) == 0 and len(session.max_step(BEFORE).worlds) == 0


@pytest.mark.parametrize("shared", [(), (GROUND,)])
def test_each_copy_has_the_filters_and_the_thickness_of_one(anywhere, shared):
    near = BEFORE + 0.5 * (AFTER - BEFORE) * 0.9
    ways = [dict(thickness=[0, 0, 0, 0.2, 0, 0.1]), dict(thickness=0.05), dict(filters=dict(excluded_vertex_pairs=[[0, 3], [1, 4]])),
            dict(filters=warmfront.PairFilters(patches=[1, 1, 1, 1, 1, 1])), dict(filters=dict(near_at_rest=0.3)),
            dict(filters=dict(near_at_rest=0.3, rest_positions=AFTER), thickness=[0.01] * 6)]
    listed = []
    for way in ways:
        with anywhere.session(BEFORE, FACES, bodies=PAIR, **way) as alone:
            expected = [alone.trial(end) for end in (near, AFTER)]
            with anywhere.batch(3, BEFORE, FACES, bodies=PAIR, shared=shared, **way) as batch:
                for end, one in zip((near, AFTER), expected):
                    told = batch.trial(np.stack([end] * 3))
                    for world in range(3):
                        rows = told.rows(world)
                        assert told.v[rows].tolist() == one.v.tolist() and told.contacts.toi[rows].tolist() == one.toi.tolist()
                    listed.append(len(one))
    assert 0 in listed and max(listed) > 0
    with pytest.raises(InvalidArgumentError, match=r"thickness: shape \(5,\); give \(6,\)"):
        anywhere.batch(3, BEFORE, FACES, thickness=[0] * 5)
    with pytest.raises(InvalidArgumentError, match="filters.patches"):
        anywhere.batch(3, BEFORE, FACES, filters=dict(patches=[1]))


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("shared", [(), (GROUND,)])
def test_a_batch_answers_as_each_copy_alone(anywhere, shared, dtype):
    fractions = np.array([1, 0.25, 0.75, 4, 0])
    target = at_fractions(fractions).astype(dtype)
    start = BEFORE.astype(dtype)
    with anywhere.batch(5, start, FACES, bodies=PAIR, shared=shared) as batch:
        assert batch.count == 5 and batch.positions.shape == (5, 6, 3) and (batch.positions == start).all()
        limits = batch.max_step(target)
        told = batch.trial(target)
        near = batch.proximity(1.5)
        room = batch.vertex_distances(0.75)
        for world in range(5):
            first = 4 * len(shared)
            ground = np.reshape([p for _, _, p in shared], (-1, 3)).astype(dtype)
            faces = np.concatenate([np.reshape([f for _, f, _ in shared], (-1, 3)).astype(int), FACES + first])
            with anywhere.session(np.concatenate([ground, start]), faces, bodies=[*(b for b, _, _ in shared), *PAIR]) as alone:
                whole = alone.trial(bodies={len(shared): target[world, :3], len(shared) + 1: target[world, 3:]})
                rows = told.rows(world)
                assert np.array_equal(told.contacts.toi[rows], whole.toi)
                own = np.where(whole.v < first, -1 - whole.v.astype(int), whole.v.astype(int) - first)
                assert np.array_equal(told.v[rows], own) and told.counts[world] == len(whole)
                assert told.tois[world] == (whole.earliest_toi if whole else np.inf)
                far = alone.max_step(bodies={len(shared): target[world, :3], len(shared) + 1: target[world, 3:]}).fraction
                assert limits[world] == far == pytest.approx(whole.earliest_toi if whole else 1, rel=1e-5)
                assert np.array_equal(near.contacts.v[near.rows(world)] * 0, alone.proximity(1.5).v * 0)
                assert np.array_equal(room[world], alone.vertex_distances(0.75).distances[first:])
        assert batch.step(target).counts.tolist() == told.counts.tolist()
        assert (batch.positions == target).all()
        counted = batch.trial(np.stack([start] * 5), report="count")
        assert counted and counted.tois is None and counted.counts is None
        # Some copies are reset, and go again; the others stay.
        batch.place(np.stack([start, start]), worlds=[3, 0])
        expected = target.copy()
        expected[[3, 0]] = start
        assert (batch.positions == expected).all()
        again = batch.step(target[[0, 3]], worlds=[0, 3])
        assert again.counts.tolist() == [told.counts[0], 0, 0, told.counts[3], 0]
        assert (batch.positions == target).all()
        batch.trial(np.broadcast_to(start, (5, 6, 3)))
        batch.commit(0.5)
        assert np.allclose(batch.positions, at_fractions(fractions / 2), atol=1e-6)


def test_rigid_bodies_of_a_batch_go_by_poses(anywhere):
    down = np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, -2]], float)
    stay = np.eye(3, 4)
    with anywhere.batch(3, BEFORE, FACES, bodies=[Body(3), Body(3, "rigid")]) as batch:
        told = batch.trial(poses=np.stack([down, stay, down])[:, None], tier="exact")
        assert (told.counts > 0).tolist() == [True, False, True] and told.tois[0] == 0.5
        moved = np.broadcast_to(BEFORE[:3] - [0, 0, 5], (3, 3, 3))
        assert batch.poses.tobytes() == np.stack([stay] * 3).tobytes(), "a trial moves nothing"
        both = batch.step(moved, poses=np.stack([down, stay, down])[:, None])
        assert batch.poses.shape == (3, 1, 3, 4) and (batch.poses[:, 0] == [down, stay, down]).all()
        assert not both and (batch.positions[:, :3] == moved).all() and (batch.positions[[0, 2], 3:] == AFTER[3:]).all()
        told = batch.step(BEFORE[None, :3] + [0, 0, 2], poses=stay[None, None], worlds=[2])
        assert (told.counts > 0).tolist() == [False, False, True], "both come back, one through the other"
        with pytest.raises(InvalidArgumentError, match=r"poses: shape \(3, 3, 4\); give \(3, 1, 3, 4\)"):
            batch.step(poses=np.stack([down] * 3))


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("screw", [False, True])
def test_each_copy_goes_as_far_as_it_may(anywhere, screw, dtype):
    """As copies that are alone, each of which commits its own part of its way."""
    turned = np.array([[0, -1, 0, 0.5], [1, 0, 0, 0], [0, 0, 1, -2]], float)
    start, ends = BEFORE.astype(dtype), at_fractions([1, 0.25, 0.75, 4, 0]).astype(dtype)[:, :3]
    poses = np.stack([turned, turned, np.eye(3, 4), turned, turned])[:, None]
    bodies = [Body(3), Body(3, "rigid", screw=screw)]
    with anywhere.batch(5, start, FACES, bodies=bodies, shared=[GROUND]) as batch:
        limits = batch.max_step(ends, poses=poses)
        fractions = np.where(limits < 1, 0.9 * limits, [1, 0, 1, 1, 1])
        at, placed = batch.part_way(fractions, ends, poses=poses)
        assert not batch.step(at, poses=placed) or not screw
        for copy in range(5):
            rigid = warmfront.screw_way(np.eye(3, 4), poses[copy, 0], fractions[copy], dtype)
            assert batch.session.poses[1 + 2 * copy + 1].tobytes() == batch.poses[copy, 0].tobytes() == rigid.tobytes()
            with anywhere.session(start, FACES, bodies=bodies) as alone:
                alone.trial(bodies={0: ends[copy]}, poses={1: poses[copy, 0]})
                alone.commit(fractions[copy])
                assert batch.positions[copy, :3].tobytes() == alone.positions[:3].tobytes()
                assert not screw or batch.positions[copy].tobytes() == alone.positions.tobytes()
        whole = at_fractions([0.5, 1, 0, 4, 1]).astype(dtype)
        at, none = batch.part_way([0.5, 0, 1, 0.25, 1], whole)
        assert none is None and at.dtype == dtype and (at[[1, 2, 4]] == np.stack([batch.positions[1], whole[2], whole[4]])).all()
        for message, wrong in ((r"fractions: shape \(4,\); give \(5,\)", [1] * 4), (r"fractions\[2\]: 1.5 is not in", [0, 1, 1.5, 0, 0]),
                               (r"fractions\[0\]: nan is not in", [np.nan] * 5)):
            with pytest.raises(InvalidArgumentError, match=message):
                batch.part_way(wrong, whole)
        with pytest.raises(InvalidArgumentError, match="positions: give where the copies go, or poses"):
            batch.part_way(fractions, None)
        with pytest.raises(InvalidArgumentError, match="one for all copies; part_way"):
            batch.commit(fractions)


def test_a_body_that_leaves_its_world_is_found_out(anywhere):
    with anywhere.batch(3, BEFORE, FACES, bodies=PAIR, shared=[GROUND]) as batch:
        batch.session.change_body(3, Body(3))  # as it was, but for its world
        with pytest.raises(FailedPreconditionError, match="body 3 of the session beneath is of world 0 now, and not of its own, 2"):
            batch.proximity(1)
        batch.session.change_body(3, dataclasses.replace(batch.session.bodies[3], world=2, thickness=0.01))
        assert batch.step(at_fractions([0, 1, 0])).counts.tolist()[::2] == [0, 0]
        batch.session.change_body(3, dataclasses.replace(batch.session.bodies[3], kind="removed", world=0))
        assert batch.proximity(0.1).counts.tolist() == [0, 0, 0]


def test_which_copies_are_tangled(anywhere):
    with anywhere.batch(4, BEFORE, FACES, bodies=PAIR, shared=[GROUND]) as batch:
        batch.place(at_fractions([0, 0.5, 1, 2]))
        assert (batch.intersections() > 0).tolist() == [False, True, False, True], "the last one is in the ground"
        assert batch.intersections().tolist()[1] == len(batch.session.intersections().edges) - batch.intersections()[3]
        with pytest.raises(InvalidArgumentError, match="report: which copies"):
            batch.intersections(report="any")


def test_half_spaces_are_shared_or_each_copys_own(anywhere):
    plane = lambda z, **more: Body(kind="static", half_space=((0, 0, z), (0, 0, 1)), **more)
    with anywhere.batch(3, BEFORE, FACES, bodies=[*PAIR, plane(-0.75)], shared=[(plane(-1.5), None, None), GROUND]) as batch:
        target = at_fractions([0.75, 0.95, 1.5])  # down to -0.5, -0.9 and -2
        told = batch.trial(target)
        half = told.contacts.kind == warmfront.Kind.VERTEX_HALF_SPACE
        rows = [(int(world), v[0] == v[2], int(v[3])) for world, v in zip(told.world[half], told.v[half])]
        assert sorted(rows) == sorted([(1, True, 2)] * 3 + [(2, True, 2)] * 3 + [(2, True, -1)] * 3)
        assert set(told.v[half][:, 0].tolist()) == {3, 4, 5}
        limits = batch.max_step(target)
        assert limits.tolist() == pytest.approx([told.tois[world] for world in range(3)])
        with pytest.raises(InvalidArgumentError, match=r"shared\[0\].positions"):
            anywhere.batch(3, BEFORE, FACES, shared=[(Body(3), [[0, 1, 2]], None)])


def test_the_first_contact_is_that_of_the_least_time(anywhere):
    for tier in ("certified", "exact"):
        with anywhere.batch(3, BEFORE, FACES, bodies=PAIR) as batch:
            poses = at_fractions([0.75, 0.25, 4])
            limit = batch.session.max_step(poses.reshape(-1, 3), tier=tier)
            assert limit.fraction == limit.first.toi == limit.world_fractions.min() and set(limit.first.v) <= set(range(12, 18))


def test_a_batch_ends_where_the_session_is_laid_out_otherwise(anywhere):
    with anywhere.batch(2, BEFORE, FACES, bodies=PAIR) as batch:
        batch.session.change_filters({"within_edges": 1})
        batch.session.change_body(0, Body(3, name="renamed", world=1))
        batch.session.replace_elements(0, [[2, 1, 0]])
        assert batch.step(at_fractions([1, 0.25])).counts.tolist()[0] > 0
        batch.session.replace_body(0, BEFORE[:4], [[0, 1, 2], [1, 2, 3]])
        for ask in (lambda: batch.step(at_fractions([0, 0])), lambda: batch.positions, lambda: batch.proximity(1),
                    lambda: batch.vertex_distances(1), lambda: batch.max_step(at_fractions([0, 0]))):
            with pytest.raises(FailedPreconditionError, match="batch: the session beneath has another number of vertices"):
                ask()


@pytest.mark.parametrize("kind", ["static", "deformable"])
def test_no_copies_may_go_or_be_placed(anywhere, kind):
    with anywhere.batch(3, BEFORE, FACES, bodies=[Body(3, kind), Body(3)]) as batch:
        before = batch.positions.copy()
        batch.place(np.empty((0, 6, 3)), worlds=[])
        batch.place(before[1:2], worlds=np.array([False, True, False]))
        assert batch.step(np.empty((0, 6, 3)), worlds=[]).counts.tolist() == [0, 0, 0]
        assert (batch.positions == before).all()


def test_it_comes_again_with_the_session(daemon, client):
    def play(disturb):
        answers = []
        with client.batch(4, BEFORE, FACES, bodies=PAIR, shared=[GROUND]) as batch:
            answers.append(batch.step(at_fractions([1, 0.25, 0.75, 4])))
            disturb()
            batch.place(np.stack([BEFORE]), worlds=[1])
            disturb()
            answers.append(batch.step(at_fractions([0, 1, 0, 0])))
            return [bits(answer.contacts) for answer in answers], [answer.counts.tolist() for answer in answers], batch.session.resumes

    undisturbed, counts, none = play(lambda: None)
    again, counted, resumes = play(daemon.restart)
    assert again == undisturbed and counts == counted and (none, resumes) == (0, 2)
    assert all(count > 0 for count in counts[1])


@pytest.mark.parametrize("message, arguments", [
    (r"count: 0; give how many", {"count": 0}),
    (r"count: 1.5; give how many", {"count": 1.5}),
    (r"positions: shape \(3, 6, 3\); give \(n, 3\) for all copies, or \(2, n, 3\)", {"positions": np.stack([BEFORE] * 3)}),
    (r"bodies: world is each copy's own", {"bodies": [Body(6, world=1)]}),
    (r"bodies: cover 3 of 6 vertices", {"bodies": [Body(3)]}),
    (r"shared: a body that is in all copies", {"shared": [(Body(4, world=1), *GROUND[1:])]}),
    (r"shared\[0\].positions: shape", {"shared": [(Body(5), *GROUND[1:])]}),
    (r"shared\[0\]: a Body; give \(Body, faces, positions\)", {"shared": [Body(3)]}),
    (r"shared\[0\]: a tuple; give", {"shared": [(GROUND[0],)]}),
    (r"filters: there is no 'within'; give PairFilters, or a dict of its fields: within_edges,", {"filters": {"within": 1}}),
    (r"copies of 6 vertices are 2\^31", {"count": 1 << 30}),
])
def test_what_is_no_batch_is_refused(client, message, arguments):
    with pytest.raises(InvalidArgumentError, match=message):
        client.batch(**{"count": 2, "positions": BEFORE, "faces": FACES, **arguments})
    assert client.list_sessions() == []


def test_what_does_not_fit_a_batch_is_refused(anywhere):
    with anywhere.batch(2, BEFORE, FACES, bodies=[Body(3, "static"), Body(3)]) as batch:
        for message, arguments in (
                (r"positions: shape \(6, 3\); give \(2, 6, 3\)", {"positions": BEFORE}),
                (r"worlds: copy 2 is not in \[0, 2\)", {"positions": BEFORE[None], "worlds": [2]}),
                (r"worlds: names copy 1 twice", {"positions": np.stack([BEFORE] * 2), "worlds": [1, 1]}),
                (r"worlds: a mask of 3 where there are 2 copies", {"positions": BEFORE[None], "worlds": [False, True, False]}),
                (r"positions: give where the copies go", {}),
                (r"positions\[0, 0\]: a vertex of a static body, which does not move", {"positions": BEFORE[None] + 1, "worlds": [1]}),
                (r"positions: shape \(2, 6, 3\); give \(2, 3, 3\), beside poses the vertices of deformable bodies alone",
                 {"positions": np.stack([AFTER] * 2), "poses": np.zeros((2, 0, 3, 4))}),
                (r"poses: shape", {"poses": np.eye(3, 4)})):
            with pytest.raises(InvalidArgumentError, match=message):
                batch.step(**arguments)
        with pytest.raises(InvalidArgumentError, match="world: 2 is not in"):
            batch.step(np.stack([AFTER] * 2)).rows(2)
        with pytest.raises(TypeError, match=r"max_step\(\) got an unexpected keyword argument 'kep'"):
            batch.max_step(np.stack([AFTER] * 2), kep=0.1)
        with pytest.raises(InvalidArgumentError, match=r'"body 1 of copy 1"\): positions\[2\].z: is not a number'):
            batch.step(np.where(np.arange(18).reshape(6, 3) == 17, np.nan, BEFORE)[None], worlds=[1])
        assert batch.session.last_frame == 1
    with pytest.raises(FailedPreconditionError, match="the session is closed"):
        batch.step(np.stack([AFTER] * 2))


def test_a_daemon_that_is_older_than_worlds_is_not_asked(tmp_path):
    fake = FakeDaemon(tmp_path)
    try:
        with warmfront.connect(fake.address) as client:
            with pytest.raises(UnimplementedError, match="worlds: the daemon is older"):
                client.batch(2, BEFORE, FACES)
            assert fake.received == [] and not fake.copies
            with client.session(BEFORE[:3], FACES[:1], bodies=[Body(3)]) as session:
                with pytest.raises(UnimplementedError, match="worlds: the daemon is older"):
                    session.change_body(0, Body(3, world=1))
                with pytest.raises(UnimplementedError, match="worlds: the daemon is older"):
                    session.add_body(Body(3, world=1), FACES[:1], BEFORE[:3])
    finally:
        fake.stop()
