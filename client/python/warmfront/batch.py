# SPDX-License-Identifier: Apache-2.0
"""Many copies of one scene that know nothing of each other, as one session: the environments of a learner."""
from __future__ import annotations

from types import TracebackType
from typing import Any, Optional

import numpy as np
import numpy.typing as npt

from . import _frame
from ._backend import Motion
from ._batch_contacts import BatchContacts
from ._copies import Copies
from ._frame import Part
from ._part_way import each_part_way
from ._question import question_of
from ._screw import poses_along_screws
from ._state import raw
from ._uncopied import Uncopied
from .answer import Committed, Contacts, MaxStep
from .errors import FailedPreconditionError, InvalidArgumentError
from .scene import array_of, indices_of, numbers_of, positions_of
from .session import AnySession

_OF_STEPS = {"tier", "tolerance", "min_separation", "report", "fields", "max_contacts"}
# Of one question, by its kind: those of the session's function of that name.
_OPTIONS: dict[str, set[str]] = {
    "step": _OF_STEPS, "trial": _OF_STEPS, "place": set(),
    "max_step": {"tier", "tolerance", "min_separation", "max_contacts", "leave_out_overlaps", "keep_distance"},
}


def _check_given(positions: Any, poses: Any) -> None:
    if positions is None and poses is None:
        raise InvalidArgumentError("positions: give where the copies go, or poses")


class Batch(Uncopied):
    """Created by `Client.batch()`: n copies of one scene, each in a world of its own, as one session, one frame, one answer.

    Positions are (n, vertices, 3), as the template numbers its vertices; with worlds=[...], (k), of these copies alone, and
    all others stay. Rigid bodies may be given by poses= (n, rigid bodies, 3, 4) instead, of their rest shapes, which are the
    positions last given of them; positions= then are of the deformable bodies' vertices alone. Either has a row for each, also
    of what does not move: rows of static bodies have to be as they are, and nobody looks at those of removed ones. A commit
    takes one fraction for all copies; `part_way()` says where each is at a fraction of its own. Copies count from 0 here.
    `session` is the session beneath, for everything else: shared bodies that move, filters, futures, descriptions of bodies
    (body b of copy i has the number shared + i * bodies + b there, and `world` i + 1, which it has to keep: change
    `dataclasses.replace(session.bodies[number], ...)`). It and the batch may be used in turn: bodies may be removed there, cut,
    replaced by others of as many vertices, and half-spaces added, which then are shared ones behind those that there were.
    FailedPreconditionError where vertices get other numbers, or a body leaves its world. copy and pickle raise TypeError.
    """

    _instead = "make another one, of the same template and this one's `positions`"

    def __init__(self, session: AnySession, copies: Copies) -> None:
        """Internal: use `Client.batch()`."""
        self.session = session
        self._copies = copies
        self._layout = session.layout()
        self._checked = session._changed  # the scene was right after so many changes
        self._removed: npt.NDArray[np.int64] = np.empty(0, np.int64)  # the bodies that were removed then

    def _check_layout(self) -> None:
        self.session._open()
        if self.session._changed == self._checked:
            return
        with self.session._turn:  # after a change that is under way
            if self.session.layout() is not self._layout:
                raise FailedPreconditionError("batch: the session beneath has another number of vertices, and copies are not where they "
                                              "were; go on with the session, or make another batch")
            for number, (body, world) in enumerate(zip(self.session.bodies, self._copies.worlds())):
                if body.world != world and body.kind != "removed":
                    raise FailedPreconditionError(
                        f"batch: body {number} of the session beneath is of world {body.world} now, and not of its own, {world}, so "
                        f"that copies meet; change it to dataclasses.replace(session.bodies[{number}], world={world})")
            self._removed = np.flatnonzero([body.kind == "removed" for body in self.session.bodies])
            self._checked = self.session._changed

    @property
    def count(self) -> int:
        """n, the copies."""
        return self._copies.count

    @property
    def positions(self) -> npt.NDArray[Any]:
        """(n, vertices, 3): where everything is. A copy."""
        self._check_layout()
        return self.session.positions[self._copies.first_vertex:].reshape(self.count, self._copies.vertices, 3)

    @property
    def poses(self) -> npt.NDArray[np.float64]:
        """(n, rigid bodies, 3, 4) float64 [R t]: `Session.poses` of each copy's rigid bodies, in the order of poses=; the identity
        of one that is where the positions last given of it say. A copy."""
        self._check_layout()
        moved, unmoved = self.session.poses, np.eye(3, 4)
        rigid = self._copies.bodies_in(np.arange(self.count), ("rigid",)).tolist()
        return np.array([moved.get(number, unmoved) for number in rigid]).reshape(self.count, -1, 3, 4)

    def step(self, positions: Any = None, *, poses: Any = None, worlds: Any = None, timeout: Optional[float] = None,
             **options: Any) -> BatchContacts:
        """`Session.step()` of all copies, or of some. options: those of one question, as there."""
        return self._contacts(self._ask("step", positions, poses, worlds, timeout, options))

    def trial(self, positions: Any = None, *, poses: Any = None, worlds: Any = None, timeout: Optional[float] = None,
              **options: Any) -> BatchContacts:
        """`Session.trial()` of all copies, or of some."""
        return self._contacts(self._ask("trial", positions, poses, worlds, timeout, options))

    def max_step(self, positions: Any = None, *, poses: Any = None, worlds: Any = None, timeout: Optional[float] = None,
                 **options: Any) -> npt.NDArray[np.float64]:
        """(n): how far each copy may go, `Session.max_step()` of it alone: as far as nothing of it touches. What two shared
        bodies do to each other is no copy's, and a copy that stands still may go all the way, 1. A trial, of which `commit()`
        takes a part for all copies. `trial(..., report="earliest")` of the same motion has what each copy meets first."""
        answer = self._ask("max_step", positions, poses, worlds, timeout, options)
        assert isinstance(answer, MaxStep)
        fractions = np.ones(self.count)
        own = answer.worlds > 0
        fractions[answer.worlds[own].astype(np.int64) - 1] = answer.world_fractions[own]
        return fractions

    def place(self, positions: Any = None, *, poses: Any = None, worlds: Any = None, timeout: Optional[float] = None) -> None:
        """`Session.place()` of all copies, or of some: resets."""
        self._ask("place", positions, poses, worlds, timeout, {})

    def commit(self, fraction: float = 1.0) -> Committed:
        """`Session.commit()`, of all copies."""
        if np.ndim(fraction) > 0:
            raise InvalidArgumentError("fraction: a commit takes one for all copies; part_way() tells where each is at its own, for "
                                       "step() or place()")
        return self.session.commit(fraction)

    def part_way(self, fractions: Any, positions: Any = None, *,
                 poses: Any = None) -> tuple[Optional[npt.NDArray[Any]], Optional[npt.NDArray[np.float64]]]:
        """Where each copy is at its own of `fractions`, (n) in [0, 1], of the way to these positions and poses: what `step()`,
        `trial()` and `place()` take as positions and poses=. As `commit()` would leave it at that fraction; a rigid body without
        screw, which a commit would leave shrunk where it turns, is put on the screw all the same: `step()` tells what it meets.

            limits = batch.max_step(X, poses=P)
            X, P = batch.part_way(0.9 * limits, X, poses=P)
            contacts = batch.step(X, poses=P)
        """
        self._check_layout()
        _check_given(positions, poses)
        share = numbers_of(fractions, np.dtype("<f8"), "fractions")
        if share.shape != (self.count,):
            raise InvalidArgumentError(f"fractions: shape {share.shape}; give ({self.count},), one for each copy")
        outside = ~((share >= 0) & (share <= 1))
        if outside.any():
            raise InvalidArgumentError(f"fractions[{int(np.argmax(outside))}]: {share[outside][0]} is not in [0, 1]")
        dtype = self.session.positions_dtype
        at = placed = None
        if positions is not None:
            start = self.positions if poses is None else self.positions[:, self._copies.is_deformable]
            rows = self._rows(positions, self.count, start.shape[1], dtype).reshape(start.shape)
            at = each_part_way(start.astype(np.float64), rows.astype(np.float64), share, dtype).astype(dtype)
        if poses is not None:
            ends = self._matrices(poses, self.count).astype(dtype).astype(np.float64)
            starts, of_pose = self.poses.reshape(-1, 3, 4), np.repeat(share, ends.shape[1])
            placed = poses_along_screws(starts, ends.reshape(-1, 3, 4), of_pose, dtype).reshape(ends.shape)
        return at, placed

    def proximity(self, distance: float, **arguments: Any) -> BatchContacts:
        """`Session.proximity()`."""
        self._check_layout()
        return self._contacts(self.session.proximity(distance, **arguments))

    def vertex_distances(self, distance: float, **arguments: Any) -> npt.NDArray[np.float64]:
        """(n, vertices): `Session.vertex_distances()`, of the copies' vertices; a view of the answer, read-only."""
        self._check_layout()
        distances = self.session.vertex_distances(distance, **arguments).distances
        return distances[self._copies.first_vertex:].reshape(self.count, self._copies.vertices)

    def intersections(self, **arguments: Any) -> npt.NDArray[np.int64]:
        """(n): how many edges and faces of each copy meet, in itself or with what is shared; see `Session.intersections()`. What two
        shared bodies do to each other is no copy's."""
        self._check_layout()
        if arguments.get("report", "all") not in ("all", None):
            raise InvalidArgumentError("report: which copies are tangled is told by \"all\" alone; leave it out, or ask the session")
        found = self.session.intersections(**arguments)
        own = np.concatenate([found.edges[:, :1], found.faces[:, :1]], axis=1).astype(np.int64).max(axis=1) - self._copies.first_vertex
        return np.bincount(own[own >= 0] // self._copies.vertices, minlength=self.count)

    def close(self) -> None:
        """`Session.close()`."""
        self.session.close()

    def __enter__(self) -> Batch:
        return self

    def __exit__(self, kind: Optional[type[BaseException]], error: Optional[BaseException],
                 trace: Optional[TracebackType]) -> None:
        self.session.__exit__(kind, error, trace)

    def _contacts(self, answer: Any) -> BatchContacts:
        assert isinstance(answer, Contacts)
        return BatchContacts(answer, self._copies)

    def _ask(self, kind: Any, positions: Any, poses: Any, worlds: Any, timeout: Optional[float], options: Any) -> Any:
        unknown = set(options) - _OPTIONS[kind]
        if unknown:
            raise TypeError(f"{kind}() got an unexpected keyword argument {min(unknown)!r}")
        question = question_of(kind, **options)
        return self.session._ask(self._motion(positions, poses, worlds), question, timeout)

    def _motion(self, positions: Any, poses: Any, worlds: Any) -> Motion:
        self._check_layout()
        copies = self._copies
        _check_given(positions, poses)
        chosen = np.arange(self.count) if worlds is None else self._worlds(worlds)
        dtype = self.session.positions_dtype
        if positions is not None and poses is None and worlds is None and copies.first_vertex == 0:
            return Motion(self._rows(positions, self.count, copies.vertices, dtype))  # the daemon looks at what is static
        parts: list[Part] = []
        if positions is not None:
            moving = copies.is_deformable if poses is not None else ~copies.is_static
            vertices = int(moving.sum()) if poses is not None else copies.vertices
            why = ", beside poses the vertices of deformable bodies alone" if poses is not None else ""
            rows = self._rows(positions, len(chosen), vertices, dtype, why)
            if poses is None and copies.is_static.any():
                rows = self._without_static(rows, chosen)
            kinds = ("deformable",) if poses is not None else ("deformable", "rigid")
            bodies, rows = self._of_what_is_there(copies.bodies_in(chosen, kinds, meshes=True), rows, vertices=True)
            parts += [(_frame.BODIES, bodies.tobytes()), (_frame.BODY_POSITIONS, raw(rows))]
        if poses is not None:
            matrices = self._matrices(poses, len(chosen)).reshape(-1, 3, 4)
            bodies, matrices = self._of_what_is_there(copies.bodies_in(chosen, ("rigid",)), matrices)
            parts += [(_frame.POSE_BODIES, bodies.tobytes()), (_frame.POSES, np.ascontiguousarray(matrices, dtype).tobytes())]
        return Motion(parts=parts)

    def _of_what_is_there(self, bodies: npt.NDArray[np.uint32], rows: npt.NDArray[Any],
                          vertices: bool = False) -> tuple[npt.NDArray[np.uint32], npt.NDArray[Any]]:
        """Without the rows of bodies that were removed: a row for each, or of vertices, one for each of a body's."""
        if len(self._removed) == 0:
            return bodies, rows
        there = np.isin(bodies, self._removed, invert=True)
        of_rows = np.repeat(there, [self.session.bodies[b].vertex_count for b in bodies.tolist()]) if vertices else there
        return bodies[there], rows[of_rows]

    def _matrices(self, poses: Any, count: int) -> npt.NDArray[Any]:
        """(count, rigid bodies, 3, 4), of the caller's memory where that can be."""
        rigid = sum(body.kind == "rigid" for body in self._copies.bodies)
        matrices = numbers_of(poses, None, "poses")
        if matrices.shape != (count, rigid, 3, 4):
            raise InvalidArgumentError(f"poses: shape {matrices.shape}; give ({count}, {rigid}, 3, 4), [R t] of each copy's rigid bodies")
        return matrices

    def _worlds(self, worlds: Any) -> npt.NDArray[np.int64]:
        array = array_of(worlds, "worlds")
        if array.dtype == np.bool_ and array.ndim == 1:
            if len(array) != self.count:
                raise InvalidArgumentError(f"worlds: a mask of {len(array)} where there are {self.count} copies")
            return np.flatnonzero(array)
        chosen = indices_of(array, "worlds").astype(np.int64)
        if len(chosen) > 0 and chosen.max() >= self.count:
            raise InvalidArgumentError(f"worlds: copy {chosen.max()} is not in [0, {self.count})")
        if len(np.unique(chosen)) != len(chosen):
            copies, times = np.unique(chosen, return_counts=True)
            raise InvalidArgumentError(f"worlds: names copy {copies[np.argmax(times > 1)]} twice")
        return chosen

    @staticmethod
    def _rows(positions: Any, count: int, vertices: int, dtype: np.dtype[Any], why: str = "") -> npt.NDArray[Any]:
        """(count * vertices, 3), of the caller's memory where that can be. why: so many."""
        array = numbers_of(positions, dtype)
        if array.shape != (count, vertices, 3):
            raise InvalidArgumentError(f"positions: shape {array.shape}; give ({count}, {vertices}, 3){why}")
        return positions_of(array.reshape(-1, 3), None, dtype)

    def _without_static(self, rows: npt.NDArray[Any], chosen: npt.NDArray[np.int64]) -> npt.NDArray[Any]:
        static = self._copies.is_static
        given = rows.reshape(len(chosen), len(static), 3)
        differ = (given != self.positions[chosen]).any(2) & static
        if differ.any():
            copy, vertex = np.argwhere(differ)[0]
            raise InvalidArgumentError(f"positions[{copy}, {vertex}]: a vertex of a static body, which does not move, is elsewhere than it was")
        return np.ascontiguousarray(given[:, ~static]).reshape(-1, 3)
