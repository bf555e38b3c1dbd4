# SPDX-License-Identifier: Apache-2.0
"""Bodies, faces and edges of contacts' vertices, by their numbers. Immutable, and thread-safe."""
from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any, Optional

import numpy as np
import numpy.typing as npt

from .errors import InternalError
from .scene import Body

Indices = npt.NDArray[np.int64]


def _pair_keys(first: npt.NDArray[Any], second: npt.NDArray[Any]) -> npt.NDArray[np.uint64]:
    """Two indices below 2^32 as one number that sorts as the pair does."""
    keys: npt.NDArray[np.uint64] = first.astype(np.uint64) << np.uint64(32) | second.astype(np.uint64)
    return keys


class Topology:
    """Of one state of a scene: its faces (m, 3), the edges (k, 2) given besides, and bodies. Lookup tables are built on first use."""

    def __init__(self, faces: npt.NDArray[np.int32], edges: npt.NDArray[np.int32], bodies: Sequence[Body]) -> None:
        self._faces = faces
        self._given_edges = edges
        self._first_vertices = np.array([body.first_vertex for body in bodies], np.int64)

    @cached_property
    def edges(self) -> npt.NDArray[np.int32]:
        """(e, 2) vertices, the smaller one first, one row per edge, sorted: the order of edge numbers."""
        keys = self._edge_keys
        rows: npt.NDArray[np.int32] = np.stack([keys >> np.uint64(32), keys & np.uint64(0xFFFFFFFF)], axis=1).astype(np.int32)
        rows.flags.writeable = False
        return rows

    def bodies_of(self, vertices: npt.NDArray[Any]) -> Optional[Indices]:
        """The body of each vertex; None if the scene declares none."""
        if len(self._first_vertices) == 0:
            return None
        bodies: Indices = np.searchsorted(self._first_vertices, vertices, side="right") - 1
        return bodies

    def edges_of(self, pairs: npt.NDArray[Any]) -> Indices:
        """The number of each edge (k, 2), given by its vertices in either order."""
        ordered = np.sort(pairs, axis=1)
        return self._find(self._edge_keys, _pair_keys(ordered[:, 0], ordered[:, 1]))

    def faces_of(self, v: npt.NDArray[Any]) -> Indices:
        """The face of each vertex-face contact (k, 4), in the order of an answer: of duplicate faces, which a vertex meets
        simultaneously, the first row gets the first."""
        order, keys = self._face_keys
        wanted = self._face_keys_of(v[:, 1:])
        at = self._find(keys, wanted)
        # Number of earlier rows with the same vertex and an equal face.
        rows = np.lexsort((np.arange(len(v)), v[:, 0], wanted))
        same = np.zeros(len(v), bool)
        same[1:] = (wanted[rows[1:]] == wanted[rows[:-1]]) & (v[rows[1:], 0] == v[rows[:-1], 0])
        starts = np.maximum.accumulate(np.where(same, 0, np.arange(len(v))))
        repetition = np.empty(len(v), np.int64)
        repetition[rows] = np.arange(len(v)) - starts
        at = np.minimum(at + repetition, len(keys) - 1)
        if (keys[at] != wanted).any():
            raise InternalError("the daemon's answer has more contacts of a face than the scene has such faces")
        faces: Indices = order[at]
        return faces

    @cached_property
    def _edge_keys(self) -> npt.NDArray[np.uint64]:
        sides = self._faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
        sides = np.sort(np.concatenate([sides, self._given_edges]), axis=1)
        return np.unique(_pair_keys(sides[:, 0], sides[:, 1]))

    @cached_property
    def _corner_keys(self) -> npt.NDArray[np.uint64]:
        """Of the first two corners of all faces, sorted: their ranks leave room for the third."""
        return np.unique(_pair_keys(self._faces[:, 0], self._faces[:, 1]))

    def _face_keys_of(self, corners: npt.NDArray[Any]) -> npt.NDArray[np.uint64]:
        return _pair_keys(self._find(self._corner_keys, _pair_keys(corners[:, 0], corners[:, 1])), corners[:, 2])

    @cached_property
    def _face_keys(self) -> tuple[Indices, npt.NDArray[np.uint64]]:
        """The faces ordered by their corners, equal ones by their numbers; and their keys."""
        keys = self._face_keys_of(self._faces)
        order: Indices = np.argsort(keys, kind="stable")
        return order, keys[order]

    @staticmethod
    def _find(keys: npt.NDArray[np.uint64], wanted: npt.NDArray[np.uint64]) -> Indices:
        """The first position of each in the sorted keys."""
        at: Indices = np.searchsorted(keys, wanted)
        if len(wanted) > 0 and (len(keys) == 0 or (keys[np.minimum(at, len(keys) - 1)] != wanted).any()):
            raise InternalError("the daemon's answer names a face or an edge that the scene does not have")
        return at
