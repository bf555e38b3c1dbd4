# SPDX-License-Identifier: Apache-2.0
"""An answer of a batch, told by copies. Computed on first use."""
from __future__ import annotations

from functools import cached_property
from typing import Optional

import numpy as np
import numpy.typing as npt

from ._copies import Copies
from ._stencils import RowsByVertex
from .answer import Contacts, Kind
from .errors import InvalidArgumentError


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
        """Rows with one, and its body, counted from the first that is a copy's; below 0: -1 - a shared one."""
        rows = np.flatnonzero(self.contacts.kind == Kind.VERTEX_HALF_SPACE)
        return rows, self._copies.own_bodies(self.contacts.v[rows, 3].astype(np.int64))

    @cached_property
    def v(self) -> npt.NDArray[np.int64]:
        """(k, 4): see `BatchContacts`."""
        rows = self._from_first
        shared = -1 - (rows + self._copies.first_vertex)
        result: npt.NDArray[np.int64] = np.where(rows < 0, shared, rows % self._copies.vertices)
        half_spaces, bodies = self._half_spaces
        result[half_spaces, 3] = np.where(bodies < 0, bodies, bodies % len(self._copies.bodies))
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
