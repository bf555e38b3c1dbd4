# SPDX-License-Identifier: Apache-2.0
"""A caller's span is the parent of the daemon's spans of its frames: of clients in Python, and of the command line."""
import json
import os
import signal
import subprocess

import pytest
from conftest import BIN
from support import triangle_through_triangle

import warmfront

BEFORE, AFTER, FACES = triangle_through_triangle()
OURS = "00-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01"
ANOTHER = "00-11111111111111111111111111111111-2222222222222222-01"


@pytest.fixture
def traced(start_daemon, tmp_path):
    """A daemon that traces what its callers ask for; traced.frames() ends it and has (trace, parent, status) of each frame."""
    daemon = start_daemon("--trace-file", str(tmp_path / "traces"), "--trace-sample", "0")

    def frames():
        daemon.send(signal.SIGTERM)
        assert daemon.process.wait(60) == 0
        requests = [json.loads(line) for line in (tmp_path / "traces").read_text().splitlines()]
        spans = [span for request in requests for span in request["resourceSpans"][0]["scopeSpans"][0]["spans"]]
        return [(span["traceId"], span["parentSpanId"], span.get("status")) for span in spans if span["kind"] == 2]

    daemon.frames = frames
    return daemon


def test_of_a_client_and_of_a_session(traced):
    with warmfront.connect(traced.address) as plain, plain.session(BEFORE, FACES) as session:
        session.step(AFTER)
    with warmfront.connect(traced.address, traceparent=OURS) as solver:
        with solver.session(BEFORE, FACES) as session:
            session.step(AFTER)
            with pytest.raises(warmfront.InvalidArgumentError):  # which reaches the daemon: a vertex twice
                session.step(vertices=[1, 1], vertex_positions=AFTER[:2])
        with solver.session(BEFORE, FACES, traceparent=ANOTHER) as session:
            session.step(AFTER)
    with warmfront.open(BEFORE, FACES, server=traced.address, traceparent=OURS) as session:
        session.step(AFTER)
    frames = traced.frames()
    assert [frame[:2] for frame in frames] == [tuple(OURS.split("-")[1:3])] * 2 + [
        tuple(ANOTHER.split("-")[1:3]), tuple(OURS.split("-")[1:3])]
    assert [frame[2] is None for frame in frames] == [True, False, True, True]
    assert frames[1][2]["code"] == 2 and "vertex 1 is named twice" in frames[1][2]["message"]


@pytest.mark.parametrize("later", ["01" + OURS[2:], "cc" + OURS[2:] + "-what-the-future-is"])
def test_a_later_version_is_sent_as_it_is(client, later):
    with client.session(BEFORE, FACES, traceparent=later) as session:
        session.step(BEFORE)


@pytest.mark.parametrize("wrong", ["mine", OURS.upper(), OURS[:-1], OURS + "-x", OURS.replace("b7ad6b7169203331", "0" * 16),
                                   "ff" + OURS[2:], "01" + OURS[2:] + "x", "01" + OURS[2:] + "-\n", 7])
def test_what_is_none_is_refused(client, wrong):
    message = "traceparent .*: 00-TRACE-SPAN-FLAGS of W3C Trace Context is expected"
    with pytest.raises(warmfront.InvalidArgumentError, match=message):
        client.session(BEFORE, FACES, traceparent=wrong)
    with pytest.raises(warmfront.InvalidArgumentError, match=message):
        warmfront.connect("127.0.0.1:1", traceparent=wrong)
    with pytest.raises(warmfront.InvalidArgumentError, match="traceparent: it is of a connection"):
        warmfront.open(BEFORE, FACES, traceparent=OURS)


def test_of_the_command_line(traced):
    def detect(traceparent, *more):
        return subprocess.run([BIN / "warmfront", "detect", "builtin:cloth-ball?triangles=1000&frames=3", *more], stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE, text=True, env={**os.environ, "TRACEPARENT": traceparent})

    assert detect(OURS, "--server", traced.address).returncode == 0
    assert detect("", "--server", traced.address).returncode == 0
    assert detect("mine").returncode == 0, "of no use in this process"
    refused = detect("mine", "--server", traced.address)
    assert refused.returncode == 3
    assert "TRACEPARENT: the environment's 'mine': 00-TRACE-SPAN-FLAGS of W3C Trace Context" in refused.stderr
    assert [frame[:2] for frame in traced.frames()] == [tuple(OURS.split("-")[1:3])] * 2
