#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Which meshes of a folder are tangled, and where: every edge that meets a face with which it shares no vertex, by exact
arithmetic. For importers, and for whoever makes datasets.

    PYTHONPATH=build/release/python client/python/examples/check_tangles.py FOLDER [--html PAGE] [--server ADDR]

Looks at every .obj and .ply below the folder. Each is a session of its own, which is asked one question: intersections(). A
line says how many pairs there are and where the first is; the page also shows the places. Exit code 1 where any mesh is
tangled, 2 where one could not be read.
"""
import argparse
import html
import pathlib
import sys
import warnings

import numpy as np

import warmfront

MOST_LISTED, MOST_DRAWN = 20, 2000  # places that the page lists of a mesh; dots of a kind that it draws
PLY_TYPES = {"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4",
             "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4",
             "float32": "f4", "float64": "f8"}


def triangles_of(polygon):
    """A fan: what is not convex is better triangulated before."""
    return [(polygon[0], polygon[k], polygon[k + 1]) for k in range(1, len(polygon) - 1)]


def read_obj(path):
    positions, faces = [], []
    for line in path.read_text().splitlines():
        words = line.split()
        if words[:1] == ["v"]:
            positions.append([float(word) for word in words[1:4]])
        elif words[:1] == ["f"]:
            corners = [int(word.split("/")[0]) for word in words[1:]]
            faces += triangles_of([corner - 1 if corner > 0 else len(positions) + corner for corner in corners])
    return np.array(positions, float), np.array(faces, int).reshape(-1, 3)


class PlyBody:
    """What follows a PLY file's header, value by value."""

    def __init__(self, data, form):
        self.data = data
        self.words = iter(data.split()) if form == "ascii" else None
        self.order = "<" if form == "binary_little_endian" else ">"
        self.at = 0

    def next(self, kind):
        if self.words is not None:
            return float(next(self.words))
        dtype = np.dtype(self.order + PLY_TYPES[kind])
        value = np.frombuffer(self.data, dtype, 1, self.at)[0]
        self.at += dtype.itemsize
        return value


def read_ply(path):
    data = path.read_bytes()
    header, _, body = data.partition(b"end_header")
    lines = [line.split() for line in header.decode("ascii").splitlines()]
    form = next(line[1] for line in lines if line[:1] == ["format"])
    values = PlyBody(body[2:] if body.startswith(b"\r\n") else body[1:], form)
    positions, faces, elements = [], [], []
    for line in lines:
        if line[:1] == ["element"]:
            elements.append((line[1], int(line[2]), []))
        elif line[:1] == ["property"]:
            elements[-1][2].append(line[1:])
    for name, count, properties in elements:
        for _ in range(count):
            row = {}
            for kind, *rest in properties:
                if kind == "list":
                    length = int(values.next(rest[0]))
                    row[rest[2]] = [int(values.next(rest[1])) for _ in range(length)]
                else:
                    row[rest[0]] = float(values.next(kind))
            if name == "vertex":
                positions.append((row["x"], row["y"], row["z"]))
            elif name == "face":
                faces += triangles_of(row.get("vertex_indices") or row["vertex_index"])
    return np.array(positions, float), np.array(faces, int).reshape(-1, 3)


def places(positions, pairs):
    """The middle of each pair's edge: (k, 3)."""
    return positions[np.asarray(pairs.edges, int)].mean(axis=1) if len(pairs) else np.empty((0, 3))


def picture(positions, where):
    """The mesh's vertices from in front, and the places in red."""
    low, high = positions.min(axis=0), positions.max(axis=0)
    size = max(float((high - low).max()), 1e-300)

    def dots(points, radius, colour):
        return "".join(f'<circle cx="{x:.1f}" cy="{300 - y:.1f}" r="{radius}" fill="{colour}"/>'
                       for x, y, _ in (points - low) / size * 280 + 10)
    some, of_where = (points[::len(points) // MOST_DRAWN + 1] for points in (positions, where))
    return f'<svg width="300" height="310">{dots(some, 1, "#bbb")}{dots(of_where, 3, "#c00")}</svg>'


def section(name, positions, faces, where):
    rows = "".join(f"<li>{x:.6g}, {y:.6g}, {z:.6g}</li>" for x, y, z in where[:MOST_LISTED])
    more = f"<p>and {len(where) - MOST_LISTED} more</p>" if len(where) > MOST_LISTED else ""
    said = f"{len(where)} pairs" if len(where) else "not tangled"
    seen = picture(positions, where) + f"<ol>{rows}</ol>{more}" if len(where) else ""
    return f"<h2>{html.escape(name)}</h2><p>{len(positions)} vertices, {len(faces)} triangles: {said}</p>{seen}"


def check(client, path):
    """Positions, faces and the places of what meets."""
    positions, faces = (read_obj if path.suffix == ".obj" else read_ply)(path)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # vertices in no face meet nothing
        with client.session(positions, faces) as session:
            return positions, faces, places(positions, session.intersections())


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--html", type=pathlib.Path, help="write a page")
    parser.add_argument("--server", help="a daemon that runs; else one is started")
    arguments = parser.parse_args()
    paths = sorted(path for path in arguments.folder.rglob("*") if path.suffix in (".obj", ".ply"))
    sections, tangled, unread = [], 0, 0
    with warmfront.connect(*([arguments.server] if arguments.server else [])) as client:
        for path in paths:
            name = str(path.relative_to(arguments.folder))
            try:
                positions, faces, where = check(client, path)
            except (OSError, ValueError, LookupError, StopIteration, warmfront.WarmfrontError) as error:
                unread += 1
                print(f"{name}: {error}", file=sys.stderr)
                sections.append(f"<h2>{html.escape(name)}</h2><p>could not be checked: {html.escape(str(error))}</p>")
                continue
            tangled += len(where) > 0
            first = f", the first at {np.array2string(where[0], precision=6)}" if len(where) else ""
            print(f"{name}: {len(where)} pairs{first}")
            sections.append(section(name, positions, faces, where))
    summary = f"{tangled} of {len(paths)} meshes tangled" + (f", {unread} not checked" if unread else "")
    print(summary)
    if arguments.html:
        arguments.html.write_text(f'<!doctype html><meta charset="utf-8"><title>Tangles</title>'
                                  f"<style>body{{font:15px sans-serif;max-width:50em;margin:2em auto}}</style>"
                                  f"<h1>{html.escape(summary)}</h1>" + "".join(sections))
    sys.exit(2 if unread else 1 if tangled else 0)


if __name__ == "__main__":
    main()
