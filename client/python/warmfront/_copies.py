# SPDX-License-Identifier: Apache-2.0
"""How a batch lays out its scene."""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from .errors import InvalidArgumentError
from .scene import Body, PairFilters, edges_of, faces_of, filters_of, numbers_of, positions_of

Shared = Sequence[tuple[Body, Any, Any]]


def _shared_of(given: Any, where: str) -> tuple[Body, Any, Any]:
    try:
        body, faces, positions = given
    except (TypeError, ValueError):
        body = None
    if not isinstance(body, Body):
        raise InvalidArgumentError(f"{where}: a {type(given).__name__}; give (Body, faces, positions), of a half-space (Body, None, None)")
    return body, faces, positions


class Copies:
    """The shared bodies first, then the copies, one after the other. Immutable."""

    def __init__(self, count: int, positions: Any, faces: Any, edges: Any, bodies: Sequence[Body], shared: Shared) -> None:
        if not isinstance(count, (int, np.integer)) or count < 1:
            raise InvalidArgumentError(f"count: {count!r}; give how many copies, 1 or more")
        self.count = int(count)
        rows = numbers_of(positions, None)
        if rows.ndim not in (2, 3) or rows.shape[-1] != 3 or (rows.ndim == 3 and len(rows) != self.count):
            raise InvalidArgumentError(f"positions: shape {rows.shape}; give (n, 3) for all copies, or ({self.count}, n, 3)")
        self.vertices = rows.shape[-2]
        shared = [_shared_of(given, f"shared[{k}]") for k, given in enumerate(shared)]
        self.bodies = list(bodies) or [Body(self.vertices)]
        if any(body.world != 0 for body in self.bodies):
            raise InvalidArgumentError("bodies: world is each copy's own, 1 and up; leave it out")
        if sum(body.vertex_count for body in self.bodies) != self.vertices:
            raise InvalidArgumentError(f"bodies: cover {sum(body.vertex_count for body in self.bodies)} of {self.vertices} vertices")
        self.shared_rows = [positions_of(np.empty((0, 3), rows.dtype) if p is None else p, body.vertex_count, rows.dtype,
                                         f"shared[{k}].positions") for k, (body, _, p) in enumerate(shared)]
        self.shared_bodies = [replace(body, first_vertex=None) for body, _, _ in shared]
        if any(body.world != 0 for body in self.shared_bodies):
            raise InvalidArgumentError("shared: a body that is in all copies has no world; leave it out")
        self.first_vertex = sum(len(rows) for rows in self.shared_rows)
        self.first_body = len(self.shared_bodies)
        if self.first_vertex + self.vertices * self.count >= 1 << 31:
            raise InvalidArgumentError(f"count: {self.count} copies of {self.vertices} vertices are 2^31 or more")
        self._faces, self._edges = faces_of(faces), edges_of(edges)
        self._shared_faces = [faces_of(f, f"shared[{k}].faces") for k, (_, f, _) in enumerate(shared)]
        self._rows = rows

    def positions(self) -> npt.NDArray[Any]:
        """(shared and copied vertices, 3), at the start."""
        copies = np.broadcast_to(self._rows, (self.count, self.vertices, 3)).reshape(-1, 3)
        return np.concatenate([*self.shared_rows, copies]) if self.shared_rows else copies

    def faces(self) -> npt.NDArray[np.int32]:
        firsts = np.cumsum([0, *(len(rows) for rows in self.shared_rows)])
        shared = [faces + np.int32(first) for faces, first in zip(self._shared_faces, firsts)]
        return np.concatenate([*shared, self._copied(self._faces)])

    def edges(self) -> npt.NDArray[np.int32]:
        return self._copied(self._edges)

    def all_bodies(self) -> list[Body]:
        """With a world for each copy, and its number in their names."""
        copies = [replace(body, first_vertex=None, world=world + 1, name=f"{body.name or f'body {b}'} of copy {world}")
                  for world in range(self.count) for b, body in enumerate(self.bodies)]
        return [*self.shared_bodies, *copies]

    def worlds(self) -> list[int]:
        """Of all bodies, by number."""
        return [0] * self.first_body + [world + 1 for world in range(self.count) for _ in self.bodies]

    def excluded(self, pairs: Sequence[tuple[int, int]]) -> list[tuple[int, int]]:
        """Pairs of one copy's bodies, of all."""
        starts = range(self.first_body, self.first_body + self.count * len(self.bodies), len(self.bodies))
        return [(start + a, start + b) for start in starts for a, b in pairs]

    def thickness(self, thickness: Any) -> Any:
        """Of every vertex: one number is all vertices', the shared ones' too; these have none where it is (n), of one copy."""
        if thickness is None or np.ndim(thickness) == 0:
            return thickness
        of_one = numbers_of(thickness, None)
        if of_one.shape != (self.vertices,):
            raise InvalidArgumentError(f"thickness: shape {of_one.shape}; give ({self.vertices},), of each vertex of one copy, or a "
                                       "number")
        return np.concatenate([np.zeros(self.first_vertex, of_one.dtype), np.tile(of_one, self.count)])

    def filters(self, filters: Any) -> PairFilters:
        """Those of one copy, of all. Shared vertices are in no pair and in no patch, and rest where they start."""
        one = filters_of(filters).copied(self.vertices)
        rest, pairs, patches = one.rest_positions, one.excluded_vertex_pairs, one.patches
        if rest is not None:
            rest = np.concatenate([*(rows.astype("<f8") for rows in self.shared_rows), np.tile(rest, (self.count, 1))])
        if pairs is not None:
            pairs = self._copied(pairs)
        if patches is not None and len(patches) > 0:
            patches = np.concatenate([np.zeros(self.first_vertex, patches.dtype), np.tile(patches, self.count)])
        return replace(one, rest_positions=rest, excluded_vertex_pairs=pairs, patches=patches)

    def _copied(self, elements: npt.NDArray[np.int32]) -> npt.NDArray[np.int32]:
        """Of the template's vertices, once for each copy."""
        firsts = self.first_vertex + self.vertices * np.arange(self.count, dtype=np.int64)
        return (elements[None].astype(np.int64) + firsts[:, None, None]).reshape(-1, elements.shape[1]).astype(np.int32)

    def own_bodies(self, numbers: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
        """Of the scene's bodies by number, counted from the first that is a copy's; of a shared one -1 - its number among these. Those
        that were added later, behind all copies, are shared, too."""
        own, end = numbers - self.first_body, self.count * len(self.bodies)
        later = own >= end
        return np.where((own < 0) | later, -1 - np.where(later, numbers - end, numbers), own)

    @cached_property
    def is_static(self) -> npt.NDArray[np.bool_]:
        """(n): the template's vertices that do not move."""
        return np.repeat([body.kind == "static" for body in self.bodies], [body.vertex_count for body in self.bodies])

    @cached_property
    def is_deformable(self) -> npt.NDArray[np.bool_]:
        """(n): those of deformable bodies."""
        return np.repeat([body.kind == "deformable" for body in self.bodies], [body.vertex_count for body in self.bodies])

    def bodies_in(self, worlds: npt.NDArray[np.int64], kinds: Sequence[str], meshes: bool = False) -> npt.NDArray[np.uint32]:
        """The numbers of these copies' bodies of these kinds; of meshes, those that are no half-spaces."""
        of_one = np.flatnonzero([body.kind in kinds and not (meshes and body.half_space is not None) for body in self.bodies])
        return (self.first_body + worlds[:, None] * len(self.bodies) + of_one).reshape(-1).astype("<u4")
