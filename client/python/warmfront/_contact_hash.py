# SPDX-License-Identifier: Apache-2.0
"""A fingerprint of answers, to compare two computations by. Pure functions."""
from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Union

import numpy as np

from .answer import Contacts
from .errors import InvalidArgumentError

# 64-bit FNV-1a, as engine/contact_hash.h.
_START = 0xCBF29CE484222325
_PRIME = 0x100000001B3
_MASK = 0xFFFFFFFFFFFFFFFF


def contacts_hash(answers: Union[Contacts, Iterable[Contacts]], before: int = _START) -> int:
    """64 bits of one answer, or of the answers of a sequence in their order: equal where the contacts are the same, bit for bit.

    The number of rows of each answer, and of each row its kind, status, vertices and toi; of a reduced answer its multiplicity
    and stencil, too. Not the fields, the statistics and the number of the frame. The same number in this process, through a
    daemon, of `ContactHash` in C++ (engine/contact_hash.h) and, as `f"{contacts_hash(answers):016x}"`, of the `contacts_hash` of
    `warmfront detect --json` where it makes the same steps. Of report "count", which lists nothing, it says only how many
    steps there were.

    before: the hash of what came before, so that a long sequence need not be held: `h = contacts_hash(answer, h)`.

    Computed here, some 50 ns a contact; without an engine in this package (see `has_engine()`) in Python, some microseconds.
    InvalidArgumentError for what is no `Contacts`, and for a `before` that is no such number. Any thread may call it.
    """
    if isinstance(before, bool) or not isinstance(before, (int, np.integer)) or not 0 <= before <= _MASK:
        raise InvalidArgumentError(f"before: {before!r} is no hash; give what contacts_hash() returned, or leave it out")
    if isinstance(answers, Contacts):
        answers = [answers]
    if not isinstance(answers, Iterable):
        raise InvalidArgumentError(f"answers: a {type(answers).__name__}; give what step(), trial() or proximity() returned")
    value = int(before)
    mix = _mixer()
    for index, answer in enumerate(answers):
        if not isinstance(answer, Contacts):
            raise InvalidArgumentError(f"answers[{index}]: a {type(answer).__name__}; give what step(), trial() or proximity() "
                                       "returned, and of a batch its contacts")
        columns = [None if column is None else np.ascontiguousarray(column, dtype) for column, dtype in (
            (answer.kind, "u1"), (answer.status, "u1"), (answer.v, "<u4"), (answer.toi, "<f8"), (answer.multiplicity, "<u4"),
            (answer.stencil, "u1"))]
        value = mix(value, *columns)
    return value


def _mixer() -> Any:
    try:
        from . import _engine
    except ImportError:
        return mix_in_python
    return _engine.hash_after


def mix_in_python(value: int, kind: Any, status: Any, v: Any, toi: Any, multiplicity: Any, stencil: Any) -> int:
    """What the engine's does, for packages without one."""
    words = np.empty((len(kind), 4), np.uint64)
    words[:, 0] = kind.astype(np.uint64) << np.uint64(8) | status
    words[:, 1:3] = v[:, 0::2].astype(np.uint64) << np.uint64(32) | v[:, 1::2]
    words[:, 3] = np.require(toi, requirements="A").view(np.uint64)
    data = len(kind).to_bytes(8, "little") + words.astype("<u8").tobytes()
    if multiplicity is not None:
        data += (stencil.astype(np.uint64) << np.uint64(32) | multiplicity).astype("<u8").tobytes()
    for byte in data:
        value = (value ^ byte) * _PRIME & _MASK
    return value
