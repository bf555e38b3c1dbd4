# SPDX-License-Identifier: Apache-2.0
"""What is under way when an interrupt comes."""
from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Optional


class UnderWay:
    """An interrupt, a signal whose handler raises, may come at any instruction: also right after the engine or the daemon has carried
    out what it was asked. What that makes of the state that is kept here is done then before anything else is asked, and before the
    thread that was interrupted is told of the state. By whoever has the session's turn, but for `look()`, which any thread may call."""

    def __init__(self) -> None:
        self._what: Optional[tuple[int, Callable[[], bool], Callable[[], None]]] = None

    def begin(self, happened: Callable[[], bool], then: Callable[[], None]) -> None:
        """Before it is asked. happened: was it carried out? then: what that makes of the state; may be done again from its start."""
        self._what = threading.get_ident(), happened, then

    def settle(self) -> None:
        """Nothing is under way any more, and the state says what was carried out."""
        if self._what is None:
            return
        _, happened, then = self._what
        if happened():
            then()
        self._what = None

    def look(self) -> None:
        """Before the state is told. What another thread has under way is that one's."""
        what = self._what
        if what is not None and what[0] == threading.get_ident() and what[1]():
            what[2]()
