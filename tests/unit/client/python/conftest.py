# SPDX-License-Identifier: Apache-2.0
"""The real daemon and the command line, for tests of the Python client. $WARMFRONT_BIN holds both."""
import json
import os
import pathlib
import re
import signal
import subprocess
import time

import numpy as np
import pytest

import warmfront

BIN = pathlib.Path(os.environ["WARMFRONT_BIN"])


class Daemon:
    """A warmfrontd on a Unix socket and a free port of this machine; it may be killed and started again."""

    def __init__(self, folder, flags=()):
        self._log = folder / "log"
        self._flags = list(flags)
        if "--threads" not in self._flags:
            self._flags += ["--threads", "2"]
        self.address = f"unix:{folder}/d.sock"
        self.process = None
        self.start()

    def start(self):
        with open(self._log, "ab") as log:
            self.process = subprocess.Popen(
                [BIN / "warmfrontd", "--listen", self.address, "--listen", "127.0.0.1:0", "--log-format", "json",
                 *self._flags], stderr=log)

    def tcp(self):
        """The other address; the daemon logs the port that it was given."""
        for _ in range(500):
            if found := re.findall(r'"address":"(127\.0\.0\.1:\d+)"', self._log.read_text()):
                return found[-1]
            time.sleep(0.01)
        raise AssertionError("the daemon did not start: " + self._log.read_text())

    def send(self, number):
        self.process.send_signal(number)

    def kill(self):
        if self.process.poll() is None:
            self.send(signal.SIGCONT)
            self.process.kill()
        return self.process.wait(30)

    def restart(self):
        self.kill()
        self.start()


@pytest.fixture
def start_daemon(tmp_path):
    """start_daemon(*flags) -> Daemon, ended with the test."""
    daemons = []

    def start(*flags):
        folder = tmp_path / f"daemon{len(daemons)}"
        folder.mkdir()
        daemons.append(Daemon(folder, flags))
        return daemons[-1]

    yield start
    for daemon in daemons:
        daemon.kill()


@pytest.fixture
def daemon(start_daemon):
    return start_daemon()


@pytest.fixture(scope="module")
def shared_daemon(tmp_path_factory):
    daemon = Daemon(tmp_path_factory.mktemp("shared"))
    yield daemon
    assert daemon.process.poll() is None
    daemon.kill()


@pytest.fixture
def client(request):
    """Of the daemon that the test has for itself; where it asks for none, of one that it shares with its module's."""
    daemon = request.getfixturevalue("daemon" if "daemon" in request.fixturenames else "shared_daemon")
    with warmfront.connect(daemon.address) as connected:
        yield connected


class Here:
    """Sessions in this process, made as a client makes them."""

    session = staticmethod(warmfront.Collider)
    batch = staticmethod(warmfront.open_batch)


@pytest.fixture(params=["daemon", "here"])
def anywhere(request):
    """What makes sessions: a client of a daemon, and this process. What is asked of either is answered alike."""
    if request.param == "daemon":
        return request.getfixturevalue("client")
    if not warmfront.has_engine():
        pytest.skip("this package has no engine: built without pybind11-dev, or with sanitizers")
    return Here()


class Scene:
    """A built-in scene as `warmfront scene` writes it: faces (m, 3), frames (k, n, 3) float32, bodies."""

    def __init__(self, folder):
        self.folder = folder
        info = json.loads((folder / "info.json").read_text())
        self.bodies = [warmfront.Body(body["vertex_count"], body["kind"], body["name"]) for body in info["bodies"]]
        mesh = (folder / "mesh.ply").read_bytes()
        body = mesh[mesh.index(b"end_header\n") + len(b"end_header\n") + 12 * info["vertices"]:]
        rows = np.frombuffer(body, [("count", "u1"), ("v", "<i4", 3)])
        assert (rows["count"] == 3).all()
        self.faces = rows["v"]
        cache = (folder / "frames.pc2").read_bytes()
        self.frames = np.frombuffer(cache, "<f4", offset=32).reshape(-1, info["vertices"], 3)


@pytest.fixture(scope="session")
def cloth(tmp_path_factory):
    """A cloth that falls on a ball: 539 vertices, 60 frames."""
    return write_scene(tmp_path_factory, "cloth-ball")


@pytest.fixture(scope="session")
def crowd(tmp_path_factory):
    """Rigid balls that knock together."""
    return write_scene(tmp_path_factory, "n-body")


def write_scene(tmp_path_factory, name):
    folder = tmp_path_factory.mktemp(name)
    subprocess.run([BIN / "warmfront", "scene", name, "--triangles", "1000", "--out", folder], check=True,
                   stdout=subprocess.DEVNULL)
    return Scene(folder)
