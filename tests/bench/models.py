#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What a scene's model saves, printed as the table of engine/README.md:

    tests/bench/models.py build/release/bin/warmfront

Makes variants of the sequences of $WARMFRONT_DATA in a temporary folder: a cloth over a static ball, a crowd of which
1% move, a cloth of which 100 vertices move. Every variant is stepped as modelled and all deformable, in turn, and its
contacts are compared (detect --explain). Times are medians over the steps of all rounds, one thread.
$WARMFRONT_ROUNDS (3).
"""
import array
import json
import os
import pathlib
import random
import shutil
import statistics
import subprocess
import sys
import tempfile

DATA = pathlib.Path(os.environ.get("WARMFRONT_DATA", "../shared/data")) / "sequences"
ROUNDS = int(os.environ.get("WARMFRONT_ROUNDS", "3"))
HEADER = 32  # bytes of a .pc2 file before its positions


class Sequence:
    def __init__(self, name):
        self.folder = DATA / name
        self.info = json.loads((self.folder / "info.json").read_text())
        data = (self.folder / "frames.pc2").read_bytes()
        self.header = data[:HEADER]
        self.size = 3 * self.info["vertices"]
        values = array.array("f", data[HEADER:])
        self.frames = [values[i:i + self.size] for i in range(0, len(values), self.size)]

    def bodies(self, kind):
        return [b for b in self.info["bodies"] if b["kind"] == kind]

    def keep_still(self, bodies):
        for body in bodies:
            first = 3 * body["first_vertex"]
            end = first + 3 * body["vertex_count"]
            for frame in self.frames[1:]:
                frame[first:end] = self.frames[0][first:end]

    def write(self, folder):
        folder.mkdir()
        shutil.copy(self.folder / "mesh.ply", folder)
        (folder / "info.json").write_text(json.dumps(self.info))
        with open(folder / "frames.pc2", "wb") as file:
            file.write(self.header)
            for frame in self.frames:
                frame.tofile(file)
        return folder


def static_ball():
    cloth = Sequence("cloth-ball")
    ball = cloth.bodies("rigid")
    cloth.keep_still(ball)
    for body in ball:
        body["kind"] = "static"
    return cloth


def mostly_resting():
    crowd = Sequence("n-body")
    rigid = crowd.bodies("rigid")
    crowd.keep_still(rigid[max(1, len(rigid) // 100):])
    return crowd


def few_vertices():
    cloth = Sequence("cloth-ball")
    chosen = random.Random(1).sample(range(cloth.info["vertices"]), 100)
    draw = random.Random(2).uniform
    for k in range(1, len(cloth.frames)):
        cloth.frames[k] = array.array("f", cloth.frames[k - 1])
        for v in chosen:
            for axis in range(3):
                cloth.frames[k][3 * v + axis] = cloth.frames[0][3 * v + axis] + draw(-1e-3, 1e-3)
    for body in cloth.info["bodies"]:
        body["kind"] = "deformable"
    return cloth


def detect(binary, folder, *arguments):
    with tempfile.NamedTemporaryFile(suffix=".json") as report:
        subprocess.run([binary, "detect", str(folder), "--threads", "1", "--json", report.name, *arguments], check=True,
                       stdout=subprocess.DEVNULL)
        return json.load(open(report.name))["frames"][1:]


def measure(binary, what, folder, full, *arguments):
    """`full`: the folder and arguments of the step that it is measured against."""
    subprocess.run([binary, "detect", str(folder), "--threads", "1", "--explain", *arguments], check=True,
                   stdout=subprocess.DEVNULL)  # exits with 2 when the contacts are not right
    modelled, against = [], []
    for _ in range(ROUNDS):
        modelled += detect(binary, folder, *arguments)
        against += detect(binary, *full)
    mean = lambda frames, key: sum(f["counts"][key] for f in frames) / len(frames)
    ms = [statistics.median(f["ms"]["total"] for f in frames) for frames in (modelled, against)]
    sent = [statistics.mean(f["frame_bytes"] for f in frames) for frames in (modelled, against)]
    print(f"| {what} | {sent[0]:,.0f} | {sent[0] / sent[1]:.1%} | {ms[0]:.2f} | {ms[1]:.2f} | {ms[0] / ms[1]:.1%} "
          f"| {mean(modelled, 'nodes_refit') / mean(against, 'nodes_refit'):.1%} "
          f"| {mean(modelled, 'bv_tests') / max(1, mean(against, 'bv_tests')):.1%} |", flush=True)


def main():
    if len(sys.argv) < 2 or sys.argv[1].startswith("-"):
        sys.exit(__doc__)
    binary = os.path.abspath(sys.argv[1])
    whole = ("--bodies", "deformable", "--find-bodies", "off", "--find-rigid", "off", "--bounds", "kdop18")
    print("| scene | bytes a frame | of all | step, ms | full step, ms | of it | nodes refit | BV tests |")
    print("|---|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(temporary)
        measure(binary, "n-body: rigid bodies by poses", DATA / "n-body", (DATA / "n-body", *whole), "--send", "poses")
        measure(binary, "n-body: nothing said", DATA / "n-body", (DATA / "n-body", *whole), "--bodies", "deformable")
        measure(binary, "flamenco: layers of cloth on a posed body", DATA / "flamenco", (DATA / "flamenco", *whole),
                "--send", "poses")
        ball = static_ball().write(folder / "ball")
        measure(binary, "cloth-ball: the ball static", ball, (ball, *whole), "--send", "moved")
        crowd = mostly_resting().write(folder / "crowd")
        measure(binary, "n-body: 1% of the bodies move", crowd, (DATA / "n-body", *whole), "--send", "moved")
        few = few_vertices().write(folder / "few")
        measure(binary, "cloth-ball: 100 vertices move", few, (DATA / "cloth-ball", *whole), "--send", "moved")


if __name__ == "__main__":
    main()
