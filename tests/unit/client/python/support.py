# SPDX-License-Identifier: Apache-2.0
"""Checks of answers that several tests of the Python client share."""
import time

import numpy as np

COLUMNS = ("kind", "status", "v", "toi", "weights", "normal", "points", "multiplicity", "stencil")


def bits(contacts):
    """All of an answer that must be the same bit for bit, with or without a resume: a value to compare."""
    columns = tuple(None if getattr(contacts, name) is None else getattr(contacts, name).tobytes() for name in COLUMNS)
    return (contacts.frame, contacts.vf, contacts.ee, contacts.possible, contacts.earliest_toi, *columns)


def contacts_hash(answers):
    """The `contacts_hash` of `warmfront detect --json`: FNV-1a over words (engine/contact_hash.h)."""
    state = 0xCBF29CE484222325

    def mix(word):
        nonlocal state
        for byte in int(word).to_bytes(8, "little"):
            state = (state ^ byte) * 0x100000001B3 & 0xFFFFFFFFFFFFFFFF

    for answer in answers:
        mix(len(answer))
        for kind, status, v, toi in zip(answer.kind, answer.status, answer.v, answer.toi):
            mix(int(kind) << 8 | int(status))
            mix(int(v[0]) << 32 | int(v[1]))
            mix(int(v[2]) << 32 | int(v[3]))
            mix(np.float64(toi).view(np.uint64))
    return f"{state:016x}"


def triangle_through_triangle(dtype=np.float64):
    """Positions before and after: the second triangle falls through the first, which stays."""
    before = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.25, 0.25, 1], [1.25, 0.25, 1], [0.25, 1.25, 1]], dtype)
    after = before.copy()
    after[3:, 2] = -1
    return before, after, np.array([[0, 1, 2], [3, 4, 5]])


def eventually(condition):
    """Waits until the condition holds."""
    for _ in range(3000):
        if condition():
            return
        time.sleep(0.01)
    raise AssertionError("not within half a minute")
