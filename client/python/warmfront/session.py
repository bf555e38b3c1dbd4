# SPDX-License-Identifier: Apache-2.0
"""A session: a scene that is stepped frame by frame and survives its daemon.

Different sessions are independent. Calls of one session take turns: one that waits for its daemon holds up those of other
threads, `close()` apart. What is submitted and not yet answered belongs together: leave it to one thread.
"""
from __future__ import annotations

import asyncio
import logging
import threading
import time
import uuid
import warnings
from collections.abc import Callable, Collection, Mapping, Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from types import TracebackType
from typing import Any, Optional, Union

import numpy as np
import numpy.typing as npt

from ._background import Background
from ._exchange import Answer, Exchange
from ._frame import Part, Request, SentCommit, SentFrame
from ._question import Question, QuestionKind, Where, distance_of, fraction_of, question_of
from ._resume import Link, TimeUp
from .answer import Committed, Contacts, Intersections, MaxStep, VertexDistances
from .errors import (AbortedError, DeadlineExceededError, FailedPreconditionError, InvalidArgumentError, UnimplementedError,
                     WarmfrontError, may_resume)
from .info import SessionInfo
from .options import ContactField, Options, Report, Tier
from .scene import Body, PairFilters, filters_of
from .v1 import session_pb2

_log = logging.getLogger("warmfront")


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


class Session:
    """Created by `Client.session()`.

    It is one warm state and many questions: `step()` moves it along a motion and tells the contacts; `trial()` and
    `max_step()` tell what a motion would meet, and how far it may go, and leave it where it is; `commit()` moves it along the
    last of these; `proximity()` tells what is near, `intersections()` what is tangled. They wait; `submit()` and `next_answer()` have several on the way; `submit_trial()` and its like are futures,
    `trial_async()` and its like are for asyncio.

    It keeps the scene, the positions last answered and what is unanswered, so that it can be created again: when the
    daemon dies, restarts, drains or forgets it, the session goes on there, or at whatever daemon the address leads to by
    then, with exactly one answer to each frame, in order and of the same bits. A copy that a daemon still has is gone on
    with where it is in this session's own state, which the daemon states; another, and that of a daemon too old to state it,
    is deleted and made again. A limit that is met on the way, and that others fill, is waited for within `Timeouts.resume`.
    Steps, commits and changes are carried out once; a trial changes nothing and may be asked again. An `UnavailableError`,
    `AbortedError` or `InternalError` ends the session: every further call raises it again.
    """

    def __init__(self, link: Link) -> None:
        """Internal: use `Client.session()`."""
        self._link = link
        self._exchange = Exchange(link)
        self._background = Background()
        # Whose call waits for the daemon: another thread's, the background's too, comes after it.
        self._turn = threading.RLock()

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

    def step(
        self,
        positions: Any = None,
        *,
        bodies: Optional[Mapping[int, Any]] = None,
        poses: Optional[Mapping[int, Any]] = None,
        vertices: Any = None,
        vertex_positions: Any = None,
        tier: Optional[Tier] = None,
        tolerance: Optional[float] = None,
        min_separation: Optional[float] = None,
        report: Optional[Report] = None,
        fields: Optional[Collection[ContactField]] = None,
        max_contacts: Optional[int] = None,
        timeout: Optional[float] = None,
    ) -> Contacts:
        """The contacts of the linear motion from where the session is to this frame, to whose end it moves.

        Either all positions, (n, 3), scene length unit; or what moved, in any mixture, and the rest rests: bodies {body:
        (vertices of the body, 3)}; poses {rigid body: (3, 4) matrix [R t]} of its rest shape (the positions last given of
        it), sent in the session's dtype; vertices (k) of deformable bodies, each once, and vertex_positions (k, 3). Arrays are
        whatever numpy or DLPack reads without the GPU, of any numbers that the session's dtype holds exactly; they are copied
        once.

        tier, tolerance, min_separation, report, fields, max_contacts: of this question alone, see `Options`; None for what
        the session has.

        timeout: seconds; None for `Timeouts.answer`, after which the session is resumed. DeadlineExceededError when there is
        no answer by then: the frame does not count, and the session is where it was. So it is after a KeyboardInterrupt.

        InvalidArgumentError where something does not fit the scene, ResourceExhaustedError beyond a limit: the frame does not
        count. FailedPreconditionError while answers to what was submitted were not taken.

        A frame is the end of a motion: a body that is put elsewhere (reset, respawned) is tested along the straight way there,
        and meets what lies on it. `place()` puts it there without a motion.
        """
        question = question_of("step", tier=tier, tolerance=tolerance, min_separation=min_separation, report=report,
                               fields=fields, max_contacts=max_contacts)
        answer = self._ask(Motion(positions, bodies, poses, vertices, vertex_positions), question, timeout)
        assert isinstance(answer, Contacts)
        return answer

    def place(
        self,
        positions: Any = None,
        *,
        bodies: Optional[Mapping[int, Any]] = None,
        poses: Optional[Mapping[int, Any]] = None,
        vertices: Any = None,
        vertex_positions: Any = None,
        timeout: Optional[float] = None,
    ) -> None:
        """Puts what is given where it is given, without a motion: nothing is tested between before and after. For resets and
        teleports. It is the session's next frame, and what is asked next is about the new state. Arguments, errors and timeout
        as in `step()`; InvalidArgumentError from a daemon that is older."""
        self._ask(Motion(positions, bodies, poses, vertices, vertex_positions), question_of("place"), timeout)

    def trial(
        self,
        positions: Any = None,
        *,
        bodies: Optional[Mapping[int, Any]] = None,
        poses: Optional[Mapping[int, Any]] = None,
        vertices: Any = None,
        vertex_positions: Any = None,
        tier: Optional[Tier] = None,
        tolerance: Optional[float] = None,
        min_separation: Optional[float] = None,
        report: Optional[Report] = None,
        fields: Optional[Collection[ContactField]] = None,
        max_contacts: Optional[int] = None,
        timeout: Optional[float] = None,
    ) -> Contacts:
        """What would this motion meet? As `step()` in arguments, answer and errors, but the session stays where it is: ask as
        often as you like. `commit()` takes the last one. What is thick meets as soon as it is within the thickness of both,
        besides the separation."""
        question = question_of("trial", tier=tier, tolerance=tolerance, min_separation=min_separation, report=report,
                               fields=fields, max_contacts=max_contacts)
        answer = self._ask(Motion(positions, bodies, poses, vertices, vertex_positions), question, timeout)
        assert isinstance(answer, Contacts)
        return answer

    def max_step(
        self,
        positions: Any = None,
        *,
        bodies: Optional[Mapping[int, Any]] = None,
        poses: Optional[Mapping[int, Any]] = None,
        vertices: Any = None,
        vertex_positions: Any = None,
        leave_out_overlaps: bool = False,
        keep_distance: Optional[float] = None,
        tier: Optional[Tier] = None,
        tolerance: Optional[float] = None,
        min_separation: Optional[float] = None,
        max_contacts: Optional[int] = None,
        timeout: Optional[float] = None,
    ) -> MaxStep:
        """How far may this motion go before anything touches, or comes within the separation, plus the thickness of both? A
        trial that tells the first contact alone; it may be committed as one.

        leave_out_overlaps: what is not apart at the start does not count, only how much of it there is; else the answer is 0
        where there is any.

        keep_distance: s in (0, 1), how far may it go before any pair comes nearer than s times its own distance at the start?
        With a min_separation m, nearer than m + s (d - m) where it starts d apart; pairs that start within m are as without.
        Not in tier "fast".

        Everything else as in `trial()`.
        """
        question = question_of("max_step", tier=tier, tolerance=tolerance, min_separation=min_separation,
                               max_contacts=max_contacts, leave_out_overlaps=leave_out_overlaps,
                               keep_distance=keep_distance)
        answer = self._ask(Motion(positions, bodies, poses, vertices, vertex_positions), question, timeout)
        assert isinstance(answer, MaxStep)
        return answer

    def proximity(
        self,
        distance: float,
        *,
        where: Where = "base",
        tier: Optional[Tier] = None,
        report: Optional[Report] = None,
        fields: Optional[Collection[ContactField]] = None,
        max_contacts: Optional[int] = None,
        reduced: bool = False,
        timeout: Optional[float] = None,
    ) -> Contacts:
        """All pairs of features (`Kind`) without a common vertex that are within a distance (scene length unit), plus the
        thickness of both, of each other, where the session is or, with where="trial_end", at the end of the last trial or
        max_step: of its whole motion, however far it may go.

        Tier "exact" decides the distance exactly; "certified" (and "fast", which counts as it) misses none, and may tell pairs
        up to 2^-19 of their size beyond the distance (status POSSIBLE). The columns are those of a step; the useful fields are
        "squared_distance", "weights", "direction" and "closest". report: "all" or "count"; `vertex_distances()` lists no pair.

        reduced: list each closest pair once, as barriers are summed: of all rows with the same two vertices, or the same edge
        and vertex, closest, the first, with the columns multiplicity (k) uint32, how many they are, and stencil (k) uint8;
        `Contacts.stencils()` gives their vertices by kind. vf, ee and possible count all rows, and so does max_contacts. Nearly
        parallel edges a and b (|a x b|^2 < 10^-3 |a|^2 |b|^2) keep a row of their own, since barriers of such a pair are
        multiplied by a mollifier of its own (Li et al. 2020, "Incremental Potential Contact"). UnimplementedError from a
        daemon that is older.

        The session stays where it is, and `commit()` still takes the last trial. Errors and timeout as in `trial()`;
        FailedPreconditionError for the end of a trial that there is not.
        """
        if report == "vertex-distances":
            raise InvalidArgumentError("report: it has no contacts; ask vertex_distances()")
        question = question_of("proximity", tier=tier, min_separation=distance_of(distance), report=report, fields=fields,
                               max_contacts=max_contacts, where=where, reduced=reduced)
        answer = self._ask(Motion(), question, timeout)
        assert isinstance(answer, Contacts)
        return answer

    def vertex_distances(
        self,
        distance: float,
        *,
        where: Where = "base",
        tier: Optional[Tier] = None,
        timeout: Optional[float] = None,
    ) -> VertexDistances:
        """How far each vertex is from anything: (n) float64, the least distance of any pair of features that it is
        in, less the thickness of both, capped at `distance` (scene length unit). Lower bounds, proved in every tier, within
        2^-19 of the pair's size of its distance: where no vertex is displaced by half of its own or more, nothing meets. Takes
        memory for n numbers, however many pairs are near.

        Everything else as in `proximity()`.
        """
        question = question_of("proximity", tier=tier, min_separation=distance_of(distance), report="vertex-distances",
                               where=where)
        answer = self._ask(Motion(), question, timeout)
        assert isinstance(answer, VertexDistances)
        return answer

    def intersections(
        self,
        *,
        where: Where = "base",
        report: Optional[Report] = None,
        max_contacts: Optional[int] = None,
        timeout: Optional[float] = None,
    ) -> Intersections:
        """All edges and faces without a common vertex that meet where the session is or, with where="trial_end", at the end of
        the last trial or max_step: of the triangles themselves, however thick, by exact arithmetic, coplanar and degenerate
        ones included.

        report: "all", "count", or "any", which ends at the first. Neighbours that fold onto each other along a common edge
        have no such pair. What bodies and filters leave out is left out here, too: `change_filters(None)` before asking whether
        a mesh is tangled at all. Else as `proximity()`.
        """
        question = question_of("intersections", report=report, max_contacts=max_contacts, where=where)
        answer = self._ask(Motion(), question, timeout)
        assert isinstance(answer, Intersections)
        return answer

    def commit(self, fraction: float = 1.0, *, timeout: Optional[float] = None) -> Committed:
        """Moves the session along the last trial (or max_step), up to a fraction of its way in [0, 1]: to X + fraction * (Y -
        X) in float64, each operation rounded once, then rounded to the session's dtype, where X is where each vertex was, or
        number of a pose, and Y where the trial had it go; to Y itself for 1. Nothing is tested again, and no positions travel.

        InvalidArgumentError for another fraction. FailedPreconditionError without a trial since the last step, place, commit
        or change of the scene, where a later trial failed, and while answers are outstanding. timeout: as in `step()`.
        """
        answer = self._ask(None, question_of("step"), timeout, fraction_of(fraction))
        assert isinstance(answer, Committed)
        return answer

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

    # The same in the background. Arrays that are given have to stay as they are until the answer is there.

    def submit_step(self, positions: Any = None, **arguments: Any) -> Future[Contacts]:
        """`step()` as a future. What is submitted this way is carried out in its order, one after the other, on a thread of
        the session's own; calls of the session that wait meanwhile have their turn in between. A call that has begun goes on
        when its future is cancelled: give a timeout."""
        return self._background.submit(self.step, positions, **arguments)

    def submit_place(self, positions: Any = None, **arguments: Any) -> Future[None]:
        """`place()` as a future, see `submit_step()`."""
        return self._background.submit(self.place, positions, **arguments)

    def submit_trial(self, positions: Any = None, **arguments: Any) -> Future[Contacts]:
        """`trial()` as a future, see `submit_step()`."""
        return self._background.submit(self.trial, positions, **arguments)

    def submit_max_step(self, positions: Any = None, **arguments: Any) -> Future[MaxStep]:
        """`max_step()` as a future, see `submit_step()`."""
        return self._background.submit(self.max_step, positions, **arguments)

    def submit_proximity(self, distance: float, **arguments: Any) -> Future[Contacts]:
        """`proximity()` as a future, see `submit_step()`."""
        return self._background.submit(self.proximity, distance, **arguments)

    def submit_vertex_distances(self, distance: float, **arguments: Any) -> Future[VertexDistances]:
        """`vertex_distances()` as a future, see `submit_step()`."""
        return self._background.submit(self.vertex_distances, distance, **arguments)

    def submit_intersections(self, **arguments: Any) -> Future[Intersections]:
        """`intersections()` as a future, see `submit_step()`."""
        return self._background.submit(self.intersections, **arguments)

    def submit_commit(self, fraction: float = 1.0, **arguments: Any) -> Future[Committed]:
        """`commit()` as a future, see `submit_step()`."""
        return self._background.submit(self.commit, fraction, **arguments)

    async def step_async(self, positions: Any = None, **arguments: Any) -> Contacts:
        """`step()` for asyncio, see `submit_step()`."""
        return await asyncio.wrap_future(self.submit_step(positions, **arguments))

    async def place_async(self, positions: Any = None, **arguments: Any) -> None:
        """`place()` for asyncio, see `submit_step()`."""
        await asyncio.wrap_future(self.submit_place(positions, **arguments))

    async def trial_async(self, positions: Any = None, **arguments: Any) -> Contacts:
        """`trial()` for asyncio, see `submit_step()`."""
        return await asyncio.wrap_future(self.submit_trial(positions, **arguments))

    async def max_step_async(self, positions: Any = None, **arguments: Any) -> MaxStep:
        """`max_step()` for asyncio, see `submit_step()`."""
        return await asyncio.wrap_future(self.submit_max_step(positions, **arguments))

    async def proximity_async(self, distance: float, **arguments: Any) -> Contacts:
        """`proximity()` for asyncio, see `submit_step()`."""
        return await asyncio.wrap_future(self.submit_proximity(distance, **arguments))

    async def vertex_distances_async(self, distance: float, **arguments: Any) -> VertexDistances:
        """`vertex_distances()` for asyncio, see `submit_step()`."""
        return await asyncio.wrap_future(self.submit_vertex_distances(distance, **arguments))

    async def intersections_async(self, **arguments: Any) -> Intersections:
        """`intersections()` for asyncio, see `submit_step()`."""
        return await asyncio.wrap_future(self.submit_intersections(**arguments))

    async def commit_async(self, fraction: float = 1.0, **arguments: Any) -> Committed:
        """`commit()` for asyncio, see `submit_step()`."""
        return await asyncio.wrap_future(self.submit_commit(fraction, **arguments))

    def add_body(self, body: Body, faces: Any, positions: Any, edges: Any = None) -> int:
        """Adds a stationary body and returns its index, the previous number of bodies; its vertices, faces and
        edges come after all others. faces (m, 3) and edges (k, 2), as in `Client.session()`, number its own vertices from 0;
        positions (vertex_count, 3) of the session's dtype. Of a
        half-space, which has none of these, give None.

        FailedPreconditionError while frames are unanswered, or in a session that declared no bodies.
        """
        with self._turn:
            state = self._alive().state
            index = len(state.bodies)

            def encode() -> session_pb2.SceneChange:
                change = state.encode_addition(body, faces, positions, edges)
                self._need_features(change.add.body)
                if change.add.edges:
                    self._need(session_pb2.FEATURE_EDGES)
                if change.add.body.HasField("half_space"):
                    self._need(session_pb2.FEATURE_HALF_SPACES)
                return change

            self._change(encode, lambda: state.take_addition(body, faces, positions, edges))
            return index

    def change_body(self, index: int, body: Body) -> None:
        """Describes a body differently, from the next step on; its range stays, whatever `body` says. "removed" takes it out
        for good. One that becomes rigid takes where it is for its rest shape. A half-space stays one; if its point, normal or
        kind changes, it is where its description says from then on, without a motion.

        FailedPreconditionError while frames are unanswered; InvalidArgumentError for an unknown or removed body.
        """
        with self._turn:
            state = self._alive().state

            def encode() -> session_pb2.SceneChange:
                change = state.encode_change(index, body)
                self._need_features(change.change.body)
                return change

            self._change(encode, lambda: state.take_change(index, body))

    def replace_elements(self, index: int, faces: Any, edges: Any = None) -> None:
        """Other faces (m, 3) and edges (k, 2), which number its own vertices from 0, for the same vertices of a body, which stay
        where they are: what is cut, torn, or has edges flipped. Index 0 of a session that declared no bodies is all of it.

        Vertices, faces and edges then have the numbers of a session that is created with the bodies that there are, in
        their order: each body's come after those of the bodies before it. What is answered since is what such a session would
        answer, to the bit. FailedPreconditionError while frames are unanswered; InvalidArgumentError for an unknown or removed
        body, and indices out of range; UnimplementedError where the daemon is older than this.
        """
        with self._turn:
            state = self._alive().state

            def encode() -> session_pb2.SceneChange:
                change = state.encode_elements(index, faces, edges)
                self._need(session_pb2.FEATURE_REPLACE)
                return change

            self._change(encode, lambda: state.take_elements(index, faces, edges))

    def replace_body(self, index: int, positions: Any, faces: Any = None, edges: Any = None, thickness: Any = None,
                     body: Optional[Body] = None) -> None:
        """Another body with this index, at rest at `positions` (k, 3), of the session's dtype: remeshed, refined, or in place of
        one that was removed. Faces and edges as in `add_body()`; thickness (k), of each vertex. Without `body` the description
        stays. `body=Body(vertex_count=0, kind="removed")` with positions of shape (0, 3) removes it and frees what it took.

        Numbers change, and errors are raised, as `replace_elements()` says; also FailedPreconditionError where filters name
        pairs of its vertices (change the filters first), where these have a thickness of their own and none is given (zeros for
        none), and in a session that declared no bodies.
        """
        with self._turn:
            state = self._alive().state
            other = Body(vertex_count=0)

            def encode() -> session_pb2.SceneChange:
                nonlocal other
                other = state.replacing(index, positions, body)
                change = state.encode_replacement(index, other, faces, positions, edges, thickness)
                self._need(session_pb2.FEATURE_REPLACE)
                to = getattr(change.replace_body, "with")
                self._need_features(to.body)
                if to.edges:
                    self._need(session_pb2.FEATURE_EDGES)
                return change

            self._change(encode, lambda: state.take_replacement(index, other, faces, positions, edges, thickness))

    def _need_features(self, body: session_pb2.Body) -> None:
        if body.thickness != 0:
            self._need(session_pb2.FEATURE_THICKNESS)
        if body.world != 0:
            self._need(session_pb2.FEATURE_WORLDS)

    def _need(self, feature: session_pb2.Feature) -> None:
        """UnimplementedError where the daemon lacks the feature. One that is lost the change finds out, too."""
        try:
            self._alive().connection.need([feature], self.id)
        except UnimplementedError:
            raise
        except WarmfrontError:
            pass

    def change_filters(self, filters: Union[PairFilters, Mapping[str, Any], None]) -> None:
        """Leaves out other pairs of features, from the next question on, in place of all that were left out: `PairFilters`,
        or a dict of its fields, of all vertices that there are; None: none are. Their rest shape has to be given here.

        FailedPreconditionError while frames are unanswered; UnimplementedError where the daemon is older than filters.
        """
        with self._turn:
            link = self._alive()
            other = PairFilters()

            def encode() -> session_pb2.SceneChange:
                nonlocal other
                other = filters_of(filters).copied(link.state.vertex_count)
                if other.given:
                    self._need(session_pb2.FEATURE_PAIR_FILTERS)
                return link.state.encode_filters(other)

            self._change(encode, lambda: link.state.take_filters(other))

    def change_excluded_pairs(self, pairs: Sequence[tuple[int, int]]) -> None:
        """Does not test other pairs of bodies (indices) against each other, from the next question on, in place of all that were
        left out: `[]` for none.

        FailedPreconditionError while frames are unanswered; InvalidArgumentError for a body that there is not, or with itself;
        UnimplementedError where the daemon is older than this.
        """
        with self._turn:
            state = self._alive().state
            other = list(pairs)

            def encode() -> session_pb2.SceneChange:
                change = state.encode_excluded_pairs(other)
                self._need(session_pb2.FEATURE_OPTION_CHANGES)
                return change

            self._change(encode, lambda: state.take_excluded_pairs(other))

    @property
    def options(self) -> Options:
        """As given when the session was created or its options were changed; None where the daemon's default is taken.
        `info().options` has the values in force."""
        return self._link.options

    def change_options(self, options: Options) -> None:
        """Other options from the next question on, in place of all that were given: `change_options(dataclasses.replace(
        session.options, tier="exact"))` changes one. `front`, `lazy_front`, `find_rigid`, `separate_parts`, `rebuild_...` and
        `max_front_bytes` make the next step a cold one; all others cost nothing by themselves.

        FailedPreconditionError while frames are unanswered; InvalidArgumentError for what the daemon does not take, and where
        `bounds`, `find_bodies`, `leaf_size`, `normal_cones` or `explain`, which are fixed when the session is created, differ;
        UnimplementedError where the daemon is older than this.
        """
        with self._turn:
            link = self._alive()
            request = session_pb2.ChangeSceneRequest()

            def make() -> session_pb2.ChangeSceneRequest:
                request.options.SetInParent()
                options.put_into(request.options)
                self._need(session_pb2.FEATURE_OPTION_CHANGES)
                return request

            def taken() -> None:
                link.options = options
                link.header.options.CopyFrom(request.options)

            self._request_change(make, taken)

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

    def _change(self, change: Callable[[], session_pb2.SceneChange], taken: Callable[[], None]) -> None:
        self._request_change(lambda: session_pb2.ChangeSceneRequest(changes=[change()]), taken)

    def _request_change(self, make: Callable[[], session_pb2.ChangeSceneRequest], taken: Callable[[], None]) -> None:
        """Has the daemon carry out changes, after which `taken` holds. When the daemon is lost on the way, the session is
        resumed as it was before the changes, which are sent again: they are carried out once."""
        link = self._link
        if link.unanswered:
            raise FailedPreconditionError("frames are unanswered; take their answers before changing the scene")
        # Whether or not the change is carried out.
        link.trial = None
        link.may_commit = False
        request = make()
        request.session_id, request.next_frame, request.key = self.id, self.last_frame + 1, str(uuid.uuid4())
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
                    error = AbortedError(error.message, reason="STATE_CHANGED")
                if error.retry_after is not None or not may_resume(error):
                    raise
                lost = error
            link.resume(lost)
