# SPDX-License-Identifier: Apache-2.0
"""Daemons for the snippets of a test module, and a folder that holds what their commands name."""
import os
import shutil
import socket
import ssl
import subprocess
import time

import pytest
from pages import BIN, SOURCE

TOKENS = {"my-token": "a-token-of-a-user", "admin-token": "a-token-of-an-admin"}


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def serves(place):
    """Does something listen there, at a port or a Unix socket's path, before the time limit?"""
    for _ in range(600):
        try:
            if isinstance(place, int):
                socket.create_connection(("127.0.0.1", place)).close()
            else:
                with socket.socket(socket.AF_UNIX) as one:
                    one.connect(str(place))
            return True
        except OSError:
            time.sleep(0.1)
    return False


def stop(daemon):
    daemon.terminate()
    return daemon.wait(60)


@pytest.fixture(scope="module")
def address(tmp_path_factory):
    """A daemon on a Unix socket."""
    folder = tmp_path_factory.mktemp("daemon")
    daemon = subprocess.Popen([BIN / "warmfrontd", "--listen", f"unix:{folder}/d.sock"], stderr=subprocess.DEVNULL)
    yield f"unix:{folder}/d.sock"
    assert stop(daemon) == 0


@pytest.fixture(scope="module")
def credentials(tmp_path_factory):
    """A folder of the files that the pages name: certificate, key, tokens."""
    folder = tmp_path_factory.mktemp("credentials")
    subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-days", "60",
                    "-subj", "/CN=localhost", "-addext", "subjectAltName=IP:127.0.0.1", "-keyout", folder / "daemon.key",
                    "-out", folder / "daemon.pem"], check=True, stderr=subprocess.DEVNULL)
    (folder / "ca.pem").write_bytes((folder / "daemon.pem").read_bytes())
    for name, token in TOKENS.items():
        (folder / name).write_text(token + "\n")
    (folder / "tokens").write_text(f"{TOKENS['my-token']} alice\n{TOKENS['admin-token']} root admin\n")
    ssl.create_default_context(cafile=folder / "ca.pem")  # or the files are no good
    return folder


@pytest.fixture(scope="module")
def guarded(credentials):
    """Ports of a daemon with TLS and tokens: its own, and that of its metrics."""
    port, metrics = free_port(), free_port()
    daemon = subprocess.Popen([BIN / "warmfrontd", "--listen", f"127.0.0.1:{port}", "--tls-cert", credentials / "daemon.pem",
                               "--tls-key", credentials / "daemon.key", "--token-file", credentials / "tokens",
                               "--metrics-listen", f"127.0.0.1:{metrics}"], stderr=subprocess.DEVNULL)
    assert serves(port) and serves(metrics)
    yield port, metrics
    assert stop(daemon) == 0


def write_obj(path, offset):
    vertices = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (.25, .25, 1 - offset), (1.25, .25, 1 - offset), (.25, 1.25, 1 - offset)]
    path.write_text("".join("v {} {} {}\n".format(*v) for v in vertices) + "f 1 2 3\nf 4 5 6\n")


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    """A small scene, of which every page gets copies of its own."""
    folder = tmp_path_factory.mktemp("scene") / "cloth-ball"
    subprocess.run([BIN / "warmfront", "scene", "cloth-ball", "--triangles", "1000", "--frames", "4", "--out", folder], check=True,
                   stdout=subprocess.DEVNULL)
    return folder


@pytest.fixture
def sandbox(tmp_path, credentials, scene):
    """A folder in which the pages' commands find what they name; scenes are small ones."""
    for name in ("folder", "frames/cloth-ball", "data/frames/cloth-ball", "data/frames/n-body", "data/sequences/cloth-ball",
                 "data/sequences/cloth-ball-10k"):
        shutil.copytree(scene, tmp_path / name)
    for k in range(3):
        write_obj(tmp_path / f"t{k}.obj", k)
    # A vertex that falls through a triangle: eight rows, of rational numbers.
    rows = [(1, 1, 1), (0, 0, 0), (4, 0, 0), (0, 4, 0), (1, 1, -1), (0, 0, 0), (4, 0, 0), (0, 4, 0)]
    for folder in ("queries/vertex-face", "data/queries/vertex-face"):
        (tmp_path / folder).mkdir(parents=True)
        (tmp_path / folder / "some.csv").write_text("".join(f"{x},1,{y},1,{z},1,1\n" for x, y, z in rows))
    (tmp_path / "build/release").mkdir(parents=True)
    (tmp_path / "build/release/bin").symlink_to(BIN)
    (tmp_path / "build/release/python").symlink_to(os.environ["PYTHONPATH"])
    (tmp_path / "client").symlink_to(SOURCE / "client")
    for file in credentials.iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes())
    return tmp_path
