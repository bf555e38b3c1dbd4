# SPDX-License-Identifier: Apache-2.0
"""The command line, and a scene with everything that it writes. $WARMFRONT_BIN holds `warmfront`."""
import os
import pathlib
import subprocess

import pytest

WARMFRONT = pathlib.Path(os.environ["WARMFRONT_BIN"]) / "warmfront"


def run(*arguments):
    return subprocess.run([WARMFRONT, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def detect(*arguments):
    return run("detect", *arguments)


@pytest.fixture(scope="session")
def folder(tmp_path_factory):
    """A cloth that falls on a ball, as files; its page, contacts, meshes and report."""
    where = tmp_path_factory.mktemp("page")
    assert run("scene", "cloth-ball", "--triangles", "1000", "--out", where).returncode == 0
    done = detect(where, "--html", where / "page.html", "--contacts", where / "contacts.csv", "--json", where / "report.json",
                  "--meshes", where / "mesh.vtp")
    assert done.returncode == 0, done.stderr
    return where
