# SPDX-License-Identifier: Apache-2.0
"""Creating, attaching and resuming a session, by the rules of the C++ client. Used by one thread at a time."""
from __future__ import annotations

import time
from collections import deque
from typing import NoReturn, Optional

from ._connection import Connection
from ._contacts import AnswerPart
from ._frame import SentFrame
from ._state import SceneState, raw
from ._stream import StepStream
from .errors import Aborted, DeadlineExceeded, Unavailable, WarmfrontError, lost_session_or_daemon
from .v1 import session_pb2, step_pb2

_FIRST_BACKOFF = 0.05
_LONGEST_BACKOFF = 2.0
# One message of positions: large enough to be fast, small enough not to hold up other streams of the connection.
_FRAME_CHUNK = 4 << 20
# What a message has besides its bulk field.
_MESSAGE_OVERHEAD = 1024


class Link:
    """A session's stream, and everything needed to create the session again: the scene, the positions last answered, the
    frames unanswered. A frame leaves `unanswered` only when its answer is complete, so each gets exactly one."""

    def __init__(self, connection: Connection, header: session_pb2.SessionHeader, state: SceneState) -> None:
        self.connection = connection
        self.header = header  # first_frame: the frame last answered
        self.state = state  # at that frame
        self.unanswered: deque[SentFrame] = deque()
        self.sent = 0  # of these, on the present stream
        self.partial: list[AnswerPart] = []  # the chunks so far of the oldest unanswered frame
        self.stream: Optional[StepStream] = None
        self.window = 1
        self.chunk_bytes = _FRAME_CHUNK  # of positions in one message
        self.draining = False
        self.recreate = False  # what the daemon has may not be this scene
        self.resumes = 0
        self.resumes_without_answer = 0
        self.failed: Optional[WarmfrontError] = None  # for good
        self._expected = 0  # by the daemon, as it said when the stream was attached

    @property
    def session_id(self) -> str:
        return str(self.header.session_id)

    @property
    def asked_fields(self) -> list[str]:
        """Columns of contacts besides those that are always told."""
        return [descriptor.name for descriptor, wanted in self.header.options.fields.ListFields() if wanted]

    def open(self) -> None:
        """Creates the session in the daemon and attaches to it."""
        try:
            self._create()
        except WarmfrontError as error:
            # With the connection lost it may have been created all the same: establish() finds out.
            if not lost_session_or_daemon(error):
                self.fail(error)
        self.establish()

    def resume(self, why: WarmfrontError) -> None:
        """After the stream was lost. Raises when the session has failed for good."""
        self.drop_stream()
        if not lost_session_or_daemon(why):
            self.fail(why)
        if self.resumes_without_answer >= self.connection.patience.resumes_without_answer:
            self.fail(Unavailable(f"gave up after {self.resumes_without_answer} resumes without an answer to frame "
                                  f"{self.unanswered[0].number}: {why.message}"))
        self.resumes_without_answer += 1
        self.resumes += 1
        self.establish()

    def establish(self) -> None:
        """Attaches, creating the session anew where it is unknown or too far ahead; tries until the resume timeout."""
        deadline = time.monotonic() + self.connection.patience.resume
        backoff = _FIRST_BACKOFF
        while True:
            try:
                # gRPC connects only while a call waits for it: this one does, and a stream must not wait forever.
                self.connection.server_info(max(deadline - time.monotonic(), 0.001), self.session_id)
                self._try_establish()
                return
            except WarmfrontError as error:
                self.drop_stream()
                if not lost_session_or_daemon(error):
                    self.fail(error)
                if time.monotonic() + backoff >= deadline:
                    self.fail(Unavailable(f"session {self.session_id} could not be resumed within the resume timeout: "
                                          f"{error.message}"))
            time.sleep(backoff)
            backoff = min(2 * backoff, _LONGEST_BACKOFF)

    def fail(self, error: WarmfrontError) -> NoReturn:
        """Raises the error, now and at every further call."""
        if self.failed is None:
            self.failed = error
        self.drop_stream()
        self.unanswered.clear()
        raise self.failed

    def drop_stream(self) -> None:
        if self.stream is not None:
            self.stream.close()
        self.stream = None

    def remove(self) -> None:
        """Deletes the session in the daemon; gone is gone."""
        try:
            self.connection.remove(self.session_id)
        except WarmfrontError as error:
            if error.reason != "SESSION_NOT_FOUND":
                raise

    def _try_establish(self) -> None:
        if self.recreate:
            self.remove()
            self.recreate = False
        due = self.header.first_frame + 1
        try:
            self._attach()
            known = self._expected == due or (self._expected == due + 1 and len(self.unanswered) > 0)
            if not known:
                # Answers to more than one frame were lost, and the daemon keeps only the last: start over from what was
                # answered.
                self.drop_stream()
                self.remove()
        except WarmfrontError as error:
            if error.reason != "SESSION_NOT_FOUND":
                raise
            known = False
        if not known:
            self.drop_stream()
            try:
                self._create()
            except WarmfrontError as error:
                if error.reason != "SESSION_EXISTS":
                    raise
            self._attach()
            if self._expected != due:
                raise Aborted(f"session {self.session_id} is stepped by someone else as well", reason="SESSION_ATTACHED")
        # What the daemon answered already comes again from its memory, and the rest follows.
        self.sent = 0
        self.partial = []
        self.draining = False

    def _create(self) -> None:
        self.state.describe(self.header)
        self.connection.create(self.header, raw(self.state.faces), self.state.positions())

    def _attach(self) -> None:
        self.stream = StepStream(self.connection, self.session_id)
        request = step_pb2.StreamStepsRequest()
        request.attach.session_id = self.session_id
        # The stream before may not have been noticed to be dead yet.
        request.attach.takeover = True
        self.stream.write(request.SerializeToString())
        try:
            # Frames of the stream before may still be computed: the answer comes after them.
            response = self.stream.read(self.connection.patience.answer)
        except DeadlineExceeded as error:
            if error.reason:
                raise
            raise Unavailable("no daemon answers") from None
        if isinstance(response, AnswerPart) or not response.HasField("attached"):
            raise Unavailable("the daemon is draining")
        self._expected = response.attached.expected_frame
        limits = response.attached.limits
        self.window = max(limits.window, 1)
        self.chunk_bytes = min(max(limits.max_message_bytes, 2 * _MESSAGE_OVERHEAD), _FRAME_CHUNK) - _MESSAGE_OVERHEAD
