# SPDX-License-Identifier: Apache-2.0
"""tests/bench/scoreboard: its columns, and its verdicts, on a scene whose times of impact are known, also of a command line
that answers wrongly. $WARMFRONT_BIN holds `warmfront`."""
import csv
import io
import os
import pathlib
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[3]
BIN = pathlib.Path(os.environ["WARMFRONT_BIN"])
DATA = pathlib.Path(os.environ.get("WARMFRONT_DATA", ROOT / ".." / "shared" / "data"))
# Of github.com/zulianp/sccd, benchmark/competitors/common/competitor_bench.hpp: rows of both go into one file.
COLUMNS = ("dataset,mode,broadphase,case,type,queries,prep_ms,broad_ms,narrow_ms,query_narrow_ms,fp,fn,broad_fp,broad_fn,"
           "narrow_ms_s1,toi_n,toi_late,toi_max_late,toi_max_early,toi_med_early,s0_late,s0_margin,s0_toi,gt_earliest,root_n,"
           "s1_min")
# A triangle whose corners, at heights 1, 2 and 3, fall by 4 a step through a large one: each meets it once, and no edges meet.
FACE = [(-8, -8, 0), (8, -8, 0), (0, 8, 0)]
CORNERS = [(-1, -1, 1), (1, -1, 2), (0, 1, 3)]
TIMES = {3: 0.25, 4: 0.5, 5: 0.75}
TRUTH = "type,v0,v1,v2,v3,collides\nvf,3,0,1,2,1\nvf,4,2,1,0,1\nvf,5,1,2,0,1\nvf,0,3,4,5,0\nee,1,0,4,3,0\n"


def write_folder(folder, frames, truth):
    folder.mkdir()
    for k in range(frames):
        vertices = FACE + [(x, y, z - 4 * k) for x, y, z in CORNERS]
        folder.joinpath(f"t{k}.ply").write_text(
            "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\nproperty float z\nelement face 2\n"
            "property list uchar int vertex_indices\nend_header\n" + "".join("{} {} {}\n".format(*v) for v in vertices) +
            "3 0 1 2\n3 3 4 5\n")
    if truth:
        (folder / "truth.csv").write_text(truth)
    return folder


@pytest.fixture
def folder(tmp_path):
    return write_folder(tmp_path / "corners", 2, TRUTH)


def scoreboard(*flags, bin_folder=BIN):
    """Its exit code, rows and errors; one round, one thread."""
    done = subprocess.run([sys.executable, ROOT / "tests/bench/scoreboard", "--rounds", "1", "--threads", "1", "--csv", "-",
                           "--bin", bin_folder, *map(str, flags)],
                          stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    return done.returncode, list(csv.DictReader(io.StringIO(done.stdout))), done.stderr


def fake(folder, change):
    """A command line that answers as the real one does, but for the contacts of tier certified, whose CSV rows `change` (source
    text) makes others."""
    folder.mkdir()
    program = folder / "warmfront"
    program.write_text(f"""#!{sys.executable}
import subprocess, sys
words = sys.argv[1:]
code = subprocess.run([{str(BIN / "warmfront")!r}, *words]).returncode
if words[0] == "detect" and "certified" in words:
    path = words[words.index("--contacts") + 1]
    header, *rows = [line.split(",") for line in open(path).read().splitlines()]
    rows = {change}
    open(path, "w").write("".join(",".join(row) + "\\n" for row in [header, *rows]))
sys.exit(code)
""")
    program.chmod(0o755)
    return folder


def test_columns_of_a_step_whose_times_are_known(folder):
    code, rows, said = scoreboard(folder)
    assert code == 0, said
    assert [",".join(row) for row in rows] == [COLUMNS] * 2
    earliest, every = rows
    assert [row["mode"] for row in rows] == ["warmfront-certified-earliest", "warmfront-certified-all"]
    for row in rows:
        assert (row["dataset"], row["case"], row["type"], row["root_n"]) == ("corners", "0", "vf+ee", "3")
        assert all(float(row[column]) > 0 for column in ("prep_ms", "broad_ms", "narrow_ms"))
        assert (row["s0_late"], row["toi_late"], row["fp"], row["fn"]) == ("0",) * 4
        assert float(row["gt_earliest"]) == 0.25
        assert 0 <= float(row["s0_margin"]) == 0.25 - float(row["s0_toi"]) < 1e-5
    assert (earliest["toi_n"], every["toi_n"]) == ("1", "3")
    assert 1 <= int(earliest["queries"]) <= int(every["queries"])
    assert (earliest["narrow_ms_s1"], every["narrow_ms_s1"]) == ("", every["narrow_ms"])


def test_the_exact_tier_has_the_times_themselves(folder):
    code, rows, said = scoreboard(folder, "--tier", "exact")
    assert code == 0, said
    assert [(float(row["s0_toi"]), float(row["toi_max_early"])) for row in rows] == [(0.25, 0), (0.25, 0)]


def test_every_step_of_a_folder_without_truth(tmp_path):
    code, rows, said = scoreboard(write_folder(tmp_path / "below", 3, None))
    assert code == 0, said
    assert [(row["case"], row["gt_earliest"], row["root_n"]) for row in rows[::2]] == [("0", "0.25", "3"), ("1", "1.0", "0")]
    assert rows[2]["s0_toi"] == "1.0" and rows[2]["s0_late"] == "0"


def test_the_table(folder):
    done = subprocess.run([sys.executable, ROOT / "tests/bench/scoreboard", "--rounds", "3", "--bin", BIN, folder],
                          stdout=subprocess.PIPE, text=True)
    assert done.returncode == 0
    header, _, earliest, every = [[cell.strip() for cell in line.split("|")[1:-1]] for line in done.stdout.splitlines()]
    earliest, every = dict(zip(header, earliest)), dict(zip(header, every))
    assert (earliest["question"], earliest["late"], earliest["misses"]) == ("earliest", "0", "0")
    assert (every["question"], every["late"], every["misses"]) == ("all", "0", "0")
    assert earliest["of all"].endswith("%") and every["of all"] == ""


def test_late_answers_are_told(folder, tmp_path):
    late = fake(tmp_path / "late", "[[*row[:6], str(float(row[6]) + 0.375), *row[7:]] for row in rows]")
    code, (earliest, every), said = scoreboard(folder, bin_folder=late)
    assert code == 1 and "step 0, earliest: late or missed" in said
    assert (earliest["s0_late"], every["s0_late"], every["toi_late"]) == ("1", "1", "3")
    assert float(every["toi_max_late"]) == pytest.approx(0.375, abs=1e-5)
    assert earliest["fn"] == "2"  # what meets at 0.25 and 0.5, before some 0.625
    assert every["fn"] == "0"
    assert scoreboard(folder, "--tier", "fast", bin_folder=late)[0] == 0  # which the fake leaves as they are


def test_missing_answers_are_told(folder, tmp_path):
    code, (earliest, every), said = scoreboard(folder, bin_folder=fake(tmp_path / "silent", "[]"))
    assert code == 1 and "step 0, all: late or missed" in said
    assert (earliest["fn"], every["fn"], earliest["s0_toi"], earliest["s0_late"]) == ("3", "3", "1.0", "1")


def test_false_answers_are_counted(folder, tmp_path):
    more = fake(tmp_path / "more", "rows + [['1', 'ee', '0', '1', '3', '4', '0.125', 'possible']]")
    code, rows, said = scoreboard(folder, bin_folder=more)
    assert code == 0, said  # certified may
    assert [(row["fp"], row["fn"], row["s0_margin"]) for row in rows] == [("1", "0", "0.125")] * 2


@pytest.mark.parametrize("line, lacks, none", [("vf,0,3,4,5,1", 1, 0), ("vf,3,0,1,2,0", 0, 1)])
def test_a_truth_that_differs_is_told(tmp_path, line, lacks, none):
    pair, _, _ = line.rpartition(",")
    lines = [line if known.startswith(pair) else known for known in TRUTH.splitlines()]
    code, _, said = scoreboard(write_folder(tmp_path / "wrong", 2, "\n".join(lines) + "\n"))
    assert code == 1 and f"lacks {lacks} contacts of truth.csv and has {none} that are none" in said


def test_failures(folder, tmp_path):
    (folder / "truth.csv").write_text("v0,v1\n")
    assert scoreboard(folder)[0] == 2
    assert scoreboard(tmp_path / "nowhere")[0] == 2
    assert scoreboard(folder, bin_folder=tmp_path)[0] == 2
    assert scoreboard(folder, "--rounds", "0")[0] == 2


def test_real_frames():
    folder = DATA / "frames" / "n-body"
    if not folder.exists():
        pytest.skip(f"no {folder}")
    code, rows, said = scoreboard(folder)
    assert code == 0, said
    assert [(row["root_n"], row["s0_late"], row["toi_late"], row["fn"]) for row in rows] == [("50490", "0", "0", "0")] * 2
