# SPDX-License-Identifier: Apache-2.0
"""A session's requests and answers over its link: one answer to each, in order, even if the daemon is lost. Used by one
thread at a time."""
from __future__ import annotations

import time
from typing import Optional, Union

from ._backend import Answer, only_with_trial
from ._contacts import REDUCED, AnswerPart, error_from, finish, intersections_of, max_step_of, up_to, vertex_distances_of
from ._frame import Request, SentCommit
from ._resume import Link, TimeUp
from .answer import Contacts
from .errors import (AbortedError, DeadlineExceededError, FailedPreconditionError, InternalError, UnavailableError,
                     UnimplementedError, WarmfrontError, lost_session, other_state)
from .v1 import step_pb2


class Exchange:
    """What was submitted is in `Link.unanswered` until its answer is complete."""

    def __init__(self, link: Link) -> None:
        self._link = link
        self._frame_failed = False  # and answers to frames after it are outstanding

    def next_number(self) -> int:
        """Of the next request: questions have the number of the frame that comes next."""
        return int(self._link.header.first_frame) + 1 + sum(request.counts for request in self._link.unanswered)

    def check_room(self) -> None:
        """FailedPreconditionError where nothing may be sent now."""
        link = self._link
        if self._frame_failed:
            raise FailedPreconditionError("a frame failed, and frames were sent after it; take their answers before sending "
                                          "more")
        if len(link.unanswered) >= link.window:
            raise FailedPreconditionError(f"{link.window} frames are unanswered, which is the daemon's window; take an answer "
                                          "before sending more")

    def check_trial(self, method: str) -> None:
        """FailedPreconditionError where a commit, or a question about a trial's end, would find no trial: the daemon may have an
        earlier one than this session, where a later one was given up."""
        link = self._link
        if not link.may_commit or (not link.unanswered and link.trial is None):
            raise FailedPreconditionError(only_with_trial(method))

    def submit(self, request: Request) -> None:
        """After the checks."""
        self._link.unanswered.append(request)
        if request.counts or request.is_trial:
            self._link.may_commit = request.is_trial
        self.send()

    def next_answer(self) -> Answer:
        """To the oldest request; raises its error. TimeUp when `Link.deadline` passes."""
        link = self._link
        while True:
            if link.failed is not None:
                raise link.failed
            self.send()
            lost: WarmfrontError = UnavailableError("the daemon is draining")
            if link.stream is None:
                lost = UnavailableError("waiting was interrupted")
            elif not (link.draining and link.sent == 0 and not link.echo_sent):
                try:
                    response = link.stream.read(link.time_left(link.connection.timeouts.answer))
                except (KeyboardInterrupt, SystemExit):
                    # A read is left behind in the call; the next one goes on with another stream.
                    link.drop_stream()
                    raise
                except DeadlineExceededError as error:
                    if link.deadline is not None and time.monotonic() >= link.deadline and not error.reason:
                        raise TimeUp() from None
                    lost = error if error.reason else DeadlineExceededError(
                        f"frame {link.unanswered[0].number}: no answer within the answer timeout")
                except WarmfrontError as error:
                    lost = error
                else:
                    if link.failed is not None:
                        raise link.failed
                    answer = self._take(response)
                    if answer is not None:
                        return answer
                    continue
            link.resume(lost)

    def give_up(self) -> None:
        """Gives up all unanswered requests: they do not count, whether or not the daemon carried them out; the session is where
        the last answer left it. The daemon stops computing."""
        link = self._link
        link.drop_stream()
        if any(request.is_trial or request.kind in ("step", "place") for request in link.unanswered):
            link.trial = None
        link.may_commit = link.trial is not None
        link.unanswered.clear()
        link.sent = 0
        link.resumes_without_answer = 0
        self._frame_failed = False

    def send(self) -> None:
        """What the window has room for."""
        link = self._link
        if link.stream is None or link.draining:
            return
        if link.echo is not None and not link.echo_sent:
            for message in link.echo.to_send(link.region, link.room, link.shares_moved):
                link.stream.write(message)
            link.echo_sent = True
        while link.sent < min(len(link.unanswered), link.window - (link.echo is not None)):
            request = link.unanswered[link.sent].fitted(link.chunk_bytes)
            link.unanswered[link.sent] = request
            for message in request.to_send(link.region, link.room, link.shares_moved):
                link.stream.write(message)
            link.sent += 1

    def _take(self, response: Union[AnswerPart, step_pb2.StreamStepsResponse]) -> Optional[Answer]:
        """The answer when the message completes one; raises the request's error."""
        link = self._link
        if isinstance(response, AnswerPart):
            return self._take_part(response)
        if response.HasField("draining"):
            link.draining = True
            return None
        if not response.HasField("error"):
            link.fail(InternalError("the daemon sent an unexpected message"))
        status = response.error.status
        error = error_from(status.code, status.message, status.details)
        request = link.unanswered[0]
        # Dropped sessions end the stream too: it is read to its end, and resumed.
        if lost_session(error):
            return None
        if error.reason == "DRAINING":  # the daemon stops before it has computed the frame, and another one does
            link.resume(error)
            return None
        # This session's next frame: a copy that answered it differently, or expects another, is not this session.
        out_of_order = error.reason == "FRAME_OUT_OF_ORDER" and response.error.frame == link.header.first_frame + 1
        # So is one that does not know the trial that this is about.
        trial_lost = (request.needs_trial and link.trial is not None and link.echo is None and link.echo_error is None
                      and response.error.frame == request.number and isinstance(error, FailedPreconditionError))
        if other_state(error) or out_of_order or trial_lost:
            link.resume(AbortedError(error.message, reason="STATE_CHANGED"))
            return None
        if response.error.frame != request.number:
            link.fail(InternalError(f"the daemon refused frame {response.error.frame} where frame {request.number} is due: "
                                    f"{error.message}"))
        # The engine failed on this frame and the session is gone: creating it again would fail in the same way.
        if error.reason == "ENGINE":
            link.fail(error)
        if link.echo is not None:
            # The trial was answered before, and this daemon refuses it, and its commit after it: with this error.
            link.echo = None
            link.echo_error = error
            return None
        if request.needs_trial and link.echo_error is not None:
            error = link.echo_error
        if request.is_trial or request.kind in ("step", "place") or (request.needs_trial and isinstance(error, FailedPreconditionError)):
            link.trial = None
        self._answered()
        if request.kind == "commit" and not link.unanswered:
            link.may_commit = link.trial is not None
        # What was sent after a frame that does not count is out of order; after a trial it is not.
        if request.counts and link.unanswered:
            self._frame_failed = True
        raise error

    def _take_part(self, part: AnswerPart) -> Optional[Answer]:
        link = self._link
        request = link.unanswered[0] if link.echo is None else link.echo
        if part.frame != request.number:
            link.fail(InternalError(f"the daemon answered frame {part.frame} where frame {request.number} is due"))
        try:
            part.fill_from(request.room)
        except InternalError as error:
            link.fail(error)
        link.partial.append(part)
        if not part.last:
            return None
        link.wanted_room = max(link.wanted_room, sum(one.bulk for one in link.partial))
        request.room = request.moved_block = None
        summary = part.summary
        if link.known is not None:
            if summary.state_before != link.known:
                link.resume(AbortedError(f"frame {part.frame} was stepped from another state: session {link.session_id} is "
                                         "also changed by another client", reason="STATE_CHANGED"))
                return None
            if not request.counts and summary.state != link.known:
                link.fail(UnimplementedError(f"the daemon is older than trials, and took the {request.kind} for a step; use a "
                                             "daemon that is as new as this client"))
        parts, link.partial = link.partial, []
        if link.echo is not None:
            link.echo = None
            return None
        try:
            answer = self._complete(request, parts)
        except WarmfrontError as error:
            link.fail(error)
        if request.counts:
            link.header.first_frame = request.number
            if link.known is not None:
                link.known = summary.state
        self._answered()
        # By the answer, and not by what a daemon lists before: behind a proxy another one may answer.
        if not isinstance(request, SentCommit) and request.question.reduced and isinstance(answer, Contacts) \
                and answer.multiplicity is not None and len(answer.multiplicity) < len(answer):
            raise UnimplementedError("reduced: the daemon is older than it, and lists each closest pair as often as rows have "
                                     "it; update it, or ask without")
        if not isinstance(request, SentCommit) and request.question.keeps_distance \
                and not summary.HasField("keep_distance"):
            raise UnimplementedError("keep_distance: the daemon is older than it, and answers as if nothing but contact were to be "
                                     "kept from; update it, or ask without")
        return answer

    def _complete(self, request: Request, parts: list[AnswerPart]) -> Answer:
        """The answer, after which the session is where it says."""
        link = self._link
        if isinstance(request, SentCommit):
            if link.trial is None:
                raise InternalError("the daemon committed a trial that was not answered")
            frame, told = link.trial
            link.state.take_part(frame, request.fraction)
            link.trial = None
            return up_to(told, request.fraction, request.number)
        asked = link.asked_fields if request.question.fields is None else request.question.fields
        if request.question.reduced:
            asked = (*(() if asked is None else asked), *REDUCED)
        contacts = finish(parts, asked, link.state.topology())
        if request.counts:
            link.state.take(request)
        if request.counts or request.is_trial:
            link.trial = None if request.counts else (request, contacts)
        if request.question.by_vertex:
            return vertex_distances_of(parts, contacts)
        if request.kind == "intersections":
            return intersections_of(contacts, parts[-1].summary)
        if request.kind == "max_step":
            return max_step_of(contacts, parts[-1].summary)
        return contacts

    def _answered(self) -> None:
        link = self._link
        link.unanswered.popleft()
        link.sent -= 1
        link.resumes_without_answer = 0
        link.echo_error = None
        if not link.unanswered:
            self._frame_failed = False
