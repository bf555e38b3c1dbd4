# SPDX-License-Identifier: Apache-2.0
"""Bodies that move along screws: what they meet, where a commit leaves them, also when the daemon dies, and refusals."""
import numpy as np
import pytest
from fake_daemon import FakeDaemon

import warmfront
from warmfront import Body, InvalidArgumentError, UnimplementedError
from warmfront._part_way import pose_part_way
from warmfront._screw import pose_along_screw, poses_along_screws

HAND = np.array([[0, -0.1, 0], [0, 0.1, 0], [2, 0, 0]], float)
POINTS = np.array([[1, 3**0.5, 0], [0.25, 0.43, 0]])
FACES = [[0, 1, 2]]
X = np.concatenate([HAND, POINTS])


def turned(angle, shift=(0, 0, 0)):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0, shift[0]], [s, c, 0, shift[1]], [0, 0, 1, shift[2]]])


def session(client, screw=True, dtype=np.float64, **given):
    given.setdefault("options", warmfront.Options(min_separation=0.01))
    return client.session(X.astype(dtype), FACES, bodies=[Body(3, "rigid", screw=screw), Body(2, "static")], **given)


def test_it_meets_on_its_arc_what_lines_miss(client):
    with session(client) as arcs, session(client, screw=False) as lines:
        assert arcs.info().screw_count == 1 and lines.info().screw_count == 0
        along = arcs.step(poses={0: turned(2 * np.pi / 3)})
        assert along.v[:, 0].tolist() == [3, 4] and abs(along.toi[0] - 0.5) < 0.01
        assert 3 not in lines.step(poses={0: turned(2 * np.pi / 3)}).v[:, 0]


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("f", [0, 5e-324, 0.1, 1 / 3, 0.5, 0.9, 1 - 2**-53, 1])
def test_a_commit_leaves_the_daemon_and_the_client_at_the_same_bits(client, dtype, f):
    numbers = np.random.default_rng(int(1000 * f))
    with session(client, dtype=dtype) as asked:
        for _ in range(5):
            pose = turned(numbers.uniform(-3, 3), numbers.uniform(-1, 1, 3))
            asked.trial(poses={0: pose})
            asked.commit(f)
            # The daemon tells of where it is by a digest of positions and poses, which the client compares.
            assert asked.step(poses={0: pose}) is not None


@pytest.mark.parametrize("count", [2, 40])
def test_a_commit_of_many_bodies_leaves_them_where_that_of_each_does(client, count):
    numbers = np.random.default_rng(count)
    positions = np.concatenate([HAND + [0, 0, 10 * b] for b in range(count)])
    faces = np.arange(3 * count).reshape(-1, 3)
    bodies = [Body(3, "rigid", screw=b % 3 != 1) for b in range(count)]
    with client.session(positions, faces, bodies=bodies) as asked:
        at = [np.eye(3, 4)] * count
        for f in (0.3, 1, 0, 0.7):
            ends = [turned(numbers.uniform(-3, 3), numbers.uniform(-1, 1, 3)) for _ in range(count)]
            given = dict(enumerate(ends)) if f != 0.7 else {1: ends[1]}
            ways = [pose_along_screw if body.screw else pose_part_way for body in bodies]
            at = [ways[b](at[b], given[b], f, np.dtype("f8")) if b in given else at[b] for b in range(count)]
            asked.trial(poses=given)
            asked.commit(f)
            assert np.array([asked.poses[b] for b in range(count)]).tobytes() == np.array(at).tobytes()
        asked.step(poses={0: at[0]})  # of what the daemon's digest says, too


def test_part_of_a_screw_is_as_far_from_its_axis():
    start, end = turned(0.3, (1, 0, 0)), turned(2.5, (1, 0, 2))
    for f in np.linspace(0, 1, 11):
        pose = pose_along_screw(start, end, float(f), np.dtype("f8"))
        assert np.allclose(pose[:, :3] @ pose[:, :3].T, np.eye(3), atol=1e-14)
        assert np.allclose(pose[:, :3], turned(0.3 + 2.2 * f)[:, :3], atol=1e-14)
        assert abs(pose[2, 3] - 2 * f) < 1e-14
    assert pose_along_screw(start, end, 0, np.dtype("f8")).tobytes() == start.tobytes()
    assert pose_along_screw(start, end, 1, np.dtype("f8")).tobytes() == end.tobytes()


@pytest.mark.parametrize("dtype", [np.dtype("f4"), np.dtype("f8")])
def test_many_poses_have_the_bits_of_each(dtype):
    numbers = np.random.default_rng(3)
    angles = [0, 1e-300, 1e-160, 1e-8, 0.1, 1, 2, np.pi - 1e-9, np.pi]
    ways = []
    for size in (0, 1e-30, 1, 1e37 if dtype == np.dtype("f4") else 1.7e308):
        for angle in angles:
            for f in (0, 5e-324, 0.3, 1 - 2**-53, 1):
                turn, shifts = np.roll(turned(angle)[:, :3], numbers.integers(3), (0, 1)), numbers.uniform(-1, 1, (2, 3)) * size
                start = np.roll(turned(numbers.uniform(-3, 3)), numbers.integers(3), axis=0)
                ways.append((np.column_stack([start[:, :3], shifts[0]]), np.column_stack([turn @ start[:, :3], shifts[1]]), f))
                ways.append((start, start, f))
                ways.append((start, -0.0 * start + start, f))
    starts, ends = (np.array(poses).astype(dtype).astype(np.float64) for poses in list(zip(*ways))[:2])
    fractions = np.array([f for _, _, f in ways])
    together = poses_along_screws(starts, ends, fractions, dtype)
    for k, pose in enumerate(together):
        assert pose.tobytes() == pose_along_screw(starts[k], ends[k], float(fractions[k]), dtype).tobytes(), ways[k]


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_a_program_may_ask_where_part_of_a_screw_ends(client, dtype):
    start, end = turned(0.1), turned(2 * np.pi / 3)
    with session(client, dtype=dtype) as asked, session(client, dtype=dtype) as told:
        for one in (asked, told):
            one.place(poses={0: start})
        asked.trial(poses={0: end})
        asked.commit(0.4)
        assert asked.poses[0].tobytes() == warmfront.screw_way(start, end, 0.4, dtype).tobytes()
        told.place(poses={0: warmfront.screw_way(start, end, 0.4, dtype)})
        assert asked.positions.tobytes() == told.positions.tobytes()
        onward = [one.step(poses={0: end}) for one in (asked, told)]
        assert onward[0].toi.tobytes() == onward[1].toi.tobytes() and len(onward[0]) > 0
    with pytest.raises(InvalidArgumentError, match="fraction: 2"):
        warmfront.screw_way(start, end, 2)
    with pytest.raises(InvalidArgumentError, match="end"):
        warmfront.screw_way(start, np.eye(3), 0.5)
    with pytest.raises(InvalidArgumentError, match="dtype: int32"):
        warmfront.screw_way(start, end, 0.5, "i4")


@pytest.mark.parametrize("message, matrix", [
    (r"is not a number", np.eye(3, 4) * np.nan),
    (r"its 3x3 part mirrors", np.eye(3, 4) * [[-1, 1, 1, 1]]),
    (r"columns 0 and 0 of its 3x3 part have the product 4.000000 where 1 is expected, give or take 1e-05", np.eye(3, 4) * 2),
    (r"columns 1 and 1 .* the product 1.000022", np.eye(3, 4) * [[1, 1 + 1.1e-5, 1, 1]]),
    (r"columns 0 and 1 .* the product 0.100000", np.eye(3, 4) + [[0, 0.1, 0, 0], [0, -0.005, 0, 0], [0, 0, 0, 0]]),
])
def test_what_is_no_pose_is_refused_by_sessions_and_of_a_way(client, message, matrix):
    words = message.split(",")[0]
    with pytest.raises(InvalidArgumentError, match="end.*" + message):
        warmfront.screw_way(np.eye(3, 4), matrix, 0.5)
    with session(client) as asked, pytest.raises(InvalidArgumentError, match=words):
        asked.step(poses={0: matrix})


def test_it_goes_on_from_there_where_the_daemon_died(daemon):
    with warmfront.connect(daemon.address) as client, session(client) as asked, session(client) as undisturbed:
        for one in (asked, undisturbed):
            one.trial(poses={0: turned(2)})
            one.commit(0.4)
        daemon.restart()
        for angle in (2, -1, 1):
            assert asked.step(poses={0: turned(angle)}).toi.tolist() == undisturbed.step(poses={0: turned(angle)}).toi.tolist()


def test_what_cannot_be_is_refused(client):
    with pytest.raises(InvalidArgumentError, match="screw: the body is not rigid"):
        client.session(X, FACES, bodies=[Body(3, screw=True), Body(2, "static")])
    with pytest.raises(InvalidArgumentError, match="along a screw"):
        session(client, options=warmfront.Options(tier="exact"))
    with session(client) as asked:
        with pytest.raises(InvalidArgumentError, match="along a screw"):
            asked.trial(poses={0: turned(1)}, tier="exact")
        assert len(asked.step(poses={0: turned(1.2)})) > 0


def test_an_older_daemon_is_not_given_any(tmp_path):
    fake = FakeDaemon(tmp_path)
    try:
        with warmfront.connect(fake.address) as client:
            with pytest.raises(UnimplementedError, match="screw: the daemon is older"):
                session(client)
            assert fake.received == [] and not fake.copies
    finally:
        fake.stop()
