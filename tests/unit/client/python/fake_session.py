# SPDX-License-Identifier: Apache-2.0
"""A session of a daemon that does what the test says; fixtures."""
import numpy as np
import pytest
from fake_daemon import FakeDaemon

import warmfront

FACES = [[0, 1, 2]]


@pytest.fixture
def fake(tmp_path):
    daemon = FakeDaemon(tmp_path)
    yield daemon
    daemon.stop()


@pytest.fixture
def client(fake):
    with warmfront.connect(fake.address) as connected:
        yield connected


@pytest.fixture(params=[np.float32, np.float64])
def session(client, request):
    with client.session(draw(0, request.param), FACES) as made:
        yield made


def draw(seed, dtype=np.float64):
    return np.random.default_rng(seed).standard_normal((3, 3)).astype(dtype)


def sent(fake):
    """The requests that arrived since the last call."""
    words, fake.received[:] = list(fake.received), []
    return [word for word in words]


def once(*words):
    """Disturbs the first request of these words: once("trial 1", "cut")."""
    wanted, what = words
    left = [what]
    return lambda came: left.pop() if came == wanted and left else None
