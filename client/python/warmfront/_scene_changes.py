# SPDX-License-Identifier: Apache-2.0
"""Changes of a scene between two frames, each as one value: the request for it, what the daemon has to know for that, and
what it makes of the scene that is kept to create the session again. Used by one thread at a time."""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Optional, Protocol

import numpy as np
import numpy.typing as npt

from ._state import SceneState, set_pairs
from .errors import FailedPreconditionError
from .options import Options
from .scene import Body, PairFilters, edges_of, faces_of, half_space_of, placed, positions_of, thickness_of
from .v1 import session_pb2

Elements = npt.NDArray[np.int32]


class SceneChange(Protocol):
    @property
    def features(self) -> list[session_pb2.Feature]:
        """What a daemon must know to carry it out, in the order in which they are checked."""

    def encode(self, state: SceneState) -> session_pb2.SceneChange:
        """The request. InvalidArgumentError for a body that there is not, and for what is not of the contract's type."""

    def take(self, state: SceneState) -> None:
        """The daemon has carried it out."""


def drafted(change: SceneChange, state: SceneState) -> tuple[SceneState, Optional[Exception]]:
    """The state with the change, which was not carried out yet; and what failed on the way there. Whoever carries the change out
    says better what is wrong with it, and is asked all the same."""
    draft = state.draft()
    try:
        change.take(draft)
    except Exception as error:
        return draft, error
    return draft, None


def _given_thickness(thickness: Any, count: int) -> npt.NDArray[np.float64]:
    """One for each of a body's vertices, also where all are 0: so it is said that they have none."""
    given = thickness_of(thickness, count)
    return np.zeros(count) if given is None else given


def _features_of(body: Body) -> list[session_pb2.Feature]:
    return ([session_pb2.FEATURE_THICKNESS] if body.thickness != 0 else []) + (
        [session_pb2.FEATURE_WORLDS] if body.world != 0 else []) + ([session_pb2.FEATURE_SCREW] if body.screw else [])


@dataclass(frozen=True, eq=False)
class PutBody:
    """A body at rest at `rows` (k, 3), of the session's dtype: behind all others, or in place of the one of this index."""

    index: Optional[int]
    body: Body
    faces: Elements
    edges: Elements
    rows: npt.NDArray[Any]
    thickness: Optional[npt.NDArray[np.float64]]

    @staticmethod
    def added(state: SceneState, body: Body, faces: Any, positions: Any, edges: Any, thickness: Any) -> PutBody:
        """positions may be None for a half-space."""
        none = positions is None and body.half_space is not None
        rows = np.empty((0, 3), state.dtype) if none else positions_of(positions, body.vertex_count, state.dtype)
        return PutBody(None, body, faces_of(faces), edges_of(edges), rows, thickness_of(thickness, len(rows)))

    @staticmethod
    def in_place_of(state: SceneState, index: int, body: Optional[Body], faces: Any, positions: Any, edges: Any,
                    thickness: Any) -> PutBody:
        """Without `body` the description stays, but for as many vertices as positions are given."""
        if state.bodies:  # else the daemon says what to do
            old = state.body(index, "index")
        elif body is None:
            raise FailedPreconditionError("bodies: the session declares none; declare its bodies to replace one, or replace the "
                                          "elements of all of it as body 0")
        if body is None:
            body = replace(old, vertex_count=len(positions_of(positions, None, state.dtype)))
        return PutBody(index, body, faces_of(faces), edges_of(edges), positions_of(positions, body.vertex_count, state.dtype),
                       None if thickness is None else _given_thickness(thickness, body.vertex_count))

    @property
    def features(self) -> list[session_pb2.Feature]:
        return [
            *([] if self.index is None and self.thickness is None else [session_pb2.FEATURE_REPLACE]), *_features_of(self.body),
            *([session_pb2.FEATURE_EDGES] if len(self.edges) > 0 else []),
            *([session_pb2.FEATURE_HALF_SPACES] if self.body.half_space is not None else []),
        ]

    def encode(self, state: SceneState) -> session_pb2.SceneChange:
        change = session_pb2.SceneChange()
        to = change.add
        if self.index is not None:
            change.replace_body.index = self.index
            to = getattr(change.replace_body, "with")
        replace(self.body, first_vertex=0).put_into(to.body, len(state.bodies) if self.index is None else self.index)
        to.faces = self.faces.tobytes()
        to.edges = self.edges.tobytes()
        to.positions = self.rows.tobytes()
        if self.thickness is not None:
            to.thickness = self.thickness.tobytes()
        return change

    def take(self, state: SceneState) -> None:
        """A body is added as one without vertices behind all others, which the other one then takes the place of."""
        index = self.index
        if index is None:
            index = len(state.bodies)
            _append_mesh(state, self.faces, self.edges)
            state.bodies.append(replace(self.body, first_vertex=state.vertex_count, vertex_count=0))
            state.poses.append(None)
        else:
            _replace_mesh(state, index, self.body.vertex_count, self.faces, self.edges)
        old = state.bodies[index]
        first = old.first_vertex
        assert first is not None
        end = first + old.vertex_count
        if state.thickness is not None or self.thickness is not None:
            before = np.zeros(state.vertex_count) if state.thickness is None else state.thickness
            given = np.zeros(len(self.rows)) if self.thickness is None else self.thickness
            after = np.concatenate([before[:first], given, before[end:]])
            state.thickness = after if after.any() else None  # as in the engine, and as a daemon is told of it
        state.filters = state.filters.with_replaced(first, end, self.rows)
        state.replace_rows(first, end, self.rows)
        state.bodies[index] = replace(self.body, first_vertex=first)
        if end - first != len(self.rows):
            state.bodies[index + 1:] = placed([replace(each, first_vertex=None) for each in state.bodies[index + 1:]],
                                              first + len(self.rows))
        state.poses[index] = None


@dataclass(frozen=True, eq=False)
class ReplaceElements:
    """Other faces (m, 3) and edges (k, 2) for the vertices of a body."""

    index: int
    faces: Any
    edges: Any

    @property
    def features(self) -> list[session_pb2.Feature]:
        return [session_pb2.FEATURE_REPLACE]

    def encode(self, state: SceneState) -> session_pb2.SceneChange:
        if state.bodies:  # else index 0 is the whole scene, of which the daemon tells
            state.body(self.index, "index")
        change = session_pb2.SceneChange()
        change.replace_elements.index = self.index
        change.replace_elements.faces = faces_of(self.faces).tobytes()
        change.replace_elements.edges = edges_of(self.edges).tobytes()
        return change

    def take(self, state: SceneState) -> None:
        if state.bodies:
            count = state.bodies[self.index].vertex_count
            _replace_mesh(state, self.index, count, faces_of(self.faces), edges_of(self.edges))
        else:
            state.faces, state.edges = faces_of(self.faces).copy(), edges_of(self.edges).copy()
        state.forget_topology()


@dataclass(frozen=True, eq=False)
class ChangeBody:
    """Another description of a body, whose range stays."""

    index: int
    body: Body

    @property
    def features(self) -> list[session_pb2.Feature]:
        return _features_of(self.body)

    def encode(self, state: SceneState) -> session_pb2.SceneChange:
        """FailedPreconditionError for a body that is at a pose and would be rigid no more, in a session of float32: where its
        vertices are is not known in float32."""
        old = state.body(self.index, "index")
        if state.dtype.itemsize == 4 and state.poses[self.index] is not None \
                and self.body.kind not in ("rigid", "removed") and old.kind != "removed" and old.half_space is None:
            raise FailedPreconditionError(f"body {self.index} is at a pose, and its vertices are not known in the session's "
                                          "float32; give its positions in a frame before it becomes another kind")
        change = session_pb2.SceneChange()
        change.change.index = self.index
        replace(self.body, first_vertex=old.first_vertex, vertex_count=old.vertex_count).put_into(change.change.body, self.index)
        return change

    def take(self, state: SceneState) -> None:
        index, body, old = self.index, self.body, state.bodies[self.index]
        if body.half_space is None:
            body = replace(body, half_space=old.half_space)  # of one that is removed
        if old.half_space is not None:
            before, now = (half_space_of(each.half_space, f"body {index}") for each in (old, body))
            if body.kind != old.kind or now != before:
                state.poses[index] = None  # where its new description says
        state.describe_body(index, replace(body, first_vertex=old.first_vertex, vertex_count=old.vertex_count))
        if state.poses[index] is None or body.kind in ("rigid", "removed"):  # where that was is still of interest
            return
        if state.dtype.itemsize == 8:
            state.body_rows(index)[:] = state.placed_body(index)
        state.poses[index] = None


@dataclass(frozen=True, eq=False)
class ChangeFilters:
    """Other filters, as PairFilters.copied() makes them."""

    filters: PairFilters

    @property
    def features(self) -> list[session_pb2.Feature]:
        return [session_pb2.FEATURE_PAIR_FILTERS] if self.filters.given else []

    def encode(self, state: SceneState) -> session_pb2.SceneChange:
        change = session_pb2.SceneChange()
        change.change_filters.SetInParent()
        self.filters.put_into(change.change_filters)
        return change

    def take(self, state: SceneState) -> None:
        state.filters = self.filters


@dataclass(frozen=True, eq=False)
class ChangeExcludedPairs:
    """Other pairs of bodies that are not tested against each other."""

    pairs: Sequence[tuple[int, int]]

    @property
    def features(self) -> list[session_pb2.Feature]:
        return [session_pb2.FEATURE_OPTION_CHANGES]

    def encode(self, state: SceneState) -> session_pb2.SceneChange:
        change = session_pb2.SceneChange()
        change.change_excluded_pairs.SetInParent()
        set_pairs(change.change_excluded_pairs.pairs, self.pairs)
        return change

    def take(self, state: SceneState) -> None:
        state.excluded_pairs = list(self.pairs)


class ChangesInOne:
    """Changes that are carried out together, each of the scene that those before it make."""

    def __init__(self, state: SceneState) -> None:
        self.state = state.draft()
        self.messages: list[session_pb2.SceneChange] = []
        self.features: list[session_pb2.Feature] = []
        self.options: Optional[Options] = None

    def add(self, change: SceneChange) -> None:
        self.messages.append(change.encode(self.state))
        self.features += change.features
        change.take(self.state)


def _append_mesh(state: SceneState, faces: Elements, edges: Elements) -> None:
    """The mesh of a body behind all others, whose vertices count from 0."""
    first = np.int32(state.vertex_count)
    state.faces = np.concatenate([state.faces, faces + first])
    state.edges = np.concatenate([state.edges, edges + first])


def _replace_mesh(state: SceneState, index: int, count: int, faces: Elements, edges: Elements) -> None:
    """Faces and edges are of bodies in their order; one body has these, and `count` vertices, from now on."""
    body = state.bodies[index]
    assert body.first_vertex is not None
    first, last = body.first_vertex, body.first_vertex + body.vertex_count
    ends = np.array([each.first_vertex + each.vertex_count for each in state.bodies if each.first_vertex is not None])

    def replaced(all_of: Elements, these: Elements) -> Elements:
        all_of = all_of[np.argsort(np.searchsorted(ends, all_of[:, 0], side="right"), kind="stable")]
        before, after = all_of[all_of[:, 0] < first], all_of[all_of[:, 0] >= last]
        return np.concatenate([before, these + np.int32(first), after + np.int32(count - body.vertex_count)])

    state.faces, state.edges = replaced(state.faces, faces), replaced(state.edges, edges)
