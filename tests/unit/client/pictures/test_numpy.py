# SPDX-License-Identifier: Apache-2.0
"""Inputs that numpy writes, .npy beside a mesh and .npz, are the same as the folder whose positions they have."""
import json
import struct

import numpy as np
import pytest
from conftest import detect

OPTIONS = ("--bodies", "deformable", "--frames", "20:40", "--json", "-")


def mesh_of(folder):
    """Frames and faces, as the folder has them."""
    info = json.loads((folder / "info.json").read_text())
    positions = np.frombuffer((folder / "frames.pc2").read_bytes(), "<f4", offset=32).reshape(-1, info["vertices"], 3)
    mesh = (folder / "mesh.ply").read_bytes()
    rows = mesh[mesh.index(b"end_header\n") + 11 + 12 * info["vertices"]:]
    faces = np.frombuffer(rows, [("count", "u1"), ("v", "<i4", 3)], info["triangles"])["v"]
    return positions, faces


def hash_of(*inputs):
    done = detect(*inputs, *OPTIONS)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)["contacts_hash"]


@pytest.fixture(scope="module")
def expected(folder):
    return hash_of(folder)


def test_a_cache_after_a_mesh(folder, expected, tmp_path):
    positions, faces = mesh_of(folder)
    obj = tmp_path / "mesh.obj"
    obj.write_text("".join("v 0 0 0\n" for _ in positions[0]) + "".join("f {} {} {}\n".format(*(face + 1)) for face in faces))
    np.save(tmp_path / "frames.npy", positions)
    np.save(tmp_path / "double.npy", positions.astype(">f8"))
    frames, points, _ = positions.shape
    (tmp_path / "frames.MDD").write_bytes(struct.pack(">ii", frames, points) + np.arange(frames).astype(">f4").tobytes() +
                                          positions.astype(">f4").tobytes())
    for cache in (folder / "frames.pc2", tmp_path / "frames.MDD", tmp_path / "frames.npy", tmp_path / "double.npy"):
        assert hash_of(obj, cache) == expected, cache


def test_an_npz(folder, expected, tmp_path):
    positions, faces = mesh_of(folder)
    for name, of_positions, of_faces in (("a", positions, faces), ("b", positions.astype(np.float64), faces.astype(np.uint16))):
        np.savez(tmp_path / f"{name}.npz", positions=of_positions, faces=of_faces, comment=np.array([1]))
        assert hash_of(tmp_path / f"{name}.npz") == expected
    assert "comment is not looked at" in detect(tmp_path / "a.npz", *OPTIONS).stderr


def test_edges_of_an_npz(tmp_path):
    """A hair that falls through another."""
    frames = np.array([[[-1, 0, z], [1, 0, z], [0, -1, 0], [0, 1, 0]] for z in (1, .5, -.5)])
    np.savez(tmp_path / "hair.npz", positions=frames, faces=np.zeros((0, 3), int), edges=[[0, 1], [2, 3]])
    report = json.loads(detect(tmp_path / "hair.npz", "--json", "-").stdout)
    assert [step["ee"] for step in report["frames"]] == [0, 1] and report["edges"] == 2


@pytest.mark.parametrize("arrays, says", [
    (dict(faces=[[0, 1, 2]]), "holds no array 'positions'"),
    (dict(positions=np.zeros((2, 3, 3))), "holds no array 'faces'"),
    (dict(positions=np.zeros((2, 3, 3)), faces=[[0, 1, 3]]), "faces name a vertex beyond the 3 of positions"),
    (dict(positions=np.zeros((2, 3, 3)), faces=[[0, 1, -1]]), "faces[0, 2] is no vertex's number"),
    (dict(positions=np.zeros((2, 3, 3)), faces=[[0, 1, 2]], edges=[[0, 9]]), "edges name a vertex beyond"),
    (dict(positions=np.zeros((2, 3, 3)), faces=[0, 1, 2]), "integers of the shape (any, 3) are expected"),
    (dict(positions=np.zeros((2, 3, 3)), faces=[[0., 1., 2.]]), "integers of the shape (any, 3) are expected"),
    (dict(positions=np.zeros((1, 3, 3)), faces=[[0, 1, 2]]), "1 frames, but 2 are needed"),
    (dict(positions=np.zeros((2, 0, 3)), faces=np.zeros((0, 3), int)), "positions of no vertex"),
    (dict(positions=np.zeros((3, 3)), faces=[[0, 1, 2]]), "(3, 3) of <f8; positions are expected"),
    (dict(positions=np.asfortranarray(np.zeros((2, 4, 3))), faces=[[0, 1, 2]]), "numpy.ascontiguousarray"),
    (dict(positions=np.full((2, 3, 3), np.nan), faces=[[0, 1, 2]]), "not a number"),
])
def test_what_is_refused(tmp_path, arrays, says):
    np.savez(tmp_path / "a.npz", **arrays)
    done = detect(tmp_path / "a.npz")
    assert done.returncode == 2 and says in done.stderr and len(done.stderr.splitlines()) == 1, done.stderr


def test_a_compressed_npz_is_refused(tmp_path):
    np.savez_compressed(tmp_path / "a.npz", positions=np.zeros((2, 3, 3)), faces=[[0, 1, 2]])
    assert "write it with numpy.savez" in detect(tmp_path / "a.npz").stderr
