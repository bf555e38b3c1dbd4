# SPDX-License-Identifier: Apache-2.0
"""A caller's description of a scene. Plain values and checks of arrays."""
from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, Literal, Optional

import numpy as np
import numpy.typing as npt

from .errors import InvalidArgumentError
from .v1 import session_pb2

BodyKind = Literal["deformable", "rigid", "static", "removed"]
# The wire's enum lists these names in this order, after UNSPECIFIED.
_KINDS = ("deformable", "rigid", "static", "removed")
# What numbers of a body are not: integers of 32 bits.
_VALUES = {"name": "a string", "self_collision": "True or False", "screw": "True or False", "thickness": "a number"}


@dataclass(frozen=True)
class Body:
    """A range of vertices that form a body, and what need not be tested of it; or a half-space, a body without vertices.

    vertex_count: at least 1; 0 of a half-space, and of a body that is removed for good. first_vertex: None: the end of the
        previous body.
    kind: "deformable"; "rigid": moves as a whole, by poses of its shape, which is where positions put it last, and is not
        tested against itself; "static": does not move, nor is it tested against itself or another static body; "removed":
        tested against nothing.
    self_collision: of a deformable body.
    group, mask: 32 bits each; two bodies are tested when the group of each has a bit in the mask of the other.
    thickness: scene length unit, 0 to 2^1020: that much is added to the separation of every pair that one of the body's
        vertices is in, as of the thickest of a face's or an edge's; of a pair within the body twice that much, once for each
        of the two. Tiers certified and exact.
    world: below 2^32; bodies of two different worlds never meet, those of 0 meet all. See `Client.batch()`.
    half_space: (point, normal), each of 3 numbers: the body is all points x with normal . (x - point) <= 0, "static" or
        "rigid". The normal points out of it and may have any length; its coordinates are at most 2^1020. It meets the vertices
        of bodies that it may meet, and a rigid one moves by poses, relative to this.
        Example: Body(kind="static", half_space=((0, 0, 0), (0, 0, 1))) is a ground.
    screw: of a "rigid" body with vertices: from one pose to the next it moves along the screw between them (one axis, one
        angle below half a turn, one way along it), not each vertex along a line. Positions move it along lines. Not in tier
        "exact".
    """

    vertex_count: int = 0
    kind: BodyKind = "deformable"
    name: str = ""
    first_vertex: Optional[int] = None
    self_collision: bool = True
    group: int = 1
    mask: int = 0xFFFFFFFF
    thickness: float = 0.0
    world: int = 0
    half_space: Any = None
    screw: bool = False

    def __post_init__(self) -> None:
        for name in ("vertex_count", "first_vertex"):
            given = getattr(self, name)
            if not isinstance(given, (int, float, np.number)) and not (given is None and name == "first_vertex"):
                raise InvalidArgumentError(f"Body: {name} {given!r} is not a number")

    def put_into(self, message: Any, index: int) -> None:
        """Into a v1.Body. Raises InvalidArgumentError for a kind or number that the contract does not have, of the body by its
        name or, without one, its index."""
        body = f"body '{self.name}'" if self.name else f"body {index}"
        if self.kind not in _KINDS:
            raise InvalidArgumentError(f"{body}: kind '{self.kind}' is none of {', '.join(_KINDS)}")
        for name in ("name", "vertex_count", "first_vertex", "self_collision", "group", "mask", "thickness", "world",
                     "screw"):
            try:
                setattr(message, name, getattr(self, name) if name != "first_vertex" else self.first_vertex or 0)
            except (TypeError, ValueError):
                raise InvalidArgumentError(
                    f"{body}: {name} {getattr(self, name)!r} is not {_VALUES.get(name, 'an integer from 0 to 4294967295')}") from None
        message.kind = _KINDS.index(self.kind) + 1
        if self.half_space is not None:
            point, normal = half_space_of(self.half_space, body)
            message.half_space.point.extend(point)
            message.half_space.normal.extend(normal)


def body_of(given: Any) -> Body:
    """InvalidArgumentError for what is not one."""
    if not isinstance(given, Body):
        raise InvalidArgumentError(f"body: {given!r}; give a Body")
    return given


def half_space_of(given: Any, where: str) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """(point, normal), each of 3 numbers. InvalidArgumentError for anything else; whether they are finite is the daemon's to
    say."""
    try:
        point, normal = (tuple(float(x) for x in three) for three in given)
    except (TypeError, ValueError):
        raise InvalidArgumentError(f"{where}: half_space {given!r}; give (point, normal), each of 3 numbers") from None
    if len(point) != 3 or len(normal) != 3:
        raise InvalidArgumentError(f"{where}: half_space has {len(point)} and {len(normal)} numbers; give 3 of the point and 3 "
                                   "of the normal")
    return point, normal


@dataclass(frozen=True, eq=False)
class PairFilters:
    """Pairs of features that no question tells of, nor tests. A pair (of any `Kind`, or an edge and a face that meet) is
    left out when a vertex of one and a vertex of the other are at most `within_edges` edges of the mesh apart, or are one of
    `excluded_vertex_pairs`; when both are at most `near_at_rest` apart in the rest shape; or when all their vertices have the
    same number, other than 0, in `patches`.

    within_edges: 0 to 3; 0: off. near_at_rest: scene length unit, finite; 0: off.
    rest_positions: (n, 3), the rest shape, where near_at_rest is not 0; None: in `Client.session()` its positions.
    excluded_vertex_pairs: (p, 2) indices of different vertices, of one body or two.
    patches: (n) numbers below 2^32, one a vertex, 0: in no patch; None: no patches.
    Arrays are whatever numpy or DLPack reads without the GPU.
    """

    within_edges: int = 0
    near_at_rest: float = 0.0
    rest_positions: Any = None
    excluded_vertex_pairs: Any = None
    patches: Any = None

    def copied(self, vertices: int, rest: Optional[Callable[[], npt.NDArray[Any]]] = None) -> PairFilters:
        """With arrays of its own, of the wire's types, for so many vertices. rest: the rest shape where one is needed and there
        is none. InvalidArgumentError for what is no such array or number."""
        for name in ("within_edges", "near_at_rest"):
            try:
                setattr(session_pb2.PairFilters(), name, getattr(self, name))
            except (TypeError, ValueError):
                kind = "an integer from 0 to 3" if name == "within_edges" else "a number"
                raise InvalidArgumentError(f"filters.{name}: {getattr(self, name)!r} is not {kind}") from None
        shape = self.rest_positions
        if shape is not None and self.near_at_rest == 0 and np.size(shape) > 0:
            raise InvalidArgumentError("filters.rest_positions: has no effect while near_at_rest is 0; leave it out")
        if shape is None and rest is not None and self.near_at_rest > 0:
            shape = rest()
        pairs = self.excluded_vertex_pairs
        patches = None if self.patches is None else indices_of(self.patches, "filters.patches").copy()
        if patches is not None and len(patches) not in (0, vertices):
            raise InvalidArgumentError(f"filters.patches: shape {patches.shape}; give ({vertices},), a patch for each vertex")
        return PairFilters(
            self.within_edges, self.near_at_rest,
            None if shape is None else positions_of(shape, vertices, np.dtype("<f8"), "filters.rest_positions").copy(),
            None if pairs is None else _vertex_pairs_of(pairs, "filters.excluded_vertex_pairs"), patches)

    @property
    def given(self) -> bool:
        """Is anything said at all?"""
        return bool(self.within_edges != 0 or self.near_at_rest != 0 or any(len(array) > 0 for _, array in self.arrays()))

    def arrays(self) -> list[tuple[str, npt.NDArray[Any]]]:
        """Those that there are, by their names on the wire; of what copied() made."""
        names = ("rest_positions", "excluded_vertex_pairs", "patches")
        return [(name, getattr(self, name)) for name in names if getattr(self, name) is not None]

    def put_into(self, message: session_pb2.PairFilters) -> None:
        """Of what copied() made."""
        message.within_edges = self.within_edges
        message.near_at_rest = self.near_at_rest
        for name, array in self.arrays():
            setattr(message, name, array.tobytes())

    def announce_in(self, header: session_pb2.PairFiltersHeader) -> None:
        """Of what copied() made."""
        header.within_edges = self.within_edges
        header.near_at_rest = self.near_at_rest
        header.excluded_vertex_pair_count = 0 if self.excluded_vertex_pairs is None else len(self.excluded_vertex_pairs)
        header.patches = self.patches is not None and len(self.patches) > 0

    def with_replaced(self, first: int, end: int, positions: npt.NDArray[Any]) -> PairFilters:
        """Of what copied() made, where vertices [first, end) make way for others, which are in no patch, and at rest at
        `positions`, (k, 3). No pair of vertices names those that go."""
        patches, rest, pairs = self.patches, self.rest_positions, self.excluded_vertex_pairs
        if patches is not None and len(patches) > 0:
            patches = np.concatenate([patches[:first], np.zeros(len(positions), "<u4"), patches[end:]])
        if self.near_at_rest > 0:
            rest = np.concatenate([rest[:first], positions.astype("<f8"), rest[end:]])
        if pairs is not None:
            pairs = pairs.copy()
            pairs[pairs >= end] += np.uint32((len(positions) - (end - first)) % 2**32)
        return replace(self, patches=patches, rest_positions=rest, excluded_vertex_pairs=pairs)


def filters_of(filters: Any) -> PairFilters:
    """PairFilters, or a mapping of its fields. InvalidArgumentError for anything else."""
    if isinstance(filters, PairFilters):
        return filters
    if filters is None:
        return PairFilters()
    try:
        return PairFilters(**filters)
    except TypeError:
        names = [field.name for field in fields(PairFilters)]
        unknown = [name for name in filters if name not in names] if isinstance(filters, Mapping) else []
        what = f"there is no {unknown[0]!r}" if unknown else f"a {type(filters).__name__}"
        raise InvalidArgumentError(f"filters: {what}; give PairFilters, or a dict of its fields: {', '.join(names)}") from None


def placed(bodies: Sequence[Body], first_vertex: int = 0) -> list[Body]:
    """The bodies with every first_vertex filled in, behind so many vertices."""
    result: list[Body] = []
    end = first_vertex
    for body in bodies:
        first = end if body.first_vertex is None else body.first_vertex
        result.append(replace(body, first_vertex=first))
        end = first + body.vertex_count
    return result


def array_of(value: Any, where: str) -> npt.NDArray[Any]:
    """What numpy or DLPack makes of it, on its own memory where that can be. InvalidArgumentError for what lies on another
    device or is no array."""
    if isinstance(value, np.ndarray):
        return value
    if hasattr(value, "__dlpack__"):
        try:
            shared: npt.NDArray[Any] = np.from_dlpack(value)
            return shared
        except Exception:  # each library has its own; numpy may read it all the same, such as what is read-only
            pass
    try:
        return np.asarray(value)
    except Exception as error:
        hint = "; bring it to the CPU first" if hasattr(value, "__dlpack__") else ""
        raise InvalidArgumentError(f"{where}: {type(value).__name__}; give an array, or lists of numbers ({error}){hint}"
                                   ) from None


def faces_of(faces: Any, where: str = "faces") -> npt.NDArray[np.int32]:
    """(m, 3) little-endian int32, a copy only where it has to be; none of None. InvalidArgumentError for another shape or
    type."""
    return _vertices_of(faces, 3, "m", where)


def edges_of(edges: Any, where: str = "edges") -> npt.NDArray[np.int32]:
    """(k, 2), as `faces_of()`."""
    return _vertices_of(edges, 2, "k", where)


def _vertices_of(elements: Any, each: int, rows: str, where: str) -> npt.NDArray[np.int32]:
    array = np.zeros((0, each), np.int32) if elements is None else array_of(elements, where)
    if array.shape in ((0,), (0, each)):
        return np.zeros((0, each), "<i4")  # an empty list has no type
    if array.ndim != 2 or array.shape[1] != each:
        raise InvalidArgumentError(f"{where}: shape {array.shape}; give ({rows}, {each}) vertex indices")
    if array.dtype.kind not in "iu":
        raise InvalidArgumentError(f"{where}: {array.dtype} numbers; give integers")
    wide = (array > 0x7FFFFFFF) | (array < -0x80000000) if array.dtype.itemsize > 4 or array.dtype.kind == "u" else None
    if wide is not None and wide.any():
        row = int(np.argmax(wide.any(axis=1)))
        raise InvalidArgumentError(f"{where}[{row}]: index {array[row][wide[row]][0]} is beyond int32")
    return np.ascontiguousarray(array, dtype="<i4")


def _exactly(array: npt.NDArray[Any], dtype: np.dtype[Any], where: str) -> npt.NDArray[Any]:
    """The same numbers in `dtype`. InvalidArgumentError, naming the first that it does not hold."""
    with np.errstate(over="ignore"):
        converted = array.astype(dtype)
    if array.dtype.kind == "f":
        same = (converted == array) | np.isnan(array)
    else:
        # Without trailing zero bits, an integer fits the significand.
        magnitude = array.astype(np.uint64) if array.dtype.kind == "u" else np.abs(array.astype(np.int64)).astype(np.uint64)
        lowest = magnitude & (~magnitude + np.uint64(1))
        same = magnitude // np.maximum(lowest, np.uint64(1)) < np.uint64(2 ** (np.finfo(dtype).nmant + 1))
    if not same.all():
        at = tuple(int(i) for i in np.argwhere(~same)[0])
        raise InvalidArgumentError(f"{where}{list(at)}: {array[at]} is not exactly a {dtype.name}; round it yourself"
                                   + ("; a session made from float64 positions takes float64" if dtype == np.float32 else ""))
    return converted


def numbers_of(positions: Any, dtype: Optional[np.dtype[Any]], where: str = "positions") -> npt.NDArray[Any]:
    """The array itself where it is of `dtype` (of float32 or float64 where there is none); else one of `dtype` (float64)
    that holds the same numbers. InvalidArgumentError where none does, and for what is no number."""
    array = array_of(positions, where)
    if array.dtype.newbyteorder("=") in ((np.float32, np.float64) if dtype is None else (dtype,)):
        return array
    if array.dtype.kind not in "iuf":
        what = f"{array.dtype} numbers" if isinstance(positions, np.ndarray) else type(positions).__name__
        raise InvalidArgumentError(f"{where}: {what}; give an array of float32 or float64, or lists of numbers")
    return _exactly(array, np.dtype("<f8") if dtype is None else dtype, where)


def positions_of(positions: Any, vertices: Optional[int], dtype: Optional[np.dtype[Any]],
                 where: str = "positions") -> npt.NDArray[Any]:
    """(vertices, 3) of `dtype`, little-endian, a copy only where the memory is not such. InvalidArgumentError for another
    shape, and for numbers that `dtype` does not hold exactly; None expects nothing particular."""
    array = numbers_of(positions, dtype, where)
    given = array.dtype.newbyteorder("<")
    if array.shape == (0,):  # an empty list
        array = array.reshape(0, 3)
    if array.ndim != 2 or array.shape[1] != 3 or (vertices is not None and len(array) != vertices):
        expected = "n" if vertices is None else str(vertices)
        raise InvalidArgumentError(f"{where}: shape {array.shape}, but ({expected}, 3) is expected")
    return np.ascontiguousarray(array, dtype=given)


def pose_of(pose: Any, where: str) -> npt.NDArray[np.float64]:
    """(3, 4) float64. InvalidArgumentError for another shape; whether R is a rotation is the daemon's to say."""
    try:
        matrix = array_of(pose, where).astype("<f8", copy=False)
    except (TypeError, ValueError):
        raise InvalidArgumentError(f"{where}: {type(pose).__name__}; give a (3, 4) matrix [R t]") from None
    if matrix.shape != (3, 4):
        raise InvalidArgumentError(f"{where}: shape {matrix.shape}; give a (3, 4) matrix [R t]")
    return matrix


def _vertex_pairs_of(pairs: Any, where: str) -> npt.NDArray[np.uint32]:
    """(p, 2) uint32, a copy."""
    array = array_of(pairs, where)
    if array.size == 0:
        return np.empty((0, 2), "<u4")
    if array.ndim != 2 or array.shape[1] != 2 or array.dtype.kind not in "iu":
        raise InvalidArgumentError(f"{where}: {array.dtype} of shape {array.shape}; give (p, 2) vertex indices")
    beyond = ((array < 0) | (array > 0xFFFFFFFF)).any(axis=1)
    if beyond.any():
        at = int(np.argmax(beyond))
        raise InvalidArgumentError(f"{where}[{at}]: {array[at].tolist()} are no indices")
    return np.array(array, dtype="<u4", order="C")


def thickness_of(thickness: Any, vertices: int) -> Optional[npt.NDArray[np.float64]]:
    """(n) float64, a copy, of one number for all or one for each; None where nothing is thick. InvalidArgumentError for another
    shape, and for what is no number; whether each is a length is the daemon's to say."""
    if thickness is None:
        return None
    given = array_of(thickness, "thickness")
    array = numbers_of(np.full(vertices, given) if given.ndim == 0 else given, np.dtype("<f8"), "thickness")
    if array.shape != (vertices,):
        raise InvalidArgumentError(f"thickness: shape {array.shape}; give ({vertices},), a length for each vertex")
    return np.array(array, dtype="<f8", order="C") if array.any() else None


def indices_of(indices: Any, where: str) -> npt.NDArray[np.uint32]:
    """(k) uint32. InvalidArgumentError for anything but integers in range."""
    array = array_of(indices, where)
    if array.ndim != 1 or (array.size > 0 and array.dtype.kind not in "iu"):
        raise InvalidArgumentError(f"{where}: {array.dtype} of shape {array.shape}; give a list of indices")
    beyond = (array < 0) | (array > 0xFFFFFFFF)
    if beyond.any():
        at = int(np.argmax(beyond))
        raise InvalidArgumentError(f"{where}[{at}]: {array[at]} is no index")
    return np.ascontiguousarray(array, dtype="<u4")
