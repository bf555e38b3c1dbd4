# SPDX-License-Identifier: Apache-2.0
"""On machines without AVX2 the package computes with the engine that is made for them, the same bits."""
import os
import pathlib
import subprocess
import sys

import pytest

import warmfront
from warmfront import _instructions

PROGRAM = """
import sys, numpy as np, warmfront
draws = np.random.default_rng(5)
faces = np.arange(600).reshape(200, 3)
positions = draws.uniform(0, 4, (200, 1, 3)).repeat(3, 1).reshape(600, 3) + draws.uniform(0, 1, (600, 3))
with warmfront.Collider(positions, faces) as session:
    contacts = session.step(positions + draws.uniform(-0.3, 0.3, (600, 3)))
from warmfront import _engine
print(len(contacts), warmfront.contacts_hash(contacts), _engine.instruction_sets())
"""


def run(**environment):
    done = subprocess.run([sys.executable, "-c", PROGRAM], env={**os.environ, **environment}, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    count, digest, sets = done.stdout.split(maxsplit=2)
    return int(count), digest, sets.strip()


@pytest.mark.skipif(not warmfront.has_engine() or not (pathlib.Path(warmfront.__file__).parent / "_baseline").is_dir(),
                    reason="there is one engine alone")
def test_both_engines_answer_alike():
    usual, baseline = run(), run(WARMFRONT_INSTRUCTIONS="baseline")
    assert usual[0] > 100
    assert usual[:2] == baseline[:2]
    assert baseline[2] == "baseline" and "avx2" in usual[2].split()


@pytest.mark.parametrize("flags, baseline", [("flags : fpu sse2 avx2 bmi2", False), ("flags : fpu sse2 avx ssse3", True),
                                             ("Features : fp asimd", False)])
def test_the_machine_decides(tmp_path, monkeypatch, flags, baseline):
    package = tmp_path / "warmfront"
    (tmp_path / "cpuinfo").write_text(f"processor : 0\n{flags}\n\nprocessor : 1\n")
    monkeypatch.setattr(_instructions, "PROCESSORS", tmp_path / "cpuinfo")
    monkeypatch.delenv("WARMFRONT_INSTRUCTIONS", raising=False)
    assert _instructions.folders([str(package)]) == [str(package)]  # there is no other engine
    (package / "_baseline").mkdir(parents=True)
    expected = [str(package / "_baseline"), str(package)] if baseline else [str(package)]
    assert _instructions.folders([str(package)]) == expected
    monkeypatch.setattr(_instructions, "PROCESSORS", tmp_path / "none")
    assert _instructions.folders([str(package)]) == [str(package)]


def test_what_is_no_set_of_instructions_is_refused():
    program = [sys.executable, "-c", "import warmfront"]
    done = subprocess.run(program, env={**os.environ, "WARMFRONT_INSTRUCTIONS": "sse9"}, capture_output=True, text=True)
    assert done.returncode != 0 and "WARMFRONT_INSTRUCTIONS: 'sse9'" in done.stderr
    assert subprocess.run(program, env={**os.environ, "WARMFRONT_INSTRUCTIONS": ""}).returncode == 0
