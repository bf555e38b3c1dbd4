# SPDX-License-Identifier: Apache-2.0
"""Pages of what is no triangle mesh alone: points, edges, half-spaces and bodies along screws."""
import csv
import json

import numpy as np
import pytest
from conftest import detect, run
from page import blob, scene_of


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
