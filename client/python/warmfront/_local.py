# SPDX-License-Identifier: Apache-2.0
"""A session's questions and changes of the engine in this process. Used by one thread at a time, but for `close()`."""
from __future__ import annotations

import uuid
from collections import deque
from collections.abc import Callable, Iterable, Sized
from datetime import datetime, timezone
from typing import Any, Optional

import numpy as np
import numpy.typing as npt

from . import _engine, _frame
from ._asked import ALL, NOTHING, Asked, Moved
from ._backend import Answer, Motion, only_with_trial, too_late
from ._contacts import intersections_of, max_step_of
from ._question import Question, frame_number_of, session_id_of
from ._scene_changes import ChangesInOne, SceneChange, drafted
from ._state import SceneState
from ._statistics import statistics_of
from ._under_way import UnderWay
from .answer import Committed, Contacts, VertexDistances
from .errors import CancelledError, DeadlineExceededError, FailedPreconditionError, WarmfrontError
from .info import SessionInfo
from .options import Options, check_options
from .v1 import options_pb2, session_pb2, step_pb2

# As a daemon's, unless it is told another one.
_WINDOW = 4
# Questions that were read, by their bytes: a solver asks the same few.
_KEPT_QUESTIONS = 256


class Local:
    """A `Backend`."""

    window = _WINDOW

    def __init__(self, state: SceneState, options: Options, session_id: str, first_frame: int, threads: int) -> None:
        """Raises as a daemon does that is asked for such a session."""
        check_options(options)
        header = session_pb2.SessionHeader()
        options.put_into(header.options)
        state.describe(header)
        session_id = session_id_of(session_id)
        header.first_frame = frame_number_of(first_frame)
        filters = None
        if state.filters.given:
            filters = session_pb2.PairFilters()
            state.filters.put_into(filters)
        self.failed: Optional[WarmfrontError] = None
        self.options = options
        self._state = state
        self._under_way = UnderWay()
        self._engine: Optional[_engine.Session] = _engine.Session(header, state.rows(), state.faces, state.edges, state.thickness,
                                                                  filters, threads)
        state.forget_rows()
        self._id = session_id.lower()
        self._created = datetime.now(timezone.utc)
        self._frame = first_frame
        self._steps = 0
        self._questions: dict[bytes, _engine.Question] = {}
        self._asked: deque[Asked] = deque()
        self._frame_failed = False  # and answers to frames after it are outstanding
        self._trial: Optional[Moved] = None  # the one answered last, as long as it may be committed
        self._may_commit = False  # what was asked last is a trial, answered or on its way, or its commit failed

    @property
    def session_id(self) -> str:
        if not self._id:
            self._id = str(uuid.uuid4())
        return self._id

    @property
    def state(self) -> SceneState:
        self._under_way.look()
        return self._state

    @property
    def last_frame(self) -> int:
        self._under_way.look()
        return self._frame

    @property
    def unanswered(self) -> Sized:
        return self._asked

    def _open(self) -> _engine.Session:
        if self._engine is None:
            raise self.failed or FailedPreconditionError("the session is closed")
        return self._engine

    def positions(self) -> npt.NDArray[Any]:
        return self._open().positions()

    def info(self) -> SessionInfo:
        dtype = options_pb2.DTYPE_FLOAT32 if self._state.dtype.itemsize == 4 else options_pb2.DTYPE_FLOAT64
        message = session_pb2.SessionInfo(session_id=self.session_id, steps=self._steps, dtype=dtype,
                                          created_unix_ms=int(self._created.timestamp() * 1000))
        self._open().describe(message)
        return SessionInfo.read_from(message)

    def close(self) -> None:
        engine, self._engine = self._engine, None
        if engine is not None:
            engine.stop()

    def release(self) -> None:
        self.close()

    # Questions.

    def ask(self, motion: Optional[Motion], question: Question, timeout: Optional[float], fraction: float) -> Answer:
        self._under_way.settle()
        engine = self._open()
        number = self._frame + 1
        if motion is None:
            self._check_trial("commit")
            self._under_way.begin(lambda: engine.frame >= number, self._counting(number, self._trial, fraction))
            try:
                answer = engine.commit(fraction, timeout)
            except WarmfrontError as error:
                if isinstance(error, FailedPreconditionError):
                    self._trial = None
                self._may_commit = self._trial is not None
                raise self._told(error, number, timeout) from None
            self._under_way.settle()
            return self._committed(answer, fraction, number)
        array, parts, moved = self._read(number, motion)
        if question.of_trial_end:
            self._check_trial(question.method)
        asked = self._questions.get(question.content) or self._kept(question)
        if question.kind not in ("proximity", "intersections"):
            self._trial = None  # also where this one ends without an answer
            self._may_commit = False
        if question.counts:
            self._under_way.begin(lambda: engine.frame >= number, self._counting(number, moved, 1))
        try:
            answer = engine.ask(asked, array, parts, timeout)
        except WarmfrontError as error:
            if question.of_trial_end and isinstance(error, FailedPreconditionError):
                self._trial = None
            raise self._told(error, number, timeout) from None
        self._under_way.settle()
        if question.is_trial:
            self._may_commit = True
            self._trial = moved
        return self._answered(answer, question, number)

    def submit(self, motion: Optional[Motion], question: Question, fraction: float) -> int:
        self._under_way.settle()
        engine = self._open()
        number = self._frame + 1 + sum(asked.counts for asked in self._asked)
        if motion is None:
            self._check_trial("commit")
            self._check_room()
            asked = Asked(number, None, NOTHING, fraction, engine.submit_commit(fraction))
        else:
            array, parts, moved = self._read(number, motion)
            if question.of_trial_end:
                self._check_trial(question.method)
            self._check_room()
            asked = Asked(number, question, moved, 1.0, engine.submit(self._kept(question), array, parts))
        self._asked.append(asked)
        if asked.counts or question.is_trial:
            self._may_commit = not asked.counts
        return number

    def next_answer(self) -> Answer:
        self._under_way.settle()
        asked = self._asked[0]
        engine = self._open()
        try:
            answer = engine.take(asked.on_its_way)
        except WarmfrontError as error:
            question = asked.question
            moves = question is not None and question.kind not in ("proximity", "intersections")
            of_trial = question is None or question.of_trial_end
            if moves or (of_trial and isinstance(error, FailedPreconditionError)):
                self._trial = None
            told = self._told(error, asked.number, None)
            if self._frame_failed and isinstance(error, FailedPreconditionError):
                expected = self._frame + 1
                told = FailedPreconditionError(f"frame {asked.number} is out of order: frame {expected} is expected",
                                               reason="FRAME_OUT_OF_ORDER", expected_frame=expected)
            self._pop()
            if question is None and not self._asked:
                self._may_commit = self._trial is not None
            # What was sent after a frame that does not count is out of order; after a trial it is not.
            if asked.counts and self._asked:
                self._frame_failed = True
            raise told from None
        question = asked.question
        if asked.counts:
            moved = self._trial if question is None else asked.moved
            self._under_way.begin(lambda: asked not in self._asked, self._counting(asked.number, moved, asked.fraction))
        elif question is not None and question.is_trial:
            self._trial = asked.moved
        self._pop()
        self._under_way.settle()
        if question is None:
            return self._committed(answer, asked.fraction, asked.number)
        return self._answered(answer, question, asked.number)

    def _pop(self) -> None:
        self._asked.popleft()
        if not self._asked:
            self._frame_failed = False

    def _check_room(self) -> None:
        if self._frame_failed:
            raise FailedPreconditionError("a frame failed, and frames were sent after it; take their answers before sending "
                                          "more")
        if len(self._asked) >= _WINDOW:
            raise FailedPreconditionError(f"{_WINDOW} frames are unanswered, which is the session's window; take an answer "
                                          "before sending more")

    def _check_trial(self, method: str) -> None:
        if not self._may_commit or (not self._asked and self._trial is None):
            raise FailedPreconditionError(only_with_trial(method))

    def _told(self, error: WarmfrontError, number: int, timeout: Optional[float]) -> WarmfrontError:
        if self.failed is not None and isinstance(error, CancelledError):
            return self.failed  # closed by another thread
        if isinstance(error, DeadlineExceededError) and timeout is not None:
            return DeadlineExceededError(too_late(number, timeout))
        return error

    def _read(self, number: int, motion: Motion) -> tuple[Optional[npt.NDArray[Any]], Any, Moved]:
        """What the engine is given."""
        if motion.parts is not None:
            given = dict(motion.parts)
            bodies, posed = (tuple(np.frombuffer(given.get(part, b""), "<u4").tolist()) for part in (_frame.BODIES, _frame.POSE_BODIES))
            parts = [(part, [data]) for part, data in motion.parts if len(data) > 0]
            return None, parts, Moved(False, bodies, posed, self._matrices(given.get(_frame.POSES, b"")))
        try:
            array, parts = self._state.read(motion.positions, motion.bodies or {}, motion.poses or {}, motion.vertices,
                                            motion.vertex_positions)
        except WarmfrontError as error:
            self._may_commit = False  # as after any question that fails
            raise type(error)(f"frame {number}: {error.message}") from None
        if array is not None:
            return array, None, ALL
        if not parts:
            return None, None, NOTHING
        matrices = self._matrices(b"".join(b"".join(pieces) for part, pieces in parts if part == _frame.POSES))
        return None, parts, Moved(False, tuple(motion.bodies or ()), tuple(motion.poses or ()), matrices)

    def _matrices(self, poses: Any) -> npt.NDArray[np.float64]:
        """(k, 3, 4), of the bytes that travel."""
        return np.frombuffer(poses, self._state.dtype).reshape(-1, 3, 4).astype(np.float64)

    def _kept(self, question: Question) -> _engine.Question:
        """The question as the engine takes it."""
        asked = self._questions.get(question.content)
        if asked is None:
            asked = _engine.Question(step_pb2.Question.FromString(question.content))
            if len(self._questions) >= _KEPT_QUESTIONS:
                self._questions.clear()
            self._questions[question.content] = asked
        return asked

    def _counting(self, number: int, moved: Optional[Moved], fraction: float) -> Callable[[], None]:
        """What it makes of the state that this frame counts, of which so much was taken."""
        state, steps, poses = self._state, self._steps + 1, self._state.poses

        def then() -> None:
            if moved is not None and fraction > 0 and poses:
                state.poses = state.poses_after(poses, moved.whole, moved.bodies, moved.posed, moved.matrices, fraction)
            self._frame, self._steps, self._trial = number, steps, None
            self._may_commit = bool(self._asked) and self._may_commit
        return then

    def _answered(self, answer: _engine.Answer, question: Question, number: int) -> Answer:
        topology = self._state.topology()
        if question.by_vertex:
            return VertexDistances(number, answer.distances(), answer.vf, answer.ee, answer.possible,
                                   statistics_of(answer.statistics), answer.vh)
        worlds, tois = answer.worlds() if answer.has_worlds() else (None, None)
        contacts = Contacts(number, *answer.columns(), answer, topology, worlds, tois)
        if question.kind == "intersections":
            return intersections_of(contacts, answer)
        return max_step_of(contacts, answer) if question.kind == "max_step" else contacts

    @staticmethod
    def _committed(answer: _engine.Answer, fraction: float, number: int) -> Committed:
        vf, ee, possible, earliest_toi, vh = answer.commit()
        return Committed(fraction, vf, ee, possible, earliest_toi, number, vh)

    # Changes.

    def change(self, make: Callable[[SceneState], SceneChange]) -> None:
        engine = self._changing()
        change = make(self._state)
        message = change.encode(self._state)
        draft, failed = drafted(change, self._state)
        self._change(engine, [message], draft, None)
        if failed is not None:
            raise failed

    def change_all(self, changes: ChangesInOne) -> None:
        self._change(self._changing(), changes.messages, changes.state, changes.options)

    def _change(self, engine: _engine.Session, messages: list[Any], draft: SceneState, options: Optional[Options]) -> None:
        header = session_pb2.SessionHeader()
        if options is not None:
            options.put_into(header.options)
        before = engine.changes

        def then() -> None:
            draft.forget_rows()
            self._state.become(draft)
            self.options = options or self.options
        self._under_way.begin(lambda: engine.changes > before, then)
        try:
            engine.change(messages, None if options is None else header.options)
        except WarmfrontError as error:
            raise self._told(error, 0, None) from None
        self._under_way.settle()

    def change_options(self, options: Options) -> None:
        check_options(options)
        engine = self._changing()
        header = session_pb2.SessionHeader()
        options.put_into(header.options)
        before = engine.changes
        self._under_way.begin(lambda: engine.changes > before, lambda: setattr(self, "options", options))
        try:
            engine.change_options(header.options)
        except WarmfrontError as error:
            raise self._told(error, 0, None) from None
        self._under_way.settle()

    def _changing(self) -> _engine.Session:
        """From here on there is no trial to commit, whether or not the change is carried out."""
        self._under_way.settle()
        if self._asked:
            raise FailedPreconditionError("frames are unanswered; take their answers before changing the scene")
        self._trial = None
        self._may_commit = False
        return self._open()
