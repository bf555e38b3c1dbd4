# SPDX-License-Identifier: Apache-2.0
"""The state needed to create a session again: its scene and all current positions. Used by one thread at a time."""
from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, Optional

import numpy as np
import numpy.typing as npt

from . import _frame
from ._frame import Part, SentFrame
from ._part_way import pose_part_way, vertices_part_way
from ._question import Question
from ._topology import Topology
from ._wire import Bytes
from .errors import FailedPreconditionError, InvalidArgumentError
from .scene import Body, PairFilters, edges_of, faces_of, half_space_of, indices_of, placed, pose_of, positions_of, thickness_of
from .v1 import options_pb2, session_pb2


def raw(array: npt.NDArray[Any]) -> memoryview:
    """An array's memory, which must be contiguous."""
    return array.reshape(-1).view(np.uint8).data


def _given_thickness(thickness: Any, count: int) -> npt.NDArray[np.float64]:
    """One for each of a body's vertices, also where all are 0: so it is said that they have none."""
    given = thickness_of(thickness, count)
    return np.zeros(count) if given is None else given


def _set_pairs(message: Any, pairs: Sequence[tuple[int, int]]) -> None:
    """Into repeated v1.BodyPair."""
    del message[:]
    for k, pair in enumerate(pairs):
        try:
            a, b = pair
            message.add(a=a, b=b)
        except (TypeError, ValueError):
            raise InvalidArgumentError(f"excluded_pairs[{k}]: {pair!r} are no two indices of bodies") from None


class SceneState:
    """The scene, and its positions after the last answered frame."""

    def __init__(self, positions: Any, faces: Any, bodies: Sequence[Body],
                 excluded_pairs: Sequence[tuple[int, int]], filters: PairFilters = PairFilters(),
                 thickness: Any = None, edges: Any = None) -> None:
        """positions (n, 3) float32 or float64, the type of all positions of the session's frames; a copy is kept. They are
        the rest shape where the filters need one and have none."""
        self._rows = positions_of(positions, None, None).copy()
        self._latest: Optional[Bytes] = None  # of a frame with all positions; newer than _rows
        self.dtype: np.dtype[Any] = self._rows.dtype
        self.faces = faces_of(faces).copy()
        self.edges = edges_of(edges).copy()
        self.bodies = placed(bodies)
        self.excluded_pairs = list(excluded_pairs)
        self.filters = filters.copied(len(self._rows), lambda: self._rows)
        self.thickness = thickness_of(thickness, len(self._rows))
        self._topology: Optional[Topology] = None
        self.layout = object()  # another one where vertices or bodies have other numbers
        self._poses: list[Optional[npt.NDArray[np.float64]]] = [None] * len(self.bodies)

    @property
    def vertex_count(self) -> int:
        return len(self._rows)

    def topology(self) -> Topology:
        """Of the current scene."""
        if self._topology is None:
            self._topology = Topology(self.faces, self.edges, self.bodies)
        return self._topology

    def positions(self) -> Bytes:
        """The upload's: (n, 3) in the session's dtype; for rigid bodies with a pose, their reference shapes."""
        return self._latest if self._latest is not None else raw(self._rows)

    def describe(self, header: session_pb2.SessionHeader) -> None:
        """Writes the scene's description, except faces, edges, positions, thickness and arrays of filters, into the header."""
        header.vertex_count = self.vertex_count
        header.face_count = len(self.faces)
        header.edge_count = len(self.edges)
        header.dtype = options_pb2.DTYPE_FLOAT32 if self.dtype.itemsize == 4 else options_pb2.DTYPE_FLOAT64
        del header.bodies[:]
        for index, body in enumerate(self.bodies):
            body.put_into(header.bodies.add(), index)
        _set_pairs(header.excluded_pairs, self.excluded_pairs)
        header.vertex_thickness = self.thickness is not None
        header.ClearField("filters")
        if self.filters.given:
            self.filters.announce_in(header.filters)
        posed = [b for b, pose in enumerate(self._poses) if pose is not None]
        header.pose_bodies = np.array(posed, dtype="<u4").tobytes()
        header.poses = b"".join(pose.tobytes() for pose in self._poses if pose is not None)

    # Frames.

    def encode(self, number: int, positions: Any, bodies: Mapping[int, Any], poses: Mapping[int, Any], vertices: Any,
               vertex_positions: Any, chunk_bytes: int, question: Question) -> SentFrame:
        """A frame's messages. InvalidArgumentError for positions that the session's dtype does not hold exactly or of another
        number than the session's, and for bodies that are not there."""
        if positions is not None:
            if bodies or poses or vertices is not None or vertex_positions is not None:
                raise InvalidArgumentError("positions: the frame gives all vertices and also parts; give only one of them")
            array = positions_of(positions, self.vertex_count, self.dtype)
            return SentFrame(number, raw(array), [], chunk_bytes, question)
        parts = [*self._body_parts(bodies), *self._pose_parts(poses), *self._vertex_parts(vertices, vertex_positions)]
        return SentFrame(number, None, [part for part in parts if len(part[1]) > 0], chunk_bytes, question)

    def _body_parts(self, bodies: Mapping[int, Any]) -> list[Part]:
        rows = [raw(positions_of(positions, self._body(b, f"bodies[{b}]").vertex_count, self.dtype, f"bodies[{b}]"))
                for b, positions in bodies.items()]
        return [(_frame.BODIES, np.array(list(bodies), dtype="<u4").tobytes()),
                (_frame.BODY_POSITIONS, rows[0] if len(rows) == 1 else b"".join(rows))]

    def _pose_parts(self, poses: Mapping[int, Any]) -> list[Part]:
        for b in poses:
            self._body(b, f"poses[{b}]")
        matrices = [pose_of(pose, f"poses[{b}]").astype(self.dtype).tobytes() for b, pose in poses.items()]
        # Poses of all rigid bodies in order need no body indices.
        named = np.array([] if list(poses) == self._rigid() else list(poses), dtype="<u4")
        return [(_frame.POSE_BODIES, named.tobytes()), (_frame.POSES, b"".join(matrices))]

    def _vertex_parts(self, vertices: Any, vertex_positions: Any) -> list[Part]:
        if (vertices is None) != (vertex_positions is None):
            raise InvalidArgumentError("vertices and vertex_positions belong together; give both or neither")
        if vertices is None:
            return []
        indices = indices_of(vertices, "vertices")
        array = positions_of(vertex_positions, len(indices), self.dtype, "vertex_positions")
        return [(_frame.VERTICES, raw(indices)), (_frame.VERTEX_POSITIONS, raw(array))]

    def take(self, frame: SentFrame) -> None:
        """Makes an answered frame's positions current."""
        if frame.whole:
            self._latest = frame.positions()
            self._forget_poses()
            return
        self._take_bodies(frame)
        for b, matrix in self._poses_in(frame):
            self._poses[b] = matrix
        vertices, rows = self._vertices_in(frame)
        if len(vertices) > 0:
            self._writable()[vertices] = rows

    def _take_bodies(self, frame: SentFrame) -> None:
        """Bodies whose vertices follow one another are copied as one: there may be tens of thousands."""
        bodies = np.frombuffer(frame.bytes_of(_frame.BODIES), "<u4")
        if len(bodies) == 0:
            return
        moved = np.frombuffer(frame.bytes_of(_frame.BODY_POSITIONS), self.dtype).reshape(-1, 3)
        first = np.array([self.bodies[b].first_vertex for b in bodies.tolist()], np.int64)
        count = np.array([self.bodies[b].vertex_count for b in bodies.tolist()], np.int64)
        begins = np.concatenate([[0], 1 + np.flatnonzero(first[1:] != first[:-1] + count[:-1])])
        at = np.concatenate([[0], np.cumsum(count)])
        rows = self._writable()
        for begin, end in zip(begins, [*begins[1:], len(bodies)]):
            rows[first[begin]:first[end - 1] + count[end - 1]] = moved[at[begin]:at[end]]
        for b in bodies.tolist():
            self._poses[b] = None

    def take_part(self, frame: SentFrame, fraction: float) -> None:
        """The trial was committed up to `fraction`: everything is that part of the way to where it says (v1.Commit)."""
        if fraction == 1:
            return self.take(frame)
        if fraction == 0:
            return
        if frame.whole:
            end = np.frombuffer(frame.positions(), self.dtype).reshape(-1, 3)
            rows = vertices_part_way(self.placed(), end.astype(np.float64), fraction, self.dtype)
            self._latest = None
            self._rows = rows.astype(self.dtype)
            self._forget_poses()
            return
        for b, end in self._bodies_in(frame):
            self._body_rows(b)[:] = vertices_part_way(self._placed_body(b), end.astype(np.float64), fraction, self.dtype)
            self._poses[b] = None
        for b, matrix in self._poses_in(frame):
            start = self._poses[b]
            self._poses[b] = pose_part_way(np.eye(3, 4) if start is None else start, matrix, fraction, self.dtype)
        vertices, end = self._vertices_in(frame)
        if len(vertices) > 0:
            rows = self._writable()
            rows[vertices] = vertices_part_way(rows[vertices].astype(np.float64), end.astype(np.float64), fraction, self.dtype)

    def _forget_poses(self) -> None:
        """All vertices were given, which says nothing of half-spaces."""
        self._poses = [pose if body.half_space is not None else None for body, pose in zip(self.bodies, self._poses)]

    def _bodies_in(self, frame: SentFrame) -> Iterator[tuple[int, npt.NDArray[Any]]]:
        moved = np.frombuffer(frame.bytes_of(_frame.BODY_POSITIONS), self.dtype).reshape(-1, 3)
        at = 0
        for b in np.frombuffer(frame.bytes_of(_frame.BODIES), "<u4"):
            count = self.bodies[b].vertex_count
            yield int(b), moved[at:at + count]
            at += count

    def _poses_in(self, frame: SentFrame) -> Iterator[tuple[int, npt.NDArray[np.float64]]]:
        matrices = np.frombuffer(frame.bytes_of(_frame.POSES), self.dtype).reshape(-1, 3, 4).astype("<f8")
        if len(matrices) > 0:
            named: list[int] = np.frombuffer(frame.bytes_of(_frame.POSE_BODIES), "<u4").tolist()
            yield from zip(named or self._rigid(), matrices)

    def _vertices_in(self, frame: SentFrame) -> tuple[npt.NDArray[np.uint32], npt.NDArray[Any]]:
        vertices = np.frombuffer(frame.bytes_of(_frame.VERTICES), "<u4")
        return vertices, np.frombuffer(frame.bytes_of(_frame.VERTEX_POSITIONS), self.dtype).reshape(-1, 3)

    # Changes between frames: the request, and its effect on the state after the daemon has carried it out.

    def encode_addition(self, body: Body, faces: Any, positions: Any, edges: Any = None) -> session_pb2.SceneChange:
        change = session_pb2.SceneChange()
        replace(body, first_vertex=0).put_into(change.add.body, len(self.bodies))
        change.add.faces = faces_of(faces).tobytes()
        change.add.edges = edges_of(edges).tobytes()
        change.add.positions = self._added_rows(body, positions).tobytes()
        return change

    def _added_rows(self, body: Body, positions: Any) -> npt.NDArray[Any]:
        if positions is None and body.half_space is not None:
            return np.empty((0, 3), self.dtype)
        return positions_of(positions, body.vertex_count, self.dtype)

    def take_addition(self, body: Body, faces: Any, positions: Any, edges: Any = None) -> None:
        first = self.vertex_count
        self.bodies.append(replace(body, first_vertex=first))
        self.faces = np.concatenate([self.faces, faces_of(faces) + np.int32(first)])
        self.edges = np.concatenate([self.edges, edges_of(edges) + np.int32(first)])
        rows = self._added_rows(body, positions)
        self._rows = np.concatenate([self._writable(), rows])
        self.filters = self.filters.with_body(rows)
        if self.thickness is not None:
            self.thickness = np.concatenate([self.thickness, np.zeros(len(rows))])
        self._topology = None
        self.layout = object()
        self._poses.append(None)

    def encode_elements(self, index: int, faces: Any, edges: Any = None) -> session_pb2.SceneChange:
        if self.bodies:  # else index 0 is the whole scene, of which the daemon tells
            self._body(index, "index")
        change = session_pb2.SceneChange()
        change.replace_elements.index = index
        change.replace_elements.faces = faces_of(faces).tobytes()
        change.replace_elements.edges = edges_of(edges).tobytes()
        return change

    def take_elements(self, index: int, faces: Any, edges: Any = None) -> None:
        self._topology = None
        if not self.bodies:
            self.faces, self.edges = faces_of(faces).copy(), edges_of(edges).copy()
        else:
            self._replace_mesh(index, self.bodies[index].vertex_count, faces_of(faces), edges_of(edges))

    def replacing(self, index: int, positions: Any, body: Optional[Body]) -> Body:
        """The description of what takes a body's place: another one, or its own with as many vertices as are given."""
        if body is not None:
            return replace(body, first_vertex=0)
        if not self.bodies:
            raise FailedPreconditionError("bodies: the session declares none; declare its bodies to replace one, or replace the "
                                          "elements of all of it as body 0")
        old = self._body(index, "index")
        return replace(old, first_vertex=0, vertex_count=len(positions_of(positions, None, self.dtype)))

    def encode_replacement(self, index: int, body: Body, faces: Any, positions: Any, edges: Any,
                           thickness: Any) -> session_pb2.SceneChange:
        """`body` as replacing() returned."""
        if self.bodies:  # else the daemon says what to do
            self._body(index, "index")
        change = session_pb2.SceneChange()
        change.replace_body.index = index
        to = getattr(change.replace_body, "with")
        body.put_into(to.body, index)
        to.faces = faces_of(faces).tobytes()
        to.edges = edges_of(edges).tobytes()
        to.positions = positions_of(positions, body.vertex_count, self.dtype).tobytes()
        if thickness is not None:
            to.thickness = _given_thickness(thickness, body.vertex_count).tobytes()
        return change

    def take_replacement(self, index: int, body: Body, faces: Any, positions: Any, edges: Any, thickness: Any) -> None:
        old = self.bodies[index]
        first, count = old.first_vertex, body.vertex_count
        assert first is not None
        end = first + old.vertex_count
        self._replace_mesh(index, count, faces_of(faces), edges_of(edges))
        rows = positions_of(positions, count, self.dtype)
        self._rows = np.concatenate([self._writable()[:first], rows, self._rows[end:]])
        self.filters = self.filters.with_replaced(first, end, rows)
        if self.thickness is not None or thickness is not None:
            before = self.thickness if self.thickness is not None else np.zeros(len(self._rows) - count + old.vertex_count)
            given = np.zeros(count) if thickness is None else _given_thickness(thickness, count)
            self.thickness = np.concatenate([before[:first], given, before[end:]])
        self.bodies[index] = body
        self.bodies = placed([replace(each, first_vertex=None) for each in self.bodies])
        self._topology = None
        self.layout = object()
        self._poses[index] = None

    def _replace_mesh(self, index: int, count: int, faces: npt.NDArray[np.int32], edges: npt.NDArray[np.int32]) -> None:
        """Faces and edges are of bodies in their order; one body has these, and `count` vertices, from now on."""
        body = self.bodies[index]
        assert body.first_vertex is not None
        first, last = body.first_vertex, body.first_vertex + body.vertex_count
        ends = np.array([each.first_vertex + each.vertex_count for each in self.bodies if each.first_vertex is not None])

        def replaced(all_of: npt.NDArray[np.int32], these: npt.NDArray[np.int32]) -> npt.NDArray[np.int32]:
            all_of = all_of[np.argsort(np.searchsorted(ends, all_of[:, 0], side="right"), kind="stable")]
            before, after = all_of[all_of[:, 0] < first], all_of[all_of[:, 0] >= last]
            return np.concatenate([before, these + np.int32(first), after + np.int32(count - body.vertex_count)])

        self.faces, self.edges = replaced(self.faces, faces), replaced(self.edges, edges)

    def encode_filters(self, filters: PairFilters) -> session_pb2.SceneChange:
        """Of what PairFilters.copied() made."""
        change = session_pb2.SceneChange()
        change.change_filters.SetInParent()
        filters.put_into(change.change_filters)
        return change

    def take_filters(self, filters: PairFilters) -> None:
        self.filters = filters

    def encode_excluded_pairs(self, pairs: Sequence[tuple[int, int]]) -> session_pb2.SceneChange:
        change = session_pb2.SceneChange()
        change.change_excluded_pairs.SetInParent()
        _set_pairs(change.change_excluded_pairs.pairs, pairs)
        return change

    def take_excluded_pairs(self, pairs: Sequence[tuple[int, int]]) -> None:
        self.excluded_pairs = list(pairs)

    def encode_change(self, index: int, body: Body) -> session_pb2.SceneChange:
        """FailedPreconditionError for a body that is at a pose and would be rigid no more, in a session of float32: where its
        vertices are is not known in float32."""
        old = self._body(index, "index")
        if self.dtype.itemsize == 4 and self._poses[index] is not None and body.kind not in ("rigid", "removed") \
                and old.half_space is None:
            raise FailedPreconditionError(f"body {index} is at a pose, and its vertices are not known in the session's "
                                          "float32; give its positions in a frame before it becomes another kind")
        change = session_pb2.SceneChange()
        change.change.index = index
        replace(body, first_vertex=old.first_vertex, vertex_count=old.vertex_count).put_into(change.change.body, index)
        return change

    def take_change(self, index: int, body: Body) -> None:
        old = self.bodies[index]
        if body.half_space is None:
            body = replace(body, half_space=old.half_space)  # of one that is removed
        if old.half_space is not None:
            before, now = (half_space_of(each.half_space, f"body {index}") for each in (old, body))
            if body.kind != old.kind or now != before:
                self._poses[index] = None  # described anew, it is where that says
        self.bodies[index] = replace(body, first_vertex=old.first_vertex, vertex_count=old.vertex_count)
        pose = self._poses[index]
        if pose is None or body.kind == "rigid":
            return
        if self.dtype.itemsize == 8:
            self._body_rows(index)[:] = self._placed_body(index)
        self._poses[index] = None

    # Current positions.

    def placed(self) -> npt.NDArray[np.float64]:
        """(n, 3): where everything is, bodies that are at a pose too. A copy."""
        rows = np.frombuffer(self.positions(), self.dtype).reshape(-1, 3).astype(np.float64)
        for b, pose in enumerate(self._poses):
            if pose is not None:
                first = self.bodies[b].first_vertex
                assert first is not None
                rows[first:first + self.bodies[b].vertex_count] = self._placed_body(b)
        return rows

    def _placed_body(self, index: int) -> npt.NDArray[np.float64]:
        x = self._body_rows(index).astype(np.float64)
        pose = self._poses[index]
        if pose is None:
            return x
        # In the engine's order of operations, each rounded once: the same bits.
        at: npt.NDArray[np.float64] = ((pose[:, 0] * x[:, 0:1] + pose[:, 1] * x[:, 1:2]) + pose[:, 2] * x[:, 2:3]) + pose[:, 3]
        return at

    def _body(self, index: int, where: str) -> Body:
        if not isinstance(index, (int, np.integer)) or not 0 <= index < len(self.bodies):
            raise InvalidArgumentError(f"{where}: body {index!r} is not in [0, {len(self.bodies)})")
        return self.bodies[index]

    def _rigid(self) -> list[int]:
        return [b for b, body in enumerate(self.bodies) if body.kind == "rigid"]

    def _writable(self) -> npt.NDArray[Any]:
        if self._latest is not None:
            self._rows = np.frombuffer(self._latest, self.dtype).reshape(-1, 3).copy()
            self._latest = None
        return self._rows

    def _body_rows(self, index: int) -> npt.NDArray[Any]:
        first = self.bodies[index].first_vertex
        assert first is not None
        return self._writable()[first:first + self.bodies[index].vertex_count]
