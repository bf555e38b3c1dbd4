# SPDX-License-Identifier: Apache-2.0
"""A session's questions and changes over its link to a daemon. Used by one thread at a time, but for `close()`."""
from __future__ import annotations

import time
import uuid
from collections.abc import Callable, Sequence, Sized
from typing import Any, Optional

import numpy.typing as npt

from ._backend import Answer, Motion, too_late
from ._exchange import Exchange
from ._frame import Request, SentCommit, SentFrame
from ._question import Question
from ._resume import Link, TimeUp
from ._scene_changes import ChangesInOne, SceneChange, drafted
from ._state import SceneState
from ._under_way import UnderWay
from .errors import (AbortedError, DeadlineExceededError, FailedPreconditionError, NotFoundError, UnavailableError, UnimplementedError,
                     WarmfrontError, may_resume)
from .info import SessionInfo
from .options import Options, check_options
from .v1 import session_pb2


class Remote:
    """A `Backend`."""

    def __init__(self, link: Link) -> None:
        self.link = link
        self.exchange = Exchange(link)
        self.ends_connection = False  # with the session: nobody else has it
        self._under_way = UnderWay()
        self._unsure = False  # a change was interrupted: the daemon may have carried it out, and may be at it

    @property
    def failed(self) -> Optional[WarmfrontError]:
        return self.link.failed

    @failed.setter
    def failed(self, error: Optional[WarmfrontError]) -> None:
        self.link.failed = error

    @property
    def options(self) -> Options:
        return self.link.options

    @options.setter
    def options(self, options: Options) -> None:
        self.link.options = options

    @property
    def state(self) -> SceneState:
        self._under_way.look()
        return self.link.state

    @property
    def session_id(self) -> str:
        return self.link.session_id

    @property
    def window(self) -> int:
        return self.link.window

    @property
    def last_frame(self) -> int:
        return int(self.link.header.first_frame)

    @property
    def unanswered(self) -> Sized:
        return self.link.unanswered

    def positions(self) -> npt.NDArray[Any]:
        return self.state.placed().astype(self.state.dtype)

    def info(self) -> SessionInfo:
        try:
            return SessionInfo.read_from(self.link.connection.get(self.link.session_id))
        except NotFoundError as error:
            raise error.said_with("", "; the session's next frame creates it there again") from None

    def close(self) -> None:
        # The stream and the frames are the waiting thread's, which may be in the middle of them.
        self.link.cancel_stream()
        try:
            self.link.remove()
        except UnavailableError as error:
            raise UnavailableError(f"session {self.link.session_id} could not be deleted in its daemon, which ends it when it has "
                                   f"been idle: {error.message}") from None
        finally:
            self.release()

    def release(self) -> None:
        if self.ends_connection:
            self.link.connection.close()

    # Questions.

    def submit(self, motion: Optional[Motion], question: Question, fraction: float) -> int:
        link = self.link
        self._settle()
        number = self.exchange.next_number()
        request: Request
        if motion is None:
            self.exchange.check_trial("commit")
            request = SentCommit(number, fraction)
        elif motion.parts is not None:
            request = SentFrame(number, None, motion.parts, link.chunk_bytes, question)
        else:
            try:
                link.enlarge_rooms()
                request = link.state.encode(number, motion.positions, motion.bodies or {}, motion.poses or {}, motion.vertices,
                                            motion.vertex_positions, link.chunk_bytes, question, link.region)
            except WarmfrontError as error:
                link.may_commit = False  # as after any question that fails
                raise type(error)(f"frame {number}: {error.message}") from None
        if motion is not None:
            if question.content and link.known is None:
                raise UnimplementedError(f"{question.method}: the daemon is older than trials and options of one question; use "
                                         "one that is as new as this client")
            if request.needs_trial:
                self.exchange.check_trial(question.method)
        self.exchange.check_room()
        self.exchange.submit(request)
        return number

    def next_answer(self) -> Answer:
        return self.exchange.next_answer()

    def ask(self, motion: Optional[Motion], question: Question, timeout: Optional[float], fraction: float) -> Answer:
        """What ends without an answer is given up."""
        link = self.link
        link.deadline = None if timeout is None else time.monotonic() + timeout
        try:
            number = self.submit(motion, question, fraction)
            return self.exchange.next_answer()
        except TimeUp:
            self.exchange.give_up()
            assert timeout is not None
            raise DeadlineExceededError(too_late(number, timeout) + (f"; {link.trouble}" if link.trouble else "")) from None
        except (KeyboardInterrupt, SystemExit):
            self.exchange.give_up()
            raise
        finally:
            link.deadline = None

    # Changes.

    def change(self, make: Callable[[SceneState], SceneChange]) -> None:
        """Has the daemon carry the change out, and then keeps what it makes of the scene."""
        request = self._request()
        state = self.link.state
        change = make(state)
        request.changes.append(change.encode(state))
        self._need(change.features)
        draft, failed = drafted(change, state)
        self._carry_out(request, draft, None)
        if failed is not None:
            raise failed

    def change_all(self, changes: ChangesInOne) -> None:
        request = self._request()
        request.changes.extend(changes.messages)
        features = changes.features
        if changes.options is not None:
            request.options.SetInParent()
            changes.options.put_into(request.options)
            features = [*features, session_pb2.FEATURE_OPTION_CHANGES]
        self._need(features)
        self._carry_out(request, changes.state, changes.options)

    def change_options(self, options: Options) -> None:
        check_options(options)
        request = self._request()
        request.options.SetInParent()
        options.put_into(request.options)
        self._need([session_pb2.FEATURE_OPTION_CHANGES])
        self._carry_out(request, None, options)

    def _settle(self) -> None:
        """Before anything is asked. Where nobody knows whether the daemon carried a change out, it is given the session anew, without."""
        self._under_way.settle()
        if self._unsure:
            self.link.drop_stream()
            self.link.recreate = True
            self._unsure = False

    def _request(self) -> session_pb2.ChangeSceneRequest:
        """A request for changes. From here on there is no trial to commit, whether or not they are carried out."""
        link = self.link
        self._settle()
        if link.unanswered:
            raise FailedPreconditionError("frames are unanswered; take their answers before changing the scene")
        link.trial = None
        link.may_commit = False
        if link.recreate:
            link.resume(UnavailableError("a change was interrupted"))
        return session_pb2.ChangeSceneRequest(session_id=link.session_id, next_frame=int(link.header.first_frame) + 1,
                                              key=str(uuid.uuid4()))

    def _need(self, features: Sequence[session_pb2.Feature]) -> None:
        """UnimplementedError where the daemon lacks one of the features. One that is lost the change finds out, too."""
        for feature in features:
            try:
                self.link.connection.need([feature], self.link.session_id)
            except UnimplementedError:
                raise
            except WarmfrontError:
                pass

    def _carry_out(self, request: session_pb2.ChangeSceneRequest, draft: Optional[SceneState], options: Optional[Options]) -> None:
        """When the daemon is lost on the way, the session is resumed as it was before the changes, which are sent again with
        their key: they are carried out once. draft: the state after them; options: those that are changed."""
        link, revision = self.link, self.link.header.first_revision + 1
        answers: list[Any] = []

        def then() -> None:
            link.header.first_revision = revision
            link.known = answers[0].state if answers[0].HasField("state") else None
            link.resumes_without_answer = 0
            if draft is not None:
                link.state.become(draft)
            if options is not None:
                link.options = options
                link.header.options.CopyFrom(request.options)
            self._unsure = False
        self._under_way.begin(lambda: bool(answers), then)
        self._unsure = link.changing = True
        try:
            answers.append(self._sent_change(request))
        except WarmfrontError:
            self._unsure = False
            raise
        finally:
            link.changing = False
        self._under_way.settle()

    def _sent_change(self, request: session_pb2.ChangeSceneRequest) -> Any:
        """v1.ChangeSceneResponse; raises the daemon's refusal of the change."""
        link = self.link
        while True:
            request.ClearField("expected_state")
            if link.known is not None:
                request.expected_state.CopyFrom(link.known)
            try:
                return link.connection.change(request)
            except WarmfrontError as error:
                # This session's next frame: a copy that expects another one is not this session.
                if error.reason == "FRAME_OUT_OF_ORDER":
                    error = AbortedError(error.message, reason="STATE_CHANGED")
                if error.retry_after is not None or not may_resume(error):
                    raise
                lost = error
            link.resume(lost)
