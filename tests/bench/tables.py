#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Prints the measured tables of tests/README.md: tests/bench/tables.py WARMFRONT TABLE...

WARMFRONT is the command line's binary. Tables: step (one big step), sequences (stages and threads), front (what the front
saves, beside the 2009 paper's figures), equal (one answer whatever the way), tiled (1.5 million triangles), remote (what the
daemon adds), many (64 sessions at once). The real scenes are looked
for in $WARMFRONT_DATA (default ../shared/data beside the project). Ways that are compared run in turn, several times over,
so that a slow spell of the machine hits all of them; of a frame's times the least counts, of frames the median.
"""
import array
import contextlib
import json
import os
import pathlib
import resource
import shutil
import statistics
import struct
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
DATA = pathlib.Path(os.environ.get("WARMFRONT_DATA", ROOT / ".." / "shared" / "data"))
SEQUENCES = ["cloth-ball", "flamenco", "n-body", "cloth-ball-10k", "bart-like"]
# Separations at which every sequence has thousands of contacts a frame.
SEPARATION = {"cloth-ball": 0.005, "flamenco": 0.01, "n-body": 0.02, "cloth-ball-10k": 0.03, "bart-like": 0.02}
# Everything deformable and tested against all else, and nothing found out: what the method itself costs.
PLAIN = ["--bodies", "deformable", "--find-bodies", "off", "--find-rigid", "off"]
ROUNDS = int(os.environ.get("WARMFRONT_ROUNDS", "5"))


def plain(flags):
    """Flags of a scene of which nothing is known, unless they say otherwise; of bounds that no trial picks."""
    bounds = [] if "--bounds" in flags else ["--bounds", "kdop18"]
    return [*flags, *bounds, *([] if "--bodies" in flags else PLAIN)]


def detect(binary, path, *flags):
    flags = plain(flags)
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
    """The median over frames of each frame's minimum time: other load on the machine only adds to it."""
    rounds = [[f["ms"][stage] for f in warm_frames(r)] for r in reports]
    return statistics.median(min(times) for times in zip(*rounds))


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
        ways = {(tier, threads): ["--tier", tier, "--threads", threads]
                for tier in ["fast", "certified", "exact"] for threads in ["1", "2"]}
        ways["certified, earliest", "1"] = ["--report", "earliest", "--threads", "1"]
        for (tier, threads), reports in in_turn(binary, DATA / "frames" / name, ways).items():
            frames = [r["frames"][0] for r in reports]
            ms = {s: min(f["ms"][s] for f in frames) for s in frames[0]["ms"]}
            rows.append([name, tier, threads, frames[0]["vf"], frames[0]["ee"], *(f"{ms[s]:.0f}" for s in
                        ["total", "refit", "front", "elementary"]), f"{ms['adjacent']:.1f}"])
    table("One step from cold, t0 to t1, all contacts (ms)",
          ["scene", "tier", "threads", "vf", "ee", "total", "refit, build", "front", "elementary", "adjacent"], rows)


def sequences(binary):
    rows = []
    for name in SEQUENCES:
        ways = {t: ["--threads", t] for t in ["1", "2"]}
        ways["found"] = ["--threads", "1", "--bodies", "deformable"]
        ways["declared"] = ["--threads", "1", "--bodies", "declared"]
        reports = in_turn(binary, DATA / "sequences" / name, ways)
        one = median_ms(reports["1"])
        two = median_ms(reports["2"])
        stages = [f"{median_ms(reports['1'], s):.2f}" for s in ["refit", "front", "elementary", "adjacent"]]
        rows.append([name, reports["1"][0]["triangles"], f"{one:.2f}", *stages, f"{two:.2f}", f"{100 * two / one:.0f}%",
                     *(f"{median_ms(reports[way]):.2f}" for way in ["found", "declared"])])
    table("Warm steps (median ms a frame); of everything deformable, then on one thread with what is found, and as declared",
          ["sequence", "triangles", "1 thread", "refit", "front", "elementary", "adjacent", "2 threads", "2 / 1", "found",
           "declared"], rows)


def front(binary):
    rows = []
    for name in SEQUENCES:
        for substeps in ["1", "10"]:
            modes = {"none": ["--front", "none"], "paper": ["--front", "paper"], "warm": ["--lazy", "off"], "lazy": []}
            ways = {mode: ["--threads", "1", "--substeps", substeps, *flags] for mode, flags in modes.items()}
            reports = in_turn(binary, DATA / "sequences" / name, ways)
            none = reports["none"][0]
            cells = [name, "whole" if substeps == "1" else f"1/{substeps}", f"{median_ms(reports['none']):.2f}"]
            for mode in ["paper", "warm", "lazy"]:
                tests = 1 - count(reports[mode][0], "bv_tests") / count(none, "bv_tests")
                outside = [median_ms(reports[m]) - median_ms(reports[m], "elementary") for m in ["none", mode]]
                cells += [f"{100 * tests:.0f}%", f"{100 * (1 - outside[1] / outside[0]):.0f}%"]
            lazy = reports["lazy"][0]
            cells.append(f"{100 * count(lazy, 'front_skipped') / count(lazy, 'front_pairs'):.0f}%")
            cells.append(f"{warm_frames(lazy)[-1]['counts']['front_bytes'] / none['triangles']:.0f}")
            rows.append(cells)
    table("What the front saves against traversal from the root: bounding volume tests (paper: 53-63%) and time outside the "
          "elementary tests (of all time: 68-88%)",
          ["sequence", "step", "none: ms", "paper: tests", "time", "warm, not lazy: tests", "time", "warm: tests", "time",
           "pairs not looked at", "bytes a triangle"], rows)


def read_sequence(folder, frames):
    """The mesh's faces and the first frames' positions, of a binary PLY of triangles and a PC2 cache."""
    ply = (folder / "mesh.ply").read_bytes()
    header, _, body = ply.partition(b"end_header\n")
    counts = {line.split()[1]: int(line.split()[2]) for line in header.decode().splitlines() if line.startswith("element")}
    vertices = counts["vertex"]
    faces = [struct.unpack_from("<3i", body, 12 * vertices + 13 * f + 1) for f in range(counts["face"])]
    cache = (folder / "frames.pc2").read_bytes()
    positions = []
    for k in range(frames):
        values = array.array("f")
        values.frombytes(cache[32 + 12 * vertices * k:32 + 12 * vertices * (k + 1)])
        positions.append(values)
    return faces, positions


def write_tiled(source, tiles, frames, folder):
    """Copies of a sequence side by side in a square, as mesh and cache."""
    faces, positions = read_sequence(source, frames)
    vertices = len(positions[0]) // 3
    side = max(max(p[k::3]) - min(p[k::3]) for p in positions for k in (0, 1)) * 1.1
    places = [(side * (t % 4), side * (t // 4)) for t in range(tiles)]
    with open(folder / "mesh.ply", "wb") as mesh:
        mesh.write((f"ply\nformat binary_little_endian 1.0\nelement vertex {vertices * tiles}\nproperty float x\n"
                    f"property float y\nproperty float z\nelement face {len(faces) * tiles}\n"
                    "property list uchar int vertex_indices\nend_header\n").encode())
        mesh.write(bytes(12 * vertices * tiles))
        for t in range(tiles):
            mesh.write(b"".join(struct.pack("<B3i", 3, *(v + t * vertices for v in face)) for face in faces))
    with open(folder / "frames.pc2", "wb") as cache:
        cache.write(struct.pack("<12siiffi", b"POINTCACHE2\0", 1, vertices * tiles, 0.0, 1.0, frames))
        for frame in positions:
            for x, y in places:
                tile = array.array("f", frame)
                tile[0::3] = array.array("f", (v + x for v in frame[0::3]))
                tile[1::3] = array.array("f", (v + y for v in frame[1::3]))
                cache.write(tile.tobytes())


def tiled(binary):
    """1.5 million triangles: cost a triangle and peak memory, beside the same frames of one tile."""
    frames = 12
    rows = []
    for tiles in [1, 16]:
        with tempfile.TemporaryDirectory() as folder:
            write_tiled(DATA / "sequences" / "cloth-ball", tiles, frames, pathlib.Path(folder))
            reports = in_turn(binary, folder, {"warm": ["--threads", "2"]})["warm"]
            report = reports[0]
            peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss  # of the largest so far, which this is
            warm = median_ms(reports)
            rows.append([tiles, report["triangles"], f"{report['frames'][0]['ms']['total']:.0f}", f"{warm:.1f}",
                         f"{1e6 * warm / report['triangles']:.0f}", f"{peak / 2**20:.2f}"])
    table("Tiles of cloth-ball, 2 threads",
          ["tiles", "triangles", "first step, ms", "warm step, ms", "ns a triangle", "peak memory, GiB"], rows)


def write_longer(source, passes, folder):
    """The sequence played forward and backward, so many passes of it, its frames as they are; returns the number of steps. More steps of
    the sequence's own, where substeps would be shorter ones, of positions in double that its files do not have."""
    header, *frames = split_cache((source / "frames.pc2").read_bytes())
    order = list(range(len(frames)))
    played = order[:1]
    for k in range(passes):
        played += (order if k % 2 == 0 else order[::-1])[1:]
    with open(folder / "frames.pc2", "wb") as cache:
        cache.write(header[:28] + struct.pack("<i", len(played)))
        for k in played:
            cache.write(frames[k])
    shutil.copyfile(source / "mesh.ply", folder / "mesh.ply")
    return len(played) - 1


def split_cache(cache):
    """The header of a PC2 cache, then its frames."""
    vertices, count = struct.unpack_from("<16xi8xi", cache)
    return [cache[:32], *(cache[32 + 12 * vertices * k:32 + 12 * vertices * (k + 1)] for k in range(count))]


def wall_seconds(*command):
    start = time.perf_counter()
    run = subprocess.run([str(c) for c in command], capture_output=True, text=True)
    if run.returncode != 0:
        sys.exit(f"{command}\n{run.stderr}")
    return time.perf_counter() - start


def remote(binary):
    """Whole runs, in-process and through the daemon: wall time a frame, positions in and answers out included. What both
    do once (reading, and creating the session) is taken off by running the first frames alone."""
    rows = []
    few = 10
    for name, passes in [("cloth-ball", 3), ("bart-like", 10)]:
        with daemon(binary) as address, tempfile.TemporaryDirectory() as folder:
            steps = write_longer(DATA / "sequences" / name, passes, pathlib.Path(folder))
            remote = ["--server", address, "--in-flight"]
            ways = {"in-process": [], "one": [*remote, "1"], "two": [*remote, "2"]}
            best = {}
            for _ in range(ROUNDS + 1):
                for way, flags in ways.items():
                    for last in [few, steps]:
                        seconds = wall_seconds(binary, "detect", folder, "--frames", f"0:{last}", *plain(flags))
                        best[way, last] = min(best.get((way, last), 1e9), seconds)
            ms = {way: 1e3 * (best[way, steps] - best[way, few]) / (steps - few) for way in ways}
            alone = ms.pop("in-process")
            rows.append([name, f"{alone:.2f}", *(text for through in ms.values() for text in [
                f"{through:.2f}", f"{through / alone:.2f}", f"{1e3 * (through - alone):.0f}"])])
    table("A step in-process and through the daemon, one or two frames in flight (wall ms a frame)",
          ["sequence", "in-process", "one in flight", "ratio", "more, us", "two in flight", "ratio", "more, us"], rows)


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


def many(binary):
    """Frames a second of 64 sessions at once, beside the same 64 in processes of their own without a daemon, and beside one
    in-process on one thread. Start-up is taken off as in remote()."""
    sessions = 64
    few = 10
    best = {}
    with daemon(binary) as address, tempfile.TemporaryDirectory() as folder:
        steps = write_longer(DATA / "sequences" / "bart-like", 20, pathlib.Path(folder))
        report = detect(binary, folder, "--threads", "1")
        alone = 1e3 / statistics.mean(f["ms"]["total"] for f in warm_frames(report))
        ways = {"daemon": ["--server", address], "processes": ["--threads", "1"]}
        for _ in range((ROUNDS + 1) // 2):
            for way, flags in ways.items():
                for last in [few, steps]:
                    start = time.perf_counter()
                    clients = [subprocess.Popen([binary, "detect", folder, *flags, "--frames", f"0:{last}", *plain([])],
                                                stdout=subprocess.DEVNULL, stderr=subprocess.PIPE) for _ in range(sessions)]
                    for client in clients:
                        if client.wait() != 0:
                            sys.exit(client.stderr.read().decode())
                    best[way, last] = min(best.get((way, last), 1e9), time.perf_counter() - start)
    together = {way: (steps - few) * sessions / (best[way, steps] - best[way, few]) for way in ways}
    cores = len(os.sched_getaffinity(0))
    table(f"{sessions} sessions of {report['triangles']} triangles at once, clients on the same {cores} cores",
          ["frames a second in all", "of cores x one", f"{sessions} processes without a daemon", "of cores x one",
           "one, one thread"],
          [[*(cell for way in ways for cell in [f"{together[way]:.0f}", f"{together[way] / (cores * alone):.2f}"]),
            f"{alone:.0f}"]])


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
    tables = {"step": step, "sequences": sequences, "front": front, "equal": equal, "tiled": tiled,
              "remote": remote, "many": many}
    for name in sys.argv[2:]:
        if name not in tables:
            sys.exit(f"no table {name}; there are {', '.join(tables)}")
        if tables[name](sys.argv[1]) is False:
            sys.exit(1)


main()
