# SPDX-License-Identifier: Apache-2.0
"""A session: a scene that is stepped frame by frame, in this process or behind a daemon.

Different sessions are independent. Calls of one session take turns: one that waits for its answer holds up those of other
threads, `close()` apart. What is submitted and not yet answered belongs together: leave it to one thread.
"""
from __future__ import annotations

import logging
import warnings
from types import TracebackType
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
import numpy.typing as npt

from ._backend import Backend
from ._background_questions import BackgroundQuestions
from ._changes import Changes
from ._uncopied import Uncopied
from .errors import FailedPreconditionError, WarmfrontError
from .info import SessionInfo
from .scene import Body

if TYPE_CHECKING:  # who computes in this process needs no gRPC
    from ._exchange import Exchange
    from ._remote import Remote
    from ._resume import Link

_log = logging.getLogger("warmfront")
_Self = TypeVar("_Self", bound="AnySession")


class AnySession(Uncopied, BackgroundQuestions, Changes):
    """A `Collider`, in this process, or a `Session`, behind a daemon: the same questions, answers, errors and bits.

    It is one warm state and many questions: `step()` moves it along a motion and tells the contacts; `trial()` and
    `max_step()` tell what a motion would meet, and how far it may go, and leave it where it is; `commit()` moves it along the
    last of these; `proximity()` tells what is near, `intersections()` what is tangled. They wait; `submit()` and
    `next_answer()` have several on the way; `submit_trial()` and its like are futures,
    `trial_async()` and its like are for asyncio. Steps, commits and changes are carried out once; a trial changes nothing and
    may be asked again.

    Once it is closed, its questions, changes, `positions`, `bodies`, `poses`, `edges` and `info()` raise
    FailedPreconditionError. copy and pickle raise TypeError.
    """

    _instead = "create another one, of the same scene and this one's `positions`"
    _closed = False

    @property
    def id(self) -> str:
        """The session's UUID."""
        return self._backend.session_id

    @property
    def window(self) -> int:
        """Most frames that may be unanswered at once."""
        return self._backend.window

    @property
    def last_frame(self) -> int:
        """The last answered frame; the first frame if none was answered."""
        return self._backend.last_frame

    @property
    def positions(self) -> npt.NDArray[Any]:
        """(n, 3) of the session's dtype: where everything is after the last step, place or commit; bodies that are at a pose are
        placed by it, and rounded to the dtype. A copy. FailedPreconditionError once the session is closed."""
        with self._turn:
            return self._open().positions()

    @property
    def bodies(self) -> tuple[Body, ...]:
        """By number: the bodies as they were declared, added and changed since; empty where none were declared. To change one thing
        of a body's description: `change_body(b, dataclasses.replace(session.bodies[b], thickness=0.01))`.
        FailedPreconditionError once the session is closed."""
        with self._turn:
            return tuple(self._open().state.bodies)

    @property
    def poses(self) -> dict[int, npt.NDArray[np.float64]]:
        """{body: (3, 4) float64 [R t]}: where the rigid bodies and half-spaces that moved by poses are after the last step, place or
        commit, to the bit, of the rest shapes that their poses are of. Copies. Bodies that are not in it are at the identity: where
        the positions last given of them say. After a commit of part of the way a body that turned without a screw is no rotation of
        its shape, and no frame takes its pose. FailedPreconditionError once the session is closed."""
        with self._turn:
            return {b: pose.copy() for b, pose in self._open().state.posed().items()}

    def layout(self) -> object:
        """Another object once bodies were added or replaced, so that vertices, faces or bodies have other numbers."""
        return self._backend.state.layout

    @property
    def positions_dtype(self) -> np.dtype[Any]:
        """float32 or float64: of all positions of the session."""
        return self._backend.state.dtype

    @property
    def edges(self) -> npt.NDArray[np.int32]:
        """(e, 2) vertices of the scene's current edges, the smaller one first: the numbering of `Contacts.edges`. Sorted;
        the edges of an added body follow. FailedPreconditionError once the session is closed."""
        return self._open().state.topology().edges

    def info(self) -> SessionInfo:
        """State of the session where it is computed. Keeps it from expiring in a daemon. NotFoundError where the daemon has lost
        it, until a frame or a change has created it again; FailedPreconditionError once the session is closed."""
        return self._open().info()

    def _open(self) -> Backend:
        """For what can be told of a session that was lost, too, but not of one that is closed."""
        if self._closed:
            raise FailedPreconditionError("the session is closed")
        return self._backend

    def close(self) -> None:
        """Ends the session, and deletes it in its daemon; unanswered frames are given up, and further calls fail. Closing again
        does nothing. May be called from any thread: a step that another one waits for is stopped, and raises
        FailedPreconditionError."""
        backend = self._backend
        if self._closed:
            return
        self._closed = True
        lost = backend.failed is not None
        if not lost:
            backend.failed = FailedPreconditionError("the session is closed")
        self._background.end()
        if lost:
            backend.release()
        else:
            backend.close()

    def __enter__(self: _Self) -> _Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        """Closes. If the daemon is gone, there is no session to delete: not an error."""
        try:
            self.close()
        except WarmfrontError:
            pass


class Session(AnySession):
    """Created by `Client.session()`, or by `open()` with a server: behind a daemon.

    It keeps the scene, the positions last answered and what is unanswered, so that it can be created again: when the daemon
    dies, restarts, drains or forgets it, the session goes on there, or at whatever daemon the address leads to by then, with
    exactly one answer to each frame, in order and of the same bits. A copy that a daemon still has is reused where its state,
    which the daemon reports, is this session's; another one, and that of a daemon too old to report it, is deleted and created
    again. Where the daemon is full of other sessions meanwhile, the client waits for room, at most `Timeouts.resume`. An
    `UnavailableError`, `AbortedError` or `InternalError` ends the session, and so does an `UnauthenticatedError` (its token is
    gone, which is read when a client connects), and what says that it could not be resumed, as where another daemon has lower
    limits: every further call raises it again, but for `positions`, `bodies`, `edges` and `options`, of which, with the
    caller's own faces, filters and thickness, another one is made. Everything is where it was in that one, at identity poses:
    `positions` have what `poses`, which can still be asked for, moved, and are the new shapes at rest.
    """

    _backend: Remote

    def __init__(self, backend: Remote) -> None:
        """Internal: use `Client.session()`."""
        super().__init__(backend)

    @property
    def _link(self) -> Link:
        return self._backend.link

    @property
    def _exchange(self) -> Exchange:
        return self._backend.exchange

    @property
    def resumes(self) -> int:
        """How often the session was resumed."""
        return self._link.resumes

    @property
    def shares_memory(self) -> bool:
        """Whether whole frames and answers go through memory that the daemon shares, and not through its socket: False between
        two connections."""
        return self._link.region is not None

    def __del__(self) -> None:
        """Reports that the session was not closed, as a ResourceWarning, which Python hides by default, and in the log
        "warmfront", which it shows. Makes no request, since the daemon's answer may take long."""
        backend = getattr(self, "_backend", None)
        link = None if backend is None else backend.link
        if link is not None and link.failed is None and link.stream is not None:
            # A daemon of one's own ends with the client.
            kept = "" if link.connection.is_private else "; the daemon keeps it until it expires"
            message = f"session {link.session_id} was not closed{kept}: use `with` or close()"
            _log.warning(message)
            warnings.warn(message, ResourceWarning, source=self)
            link.drop_stream()
