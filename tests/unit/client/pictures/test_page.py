# SPDX-License-Identifier: Apache-2.0
"""`detect --html`: the page holds exactly what was found, and in a browser it opens, draws, scrubs and plays."""
import csv
import json
import re

import numpy as np
import pytest
from conftest import detect, run
from page import blob, browse, needs_browser, scene_of


def test_the_page_carries_what_was_found(folder):
    page = (folder / "page.html").read_text()
    scene = scene_of(page)
    report = json.loads((folder / "report.json").read_text())
    assert scene["contacts_hash"] == report["contacts_hash"]
    for name in ("vf", "ee", "possible", "earliest_toi"):
        assert scene[name] == [frame[name] for frame in report["frames"]]
    assert scene["ms"]["front"] == [frame["ms"]["front"] for frame in report["frames"]]
    with open(folder / "contacts.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) > 500
    v, toi, kind = (blob(page, f"contact-{name}", dtype) for name, dtype in (("v", "<u4"), ("toi", "<f4"), ("kind", "u1")))
    assert v.reshape(-1, 4).tolist() == [[int(row[f"v{i}"]) for i in range(4)] for row in rows]
    assert toi.tolist() == [float(np.float32(float(row["toi"]))) for row in rows]
    assert kind.tolist() == [row["type"] == "ee" for row in rows]
    ends = np.cumsum([a + b for a, b in zip(scene["vf"], scene["ee"])])
    assert scene["contact_ends"] == ends.tolist()


def test_positions_are_within_the_error_that_is_stated(folder):
    page = (folder / "page.html").read_text()
    scene = scene_of(page)
    true = np.frombuffer((folder / "frames.pc2").read_bytes(), "<f4", offset=32).reshape(-1, scene["vertices"], 3)
    drawn = np.array(scene["origin"]) + np.array(scene["quantum"]) * blob(page, "positions", "<u2").reshape(true.shape)
    error = np.abs(drawn - true).max()
    assert error == pytest.approx(scene["error"], rel=1e-6)
    assert 0 < error <= 0.5001 * max(scene["quantum"])
    extent = true.max(axis=(0, 1)) - true.min(axis=(0, 1))
    assert max(scene["quantum"]) <= extent.max() / 65535 * 1.0001
    assert (blob(page, "faces", "<u4").reshape(-1, 3).max()) == scene["vertices"] - 1


def test_a_changing_topology_has_parts(tmp_path):
    scene_name = "builtin:cut?triangles=1200&frames=20"
    outputs = ("--html", tmp_path / "page.html", "--meshes", tmp_path / "m.vtp", "--contacts", tmp_path / "c.csv")
    assert detect(scene_name, *outputs).returncode == 0
    assert run("scene", "cut", "--triangles", "1200", "--frames", "20", "--out", tmp_path / "meshes").returncode == 0
    page = (tmp_path / "page.html").read_text()
    scene = scene_of(page)
    parts = scene["parts"]
    assert len(parts) > 4 and parts[0]["first_step"] == 0 and parts[1]["first_step"] == 12
    faces, positions = blob(page, "faces", "<u4"), blob(page, "positions", "<u2")
    frames = [end - part["first_step"] + 1
              for part, end in zip(parts, [part["first_step"] for part in parts[1:]] + [len(scene["steps"])])]
    assert faces.size == sum(3 * part["triangles"] for part in parts)
    assert positions.size == sum(3 * part["vertices"] * count for part, count in zip(parts, frames))
    with open(tmp_path / "c.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    v = blob(page, "contact-v", "<u4").reshape(-1, 4)
    assert v.tolist() == [[int(row[f"v{i}"]) for i in range(4)] for row in rows]
    files = sorted((tmp_path / "meshes").iterdir())
    for part, count in zip(parts, frames):
        own, faces = np.split(faces, [3 * part["triangles"]])
        assert own.max() == part["vertices"] - 1
        assert sum(body["vertex_count"] for body in part["bodies"]) == part["vertices"]
        for _ in range(count):
            drawn, positions = np.split(positions, [3 * part["vertices"]])
            drawn = np.array(scene["origin"]) + np.array(scene["quantum"]) * drawn.reshape(-1, 3)
            body = files.pop(0).read_bytes()
            head = body.index(b"end_header\n") + len(b"end_header\n")
            true = np.frombuffer(body, "<f4", count=3 * part["vertices"], offset=head).reshape(-1, 3)
            assert np.abs(drawn - true).max() <= scene["error"] * 1.000001
    assert not files


@needs_browser
def test_a_changing_topology_in_a_browser(tmp_path):
    assert detect("builtin:cut?triangles=1200&frames=20", "--html", tmp_path / "page.html").returncode == 0
    seen = browse(tmp_path / "page.html", tmp_path)
    assert seen["errors"] == [] and seen["steps"] == 19 and seen["end"] == 19
    pixels = seen["size"][0] * seen["size"][1]
    assert 0.02 * pixels < seen["drawn"] < 0.9 * pixels and seen["marks"] > 50
    assert seen["changed"] > 0.01 * pixels and seen["same"] == 0
    assert "vertices at first, 19 steps; the topology changes" in seen["subtitle"]


def test_nothing_comes_from_outside(folder):
    page = (folder / "page.html").read_text()
    assert not re.findall(r'(?:src|href)="(?!data:)[^"]*"|url\(|@import|https?://|\bfetch\(|XMLHttpRequest', page)


def test_a_name_is_text_and_not_markup(tmp_path):
    odd = tmp_path / "a<script>b"
    assert run("scene", "cloth-ball", "--triangles", "1000", "--frames", "3", "--out", odd).returncode == 0
    assert detect(odd, "--html", tmp_path / "page.html").returncode == 0
    page = (tmp_path / "page.html").read_text()
    assert "a<script>b" not in page and scene_of(page)["name"] == "a<script>b"


def test_a_page_beyond_its_limit_is_an_error(folder, tmp_path):
    page = tmp_path / "page.html"
    for limit, what in (("100KiB", "the positions of 60 frames"), ("280KiB", "positions and the contacts up to step")):
        done = detect(folder, "--html", page, "--html-limit", limit)
        assert done.returncode == 2 and not page.exists()
        assert what in done.stderr and "fewer --frames, or a larger --html-limit" in done.stderr
    assert detect(folder, "--html", page, "--html-limit", "100KiB", "--frames", "0:10").returncode == 0
    assert detect(folder, "--html-limit", "100KiB").returncode == 3
    assert detect(folder, "--html", tmp_path / "no" / "page.html").returncode == 2


@needs_browser
@pytest.mark.parametrize("size", ["1200,800", "420,900", "800,600"])
def test_in_a_browser(folder, tmp_path, size):
    seen = browse(folder / "page.html", tmp_path, size)
    report = json.loads((folder / "report.json").read_text())["frames"]
    totals = [frame["vf"] + frame["ee"] for frame in report]
    assert seen["errors"] == [] and seen["title"] == folder.name and seen["steps"] == 59
    # It opens where the most contacts are, draws meshes and marks, and neither when they are switched off.
    assert seen["opened"] == 1 + totals.index(max(totals))
    pixels = seen["size"][0] * seen["size"][1]
    assert 0.02 * pixels < seen["drawn"] < 0.9 * pixels
    assert seen["marks"] > 50 and seen["marksWithout"] == 0
    assert 0 < seen["drawnAsEdges"] < seen["drawn"] and seen["lessDrawn"] > 0
    # It scrubs: by the slider, keys and chart; the picture and the words follow.
    assert (seen["slid"], seen["slidMarks"], seen["slidWords"]) == (0, 0, "frame 0.00, 0 contacts")
    assert seen["changed"] > 0.01 * pixels and seen["same"] == 0
    assert (seen["right"], seen["rightTen"], seen["end"], seen["left"]) == (1, 11, 59, 58)
    assert seen["words"] == f"frame 58.00, {totals[57]} contacts"
    assert 58 < seen["clicked"] <= 59
    assert seen["zoomed"] > 0 and seen["viewReset"] == 0
    assert not seen["tipHidden"] and seen["tip"].startswith("frame 1 ") and seen["tipLeft"]
    assert 0 < seen["played"] <= 59 and seen["paused"]
    assert seen["bars"] == 6 and seen["unnamed"] == 0
    # All of the scene is in view, and the page in its window; the slider leaves the space bar to playing.
    assert seen["atRim"] == [0, 0] and seen["scrolls"] <= 0 and seen["spaceOnSlider"]
    assert seen["boxes"] == ["faces", "wireframe", "contacts", "up"] and "triangles, " in seen["subtitle"]
    assert seen["alone"]["faces"][0] > seen["alone"]["wireframe"][0] > 0 == seen["alone"]["edges"][0] == seen["alone"]["points"][0]
    assert "cut open" not in seen["bodies"]


def write_obj(path, vertices):
    path.write_text("".join(f"v {x!r} {y!r} {z!r}\n" for x, y, z in vertices.tolist()) + "f 1 2 3\nf 4 5 6\n")


@needs_browser
@pytest.mark.parametrize("scale, offset", [(1e-3, 1e8), (1e-290, 0), (1e300, 0)])
def test_scenes_far_away_tiny_and_huge(tmp_path, scale, offset):
    before = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.25, 0.25, 1], [1.25, 0.25, 1], [0.25, 1.25, 1]])
    after = np.concatenate([before[:3], before[3:] - [0, 0, 2]])  # the second triangle falls through the first
    frames = [offset + scale * V for V in (before, after)]
    for k, V in enumerate(frames):
        write_obj(tmp_path / f"t{k}.obj", V)
    assert detect(tmp_path / "t0.obj", tmp_path / "t1.obj", "--html", tmp_path / "page.html").returncode == 0
    page = (tmp_path / "page.html").read_text()
    scene = scene_of(page)
    drawn = np.array(scene["origin"]) + np.array(scene["quantum"]) * blob(page, "positions", "<u2").reshape(2, 6, 3)
    assert np.abs(drawn - frames).max() <= 1.001 * scene["error"] + np.spacing(offset)
    assert scene["error"] <= 0.51 * max(scene["quantum"]) + np.spacing(offset)
    seen = browse(tmp_path / "page.html", tmp_path)
    assert seen["errors"] == [] and seen["marks"] > 20 and seen["drawn"] > 1000


@needs_browser
def test_counts_without_a_list(folder, tmp_path):
    assert detect(folder, "--report", "count", "--html", tmp_path / "page.html").returncode == 0
    seen = browse(tmp_path / "page.html", tmp_path)
    assert seen["errors"] == [] and seen["drawn"] > 0 and seen["marks"] == 0
    assert seen["words"].endswith("contacts (0 listed)")
