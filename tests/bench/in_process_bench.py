#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""What Python and C add to the engine in the same process:

    PYTHONPATH=build/release/python tests/bench/in_process_bench.py build/release/bin [FOLDER]

The steps of a recorded scene (a folder with mesh.ply and frames.pc2; without, `warmfront scene cloth-ball` writes one) from
programs in C++, in C and in Python, in turn, of one thread each, the least of some rounds; and what a question of a tiny scene
takes beside the engine's own time.
"""
import pathlib
import subprocess
import sys
import tempfile
import time

import numpy as np

import warmfront

ROUNDS = 7


def read(folder):
    mesh = (folder / "mesh.ply").read_bytes()
    head, body = mesh.split(b"end_header\n", 1)
    counts = {line.split()[1]: int(line.split()[2]) for line in head.decode().splitlines() if line.startswith("element")}
    if "binary" in head.decode():
        faces = np.frombuffer(body[-13 * counts["face"]:], [("count", "u1"), ("v", "<i4", 3)])["v"]
    else:
        rows = body.decode().splitlines()[counts["vertex"]:counts["vertex"] + counts["face"]]
        faces = np.array([row.split()[1:4] for row in rows], np.int32)
    cache = (folder / "frames.pc2").read_bytes()
    return np.ascontiguousarray(faces), np.frombuffer(cache, "<f4", offset=32).reshape(-1, counts["vertex"], 3)


def in_python(frames, faces):
    with warmfront.Collider(frames[0], faces, threads=1) as session:
        told = 0
        begin = time.perf_counter()
        for positions in frames[1:]:
            told += len(session.step(positions).toi)
        return time.perf_counter() - begin, told


def in_program(program, path):
    *times, told = subprocess.run([program, path, "1", "1"], check=True, stdout=subprocess.PIPE, text=True).stdout.split()
    return float(times[0]), int(told)


def steps(binaries, folder):
    faces, frames = read(folder)
    with tempfile.NamedTemporaryFile() as file:
        file.write(np.array([frames.shape[1], len(faces), len(frames)], np.uint32).tobytes() + faces.tobytes() + frames.tobytes())
        file.flush()
        ways = {"C++": lambda: in_program(binaries / "steps_in_cpp", file.name), "C": lambda: in_program(binaries / "steps_in_c", file.name),
                "Python": lambda: in_python(frames, faces)}
        results = {name: [] for name in ways}
        for _ in range(ROUNDS):
            for name, way in ways.items():
                results[name].append(way())
    assert len({told for rounds in results.values() for _, told in rounds}) == 1
    print(f"{len(frames) - 1} steps of {len(faces)} triangles, {results['C'][0][1]} rows, 1 thread, least and median of {ROUNDS}")
    base = np.array([seconds for seconds, _ in results["C++"]])
    for name, rounds in results.items():
        seconds = np.array([seconds for seconds, _ in rounds])
        ratio = f"{seconds.min() / base.min():5.3f} {np.median(seconds) / np.median(base):5.3f}"
        print(f"  {name:8} {1e3 * seconds.min():9.2f} ms {1e3 * np.median(seconds):9.2f} ms   of C++ {ratio}")


def questions():
    before = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [.25, .25, 1], [1.25, .25, 1], [.25, 1.25, 1]])
    after = before * [1, 1, -1]
    count = 3000
    print(f"a question of two triangles, microseconds: of the call, and in it beside the engine's own (median of {count})")
    with warmfront.Collider(before, [[0, 1, 2], [3, 4, 5]], threads=1) as session:
        asked = {
            "step": lambda k: session.step(after if k % 2 == 0 else before),
            "trial": lambda k: session.trial(after),
            "trial, with options": lambda k: session.trial(after, min_separation=0.01, fields=["weights", "normal"]),
            "max_step": lambda k: session.max_step(after),
            "proximity": lambda k: session.proximity(0.5),
            "proximity, with fields": lambda k: session.proximity(0.5, fields=["squared_distance", "weights"]),
            "vertex_distances": lambda k: session.vertex_distances(0.5),
            "intersections": lambda k: session.intersections(),
        }
        for name, ask in asked.items():
            taken = []
            for k in range(count):
                begin = time.perf_counter()
                answer = ask(k)
                end = time.perf_counter()
                taken.append((1e6 * (end - begin), 1e6 * (end - begin) - 1e3 * answer.statistics.ms.total))
            whole, beside = np.median(np.array(taken), axis=0)
            print(f"  {name:24} {whole:6.1f} {beside:6.1f}")


def main():
    binaries = pathlib.Path(sys.argv[1])
    if len(sys.argv) > 2:
        steps(binaries, pathlib.Path(sys.argv[2]))
    else:
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run([binaries / "warmfront", "scene", "cloth-ball", "--triangles", "20000", "--out", folder], check=True,
                           stdout=subprocess.DEVNULL)
            steps(binaries, pathlib.Path(folder))
    questions()


if __name__ == "__main__":
    main()
