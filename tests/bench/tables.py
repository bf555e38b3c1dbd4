#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Prints the README's measured tables: tests/bench/tables.py WARMFRONT TABLE...

WARMFRONT is the command line's binary. Tables: step (one big step), sequences (stages and threads), front (what the front
and the orphan sets save, beside the 2009 paper's figures), equal (one answer whatever the way). The real scenes are looked
for in $WARMFRONT_DATA (default ../shared/data beside the project). Ways that are compared run in turn, several times over,
and medians are taken, so that a slow spell of the machine hits all of them.
"""
import contextlib
import json
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
DATA = pathlib.Path(os.environ.get("WARMFRONT_DATA", ROOT / ".." / "shared" / "data"))
SEQUENCES = ["cloth-ball", "flamenco", "n-body", "cloth-ball-10k", "bart-like"]
# Separations at which every sequence has thousands of contacts a frame.
SEPARATION = {"cloth-ball": 0.005, "flamenco": 0.01, "n-body": 0.02, "cloth-ball-10k": 0.03, "bart-like": 0.02}
ROUNDS = int(os.environ.get("WARMFRONT_ROUNDS", "3"))


def detect(binary, path, *flags):
    run = subprocess.run([binary, "detect", str(path), "--json", "-", *flags], capture_output=True, text=True)
    if run.returncode != 0:
        sys.exit(f"{' '.join(run.args)}\n{run.stderr}")
    return json.loads(run.stdout)


def in_turn(binary, path, ways):
    """{way: reports}, the ways run alternately."""
    reports = {way: [] for way in ways}
    for _ in range(ROUNDS):
        for way, flags in ways.items():
            reports[way].append(detect(binary, path, *flags))
    return reports


def warm_frames(report):
    """All frames but the first, which builds."""
    return report["frames"][1:] or report["frames"]


def median_ms(reports, stage="total"):
    return statistics.median(f["ms"][stage] for r in reports for f in warm_frames(r))


def count(report, name):
    return sum(f["counts"][name] for f in warm_frames(report))


def table(title, header, rows):
    print(f"\n**{title}**\n")
    print("| " + " | ".join(header) + " |")
    print("|" + "---|" * len(header))
    for row in rows:
        print("| " + " | ".join(str(cell) for cell in row) + " |")


def step(binary):
    rows = []
    for name in ["cloth-ball", "n-body"]:
        for threads in ["1", "2"]:
            reports = [detect(binary, DATA / "frames" / name, "--threads", threads) for _ in range(ROUNDS)]
            frames = [r["frames"][0] for r in reports]
            ms = {s: statistics.median(f["ms"][s] for f in frames) for s in frames[0]["ms"]}
            rows.append([name, threads, frames[0]["vf"], frames[0]["ee"], *(f"{ms[s]:.0f}" for s in
                        ["total", "refit", "front", "elementary"]), f"{ms['adjacent']:.1f}"])
    table("One step from cold, t0 to t1, all contacts (ms)",
          ["scene", "threads", "vf", "ee", "total", "refit, build", "front", "elementary", "adjacent"], rows)


def sequences(binary):
    rows = []
    for name in SEQUENCES:
        reports = in_turn(binary, DATA / "sequences" / name, {t: ["--threads", t] for t in ["1", "2"]})
        one = median_ms(reports["1"])
        two = median_ms(reports["2"])
        stages = [f"{median_ms(reports['1'], s):.2f}" for s in ["refit", "front", "elementary", "adjacent"]]
        rows.append([name, reports["1"][0]["triangles"], f"{one:.2f}", *stages, f"{two:.2f}", f"{100 * two / one:.0f}%"])
    table("Warm steps (median ms a frame)",
          ["sequence", "triangles", "1 thread", "refit", "front", "elementary", "adjacent", "2 threads", "2 / 1"], rows)


def front(binary):
    rows = []
    for name in SEQUENCES:
        for leaf in ["1", "4"]:
            ways = {mode: ["--threads", "1", "--front", mode, "--leaf-size", leaf] for mode in ["none", "paper", "warm"]}
            reports = in_turn(binary, DATA / "sequences" / name, ways)
            none = reports["none"][0]
            cells = [name, leaf]
            for mode in ["paper", "warm"]:
                tests = 1 - count(reports[mode][0], "bv_tests") / count(none, "bv_tests")
                outside = [median_ms(reports[m]) - median_ms(reports[m], "elementary") for m in ["none", mode]]
                cells += [f"{100 * tests:.0f}%", f"{100 * (1 - outside[1] / outside[0]):.0f}%"]
            pairs = count(reports["warm"][0], "front_pairs")
            adjacent = count(reports["warm"][0], "adjacent_pairs")
            cells.append(f"{100 * adjacent / (pairs + adjacent):.0f}%" if leaf == "1" else "")
            last = warm_frames(reports["warm"][0])[-1]["counts"]
            cells.append(f"{last['front_bytes'] / none['triangles']:.0f}")
            rows.append(cells)
    table("What the front saves against traversal from the root (paper: 53-63% of bounding volume tests, 68-88% of time; "
          "orphan sets shorten it by 60-80%)",
          ["sequence", "leaf", "paper mode: tests", "time outside elementary", "warm mode: tests", "time outside elementary",
           "shortened by orphans", "bytes a triangle"], rows)


@contextlib.contextmanager
def daemon(binary):
    """The address of a daemon that lives as long as the block."""
    with tempfile.TemporaryDirectory() as folder:
        socket = pathlib.Path(folder, "warmfront.sock")
        process = subprocess.Popen([pathlib.Path(binary).parent / "warmfrontd", "--listen", f"unix:{socket}",
                                    "--log-level", "warning"])
        while not socket.exists():
            time.sleep(0.05)
        yield f"unix:{socket}"
        process.terminate()
        if process.wait() != 0:
            sys.exit("the daemon did not stop cleanly")


def equal(binary):
    rows = []
    ok = True
    with daemon(binary) as address:
        ways = [["--front", mode, "--bounds", bounds, "--threads", "2"]
                for mode in ["none", "paper", "warm"] for bounds in ["kdop18", "aabb"]]
        ways += [["--threads", "1"], ["--threads", "8"], ["--server", address]]
        for name in SEQUENCES:
            for separation in ["0", str(SEPARATION[name])]:
                reports = [detect(binary, DATA / "sequences" / name, "--min-separation", separation, *way) for way in ways]
                hashes = {r["contacts_hash"] for r in reports}
                pairs = {(r["bounds"], tuple(f["counts"]["triangle_pairs"] for f in r["frames"])) for r in reports}
                contacts = statistics.mean(f["vf"] + f["ee"] for f in reports[0]["frames"])
                same = len(hashes) == 1 and len(pairs) == 2
                ok &= same
                rows.append([name, separation, len(reports[0]["frames"]), f"{contacts:.0f}",
                             hashes.pop() if same else f"DIFFER: {hashes}"])
    table(f"One answer, {len(ways)} ways: fronts none, paper, warm; 18-DOP, AABB; 1, 2, 8 threads; in-process, daemon "
          "(triangle pairs equal too, frame by frame, for all fronts)",
          ["sequence", "separation", "frames", "contacts a frame", "hash of all frames"], rows)
    return ok


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    tables = {"step": step, "sequences": sequences, "front": front, "equal": equal}
    for name in sys.argv[2:]:
        if name not in tables:
            sys.exit(f"no table {name}; there are {', '.join(tables)}")
        if tables[name](sys.argv[1]) is False:
            sys.exit(1)


main()
