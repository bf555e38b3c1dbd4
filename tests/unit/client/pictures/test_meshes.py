# SPDX-License-Identifier: Apache-2.0
"""`detect --meshes` and `--contacts .vtp`: series that read back as what was stepped through and found."""
import csv
import json
import re
import xml.etree.ElementTree as xml

import numpy as np
from conftest import detect

TYPES = {"Float32": "<f4", "Float64": "<f8", "UInt8": "u1", "UInt32": "<u4", "UInt64": "<u8", "Int64": "<i8"}


def read_vtp(path):
    """Arrays by name, and the piece's counts: XML around bytes that are appended raw."""
    data = path.read_bytes()
    mark = data.index(b'<AppendedData encoding="raw">\n_') + len(b'<AppendedData encoding="raw">\n_')
    end = data.rindex(b"\n</AppendedData>")
    tree = xml.fromstring(data[:mark] + data[end:])
    arrays = {}
    at = mark
    for array in tree.iter("DataArray"):
        first = mark + int(array.get("offset"))
        assert first == at  # one after the other, nothing between
        size = int(np.frombuffer(data, "<u8", 1, first)[0])
        values = np.frombuffer(data[first + 8:first + 8 + size], TYPES[array.get("type")])
        components = int(array.get("NumberOfComponents"))
        arrays[array.get("Name")] = values.reshape(-1, components) if components > 1 else values
        at = first + 8 + size
    assert at == end
    return arrays, {name: int(value) for name, value in tree.find("PolyData/Piece").items()}


def read_series(index):
    """Frame numbers and files of a .pvd."""
    return [(int(entry.get("timestep")), index.parent / entry.get("file"))
            for entry in xml.parse(index).getroot().iter("DataSet")]


def contacts_by_frame(folder):
    frames = {}
    with open(folder / "contacts.csv", newline="") as file:
        for row in csv.DictReader(file):
            frames.setdefault(int(row["frame"]), []).append(([int(row[f"v{i}"]) for i in range(4)], float(row["toi"])))
    return frames


def test_meshes_read_back(folder):
    info = json.loads((folder / "info.json").read_text())
    true = np.frombuffer((folder / "frames.pc2").read_bytes(), "<f4", offset=32).reshape(-1, info["vertices"], 3)
    contacts = contacts_by_frame(folder)
    series = read_series(folder / "mesh.pvd")
    assert [number for number, _ in series] == list(range(60))
    cloth = info["bodies"][0]["vertex_count"]
    touched = 0
    for number, path in series:
        arrays, piece = read_vtp(path)
        assert (piece["NumberOfPoints"], piece["NumberOfPolys"], piece["NumberOfVerts"]) == (539, 992, 0)
        assert (arrays["Points"] == true[number]).all() and arrays["Points"].dtype == np.float32
        faces = arrays["connectivity"].reshape(-1, 3)
        assert arrays["offsets"].tolist() == list(range(3, 3 * 992 + 1, 3))
        assert (arrays["body"] == (faces[:, 0] >= cloth)).all() and 0 < arrays["body"].sum() < 992
        least = np.full(539, np.nan)
        for vertices, toi in contacts.get(number, []):
            least[vertices] = np.fmin(least[vertices], toi)
        assert np.array_equal(arrays["toi"], least, equal_nan=True)
        touched += np.isfinite(least).sum()
    assert touched > 100


def test_contacts_read_back(folder, tmp_path):
    assert detect(folder, "--contacts", tmp_path / "c & c.vtp").returncode == 0
    true = contacts_by_frame(folder)
    series = read_series(tmp_path / "c & c.pvd")
    assert [number for number, _ in series] == list(range(1, 60))
    for number, path in series:
        arrays, piece = read_vtp(path)
        assert arrays["toi"].tolist() == [toi for _, toi in true.get(number, [])]
        assert piece["NumberOfPoints"] == piece["NumberOfVerts"] == len(arrays["kind"]) == len(arrays["Points"])


def test_names_that_cannot_be(folder, tmp_path):
    done = detect(folder, "--meshes", tmp_path / "mesh.obj")
    assert done.returncode == 3 and re.search(r"--meshes .*mesh.obj: the name must end in .vtp", done.stderr)
    assert detect(folder, "--meshes", tmp_path / "no" / "mesh.vtp").returncode == 2
