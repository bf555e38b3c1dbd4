# SPDX-License-Identifier: Apache-2.0
"""Answers. Plain values, safe to share between threads."""
from __future__ import annotations

import enum
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Optional

import numpy as np
import numpy.typing as npt

from ._statistics import AllDeformable, Statistics, statistics_of
from ._stencils import RowsByVertex, Stencils, rows_by_vertex, stencils_of
from ._topology import Topology
from .errors import InvalidArgumentError


class Kind(enum.IntEnum):
    """Values of `Contacts.kind`."""

    VERTEX_FACE = 0
    EDGE_EDGE = 1
    VERTEX_EDGE = 3
    VERTEX_VERTEX = 4
    VERTEX_HALF_SPACE = 5


class Closest(enum.IntEnum):
    """Values of `Contacts.closest`: which features of the two have the closest points."""

    VERTEX_VERTEX = 0
    EDGE_VERTEX = 1
    EDGE_EDGE = 2
    FACE_VERTEX = 3


class Status(enum.IntEnum):
    """Values of `Contacts.status`."""

    HIT = 1  #: proved: they meet; of `proximity()`, they are within the distance
    POSSIBLE = 2  #: within tolerance; neither a meeting nor a miss could be proved
    OVERLAP_AT_START = 3  #: not provably apart at t = 0; toi is 0
    BUDGET = 4  #: the test's budget ended; toi is the earliest time not excluded


@dataclass(frozen=True)
class Contact:
    """One contact by itself: see `Contacts` for each. v: four vertices. toi: in [0, 1]."""

    kind: Kind
    status: Status
    v: tuple[int, int, int, int]
    toi: float


@dataclass(frozen=True, eq=False)
class Intersections:
    """Edges and faces without a common vertex that meet; `len()` of it is how many are listed, `bool()` whether there are any.

    frame: number of the next one. count: how many meet; with report "any" 1 where any do, without the list. edges (k, 2)
    uint32: vertices of the edge; faces (k, 3) uint32: of the face. Sorted by the scene's edge and face.
    """

    frame: int
    count: int
    edges: npt.NDArray[np.uint32]
    faces: npt.NDArray[np.uint32]
    statistics: Statistics

    def __len__(self) -> int:
        return len(self.edges)

    def __bool__(self) -> bool:
        return self.count > 0


@dataclass(frozen=True, eq=False)
class VertexDistances:
    """How far each vertex is from anything; `numpy.asarray()` of it, and its `distances`, are (n) float64, read-only.

    frame: number of the next one. distances: by vertex, in the scene's length unit; see `Session.vertex_distances()`. vf, ee, vh,
    possible: as of `Contacts`, how many pairs are within the distance that was asked about.
    """

    frame: int
    distances: npt.NDArray[np.float64]
    vf: int
    ee: int
    possible: int
    statistics: Statistics
    vh: int = 0

    def __len__(self) -> int:
        return len(self.distances)

    def __array__(self, dtype: Any = None, copy: Optional[bool] = None) -> npt.NDArray[Any]:
        return np.array(self.distances, dtype) if copy else np.asarray(self.distances, dtype)


@dataclass(frozen=True)
class MaxStep:
    """How far a motion may go; `float()` of it is the fraction.

    fraction: in [0, 1]. Nothing touches, or comes within the separation, before it (tiers "certified" and "exact": a lower
    bound, with room for what `Session.commit()` rounds, so that nothing passes through anything, or is left within the
    separation, when it is committed). 1 where nothing does in the whole motion.
    first: of what comes first, the first in the order of contacts; None where nothing comes.
    overlaps_at_start: pairs that are within the separation, or nearer than a commit rounds, or not provably apart, at the
    start: counted whether they are left out or not. Where they are not, any that comes nearer makes the fraction 0.
    In a scene with worlds, else empty: worlds (w) uint32, ascending, with 0 where a body is in none, and world_fractions (w)
    float64, how far the motion may go in each alone.
    """

    fraction: float
    first: Optional[Contact]
    overlaps_at_start: int
    statistics: Statistics = field(repr=False)
    worlds: npt.NDArray[np.uint32] = field(repr=False, compare=False, default_factory=lambda: np.empty(0, np.uint32))
    world_fractions: npt.NDArray[np.float64] = field(repr=False, compare=False, default_factory=lambda: np.empty(0))

    def __float__(self) -> float:
        return self.fraction


@dataclass(frozen=True)
class Committed:
    """What a commit took of its trial.

    fraction: of the motion. vf, ee, vh, possible: of the contacts that the trial listed, those up to there; None where it only
    counted them, and some may lie beyond. Of a max_step they are what comes first, which its fraction stops short of.
    earliest_toi: of these, in steps of the trial; None without any. frame: the session's, from now on.
    """

    fraction: float
    vf: Optional[int]
    ee: Optional[int]
    possible: Optional[int]
    earliest_toi: Optional[float]
    frame: int
    vh: Optional[int] = None


_COLUMNS = ("kind", "status", "v", "toi", "weights", "normal", "points", "direction", "squared_distance", "closest",
            "multiplicity", "stencil")


_NO_WORLDS: npt.NDArray[np.uint32] = np.empty(0, "<u4")
_NO_TIMES: npt.NDArray[np.float64] = np.empty(0, "<f8")


class Contacts:
    """One frame's answer: k contacts as columns, sorted by kind, then by the numbers of the first and of the second feature.

    kind (k) uint8: `Kind`. status (k) uint8: `Status`. v (k, 4) uint32: the vertex, then the face's three; or edge a's
    two, then edge b's two, where an isolated vertex stands twice in place of an edge; of a half-space the vertex three times, as
    in no other row, then the number of the body that it is. toi (k) float64 in [0, 1], in steps:
    never later than the first time of contact (in tier "fast", an estimate of it). Of `proximity()` the instant that was asked about: 0, or 1 at a trial's end.
    Where `Options.fields` ask for them, else None: weights (k, 4) float64, barycentric coordinates of the closest points
    at toi by the vertices in v; normal (k, 3) float64, unit, of the face or common to both edges (of points: the
    direction that they come from), towards the side that the vertex or first edge comes from; points (k, 2, 3) float64, the closest points in the scene's length unit; direction
    (k, 3) float64, unit, from the second of these to the first, zero where they touch; squared_distance (k) float64, of
    these points; closest (k) uint8: `Closest`, which features they are on, where weights are exactly 0 for the others.
    `normal` is the features' own: with a separation it differs, by up to a right angle and more, from `direction` if a
    closest point lies on the face's rim or at an edge's end. Use the direction to push two things apart, and the normal only
    where they touch. Of a half-space weights are 1, 0, 0, 0, the normal points out of it, and the second point is the foot of
    the vertex on its plane, or the vertex itself where that is inside.
    Of `proximity(reduced=True)`, else None: multiplicity (k) uint32, how many rows have the same closest features where they
    are not reduced; stencil (k) uint8: bit i is set where v[:, i] is of these features, all four of nearly parallel edges. See
    `stencils()`.
    Computed on first use, from the scene at this frame: bodies, faces, edges; from squared_distance: distance.

    frame: its number; of a trial, that of the next frame. vf, ee: how many there are, also when the report is "count" and
    the columns are empty; of a reduced answer, of all rows before they were reduced. ee: edge-edge ones, and with points; ve, vv:
    how many of these are vertex-edge and vertex-vertex. vh: vertex-half-space ones, which are not in ee.
    possible: of all, those neither proved nor excluded; what was not provably apart at the start has the status
    OVERLAP_AT_START instead. earliest_toi: of a motion the least toi; None without contacts, and
    of `proximity()`, which has no motion.
    queue_ms: milliseconds in the daemon between the frame's arrival and its step; 0 in this process.
    Of report "earliest" in a scene with worlds, whose rows are the earliest of each, else empty: worlds (w) uint32, ascending,
    with 0 where a body is in none, and world_tois (w) float64, the least toi in each, infinity without a contact.

    `warmfront.contacts_hash()` of two of them compares the rows, bit for bit.

    The columns are read-only views: of the engine's own memory in this process; of the received message behind a daemon,
    possibly unaligned there: `numpy.require(x, requirements="A")` copies if needed. Only an answer of several messages
    (beyond the daemon's answer_chunk_bytes) is copied, once.
    """

    def __init__(
        self,
        frame: int,
        kind: npt.NDArray[np.uint8],
        status: npt.NDArray[np.uint8],
        v: npt.NDArray[np.uint32],
        toi: npt.NDArray[np.float64],
        weights: Optional[npt.NDArray[np.float64]],
        normal: Optional[npt.NDArray[np.float64]],
        points: Optional[npt.NDArray[np.float64]],
        direction: Optional[npt.NDArray[np.float64]],
        squared_distance: Optional[npt.NDArray[np.float64]],
        closest: Optional[npt.NDArray[np.uint8]],
        multiplicity: Optional[npt.NDArray[np.uint32]],
        stencil: Optional[npt.NDArray[np.uint8]],
        summary: Any,
        topology: Optional[Topology] = None,
        worlds: Optional[npt.NDArray[np.uint32]] = None,
        world_tois: Optional[npt.NDArray[np.float64]] = None,
    ) -> None:
        """Internal: created by `Session`."""
        self.frame = frame
        self.kind = kind
        self.status = status
        self.v = v
        self.toi = toi
        self.weights = weights
        self.normal = normal
        self.points = points
        self.direction = direction
        self.squared_distance = squared_distance
        self.closest = closest
        self.multiplicity = multiplicity
        self.stencil = stencil
        self.vf: int = summary.vf
        self.ee: int = summary.ee
        self.ve: int = summary.ve
        self.vv: int = summary.vv
        self.vh: int = summary.vh
        self.possible: int = summary.possible
        self.earliest_toi: Optional[float] = summary.earliest_toi if summary.HasField("earliest_toi") else None
        self.queue_ms: float = summary.queue_ms
        self.worlds: npt.NDArray[np.uint32] = _NO_WORLDS if worlds is None else worlds
        self.world_tois: npt.NDArray[np.float64] = _NO_TIMES if world_tois is None else world_tois
        self._topology = topology
        self._statistics = summary.statistics
        self._all_deformable = summary.all_deformable if summary.HasField("all_deformable") else None

    @cached_property
    def distance(self) -> Optional[npt.NDArray[np.float64]]:
        """(k) float64, scene length unit: of the closest points, along `direction`; None without the field "squared_distance"."""
        return None if self.squared_distance is None else np.sqrt(self.squared_distance)

    @cached_property
    def bodies(self) -> Optional[npt.NDArray[np.int64]]:
        """(k, 2): the body of the vertex or first edge, then of the face or second edge or the half-space itself, as numbered when they were declared
        and added; None in a scene that declares none."""
        bodies = None if self._topology is None else self._topology.bodies_of(self.v[:, [0, 2]])
        if bodies is not None and self.vh > 0:
            rows = self.kind == Kind.VERTEX_HALF_SPACE
            bodies[rows, 1] = self.v[rows, 3]
        return bodies

    @cached_property
    def faces(self) -> npt.NDArray[np.int64]:
        """(k): the face of a vertex-face contact, a row of the faces given (those of added bodies follow); -1 for all
        others."""
        result = np.full(len(self), -1, np.int64)
        rows = self.kind == Kind.VERTEX_FACE
        if self._topology is not None and rows.any():
            result[rows] = self._topology.faces_of(self.v[rows])
        return result

    @cached_property
    def edges(self) -> npt.NDArray[np.int64]:
        """(k, 2): both edges of an edge-edge contact, rows of `Session.edges`; -1 for what is no edge."""
        result = np.full((len(self), 2), -1, np.int64)
        rows = self.kind == Kind.EDGE_EDGE
        if self._topology is not None and rows.any():
            result[rows] = self._topology.edges_of(self.v[rows].reshape(-1, 2)).reshape(-1, 2)
        rows = self.kind == Kind.VERTEX_EDGE
        if self._topology is not None and rows.any():
            result[rows, 1] = self._topology.edges_of(self.v[rows, 2:])
        return result

    def __getstate__(self) -> dict[str, Any]:
        """What is pickled and copied: costs as plain values, wherever the answer was computed."""
        told = {"statistics": self.statistics, "all_deformable": self.all_deformable}
        return {**self.__dict__, **told, "_statistics": None, "_all_deformable": None}

    @cached_property
    def statistics(self) -> Statistics:
        """Cost of the step."""
        return statistics_of(self._statistics)

    @cached_property
    def all_deformable(self) -> Optional[AllDeformable]:
        """With `Options.explain`: the difference to `statistics` is what the scene's model saves."""
        message = self._all_deformable
        if message is None:
            return None
        statistics = statistics_of(message.statistics)
        return AllDeformable(statistics, message.frame_bytes, message.positions_bytes)

    def stencils(self) -> Stencils:
        """Of `proximity(reduced=True)`: the vertices of the closest features by kind, with multiplicities, as a barrier is
        assembled. InvalidArgumentError of an answer that is not reduced."""
        if self.multiplicity is None or self.stencil is None:
            raise InvalidArgumentError("stencils: the rows are not reduced; ask proximity(..., reduced=True)")
        return stencils_of(self.kind, self.v, self.multiplicity, self.stencil, self.weights)

    def by_vertex(self, vertex_count: int) -> RowsByVertex:
        """The rows that each of `vertex_count` vertices is in, ascending: what an assembler that goes by vertices loops over.
        InvalidArgumentError where a row has a vertex beyond."""
        return rows_by_vertex(self.v, vertex_count)

    def table(self) -> npt.NDArray[np.void]:
        """The rows as one structured array, (k), with the columns' names as its fields. A copy."""
        columns = {name: getattr(self, name) for name in _COLUMNS}
        present = {name: column for name, column in columns.items() if column is not None}
        rows = np.empty(len(self), [(name, column.dtype, column.shape[1:]) for name, column in present.items()])
        for name, column in present.items():
            rows[name] = column
        return rows

    def __len__(self) -> int:
        return len(self.toi)

    def __bool__(self) -> bool:
        """Is there any contact, in every report?"""
        return self.vf + self.ee + self.vh > 0

    def __repr__(self) -> str:
        return (f"Contacts(frame={self.frame}, vf={self.vf}, ee={self.ee}, vh={self.vh}, possible={self.possible}, "
                f"earliest_toi={self.earliest_toi})")
