# SPDX-License-Identifier: Apache-2.0
"""What is under way when an interrupt comes. Used by one thread at a time."""
from __future__ import annotations

from collections.abc import Callable
from typing import Optional


class UnderWay:
    """An interrupt, a signal whose handler raises, may come at any instruction: also right after the engine or the daemon has carried
    out what it was asked. What that makes of the state that is kept here is done then before anything else: whatever looks at the
    state calls `settle()` first."""

    def __init__(self) -> None:
        self._what: Optional[tuple[Callable[[], bool], Callable[[], None]]] = None

    def begin(self, happened: Callable[[], bool], then: Callable[[], None]) -> None:
        """Before it is asked. happened: was it carried out? then: what that makes of the state; may be done again from its start."""
        self._what = happened, then

    def settle(self) -> None:
        """Nothing is under way any more, and the state says what was carried out."""
        if self._what is None:
            return
        happened, then = self._what
        if happened():
            then()
        self._what = None
