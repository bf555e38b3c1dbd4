# SPDX-License-Identifier: Apache-2.0
"""Signals while a question is computed in this process."""
from __future__ import annotations

import os
import statistics
import subprocess
import sys
import time

import pytest

import warmfront

BEFORE = f"""
import signal, sys, threading
sys.path.insert(0, {os.path.dirname(__file__)!r})
import warmfront
from asker import large
above, below, faces = large()
session = warmfront.Collider(above, faces, threads=1)
signal.signal(signal.SIGALRM, signal.default_int_handler)
"""


def run_on_a_large_scene(tmp_path, program):
    path = tmp_path / "program.py"
    path.write_text(BEFORE + program)
    return subprocess.run([sys.executable, str(path)], capture_output=True, text=True, timeout=300)


def test_an_interrupt_leaves_everything_as_it_was(tmp_path):
    """In a process of its own, which is interrupted while it computes."""
    done = run_on_a_large_scene(tmp_path, """
interrupts = 0
for k in range(20):
    frame = session.last_frame
    answered = False
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.001 + 0.004 * k)
        session.step(below if frame % 2 == 0 else above)
        answered = True
        threading.Event().wait(60)
    except KeyboardInterrupt:
        interrupts += not answered
    at = above if session.last_frame % 2 == 0 else below
    assert session.last_frame - frame in (0, 1) and session.positions.tobytes() == at.tobytes()
print("interrupted", interrupts, "of 20; then", len(session.step(above if session.last_frame % 2 else below)))
""")
    assert done.returncode == 0, done.stderr
    assert int(done.stdout.split()[1]) > 0, done.stdout


def test_an_interrupt_stops_a_long_question_after_brief_ones(tmp_path):
    """All pairs of a large scene take minutes; what was asked before, in another way, took milliseconds."""
    done = run_on_a_large_scene(tmp_path, """
stopped = 0
for brief in (lambda: session.trial(above), lambda: session.proximity(0.0, report="count"), lambda: session.max_step(above)):
    for _ in range(2):
        brief()
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.3)
        session.proximity(1e6, report="count")
    except KeyboardInterrupt:
        stopped += 1
print("stopped", stopped, "of 3; then", len(session.step(above)))
""")
    assert done.stdout.startswith("stopped 3 of 3"), done.stdout + done.stderr


@pytest.mark.parametrize("turns", [(None,), (None, 0.25), (None, 0.25, 0.5, 0.75)])
def test_brief_questions_in_turn_are_computed_where_they_are_asked(cloth, turns):
    """And not on threads of their own, which begin with cold caches."""
    own = []
    with warmfront.Collider(cloth.frames[20], cloth.faces, bodies=cloth.bodies, threads=1) as session:
        for k in range(12):
            for share in turns:
                thread, process = time.thread_time(), time.process_time()
                session.max_step(cloth.frames[21 + k % 2], keep_distance=share)
                own.append((time.thread_time() - thread) / (time.process_time() - process))
    assert statistics.median(own[len(turns):]) > 0.7, own
