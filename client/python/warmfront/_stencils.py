# SPDX-License-Identifier: Apache-2.0
"""Rows as those who assemble forces need them: by closest features, and by vertex. Pure functions."""
from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Optional

import numpy as np
import numpy.typing as npt

from .errors import InvalidArgumentError

# Of Contacts.kind: a vertex and a face, and a vertex and a half-space; all others are two edges, of which some are points.
_VERTEX_FACE, _EDGES, _HALF_SPACE = 0, 1, 5


@dataclass(frozen=True, eq=False)
class Stencil:
    """Closest pairs of one kind, m of them. v (m, 2 to 4) uint32: their vertices. multiplicity (m) uint32. rows (m) int64:
    where in `Contacts` each is, ascending. weights (m, 2 to 4) float64, where the answer has weights, else None: of the same
    vertices, with signs, so that (weights[:, :, None] * x[v]).sum(1) is the vector from the row's second closest point to its
    first, which `direction` points along."""

    v: npt.NDArray[np.uint32]
    multiplicity: npt.NDArray[np.uint32]
    rows: npt.NDArray[np.int64]
    weights: Optional[npt.NDArray[np.float64]] = None

    def __len__(self) -> int:
        return len(self.rows)


@dataclass(frozen=True, eq=False)
class Stencils:
    """What a barrier is summed over, each with its multiplicity; vertices in the order of the letters. Iterating gives the
    first four in this order.

    vv: two vertices, v (m, 2). ev: the edge's two, then the vertex, v (m, 3). ee: edge a's two, then edge b's, v (m, 4); of
    nearly parallel edges, too, whose closest points may be anywhere on them. fv: the face's three, then the vertex, v (m, 4).
    vh: the vertex alone, v (m, 1), of a half-space, which `Contacts.bodies` names; not among those that iterating gives.
    """

    vv: Stencil
    ev: Stencil
    ee: Stencil
    fv: Stencil
    vh: Stencil

    def __iter__(self) -> Iterator[Stencil]:
        return iter((self.vv, self.ev, self.ee, self.fv))


@dataclass(frozen=True, eq=False)
class RowsByVertex:
    """Compressed rows (CSR): `rows[begin[i]:begin[i + 1]]` are those that vertex i is in, ascending, each once. begin (n + 1),
    rows: int64. `len()` of it is n, and `by_vertex[i]` the rows of vertex i."""

    begin: npt.NDArray[np.int64]
    rows: npt.NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.begin) - 1

    def __getitem__(self, vertex: int) -> npt.NDArray[np.int64]:
        if not 0 <= vertex < len(self):
            raise IndexError(f"vertex {vertex} is none of {len(self)}")
        return self.rows[self.begin[vertex]:self.begin[vertex + 1]]


#: By stencil, a byte: has it two of the row's vertices or more, and no other bit; or the vertex of a half-space alone?
STENCILS: npt.NDArray[np.bool_] = np.array([bits == 1 or (bits < 16 and bin(bits).count("1") >= 2) for bits in range(256)])


def _columns_by_stencil() -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """How many vertices each stencil has, and which of a row they are: (2, 16, 4), of a vertex and a face and of two edges, in the order of
    the letters."""
    sizes = np.array([bin(bits).count("1") for bits in range(16)])
    columns = np.zeros((2, 16, 4), np.int64)
    for kind in range(2):
        for bits in range(16):
            first = [k for k in range(4) if bits >> k & 1]
            if kind == _EDGES:  # edge b has two of three: it comes first
                last = [k for k in first if len(first) == 3 and k < 2 and bits & 12 == 12]
            else:  # the face's or edge's before the vertex
                last = [k for k in first if len(first) > 2 and k == 0]
            ordered = [k for k in first if k not in last] + last
            columns[kind, bits, :len(ordered)] = ordered
    return sizes, columns


_SIZES, _COLUMNS = _columns_by_stencil()
_SIGNS = np.array([[1, -1, -1, -1], [1, 1, -1, -1]])  # of a row's weights, likewise


def stencils_of(kind: npt.NDArray[np.uint8], v: npt.NDArray[np.uint32], multiplicity: npt.NDArray[np.uint32],
                stencil: npt.NDArray[np.uint8], weights: Optional[npt.NDArray[np.float64]] = None) -> Stencils:
    """Of the columns of a reduced answer."""
    sizes = _SIZES[stencil]
    edges = kind != _VERTEX_FACE
    form = edges.astype(np.int64)

    def of(chosen: npt.NDArray[np.bool_], size: int) -> Stencil:
        rows = np.flatnonzero(chosen)
        columns = _COLUMNS[form[rows], stencil[rows], :size]
        signed = None if weights is None else np.take_along_axis(weights[rows] * _SIGNS[form[rows]], columns, 1)
        return Stencil(np.take_along_axis(v[rows], columns, 1), multiplicity[rows], rows, signed)

    four = sizes == 4
    return Stencils(of(sizes == 2, 2), of(sizes == 3, 3), of(four & edges, 4), of(four & ~edges, 4),
                    of(kind == _HALF_SPACE, 1))


def rows_by_vertex(v: Any, vertex_count: int) -> RowsByVertex:
    """The rows that each vertex is in, of (k, m) vertices of k rows. InvalidArgumentError for a count that is none, and where
    a row names a vertex beyond it."""
    if not isinstance(vertex_count, (int, np.integer)) or vertex_count < 0:
        raise InvalidArgumentError(f"vertex_count: {vertex_count!r}; give how many vertices there are")
    columns = np.array(v)
    if columns.ndim == 2 and columns.shape[1] == 4:
        # A half-space's row has the vertex three times, as no other, and then no vertex.
        half_space = (columns[:, 0] == columns[:, 1]) & (columns[:, 0] == columns[:, 2])
        columns[half_space, 3] = columns[half_space, 0]
    if len(columns) > 0 and columns.size > 0 and int(columns.max()) >= vertex_count:
        row = int(np.flatnonzero((columns >= vertex_count).any(1))[0])
        raise InvalidArgumentError(f"row {row}: vertex {int(columns[row].max())} is none of {vertex_count}")
    # A degenerate face has a vertex twice.
    again = np.zeros(columns.shape, bool)
    for later in range(1, columns.shape[1]):
        again[:, later] = (columns[:, :later] == columns[:, later:later + 1]).any(1)
    once = ~again.ravel()
    vertices = columns.ravel()[once].astype(np.int64)
    rows = np.repeat(np.arange(len(columns)), columns.shape[1])[once]
    begin = np.zeros(vertex_count + 1, np.int64)
    np.cumsum(np.bincount(vertices, minlength=vertex_count), out=begin[1:])
    # Vertex and row as one number: these are sorted in less time than an order of the vertices takes.
    pairs = np.sort(vertices << 32 | rows)
    return RowsByVertex(begin, pairs & 0xFFFFFFFF)
