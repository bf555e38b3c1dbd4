# SPDX-License-Identifier: Apache-2.0
"""Where a session's questions are computed, as its calls see it: behind a daemon (_remote.py) or in this process (_local.py).
Used by one thread at a time, but for `close()`."""
from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence, Sized
from dataclasses import dataclass
from typing import Any, Optional, Protocol, Union

import numpy as np
import numpy.typing as npt

from ._frame import Part
from ._question import Question
from ._scene_changes import ChangesInOne, SceneChange
from ._state import SceneState
from .answer import Committed, Contacts, Intersections, MaxStep, VertexDistances
from .errors import InvalidArgumentError, WarmfrontError
from .info import SessionInfo
from .options import Options

Answer = Union[Contacts, MaxStep, Committed, Intersections, VertexDistances]


@dataclass(frozen=True, eq=False)
class Motion:
    """Where a frame has what go, as `AnySession.step()` takes it."""

    positions: Any = ...  # left out: nothing moves, or what is given otherwise
    bodies: Optional[Mapping[int, Any]] = None
    poses: Optional[Mapping[int, Any]] = None
    vertices: Any = None
    vertex_positions: Any = None
    parts: Optional[Sequence[Part]] = None  # instead: what moved as it travels, checked by who made it

    def __post_init__(self) -> None:
        for name in ("bodies", "poses"):
            given = getattr(self, name)
            if given is not None and not isinstance(given, Mapping):
                raise InvalidArgumentError(f"{name}: a {type(given).__name__}; give a dict, from the number of each body that moves")
        if self.positions is ...:
            object.__setattr__(self, "positions", None)
        elif self.positions is None and not self.bodies and not self.poses and self.vertices is None and \
                self.vertex_positions is None and self.parts is None:  # what a function returns that forgets to
            raise InvalidArgumentError("positions: None; give an array, or leave it out for a frame in which nothing moves")

    @property
    def empty(self) -> bool:
        return self.parts is None and all(part is None for part in (self.positions, self.bodies, self.poses, self.vertices,
                                                                    self.vertex_positions))


class Backend(Protocol):
    """All that fails raises a `WarmfrontError`, and leaves the session where it was."""

    failed: Optional[WarmfrontError]  # for good, or closed
    options: Options  # as given

    @property
    def state(self) -> SceneState:
        """The scene, to number what is told of it."""

    @property
    def session_id(self) -> str: ...

    @property
    def window(self) -> int:
        """Most questions that may be unanswered at once."""

    @property
    def last_frame(self) -> int: ...

    @property
    def unanswered(self) -> Sized:
        """What was submitted, and whose answer was not taken."""

    def submit(self, motion: Optional[Motion], question: Question, fraction: float) -> int:
        """Asks without waiting, and returns the frame's number. Without a motion: a commit."""

    def next_answer(self) -> Answer:
        """To the oldest of what was submitted, of which there is some."""

    def ask(self, motion: Optional[Motion], question: Question, timeout: Optional[float], fraction: float) -> Answer:
        """Asks, nothing else being unanswered, and waits."""

    def change(self, make: Callable[[SceneState], SceneChange]) -> None:
        """Carries a change of the scene out."""

    def change_all(self, changes: ChangesInOne) -> None:
        """Carries all of them out, or none."""

    def change_options(self, options: Options) -> None: ...

    def positions(self) -> npt.NDArray[Any]:
        """(n, 3) of the session's dtype, a copy."""

    def info(self) -> SessionInfo: ...

    def close(self) -> None:
        """From any thread; `failed` is set by then. What waits is stopped."""

    def release(self) -> None:
        """In place of close(), of a session that was lost: what was opened for it alone ends."""


def only_with_trial(method: str) -> str:
    """Why a commit, or a question about a trial's end, is refused where there is none."""
    return (f"{method}: there is no trial to take since the last step, place, commit, failure or change of the scene or its options; "
            "ask for a trial() or max_step() first")


def too_late(number: int, timeout: float) -> str:
    """Why a question was given up."""
    return f"frame {number}: no answer within {timeout:g} s; it does not count, and the session is where it was"


