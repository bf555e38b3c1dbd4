# SPDX-License-Identifier: Apache-2.0
"""How a session's scene and options are changed between two frames. Thread-safe, as `Session` says."""
from __future__ import annotations

import abc
import contextlib
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Optional, Union

from ._asking import Asking
from ._scene_changes import (ChangeBody, ChangeExcludedPairs, ChangeFilters, ChangesInOne, PutBody, ReplaceElements,
                             SceneChange)
from ._state import SceneState, pairs_of
from .errors import FailedPreconditionError
from .options import Options, check_options
from .scene import Body, PairFilters, body_of, filters_of


class _Changing(abc.ABC):
    """What can be changed, one at a time or together with others."""

    _turn: threading.RLock

    @abc.abstractmethod
    def _scene(self) -> SceneState:
        """That the next change is of."""

    @abc.abstractmethod
    def _change(self, make: Callable[[SceneState], SceneChange]) -> None:
        """Has the change carried out, or done so later."""

    @abc.abstractmethod
    def change_options(self, options: Options) -> None: ...

    def add_body(self, body: Body, faces: Any, positions: Any, edges: Any = None, thickness: Any = None) -> int:
        """Adds a stationary body and returns its index, the previous number of bodies; its vertices, faces and
        edges come after all others. faces (m, 3) and edges (k, 2), as in `Client.session()`, number its own vertices from 0;
        positions (vertex_count, 3) of the session's dtype; thickness (vertex_count), or one number, besides the body's. Of a
        half-space, which has none of these, give None.

        FailedPreconditionError while frames are unanswered, or in a session that declared no bodies; UnimplementedError where the
        daemon is older than thickness of vertices that are added.
        """
        with self._turn:
            index = len(self._scene().bodies)
            self._change(lambda state: PutBody.added(state, body_of(body), faces, positions, edges, thickness))
            return index

    def change_body(self, index: int, body: Body) -> None:
        """Describes a body differently, from the next step on; its range stays, whatever `body` says. "removed" takes it out,
        and only `replace_body()` puts one in its place (none in a half-space's). One that becomes rigid takes where it is for
        its rest shape. A half-space stays one; if its point, normal or kind changes, it is where its description says from then
        on, without a motion.

        FailedPreconditionError while frames are unanswered; InvalidArgumentError for an unknown or removed body.
        """
        with self._turn:
            self._change(lambda state: ChangeBody(index, body_of(body)))

    def replace_elements(self, index: int, faces: Any, edges: Any = None) -> None:
        """Other faces (m, 3) and edges (k, 2), which number its own vertices from 0, for the same vertices of a body, which stay
        where they are: what is cut, torn, or has edges flipped. Index 0 of a session that declared no bodies is all of it.

        Vertices, faces and edges then have the numbers of a session that is created with the bodies that there are, in
        their order: each body's come after those of the bodies before it. What is answered since is what such a session would
        answer, to the bit. FailedPreconditionError while frames are unanswered; InvalidArgumentError for an unknown or removed
        body, and indices out of range; UnimplementedError where the daemon is older than this.
        """
        with self._turn:
            self._change(lambda state: ReplaceElements(index, faces, edges))

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
            given = None if body is None else body_of(body)
            self._change(lambda state: PutBody.in_place_of(state, index, given, faces, positions, edges, thickness))

    def change_filters(self, filters: Union[PairFilters, Mapping[str, Any], None]) -> None:
        """Leaves out other pairs of features, from the next question on, in place of all that were left out: `PairFilters`,
        or a dict of its fields, of all vertices that there are; None: none are. Their rest shape has to be given here.

        FailedPreconditionError while frames are unanswered; UnimplementedError where the daemon is older than filters.
        """
        with self._turn:
            self._change(lambda state: ChangeFilters(filters_of(filters).copied(state.vertex_count)))

    def change_excluded_pairs(self, pairs: Sequence[tuple[int, int]]) -> None:
        """Does not test other pairs of bodies (indices) against each other, from the next question on, in place of all that were
        left out: `[]` for none.

        FailedPreconditionError while frames are unanswered; InvalidArgumentError for a body that there is not, or with itself;
        UnimplementedError where the daemon is older than this.
        """
        with self._turn:
            self._change(lambda state: ChangeExcludedPairs(pairs_of(pairs)))


class ChangeList(_Changing):
    """Changes that are carried out together when its block ends: see `Changes.changes()`."""

    def __init__(self, turn: threading.RLock, state: SceneState) -> None:
        """Internal: use `Session.changes()`."""
        self._turn = turn
        self._in_one = ChangesInOne(state)

    def change_options(self, options: Options) -> None:
        """Other options, as of `Session.change_options()`; of several the last."""
        check_options(options)
        self._in_one.options = options

    def _scene(self) -> SceneState:
        return self._in_one.state

    def _change(self, make: Callable[[SceneState], SceneChange]) -> None:
        self._in_one.add(make(self._in_one.state))


class Changes(Asking, _Changing):
    """`add_body()`, `change_options()` and their like."""

    _changed = 0  # times that a change was asked for

    @contextlib.contextmanager
    def changes(self) -> Iterator[ChangeList]:
        """Changes that are carried out together, all or none, when the block ends, and as one, so that what costs O(scene) is paid
        once; not at all if it raises. Each is of the scene that those before it make:

            with session.changes() as change:
                change.change_filters(None)
                change.replace_elements(0, F0)
                number = change.add_body(Body(3), [[0, 1, 2]], X)

        Raises what the changes raise, with the number of the change; FailedPreconditionError where the session went on to
        another frame, or was changed, within the block.
        """
        with self._turn:
            backend = self._alive()
            if backend.unanswered:
                raise FailedPreconditionError("frames are unanswered; take their answers before changing the scene")
            listed = ChangeList(self._turn, backend.state)
            begun = (backend.last_frame, self._changed)
        yield listed
        with self._turn:
            backend = self._alive()
            if (backend.last_frame, self._changed) != begun:
                raise FailedPreconditionError("the session has gone on since changes() began; list the changes between two frames")
            self._changed += 1
            in_one = listed._in_one
            if in_one.messages:
                backend.change_all(in_one)
            elif in_one.options is not None:
                backend.change_options(in_one.options)

    @property
    def options(self) -> Options:
        """As given when the session was created or its options were changed; None where the daemon's default is taken.
        `info().options` has the values in force."""
        return self._backend.options

    def change_options(self, options: Options) -> None:
        """Other options from the next question on, in place of all that were given: `change_options(dataclasses.replace(
        session.options, tier="exact"))` changes one. `front`, `lazy_front`, `find_rigid`, `separate_parts`, `rebuild_...` and
        `max_front_bytes` make the next step a cold one; all others cost nothing by themselves.

        FailedPreconditionError while frames are unanswered; InvalidArgumentError for what the daemon does not take, and where
        `bounds`, `find_bodies`, `leaf_size`, `normal_cones` or `explain`, which are fixed when the session is created, differ;
        UnimplementedError where the daemon is older than this.
        """
        with self._turn:
            self._changed += 1
            self._alive().change_options(options)

    def _scene(self) -> SceneState:
        return self._alive().state

    def _change(self, make: Callable[[SceneState], SceneChange]) -> None:
        self._changed += 1
        self._alive().change(make)
