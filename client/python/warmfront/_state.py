# SPDX-License-Identifier: Apache-2.0
"""The state needed to create a session again: its scene and all current positions. Used by one thread at a time."""
from __future__ import annotations

import copy
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, Optional

import numpy as np
import numpy.typing as npt

from . import _frame
from ._frame import Part, SentFrame
from ._memory import SharedRegion
from ._part_way import vertices_part_way
from ._screw import Poses, commit_poses
from ._staying import Selection, rows_that_stay
from ._question import Question
from ._topology import Topology
from ._wire import Bytes
from .errors import InvalidArgumentError
from .scene import Body, PairFilters, edges_of, faces_of, indices_of, placed, pose_of, positions_of, thickness_of
from .v1 import options_pb2, session_pb2


def raw(array: npt.NDArray[Any]) -> memoryview:
    """An array's memory, which must be contiguous."""
    return array.reshape(-1).view(np.uint8).data


def pairs_of(given: Any) -> list[Any]:
    """InvalidArgumentError for what is no list; what is in it is looked at when it is sent."""
    try:
        return list(given)
    except TypeError:
        raise InvalidArgumentError(f"excluded_pairs: {given!r}; give pairs of bodies by index") from None


def set_pairs(message: Any, pairs: Sequence[tuple[int, int]]) -> None:
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
        if isinstance(bodies, Body) or not isinstance(bodies, Iterable):
            raise InvalidArgumentError(f"bodies: a {type(bodies).__name__}; give a list of warmfront.Body(...)")
        bodies = list(bodies)
        for index, body in enumerate(bodies):
            if not isinstance(body, Body):
                raise InvalidArgumentError(f"bodies[{index}]: a {type(body).__name__}; give a warmfront.Body(...)")
        self.bodies = placed(bodies)
        self.excluded_pairs = pairs_of(excluded_pairs)
        self.filters = filters.copied(len(self._rows), lambda: self._rows)
        self.thickness = thickness_of(thickness, len(self._rows))
        self._topology: Optional[Topology] = None
        self._staying: Optional[Selection] = None
        self.layout = object()  # another one where there are other vertices
        self.poses: Poses = [None] * len(self.bodies)

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
        set_pairs(header.excluded_pairs, self.excluded_pairs)
        header.vertex_thickness = self.thickness is not None
        header.ClearField("filters")
        if self.filters.given:
            self.filters.announce_in(header.filters)
        posed = self.posed()
        header.pose_bodies = np.array(list(posed), dtype="<u4").tobytes()
        header.poses = b"".join(pose.tobytes() for pose in posed.values())

    def posed(self) -> dict[int, npt.NDArray[np.float64]]:
        """Rigid bodies that last moved by poses; not what was removed at one."""
        return {b: pose for b, pose in enumerate(self.poses) if pose is not None and self.bodies[b].kind != "removed"}

    # Frames.

    def encode(self, number: int, positions: Any, bodies: Mapping[int, Any], poses: Mapping[int, Any], vertices: Any,
               vertex_positions: Any, chunk_bytes: int, question: Question, region: Optional[SharedRegion] = None) -> SentFrame:
        """A frame's messages. Raises as read(). region: that the daemon sees, and all positions are put into where it has room."""
        array, parts = self.read(positions, bodies, poses, vertices, vertex_positions)
        if array is not None:
            block = None if region is None else region.take(array.nbytes)
            if block is not None:
                block.data[:] = np.frombuffer(raw(array), np.uint8)
                return SentFrame(number, raw(block.data), [], chunk_bytes, question, block)
            return SentFrame(number, raw(array), [], chunk_bytes, question)
        joined = [(part, pieces[0] if len(pieces) == 1 else b"".join(pieces)) for part, pieces in parts]
        return SentFrame(number, None, [part for part in joined if len(part[1]) > 0], chunk_bytes, question)

    def read(self, positions: Any, bodies: Mapping[int, Any], poses: Mapping[int, Any], vertices: Any,
             vertex_positions: Any) -> tuple[Optional[npt.NDArray[Any]], list[tuple[int, list[Bytes]]]]:
        """A frame as the engine takes it: all positions, or fields of v1.MovedParts, each in pieces, where the caller has them.
        InvalidArgumentError for positions that the session's dtype does not hold exactly or of another number than the
        session's, and for bodies that are not there."""
        if positions is not None:
            if bodies or poses or vertices is not None or vertex_positions is not None:
                raise InvalidArgumentError("positions: the frame gives all vertices and also parts; give only one of them")
            return positions_of(positions, self.vertex_count, self.dtype), []
        parts: list[tuple[int, list[Bytes]]] = []
        if bodies:
            rows: list[Bytes] = [raw(self._rows_of(b, positions)) for b, positions in bodies.items()]
            parts += [(_frame.BODIES, [np.array(list(bodies), dtype="<u4").tobytes()]), (_frame.BODY_POSITIONS, rows)]
        parts += [(part, [data]) for part, data in [*self._pose_parts(poses), *self._vertex_parts(vertices, vertex_positions)]]
        return None, parts

    def _rows_of(self, index: int, positions: Any) -> npt.NDArray[Any]:
        where = f"bodies[{index}]"
        body = self.body(index, where)
        if body.half_space is not None or (body.kind == "removed" and body.vertex_count == 0):
            # The engine refuses it by its name, whatever is given.
            return np.empty((0, 3), self.dtype)
        return positions_of(positions, body.vertex_count, self.dtype, where)

    def _pose_parts(self, poses: Mapping[int, Any]) -> list[Part]:
        if not poses:
            return []
        for b in poses:
            self.body(b, f"poses[{b}]")
        matrices = [pose_of(pose, f"poses[{b}]").astype(self.dtype).tobytes() for b, pose in poses.items()]
        # Poses of all rigid bodies in order need no body indices.
        named = np.array([] if list(poses) == self.rigid() else list(poses), dtype="<u4")
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
            return self._take_all(frame.positions())
        self._take_bodies(frame)
        for b, matrix in self._poses_in(frame):
            self.poses[b] = matrix
        vertices, rows = self._vertices_in(frame)
        if len(vertices) > 0:
            self.writable()[vertices] = rows

    def _take_all(self, positions: Bytes) -> None:
        """What stays has the bits that it had: 0 may be given for -0, which would be a motion to who looks closely."""
        now, given = self.rows(), np.frombuffer(positions, self.dtype).reshape(-1, 3)
        other = [rows for rows in self._rows_that_stay() if now[rows].tobytes() != given[rows].tobytes()]
        self._latest = positions
        for rows in other:
            self.writable()[rows] = now[rows]
        self._forget_poses(self.poses)

    def _rows_that_stay(self) -> Selection:
        self._staying = rows_that_stay(self.bodies) if self._staying is None else self._staying
        return self._staying

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
        rows = self.writable()
        for begin, end in zip(begins, [*begins[1:], len(bodies)]):
            rows[first[begin]:first[end - 1] + count[end - 1]] = moved[at[begin]:at[end]]
        for b in bodies.tolist():
            self.poses[b] = None

    def take_part(self, frame: SentFrame, fraction: float) -> None:
        """The trial was committed up to `fraction`: everything is that part of the way to where it says (v1.Commit)."""
        if fraction == 1:
            return self.take(frame)
        if fraction == 0:
            return
        if frame.whole:
            end = np.frombuffer(frame.positions(), self.dtype).reshape(-1, 3)
            rows = vertices_part_way(self.placed(), end.astype(np.float64), fraction, self.dtype)
            return self._take_all(raw(rows.astype(self.dtype)))
        for b, end in self._bodies_in(frame):
            self.body_rows(b)[:] = vertices_part_way(self.placed_body(b), end.astype(np.float64), fraction, self.dtype)
            self.poses[b] = None
        self._move_poses(self.poses, dict(self._poses_in(frame)), fraction)
        vertices, end = self._vertices_in(frame)
        if len(vertices) > 0:
            rows = self.writable()
            rows[vertices] = vertices_part_way(rows[vertices].astype(np.float64), end.astype(np.float64), fraction, self.dtype)

    def poses_after(self, before: Poses, whole: bool, bodies: Sequence[int], posed: Sequence[int],
                    matrices: Iterable[npt.NDArray[np.float64]], fraction: float) -> Poses:
        """For who keeps the positions elsewhere: of bodies that were at these poses, after that part of a frame that gave these."""
        after = list(before)
        if whole:
            self._forget_poses(after)
        for b in bodies:
            after[b] = None
        self._move_poses(after, dict(zip(posed, matrices)), fraction)
        return after

    def _move_poses(self, poses: Poses, ends: Mapping[int, npt.NDArray[np.float64]], fraction: float) -> None:
        starts = [np.eye(3, 4) if pose is None else pose for pose in map(poses.__getitem__, ends)]
        screws = [self.bodies[b].screw for b in ends]
        for b, pose in zip(ends, commit_poses(starts, list(ends.values()), screws, fraction, self.dtype)):
            poses[b] = pose

    def rows(self) -> npt.NDArray[Any]:
        """(n, 3) of the session's dtype, as they are kept: of rigid bodies with a pose, their reference shapes."""
        return np.frombuffer(self.positions(), self.dtype).reshape(-1, 3)

    def forget_rows(self) -> None:
        """The positions are kept elsewhere: from now on only their number is known here."""
        self._latest = None
        self._rows = np.empty_like(self._rows)  # memory that is never touched is never there

    def _forget_poses(self, poses: Poses) -> None:
        """All vertices were given, which says nothing of half-spaces, nor of what was removed."""
        for b, pose in enumerate(poses):
            if pose is not None and self.bodies[b].half_space is None and self.bodies[b].kind != "removed":
                poses[b] = None

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
            yield from zip(named or self.rigid(), matrices)

    def _vertices_in(self, frame: SentFrame) -> tuple[npt.NDArray[np.uint32], npt.NDArray[Any]]:
        vertices = np.frombuffer(frame.bytes_of(_frame.VERTICES), "<u4")
        return vertices, np.frombuffer(frame.bytes_of(_frame.VERTEX_POSITIONS), self.dtype).reshape(-1, 3)

    # Changes between frames (_scene_changes.py).

    def draft(self) -> SceneState:
        """A copy for changes that may not come to be."""
        draft = copy.copy(self)
        draft._rows = draft.rows().copy()
        draft._latest = None
        draft.bodies, draft.poses = list(self.bodies), list(self.poses)
        return draft

    def become(self, draft: SceneState) -> None:
        """The changes of the draft, of this one, are carried out."""
        self.__dict__.update(draft.__dict__)

    def replace_rows(self, first: int, end: int, rows: npt.NDArray[Any]) -> None:
        """Vertices [first, end) make way for others, at these positions: all behind them have other numbers where they are not as many."""
        self._rows = np.concatenate([self.writable()[:first], rows, self._rows[end:]])
        self._topology = self._staying = None
        if len(rows) != end - first:
            self.layout = object()

    def describe_body(self, index: int, body: Body) -> None:
        """Another description of the same vertices."""
        self.bodies[index] = body
        self._staying = None

    def forget_topology(self) -> None:
        """Faces or edges are others."""
        self._topology = None

    # Current positions.

    def placed(self) -> npt.NDArray[np.float64]:
        """(n, 3): where everything is, bodies that are at a pose too. A copy."""
        rows = np.frombuffer(self.positions(), self.dtype).reshape(-1, 3).astype(np.float64)
        for b, pose in enumerate(self.poses):
            if pose is not None:
                first = self.bodies[b].first_vertex
                assert first is not None
                rows[first:first + self.bodies[b].vertex_count] = self.placed_body(b)
        return rows

    def placed_body(self, index: int) -> npt.NDArray[np.float64]:
        x = self.body_rows(index).astype(np.float64)
        pose = self.poses[index]
        if pose is None or np.array_equal(pose, np.eye(3, 4)):  # the sum would make 0 of -0
            return x
        # In the engine's order of operations, each rounded once: the same bits.
        at: npt.NDArray[np.float64] = ((pose[:, 0] * x[:, 0:1] + pose[:, 1] * x[:, 1:2]) + pose[:, 2] * x[:, 2:3]) + pose[:, 3]
        return at

    def body(self, index: int, where: str) -> Body:
        if not isinstance(index, (int, np.integer)) or not 0 <= index < len(self.bodies):
            raise InvalidArgumentError(f"{where}: body {index!r} is not in [0, {len(self.bodies)}); " + (
                "give the number of one of the scene's bodies" if self.bodies else "the scene was made without bodies"))
        return self.bodies[index]

    def rigid(self) -> list[int]:
        return [b for b, body in enumerate(self.bodies) if body.kind == "rigid"]

    def writable(self) -> npt.NDArray[Any]:
        if self._latest is not None:
            self._rows = np.frombuffer(self._latest, self.dtype).reshape(-1, 3).copy()
            self._latest = None
        return self._rows

    def body_rows(self, index: int) -> npt.NDArray[Any]:
        first = self.bodies[index].first_vertex
        assert first is not None
        return self.writable()[first:first + self.bodies[index].vertex_count]
