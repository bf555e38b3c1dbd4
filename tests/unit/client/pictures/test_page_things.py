# SPDX-License-Identifier: Apache-2.0
"""Pages of what is no triangle mesh alone: points, edges, half-spaces, bodies along screws and bodies around others."""
import csv
import json

import numpy as np
import pytest
from conftest import detect, run
from page import blob, browse, needs_browser, scene_of


def write_ply(path, vertices, faces=(), edges=()):
    head = ["ply", "format ascii 1.0", f"element vertex {len(vertices)}", "property double x", "property double y", "property double z",
            f"element face {len(faces)}", "property list uchar int vertex_indices",
            f"element edge {len(edges)}", "property int vertex1", "property int vertex2", "end_header"]
    rows = [" ".join(map(repr, row)) for row in np.asarray(vertices, float).tolist()]
    rows += [f"3 {a} {b} {c}" for a, b, c in faces] + [f"{a} {b}" for a, b in edges]
    path.write_text("\n".join(head + rows) + "\n")


def write_scene(folder, frames, bodies, faces=(), edges=()):
    for k, vertices in enumerate(frames):
        write_ply(folder / f"t{k}.ply", vertices, faces, edges)
    (folder / "info.json").write_text(json.dumps({"bodies": bodies}))


def box(half, centre=(0, 0, 0)):
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * half + centre
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return corners, [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]


AXIS = np.array([1, 2, 2]) / 3


def turned_rod(share, angle=2.0, along=0.4):
    """A rod, this share of the way along a screw about an axis that is not its own."""
    k = np.cross(np.eye(3), AXIS)
    rotation = np.eye(3) + np.sin(share * angle) * k + (1 - np.cos(share * angle)) * k @ k
    around = np.array([0.3, 0.2, -0.1])
    return (box([1, 0.1, 0.1])[0] - around) @ rotation.T + around + share * along * AXIS


def detect_rod(where, shares):
    """The page of the rod at these shares of the way; small faces far out keep the view the same."""
    where.mkdir()
    small = 0.1 * np.eye(3)
    static = np.concatenate([small - 2, 2 - small])
    bodies = [{"name": "far", "first_vertex": 8, "vertex_count": 6, "kind": "static"}]
    bodies.insert(0, {"name": "rod", "first_vertex": 0, "vertex_count": 8, "kind": "rigid", "screw": True})
    faces = box([1, 0.1, 0.1])[1] + [(8, 9, 10), (11, 12, 13)]
    write_scene(where, [np.concatenate([turned_rod(share), static]) for share in shares], bodies, faces)
    assert detect(where, "--html", where / "page.html").returncode == 0
    return where / "page.html"


@pytest.fixture(scope="module")
def mixed(tmp_path_factory):
    """Balls that are points, a rod that is an edge, and the ground: a ball falls on another, one on the rod, one on the ground."""
    where = tmp_path_factory.mktemp("mixed")
    frames = [[[0, 0, 0.1], [0, 0, 1 - 0.2 * k], [2, 0, 0.9 - 0.2 * k], [4, 0, 0.8 - 0.2 * k], [1.5, 0, 0.5], [2.5, 0, 0.5]]
              for k in range(5)]
    bodies = [{"name": "balls", "first_vertex": 0, "vertex_count": 4, "kind": "deformable", "thickness": 0.05},
              {"name": "rod", "first_vertex": 4, "vertex_count": 2, "kind": "static", "thickness": 0.05},
              {"name": "ground", "first_vertex": 6, "vertex_count": 0, "kind": "static",
               "half_space": {"point": [0, 0, -0.05], "normal": [0, 0, 1]}}]
    write_scene(where, frames, bodies, edges=[(4, 5)])
    return where


def test_contacts_of_points_have_kinds_of_their_own(mixed, tmp_path):
    assert detect(mixed, "--html", tmp_path / "page.html", "--contacts", tmp_path / "c.csv").returncode == 0
    page = (tmp_path / "page.html").read_text()
    with open(tmp_path / "c.csv", newline="") as file:
        types = [row["type"] for row in csv.DictReader(file)]
    assert {"ve", "vv", "vh"} <= set(types)
    assert [["vf", "ee", "vh", "ve", "vv"][kind] for kind in blob(page, "contact-kind", "u1")] == types


def test_closest_pairs_with_a_half_space_are_no_faces(mixed, tmp_path):
    options = ("--distance", "0.3", "--reduced", "--html", tmp_path / "page.html", "--json", tmp_path / "near.json")
    assert run("near", mixed, *options).returncode == 0
    page = (tmp_path / "page.html").read_text()
    scene, report = scene_of(page), json.loads((tmp_path / "near.json").read_text())
    assert scene["rows"]["vh"] == [frame["vh"] for frame in report["frames"]] and sum(scene["rows"]["vh"]) > 0
    assert sum(scene["rows"]["fv"]) == 0
    assert (blob(page, "contact-kind", "u1") == 4).sum() == sum(scene["rows"]["vh"])


def test_a_page_has_the_twists_of_its_screws(tmp_path):
    page = detect_rod(tmp_path / "rod", (0, 0.5, 1)).read_text()
    assert [body.get("screw", False) for body in scene_of(page)["bodies"]] == [True, False]
    twists = blob(page, "twists", "<f8").reshape(2, 3, 3)  # by step: angular, centre, linear
    assert np.abs(twists[:, 0] - AXIS).max() < 1e-6  # one radian a step
    # The velocity of any point of the rod is that of the screw.
    for step, (angular, centre, linear) in enumerate(twists):
        x, h = turned_rod(0.5 * step)[3], 1e-6
        velocity = np.cross(angular, x - centre) + linear
        assert np.abs(velocity - (turned_rod(0.5 * (step + h))[3] - x) / h).max() < 1e-5


@needs_browser
@pytest.mark.parametrize("dark", [False, True])
def test_points_edges_and_half_spaces_in_a_browser(mixed, dark, tmp_path):
    assert detect(mixed, "--html", tmp_path / "page.html").returncode == 0
    seen = browse(tmp_path / "page.html", tmp_path, dark=dark)
    assert seen["errors"] == [] and seen["dark"] == dark
    assert seen["boxes"] == ["edges", "points", "half-spaces", "contacts", "up"]
    assert seen["subtitle"].startswith("0 triangles, 1 edge, 4 points, 6 vertices, 4 steps")
    for name in ("edges", "points"):
        drawn, contrast = seen["alone"][name]
        assert drawn > 20 and contrast > 3, name
    assert seen["alone"]["grounds"][0] > 1000 and seen["alone"]["faces"][0] == 0
    named = "vertex-face edge-edge vertex-half-space vertex-edge vertex-vertex"
    assert seen["legend"].endswith(named) and seen["captions"][0].endswith(named)
    assert "0 vertex-half-space, 0 vertex-edge" in seen["tip"] and "0.5" not in seen["ticks"] and len(seen["ticks"]) > 1
    assert run("near", mixed, "--distance", "0.3", "--reduced", "--html", tmp_path / "near.html").returncode == 0
    seen = browse(tmp_path / "near.html", tmp_path)
    assert seen["errors"] == [] and "vertex-half-space" in seen["legend"] and "face-vertex" not in seen["legend"]


@needs_browser
def test_one_contact_is_no_contacts(tmp_path):
    for k, z in enumerate((1, -1)):
        write_ply(tmp_path / f"t{k}.ply", [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.25, 0.25, z]], [(0, 1, 2)])
    done = detect(tmp_path / "t0.ply", tmp_path / "t1.ply", "--html", tmp_path / "page.html")
    assert "\n1 step of 1 triangle, 4 vertices: 1 contact (1 vf" in done.stdout
    seen = browse(tmp_path / "page.html", tmp_path)
    assert seen["errors"] == [] and seen["words"] == "frame 0.00, 0 contacts" and seen["ticks"] == ["0", "1"]
    assert seen["subtitle"].startswith("1 triangle, 1 point, 4 vertices, 1 step ")


@needs_browser
def test_bodies_along_screws_keep_their_shape(tmp_path):
    pages = {name: detect_rod(tmp_path / name, shares) for name, shares in (("whole", (0, 1)), ("halves", (0, 0.5)))}
    seen = {name: browse(page, tmp_path / name) for name, page in pages.items()}
    for name in seen:
        assert seen[name]["errors"] == [] and "rod rigid, along a screw" in seen[name]["bodies"]
    error = scene_of(pages["whole"].read_text())["error"]
    assert np.abs(np.array(seen["whole"]["whereHalf"])[:8] - turned_rod(0.5)).max() < 4 * error
    # In the shader as on the CPU: half of the way is drawn as a frame that is there.
    half, there = (np.array(seen[name][when], float) for name, when in (("whole", "half"), ("halves", "one")))
    assert np.abs(half - there).sum() < 0.02 * there.sum()
    assert np.abs(np.array(seen["whole"]["one"], float) - half).sum() > 0.2 * half.sum()


@needs_browser
def test_what_is_around_others_is_cut_open_where_it_has_faces(tmp_path):
    inner, faces = box([0.3, 0.3, 0.3])
    outer, outer_faces = box([1, 1, 1])
    for name, others, edges, told in (
            ("box", [tuple(8 + v for v in face) for face in outer_faces], [], "around deformable, cut open"),
            ("hair", [], [(8 + v, 8 + (v + 1) % 8) for v in range(8)], "around deformable")):
        where = tmp_path / name
        where.mkdir()
        bodies = [{"name": "inner", "first_vertex": 0, "vertex_count": 8}, {"name": "around", "first_vertex": 8, "vertex_count": 8},
                  {"name": "ground", "first_vertex": 16, "vertex_count": 0, "kind": "static",
                   "half_space": {"point": [0, 0, -2], "normal": [0, 0, 1]}}]
        vertices = np.concatenate([inner, outer])
        write_scene(where, [vertices, vertices], bodies, faces + others, edges)
        assert detect(where, "--html", where / "page.html").returncode == 0
        seen = browse(where / "page.html", where)
        assert seen["errors"] == [] and seen["bodies"] == f"inner deformable {told} ground static"


@needs_browser
@pytest.mark.parametrize("half", [[0.1, 0.1, 3], [3, 3, 0.1], [1, 0.1, 0.1]])
@pytest.mark.parametrize("size", ["1200,800", "420,900"])
def test_all_of_a_scene_is_in_view(half, size, tmp_path):
    vertices, faces = box(half)
    write_scene(tmp_path, [vertices, vertices], [], faces)
    assert detect(tmp_path, "--html", tmp_path / "page.html").returncode == 0
    seen = browse(tmp_path / "page.html", tmp_path, size)
    assert seen["errors"] == [] and seen["atRim"] == [0, 0]
    rows, columns = (np.flatnonzero(np.array(seen["coarse"]).reshape(20, 32).any(axis=axis)) for axis in (1, 0))
    assert max(np.ptp(rows) / 20, np.ptp(columns) / 32) > 0.6


def row_of_boxes(count, folder):
    parts = [box([0.3, 0.3, 0.3], [2 * k, 0, 0]) for k in range(count)]
    vertices = np.concatenate([corners for corners, _ in parts])
    faces = [tuple(8 * k + v for v in face) for k, (_, own) in enumerate(parts) for face in own]
    write_scene(folder, [vertices, vertices], [{"first_vertex": 8 * k, "vertex_count": 8} for k in range(count)], faces)
    assert detect(folder, "--html", folder / "page.html").returncode == 0
    return folder / "page.html"


@needs_browser
def test_many_bodies_are_shown_and_hidden_together_or_one_by_one(tmp_path):
    seen = browse(row_of_boxes(25, tmp_path), tmp_path)
    assert seen["errors"] == [] and seen["bodies"].startswith("all bodies body 0 deformable body 1 deformable")
    assert seen["lessDrawn"] > 0.9 * seen["drawn"]


@needs_browser
def test_the_view_goes_to_what_is_shown_and_to_the_pointer(tmp_path):
    seen = browse(row_of_boxes(25, tmp_path), tmp_path)
    drawn = {name: np.array(seen[name]).reshape(20, 32) for name in ("lastAlone", "lastFitted", "allFitted")}
    rows, columns = ({name: np.count_nonzero(at.any(axis=axis)) for name, at in drawn.items()} for axis in (1, 0))
    assert columns["lastAlone"] <= 3 and columns["allFitted"] > 12
    assert rows["lastAlone"] <= 3 and rows["lastFitted"] > 12
    before, after = seen["leftmost"]
    assert after is not None and abs(after - before) <= 3, "the end of the row is under the pointer, and stays in view"


@needs_browser
def test_a_crowd_of_bodies_is_said_to_be_one(tmp_path):
    seen = browse(row_of_boxes(1001, tmp_path), tmp_path)
    assert seen["errors"] == [] and seen["bodies"] == "1,001 bodies, too many to list"
