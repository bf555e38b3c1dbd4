# SPDX-License-Identifier: Apache-2.0
"""Reads and writes bulk data on the wire without extra copies. Pure functions.

protobuf's own classes copy every `bytes` field, twice when sending. A message is a sequence of tagged fields
(protobuf.dev, "Encoding"), so that a bulk field can be appended directly from an array's memory, and located in a message
as a view. Everything else goes through the generated classes.
"""
from __future__ import annotations

from collections.abc import Iterator
from typing import Union

Bytes = Union[bytes, memoryview]

VARINT = 0
FIXED64 = 1
DELIMITED = 2
FIXED32 = 5


class Malformed(Exception):
    """These bytes are not a valid message."""


def varint(value: int) -> bytes:
    """The value, >= 0, seven bits a byte, least first."""
    out = bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    out.append(value)
    return bytes(out)


def field(number: int, *pieces: Bytes) -> list[Bytes]:
    """A delimited field whose content is the pieces, to be joined with its neighbours: b"".join([...])."""
    length = sum(len(piece) for piece in pieces)
    return [varint(number << 3 | DELIMITED) + varint(length), *pieces]


def number_field(number: int, value: int) -> bytes:
    """A varint field."""
    return varint(number << 3 | VARINT) + varint(value)


def _read_varint(message: memoryview, at: int) -> tuple[int, int]:
    value = shift = 0
    while shift < 64:
        byte = message[at]
        at += 1
        value |= (byte & 0x7F) << shift
        if byte < 0x80:
            return value, at
        shift += 7
    raise Malformed("a number of more than 64 bits")


def fields(message: memoryview) -> Iterator[tuple[int, Union[int, memoryview]]]:
    """The fields of a message in order: numbers as int, delimited ones as views. Raises Malformed."""
    at = 0
    end = len(message)
    try:
        while at < end:
            tag, at = _read_varint(message, at)
            kind = tag & 7
            if kind == VARINT:
                value, at = _read_varint(message, at)
                yield tag >> 3, value
                continue
            if kind == DELIMITED:
                length, at = _read_varint(message, at)
            elif kind == FIXED64:
                length = 8
            elif kind == FIXED32:
                length = 4
            else:
                raise Malformed(f"field {tag >> 3} is of the unknown type {kind}")
            if length > end - at:
                raise Malformed(f"field {tag >> 3} goes beyond the message")
            yield tag >> 3, message[at:at + length]
            at += length
    except IndexError:
        raise Malformed("the message ends within a field") from None
