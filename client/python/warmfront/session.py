# SPDX-License-Identifier: Apache-2.0
"""A session: a scene that is stepped frame by frame and survives its daemon.

Different sessions are independent. Calls of one session take turns: one that waits for its daemon holds up those of other
threads, `close()` apart. What is submitted and not yet answered belongs together: leave it to one thread.
"""
from __future__ import annotations

import logging
import warnings
from types import TracebackType
from typing import Any, Optional

import numpy as np
import numpy.typing as npt

from ._background_questions import BackgroundQuestions
from ._changes import Changes
from .errors import FailedPreconditionError, WarmfrontError
from .info import SessionInfo

_log = logging.getLogger("warmfront")


class Session(BackgroundQuestions, Changes):
    """Created by `Client.session()`.

    It is one warm state and many questions: `step()` moves it along a motion and tells the contacts; `trial()` and
    `max_step()` tell what a motion would meet, and how far it may go, and leave it where it is; `commit()` moves it along the
    last of these; `proximity()` tells what is near, `intersections()` what is tangled. They wait; `submit()` and
    `next_answer()` have several on the way; `submit_trial()` and its like are futures,
    `trial_async()` and its like are for asyncio.

    It keeps the scene, the positions last answered and what is unanswered, so that it can be created again: when the
    daemon dies, restarts, drains or forgets it, the session goes on there, or at whatever daemon the address leads to by
    then, with exactly one answer to each frame, in order and of the same bits. A copy that a daemon still has is reused where
    its state, which the daemon reports, is this session's; another one, and that of a daemon too old to report it, is
    deleted and created again. Where the daemon is full of other sessions meanwhile, the client waits for room, at most
    `Timeouts.resume`.
    Steps, commits and changes are carried out once; a trial changes nothing and may be asked again. An `UnavailableError`,
    `AbortedError` or `InternalError` ends the session: every further call raises it again.
    """

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
    def positions(self) -> npt.NDArray[Any]:
        """(n, 3) of the session's dtype: where everything is after the last step, place or commit; bodies that are at a pose are
        placed by it, and rounded to the dtype. A copy."""
        with self._turn:
            state = self._link.state
            return state.placed().astype(state.dtype)

    def layout(self) -> object:
        """Another object once bodies were added or replaced, so that vertices, faces or bodies have other numbers."""
        return self._link.state.layout

    @property
    def positions_dtype(self) -> np.dtype[Any]:
        """float32 or float64: of all positions of the session."""
        return self._link.state.dtype

    @property
    def edges(self) -> npt.NDArray[np.int32]:
        """(e, 2) vertices of the scene's current edges, the smaller one first: the numbering of `Contacts.edges`. Sorted;
        the edges of an added body follow."""
        return self._link.state.topology().edges

    def info(self) -> SessionInfo:
        """State of the session in the daemon. Keeps it from expiring there."""
        return SessionInfo.read_from(self._link.connection.get(self.id))

    def close(self) -> None:
        """Deletes the session in the daemon; unanswered frames are given up, and further calls fail. Closing again does
        nothing. May be called from any thread: a step that another one waits for is stopped in the daemon, and raises
        FailedPreconditionError."""
        link = self._link
        if link.failed is not None:
            return
        link.failed = FailedPreconditionError("the session is closed")
        self._background.end()
        # The stream and the frames are the waiting thread's, which may be in the middle of them.
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
            # A daemon of one's own ends with the client.
            kept = "" if link.connection.is_private else "; the daemon keeps it until it expires"
            message = f"session {link.session_id} was not closed{kept}: use `with` or close()"
            _log.warning(message)
            warnings.warn(message, ResourceWarning, source=self)
            link.drop_stream()
