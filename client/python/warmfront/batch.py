# SPDX-License-Identifier: Apache-2.0
"""Many copies of one scene that know nothing of each other, as one session: the environments of a learner."""
from __future__ import annotations

from functools import cached_property
from types import TracebackType
from typing import Any, Optional

import numpy as np
import numpy.typing as npt

from . import _frame
from ._backend import Motion
from ._copies import Copies
from ._frame import Part
from ._question import question_of
from ._state import raw
from ._stencils import RowsByVertex
from ._uncopied import Uncopied
from .answer import Committed, Contacts, Kind, MaxStep
from .errors import FailedPreconditionError, InvalidArgumentError
from .scene import indices_of, numbers_of, positions_of
from .session import AnySession


class BatchContacts:
    """An answer of a batch: `contacts`, and which copy each row is of. Computed on first use.

    contacts: `Contacts` of the whole session. world (k) int64: the copy, 0 to n - 1; -1 where both are shared. v (k, 4)
    int64: the copy's own vertices, 0 to vertices - 1; of a shared body -1 - its vertex among all that are shared. Of a vertex
    and a half-space v[:, 3] is the copy's own body, or -1 - a shared one.
    counts (n) int64: rows of each copy. tois (n) float64: the least toi of each, infinity without a contact. Both are None of
    report "count", which lists nothing to tell copies by. `rows(world)` are the rows of one copy.
    """

    def __init__(self, contacts: Contacts, copies: Copies) -> None:
        """Internal: created by `Batch`."""
        self.contacts = contacts
        self._copies = copies

    def __len__(self) -> int:
        return len(self.contacts)

    def __bool__(self) -> bool:
        return bool(self.contacts)

    @cached_property
    def _from_first(self) -> npt.NDArray[np.int64]:
        return self.contacts.v.astype(np.int64) - self._copies.first_vertex

    @cached_property
    def world(self) -> npt.NDArray[np.int64]:
        """(k): see `BatchContacts`."""
        first, second = self._from_first[:, 0], self._from_first[:, 2]
        worlds: npt.NDArray[np.int64] = np.maximum(first, second) // self._copies.vertices
        half_spaces, bodies = self._half_spaces
        worlds[half_spaces] = np.maximum(worlds[half_spaces], bodies // len(self._copies.bodies))
        return np.maximum(worlds, -1)

    @cached_property
    def _half_spaces(self) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
        """Rows with one, and its body, counted from the first that is a copy's."""
        rows = np.flatnonzero(self.contacts.kind == Kind.VERTEX_HALF_SPACE)
        return rows, self.contacts.v[rows, 3].astype(np.int64) - self._copies.first_body

    @cached_property
    def v(self) -> npt.NDArray[np.int64]:
        """(k, 4): see `BatchContacts`."""
        rows = self._from_first
        shared = -1 - (rows + self._copies.first_vertex)
        result: npt.NDArray[np.int64] = np.where(rows < 0, shared, rows % self._copies.vertices)
        half_spaces, bodies = self._half_spaces
        result[half_spaces, 3] = np.where(bodies < 0, -1 - (bodies + self._copies.first_body), bodies % len(self._copies.bodies))
        return result

    @property
    def _only_counted(self) -> bool:
        return len(self.contacts) == 0 and bool(self.contacts)

    @cached_property
    def counts(self) -> Optional[npt.NDArray[np.int64]]:
        """(n): see `BatchContacts`."""
        return None if self._only_counted else self._rows_of_each

    @cached_property
    def _rows_of_each(self) -> npt.NDArray[np.int64]:
        return np.bincount(self.world[self.world >= 0], minlength=self._copies.count)

    @cached_property
    def tois(self) -> Optional[npt.NDArray[np.float64]]:
        """(n): see `BatchContacts`."""
        if self._only_counted:
            return None
        tois = np.full(self._copies.count, np.inf)
        within = self.world >= 0
        np.minimum.at(tois, self.world[within], self.contacts.toi[within])
        return tois

    @cached_property
    def _by_world(self) -> RowsByVertex:
        order = np.argsort(self.world, kind="stable")
        order = order[np.count_nonzero(self.world < 0):]
        begin = np.concatenate([[0], np.cumsum(self._rows_of_each)])
        return RowsByVertex(begin, order)

    def rows(self, world: int) -> npt.NDArray[np.int64]:
        """Of one copy, ascending."""
        if not 0 <= world < self._copies.count:
            raise InvalidArgumentError(f"world: {world!r} is not in [0, {self._copies.count})")
        grouped = self._by_world
        return grouped.rows[grouped.begin[world]:grouped.begin[world + 1]]


class Batch(Uncopied):
    """Created by `Client.batch()`: n copies of one scene, each in a world of its own, as one session, one frame, one answer.

    Positions are (n, vertices, 3), as the template numbers its vertices; with worlds=[...], (k), of these copies alone, and
    all others stay. Rigid bodies may be given by poses= (n, rigid bodies, 3, 4) instead, of their rest shapes, which are the
    positions last given of them; positions= then are of the deformable bodies' vertices alone. What does not move may be left
    out of neither: rows of static bodies have to be as they are. A commit takes one fraction for all copies.
    `session` is the session beneath, for everything else: shared bodies that move, filters, futures, descriptions of bodies
    (body b of copy i has the number shared + i * bodies + b there). It and the batch may be used in turn, as long as no
    vertices are added or replaced there: FailedPreconditionError then. copy and pickle raise TypeError.
    """

    _instead = "make another one, of the same template and this one's `positions`"

    def __init__(self, session: AnySession, copies: Copies) -> None:
        """Internal: use `Client.batch()`."""
        self.session = session
        self._copies = copies
        self._layout = session.layout()

    def _check_layout(self) -> None:
        if self.session.layout() is not self._layout:
            raise FailedPreconditionError("batch: vertices of the session beneath were added or replaced, and copies are not "
                                          "where they were; go on with the session, or make another batch")

    @property
    def count(self) -> int:
        """n, the copies."""
        return self._copies.count

    @property
    def positions(self) -> npt.NDArray[Any]:
        """(n, vertices, 3): where everything is. A copy."""
        self._check_layout()
        return self.session.positions[self._copies.first_vertex:].reshape(self.count, self._copies.vertices, 3)

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
        bodies do to each other is no copy's. A trial, of which `session.commit()` takes a part for all copies."""
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
        return self.session.commit(fraction)

    def proximity(self, distance: float, **arguments: Any) -> BatchContacts:
        """`Session.proximity()`."""
        self._check_layout()
        return self._contacts(self.session.proximity(distance, **arguments))

    def vertex_distances(self, distance: float, **arguments: Any) -> npt.NDArray[np.float64]:
        """(n, vertices): `Session.vertex_distances()`, of the copies' vertices; a view of the answer, read-only."""
        self._check_layout()
        distances = self.session.vertex_distances(distance, **arguments).distances
        return distances[self._copies.first_vertex:].reshape(self.count, self._copies.vertices)

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
        question = question_of(kind, **options)
        return self.session._ask(self._motion(positions, poses, worlds), question, timeout)

    def _motion(self, positions: Any, poses: Any, worlds: Any) -> Motion:
        self._check_layout()
        copies = self._copies
        if positions is None and poses is None:
            raise InvalidArgumentError("positions: give where the copies go, or poses")
        chosen = np.arange(self.count) if worlds is None else self._worlds(worlds)
        dtype = self.session.positions_dtype
        if positions is not None and poses is None and worlds is None and copies.first_vertex == 0:
            return Motion(self._rows(positions, self.count, copies.vertices, dtype))  # the daemon looks at what is static
        parts: list[Part] = []
        if positions is not None:
            moving = copies.is_deformable if poses is not None else ~copies.is_static
            vertices = int(moving.sum()) if poses is not None else copies.vertices
            rows = self._rows(positions, len(chosen), vertices, dtype)
            if poses is None and copies.is_static.any():
                rows = self._without_static(rows, chosen)
            kinds = ("deformable",) if poses is not None else ("deformable", "rigid")
            parts += [(_frame.BODIES, copies.bodies_in(chosen, kinds, meshes=True).tobytes()), (_frame.BODY_POSITIONS, raw(rows))]
        if poses is not None:
            rigid = sum(body.kind == "rigid" for body in copies.bodies)
            matrices = numbers_of(poses, None, "poses")
            if matrices.shape != (len(chosen), rigid, 3, 4):
                raise InvalidArgumentError(f"poses: shape {matrices.shape}; give ({len(chosen)}, {rigid}, 3, 4), [R t] of each copy's "
                                           "rigid bodies")
            parts += [(_frame.POSE_BODIES, copies.bodies_in(chosen, ("rigid",)).tobytes()),
                      (_frame.POSES, np.ascontiguousarray(matrices, dtype).tobytes())]
        return Motion(parts=parts)

    def _worlds(self, worlds: Any) -> npt.NDArray[np.int64]:
        chosen = indices_of(worlds, "worlds").astype(np.int64)
        if len(chosen) > 0 and chosen.max() >= self.count:
            raise InvalidArgumentError(f"worlds: copy {chosen.max()} is not in [0, {self.count})")
        if len(np.unique(chosen)) != len(chosen):
            raise InvalidArgumentError("worlds: names a copy twice")
        return chosen

    @staticmethod
    def _rows(positions: Any, count: int, vertices: int, dtype: np.dtype[Any]) -> npt.NDArray[Any]:
        """(count * vertices, 3), of the caller's memory where that can be."""
        array = numbers_of(positions, dtype)
        if array.shape != (count, vertices, 3):
            raise InvalidArgumentError(f"positions: shape {array.shape}; give ({count}, {vertices}, 3)")
        return positions_of(array.reshape(-1, 3), None, dtype)

    def _without_static(self, rows: npt.NDArray[Any], chosen: npt.NDArray[np.int64]) -> npt.NDArray[Any]:
        static = self._copies.is_static
        given = rows.reshape(len(chosen), -1, 3)
        if not np.array_equal(given[:, static], self.positions[chosen][:, static]):
            raise InvalidArgumentError("positions: rows of static bodies are not where these are; they do not move")
        return np.ascontiguousarray(given[:, ~static]).reshape(-1, 3)
