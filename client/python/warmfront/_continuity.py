# SPDX-License-Identifier: Apache-2.0
"""Which rows of an answer were there in an earlier one. Pure functions."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Optional

import numpy as np
import numpy.typing as npt

from .answer import Contacts, Kind
from .errors import InvalidArgumentError


@dataclass(frozen=True, eq=False)
class Continuity:
    """kept (k) int64: of each row where the same one is in the earlier answer, or -1 where it is new. ended (m) int64: the
    earlier rows that are not there any more, ascending."""

    kept: npt.NDArray[np.int64]
    ended: npt.NDArray[np.int64]

    @property
    def new(self) -> npt.NDArray[np.bool_]:
        """(k): is the row new?"""
        return self.kept < 0

    def carry(self, values: Any, new: Any = 0.0) -> npt.NDArray[Any]:
        """(k) or (k, ...): what `values` has for each row, or `new` where the row is new. values: a number, or an array of one
        shape, for each row of the earlier answer, which may have had none. InvalidArgumentError for another number of them."""
        earlier = np.asarray(values)
        before = int((self.kept >= 0).sum()) + len(self.ended)
        if earlier.ndim == 0 or len(earlier) != before:
            raise InvalidArgumentError(f"carry: values of shape {earlier.shape}; give ({before}, ...), one for each earlier row")
        fill = new if np.isscalar(new) else np.asarray(new)  # a plain number does not widen float32
        made: npt.NDArray[Any] = np.full((len(self.kept), *earlier.shape[1:]), fill, np.result_type(earlier, fill))
        rows = np.flatnonzero(self.kept >= 0)
        made[rows] = earlier[self.kept[rows]]
        return made


def continuity(earlier: Optional[Contacts], now: Contacts) -> Continuity:
    """Of the rows of two answers of one session, for example of two frames: which are kept, and which ended. What friction and
    warm-started multipliers are carried over by: `multipliers = c.carry(multipliers)`.

    Rows are the same where their kind and vertices are; status, time and fields do not count. Of two reduced answers, where the
    vertices of their closest pairs are, whichever row stands for these. None for the earlier one: all are new. It is a function
    of the two answers alone, so that no resume changes it. Bodies that are added or described otherwise leave the numbers of what
    was there; where elements or bodies are replaced, numbers are others, and an answer from before says nothing of one after:
    give None for it then. InvalidArgumentError where one is reduced and the other is not.
    """
    for given, name in ((earlier, "earlier"), (now, "now")):
        if not isinstance(given, Contacts) and not (given is None and name == "earlier"):
            raise InvalidArgumentError(f"continuity: {name}: {type(given).__name__}; give Contacts, an answer's")
    if earlier is None:
        return Continuity(np.full(len(now), -1, np.int64), np.empty(0, np.int64))
    if (earlier.multiplicity is None) != (now.multiplicity is None):
        raise InvalidArgumentError("continuity: one of the answers is reduced, and the other is not; ask for both alike")
    before = len(earlier)
    keys = np.concatenate([_keys(earlier), _keys(now)])
    kept, there = np.full(len(now), -1, np.int64), np.zeros(before, bool)
    if len(keys) > 0:
        order = np.lexsort((keys[:, 1], keys[:, 0]))  # stable: of equal keys the earlier answer's first
        keys = keys[order]
        first = np.flatnonzero(np.concatenate([[True], (keys[1:] != keys[:-1]).any(1)]))
        is_earlier = order < before
        # Of faces that are given twice several rows are the same: the first is the first, and so on.
        earlier_ones = np.add.reduceat(is_earlier.astype(np.int64), first)
        group = np.repeat(np.arange(len(first)), np.diff(np.append(first, len(keys))))
        rank = np.arange(len(keys)) - first[group] - earlier_ones[group]  # of a present row, among those that are the same
        same = np.flatnonzero(~is_earlier & (rank < earlier_ones[group]))
        kept[order[same] - before] = order[first[group[same]] + rank[same]]
        there[kept[kept >= 0]] = True
    return Continuity(kept, np.flatnonzero(~there))


def _keys(rows: Contacts) -> npt.NDArray[np.uint64]:
    """(k, 2): what makes a row itself."""
    form, v = (rows.kind != Kind.VERTEX_FACE).astype(np.uint64), rows.v.astype(np.uint64)
    # A half-space's vertex stands three times in its row, as in no other: that form tells it from all others.
    if rows.multiplicity is not None:
        stencils = rows.stencils()
        for size, stencil in ((2, stencils.vv), (3, stencils.ev)):
            form[stencil.rows] = size
            v[stencil.rows] = 0
            v[stencil.rows, :2] = np.sort(stencil.v[:, :2], axis=1)
            v[stencil.rows, 2:size] = stencil.v[:, 2:]
    # Faces number their vertices below 2^31.
    return np.stack([form << np.uint64(62) | v[:, 0] << np.uint64(31) | v[:, 1], v[:, 2] << np.uint64(32) | v[:, 3]], axis=1)
