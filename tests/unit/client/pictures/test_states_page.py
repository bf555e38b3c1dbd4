# SPDX-License-Identifier: Apache-2.0
"""`near --html` and `tangled --html`: the page carries the pairs of each frame that the lists have, and says what they are."""
import csv
import json

import numpy as np
import pytest
from conftest import run
from page import blob, browse, needs_browser, scene_of

FRAMES = range(4, 13)
CLOSEST = ["vv", "ev", "ee", "fv", "vh"]


def ask(where, folder, verb, *options, code=0):
    """The page's path, its text, its JSON, and the report."""
    page, report = where / f"{verb}.html", where / f"{verb}.json"
    done = run(verb, folder, *options, "--html", page, "--json", report)
    assert done.returncode == code, done.stderr
    text = page.read_text()
    return page, text, scene_of(text), json.loads(report.read_text())


def rows_of(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def f4(values):
    return [float(np.float32(value)) for value in values]


def ends_of(rows, frames):
    return np.cumsum([sum(int(row["frame"]) == frame for row in rows) for frame in frames]).tolist()


@pytest.fixture(scope="module")
def near(folder, tmp_path_factory):
    where = tmp_path_factory.mktemp("near")
    return *ask(where, folder, "near", "--distance", "0.05", "--frames", "4:12", "--contacts", where / "near.csv", "--fields",
                "squared_distance"), rows_of(where / "near.csv")


@pytest.fixture(scope="module")
def closest(folder, tmp_path_factory):
    where = tmp_path_factory.mktemp("closest")
    return *ask(where, folder, "near", "--distance", "0.05", "--frames", "4:12", "--reduced", "--contacts", where / "near.csv",
                "--fields", "squared_distance"), rows_of(where / "near.csv")


@pytest.fixture(scope="module")
def tangled(folder, tmp_path_factory):
    where = tmp_path_factory.mktemp("tangled")
    return *ask(where, folder, "tangled", "--frames", "4:12", "--pairs", where / "pairs.csv", code=1), rows_of(where / "pairs.csv")


def test_near_carries_what_is_listed(near):
    _, page, scene, report, rows = near
    assert len(rows) > 500 and (scene["asked"], scene["distance"], scene["thick"]) == ("near", 0.05, False)
    assert scene["contacts_hash"] == report["contacts_hash"]
    assert scene["steps"] == [frame["frame"] for frame in report["frames"]] == list(FRAMES)
    for name in ("vf", "ee", "possible", "least_distance"):
        assert scene[name] == [frame[name] for frame in report["frames"]]
    assert scene["ms"] == {"total": [frame["ms"] for frame in report["frames"]]}
    assert blob(page, "contact-v", "<u4").reshape(-1, 4).tolist() == [[int(row[f"v{i}"]) for i in range(4)] for row in rows]
    assert blob(page, "contact-kind", "u1").tolist() == [row["type"] == "ee" for row in rows]
    shares = [np.sqrt(float(row["squared_distance"])) / 0.05 for row in rows]
    assert blob(page, "contact-share", "<f4").tolist() == f4(shares) and max(shares) < 1 + 1e-5
    assert scene["contact_ends"] == ends_of(rows, FRAMES)


def test_closest_pairs_are_what_their_stencils_say(closest):
    _, page, scene, report, rows = closest
    assert len(rows) > 100 and scene["asked"] == "closest"
    vertices = blob(page, "contact-v", "<u4").reshape(-1, 4)
    counts = {name: [0] * len(FRAMES) for name in CLOSEST}
    for v, kind, row in zip(vertices, blob(page, "contact-kind", "u1"), rows):
        inside = {int(row[f"v{i}"]) for i in range(4) if int(row["stencil"]) >> i & 1}
        name = {2: "vv", 3: "ev", 4: "ee" if row["type"] == "ee" else "fv"}[bin(int(row["stencil"])).count("1")]
        assert CLOSEST[kind] == name and set(v[:len(inside)].tolist()) == inside
        counts[name][int(row["frame"]) - FRAMES[0]] += 1
    assert scene["rows"] == counts and all(sum(counts[name]) > 0 for name in ("ev", "ee", "fv"))
    assert [scene["vf"], scene["ee"]] == [[frame[name] for frame in report["frames"]] for name in ("vf", "ee")]
    assert blob(page, "contact-share", "<f4").tolist() == f4(np.sqrt(float(row["squared_distance"])) / 0.05 for row in rows)
    assert scene["contact_ends"] == ends_of(rows, FRAMES)


def test_tangled_carries_what_is_listed(tangled):
    _, page, scene, report, rows = tangled
    assert len(rows) > 20 and scene["asked"] == "tangled" and scene["steps"] == list(FRAMES)
    assert scene["ef"] == [frame["pairs"] for frame in report["frames"]]
    corners = [[int(row[name]) for name in ("e0", "e1", "f0", "f1", "f2")] for row in rows]
    assert blob(page, "contact-v", "<u4").reshape(-1, 5).tolist() == corners
    assert blob(page, "contact-kind", "u1").tolist() == [0] * len(rows)
    assert "contact-share" not in page.split("<script>")[0] and "contact-toi" not in page.split("<script>")[0]
    assert scene["contact_ends"] == ends_of(rows, FRAMES)


def test_positions_are_those_of_the_frames(folder, near):
    _, page, scene, *_ = near
    true = np.frombuffer((folder / "frames.pc2").read_bytes(), "<f4", offset=32).reshape(-1, scene["vertices"], 3)[4:13]
    drawn = np.array(scene["origin"]) + np.array(scene["quantum"]) * blob(page, "positions", "<u2").reshape(true.shape)
    assert np.abs(drawn - true).max() == pytest.approx(scene["error"], rel=1e-6)
    assert 0 < scene["error"] <= 0.5001 * max(scene["quantum"])


def test_where_things_are_thick_shares_are_of_what_counts(folder, tmp_path):
    info = json.loads((folder / "info.json").read_text())
    thick = [0.04, 0.01]
    for body, thickness in zip(info["bodies"], thick):
        body["thickness"] = thickness
    for name in ("mesh.ply", "frames.pc2"):
        (tmp_path / name).write_bytes((folder / name).read_bytes())
    (tmp_path / "info.json").write_text(json.dumps(info))
    _, page, scene, _ = ask(tmp_path, tmp_path, "near", "--distance", "0.01", "--frames", "4:6", "--contacts",
                            tmp_path / "near.csv", "--fields", "squared_distance")
    first_of_ball = info["bodies"][1]["first_vertex"]
    shares = []
    for row in rows_of(tmp_path / "near.csv"):
        a, b = int(row["v0"]), int(row["v3"])
        most = 0.01 + thick[a >= first_of_ball] + thick[b >= first_of_ball]
        shares.append(np.sqrt(float(row["squared_distance"])) / most)
    assert scene["thick"] and len(shares) > 50 and 0.5 < max(shares) < 1 + 1e-5
    assert blob(page, "contact-share", "<f4") == pytest.approx(shares, rel=1e-6)


def test_misuse_and_limits(folder, tmp_path):
    page = tmp_path / "page.html"
    near, tangled = ["near", folder, "--distance", "0.05"], ["tangled", folder]
    for what in (near, tangled):
        for limit, told in (("100KiB", "the positions of 60 frames"), ("271KiB", "positions and the pairs so far")):
            done = run(*what, "--html", page, "--html-limit", limit)
            assert done.returncode == 2 and not page.exists()
            assert told in done.stderr and "fewer --frames, or a larger --html-limit" in done.stderr
        assert run(*what, "--html-limit", "1MiB").returncode == 3
        assert run(*what, "--html", tmp_path / "no" / "page.html").returncode == 2
    for what in ([*near, "--count"], [*tangled, "--any"]):
        done = run(*what, "--html", page)
        assert done.returncode == 3 and f"{what[-1]} lists no pairs for --html" in done.stderr and not page.exists()


@needs_browser
@pytest.mark.parametrize("size", ["1200,800", "420,900"])
@pytest.mark.parametrize("verb", ["near", "closest", "tangled"])
def test_in_a_browser(verb, size, folder, tmp_path, request):
    page, _, _, report, rows = request.getfixturevalue(verb)
    seen = browse(page, tmp_path, size)
    totals = [sum(int(row["frame"]) == frame for row in rows) for frame in FRAMES]
    things = "closest pairs" if verb == "closest" else "pairs"
    assert seen["errors"] == [] and seen["title"] == folder.name and seen["steps"] == 9
    # It opens where the most pairs are, draws meshes and marks, and neither when they are switched off.
    assert seen["opened"] == totals.index(max(totals))
    pixels = seen["size"][0] * seen["size"][1]
    assert 0.02 * pixels < seen["drawn"] < 0.9 * pixels
    assert seen["marks"] > 50 and seen["marksWithout"] == 0
    assert 0 < seen["drawnAsEdges"] < seen["drawn"] and seen["lessDrawn"] > 0
    # It goes from frame to frame: by the slider, keys and chart; the picture and the words follow.
    assert (seen["slid"], seen["slidWords"]) == (0, f"frame 4, {totals[0]:,} {things}")
    assert seen["changed"] > 0.01 * pixels and seen["same"] == 0
    assert (seen["right"], seen["rightTen"], seen["end"], seen["left"]) == (1, 8, 8, 7)
    assert seen["words"] == f"frame 11, {totals[7]:,} {things}"
    assert (seen["clickedInside"], seen["clicked"]) == (3, 8)  # 0.37 of nine bars
    assert seen["zoomed"] > 0 and seen["viewReset"] == 0
    assert not seen["tipHidden"] and seen["tip"].startswith("frame 4 ") and seen["tipLeft"]
    assert 0 < seen["played"] <= 9 and seen["paused"] and seen["pausedAt"] in range(1, 9) and seen["unnamed"] == 0
    # What it says is true of the verb: no time of impact, no stages; kinds of pairs that there are.
    assert "impact" not in seen["legend"] and "contacts" not in seen["shown"] and "first at" not in seen["tip"]
    assert seen["captions"][1] == "milliseconds a frame" and "9 frames · " in seen["subtitle"]
    first = report["frames"][0]
    if verb == "near":
        assert seen["bars"] == 3 and seen["captions"][0] == "pairs a frame vertex-face edge-edge"
        assert seen["legend"] == "distance 0 0.025 0.05 vertex-face edge-edge"
        assert seen["subtitle"].endswith("pairs within 0.05, certified") and "contacts_hash" in seen["foot"]
        assert seen["tip"].startswith(f"frame 4 {first['vf']} vertex-face, {first['ee']} edge-edge")
    elif verb == "closest":
        assert seen["bars"] == 5 and "of " in seen["tip"] and "least distance" in seen["tip"]
        named = ["vertex-vertex", "edge-vertex", "edge-edge", "face-vertex", "vertex-half-space"]
        assert [name in seen["legend"] for name in named] == [any(scene_of(page.read_text())["rows"][kind]) for kind in CLOSEST]
    else:
        assert seen["bars"] == 2 and seen["captions"][0] == "pairs a frame edge-face"
        assert seen["legend"] == "edges that meet faces edge-face" and "contacts" not in seen["foot"]
        assert seen["tip"].startswith(f"frame 4 {first['pairs']} edge-face")


@needs_browser
@pytest.mark.parametrize("scale, offset", [(1, 0), (1e-3, 1e8), (1e-290, 0), (1e300, 0)])
@pytest.mark.parametrize("verb", ["near", "tangled"])
def test_one_frame_of_any_size(verb, scale, offset, tmp_path):
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.25, 0.25, -1], [0.25, 0.25, 1], [0.3, 0.3, 2]]) * scale + offset
    (tmp_path / "t.obj").write_text("".join(f"v {x!r} {y!r} {z!r}\n" for x, y, z in corners.tolist()) + "f 1 2 3\nf 4 5 6\n")
    options = ["--distance", repr(0.5 * scale)] if verb == "near" else []
    page, text, scene, _ = ask(tmp_path, tmp_path / "t.obj", verb, *options, code=1 if verb == "tangled" else 0)
    assert blob(text, "positions", "<u2").size == 18 and scene["contact_ends"][0] > 0
    seen = browse(page, tmp_path)
    assert seen["errors"] == [] and seen["marks"] > 20 and seen["drawn"] > 1000
    count = scene["contact_ends"][0]
    assert (seen["opened"], seen["end"], seen["playable"]) == (0, 0, False)
    assert seen["words"] == f"frame 0, {count} pair{'' if count == 1 else 's'}" and "1 frame · " in seen["subtitle"]
