# SPDX-License-Identifier: Apache-2.0
"""The example is right about itself: nothing passes through, and where nothing is asked, it is found out."""
import os
import subprocess
import sys

EXAMPLE = os.path.join(os.environ["WARMFRONT_EXAMPLES"], "cloth_on_ball.py")


def run(daemon, *arguments):
    return subprocess.run([sys.executable, EXAMPLE, "--server", daemon.tcp(), "--steps", "45", *arguments],
                          stdout=subprocess.PIPE, text=True)


def test_nothing_passes_through(daemon):
    done = run(daemon)
    last = done.stdout.splitlines()[-1]
    assert done.returncode == 0 and "exact tier: 0: nothing passed through" in last
    assert int(last.split()[0]) > 0  # steps were cut where something would have been met


def test_a_solver_that_does_not_ask_is_found_out(daemon):
    done = run(daemon, "--blind")
    assert done.returncode == 1 and "something passed through" in done.stdout.splitlines()[-1]
