# SPDX-License-Identifier: Apache-2.0
"""How a session asks: one question that is waited for, or several on the way. Thread-safe, as `Session` says."""
from __future__ import annotations

import threading
import time
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Optional

from ._exchange import Answer, Exchange
from ._frame import Part, Request, SentCommit, SentFrame
from ._question import Question, QuestionKind, Where, fraction_of, question_of
from ._resume import Link, TimeUp
from .errors import (DeadlineExceededError, FailedPreconditionError, InvalidArgumentError, UnimplementedError,
                     WarmfrontError)
from .options import ContactField, Report, Tier


@dataclass(frozen=True, eq=False)
class Motion:
    """Where a frame has what go, as `Session.step()` takes it."""

    positions: Any = None
    bodies: Optional[Mapping[int, Any]] = None
    poses: Optional[Mapping[int, Any]] = None
    vertices: Any = None
    vertex_positions: Any = None
    parts: Optional[Sequence[Part]] = None  # instead: what moved as it travels, checked by who made it

    @property
    def empty(self) -> bool:
        return self.parts is None and all(part is None for part in (self.positions, self.bodies, self.poses, self.vertices,
                                                                    self.vertex_positions))


class Asking:
    """A session's link to its daemon, and whose turn it is to use it."""

    def __init__(self, link: Link) -> None:
        """Internal: use `Client.session()`."""
        self._link = link
        self._exchange = Exchange(link)
        # Whose call waits for the daemon: another thread's, the background's too, comes after it.
        self._turn = threading.RLock()

    def submit(
        self,
        positions: Any = None,
        *,
        bodies: Optional[Mapping[int, Any]] = None,
        poses: Optional[Mapping[int, Any]] = None,
        vertices: Any = None,
        vertex_positions: Any = None,
        kind: QuestionKind = "step",
        fraction: float = 1.0,
        leave_out_overlaps: bool = False,
        where: Optional[Where] = None,
        keep_distance: Optional[float] = None,
        tier: Optional[Tier] = None,
        tolerance: Optional[float] = None,
        min_separation: Optional[float] = None,
        report: Optional[Report] = None,
        fields: Optional[Collection[ContactField]] = None,
        max_contacts: Optional[int] = None,
        reduced: bool = False,
    ) -> int:
        """Sends the next question without waiting for its answer, which `next_answer()` takes, and returns its frame's number:
        a "step", "place", "trial", "max_step", "commit" (which takes a fraction and nothing else), "proximity" (which takes
        the distance as min_separation) or "intersections", both without a motion, with the arguments of these. The
        arrays are free to be changed afterwards. A trial that is to be committed may itself be unanswered.

        InvalidArgumentError where something does not fit the scene; FailedPreconditionError when `window` frames are
        unanswered, or when a frame failed and answers to frames after it were not taken yet.
        """
        motion = Motion(positions, bodies, poses, vertices, vertex_positions)
        with self._turn:
            if kind == "commit":
                if not motion.empty or leave_out_overlaps or reduced or any(
                        option is not None for option in
                        (tier, tolerance, min_separation, report, fields, max_contacts, where, keep_distance)):
                    raise InvalidArgumentError("commit: it takes the last trial as it is; give a fraction and nothing else")
                return self._submit(None, question_of("step"), fraction_of(fraction))
            question = question_of(kind, tier=tier, tolerance=tolerance, min_separation=min_separation, report=report,
                                   fields=fields, max_contacts=max_contacts, leave_out_overlaps=leave_out_overlaps,
                                   where=where, keep_distance=keep_distance, reduced=reduced)
            if kind in ("proximity", "intersections") and not motion.empty:
                raise InvalidArgumentError(f"{kind}: it moves nothing; make the motion a trial, and ask where=\"trial_end\"")
            return self._submit(motion, question)

    def next_answer(self) -> Any:
        """Waits for the answer to the oldest of what was submitted: `Contacts` to a step, trial or proximity, `MaxStep`,
        `Committed`, `Intersections`, or `VertexDistances` to proximity with report "vertex-distances".

        An error in a step or commit itself (InvalidArgumentError, ResourceExhaustedError, ...) does not count as one: what was
        sent after it fails with FailedPreconditionError, and once all is taken the next `submit()` has the failed one's
        number. FailedPreconditionError when nothing is unanswered.
        """
        with self._turn:
            link = self._alive()
            if not link.unanswered:
                raise FailedPreconditionError("no frame is unanswered; submit one first")
            return self._exchange.next_answer()

    def _alive(self) -> Link:
        if self._link.failed is not None:
            raise self._link.failed
        return self._link

    def _submit(self, motion: Optional[Motion], question: Question, fraction: float = 1.0) -> int:
        """Without a motion: a commit."""
        link = self._alive()
        number = self._exchange.next_number()
        request: Request
        if motion is None:
            self._exchange.check_trial("commit")
            request = SentCommit(number, fraction)
        elif motion.parts is not None:
            request = SentFrame(number, None, motion.parts, link.chunk_bytes, question)
        else:
            try:
                request = link.state.encode(number, motion.positions, motion.bodies or {}, motion.poses or {}, motion.vertices,
                                            motion.vertex_positions, link.chunk_bytes, question)
            except WarmfrontError as error:
                link.may_commit = False  # as after any question that fails
                raise type(error)(f"frame {number}: {error.message}") from None
        if motion is not None:
            if question.content and link.known is None:
                raise UnimplementedError(f"{question.kind}: the daemon is older than trials and options of one question; use "
                                         "one that is as new as this client")
            if request.needs_trial:
                self._exchange.check_trial(question.kind)
        self._exchange.check_room()
        self._exchange.submit(request)
        return number

    def _ask(self, motion: Optional[Motion], question: Question, timeout: Optional[float], fraction: float = 1.0) -> Answer:
        """Submits, and waits for the answer; what ends without one is given up."""
        if timeout is not None and not timeout > 0:
            raise InvalidArgumentError(f"timeout: {timeout!r} seconds; give a positive time")
        with self._turn:
            link = self._alive()
            if link.unanswered:
                raise FailedPreconditionError("frames are unanswered; take their answers before a single step")
            link.deadline = None if timeout is None else time.monotonic() + timeout
            try:
                number = self._submit(motion, question, fraction)
                return self._exchange.next_answer()
            except TimeUp:
                self._exchange.give_up()
                raise DeadlineExceededError(f"frame {number}: no answer within {timeout:g} s; it does not count, and the "
                                            "session is where it was") from None
            except (KeyboardInterrupt, SystemExit):
                self._exchange.give_up()
                raise
            finally:
                link.deadline = None
