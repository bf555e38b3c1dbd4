# SPDX-License-Identifier: Apache-2.0
"""A session: a scene that is stepped frame by frame and survives its daemon.

A Session is used by one thread at a time; different sessions are independent.
"""
from __future__ import annotations

import logging
import uuid
import warnings
from collections.abc import Callable, Mapping
from types import TracebackType
from typing import Any, Optional, Union

import numpy as np
import numpy.typing as npt

from ._contacts import AnswerPart, error_from, finish
from ._resume import Link
from .answer import Contacts
from .errors import (Aborted, DeadlineExceeded, FailedPrecondition, Internal, Unavailable, WarmfrontError, lost_session,
                     may_resume, other_state)
from .info import SessionInfo
from .scene import Body
from .v1 import session_pb2, step_pb2

_log = logging.getLogger("warmfront")


class Session:
    """Created by `Client.session()`.

    It keeps the scene, the last answered positions and the unanswered frames, so that it can be created again: when the
    daemon dies, restarts, drains or loses it, the session continues there, or at the daemon that the address then leads
    to, with exactly one answer to each frame, in order and with the same bits. A copy in a daemon is reused if the daemon
    reports this session's exact state; otherwise, and if the daemon is too old to report it, the copy is deleted and created
    again. If others use up a limit during a resume, the session waits for room within `Patience.resume`. A change is carried
    out exactly once. After `Unavailable`, `DeadlineExceeded`, `Aborted` or `Internal` every further call raises that error.
    """

    def __init__(self, link: Link) -> None:
        """Internal: use `Client.session()`."""
        self._link = link
        self._frame_failed = False  # and answers to later frames are outstanding

    @property
    def id(self) -> str:
        """The session's UUID."""
        return self._link.session_id

    @property
    def window(self) -> int:
        """Most frames that may be unanswered at once."""
        return self._link.window

    @property
    def resumes(self) -> int:
        """How often the session was resumed."""
        return self._link.resumes

    @property
    def last_frame(self) -> int:
        """The last answered frame; the first frame if none was answered."""
        return int(self._link.header.first_frame)

    @property
    def edges(self) -> npt.NDArray[np.int32]:
        """(e, 2) vertices of the scene's current edges, the smaller one first: the numbering of `Contacts.edges`. Sorted;
        the edges of an added body follow."""
        return self._link.state.topology().edges

    def info(self) -> SessionInfo:
        """State of the session in the daemon. Keeps it from expiring there."""
        return SessionInfo.read_from(self._link.connection.get(self.id))

    def step(
        self,
        positions: Any = None,
        *,
        bodies: Optional[Mapping[int, Any]] = None,
        poses: Optional[Mapping[int, Any]] = None,
        vertices: Any = None,
        vertex_positions: Any = None,
    ) -> Contacts:
        """The contacts of the linear motion from the last frame to this one: `submit()`, then `next_answer()`.

        FailedPrecondition while answers to earlier frames were not taken.
        """
        if self._link.unanswered:
            raise FailedPrecondition("frames are unanswered; take their answers before calling step()")
        self.submit(positions, bodies=bodies, poses=poses, vertices=vertices, vertex_positions=vertex_positions)
        return self.next_answer()

    def submit(
        self,
        positions: Any = None,
        *,
        bodies: Optional[Mapping[int, Any]] = None,
        poses: Optional[Mapping[int, Any]] = None,
        vertices: Any = None,
        vertex_positions: Any = None,
    ) -> int:
        """Sends the next frame and returns its number. The arrays may be changed afterwards.

        A frame is always the end of a linear motion: a body that is moved elsewhere (reset, respawned) collides with
        everything on the straight path. To avoid this, create the session again, or remove the body and add another.

        Either all positions, (n, 3) of the session's dtype, scene length unit (lists and integers are taken where they are
        exactly of that dtype); or only what moved, in any mixture: bodies {body: (vertices of the body, 3)}; poses {rigid body: (3, 4) matrix [R t]} of its reference shape (its
        last given positions), sent in the session's dtype; vertices (k) of deformable bodies, each once, and
        vertex_positions (k, 3).

        InvalidArgument if the frame does not fit the scene; FailedPrecondition when `window` frames are unanswered, or
        when a frame failed and answers to later frames were not taken yet.
        """
        link = self._alive()
        number = self.last_frame + 1 + len(link.unanswered)
        try:
            frame = link.state.encode(number, positions, bodies or {}, poses or {}, vertices, vertex_positions,
                                      link.chunk_bytes)
        except WarmfrontError as error:
            raise type(error)(f"frame {number}: {error.message}") from None
        if self._frame_failed:
            raise FailedPrecondition("a frame failed, and frames were sent after it; take their answers before sending more")
        if len(link.unanswered) >= link.window:
            raise FailedPrecondition(f"{link.window} frames are unanswered, which is the daemon's window; take an answer "
                                     "before sending more")
        link.unanswered.append(frame)
        self._send_frames()
        return number

    def next_answer(self) -> Contacts:
        """Waits for the answer to the oldest unanswered frame.

        An error in the frame itself (InvalidArgument, ResourceExhausted) is not a step: later frames in flight fail with
        FailedPrecondition, and after all these answers the next `submit()` has the failed frame's number.
        FailedPrecondition when no frame is unanswered.
        """
        link = self._alive()
        if not link.unanswered:
            raise FailedPrecondition("no frame is unanswered; submit one first")
        while True:
            link = self._alive()
            self._send_frames()
            lost: WarmfrontError = Unavailable("the daemon is draining")
            if link.stream is None:
                lost = Unavailable("waiting was interrupted")
            elif not (link.draining and link.sent == 0):
                try:
                    response = link.stream.read(link.connection.patience.answer)
                except (KeyboardInterrupt, SystemExit):
                    # This read stays in the old call; the next one uses another stream.
                    link.drop_stream()
                    raise
                except DeadlineExceeded as error:
                    lost = error if error.reason else DeadlineExceeded(
                        f"frame {link.unanswered[0].number}: no answer within the answer timeout")
                except WarmfrontError as error:
                    lost = error
                else:
                    self._alive()
                    answer = self._take(response)
                    if answer is not None:
                        return answer
                    continue
            link.resume(lost)

    def add_body(self, body: Body, faces: Any, positions: Any) -> int:
        """Adds a stationary body and returns its index, the previous number of bodies; its vertices and faces come after
        all others. faces (m, 3) number its own vertices from 0; positions (vertex_count, 3) of the session's dtype.

        FailedPrecondition while frames are unanswered, or in a session that declared no bodies.
        """
        state = self._alive().state
        change = state.encode_addition(body, faces, positions)
        index = len(state.bodies)
        self._change(change, lambda: state.take_addition(body, faces, positions))
        return index

    def change_body(self, index: int, body: Body) -> None:
        """Changes a body's description, from the next step on; its range does not change, and `body`'s is ignored. "removed"
        is permanent. A body that becomes rigid takes its current positions as its reference shape.

        FailedPrecondition while frames are unanswered; InvalidArgument for an unknown or removed body.
        """
        state = self._alive().state
        self._change(state.encode_change(index, body), lambda: state.take_change(index, body))

    def close(self) -> None:
        """Deletes the session in the daemon; unanswered frames are dropped, and further calls fail. Closing again does
        nothing. May be called from any thread: a step on another thread is cancelled in the daemon, and raises
        FailedPrecondition."""
        link = self._link
        if link.failed is not None:
            return
        link.failed = FailedPrecondition("the session is closed")
        # The stream and the frames belong to the waiting thread, which may be using them.
        link.cancel_stream()
        link.remove()

    def __enter__(self) -> Session:
        return self

    def __exit__(self, kind: Optional[type[BaseException]], error: Optional[BaseException],
                 trace: Optional[TracebackType]) -> None:
        """Closes. If the daemon is gone, there is no session to delete: not an error."""
        try:
            self.close()
        except WarmfrontError:
            pass

    def __del__(self) -> None:
        """Reports that the session was not closed, as a ResourceWarning, which Python hides by default, and in the log
        "warmfront", which it shows. Makes no request, since the daemon's answer may take long."""
        link = getattr(self, "_link", None)
        if link is not None and link.failed is None and link.stream is not None:
            message = f"session {link.session_id} was not closed; the daemon keeps it until it expires: use `with` or close()"
            _log.warning(message)
            warnings.warn(message, ResourceWarning, source=self)
            link.drop_stream()

    def _alive(self) -> Link:
        if self._link.failed is not None:
            raise self._link.failed
        return self._link

    def _send_frames(self) -> None:
        link = self._link
        while link.stream is not None and not link.draining and link.sent < min(len(link.unanswered), link.window):
            frame = link.unanswered[link.sent].fitted(link.chunk_bytes)
            link.unanswered[link.sent] = frame
            for message in frame.messages:
                link.stream.write(message)
            link.sent += 1

    def _take(self, response: Union[AnswerPart, step_pb2.StreamStepsResponse]) -> Optional[Contacts]:
        """The frame's answer when the message completes one; raises the frame's error."""
        link = self._link
        if isinstance(response, AnswerPart):
            return self._take_part(response)
        if response.HasField("draining"):
            link.draining = True
            return None
        if not response.HasField("error"):
            link.fail(Internal("the daemon sent an unexpected message"))
        status = response.error.status
        error = error_from(status.code, status.message, status.details)
        due = link.unanswered[0].number
        # Losing the session also ends the stream: read it to its end, then resume.
        if lost_session(error):
            return None
        # This session's next frame: a copy that answered it differently, or expects another, is not this session.
        out_of_order = error.reason == "FRAME_OUT_OF_ORDER" and response.error.frame == self.last_frame + 1
        if other_state(error) or out_of_order:
            link.resume(Aborted(error.message, reason="STATE_CHANGED"))
            return None
        if response.error.frame != due:
            link.fail(Internal(f"the daemon refused frame {response.error.frame} where frame {due} is due: {error.message}"))
        # The engine failed on this frame and the session is gone: creating it again would fail in the same way.
        if error.reason == "ENGINE":
            link.fail(error)
        self._answered()
        self._frame_failed = len(link.unanswered) > 0
        raise error

    def _take_part(self, part: AnswerPart) -> Optional[Contacts]:
        link = self._link
        frame = link.unanswered[0]
        if part.frame != frame.number:
            link.fail(Internal(f"the daemon answered frame {part.frame} where frame {frame.number} is due"))
        link.partial.append(part)
        if not part.last:
            return None
        if link.known is not None:
            if part.summary.state_before != link.known:
                link.resume(Aborted(f"frame {part.frame} was stepped from another state: session {self.id} is also "
                                    "changed by another client", reason="STATE_CHANGED"))
                return None
            link.known = part.summary.state
        try:
            contacts = finish(link.partial, link.asked_fields, link.state.topology())
        except WarmfrontError as error:
            link.fail(error)
        link.partial = []
        link.header.first_frame = frame.number
        link.state.take(frame)
        self._answered()
        return contacts

    def _answered(self) -> None:
        link = self._link
        link.unanswered.popleft()
        link.sent -= 1
        link.resumes_without_answer = 0

    def _change(self, change: session_pb2.SceneChange, taken: Callable[[], None]) -> None:
        """Has the daemon carry out a change, then calls `taken`. If the daemon is lost, the session is resumed in the state
        before the change, which is sent again with its key: it is carried out once."""
        link = self._link
        if link.unanswered:
            raise FailedPrecondition("frames are unanswered; take their answers before changing the scene")
        request = session_pb2.ChangeSceneRequest(session_id=self.id, next_frame=self.last_frame + 1, changes=[change],
                                                 key=str(uuid.uuid4()))
        link.changing = True
        try:
            response = self._sent_change(request)
        finally:
            link.changing = False
        taken()
        link.header.first_revision += 1
        link.known = response.state if response.HasField("state") else None
        link.resumes_without_answer = 0

    def _sent_change(self, request: session_pb2.ChangeSceneRequest) -> Any:
        """v1.ChangeSceneResponse; raises the daemon's refusal of the change."""
        link = self._link
        while True:
            request.ClearField("expected_state")
            if link.known is not None:
                request.expected_state.CopyFrom(link.known)
            try:
                return link.connection.change(request)
            except WarmfrontError as error:
                # This session's next frame: a copy that expects another one is not this session.
                if error.reason == "FRAME_OUT_OF_ORDER":
                    error = Aborted(error.message, reason="STATE_CHANGED")
                if error.retry_after is not None or not may_resume(error):
                    raise
                lost = error
            link.resume(lost)
