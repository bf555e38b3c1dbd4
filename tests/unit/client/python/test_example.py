# SPDX-License-Identifier: Apache-2.0
"""The examples are right about themselves: nothing passes through, and where nothing is asked, it is found out."""
import os
import pathlib
import subprocess
import sys

import pytest
from conftest import BIN

EXAMPLES = pathlib.Path(os.environ["WARMFRONT_EXAMPLES"])


def run(name, *arguments):
    return subprocess.run([sys.executable, EXAMPLES / name, *arguments], stdout=subprocess.PIPE, text=True,
                          env={**os.environ, "WARMFRONTD": str(BIN / "warmfrontd")})


@pytest.mark.parametrize("own", [False, True])
def test_nothing_passes_through(daemon, own):
    done = run("cloth_on_ball.py", "--steps", "45", *([] if own else ["--server", daemon.tcp()]))
    last = done.stdout.splitlines()[-1]
    assert done.returncode == 0 and "exact tier: 0: nothing passed through" in last
    assert int(last.split()[0]) > 0  # steps were cut where something would have been met


def test_a_solver_that_does_not_ask_is_found_out(daemon):
    done = run("cloth_on_ball.py", "--steps", "45", "--blind", "--server", daemon.tcp())
    assert done.returncode == 1 and "something passed through" in done.stdout.splitlines()[-1]


def test_a_barrier_keeps_everything_apart(daemon):
    done = run("barrier_newton.py", "--steps", "18", "--server", daemon.tcp())
    *steps, last = done.stdout.splitlines()
    assert done.returncode == 0 and "exact tier: 0: nothing touched" in last
    nearest = [float(line.split("nearest ")[1].split(",")[0]) for line in steps[1:]]
    assert min(nearest) < 0.01 and min(nearest) > 0  # the barrier was at work
    iterations = [int(line.split(":")[1].split()[0]) for line in steps[1:]]
    assert max(iterations) < 60  # and its minimum was found
