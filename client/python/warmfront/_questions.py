# SPDX-License-Identifier: Apache-2.0
"""What a session is asked, each call waiting for its answer. Thread-safe, as `Session` says."""
from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any, Optional

from ._asking import Asking
from ._backend import Motion
from ._question import Where, distance_of, fraction_of, question_of
from .answer import Committed, Contacts, Intersections, MaxStep, VertexDistances
from .errors import InvalidArgumentError
from .options import ContactField, Report, Tier


class Questions(Asking):
    """`step()`, `trial()` and their like."""

    def step(
        self,
        positions: Any = ...,
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
        """The contacts of the motion from where the session is to this frame, to whose end it moves: along lines, or screws.

        Either all positions, (n, 3), scene length unit; or what moved, in any mixture, and the rest rests: bodies {body:
        (vertices of the body, 3)}; poses {rigid body: (3, 4) matrix [R t]} of its rest shape (the positions last given of
        it), sent in the session's dtype; vertices (k) of deformable bodies, each once, and vertex_positions (k, 3). Arrays are
        whatever numpy or DLPack reads without the GPU, of any numbers that the session's dtype holds exactly; they are copied
        once. Without any of it nothing moves.

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
        positions: Any = ...,
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
        positions: Any = ...,
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
        positions: Any = ...,
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

        Except in tier "fast", it leaves room for what a commit of part of the motion rounds, which is less than r, 2**-22 (in
        a session of float64: 2**-44) of the largest coordinate, at either end, of those of a pair's vertices that move. With m
        the separation and the thickness of both, a pair stops at m + 4 r, or, where it starts within that, at m + 2 r. So no
        commit of as much or less leaves anything within m, or takes it through anything. What starts nearer still may move
        apart, or along: the answer is 0 where any of it comes nearer at any time.

        leave_out_overlaps: what starts so near is asked about without its separation, and what touches at the start is not
        asked about: it may be taken through. It is counted in either case.

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
        number of a pose, and Y where the trial had it go; to Y itself for 1. A body of which the description says screw goes
        along that, and stays rigid. Nothing is tested again, and no positions travel: what comes nearer to each other than
        this rounds may be taken through, and no later question tells. `max_step()` leaves room for that, and a trial does not.

        InvalidArgumentError for another fraction. FailedPreconditionError without a trial since the last step, place, commit
        or change of the scene (also a refused one), where a later trial failed, and while answers are outstanding. timeout: as
        in `step()`.
        """
        answer = self._ask(None, question_of("step"), timeout, fraction_of(fraction))
        assert isinstance(answer, Committed)
        return answer
