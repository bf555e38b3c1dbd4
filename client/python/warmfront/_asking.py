# SPDX-License-Identifier: Apache-2.0
"""How a session asks: one question that is waited for, or several on the way. Thread-safe, as `Session` says."""
from __future__ import annotations

import threading
from collections.abc import Collection, Mapping
from typing import Any, Optional

from ._backend import Answer, Backend, Motion
from ._question import Question, QuestionKind, Where, fraction_of, number_of, question_of
from .errors import FailedPreconditionError, InvalidArgumentError
from .options import ContactField, Report, Tier


class Asking:
    """Where a session's questions are computed, and whose turn it is to ask."""

    def __init__(self, backend: Backend) -> None:
        """Internal: use `Client.session()`, `Collider` or `open()`."""
        self._backend = backend
        # Whose call waits for an answer: another thread's, the background's too, comes after it.
        self._turn = threading.RLock()

    def submit(
        self,
        positions: Any = ...,
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
                return self._alive().submit(None, question_of("step"), fraction_of(fraction))
            question = question_of(kind, tier=tier, tolerance=tolerance, min_separation=min_separation, report=report,
                                   fields=fields, max_contacts=max_contacts, leave_out_overlaps=leave_out_overlaps,
                                   where=where, keep_distance=keep_distance, reduced=reduced)
            if kind in ("proximity", "intersections") and not motion.empty:
                raise InvalidArgumentError(f"{kind}: it moves nothing; make the motion a trial, and ask where=\"trial_end\"")
            return self._alive().submit(motion, question, 1.0)

    def next_answer(self) -> Any:
        """Waits for the answer to the oldest of what was submitted: `Contacts` to a step, trial or proximity, `MaxStep`,
        `Committed`, `Intersections`, or `VertexDistances` to proximity with report "vertex-distances".

        An error in a step or commit itself (InvalidArgumentError, ResourceExhaustedError, ...) does not count as one: what was
        sent after it fails with FailedPreconditionError, and once all is taken the next `submit()` has the failed one's
        number. FailedPreconditionError when nothing is unanswered.
        """
        with self._turn:
            backend = self._alive()
            if not backend.unanswered:
                raise FailedPreconditionError("no frame is unanswered; submit one first")
            return backend.next_answer()

    def _alive(self) -> Backend:
        backend = self._backend
        if backend.failed is not None:
            raise backend.failed
        return backend

    def _ask(self, motion: Optional[Motion], question: Question, timeout: Optional[float], fraction: float = 1.0) -> Answer:
        """Submits, and waits for the answer; what ends without one is given up. Without a motion: a commit."""
        if timeout is not None and not number_of(timeout, "timeout", "a positive time in seconds") > 0:
            raise InvalidArgumentError(f"timeout: {timeout!r} seconds; give a positive time")
        with self._turn:
            backend = self._alive()
            if backend.unanswered:
                raise FailedPreconditionError("frames are unanswered; take their answers before a single step")
            return backend.ask(motion, question, timeout, fraction)
