# SPDX-License-Identifier: Apache-2.0
"""Converts the daemon's stream messages and errors to this package's values. Pure functions."""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field as dataclass_field
from typing import Any, Optional, Union

import numpy as np
import numpy.typing as npt

from ._memory import Block
from ._topology import Topology
from ._wire import Malformed, fields
from ._stencils import STENCILS
from .answer import Committed, Contact, Contacts, Intersections, Kind, MaxStep, Status, VertexDistances
from .errors import InternalError, WarmfrontError, class_of
from .v1 import errors_pb2, step_pb2

# Of v1.StreamStepsResponse and v1.StepAnswer.
_ANSWER = 1
_FRAME, _CONTACTS, _LAST, _SUMMARY, _DISTANCES, _WORLDS, _WORLD_TOIS, _SHARED = 1, 2, 3, 4, 5, 6, 7, 8
# Bits of v1.SharedColumns, beside the numbers of ContactColumns' fields.
_SHARED_DISTANCES, _SHARED_WORLDS, _SHARED_WORLD_TOIS = 13, 14, 15
# Shorter answers are copied out of shared memory, so that none of them keeps its room.
_COPIED_BYTES = 1 << 14
# Of v1.ContactColumns: name, type, shape of a row.
_COLUMNS: dict[int, tuple[str, str, tuple[int, ...]]] = {
    1: ("kind", "u1", ()),
    2: ("status", "u1", ()),
    3: ("v", "<u4", (4,)),
    4: ("toi", "<f8", ()),
    5: ("weights", "<f8", (4,)),
    6: ("normal", "<f8", (3,)),
    7: ("points", "<f8", (2, 3)),
    8: ("squared_distance", "<f8", ()),
    9: ("closest", "u1", ()),
    10: ("direction", "<f8", (3,)),
    11: ("multiplicity", "<u4", ()),
    12: ("stencil", "u1", ()),
}
# Of v1.SharedColumns besides.
_BESIDES: dict[int, tuple[str, str, tuple[int, ...]]] = {
    _SHARED_DISTANCES: ("distances", "<f8", ()),
    _SHARED_WORLDS: ("worlds", "<u4", ()),
    _SHARED_WORLD_TOIS: ("world_tois", "<f8", ()),
}
_EDGE_FACE = 2  # the kind of all rows of intersections, which have five vertices
_ALWAYS = ("kind", "status", "v", "toi")
REDUCED = ("multiplicity", "stencil")  # the columns of a reduced answer

Columns = dict[str, npt.NDArray[Any]]


@dataclass
class AnswerPart:
    """A v1.StepAnswer whose columns are views into the message."""

    frame: int = 0
    columns: Columns = dataclass_field(default_factory=dict)
    last: bool = False
    summary: Any = None  # step_pb2.StepSummary
    distances: Optional[npt.NDArray[np.float64]] = None  # of vertices, and a view, too
    worlds: Optional[npt.NDArray[np.uint32]] = None  # and these are
    world_tois: Optional[npt.NDArray[np.float64]] = None
    shared: Any = None  # step_pb2.SharedColumns
    bulk: int = 0  # bytes that it lists, where they are in the message

    def fill_from(self, room: Optional[Block]) -> None:
        """Columns that are in shared memory, as views there: the room is not used again while any of them lives. InternalError
        where they are not within it."""
        if self.shared is None:
            return
        if room is None:
            raise malformed("its columns are in shared memory, and it was given no room there")
        summary = self.summary
        counts = {_SHARED_DISTANCES: summary.distances, _SHARED_WORLDS: summary.worlds, _SHARED_WORLD_TOIS: summary.worlds}
        begin = end = self.shared.offset - room.offset
        places: list[tuple[int, int, int]] = []  # number, and first and last byte in the room
        for number, (name, dtype, shape) in {**_COLUMNS, **_BESIDES}.items():
            if not self.shared.columns >> number & 1:
                continue
            if name == "v" and summary.ef > 0:
                shape = (5,)
            first = end + -(room.offset + end) % 64
            end = first + counts.get(number, summary.rows) * int(np.dtype(dtype).itemsize * np.prod(shape, dtype=int))
            if not 0 <= begin <= end <= room.size:
                raise malformed("its columns are not within the room that it was given")
            places.append((number, first, end))
        data = room.data.view()
        data.flags.writeable = False
        if end - begin <= _COPIED_BYTES:
            data = np.frombuffer(data[begin:end].tobytes(), np.uint8)
        else:
            begin = 0
        columns: Columns = {}
        for number, first, last in places:
            array = data[first - begin:last - begin]
            if number == _SHARED_DISTANCES:
                self.distances = array.view("<f8")
            elif number == _SHARED_WORLDS:
                self.worlds = array.view("<u4")
            elif number == _SHARED_WORLD_TOIS:
                self.world_tois = array.view("<f8")
            else:
                name, dtype, shape = _COLUMNS[number]
                columns[name] = array.view(dtype).reshape(-1, *((5,) if name == "v" and summary.ef > 0 else shape))
        self.columns = _checked(columns)


def malformed(what: str) -> InternalError:
    return InternalError(f"the daemon's answer is malformed: {what}")


def parse_response(message: bytes) -> Union[AnswerPart, step_pb2.StreamStepsResponse]:
    """An answer without copying its contacts; anything else through protobuf. Raises InternalError for what is no
    message."""
    view = memoryview(message)
    try:
        for number, value in fields(view):
            if number == _ANSWER and isinstance(value, memoryview):
                return _parse_answer(value)
        response = step_pb2.StreamStepsResponse()
        response.ParseFromString(message)
        return response
    except Malformed as error:
        raise malformed(str(error)) from None
    except Exception as error:  # protobuf's DecodeError is in a module without types
        if isinstance(error, WarmfrontError):
            raise
        raise malformed(str(error)) from None


def _parse_answer(view: memoryview) -> AnswerPart:
    part = AnswerPart(summary=step_pb2.StepSummary())
    for number, value in fields(view):
        if number == _FRAME and isinstance(value, int):
            part.frame = value
        elif number == _CONTACTS and isinstance(value, memoryview):
            part.columns = _parse_columns(value)
            part.bulk += len(value)
        elif number == _LAST:
            part.last = bool(value)
        elif number == _SUMMARY and isinstance(value, memoryview):
            part.summary.MergeFromString(bytes(value))
        elif number == _DISTANCES and isinstance(value, memoryview):
            if len(value) % 8:
                raise malformed(f"distances of {len(value)} bytes")
            part.distances = np.frombuffer(value, "<f8")
            part.bulk += len(value)
        elif number == _SHARED and isinstance(value, memoryview):
            part.shared = step_pb2.SharedColumns.FromString(bytes(value))
        elif number == _WORLDS and isinstance(value, memoryview):
            if len(value) % 4:
                raise malformed(f"worlds of {len(value)} bytes")
            part.worlds = np.frombuffer(value, "<u4")
        elif number == _WORLD_TOIS and isinstance(value, memoryview):
            if len(value) % 8:
                raise malformed(f"times of worlds of {len(value)} bytes")
            part.world_tois = np.frombuffer(value, "<f8")
    return part


def _parse_columns(view: memoryview) -> Columns:
    columns: Columns = {}
    for number, value in fields(view):
        if number not in _COLUMNS or not isinstance(value, memoryview):
            continue
        name, dtype, shape = _COLUMNS[number]
        kinds = columns.get("kind")  # which the daemon writes first
        if name == "v" and kinds is not None and len(kinds) > 0 and kinds[0] == _EDGE_FACE:
            shape = (5,)
        size = int(np.dtype(dtype).itemsize * np.prod(shape, dtype=int))
        if len(value) % size:
            raise malformed(f"column {name} of {len(value)} bytes")
        columns[name] = np.frombuffer(value, dtype).reshape(-1, *shape)
    return _checked(columns)


def _checked(columns: Columns) -> Columns:
    """InternalError for what is no answer."""
    if columns:
        rows = len(columns.get("kind", ()))
        if any(len(column) != rows for column in columns.values()) or any(name not in columns for name in _ALWAYS):
            raise malformed("columns of unequal length")
        kinds = columns["kind"]
        edge_faces = kinds == _EDGE_FACE
        if (kinds > Kind.VERTEX_HALF_SPACE).any() or (edge_faces.any() and not edge_faces.all()):
            raise malformed("a contact of unknown kind")
        if ((columns["status"] < 1) | (columns["status"] > 4)).any():
            raise malformed("a contact of unknown status")
        if "closest" in columns and (columns["closest"] > 3).any():
            raise malformed("closest features of unknown kind")
        if ("multiplicity" in columns) != ("stencil" in columns):
            raise malformed("columns of unequal length")
        if "stencil" in columns and not STENCILS[columns["stencil"]].all():
            raise malformed("a stencil of no closest pair")
    return columns


def finish(parts: Sequence[AnswerPart], asked: Sequence[str], topology: Optional[Topology] = None) -> Contacts:
    """The answer of all its parts, in order, with the columns that were asked for. Raises InternalError when rows are
    missing."""
    last = parts[-1]
    filled = [part.columns for part in parts if part.columns]
    joined: dict[str, Optional[npt.NDArray[Any]]] = {}
    for name, dtype, shape in _COLUMNS.values():
        chunks = [columns[name] for columns in filled if name in columns]
        if len(chunks) not in (0, len(filled)):
            raise malformed("columns of unequal length")
        if not chunks:
            joined[name] = np.empty((0, *shape), dtype) if name in _ALWAYS or name in asked else None
        else:
            joined[name] = chunks[0] if len(chunks) == 1 else np.concatenate(chunks)
    rows = len(joined["toi"]) if joined["toi"] is not None else 0
    if rows != last.summary.rows:
        raise malformed(f"{rows} of {last.summary.rows} contacts")
    worlds, world_tois = (_joined([getattr(part, name) for part in parts], dtype)
                          for name, dtype in (("worlds", "<u4"), ("world_tois", "<f8")))
    if not len(worlds) == len(world_tois) == last.summary.worlds:
        raise malformed(f"{len(worlds)} worlds and {len(world_tois)} times of {last.summary.worlds}")
    return Contacts(last.frame, summary=last.summary, topology=topology, worlds=worlds, world_tois=world_tois,
                    **joined)  # type: ignore[arg-type]


def _joined(chunks: Sequence[Optional[npt.NDArray[Any]]], dtype: str) -> npt.NDArray[Any]:
    """A list that came in parts, read-only; a view where it came in one."""
    filled = [chunk for chunk in chunks if chunk is not None]
    joined = filled[0] if len(filled) == 1 else np.concatenate([np.empty(0, dtype), *filled])
    joined.flags.writeable = False
    return joined


def vertex_distances_of(parts: Sequence[AnswerPart], contacts: Contacts) -> VertexDistances:
    """Of all parts of an answer by vertex, and what it says besides. Raises InternalError when some are missing."""
    distances = _joined([part.distances for part in parts], "<f8")
    if len(distances) != parts[-1].summary.distances:
        raise malformed(f"{len(distances)} of {parts[-1].summary.distances} distances")
    return VertexDistances(contacts.frame, distances, contacts.vf, contacts.ee, contacts.possible, contacts.statistics,
                           contacts.vh)


def intersections_of(contacts: Contacts, summary: Any) -> Intersections:
    """Of the rows of edges and faces, and their v1.StepSummary."""
    v = contacts.v if len(contacts) > 0 else np.empty((0, 5), "<u4")
    return Intersections(contacts.frame, summary.ef, v[:, :2], v[:, 2:], contacts.statistics)


_KINDS = {int(kind): kind for kind in Kind}
_STATUSES = {int(status): status for status in Status}


def max_step_of(contacts: Contacts, summary: Any) -> MaxStep:
    """Of the earliest contacts of a motion, and their v1.StepSummary, which counts what overlaps and is not among them."""
    first = None
    tois = contacts.world_tois
    if len(contacts.toi) > 0:
        # With worlds, the earliest of each are listed; without, all are at the same time.
        row = int(np.argmin(contacts.toi)) if len(tois) > 0 else 0
        a, b, c, d = contacts.v[row].tolist()
        first = Contact(_KINDS[contacts.kind.item(row)], _STATUSES[contacts.status.item(row)], (a, b, c, d), contacts.toi.item(row))
    fraction = 1.0 if contacts.earliest_toi is None else contacts.earliest_toi
    overlaps = summary.overlaps_at_start + int((contacts.status == Status.OVERLAP_AT_START).sum())
    return MaxStep(fraction, first, overlaps, contacts.statistics, contacts.worlds,
                   np.minimum(tois, 1.0) if len(tois) > 0 else tois)


def up_to(trial: Contacts, fraction: float, frame: int) -> Committed:
    """What a commit takes of a trial, by what its caller was told."""
    earliest = trial.earliest_toi if trial.earliest_toi is not None and trial.earliest_toi <= fraction else None
    counts: tuple[Optional[int], Optional[int], Optional[int], Optional[int]] = (None, None, None, None)
    if len(trial) == trial.vf + trial.ee + trial.vh:
        within = trial.toi <= fraction
        vf = within & (trial.kind == Kind.VERTEX_FACE)
        vh = within & (trial.kind == Kind.VERTEX_HALF_SPACE)
        open_ones = within & ((trial.status == Status.POSSIBLE) | (trial.status == Status.BUDGET))
        ee = within.sum() - vf.sum() - vh.sum()
        counts = (int(vf.sum()), int(ee), int(open_ones.sum()), int(vh.sum()))
    elif fraction == 1:
        counts = (trial.vf, trial.ee, trial.possible, trial.vh)
    elif earliest is None:
        counts = (0, 0, 0, 0)
    return Committed(fraction, *counts[:3], earliest, frame, counts[3])


def error_from(code: int, message: str, details: Sequence[Any] = ()) -> WarmfrontError:
    """The exception for a status, not raised. `details`: google.protobuf.Any."""
    detail = errors_pb2.ErrorDetail()
    for packed in details:
        packed.Unpack(detail)
    reason = errors_pb2.ErrorReason.Name(detail.reason).removeprefix("ERROR_REASON_") if detail.reason else ""
    return class_of(code)(
        message,
        reason=reason,
        expected_frame=detail.expected_frame if detail.HasField("expected_frame") else None,
        limit=detail.limit,
        retry_after=detail.retry_after_ms / 1000 if detail.HasField("retry_after_ms") else None,
    )
