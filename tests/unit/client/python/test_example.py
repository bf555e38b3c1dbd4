# SPDX-License-Identifier: Apache-2.0
"""The examples check themselves: nothing passes through, and with the collision questions left out that check fails."""
import os
import pathlib
import subprocess
import sys

import numpy as np
import pytest
from conftest import BIN

EXAMPLES = pathlib.Path(os.environ["WARMFRONT_EXAMPLES"])


def run(name, *arguments):
    return subprocess.run([sys.executable, EXAMPLES / name, *arguments], stdout=subprocess.PIPE, text=True,
                          env={**os.environ, "WARMFRONTD": str(BIN / "warmfrontd")})


@pytest.mark.parametrize("own", [False, True])
def test_nothing_passes_through(daemon, own):
    done = run("cloth_on_ball.py", "--steps", "33", *([] if own else ["--server", daemon.tcp()]))
    last = done.stdout.splitlines()[-1]
    assert done.returncode == 0 and "exact tier: 0: nothing passed through" in last
    assert int(last.split()[0]) > 0  # steps were cut where something would have been met


def test_a_solver_that_does_not_ask_is_found_out(daemon):
    done = run("cloth_on_ball.py", "--steps", "15", "--blind", "--server", daemon.tcp())
    assert done.returncode == 1 and "something passed through" in done.stdout.splitlines()[-1]


def test_a_barrier_keeps_everything_apart(daemon):
    done = run("barrier_newton.py", "--steps", "13", "--server", daemon.tcp())
    *steps, last = done.stdout.splitlines()
    assert done.returncode == 0 and "exact tier: 0: nothing touched" in last
    nearest = [float(line.split("nearest ")[1].split(",")[0]) for line in steps[1:]]
    assert min(nearest) < 0.01 and min(nearest) > 0  # the barrier was at work
    iterations = [int(line.split(":")[1].split()[0]) for line in steps[1:]]
    assert 30 < max(iterations) < 60  # and its minimum was found, also where that takes long


def test_tangles_are_found_and_shown(daemon, tmp_path):
    (tmp_path / "folder").mkdir()
    corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0.2 0.2 -1\nv 0.2 0.2 1\nv 2 2 0\n"
    (tmp_path / "pierced.obj").write_text(corners + "f 1 2 3\nf 4/1 5/2 6/3\n")
    (tmp_path / "flat.obj").write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf -4 -3 -2 -1\n")
    ply = ("ply\nformat {}\nelement vertex 6\nproperty float x\nproperty float y\nproperty float z\n"
           "element face 2\nproperty list uchar int vertex_indices\nend_header\n")
    x = np.array([word for line in corners.splitlines() for word in line.split()[1:]], "<f4")
    faces = b"".join(bytes([3]) + np.array(face, "<i4").tobytes() for face in ([0, 1, 2], [3, 4, 5]))
    (tmp_path / "folder" / "binary.ply").write_bytes(ply.format("binary_little_endian 1.0").encode() + x.tobytes() + faces)
    (tmp_path / "folder" / "text.ply").write_text(ply.format("ascii 1.0") + " ".join(map(str, x)) + "\n3 0 1 2\n3 3 4 5\n")
    page = tmp_path / "page.html"
    done = run("check_tangles.py", tmp_path, "--html", page, "--server", daemon.tcp())
    said = dict(line.split(":", 1) for line in done.stdout.splitlines()[:-1])
    assert done.returncode == 1 and done.stdout.splitlines()[-1] == "3 of 4 meshes tangled"
    assert said["flat.obj"] == " 0 pairs"
    pierced = said["pierced.obj"]
    assert pierced.startswith(" 2 pairs, the first at [")
    assert said["folder/binary.ply"] == said["folder/text.ply"] == pierced
    assert page.read_text().count("<svg") == 3
    (tmp_path / "broken.obj").write_text("f x\n")
    done = run("check_tangles.py", tmp_path, "--server", daemon.tcp())
    assert done.returncode == 2 and done.stdout.splitlines()[-1] == "3 of 5 meshes tangled, 1 not checked"
