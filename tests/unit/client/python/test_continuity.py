# SPDX-License-Identifier: Apache-2.0
"""Which rows are new, kept and ended: against sets, of steps and of what is near, with a daemon that dies on the way."""
import numpy as np
import pytest
from support import triangle_through_triangle

import warmfront
from warmfront import Body, Kind, continuity

BEFORE, AFTER, FACES = triangle_through_triangle()


def key(contacts, row):
    if contacts.multiplicity is None:
        return (int(contacts.kind[row]), *map(int, contacts.v[row]))
    v = [int(x) for k, x in enumerate(contacts.v[row]) if contacts.stencil[row] >> k & 1]
    if len(v) == 4:
        return (int(contacts.kind[row]), *v)
    if len(v) == 2:
        return tuple(sorted(v))
    alone = v[0] if contacts.kind[row] == Kind.VERTEX_FACE or contacts.stencil[row] & 12 == 12 else v[-1]
    return (*sorted(set(v) - {alone}), "vertex", alone)


def expect(earlier, now):
    made = continuity(earlier, now)
    before = {key(earlier, i): i for i in range(len(earlier))} if earlier is not None else {}
    after = [key(now, i) for i in range(len(now))]
    assert list(made.kept) == [before.get(k, -1) for k in after] and made.kept.dtype == np.int64
    assert list(made.ended) == sorted(i for k, i in before.items() if k not in set(after))
    assert (made.new == (made.kept < 0)).all()
    return made


@pytest.mark.parametrize("reduced", [False, True])
def test_is_what_sets_say_also_where_a_daemon_dies(start_daemon, client, cloth, reduced):
    daemon = start_daemon()
    def ask(each, frame, last):
        step = each.step(frame)
        near = each.proximity(0.03, reduced=reduced)
        return step, near, continuity(last[0], step), continuity(last[1], near)

    with warmfront.connect(daemon.address) as mortal, mortal.session(cloth.frames[25], cloth.faces, bodies=cloth.bodies) as other, \
            client.session(cloth.frames[25], cloth.faces, bodies=cloth.bodies) as session:
        here = there = (None, None)
        kept = new = ended = 0
        for k, frame in enumerate(cloth.frames[26:32]):
            if k in (2, 4):
                daemon.restart()
            step, near, *of_session = ask(session, frame, here)
            *there_now, again_step, again_near = ask(other, frame, there)
            for made, again in zip(of_session, (again_step, again_near)):
                assert (made.kept == again.kept).all() and (made.ended == again.ended).all()
            expect(here[0], step)
            made = expect(here[1], near)
            kept, new, ended = kept + (made.kept >= 0).sum(), new + made.new.sum(), ended + len(made.ended)
            here, there = (step, near), tuple(there_now)
        assert min(kept, new, ended) > 10 and other.resumes > 0


def test_a_change_of_the_scene_keeps_what_was_there(anywhere):
    with anywhere.session(BEFORE, FACES, bodies=[Body(3), Body(3)]) as session:
        before = session.proximity(2.0)
        session.add_body(Body(3), [[0, 1, 2]], BEFORE[:3] + [0, 0, 0.1])
        session.change_body(0, Body(3, mask=2, group=2))
        after = session.proximity(2.0)
        made = expect(before, after)
        assert made.new.any() and (made.kept >= 0).sum() + len(made.ended) == len(before)
        session.change_body(0, Body(3))
        assert len(expect(before, session.proximity(2.0)).ended) == 0


def test_values_are_carried_over(anywhere):
    with anywhere.session(BEFORE, FACES) as session:
        none, some = session.proximity(1e-3), session.proximity(1.01)
        more = session.proximity(2.0)
        assert 0 < len(some) < len(more)
        for values in (np.arange(len(some)) + 1.5, np.arange(3.0 * len(some)).reshape(-1, 3) + 1, np.arange(len(some), dtype=np.float32),
                       list(range(len(some)))):
            made = continuity(some, more)
            carried = made.carry(values, new=-7)
            assert carried.shape == (len(more), *np.shape(values)[1:])
            assert (carried[made.new] == -7).all() and made.new.any()
            assert (carried[~made.new] == np.asarray(values)[made.kept[~made.new]]).all()
        assert made.carry(np.zeros(len(some), np.float32)).dtype == np.float32
        assert made.carry(np.zeros(len(some), int)).dtype == made.carry(list(range(len(some)))).dtype == np.float64
        assert (made.carry(np.zeros((len(some), 3)), new=[1, 2, 3])[made.new] == [1, 2, 3]).all()
        # Where one of the two answers has no rows, or is none.
        assert list(continuity(none, some).carry([])) == [0] * len(some)
        assert (continuity(None, some).carry(np.empty((0, 3))) == np.zeros((len(some), 3))).all()
        assert continuity(some, none).carry(np.ones((len(some), 3))).shape == (0, 3)
        with pytest.raises(ValueError, match=rf"carry: values of shape \(2, 3\); give \({len(some)}, ...\)"):
            made.carry(np.zeros((2, 3)))
        with pytest.raises(ValueError, match=r"shape \(\)"):
            made.carry(1.0)


def test_nothing_before_and_answers_that_differ(anywhere):
    with anywhere.session(BEFORE, FACES) as session:
        none, some = session.proximity(1e-3), session.proximity(2.0)
        assert expect(None, some).new.all() and len(expect(none, none).kept) == 0
        assert list(continuity(some, none).ended) == list(range(len(some)))
        with pytest.raises(ValueError, match="reduced"):
            continuity(some, session.proximity(2.0, reduced=True))
