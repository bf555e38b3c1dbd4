# SPDX-License-Identifier: Apache-2.0
"""What is asked of a frame, as a caller says it and as it travels. Immutable."""
from __future__ import annotations

import math
import re
from collections.abc import Collection
from dataclasses import dataclass
from typing import Any, Literal, Optional, get_args

import numpy as np

from .errors import InvalidArgumentError
from .options import ContactField, Options, Report, Tier
from .v1 import step_pb2

QuestionKind = Literal["step", "trial", "max_step", "commit", "proximity", "intersections", "place"]
#: The state that a question without a motion is asked of.
Where = Literal["base", "trial_end"]

_KINDS = {
    "step": step_pb2.Question.KIND_STEP,
    "trial": step_pb2.Question.KIND_TRIAL,
    "max_step": step_pb2.Question.KIND_MAX_STEP,
    "proximity": step_pb2.Question.KIND_PROXIMITY,
    "intersections": step_pb2.Question.KIND_INTERSECTIONS,
    "place": step_pb2.Question.KIND_PLACE,
}
_UUID = re.compile(r"[0-9a-fA-F]{8}(-[0-9a-fA-F]{4}){3}-[0-9a-fA-F]{12}")
_WHERES = {"base": step_pb2.Question.WHERE_BASE, "trial_end": step_pb2.Question.WHERE_TRIAL_END}


@dataclass(frozen=True)
class Question:
    """kind: see `Session`. content: a v1.Question, serialized; empty for a step as the session has it. fields: the columns
    that are asked for besides those that are always told; None for the session's."""

    kind: QuestionKind
    content: bytes = b""
    fields: Optional[tuple[str, ...]] = None
    of_trial_end: bool = False
    by_vertex: bool = False  # answered by a number a vertex
    reduced: bool = False
    keeps_distance: bool = False

    @property
    def method(self) -> str:
        """Of a session, that asks it."""
        return "vertex_distances" if self.by_vertex else self.kind

    @property
    def is_trial(self) -> bool:
        """Whether its motion may be committed."""
        return self.kind in ("trial", "max_step")

    @property
    def counts(self) -> bool:
        """Whether the session is at its frame's end from then on."""
        return self.kind in ("step", "place")


# Questions that were made before, by their arguments.
_MADE: dict[Any, Question] = {}
_MOST_KEPT = 256


def question_of(
    kind: QuestionKind,
    *,
    tier: Optional[Tier] = None,
    tolerance: Optional[float] = None,
    min_separation: Optional[float] = None,
    report: Optional[Report] = None,
    fields: Optional[Collection[ContactField]] = None,
    max_contacts: Optional[int] = None,
    leave_out_overlaps: bool = False,
    where: Optional[Where] = None,
    keep_distance: Optional[float] = None,
    reduced: bool = False,
) -> Question:
    """InvalidArgumentError for what the contract has no word for, and for what does not go together."""
    # A solver asks the same few questions, and a step of a small scene takes no longer than reading all options. With the types
    # of numbers: 5.0 is refused where 5 is not.
    if fields is not None and not isinstance(fields, str):
        try:
            fields = tuple(fields)
        except TypeError:
            raise InvalidArgumentError(f"fields: {fields!r}; give names of fields") from None
    key = (kind, tier, tolerance, min_separation, report, fields, max_contacts, leave_out_overlaps, where, keep_distance, reduced,
           type(tolerance), type(min_separation), type(max_contacts), type(keep_distance))
    try:
        made = _MADE.get(key)
    except TypeError:  # what has no hash is no option either, and is refused below
        return _made_of(*key[:11])
    if made is None:
        made = _made_of(*key[:11])
        if len(_MADE) >= _MOST_KEPT:
            _MADE.clear()
        _MADE[key] = made
    return made


def _made_of(kind: QuestionKind, tier: Any, tolerance: Any, min_separation: Any, report: Any, fields: Any, max_contacts: Any,
             leave_out_overlaps: bool, where: Any, keep_distance: Any, reduced: bool) -> Question:
    if kind not in _KINDS:
        raise InvalidArgumentError(f"kind: {kind!r} is none of {', '.join(get_args(QuestionKind))}")
    if kind == "max_step" and (report is not None or fields is not None):
        raise InvalidArgumentError("max_step: it tells the first contact alone; give no report and no fields")
    if leave_out_overlaps and kind != "max_step":
        raise InvalidArgumentError(f"leave_out_overlaps: it is of max_step alone, and not of a {kind}")
    of_state = kind in ("proximity", "intersections")
    if where is not None and not (of_state and where in _WHERES):
        raise InvalidArgumentError(f"where: {where!r} is none of {', '.join(_WHERES)}" if of_state else
                                   f"where: it is of proximity and intersections alone, and not of a {kind}")
    if keep_distance is not None and kind != "max_step":
        raise InvalidArgumentError(f"keep_distance: it is of max_step alone, and not of a {kind}")
    if reduced and kind != "proximity":
        raise InvalidArgumentError(f"reduced: it is of proximity alone, and not of a {kind}")
    if reduced and report == "vertex-distances":
        raise InvalidArgumentError("reduced: report \"vertex-distances\" lists no pairs; leave it out, or use \"all\"")
    options = Options(tier=tier, tolerance=tolerance, min_separation=min_separation, report=report, max_contacts=max_contacts,
                      fields=fields or ())
    message = step_pb2.Question()
    options.put_into(message, where="")
    if fields is not None:
        message.fields.SetInParent()  # none of them is an answer too
    if leave_out_overlaps:
        message.leave_out_overlaps = True
    if where is not None:
        message.where = _WHERES[where]
    if keep_distance is not None:
        message.keep_distance = share_of(keep_distance)
    if reduced:
        message.reduced = True
    # A step without more to say is what daemons took before there were questions.
    if kind != "step" or message.ByteSize() > 0:
        message.kind = _KINDS[kind]
    columns: Optional[tuple[str, ...]] = () if kind == "max_step" else None
    if fields is not None:
        columns = (fields,) if isinstance(fields, str) else tuple(fields)
    return Question(kind, message.SerializeToString(), columns, where == "trial_end", report == "vertex-distances",
                    bool(reduced), keep_distance is not None)


def number_of(value: Any, name: str, wanted: str) -> float:
    """InvalidArgumentError for what is no number: a text that reads as one, and a truth value, are none."""
    try:
        if isinstance(value, (str, bytes, bool, np.bool_)):
            raise TypeError
        return float(value)
    except (TypeError, ValueError):
        raise InvalidArgumentError(f"{name}: {value!r} is no number; give {wanted}") from None


def distance_of(distance: float) -> float:
    """InvalidArgumentError unless it is a finite number, 0 or more."""
    value = number_of(distance, "distance", "a length, 0 or more")
    if not 0 <= value < math.inf:
        raise InvalidArgumentError(f"distance: {value!r} is not a finite length >= 0")
    return value


def share_of(keep_distance: float) -> float:
    """InvalidArgumentError unless it is a number in (0, 1)."""
    value = number_of(keep_distance, "keep_distance", "one in (0, 1)")
    if not 0 < value < 1:
        raise InvalidArgumentError(f"keep_distance: {value!r} is not in (0, 1)")
    return value


def fraction_of(fraction: float) -> float:
    """InvalidArgumentError unless it is a number in [0, 1]."""
    value = number_of(fraction, "fraction", "one in [0, 1]")
    if not 0 <= value <= 1:
        raise InvalidArgumentError(f"fraction: {value!r} is not in [0, 1]")
    return value


def frame_number_of(number: int) -> int:
    """InvalidArgumentError unless it is a whole number in [0, 2^63)."""
    if isinstance(number, (bool, str, bytes)) or not hasattr(number, "__index__") or not 0 <= int(number) < 1 << 63:
        raise InvalidArgumentError(f"first_frame: {number!r} is not a whole number in [0, 2^63)")
    return int(number)


def session_id_of(given: str) -> str:
    """InvalidArgumentError unless it is a UUID, or empty."""
    if not isinstance(given, str) or (given and not _UUID.fullmatch(given)):
        raise InvalidArgumentError(f"session_id: a UUID of 8-4-4-4-12 hexadecimal digits is expected, got "
                                   f"{len(str(given).encode(errors='replace'))} bytes; choose a random one for each session")
    return given
