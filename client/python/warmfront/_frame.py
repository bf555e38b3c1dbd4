# SPDX-License-Identifier: Apache-2.0
"""A request as it travels: its messages, made once, and its bulk fields as views into them. Immutable.

An array's memory is copied once, into its message; the same bytes are used to resend a frame after a resume and to create
a session again.
"""
from __future__ import annotations

from collections.abc import Sequence
from struct import pack
from typing import Optional, Union

import numpy as np

from ._memory import Block, SharedRegion
from ._question import Question, QuestionKind
from ._wire import FIXED64, Bytes, field, fields, number_field, varint

# Of v1.StreamStepsRequest, v1.StepFrame and v1.MovedParts.
_STEP, _COMMIT = 1, 4
_FRAME, _POSITIONS, _MORE, _MOVED, _QUESTION, _SHARED_POSITIONS, _ANSWER_ROOM, _SHARED_MOVED = 1, 2, 3, 4, 5, 6, 7, 8
_OFFSET, _LENGTH = 1, 2  # of v1.SharedBytes
_COMMIT_FRAME, _COMMIT_FRACTION = 1, 2
BODIES, BODY_POSITIONS, POSE_BODIES, POSES, VERTICES, VERTEX_POSITIONS = 1, 2, 3, 4, 5, 6

Part = tuple[int, Bytes]  # the number of a field, and its bytes

_WORTH_SHARING = 4096  # bytes of what moved: less is as well off in a message


class SentFrame:
    """Either all positions, or what moved; a step, or another question."""

    def __init__(self, number: int, positions: Optional[Bytes], moved: Sequence[Part], chunk_bytes: int,
                 question: Question = Question("step"), block: Optional[Block] = None) -> None:
        """Without positions the frame carries `moved`, fields of v1.MovedParts. No message holds more than `chunk_bytes`
        of bulk. block: where the positions are, in memory that the daemon sees: messages are made when they are needed then."""
        self.number = number
        self.question = question
        self.whole = positions is not None
        self.room: Optional[Block] = None  # where its answer may be put
        self._block = block
        self.moved_block: Optional[Block] = None  # a copy of what moved, until the answer
        self.messages: list[bytes] = []  # v1.StreamStepsRequest, serialized
        self._chunk_bytes = chunk_bytes
        parts = [(_POSITIONS, positions)] if positions is not None else moved
        self._pieces: dict[int, list[memoryview]] = {part: [] for part, _ in parts}
        if block is not None and positions is not None:
            self._pieces[_POSITIONS].append(memoryview(positions))
            return
        if sum(len(data) for _, data in parts) <= chunk_bytes:
            self._add(parts, False)
            return
        # Field by field, chunk by chunk; an empty last part ends the frame.
        for part, data in parts:
            view = memoryview(data)
            for at in range(0, len(view), chunk_bytes):
                self._add([(part, view[at:at + chunk_bytes])], True)
        self._add([], False)

    def fitted(self, chunk_bytes: int) -> SentFrame:
        """This frame, rebuilt with smaller messages if a daemon requires them."""
        if chunk_bytes >= self._chunk_bytes:
            return self
        return self.asked(self.question, chunk_bytes)

    def to_send(self, region: Optional[SharedRegion], room: int, moved: bool) -> list[bytes]:
        """Its messages. region: that the daemon sees, where `room` bytes are kept for the answer, if there are any. moved: does
        the daemon take what moved from there too?"""
        self.room = None if region is None else region.take(room)
        tail = [] if self.room is None else field(_ANSWER_ROOM, _place_of(self.room))
        shared: list[Bytes] = []
        if self._block is not None and region is self._block.region:
            shared = field(_SHARED_POSITIONS, _place_of(self._block))
        elif region is not None and moved and not self.whole:
            shared = self._share_moved(region)
        if shared:
            head = number_field(_FRAME, self.number)
            if self.question.content:
                head += b"".join(field(_QUESTION, self.question.content))
            return [b"".join(field(_STEP, head, *shared, *tail))]
        if not self.messages:  # the daemon does not see the block
            self.room = None
            return SentFrame(self.number, self.positions(), [], self._chunk_bytes, self.question).messages
        if self.room is None or len(self.messages) > 1:
            self.room = None
            return self.messages
        _, content = next(fields(memoryview(self.messages[0])))
        assert isinstance(content, memoryview)
        return [b"".join(field(_STEP, content, *tail))]

    def _share_moved(self, region: SharedRegion) -> list[Bytes]:
        """Puts what moved there; a field of v1.StepFrame that says where, or none where it is to be in messages."""
        size = sum(len(piece) for pieces in self._pieces.values() for piece in pieces)
        self.moved_block = region.take(size) if size >= _WORTH_SHARING else None
        if self.moved_block is None:
            return []
        places: list[Bytes] = []
        at = 0
        for part, pieces in self._pieces.items():
            begin = at
            for piece in pieces:
                self.moved_block.data[at:at + len(piece)] = np.frombuffer(piece, np.uint8)
                at += len(piece)
            if at > begin:
                places += field(part, _place(self.moved_block.offset + begin, at - begin))
        return field(_SHARED_MOVED, *places)

    def asked(self, question: Question, chunk_bytes: int) -> SentFrame:
        """Another question of the same frame."""
        positions = self.positions() if self.whole else None
        moved = [] if self.whole else [(part, self.bytes_of(part)) for part in self._pieces]
        return SentFrame(self.number, positions, moved, chunk_bytes, question, self._block)

    @property
    def kind(self) -> QuestionKind:
        return self.question.kind

    @property
    def counts(self) -> bool:
        """Whether its answer moves the session to its number."""
        return self.question.counts

    @property
    def is_trial(self) -> bool:
        """Whether it may be committed."""
        return self.question.is_trial

    @property
    def needs_trial(self) -> bool:
        """Whether it is about the last trial."""
        return self.question.of_trial_end

    def positions(self) -> Bytes:
        """All of them; a view if they are in one message."""
        return self.bytes_of(_POSITIONS)

    def bytes_of(self, part: int) -> Bytes:
        """A field of v1.MovedParts; empty if it was not given."""
        pieces = self._pieces.get(part, [])
        return pieces[0] if len(pieces) == 1 else b"".join(pieces)

    def _add(self, parts: Sequence[Part], more: bool) -> None:
        """Adds one message and records the position of each part in it."""
        bulk = [field(part, data) for part, data in parts]
        content = [piece for tagged in bulk for piece in tagged]
        if not self.whole:
            content = field(_MOVED, *content)
        head = number_field(_FRAME, self.number) + (number_field(_MORE, 1) if more else b"")
        if self.question.content and not self.messages:
            head += b"".join(field(_QUESTION, self.question.content))
        message = b"".join(field(_STEP, head, *content))
        self.messages.append(message)
        # The bulk is at the end of the message.
        end = len(message)
        for (part, data), (tag, _) in zip(reversed(parts), reversed(bulk)):
            self._pieces[part].append(memoryview(message)[end - len(data):end])
            end -= len(data) + len(tag)


class SentCommit:
    """Takes the last trial, up to a fraction of its way."""

    kind: QuestionKind = "commit"
    counts = True
    is_trial = False
    needs_trial = True
    room: Optional[Block] = None  # its answer has no rows
    moved_block: Optional[Block] = None

    def __init__(self, number: int, fraction: float) -> None:
        self.number = number
        self.fraction = fraction
        content = number_field(_COMMIT_FRAME, number) + varint(_COMMIT_FRACTION << 3 | FIXED64) + pack("<d", fraction)
        self.messages = [b"".join(field(_COMMIT, content))]

    def fitted(self, chunk_bytes: int) -> SentCommit:
        """It fits everywhere."""
        return self

    def to_send(self, region: Optional[SharedRegion], room: int, moved: bool) -> list[bytes]:
        """As SentFrame's."""
        return self.messages


def _place_of(block: Block) -> bytes:
    return _place(block.offset, block.size)


def _place(offset: int, length: int) -> bytes:
    """A v1.SharedBytes."""
    return number_field(_OFFSET, offset) + number_field(_LENGTH, length)


Request = Union[SentFrame, SentCommit]
