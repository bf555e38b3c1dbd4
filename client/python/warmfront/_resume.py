# SPDX-License-Identifier: Apache-2.0
"""Creating, attaching and resuming a session, with the same rules as the C++ client. Used by one thread at a time."""
from __future__ import annotations

import logging
import time
import uuid
from collections import deque
from typing import Any, NoReturn, Optional

from ._connection import Connection
from ._contacts import AnswerPart
from ._frame import Request, SentFrame
from ._memory import SharedRegion, room_of
from ._question import question_of
from ._state import SceneState, raw
from ._stream import StepStream
from .answer import Contacts
from .errors import (AbortedError, DeadlineExceededError, ResourceExhaustedError, UnauthenticatedError, UnavailableError,
                     WarmfrontError, may_resume, other_state)
from .options import Options
from .v1 import session_pb2, step_pb2

_log = logging.getLogger("warmfront")

_FIRST_BACKOFF = 0.05
_LONGEST_BACKOFF = 2.0
# Positions per message: large enough to be fast, small enough not to delay the connection's other streams.
_FRAME_CHUNK = 4 << 20
_LEAST_ROOM = 1 << 16
_ANSWERS = 4  # the last trial's, the one under way, and two that the caller may have
_MOST_POSITIONS = 256 << 20
# Bytes of a message besides its bulk field.
_MESSAGE_OVERHEAD = 1024


class TimeUp(Exception):
    """`Link.deadline` has passed."""


class Link:
    """A session's stream, and everything needed to create the session again: the scene, the positions last answered, the
    requests unanswered. One leaves `unanswered` only when its answer is complete, so that each gets exactly one."""

    def __init__(self, connection: Connection, header: session_pb2.SessionHeader, state: SceneState, options: Options,
                 traceparent: str) -> None:
        """traceparent: of its frames; empty: as the connection's."""
        self.connection = connection
        self.traceparent = traceparent
        self.options = options  # as given; as they travel, in the header
        self.header = header  # first_frame: the last answered frame; first_revision: changes made
        self.state = state  # at that frame
        # The session's state as the daemon last reported it (v1.SessionState); with `state`, its whole identity. None
        # if the daemon is too old to report it.
        self.known: Optional[Any] = None
        self.unanswered: deque[Request] = deque()
        self.sent = 0  # of these, on the present stream
        self.partial: list[AnswerPart] = []  # the chunks so far of the oldest unanswered request
        # The trial that was answered last, as long as it may be committed, and its answer.
        self.trial: Optional[tuple[SentFrame, Contacts]] = None
        self.may_commit = False  # what was submitted last is a trial, answered or on its way, or its commit failed
        # The trial, where the stream begins with a commit of it: another copy of the session must be asked it first. It
        # only counts contacts, so that it cannot exceed a limit on listed ones; this second answer is dropped.
        self.echo: Optional[SentFrame] = None
        self.echo_sent = False
        self.echo_error: Optional[WarmfrontError] = None
        self.deadline: Optional[float] = None  # of what is waited for, by time.monotonic()
        self.trouble = ""  # why the session could not be resumed when it was last tried
        self.stream: Optional[StepStream] = None
        self.client_id = str(uuid.uuid4())  # of this object: orders its streams
        self._attach_attempts = 0
        self.window = 1
        self.chunk_bytes = _FRAME_CHUNK  # of positions in one message
        # In memory that the daemon shares: for an answer there is `room`, and `wanted_room` would have been enough.
        self.room = self.wanted_room = _LEAST_ROOM
        self.draining = False
        self.recreate = False  # the daemon's copy is not this session
        self.changing = False  # a change was sent and is not yet answered
        self.resumes = 0
        self.resumes_without_answer = 0
        self.failed: Optional[WarmfrontError] = None  # for good
        self._ahead = False  # the daemon's copy carried out what was sent first, and its answer was lost
        self._attached = step_pb2.Attached()  # what the daemon said when the stream was attached

    @property
    def session_id(self) -> str:
        return str(self.header.session_id)

    @property
    def asked_fields(self) -> list[str]:
        """The optional columns of contacts."""
        return [descriptor.name for descriptor, wanted in self.header.options.fields.ListFields() if wanted]

    @property
    def region(self) -> Optional[SharedRegion]:
        """Memory that the daemon shares; None where it does not."""
        return None if self.stream is None else self.stream.region

    @property
    def shares_moved(self) -> bool:
        """Does the daemon take what moved from that memory too? An older one takes whole frames alone."""
        return bool(self._attached.shared_memory.moved)

    def enlarge_rooms(self) -> None:
        """Where answers turned out longer than their room, more memory is asked for between two frames."""
        if self.wanted_room <= self.room or self.unanswered or self.stream is None or self.stream.region is None:
            return
        # For one that is somewhat longer.
        self.room = self.wanted_room = 1 << (3 * self.wanted_room // 2 + 1024).bit_length()
        self.stream.ask_for_memory(self._memory_for(self.room))

    def time_left(self, most: float) -> float:
        """Seconds, `most` at most. TimeUp when there are none."""
        if self.deadline is None:
            return most
        left = self.deadline - time.monotonic()
        if left <= 0:
            raise TimeUp()
        return min(left, most)

    def open(self) -> None:
        """Creates the session in the daemon and attaches to it."""
        try:  # an upload may wait for minutes: a daemon that is not there is missed sooner
            self.connection.wait_for_daemon(self.session_id)
        except WarmfrontError as error:
            self.fail(error)
        try:
            self._create()
        except WarmfrontError as error:
            if error.retry_after is not None or not may_resume(error):
                self.fail(error)
            # If the connection was lost, the session may have been created nevertheless, in an unknown state.
            self.recreate = True
        try:
            self._establish(waits=False)
        except ResourceExhaustedError:
            # The created session will not be used: delete it.
            try:
                self.remove()
            except WarmfrontError:
                pass
            raise

    def resume(self, why: WarmfrontError) -> None:
        """After the stream was lost. Raises when the session has failed for good, or was closed by another thread; TimeUp when
        `deadline` passes."""
        # Neither by this client, nor with a daemon that answers.
        lost = (self.stream is not None and not self.recreate and not self.connection.closed
                and isinstance(why, UnavailableError) and why.reason in ("", "DRAINING"))
        self.drop_stream()
        if self.failed is not None:
            raise self.failed
        if isinstance(why, UnauthenticatedError):
            self.fail(why.said_with("", "; the session has ended: connect with another token, and make it again of its `positions`"))
        if not may_resume(why):
            self.fail(why)
        if self.resumes_without_answer >= self.connection.timeouts.resumes_without_answer:
            what = "a change" if self.changing else f"frame {self.unanswered[0].number}"
            self.fail(UnavailableError(f"gave up after {self.resumes_without_answer} resumes without an answer to {what}: "
                                       f"{why.message}"))
        # Unary calls use another connection than the stream: they may fail each time though a stream attaches.
        if self.resumes_without_answer > 0:
            time.sleep(self.time_left(min(_FIRST_BACKOFF * 2 ** min(self.resumes_without_answer - 1, 10), _LONGEST_BACKOFF)))
        self.resumes_without_answer += 1
        self.resumes += 1
        if lost:
            _log.warning("session %s: the daemon is lost (%s); looking for it for up to %g s", self.session_id, why.message,
                         self.connection.timeouts.resume)
        if other_state(why):
            self.recreate = True
        self._establish(waits=True)
        if lost:
            _log.warning("session %s goes on after frame %d", self.session_id, self.header.first_frame)

    def _establish(self, waits: bool) -> None:
        """Attaches to the session where it is in this session's state, else creates it again; tries until the resume
        timeout. waits: where the daemon is full of other sessions, wait for room."""
        deadline = time.monotonic() + self.connection.timeouts.resume
        backoff = _FIRST_BACKOFF
        while True:
            try:
                # gRPC connects only while a call waits for it: this one does, and a stream must not wait forever.
                self.connection.find_daemon(self.time_left(max(deadline - time.monotonic(), 0.001)), self.session_id)
                self._try_establish()
                if self.failed is not None:  # closed meanwhile by another thread: leave nothing behind
                    self.remove()
                    self.fail(self.failed)
                self.trouble = ""
                return
            except WarmfrontError as error:
                self.drop_stream()
                self.trouble = error.message
                if self.failed is not None:
                    raise self.failed from None
                ended = "; it has ended: make another one, of its `positions`" if waits else ""
                if not may_resume(error) or (error.retry_after is not None and not waits):
                    # A daemon that came in place of the one before may not allow for as much.
                    self.fail(error.said_with(f"session {self.session_id} could not be resumed: ", ended) if waits else error)
                wait = max(backoff, error.retry_after or 0)
                self.time_left(wait)
                if time.monotonic() + wait >= deadline:
                    self.fail(self.connection.not_in_time(self.session_id, "resumed" if waits else "made", error, ended))
            time.sleep(self.time_left(wait))
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

    def cancel_stream(self) -> None:
        """From any thread: a waiting read then raises."""
        stream = self.stream
        if stream is not None:
            stream.close()

    def remove(self) -> None:
        """Deletes the session in the daemon; a missing session is not an error."""
        try:
            self.connection.remove(self.session_id)
        except WarmfrontError as error:
            if error.reason != "SESSION_NOT_FOUND":
                raise

    def _try_establish(self) -> None:
        if not self.recreate:
            try:
                self._attach()
                if self._attached_is_own():
                    self._begin_stream()
                    return
                # The copy is behind, or more than one answer was lost: the daemon caches only the last.
                self.recreate = True
            except WarmfrontError as error:
                if error.reason != "SESSION_NOT_FOUND":
                    raise
        self.drop_stream()
        if self.recreate:
            self.remove()
            self.recreate = False
        try:
            self._create()
        except WarmfrontError as error:
            # Consecutive calls may reach different daemons: check the copy there in the next try.
            if error.reason == "SESSION_EXISTS":
                raise AbortedError(error.message, reason="STATE_CHANGED") from None
            raise
        self._attach()
        if not self._attached_is_own() and not self._attached_as_created():
            raise AbortedError(f"session {self.session_id} is not in the state that it was just created in: it is used by "
                               "someone else as well, or calls lead to different daemons", reason="STATE_CHANGED")
        self._begin_stream()

    def _begin_stream(self) -> None:
        """The daemon repeats cached answers; the remaining frames follow."""
        self.sent = 0
        self.partial = []
        self.draining = False
        self._share_memory()
        needed = len(self.unanswered) > 0 and self.unanswered[0].needs_trial
        self.echo = None
        if needed and not self._ahead and self.trial is not None:
            self.echo = self.trial[0].asked(question_of("trial", report="count"), self.chunk_bytes)
        self.echo_sent = False
        self.echo_error = None

    def _share_memory(self) -> None:
        """Has messages go by packets, and memory shared, where the daemon offers it."""
        path = self.connection.memory_socket
        if path is None or self.stream is None or not self._attached.HasField("shared_memory"):
            return
        self.room = self.wanted_room
        self.stream.share(path, self.session_id, self._attached.shared_memory.token, self._memory_for(self.room))

    def _memory_for(self, room: int) -> int:
        """Of the last frame's positions, the last trial's, and those under way; and of answers with so much room each."""
        positions = room_of(len(self.state.positions()))
        frames = min(max(_MOST_POSITIONS // positions, 2), 4)
        return int(frames * positions + _ANSWERS * room_of(room))

    def _attached_is_own(self) -> bool:
        """Is the attached copy in the state `known`, or ahead of it by unanswered requests?"""
        attached = self._attached
        self._ahead = False
        if self.known is None or not attached.HasField("state"):
            return False
        if attached.state == self.known:
            return True
        if not attached.HasField("state_before") or attached.state_before != self.known:
            return False
        # Ahead by one: by a frame, whose content the daemon compares when it is sent again, or by a change, whose key
        # it compares.
        if attached.state.frame == self.known.frame:
            return self.changing
        # A trial cannot be asked of it any more.
        first = self.unanswered[0] if self.unanswered else None
        self._ahead = first is not None and first.counts and first.number == attached.state.frame
        return self._ahead

    def _attached_as_created(self) -> bool:
        """The daemon's copy was just created, and the daemon does not report its state."""
        return (self.known is None and not self._attached.HasField("state")
                and self._attached.expected_frame == self.header.first_frame + 1)

    def _create(self) -> None:
        self.state.describe(self.header)
        self.known = None
        thickness = [] if self.state.thickness is None else [("thickness", raw(self.state.thickness))]
        arrays = [("faces", raw(self.state.faces)), ("edges", raw(self.state.edges)), ("positions", self.state.positions()), *thickness,
                  *((name, raw(array)) for name, array in self.state.filters.arrays())]
        session = self.connection.create(self.header, arrays, self.time_left(self.connection.timeouts.create)).session
        if session.HasField("state"):
            self.known = session.state

    def _attach(self) -> None:
        self.stream = StepStream(self.connection, self.session_id, self.traceparent)
        request = step_pb2.StreamStepsRequest()
        request.attach.session_id = self.session_id
        # The daemon may not have noticed yet that the previous stream is dead.
        request.attach.takeover = True
        # Nor whether it was given up before this one: without this it could take over from it, coming late.
        request.attach.client_id = self.client_id
        self._attach_attempts += 1
        request.attach.attempt = self._attach_attempts
        self.stream.write(request.SerializeToString())
        try:
            # Frames of the stream before may still be computed: the answer comes after them.
            response = self.stream.read(self.time_left(self.connection.timeouts.answer))
        except DeadlineExceededError as error:
            if error.reason:
                raise
            raise UnavailableError("no daemon answers") from None
        if isinstance(response, AnswerPart) or not response.HasField("attached"):
            raise UnavailableError("the daemon is draining")
        self._attached = response.attached
        limits = self._attached.limits
        self.window = max(limits.window, 1)
        self.chunk_bytes = min(max(limits.max_message_bytes, 2 * _MESSAGE_OVERHEAD), _FRAME_CHUNK) - _MESSAGE_OVERHEAD
